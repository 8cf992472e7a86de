# SPDX-License-Identifier: GPL-3.0-or-later
"""How far one sample of light may be from its mean over a patch: estimates, axis by axis.

Not bounds but sizes: what a midpoint is off by where the integrand bends (second derivatives,
1/6 of the half width squared each) and where it steps (the deviation of a step at a random
place). They come from where the outlines of occluders stand to the light, so a shadow's edge is
found before any sample has met it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .columns import columns
from .emitter import DISK, POINT, QUAD, Emitter
from .lines import TIME
from .patch import Patch
from .plan import Plan
from .primary import Pairs, Surface, in_cache
from .quad import distance_along, distance_to, edge_planes, edges_of
from .vector import cross, dot

__all__ = ["BENDS", "KINKS", "STEPS", "half_angle", "no_variation", "shadow_variation"]

Array: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

TINY = float(np.finfo(np.float64).tiny)
BEND = 0.5
"""Of a shadow's depth and of its square of (half extent / width): a midpoint over a smooth step is
off by h^2/24 V'', and V'' = 6 - 12 u over a width of 1 has a mean square of 12."""
KINK = 0.14
"""Of (half extent / width), where a shadow begins or is whole within the patch: a ramp's kink at a
random place in a cell of h leaves its midpoint off by 0.07 h times the slope, RMS."""
STEP = 0.25
"""Of a step's height: the deviation of its midpoint sample, 1 / sqrt(12) for a random place, a
little less since the step seldom fills the cell."""
SMALLEST = 2.0**-52
"""Of an occluder's angle: a light narrower than that is a point."""
NEAREST = 2.0**-20
"""Of the distance to a light: an outline nearer to the point than that is as good as there."""
ROUNDING = 2.0**-48
"""Radians: directions to outlines and lights are rounded by that, counted generously. An outline
that moves over the light by less over a patch is where rounding puts it: no split would settle it.
A light metres from an occluder is seen so from a point 1e29 m away. In a scene of common sizes a
cell of 2^-24 pixels is a thousand times that."""
SHARPEST = 1e3
"""Half extents in units of a shadow's width: sharper than that makes no difference."""
ALIKE = 1.0 + 2.0**-20
"""Edges of a quad as sharp as that times another are equally sharp: before a point all are, and the
first of them counts, not the one that rounding chooses."""
ROUGH = 0.5
"""Of a shadow's width: a half extent from which the shadow is a step within the cell."""


BENDS, KINKS, STEPS = range(3)
"""Kinds of deviations: of what bends (they add up, and fall with the square of the extent), of
what has a kink at a random place, and of what steps there (their signs are random)."""


def no_variation(count: int) -> Array:
    """Nothing varies at n points: deviations (3, 3, n), by kind and by axis x, y, t."""
    return np.zeros((3, 3, count))


def half_angle(light: Emitter, distance: Array) -> Array:
    """Half the angle (n,) under which a light's ball is seen."""
    if light.kind == POINT:
        return np.zeros_like(distance)
    if light.kind == DISK:
        return np.arctan2(light.radius, distance)
    half: Array = np.arcsin(np.minimum(light.radius / distance, 1.0))
    return half


def shadow_variation(
    plan: Plan,
    surface: Surface,
    patch: Patch,
    light: Emitter,
    pairs: Pairs,
    time: Array | float,
) -> tuple[Array, Mask]:
    """Of the part of a light that is seen past occluders, relative to the unblocked factor.

    Parameters
    ----------
    light : as it casts shadows.  pairs : (m) candidate occluders, sorted by point, that serve
        the whole patches.  time : (m,) or a number, shutter times of the points.

    Returns
    -------
    deviations : (3, 3, n); hidden : (n,) one occluder hides the light from the whole patch.
    """
    count = surface.item.size
    total = no_variation(count)
    hidden = np.zeros(count, dtype=np.bool_)
    ball = pairs.item < plan.sphere_count
    for rows, part in ((np.flatnonzero(ball), _past_spheres), (np.flatnonzero(~ball), _past_quads)):
        if not rows.size:
            continue
        found = []
        for some in in_cache(rows):
            when = time[some] if isinstance(time, np.ndarray) else time
            found.append(part(plan, surface, patch, light, pairs.take(some), when))
        shadow, pixel = _joined(found), pairs.pixel[rows]
        hidden[pixel[shadow.covers]] = True
        _collect(total, pixel, shadow)
    total[..., hidden] = 0.0
    return total, hidden


@dataclass(frozen=True)
class _Shadows:
    """Shadows of m occluders over patches.

    Attributes
    ----------
    depth : (m,) part of the light that one hides at most; 0 where none of its bounds comes near.
    shifts : (3, m) radians that its outline moves over the light, by axis.
    width : (m,) radians between where it begins and where it is whole.
    ends : (m,) whether such a bound, a kink, runs through the patch.
    covers : (m,) whether it hides the light from the whole patch.
    """

    depth: Array
    shifts: Array
    width: Array
    ends: Mask
    covers: Mask


def _joined(parts: list[_Shadows]) -> _Shadows:
    each = (
        np.concatenate([getattr(part, one.name) for part in parts], axis=-1)
        for one in fields(_Shadows)
    )
    return _Shadows(*each)


def _collect(total: Array, pixel: Ints, shadow: _Shadows) -> None:
    """Add the deviations of shadows to their points'."""
    live = np.flatnonzero(shadow.depth > 0.0)
    pixel, depth, shifts = pixel[live], shadow.depth[live], columns(shadow.shifts, live)
    width = np.maximum(shadow.width[live], shifts.max(axis=0) / SHARPEST)
    square = (shifts / np.maximum(width, TINY)) ** 2
    across = square.sum(axis=0)
    step = across >= ROUGH * ROUGH
    kink = shadow.ends[live] & ~step
    bend = np.where(kink, np.maximum(KINK * np.sqrt(across), BEND * across), BEND * across)
    share = depth * np.minimum(bend, STEP) * square / np.maximum(across, TINY)
    count = total.shape[2]
    for kind, mask in ((BENDS, ~(kink | step)), (KINKS, kink), (STEPS, step)):
        chosen = np.flatnonzero(mask)
        if chosen.size:
            for axis in range(3):
                total[kind, axis] += np.bincount(
                    pixel[chosen], weights=share[axis, chosen], minlength=count
                )


def _shifts(
    steps: dict[int, Array], toward: Array, axis: Array, rate: Array, angle: Array | float
) -> Array:
    """Angles (3, m) by which an outline moves over a light as the point takes steps, by axis.

    Parameters
    ----------
    steps : (3, m) metres each.  toward : (3, m) unit vector across the outline.
    axis : (3, m) to the light.  rate : (m,) radians a metre.
    angle : (m,) from the light's centre to the occluder's: sideways steps count by their square.
    """
    shifts = np.zeros((3, rate.size))
    for number, step in steps.items():
        aside = step - dot(step, axis) * axis
        size = np.sqrt(dot(aside, aside)) * rate
        sideways = 0.5 * size * size / np.maximum(np.maximum(angle, size), TINY)
        shifts[number] = np.abs(dot(aside, toward)) * rate + sideways
    return shifts


def _rates(
    plan: Plan, light: Emitter, patch: Patch, pairs: Pairs, near: Array, far: Array
) -> tuple[Array, dict[int, Array]]:
    """Radians a metre at which an outline at a distance `near` moves over a light at `far`.

    Returns with it the steps by axis as if the point alone moved: (3, m) each.
    """
    rate = np.abs(1.0 / np.maximum(near, TINY) - 1.0 / far)
    steps = {axis: columns(patch.steps[axis], pairs.pixel) for axis in patch.axes}
    if TIME not in steps:
        return rate, steps
    half = patch.time[pairs.pixel]
    moved = np.zeros((3, pairs.item.size))
    for part, first in ((plan.spheres, 0), (plan.quads, plan.sphere_count)):
        d = part.displacement
        ids = pairs.item - first
        if d is not None and ids.size and 0 <= ids[0] < d.shape[1]:
            moved = columns(d, ids)
    carried = 0.0 if light.displacement is None else light.displacement
    # (occluder - point) / near - (light - point) / far, as a step of the point times the rate
    own = steps[TIME]
    turn = (moved * half - own) / np.maximum(near, TINY) - (carried * half - own) / far
    steps[TIME] = turn / np.maximum(rate, TINY)
    return rate, steps


def _past_spheres(
    plan: Plan, surface: Surface, patch: Patch, light: Emitter, pairs: Pairs, time: Array | float
) -> _Shadows:
    """Of spheres."""
    point = columns(surface.point, pairs.pixel)
    r = plan.spheres.radius[pairs.item]
    v = plan.spheres.moved(pairs.item, time) - point
    to = light.moved(time) - point
    far = np.maximum(np.sqrt(dot(to, to)), TINY)
    axis = to / far
    vv = dot(v, v)
    along = dot(axis, v)
    aside = v - along * axis
    off = np.sqrt(dot(aside, aside))
    toward = aside / np.maximum(off, TINY)
    angle = np.arctan2(off, along)
    tangent = np.sqrt(np.maximum(vv - r * r, 0.0))
    opening = np.arctan2(r, tangent)
    half = _extent(light, toward, far)
    rate, steps = _rates(plan, light, patch, pairs, np.maximum(tangent, far * NEAREST), far)
    shifts = _shifts(steps, toward, axis, rate, angle)
    whole = shifts.sum(axis=0)
    # it neither clears the light, nor hides all of it, nor lies within it, from the whole patch
    farthest = angle + half
    if light.kind == QUAD:
        farthest = np.hypot(farthest, _extent(light, cross(axis, toward), far))
    inner = _room(light, axis, v, far, half - angle) - opening
    crosses = (angle - opening - half < whole) & (opening - farthest < whole)
    crosses &= (inner < whole) & (whole > ROUNDING)
    before = np.sqrt(vv) - r < far + light.radius
    enclosed = (vv <= r * r) | (pairs.item == surface.item[pairs.pixel])
    depth = np.minimum(1.0, opening / np.maximum(half, SMALLEST * opening)) ** 2
    depth = np.where(crosses & before & ~enclosed, depth, 0.0)
    ends = (np.abs(angle - opening - half) < whole) | (np.abs(opening - farthest) < whole)
    ends |= np.abs(inner) < whole
    covers = (opening - farthest >= whole) & ~enclosed & (tangent < far - light.radius)
    some = np.flatnonzero(enclosed)
    if some.size:
        covers[some] = _holds(
            plan, surface, patch, light, pairs.take(some), columns(v, some), columns(to, some)
        )
    return _Shadows(depth, shifts, 2.0 * np.minimum(half, opening), ends, covers)


def _holds(
    plan: Plan, surface: Surface, patch: Patch, light: Emitter, pairs: Pairs, v: Array, to: Array
) -> Mask:
    """Whether spheres hold all of a patch and nothing of a light: (m,).

    v, to : (3, m) from the points to the centres of the spheres and of the light.
    """
    r, gap, eye = plan.spheres.radius[pairs.item], v - to, v + columns(surface.point, pairs.pixel)
    drift, carried = np.zeros(r.size), np.zeros(r.size)
    if plan.spheres.displacement is not None:
        d = columns(plan.spheres.displacement, pairs.item)
        drift = np.sqrt(dot(d, d)) * patch.time[pairs.pixel]
    if light.displacement is not None:
        carried = np.sqrt(dot(light.displacement, light.displacement)) * patch.time[pairs.pixel]
    apart = np.sqrt(dot(gap, gap)) - (drift + carried) > r + light.radius
    within = np.sqrt(dot(v, v)) + patch.reach[pairs.pixel] + drift < r
    # seen from within, a sphere is so all over
    lined = surface.inside[pairs.pixel] & (pairs.item == surface.item[pairs.pixel])
    lined &= (drift == 0.0) | (np.sqrt(dot(eye, eye)) + drift < r)
    holds: Mask = apart & (within | lined)
    return holds


def _room(light: Emitter, axis: Array, v: Array, far: Array, round_: Array) -> Array:
    """The angle (m,) from directions v (3, m) to a light's outline, less than 0 outside it.

    Of a quad light to the nearest of its sides: how far it extends towards a place says nothing of
    a side that the place is beside. `round_` is what holds for other lights.
    """
    if light.kind != QUAD:
        return round_
    rooms = []
    along = dot(axis, v)
    for side, other in ((light.half_u, light.half_v), (light.half_v, light.half_u)):
        across = cross(axis, other + np.zeros_like(axis))
        size = np.maximum(np.sqrt(dot(across, across)), TINY)
        wide = np.abs(dot(side, across)) / size
        rooms.append(np.arctan2(wide, far) - np.arctan2(np.abs(dot(v, across)) / size, along))
    room: Array = np.minimum(*rooms)
    return room


def _extent(light: Emitter, toward: Array, far: Array) -> Array:
    """Half the angle (m,) a light fills along a direction across the view."""
    if light.kind == QUAD:
        wide = np.abs(dot(light.half_u, toward)) + np.abs(dot(light.half_v, toward))
        flat: Array = np.arctan2(wide, far)
        return flat
    return half_angle(light, far)


def _past_quads(
    plan: Plan, surface: Surface, patch: Patch, light: Emitter, pairs: Pairs, time: Array | float
) -> _Shadows:
    """Of quads: the sharpest edge across the light, before its centre or beyond, counts."""
    point, ids = columns(surface.point, pairs.pixel), pairs.item - plan.sphere_count
    q = plan.quads.moved(ids, time) - point
    u, v = columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids)
    planes, normal, height = edge_planes(q, u, v)
    to = light.moved(time) - point
    far = np.maximum(np.sqrt(dot(to, to)), TINY)
    axis = to / far
    depth, width, shifts = np.zeros(ids.size), np.ones(ids.size), np.zeros((3, ids.size))
    ends, sharpest = np.zeros(ids.size, dtype=np.bool_), np.zeros(ids.size)
    misses = ~(height > 0.0)
    covers = ~misses
    for plane, start, edge in zip(planes, *edges_of(q, u, v), strict=True):
        near = np.maximum(distance_along(start, edge, axis), far * NEAREST)
        rate, steps = _rates(plan, light, patch, pairs, near, far)
        toward = plane / np.maximum(np.sqrt(dot(plane, plane)), TINY)
        height_of = np.arcsin(np.clip(dot(axis, toward), -1.0, 1.0))
        half = _extent(light, toward, far)
        each = _shifts(steps, toward, axis, rate, 1.0)
        whole = each.sum(axis=0)
        misses |= height_of < -half - whole
        covers &= height_of > half + whole
        crosses = (np.abs(height_of) < half + whole) & (whole > ROUNDING)
        sharp = np.where(crosses, whole / np.maximum(half, whole / SHARPEST), 0.0)
        better = sharp > ALIKE * sharpest
        sharpest = np.where(better, sharp, sharpest)
        width = np.where(better, 2.0 * half, width)
        shifts = np.where(better, each, shifts)
        depth = np.where(crosses, 1.0, depth)
        ends |= crosses & (np.abs(np.abs(height_of) - half) < whole)
    own = pairs.item == surface.item[pairs.pixel]
    depth[misses | own] = 0.0
    # a quad that the light lies on this side of hides nothing of it
    size = np.sqrt(dot(normal, normal))
    beyond = dot(to, normal) - height
    point_slack, light_slack = _plane_slack(plan, patch, light, pairs, normal)
    depth[(beyond + light.radius * size < -light_slack) & (height > point_slack)] = 0.0
    before = (beyond - light.radius * size > light_slack) & (height > point_slack)
    covers &= before & ~misses & ~own
    cut = np.flatnonzero((height <= point_slack) & ~own)
    reach = _reach(plan, patch, pairs.take(cut))
    cut = cut[distance_to(*(columns(x, cut) for x in (q, u, v))) <= reach]
    if cut.size:
        # it stands in the patch: lit on one side, dark on the other
        depth[cut], width[cut] = 1.0, 0.0
        shifts[:, cut] = _through(plan, patch, pairs.take(cut), columns(normal, cut) / size[cut])
    return _Shadows(depth, shifts, width, ends, covers)


def _drift(plan: Plan, patch: Patch, pairs: Pairs) -> Array:
    """How far (3, m) quads move over half the patches' stretch of time."""
    d = plan.quads.displacement
    if d is None:
        return np.zeros((3, pairs.item.size))
    drift: Array = columns(d, pairs.item - plan.sphere_count) * patch.time[pairs.pixel]
    return drift


def _reach(plan: Plan, patch: Patch, pairs: Pairs) -> Array:
    """How far (m,) patches reach towards quads, which may come towards them."""
    drift = _drift(plan, patch, pairs)
    reach: Array = patch.reach[pairs.pixel] + np.sqrt(dot(drift, drift))
    return reach


def _through(plan: Plan, patch: Patch, pairs: Pairs, normal: Array) -> Array:
    """How far (3, m) patches reach through the planes of quads, by axis."""
    steps = [columns(patch.steps[axis], pairs.pixel) for axis in range(3)]
    steps[2] = steps[2] - _drift(plan, patch, pairs)
    through: Array = np.abs(np.stack([dot(step, normal) for step in steps]))
    return through


def _plane_slack(
    plan: Plan, patch: Patch, light: Emitter, pairs: Pairs, normal: Array
) -> tuple[Array, Array]:
    """How far points and light move against the planes of quads, times |normal|: (m,) each."""
    point = np.zeros(pairs.item.size)
    for axis in patch.axes:
        point += np.abs(dot(columns(patch.steps[axis], pairs.pixel), normal))
    moved = np.zeros(pairs.item.size)
    half, d = patch.time[pairs.pixel], plan.quads.displacement
    if d is not None:
        moved += half * np.abs(dot(columns(d, pairs.item - plan.sphere_count), normal))
    point += moved
    if light.displacement is not None:
        moved = moved + half * np.abs(dot(light.displacement, normal))
    return point, moved
