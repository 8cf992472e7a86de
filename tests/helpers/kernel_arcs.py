# SPDX-License-Identifier: GPL-3.0-or-later
"""Families of kernels on the sphere of directions: crossings of arcs, unions of their intervals,
and light summed over arcs."""

import numpy as np

from adaptive_drt.geometry import spherical_curves as arcs
from adaptive_drt.geometry.silhouettes import CircularSilhouette
from adaptive_drt.lights.occluded_form_factor import visible_factor
from kernel_families import Family, U, across, length, near_one, spread, unit
from kernel_lights import cone_and_normal, nearest_edge, quad_and_point
from oracle import kernels as better
from oracle.numbers import cross, dot

TURN = 2.0 * np.pi


def cones(rng, n):
    """Axes (3, n), sines and cosines (n,) of cones of 1e-6 to 90 degrees."""
    half = np.where(rng.random(n) < 0.5, spread(rng, -6, 0.19, n), rng.uniform(0.01, 1.5707, n))
    return unit(rng, n), np.sin(half), np.cos(half)


def cone_and_plane(rng, n):
    """Cones, planes that cross, touch or miss them, and arcs of these shorter than half a turn."""
    axis, sine, cosine = cones(rng, n)
    tilt = rng.uniform(-1, 1, n)
    some = rng.random(n) < 0.5
    tilt[some] = (rng.choice([-1.0, 1.0], n) * near_one(rng, n))[some]
    mu = np.clip(sine * tilt, -1.0, 1.0)
    side = across(rng, axis)
    normal = mu * axis + np.sqrt((1.0 - mu) * (1.0 + mu)) * side
    normal /= length(normal)
    foot = axis - dot(axis, normal) * normal
    size = length(foot)
    foot = np.where(size > 1e-3, foot, across(rng, normal))
    foot -= dot(foot, normal) * normal
    foot /= length(foot)
    turn, half = rng.uniform(-1.5, 1.5, n), spread(rng, -6, 0.15, n)
    along = cross(normal, foot)
    ends = [np.cos(turn + s * half) * foot + np.sin(turn + s * half) * along for s in (-1, 1)]
    start, end = (p / length(p) for p in ends)
    center = np.where(rng.random(n) < 0.5, unit(rng, n), axis + spread(rng, -9, 0, n) * side)
    return {
        "axis": axis,
        "sine": sine,
        "cosine": cosine,
        "normal": normal,
        "start": start,
        "end": end,
        "center": center / length(center),
    }


def _circles(axis, sine, cosine, center):
    return arcs.make_circles(axis[:, None], sine[None], cosine[None], center)


def _segments(normal, start, end):
    planes = arcs.HalfSpaces(normal[:, None], np.zeros((1, normal.shape[1])))
    return arcs.make_great_circle_arcs(start[:, None], end[:, None], planes)


def _in_cone(axis, sine, cosine, normal, start, end, center):
    """The interval, and the frame of the segment that it is counted in."""
    segment = _segments(normal, start, end)
    low, high = arcs.arcs_inside_cones(segment, _circles(axis, sine, cosine, center))
    return np.concatenate([low[0], high[0], segment.middle[:, 0], segment.along[:, 0]])


def _crossing_bound(axis, normal, **_):
    steep = np.maximum(length(cross(normal, axis)), U**0.5)
    return np.stack([8.0 * U / steep] * 2)


def _off_cone(m, got, axis, sine, cosine, normal, start, end, center):
    """How far from the cone's circle (rad) an interval's ends are; how far its middle is wrong."""
    del normal, start, end, center
    middle, along = got[2:5], got[5:8]
    half = m.atan2(sine, cosine)
    off = []
    for phi in got[:2]:
        place = m.cos(phi) * middle + m.sin(phi) * along
        off.append(m.angle(place, axis) - half)
    empty = got[1] <= got[0]
    # an empty interval: the nearest place is no deeper inside than this
    return np.stack([better.where(empty & (x > 0), 0 * x, x) for x in off])


SPANS_IN_CIRCLES = Family(
    "arcs of great circles in cones",
    "ends within 8 u / |n x a| rad of the cone's circle",
    cone_and_plane,
    _in_cone,
    None,
    _crossing_bound,
    _off_cone,
)


def _outside(axis, sine, cosine, normal, start, end, center):
    circle = _circles(axis, sine, cosine, center)
    planes = arcs.HalfSpaces(normal[:, None], np.zeros((1, normal.shape[1])))
    middle, half = arcs.circles_outside_half_spaces(circle, planes)
    return np.concatenate([middle[0], half[0], circle.u[:, 0], circle.w[:, 0]])


def _off_plane(m, got, axis, sine, cosine, normal, start, end, center):
    """How far from the plane (rad) the ends are, or how far outside or inside all of it is."""
    middle, half, u, w = got[0], got[1], got[2:5], got[5:8]
    size = m.sqrt(sine * sine + cosine * cosine)
    off = []
    for sign in (-1, 1):
        phi = middle + sign * half
        place = cosine / size * axis + sine / size * (m.cos(phi) * u + m.sin(phi) * w)
        off.append(dot(normal, place) / m.norm(normal))
    # the farthest on either side, where the circle does not cross
    side = dot(normal, axis) * cosine / size
    reach = sine / size * m.norm(cross(normal, axis))
    none, every = half <= 0, half >= m.pi * (1 - 2.0**-50)
    off = [better.where(none, -better.positive(reach - side), x) for x in off]
    return np.stack([better.where(every, better.positive(reach + side), x) for x in off])


OUTSIDE_PLANES = Family(
    "circles outside half-spaces",
    "ends within 8 u / |n x a| rad of the plane",
    cone_and_plane,
    _outside,
    None,
    _crossing_bound,
    _off_plane,
)


def two_cones(rng, n):
    """Cones that cross, touch from outside or within, are nearly or wholly the same."""
    axis, sine, cosine = cones(rng, n)
    alpha = np.arctan2(sine, cosine)
    beta = np.where(rng.random(n) < 0.5, alpha * near_one(rng, n), spread(rng, -6, 0.19, n))
    beta = np.clip(beta, 1e-6, 1.5707)
    gap = np.abs(alpha + rng.choice([-1.0, 1.0], n) * beta) * near_one(rng, n)
    gap = np.where(rng.random(n) < 0.3, rng.uniform(0, 1, n) * (alpha + beta), gap)
    gap = np.where(rng.random(n) < 0.1, 0.0, gap)
    other = np.cos(gap) * axis + np.sin(gap) * across(rng, axis)
    center = axis + spread(rng, -9, 0, n) * unit(rng, n)
    return {
        "axis": axis,
        "sine": sine,
        "cosine": cosine,
        "other": other / length(other),
        "sine_b": np.sin(beta),
        "cosine_b": np.cos(beta),
        "center": center / length(center),
    }


def _within(axis, sine, cosine, other, sine_b, cosine_b, center):
    a = _circles(axis, sine, cosine, center)
    b = _circles(other, sine_b, cosine_b, center)
    middle, inside, outside = arcs.circles_inside_cones(a, b, np.ones((1, 1)))
    return np.concatenate([middle, inside, outside, a.u[:, 0], a.w[:, 0]])


def _off_circle(m, got, axis, sine, cosine, other, sine_b, cosine_b, center):
    """How far from the other circle (rad) the ends are; how deep all of it is where none are."""
    del center
    middle, inside, outside, u, w = got[0], got[1], got[2], got[3:6], got[6:9]
    size = m.sqrt(sine * sine + cosine * cosine)
    beta, gap = m.atan2(sine_b, cosine_b), m.angle(axis, other)
    alpha = m.atan2(sine, cosine)
    off = []
    for sign in (-1, 1):
        phi = middle + sign * inside
        place = cosine / size * axis + sine / size * (m.cos(phi) * u + m.sin(phi) * w)
        off.append(m.angle(place, other) - beta)
    none, every = inside <= 0, outside <= 0
    off = [better.where(none, better.positive(beta - abs(gap - alpha)), x) for x in off]
    off = [better.where(every, better.positive(gap + alpha - beta), x) for x in off]
    return np.stack([*off, inside + outside - m.pi])


WITHIN_CIRCLES = Family(
    "circles inside cones",
    "ends within 24 u / cos(g / 2) rad of the other circle, g between the axes",
    two_cones,
    _within,
    None,
    lambda axis, other, **_: np.stack(
        [24.0 * U / np.maximum(0.5 * length(axis + other), U**0.5)] * 3
    ),
    _off_circle,
)


SPANS = 6


def intervals(rng, n):
    """Intervals of a circle, some empty, whole, alike, or ending where another starts."""
    center = rng.uniform(-np.pi, 2.0 * np.pi, (SPANS, n))
    half = rng.uniform(0.0, 0.9, (SPANS, n))
    some = rng.random((SPANS, n)) < 0.3
    half[some] = spread(rng, -12, 0.49, some.sum())
    half[rng.random((SPANS, n)) < 0.1] = 0.0
    half[rng.random((SPANS, n)) < 0.02] = np.pi
    half = np.minimum(half, np.pi)
    alike = rng.random(n) < 0.2
    center[1, alike], half[1, alike] = center[0, alike], half[0, alike]
    meets = rng.random(n) < 0.2
    center[2, meets] = (center[3] + half[3] + half[2])[meets] % TURN
    return {"center": center, "half": half}


def _left(center, half):
    low, high = arcs.complement_on_circle(center[:, None], half[:, None])
    return (high - low).sum(axis=0)[0]


def _true_left(m, center, half):
    """What intervals leave of a turn: sorted by their starts, each adds what lies past the last."""
    turn = 2 * m.pi
    start = center - half
    start = better.where(start < -m.pi, start + turn, start)
    start = better.where(start >= m.pi, start - turn, start)
    starts = np.concatenate([start - turn, start])  # what wraps comes in again from below
    ends = starts + 2 * np.concatenate([half, half])
    order = np.argsort(starts, axis=0)
    reached, left = -m.pi + 0 * half[0], 0 * half[0]
    for k in range(2 * SPANS):
        row = order[k : k + 1]
        s, e = (np.take_along_axis(x, row, axis=0)[0] for x in (starts, ends))
        left = left + better.positive(s - reached)
        reached = better.where(e > reached, e, reached)
    return left + better.positive(m.pi - reached)


CIRCLE_GAPS = Family(
    "what intervals leave of a circle",
    "8 u rad an interval",
    intervals,
    _left,
    _true_left,
    lambda center, half: np.full(center.shape[1], 8.0 * U * SPANS),
)


def _open_quad(to, a, b, up):
    corners = np.stack(better.quad_corners(to, a, b))
    none = np.zeros((0, 3, up.shape[1])), np.zeros((0, up.shape[1]))
    return visible_factor(corners, up, none, np.zeros((0, 4, 3, up.shape[1])))


def _true_open_quad(m, to, a, b, up):
    to, a, b = (np.asarray(x).astype(np.float64) for x in (to, a, b))
    return better.lambert(m, [m.lift(c) for c in better.quad_corners(to, a, b)], up)


def _open_quad_bound(to, a, b, up):
    corners = better.quad_corners(to, a, b)
    h = np.maximum(nearest_edge(corners, up), U * (length(a) + length(b)))
    bound = 32.0 * U * (length(a) + length(b)) / h
    return np.where(bound > 0.1, np.inf, bound)  # in the plane of a vast light, to rounding


OPEN_QUAD = Family(
    "quad light by arcs",
    "32 u (|a| + |b|) / h sr",
    quad_and_point,
    _open_quad,
    _true_open_quad,
    _open_quad_bound,
)


def cone_light(rng, n):
    inputs = cone_and_normal(rng, n)
    axis = unit(rng, n)
    c = inputs["cosine"]
    up = c * axis + np.sqrt((1.0 - c) * (1.0 + c)) * across(rng, axis)
    return {"axis": axis, "sine": inputs["sine"], "other": inputs["other"], "up": up / length(up)}


def _open_cone(axis, sine, other, up):
    n = up.shape[1]
    none = np.zeros((0, 3, n)), np.zeros((0, n))
    return visible_factor(CircularSilhouette(axis, other, sine), up, none, np.zeros((0, 4, 3, n)))


OPEN_CONE = Family(
    "round light by arcs",
    "32 u sin a sr",
    cone_light,
    _open_cone,
    lambda m, axis, sine, other, up: better.cap(m, dot(up, axis) / m.norm(axis), sine, other),
    lambda axis, sine, other, up: 32.0 * U * sine,
)
