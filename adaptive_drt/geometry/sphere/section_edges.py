# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow edges of spheres that a light reaches into, seen from outside.

Of such a sphere only the part in front of the light's surface hides light. What it hides ends at
its silhouette, or where its surface meets that of the light: in a circle, the section. The section
moves over the light where sphere and light move relative to each other, and where the light turns
to face another point.
"""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.axes import TIME
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.vector import dot
from ..light_protocol import AreaLight
from ..shaded_patches import ShadedPatches
from ..shadow_edges import MARGIN_WEIGHT, ShadowEdges

__all__ = ["add_section_edges"]


def add_section_edges(
    edges: ShadowEdges,
    rows: Ints,
    half: Array,
    ends: tuple[Array, Array, Array],
    drift: Array,
    receivers: ShadedPatches,
    light: AreaLight,
) -> None:
    """Set, in place, the edges of k spheres `rows` where sections matter more than silhouettes.

    Parameters
    ----------
    half : (k,) radians, half angles of the light.
    ends : (3, k) metres from the points to the spheres' centres, the same to the light's, and
        (k,) radii.
    drift : (k,) metres by which the spheres move relative to the light over half the patches.
    receivers : those of the k spheres.
    """
    v, to, r = ends
    far = np.maximum(np.sqrt(dot(to, to)), light.radius)
    moved = _plane_motion(v - to, far, drift, receivers, light)
    height = light.plane(to).height_of(v)
    section = _section_radius(r, height)
    shifts = (moved + _growth(r, height, section, moved)) / far
    total, reach = moved.sum(axis=0), shifts.sum(axis=0) * far
    margin = receivers.patch.margin
    crosses = ~_lies_behind_silhouette(v, to, r, margin * total, light)
    inside = crosses.copy()
    if not light.solid:
        gap = v - to
        aside = np.sqrt(np.maximum(dot(gap, gap) - height * height, 0.0))
        off = np.abs(aside - section) - light.radius
        crosses &= (np.abs(height) - r < margin * total) & (off < margin * reach)
        inside &= (np.abs(height) - r < total) & (off < reach)
    depth = np.where(inside, 1.0, MARGIN_WEIGHT) * crosses
    width = 2.0 * np.minimum(half, np.arctan2(r, far))
    before = edges.depth[rows] * columns(edges.shifts, rows).sum(axis=0)
    before /= np.maximum(edges.width[rows], TINY)
    more = depth * shifts.sum(axis=0) / np.maximum(width, TINY) > before
    rows = rows[more]
    edges.depth[rows], edges.shifts[:, rows] = depth[more], columns(shifts, more)
    edges.width[rows], edges.coefficient[rows], edges.has_kink[rows] = width[more], np.inf, True


def _plane_motion(
    gap: Array, far: Array, drift: Array, receivers: ShadedPatches, light: AreaLight
) -> Array:
    """Metres (3, k) by which the sections' planes move relative to the spheres, by axis.

    A flat light does not turn, the plane of a facing disk turns about its centre, and the near side
    of a ball is as far as its radius in front of its outline.

    gap : (3, k) metres from the light's centre to the spheres'.  far : (k,) metres to the light.
    """
    moved = np.zeros((3, far.size))
    turning = light.span is None
    lever = np.full_like(far, light.radius) if light.solid else np.sqrt(dot(gap, gap))
    for axis in receivers.patch.axes:
        step = receivers.step(axis)
        if turning:
            moved[axis] = lever * np.sqrt(dot(step, step)) / far
        if axis == TIME:
            moved[axis] += drift
    return moved


def _section_radius(r: Array, height: Array) -> Array:
    """Radii of the circles in which spheres meet planes at a height below their centres."""
    radius: Array = np.sqrt(np.maximum(r * r - height * height, 0.0))
    return radius


def _growth(r: Array, height: Array, section: Array, moved: Array) -> Array:
    """Largest changes (3, k) metres of the sections' radii as the planes move by `moved` (3, k)."""
    ends = [np.abs(_section_radius(r, height + side * moved) - section) for side in (-1.0, 1.0)]
    growth: Array = np.maximum(*ends)
    return growth


def _lies_behind_silhouette(v: Array, to: Array, r: Array, moved: Array, light: AreaLight) -> Mask:
    """Whether sections (k,) lie behind the spheres' silhouettes, however the plane moves.

    They do where the circle in which rays from the point are tangent to the sphere is wholly in
    front of the light's plane.
    """
    plane = light.plane(to)
    square = np.maximum(dot(v, v), TINY)
    tangent = np.sqrt(np.maximum(square - r * r, 0.0))
    slope = dot(plane.normal, v)
    lean = np.sqrt(np.maximum(1.0 - slope * slope / square, 0.0))
    lowest = plane.height_of(v * (1.0 - r * r / square)) - r * tangent / np.sqrt(square) * lean
    behind: Mask = lowest > moved
    return behind
