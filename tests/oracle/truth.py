# SPDX-License-Identifier: GPL-3.0-or-later
"""The masks as brute force sees them: True only where a pixel certainly depends on a domain.

Each function takes pixels (n, 2), their lower left corners, and returns (n,) bool.
"""

import numpy as np

from adaptive_drt.scene.description import QuadLight, SkyLight, Sphere

from .camera import project
from .lights import aim, facing, is_area, is_dark, place
from .samples import (
    camera_rays,
    closest_times,
    landmarks,
    light_grid,
    pixel_grid,
    rim,
    shadow_landmarks,
    squeeze,
)
from .trace import BLOCKED, MARGIN, OPEN, UNSURE, dot, extent, flat_of, moves, nearest, norm, states

__all__ = ["edges", "masks", "motion", "outlines_seen", "penumbrae", "pixels_of"]

TIMES = np.linspace(-0.5, 0.5, 9)


def pixels_of(camera):
    """Lower left corners (n, 2) of the rendered pixels, row by row from the bottom."""
    left, bottom, right, top = camera.region
    columns, rows = np.meshgrid(np.arange(left, right), np.arange(bottom, top))
    return np.stack([columns.ravel(), rows.ravel()], axis=1).astype(float)


def masks(scene, use_penumbra=True, use_motion=True, use_edges=True):
    """(3, height, width) bool: what the mask of this scene must hold at least."""
    pixels = pixels_of(scene.camera)
    left, bottom, right, top = scene.camera.region
    nothing = np.zeros(len(pixels), dtype=bool)
    red = penumbrae(scene, pixels) if use_penumbra else nothing
    green = motion(scene, pixels, use_penumbra, use_edges) if use_motion else nothing
    blue = edges(scene, pixels, use_penumbra, use_motion) if use_edges else nothing
    return np.stack([red, green, blue]).reshape(3, top - bottom, right - left)


def light_states(scene, light, p, normals, own, inside, t, uv, which=None):
    """BLOCKED, OPEN or UNSURE for a light's points uv (n, 2) seen from p (n, 3) at t (n,).

    Below p's horizon counts as BLOCKED, but of a sky as UNSURE: p sees what is above it.
    """
    margin = MARGIN * extent(scene)
    point = place(light, p, t, uv)
    height = dot(point - p, normals)
    if light.casts_shadow:
        state = states(scene, p, point, t, own, normals, inside, which)
    else:
        state = np.full(len(p), OPEN)
    below = UNSURE if isinstance(light, SkyLight) else BLOCKED
    state = np.where(height < -margin, below, state)
    return np.where(np.abs(height) <= margin, np.where(state == BLOCKED, BLOCKED, UNSURE), state)


def light_samples(scene, light, p, t, k):
    """Points (m, n, 2) of a light's uv domain: a grid, and towards each occluder from p (n, 3)."""
    columns = [np.broadcast_to(uv, (len(p), 2)) for uv in light_grid(light, k)]
    if not is_area(light):
        return columns
    for shape in scene.shapes:
        for q in landmarks(shape):
            columns.append(aim(light, p, t, np.broadcast_to(q, p.shape)))
        if isinstance(shape, Sphere):
            for q in rim(shape, p, t):
                columns.append(aim(light, p, t, q))
    return columns


def visibility(scene, light, p, normals, own, inside, k=9):
    """Whether some of a light's points are certainly open, and some certainly hidden: 2 x (n,)."""
    zero = np.zeros(len(p))
    seen, hidden = np.zeros(len(p), dtype=bool), np.zeros(len(p), dtype=bool)
    left = np.arange(len(p))
    for uv in light_samples(scene, light, p, zero, k):
        args = (p[left], normals[left], own[left], inside[left], zero[left], uv[left])
        state = light_states(scene, light, *args)
        seen[left] |= state == OPEN
        hidden[left] |= state == BLOCKED
        left = left[~(seen[left] & hidden[left])]
    return seen, hidden


def penumbrae(scene, pixels):
    """Red: at the centre's hit point, some shadow-casting area light is seen in part."""
    result = np.zeros(len(pixels), dtype=bool)
    o, d, t = camera_rays(scene, pixels + 0.5, 0.0)
    hits = nearest(scene, o, d, t)
    sure = np.flatnonzero(hits.clear & (hits.ids >= 0))
    p, normals = hits.points[sure], hits.normals[sure]
    own, inside = hits.ids[sure], hits.inside[sure]
    margin = MARGIN * extent(scene)
    for light in scene.lights:
        if not is_area(light) or is_dark(light) or not light.casts_shadow or not len(sure):
            continue
        front = facing(light, p, np.zeros(len(p))) > margin
        seen, hidden = visibility(scene, light, p, normals, own, inside)
        result[sure] |= seen & hidden & front
    return result


def motion(scene, pixels, use_penumbra=True, use_edges=True):
    """Green: at some point of the pixel (or its centre), the value depends on the time."""
    moving = moves(scene.camera) or any(moves(x) for x in (*scene.shapes, *scene.lights))
    result = np.zeros(len(pixels), dtype=bool)
    if not moving:
        return result
    if use_edges:
        rng = np.random.default_rng(5)
        offsets = np.concatenate([pixel_grid(3), rng.random((4, 2))])
        spots = [pixels + offset for offset in offsets]
        movers = [landmarks(s) for s in scene.shapes if moves(s)]
        for k in range(len(np.concatenate(movers))) if movers else ():
            q = np.concatenate(movers)[k : k + 1]
            inside, count = squeeze(scene, pixels, q, np.zeros(1))
            spots += [inside] if count else []
    else:
        spots = [pixels + 0.5]
    for k, spot in enumerate(spots):
        left = np.flatnonzero(~result)
        result[left] |= _changes(scene, spot[left], use_penumbra, dense=k == 0)
    return result


def _changes(scene, spots, use_penumbra, dense):
    """Whether what is seen through picture points (n, 2) depends on the time."""
    o, d, zero = camera_rays(scene, spots, 0.0)
    base = nearest(scene, o, d, zero)
    changed = np.zeros(len(spots), dtype=bool)
    shifted = np.zeros(len(spots), dtype=bool)
    margin = MARGIN * extent(scene)
    active = [_shifts(s, scene.camera) for s in scene.shapes]
    special = closest_times(scene, o, d)
    for when in [np.full(len(spots), t) for t in TIMES] + list(special):
        o, d, t = camera_rays(scene, spots, when)
        hits = nearest(scene, o, d, t)
        changed |= hits.clear & base.clear & (hits.ids != base.ids)
        for index, shifts in enumerate(active):
            changed |= shifts & hits.clear & (hits.ids == index)
        apart = norm(hits.points - base.points) > 10.0 * margin
        shifted |= hits.clear & base.clear & (hits.ids == base.ids) & (hits.ids >= 0) & apart
    rest = np.flatnonzero(~changed & base.clear & (base.ids >= 0))
    if not len(rest):
        return changed
    p, normals = base.points[rest], base.normals[rest]
    own, inside = base.ids[rest], base.inside[rest]
    for light in scene.lights:
        # without penumbrae a sky casts no shadows
        if not is_dark(light) and (use_penumbra or not isinstance(light, SkyLight)):
            args = (scene, light, p, normals, own, inside, use_penumbra, shifted[rest], dense)
            changed[rest] |= _light_changes(*args)
    return changed


def _shifts(shape, camera):
    """Whether a hit on this shape moves, or turns, under a ray of the camera, lit or not."""
    move = np.zeros(3)
    for thing, sign in ((shape, 1.0), (camera, -1.0)):
        if moves(thing):
            move = move + sign * np.array(thing.motion.displacement)
    if isinstance(shape, Sphere):
        return bool(move.any())
    _, u, v = flat_of(shape)
    normal = np.cross(u, v)
    return abs(move @ normal) > 1e-9 * np.linalg.norm(move) * np.linalg.norm(normal)


def _light_changes(scene, light, p, normals, own, inside, use_penumbra, shifted, dense):
    """Whether a light's part at static hit points p (n, 3) depends on the time.

    `shifted` (n,): the hit itself moves, so any light that reaches it changes. `dense` False
    looks at fewer points of the light and fewer times.
    """
    n = len(p)
    changed = np.zeros(n, dtype=bool)
    movers = [i for i, s in enumerate(scene.shapes) if moves(s)]
    alive = moves(light)
    if not (alive or shifted.any() or (movers and light.casts_shadow)):
        return changed
    zero = np.zeros(n)
    if use_penumbra and is_area(light):
        columns = _moving_samples(scene, light, p, zero, dense)
    else:
        columns = np.zeros((1, n, 2))
    for uv in columns:
        left = np.flatnonzero(~changed)
        if not len(left):
            break
        at = (p[left], normals[left], own[left], inside[left])
        always = alive | shifted[left]
        changed[left] = _point_changes(scene, light, *at, uv[left], always, movers, dense)
    return changed


def _moving_samples(scene, light, p, t, dense):
    """Points (m, n, 2) of a light's uv domain: a coarse grid, and towards each mover's path."""
    columns = [np.broadcast_to(uv, (len(p), 2)) for uv in light_grid(light, 3 if dense else 2)]
    for shape in scene.shapes:
        if moves(shape):
            for when in (-0.5, 0.0, 0.5) if dense else (0.0,):
                for q in landmarks(shape)[: 5 if dense else 1] + when * np.array(
                    shape.motion.displacement
                ):
                    columns.append(aim(light, p, t, np.broadcast_to(q, p.shape)))
    return columns


def _point_changes(scene, light, p, normals, own, inside, uv, always, movers, dense):
    """Whether one point of a light uv (n, 2) is open at some time, and hidden at another.

    `always`: being open at some time is enough.
    """
    n, margin = len(p), MARGIN * extent(scene)
    args = (scene, light, p, normals, own, inside)
    zero = np.zeros(n)
    still = [i for i in range(len(scene.shapes)) if i not in movers]
    free = np.ones(n, dtype=bool)
    if not moves(light):
        free = light_states(*args, zero, uv, still) == OPEN
    some = np.flatnonzero(free)
    result = np.zeros(n, dtype=bool)
    if not len(some):
        return result
    args = (scene, light, p[some], normals[some], own[some], inside[some])
    seen, hidden = np.zeros(len(some), dtype=bool), np.zeros(len(some), dtype=bool)
    way = place(light, p[some], zero[some], uv[some]) - p[some]
    way = way / norm(way)[:, None]
    which = None if moves(light) else movers
    special = closest_times(scene, p[some], way)
    for when in [np.full(len(some), t) for t in TIMES[:: 1 if dense else 4]] + list(special):
        state = light_states(*args, when, uv[some], which)
        front = facing(light, p[some], when) > margin
        seen |= (state == OPEN) & front
        hidden |= (state == BLOCKED) & front
    result[some] = seen & (hidden | np.broadcast_to(always, (n,))[some])
    return result


def edges(scene, pixels, use_penumbra=True, use_motion=True):
    """Blue: an object's outline, or a shadow edge narrower than the pixel, crosses the pixel."""
    result = _outlines(scene, pixels, np.zeros(1), 7)
    if use_motion and any(moves(x) for x in (scene.camera, *scene.shapes)):
        result |= _outlines(scene, pixels, TIMES, 4)
        left = np.flatnonzero(~result)
        result[left] |= _passing_outlines(scene, pixels[left])
    left = np.flatnonzero(~result)
    result[left] |= _shadow_edges(scene, pixels[left], use_penumbra)
    return result


def outlines_seen(scene, pixels, k, times):
    """Whether k x k places of each pixel see more than one object at one of some times."""
    return _outlines(scene, pixels, times, k)


def _outlines(scene, pixels, times, k):
    """Whether the nearest object differs over the pixel at one of some times."""
    n = len(pixels)
    result = np.zeros(n, dtype=bool)
    for when in times:
        spots = [pixels + offset for offset in pixel_grid(k)]
        for shape in scene.shapes:
            move = np.array(shape.motion.displacement) * when if moves(shape) else 0.0
            points = landmarks(shape) + move
            inside, count = squeeze(scene, pixels, points, np.full(len(points), when))
            spots += list(inside.reshape(n, count, 2).transpose(1, 0, 2))
        result |= _differ(scene, spots, np.full(n, when))
    return result


def _differ(scene, spots, when):
    """Whether clear hits through the spots (list of (n, 2)) at times (n,) are not all one shape."""
    n = len(when)
    lowest, highest = np.full(n, len(scene.shapes)), np.full(n, -2)
    for spot in spots:
        o, d, t = camera_rays(scene, spot, when)
        hits = nearest(scene, o, d, t)
        lowest = np.where(hits.clear, np.minimum(lowest, hits.ids), lowest)
        highest = np.where(hits.clear, np.maximum(highest, hits.ids), highest)
    return lowest < highest


def _passing_outlines(scene, pixels):
    """The same at the times when a moving shape comes nearest the pixel's centre."""
    n = len(pixels)
    result = np.zeros(n, dtype=bool)
    o, d, _ = camera_rays(scene, pixels + 0.5, 0.0)
    times = iter(closest_times(scene, o, d))
    for shape in scene.shapes:
        for q in landmarks(shape) if moves(shape) else ():
            when = next(times)
            move = np.array(shape.motion.displacement)
            there = project(scene.camera, q + when[:, None] * move, when)
            there = np.where(np.isfinite(there), there, pixels)
            spots = [pixels + offset for offset in pixel_grid(2)]
            spots.append(np.clip(there, pixels, pixels + 1.0))
            result |= _differ(scene, spots, when)
    return result


def _shadow_edges(scene, pixels, use_penumbra):
    """Whether a light goes from wholly open to wholly hidden within the pixel, above horizons."""
    n = len(pixels)
    result = np.zeros(n, dtype=bool)
    lights = [x for x in scene.lights if x.casts_shadow and not is_dark(x)]
    # some of a sky is open from everywhere outside of shapes, so it has no such edges
    lights = [x for x in lights if not isinstance(x, SkyLight)]
    if not lights or not n:
        return result
    spots = [pixels + offset for offset in pixel_grid(5)]
    spots += _containing(pixels, shadow_landmarks(scene, lights), scene)
    for light in lights:
        crossed = _crossed(scene, light, spots, _center_open)
        some = np.flatnonzero(crossed)
        if use_penumbra and is_area(light) and len(some):
            crossed[some] = _crossed(scene, light, [x[some] for x in spots], _whole_open)
        result |= crossed
    return result


def _containing(pixels, points, scene):
    """List of (n, 2): in each pixel the points (k, 3) that it shows, its centre to fill up."""
    there = project(scene.camera, points, np.zeros(len(points)))
    there = there[np.isfinite(there).all(axis=1)]
    rows = []
    used = np.zeros(len(pixels), dtype=int)
    for spot in there:
        for k in np.flatnonzero((np.floor(spot) == pixels).all(axis=1)):
            if used[k] == len(rows):
                rows.append(pixels + 0.5)
            rows[used[k]][k] = spot
            used[k] += 1
    return rows


def _crossed(scene, light, spots, whole):
    """Whether the light is wholly open at one spot of a pixel and hidden at another: (n,)."""
    o, d, zero = camera_rays(scene, np.concatenate(spots), 0.0)
    hits = nearest(scene, o, d, zero)
    lit, dark = whole(scene, light, hits, zero)
    usable = hits.clear & (hits.ids >= 0)
    seen = (usable & lit).reshape(len(spots), -1).any(axis=0)
    return seen & (usable & dark).reshape(len(spots), -1).any(axis=0)


def _center_open(scene, light, hits, zero):
    """Whether a light's centre, above the horizon, is open; or hidden by a shape: 2 x (n,)."""
    margin = MARGIN * extent(scene)
    uv = np.zeros((len(zero), 2))
    point = place(light, hits.points, zero, uv)
    above = dot(point - hits.points, hits.normals) > margin
    above &= facing(light, hits.points, zero) > margin
    args = (hits.points, point, zero, hits.ids, hits.normals, hits.inside)
    state = states(scene, *args)
    return above & (state == OPEN), above & (state == BLOCKED)


def _whole_open(scene, light, hits, zero):
    """Whether all of an area light is above the horizon and open; or hidden by one shape."""
    margin = MARGIN * extent(scene)
    p, n = hits.points, len(zero)
    front = facing(light, p, zero) > margin
    outline = _outline(light)
    above, bounds = np.ones(n, dtype=bool), np.zeros((len(scene.shapes), n), dtype=bool) | True
    for uv in outline:
        point = place(light, p, zero, np.broadcast_to(uv, (n, 2)))
        above &= dot(point - p, hits.normals) > margin
        for index in range(len(scene.shapes)):
            args = (p, point, zero, hits.ids, hits.normals, hits.inside, [index])
            bounds[index] &= states(scene, *args) == BLOCKED
    hidden = bounds.any(axis=0) & front & above
    lit = front & above & ~hidden
    if lit.any():
        some = np.flatnonzero(lit)
        args = (p[some], hits.normals[some], hits.ids[some], hits.inside[some])
        _, dark = visibility(scene, light, *args, k=5)
        lit[some] &= ~dark
    return lit, hidden


def _outline(light):
    """Points (m, 2) whose hull holds the whole light: what hides them with one shape hides it."""
    if isinstance(light, QuadLight):
        return np.array([(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)])
    if not is_area(light):
        return np.zeros((1, 2))
    angles = np.arange(16) * np.pi / 8.0
    return np.stack([np.cos(angles), np.sin(angles)], axis=1) / np.cos(np.pi / 16.0)
