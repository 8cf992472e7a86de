# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance from unoccluded lights in closed form: the integral of max(0, n.w) over the light.

Every function returns a geometric factor: irradiance (W / m^2) divided by the light's radiance
(by the intensity for a point). Error bounds are relative to exact arithmetic on the float64 inputs,
in units of u = 2^-53, and hold for sizes and distances of 1e-6 to 1e6 and aspect ratios to 1e6.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import cross, dot

__all__ = ["QUAD_CORNERS", "cap_factor", "parallelogram_factor", "polygon_factor"]


SMALL_QUAD_RATIO = 2.0**-8
"""Sum of the lengths of a quad's half edges, as a fraction of its distance, below which the factor
is computed by quadrature. The rule's own error is then below roundoff, and the edges' terms would
have begun to cancel."""
GAUSS_NODES = ((-(0.6**0.5), 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.6**0.5, 5.0 / 9.0))
"""Three-point Gauss-Legendre rule, exact to degree 5: nodes and weights on [-1, 1]."""
SERIES_LIMIT = 0.25
"""Tangent below which x - atan x is summed as a series, whose coefficients are 1/3, -1/5, ..."""
SERIES_TERMS = 13
"""Number of terms that reach roundoff: the limit 0.25 to the power 26 is 2^-52."""


QUAD_CORNERS = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
"""Corners of a quad light in units of its half edges, anticlockwise seen from its lit side."""


def parallelogram_factor(to: Array, a: Array, b: Array, normal: Array) -> Array:
    """Integral of max(0, n.w) over the directions to a parallelogram: (n,) in sr, 0 from behind.

    Parameters
    ----------
    to : (3, n) metres from the points to its centre.  a, b : (3, 1) metres, half edges.
    normal : (3, n) unit vectors.

    With d the length of `to`, the error is at most 16 u (|a| + |b|) / h sr, h the distance of the
    nearest point of its outline or of the horizon's line on it; 48 u |a||b| / d^2 where
    (|a| + |b|) / d is below `SMALL_QUAD_RATIO`.
    """
    height, rise_a, rise_b = dot(normal, to), dot(normal, a), dot(normal, b)
    reach = np.abs(rise_a) + np.abs(rise_b)
    facing = -dot(to, cross(a, b))
    seen = (facing > 0.0) & (height + reach > 0.0)
    size = np.sqrt(dot(a, a)) + np.sqrt(dot(b, b))
    small = dot(to, to) * (SMALL_QUAD_RATIO * SMALL_QUAD_RATIO) > size * size
    cut = seen & (height < reach)
    if small.all():
        total = facing * _quadrature(to, a, b, height, rise_a, rise_b)
    else:
        total = 0.5 * _edge_sum(to, a, b, normal)
        rows = (small & seen).nonzero()[0]
        if rows.size:
            rises = (x[rows] for x in (height, rise_a, rise_b))
            total[rows] = facing[rows] * _quadrature(columns(to, rows), a, b, *rises)
    rows = cut.nonzero()[0]
    if rows.size:
        total[rows] = _factor_above_horizon(
            columns(to, rows), a, b, columns(normal, rows), small[rows]
        )
    return np.where(seen, np.maximum(total, 0.0), 0.0)


def _edge_sum(to: Array, a: Array, b: Array, normal: Array) -> Array:
    """Lambert's sum over the edges of a parallelogram, twice the factor where seen from its front.

    An edge from m + e to m - e lies in the plane of m x e, and spans the angle with tangent
    2 |m x e| / (m.m - e.e): products of edges, so tiny and thin quads do not lose digits.
    """
    total = _whole_edge_term(to + b, a, normal)
    total += _whole_edge_term(to - a, b, normal)
    total -= _whole_edge_term(to - b, a, normal)
    total -= _whole_edge_term(to + a, b, normal)
    return total


def _whole_edge_term(middle: Array, half: Array, normal: Array) -> Array:
    """Lambert's term of an edge, given its middle and half edge: as `_edge_term` otherwise."""
    plane = cross(middle, half)
    length = np.sqrt(dot(plane, plane))
    term: Array = np.arctan2(2.0 * length, dot(middle, middle) - dot(half, half))
    term *= dot(normal, plane)
    term /= np.maximum(length, TINY, out=length)
    return term


def _quadrature(
    to: Array, a: Array, b: Array, height: Array, rise_a: Array, rise_b: Array
) -> Array:
    """Integral of n.p / |p|^4 over p = to + x a + y b, |x|, |y| <= 1, by 3 x 3 nodes: (n,).

    height, rise_a, rise_b : (n,) n.to, n.a and n.b; all of the quad is above the horizon.
    """
    slope_a, slope_b = 2.0 * dot(to, a), 2.0 * dot(to, b)
    total = np.zeros(height.shape)
    square = dot(to, to)
    for x, weight in GAUSS_NODES:
        start = square + (x * slope_a + x * x * dot(a, a))
        level = height + x * rise_a
        step = slope_b + 2.0 * x * dot(a, b)
        for y, other in GAUSS_NODES:
            far = start + (y * step + y * y * dot(b, b))
            total += (weight * other) * (level + y * rise_b) / (far * far)
    return total


def _factor_above_horizon(to: Array, a: Array, b: Array, normal: Array, small: Mask) -> Array:
    """Factors (n,) of quads that the horizon cuts, seen from their front.

    small : (n,) which of them are integrated by quadrature, not by their edges.
    """
    total = np.zeros(to.shape[1])
    for chosen, small_ones in ((small, True), (~small, False)):
        rows = chosen.nonzero()[0]
        if not rows.size:
            continue
        place, n = columns(to, rows), columns(normal, rows)
        if small_ones:
            total[rows] = _quadrature_above_horizon(place, a, b, n)
        else:
            corners = [place + (su * a + sv * b) for su, sv in QUAD_CORNERS]
            total[rows] = 0.5 * np.abs(
                _edge_sum_above_horizon(corners, [dot(n, c) for c in corners], n)
            )
    return total


def polygon_factor(corners: list[Array], normal: Array) -> Array:
    """Integral of max(0, n.w) over the directions to a convex planar polygon.

    Parameters
    ----------
    corners : (3, n) metres, vectors from the point, in order.  normal : (3, n) unit vectors.

    Returns
    -------
    (n,) in sr. Source: Lambert 1760; the horizon clips each edge, and an arc along the horizon
    closes the outline (Arvo 1995, chapter 3). The error is at most 16 u (|a| + |b|) / h sr, half
    edges a, b and h as for `parallelogram_factor`: relative to the factor, u over the least width.
    """
    heights = [dot(normal, corner) for corner in corners]
    lowest, highest = heights[0], heights[0]
    for height in heights[1:]:
        lowest, highest = np.minimum(lowest, height), np.maximum(highest, height)
    total = np.zeros_like(lowest)
    for k, corner in enumerate(corners):
        total += _edge_term(corner, corners[(k + 1) % len(corners)], normal)
    cut = ((lowest < 0.0) & (highest > 0.0)).nonzero()[0]
    if cut.size:
        total[cut] = _edge_sum_above_horizon(
            [columns(c, cut) for c in corners], [h[cut] for h in heights], columns(normal, cut)
        )
    return np.where(highest > 0.0, 0.5 * np.abs(total), 0.0)


def _edge_term(start: Array, end: Array, normal: Array) -> Array:
    """Lambert's term of an edge: its angle times the dot product of its plane's normal and n."""
    plane = cross(start, end - start)  # not start x end, whose terms cancel for a short edge
    length = np.sqrt(dot(plane, plane))
    angle = np.arctan2(length, dot(start, end))
    term: Array = angle * dot(normal, plane) / np.maximum(length, TINY)
    return term


def _edge_sum_above_horizon(corners: list[Array], heights: list[Array], normal: Array) -> Array:
    """Lambert's sum over the edges of a polygon that the horizon cuts (heights of both signs)."""
    edges, leave, enter = _clip_at_horizon(corners, heights)
    total = _edge_term(leave, enter, normal)
    for start, end, seen in edges:
        total += np.where(seen, _edge_term(start, end, normal), 0.0)
    return total


def _clip_at_horizon(
    corners: list[Array], heights: list[Array]
) -> tuple[list[tuple[Array, Array, Mask]], Array, Array]:
    """Clip a convex polygon at the horizon.

    Parameters
    ----------
    corners : (..., n) positions, with any number of components.
    heights : (n,) of each corner above the horizon.

    Returns
    -------
    edges : for each edge the start and end (..., n) of its part above the horizon, and whether
        there is such a part (n,).
    leave, enter : (..., n) where the outline goes below the horizon and where it comes up again.
    """
    edges = []
    leave, enter = np.zeros_like(corners[0]), np.zeros_like(corners[0])
    for k, start in enumerate(corners):
        end, h0, h1 = corners[(k + 1) % len(corners)], heights[k], heights[(k + 1) % len(corners)]
        down, rise = (h0 > 0.0) & (h1 <= 0.0), (h0 <= 0.0) & (h1 > 0.0)
        gap = np.where(down | rise, h0 - h1, 1.0)
        crossing = start + (h0 / gap) * (end - start)
        leave = np.where(down, crossing, leave)
        enter = np.where(rise, crossing, enter)
        a, b = np.where(rise, crossing, start), np.where(down, crossing, end)
        edges.append((a, b, (h0 > 0.0) | (h1 > 0.0)))
    return edges, leave, enter


def _quadrature_above_horizon(to: Array, a: Array, b: Array, normal: Array) -> Array:
    """Factors (n,) of small quads that the horizon cuts, seen from their front, by quadrature.

    The part above the horizon is split into triangles that fan out from the point where the
    outline goes below the horizon; coordinates are (x, y) in half edges.
    """
    height, rise_a, rise_b = dot(normal, to), dot(normal, a), dot(normal, b)
    count = to.shape[1]
    corners = [np.repeat(np.array([[x], [y]]), count, axis=1) for x, y in QUAD_CORNERS]
    heights = [height + x * rise_a + y * rise_b for x, y in QUAD_CORNERS]
    edges, leave, _ = _clip_at_horizon(corners, heights)
    total = np.zeros(count)
    for start, end, seen in edges:
        p, q = start - leave, end - leave
        area = np.where(seen, 0.5 * np.abs(p[0] * q[1] - p[1] * q[0]), 0.0)
        for s, t, weight in TRIANGLE_RULE:
            x, y = leave + s * p + t * q
            place = to + x * a + y * b
            square = dot(place, place)
            level = np.maximum(height + x * rise_a + y * rise_b, 0.0)
            total += weight * area * level / (square * square)
    return -dot(to, cross(a, b)) * total


def _triangle_rule() -> tuple[tuple[float, float, float], ...]:
    """Radon's seven-point rule (1948), exact to degree 5: two barycentric coordinates, weight."""
    root = 15.0**0.5
    rows = [(1.0 / 3.0, 1.0 / 3.0, 9.0 / 40.0)]
    for sign in (-1.0, 1.0):
        near, weight = (6.0 + sign * root) / 21.0, (155.0 + sign * root) / 1200.0
        other = 1.0 - 2.0 * near
        rows += [(near, near, weight), (near, other, weight), (other, near, weight)]
    return tuple(rows)


TRIANGLE_RULE = _triangle_rule()
"""Quadrature rule on a triangle: barycentric coordinates s, t and weight of each node."""


def cap_factor(cosine: Array, sine_half: Array, cosine_half: Array) -> Array:
    """Integral of max(0, n.w) over a circular cone.

    Parameters
    ----------
    cosine : (n,) of the angle between n and the cone's axis.
    sine_half, cosine_half : (n,) of the cone's half angle, which is below 90 degrees.

    Returns
    -------
    (n,) in sr: pi sin^2 cos where the cone is above the horizon, less below. The error is at most
    32 u sin^2. Source: Snyder 1996, MSR-TR-96-11, in the form of Lagarde and de Rousiers 2014,
    section 4.7, where with q = root / x
        (c acos y - x root) sin^2 + atan q = (c acos y + q) sin^2 - (q - atan q),
    and the right hand side does not cancel for small cones.
    """
    square = sine_half * sine_half
    full: Array = np.pi * square * np.maximum(cosine, 0.0)
    cut = (np.abs(cosine) < sine_half).nonzero()[0]
    if cut.size:
        full = full + np.zeros_like(square)
        c, x = cosine[cut], cosine_half[cut] / sine_half[cut]
        s = np.sqrt((1.0 - c) * (1.0 + c))
        y = np.clip(-x * c / s, -1.0, 1.0)
        root = s * np.sqrt((1.0 - y) * (1.0 + y))
        swing = c * np.arccos(y)
        part = (swing - x * root) * square[cut] + np.arctan2(root, x)
        tiny = (root < SERIES_LIMIT * x).nonzero()[0]
        if tiny.size:
            q = root[tiny] / x[tiny]
            part[tiny] = (swing[tiny] + q) * square[cut[tiny]] - _x_minus_atan(q)
        full[cut] = np.maximum(part, 0.0)
    return full


def _x_minus_atan(q: Array) -> Array:
    """q - atan q for 0 <= q < `SERIES_LIMIT`, to roundoff: its series, by Horner's rule."""
    square = q * q
    total = np.zeros_like(q)
    for k in range(SERIES_TERMS, 0, -1):
        total = 1.0 / (2 * k + 1) - square * total
    return total * square * q
