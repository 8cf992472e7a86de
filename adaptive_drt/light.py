# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that nothing blocks, in closed form: the integral of max(0, n.w) over a light's outline.

Every function returns a geometric factor: irradiance (W / m^2) divided by the light's radiance
(by the intensity for a point).
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .emitter import DISK, POINT, QUAD, Emitter
from .vector import cross, dot

__all__ = ["cap_factor", "irradiance_factor", "polygon_factor"]

Array: TypeAlias = NDArray[np.float64]

TINY = float(np.finfo(np.float64).tiny)


def irradiance_factor(emitter: Emitter, center: Array, point: Array, normal: Array) -> Array:
    """Irradiance by an unblocked light over its radiance (over its intensity, for a point).

    Parameters
    ----------
    center : (3, ...) the light's centre.  point : (3, n) metres.  normal : (3, n) unit vectors.

    Returns
    -------
    (n,) in sr (1 / m^2 for a point), 0 where the light is below the horizon or faces away.
    """
    to = center - point
    if emitter.kind == QUAD:
        corners = [to + su * emitter.half_u + sv * emitter.half_v for su, sv in CORNERS]
        facing = dot(emitter.normal + np.zeros_like(to), to) < 0.0
        return np.where(facing, polygon_factor(corners, normal), 0.0)
    dd = dot(to, to)
    distance = np.sqrt(dd)
    cosine = dot(normal, to) / np.maximum(distance, TINY)
    if emitter.kind == POINT:
        with np.errstate(over="ignore"):  # a point on the light itself: clipped by the film
            bright: Array = np.maximum(cosine, 0.0) / np.maximum(dd, TINY)
        return bright
    r = emitter.radius
    if emitter.kind == DISK:
        return cap_factor(cosine, r / np.sqrt(dd + r * r), distance / np.sqrt(dd + r * r))
    tangent = np.sqrt(np.maximum((distance - r) * (distance + r), 0.0))
    safe = np.maximum(distance, TINY)
    outside = cap_factor(cosine, np.minimum(r / safe, 1.0), tangent / safe)
    # inside the ball its whole upper hemisphere shines
    return np.where(distance <= r, np.pi, outside)


CORNERS = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
"""A quad light's corners in units of its half edges, anticlockwise seen from its lit side."""


def polygon_factor(corners: list[Array], normal: Array) -> Array:
    """Integral of max(0, n.w) over a convex polygon of uniform radiance.

    Parameters
    ----------
    corners : (3, n) each, vectors from the point, in order.  normal : (3, n) unit vectors.

    Returns
    -------
    (n,) in sr. Source: Lambert 1760; the horizon clips each edge, and an arc along the horizon
    closes the outline (Arvo 1995, chapter 3).
    """
    heights = [dot(normal, corner) for corner in corners]
    lowest, highest = heights[0], heights[0]
    for height in heights[1:]:
        lowest, highest = np.minimum(lowest, height), np.maximum(highest, height)
    total = np.zeros_like(lowest)
    for k, corner in enumerate(corners):
        total += _edge_term(corner, corners[(k + 1) % len(corners)], normal)
    cut = np.flatnonzero((lowest < 0.0) & (highest > 0.0))
    if cut.size:
        total[cut] = _clipped(
            [c[:, cut] for c in corners], [h[cut] for h in heights], normal[:, cut]
        )
    return np.where(highest > 0.0, 0.5 * np.abs(total), 0.0)


def _edge_term(start: Array, end: Array, normal: Array) -> Array:
    """Angle of an edge times the cosine between its plane's normal and n."""
    plane = cross(start, end)
    length = np.sqrt(dot(plane, plane))
    angle = np.arctan2(length, dot(start, end))
    term: Array = angle * dot(normal, plane) / np.maximum(length, TINY)
    return term


def _clipped(corners: list[Array], heights: list[Array], normal: Array) -> Array:
    """The sum over edges of a polygon that the horizon cuts (heights of both signs)."""
    total = np.zeros_like(heights[0])
    leave = np.zeros_like(corners[0])
    enter = np.zeros_like(corners[0])
    for k, start in enumerate(corners):
        end, h0, h1 = corners[(k + 1) % len(corners)], heights[k], heights[(k + 1) % len(corners)]
        down, rise = (h0 > 0.0) & (h1 <= 0.0), (h0 <= 0.0) & (h1 > 0.0)
        gap = np.where(down | rise, h0 - h1, 1.0)
        crossing = start + (h0 / gap) * (end - start)
        leave = np.where(down, crossing, leave)
        enter = np.where(rise, crossing, enter)
        a = np.where(rise, crossing, start)
        b = np.where(down, crossing, end)
        total += np.where((h0 > 0.0) | (h1 > 0.0), _edge_term(a, b, normal), 0.0)
    return total + _edge_term(leave, enter, normal)


def cap_factor(cosine: Array, sine_half: Array, cosine_half: Array) -> Array:
    """Integral of max(0, n.w) over a circular cone.

    Parameters
    ----------
    cosine : (n,) of the angle between n and the cone's axis.
    sine_half, cosine_half : (n,) of the cone's half angle, which is below 90 degrees.

    Returns
    -------
    (n,) in sr: pi sin^2 cos where the cone is above the horizon, less below. Source: Snyder
    1996, MSR-TR-96-11, in the form of Lagarde and de Rousiers 2014, section 4.7.
    """
    square = sine_half * sine_half
    full: Array = np.pi * square * np.maximum(cosine, 0.0)
    cut = np.flatnonzero(np.abs(cosine) < sine_half)
    if cut.size:
        full = full + np.zeros_like(square)
        c, s, x = cosine[cut], np.sqrt(1.0 - cosine[cut] ** 2), cosine_half[cut] / sine_half[cut]
        y = np.clip(-x * c / s, -1.0, 1.0)
        root = s * np.sqrt(1.0 - y * y)
        part = (c * np.arccos(y) - x * root) * square[cut] + np.arctan2(root, x)
        full[cut] = np.maximum(part, 0.0)
    return full
