# SPDX-License-Identifier: GPL-3.0-or-later
"""Planes that separate shapes from what they might hide: a proof that they do not.

Seen from a point, two convex sets share no direction if a plane through the point has one of them
on each side, and any plane that is found proves it, however it was found. Of all planes that touch
the simpler set, a ball or a polygon, one angle is free; the one beyond which the shape reaches
least is looked for. The bounds of shapes that are not balls are wide of them by their unevenness.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..geometry.shape import ShapeSet
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot, norm, perpendicular_pair
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface

__all__ = [
    "are_tried",
    "light_corners",
    "out_of_light",
    "out_of_pixels",
    "planes_help",
    "separated",
]

ANGLES = 12
"""Planes that are tried first, all around."""
STEPS = np.array([0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6])
"""Their order: first those on the side of the shape, which separate most."""
SECTIONS = 24
"""Golden sections of the angles beside the best of them, to 1e-5: a plane at the least is off by
the square of that, one at a kink, as where it touches both ends of a cylinder, by itself."""
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
ROUNDING = 2.0**-44
"""Generous bound on the rounding of a distance from a plane, of the distances that enter it."""


def are_tried(plan: Plan) -> bool:
    """Whether planes are tried at all: for the mask of the second order, from which rays follow.

    Where light is found in closed form, an occluder that hides nothing costs less than the proof.
    """
    return plan.settings.method == "RAYS" and plan.settings.order == 2


def planes_help(plan: Plan, item: Ints) -> Ints:
    """Those of pairs (m,) whose shapes planes are tried for: rows, ascending."""
    if not are_tried(plan):
        return np.zeros(0, dtype=np.int64)
    rows = [at for shapes, at, _ in plan.shapes.groups(item) if shapes.uneven]
    return np.sort(np.concatenate(rows)) if rows else np.zeros(0, dtype=np.int64)


def light_corners(light: Emitter, point: Array, reach: Array) -> tuple[list[Array], Array]:
    """A light as points see it: corners (3, m) of its hull, to be widened by distances (m,).

    Patches of surface around the points see it within `reach` (m,) metres of that.
    """
    to = light.to_center(point)
    if light.span is not None:
        u, v = light.span.half_u, light.span.half_v
        return [to + u + v, to + u - v, to - u - v, to - u + v], reach
    cone = light.view_cone(to)
    # a light at infinity is at no distance that a reach changes
    far = np.where(np.isfinite(cone.distance), cone.distance, 1.0)
    near = np.where(np.isfinite(cone.distance), reach, 0.0)
    # nothing is separated from what surrounds the point
    wide = np.where(cone.cosine > 0.0, far * cone.sine + near, np.inf)
    return [far * cone.axis], wide


def out_of_light(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array, moving: bool = False
) -> Mask:
    """Whether planes through points separate occluders (m,) from a light at mid-shutter.

    Parameters
    ----------
    surface : n points.  reach : (n,) metres; it holds for all surface points within.
    moving : as that of `separated`.
    """
    apart = np.zeros(pairs.item.size, dtype=np.bool_)
    rows = planes_help(plan, pairs.item)
    if rows.size and not light.surrounds:
        some = pairs.take(rows)
        point, wide = columns(surface.point, some.pixel), reach[some.pixel]
        corners = light_corners(light, point, wide)
        apart[rows] = separated(plan, some.item, point, *corners, wide, moving=moving)
    return apart


def out_of_pixels(plan: Plan, item: Ints, w: Array, whole: bool, moving: bool = False) -> Mask:
    """Whether planes through the camera separate shapes from pixels: (m,).

    Parameters
    ----------
    w : (3, m) directions through the pixels' centres.  whole : whether all rays of pixels count.
    moving : as that of `separated`.
    """
    rows = planes_help(plan, item)
    apart = np.zeros(item.size, dtype=np.bool_)
    if rows.size:
        way, corners = columns(w, rows), [columns(w, rows)]
        if whole:
            right, up = 0.5 * plan.lens.right[:, None], 0.5 * plan.lens.up[:, None]
            corners = [way + right + up, way + right - up, way - right - up, way - right + up]
        zero = np.zeros(rows.size)
        apart[rows] = separated(plan, item[rows], 0.0 * way, corners, zero, moving=moving)
    return apart


def separated(
    plan: Plan,
    item: Ints,
    apex: Array,
    corners: Sequence[Array],
    wide: Array,
    reach: Array | float = 0.0,
    moving: bool = False,
) -> Mask:
    """Whether planes through apexes separate shapes from the hulls of corners: (m,).

    Parameters
    ----------
    item : (m,) shapes.  apex : (3, m) metres.
    corners : of (3, m), from the apexes.  wide : (m,) metres by which the hulls are widened.
    reach : (m,) metres, by which the apex may be off.
    moving : whether for all positions of the shapes over the shutter, or the one at its middle.
    """
    found = np.zeros(item.size, dtype=np.bool_)
    reach = np.broadcast_to(np.asarray(reach, dtype=np.float64), item.shape)
    for shapes, rows, index in plan.shapes.groups(item):
        if not shapes.uneven:
            continue
        at, (center, radius) = columns(apex, rows), shapes.bounding_spheres
        place = columns(center, index)
        slack = reach[rows] + ROUNDING * (norm(place) + radius[index] + norm(at))
        half = np.zeros((3, rows.size))
        if moving and shapes.displacement is not None:
            half = 0.5 * columns(shapes.displacement, index)
            slack += ROUNDING * norm(half)
        beyond = partial(_beyond, shapes, index, (at, half, slack))
        ends = [columns(corner, rows) for corner in corners]
        found[rows] = _are_separated(beyond, place - at, ends, wide[rows])
    return found


def _beyond(
    shapes: ShapeSet, index: Ints, sizes: tuple[Array, Array, Array], n: Array, rows: Ints
) -> Array:
    """How far (k,) metres shapes reach beyond planes of unit normals n (3, k) through apexes.

    index : (m,) shapes, and sizes : of each its apex and half of its path (3, m), and what is added
        (m,), all in metres.  rows : (k,) which of them.
    """
    apex, half, slack = (columns(each, rows, -1) for each in sizes)
    most = shapes.extent(index[rows], n, 0.0)[1] - dot(n, apex)
    far: Array = most + np.abs(dot(n, half)) + slack
    return far


def _are_separated(
    beyond: Callable[[Array, Ints], Array],
    toward: Array,
    corners: Sequence[Array],
    wide: Array,
) -> Mask:
    """Whether a plane has a shape on one side, and the widened hull of corners on the other: (m,).

    beyond : how far (k,) metres shapes, of given numbers (k,), reach beyond planes of unit normals
        (3, k) through their apexes.
    toward : (3, m) from the apexes, places on the side of the hulls where the shapes are.
    """
    found = np.zeros(wide.size, dtype=np.bool_)
    # what is out of float64's range is NaN somewhere, and not separated
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        planes = _TouchingPlanes.make(corners, wide)
        rows = planes.before.nonzero()[0]
        first = planes.angles_to(toward)
        best, least = first.copy(), np.full(wide.size, np.inf)
        step = 2.0 * np.pi / ANGLES
        for turn in STEPS * step:
            if not rows.size:
                return found
            angle = first[rows] + turn
            value = beyond(planes.normals(angle, rows), rows)
            lower = value < least[rows]
            best[rows[lower]], least[rows[lower]] = angle[lower], value[lower]
            found[rows] |= value < 0.0
            rows = rows[value >= 0.0]
        found[_lower(beyond, planes, rows, best[rows] - step, best[rows] + step)] = True
    return found


def _lower(
    beyond: Callable[[Array, Ints], Array],
    planes: _TouchingPlanes,
    rows: Ints,
    low: Array,
    high: Array,
) -> Ints:
    """Those of hulls `rows` (k,) for which golden sections between angles find a plane."""
    found = [rows[:0]]
    p, q = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    left, right = (beyond(planes.normals(angle, rows), rows) for angle in (p, q))
    for _ in range(SECTIONS):
        least = np.minimum(left, right)
        found.append(rows[least < 0.0])
        rest = (least >= 0.0).nonzero()[0]
        if not rest.size:
            break
        rows, low, high, p, q, left, right = (
            each[rest] for each in (rows, low, high, p, q, left, right)
        )
        lower = left < right
        low, high = np.where(lower, low, p), np.where(lower, q, high)
        new = np.where(lower, high - GOLDEN * (high - low), low + GOLDEN * (high - low))
        value = beyond(planes.normals(new, rows), rows)
        p, q = np.where(lower, new, q), np.where(lower, p, new)
        left, right = np.where(lower, value, right), np.where(lower, left, value)
    return np.concatenate(found)


@dataclass(frozen=True)
class _TouchingPlanes:
    """Planes through apexes that touch m hulls, by the angle at which they do.

    Attributes
    ----------
    frame : unit vectors (3, m), of which the first points into the hulls.
    corners : their coordinates (m,) in the frames.  wide : (m,) metres.
    before : (m,) whether hulls are before their apexes, so that all planes that touch them have
        them on one side.
    """

    frame: tuple[Array, Array, Array]
    corners: list[tuple[Array, Array, Array]]
    wide: Array
    before: Mask

    @classmethod
    def make(cls, corners: Sequence[Array], wide: Array) -> _TouchingPlanes:
        """The planes of hulls of corners (3, m), widened by distances (m,), metres."""
        lengths = [norm(corner) for corner in corners]
        middle = np.zeros_like(corners[0])
        for corner, length in zip(corners, lengths, strict=True):
            middle = middle + corner / length
        axis = middle / norm(middle)
        u, v = perpendicular_pair(axis)
        local = [(dot(axis, corner), dot(u, corner), dot(v, corner)) for corner in corners]
        wide = wide + ROUNDING * np.max(lengths, axis=0)
        before: Mask = np.min([ahead for ahead, _, _ in local], axis=0) > wide
        return cls((axis, u, v), local, wide, before)

    def angles_to(self, toward: Array) -> Array:
        """Angles (m,) of the planes on the sides of the hulls that vectors (3, m) lead to."""
        _, u, v = self.frame
        angle: Array = np.arctan2(dot(v, toward), dot(u, toward))
        return angle

    def normals(self, angle: Array, rows: Ints) -> Array:
        """Unit normals (3, k) to the side of the hulls `rows`, for angles (k,)."""
        c, s = np.cos(angle), np.sin(angle)
        tilt = np.full(rows.size, -np.inf)
        for ahead, right, up in self.corners:
            along, across = ahead[rows], c * right[rows] + s * up[rows]
            size = np.hypot(along, across)
            turn = np.arctan2(across, along) + np.arcsin(np.minimum(self.wide[rows] / size, 1.0))
            tilt = np.maximum(tilt, turn)
        axis, u, v = (columns(each, rows) for each in self.frame)
        normals: Array = np.sin(tilt) * axis - np.cos(tilt) * (c * u + s * v)
        return normals
