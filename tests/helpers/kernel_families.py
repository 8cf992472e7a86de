# SPDX-License-Identifier: GPL-3.0-or-later
"""Families of kernels: random hostile inputs, the core's answer, a better one, the stated bound.

Sizes run over 1e-6 to 1e6, distances to 1e6, aspect ratios to 1e6. `tests/test_kernels.py` holds a
few thousand of each against 50 digits, `benchmarks/stress_kernels.py` a million against long
doubles and the worst against 50 digits.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from adaptive_drt.geometry.polygon import kernels as quad
from adaptive_drt.geometry.sphere import kernels as quadric
from oracle import kernels as better
from oracle.numbers import cross, dot

U = 2.0**-53


@dataclass(frozen=True)
class Family:
    """One kernel under test.

    `sample(rng, n)` makes a dict of inputs, the last axis of each counts the n cases.
    `core(**inputs)` is the kernel's answer, `true(m, **inputs)` the same by better numbers (both
    (..., n)), `bound(**inputs)` the greatest error that is promised, inf where none is.
    Decisions: `core` gives bool and `true` the margin by which the answer is yes; an error is the
    margin of a wrong answer. Where many answers are right, `residual(m, got, **inputs)` says by how
    much one is not. `digits` tells whether `true` is as good as the numbers m: else it is brute
    force in float64, and bounds are those that are asked for. `share` is the part of a long run's
    cases that the family gets, where brute force takes milliseconds for each. `quick(**inputs)` is
    `true` by less work, good to a small part of the bound: a run looks at all cases by it, and by
    `true` at those that it does not find well within their bound.
    """

    name: str
    promise: str
    sample: Callable
    core: Callable
    true: Callable | None
    bound: Callable
    residual: Callable | None = None
    digits: bool = True
    share: float = 1.0
    quick: Callable | None = None

    def error(self, m, inputs, got):
        """Errors (..., n) of the core's answers, as float64."""
        lifted = {key: m.lift(value) for key, value in inputs.items()}
        if self.residual:
            return np.abs(np.asarray(self.residual(m, m.lift(got), **lifted)).astype(np.float64))
        want = self.true(m, **lifted)
        if got.dtype == bool:
            margin = np.asarray(want).astype(np.float64)
            return np.where(got == (margin > 0.0), 0.0, np.abs(margin))
        return np.abs(np.asarray(m.lift(got) - want).astype(np.float64))


def length(a):
    return np.sqrt(dot(a, a))


def unit(rng, n):
    a = rng.normal(size=(3, n))
    a[:, rng.random(n) < 0.1] *= 1e-9  # nothing along an axis ...
    some = rng.random(n) < 0.2
    a[rng.integers(0, 3, n)[some], np.flatnonzero(some)] = 1.0  # ... or all
    return a / length(a)


def across(rng, a):
    """Unit vectors at right angles to unit vectors."""
    b = cross(a, unit(rng, a.shape[1]))
    size = length(b)
    lost = size < 1e-6
    b[:, lost] = cross(a, a[[1, 2, 0]] * np.array([[1.0], [-1.0], [1.0]]))[:, lost]
    return b / length(b)


def spread(rng, low, high, n):
    """Numbers spread evenly over decades 10^low to 10^high."""
    return 10.0 ** rng.uniform(low, high, n)


def near_one(rng, n):
    """1 give or take 10^-16 to 10: what grazes, touches, or passes."""
    return np.abs(1.0 + rng.choice([-1.0, 1.0], n) * spread(rng, -16, 0.5, n))


def ray_and_sphere(rng, n):
    """Rays that mostly pass near a sphere's outline, from near its surface, far off, or within."""
    direction = unit(rng, n)
    radius = spread(rng, -6, 6, n)
    miss = radius * near_one(rng, n)
    depth = np.where(rng.random(n) < 0.5, spread(rng, -6, 6, n), radius * near_one(rng, n))
    depth *= rng.choice([-1.0, 1.0], n, p=[0.1, 0.9])
    v = depth * direction + miss * across(rng, direction)
    some = rng.random(n) < 0.3  # anywhere
    v[:, some] = (length(v) * unit(rng, n))[:, some]
    return {"w": direction * spread(rng, -3, 3, n), "v": v, "r": radius}


def miss_of(w, v):
    return length(cross(w, v))


def _discriminant_bound(w, v, r):
    return quadric.discriminant_rounding(dot(w, w), dot(v, v), r, miss_of(w, v))


DISCRIMINANT = Family(
    "discriminant",
    "32 u (r^2 w.w + max(r |w|, |w x v|) |w||v|)",
    ray_and_sphere,
    lambda w, v, r: quadric.discriminant(w, v, r),
    better.discriminant,
    _discriminant_bound,
)


def _hit(w, v, r):
    """Place of the hit along the ray in metres; a number beyond all for a miss."""
    t = quadric.intersect_sphere(w, v, r)
    return np.where(np.isfinite(t), t, 0.0) * length(w)


def _true_hit(m, w, v, r):
    near, far, half = better.sphere_roots(m, w, v, r)
    first = better.where(near > 0, near, far)
    return better.where((half > 0) & (first > 0), first, 0 * first)


def _hit_bound(w, v, r):
    """As in `hit_sphere`'s docstring; inf where rounding may have decided whether it hits."""
    ww, vv = dot(w, w), dot(v, v)
    rough = quadric.discriminant_rounding(ww, vv, r)
    d = quadric.discriminant(w, v, r)
    half = np.sqrt(np.maximum(d, 0.0) / ww)
    bound = 8.0 * U * (np.sqrt(vv) + r) + 0.5 * rough / ww / np.where(d > 0.0, half, 1.0)
    foot = dot(w, v) / length(w)
    unsure = np.minimum(np.abs(foot - half), np.abs(foot + half)) <= 2.0 * bound
    unsure = np.where(d < -2.0 * rough, False, unsure | (d < 2.0 * rough))
    return np.where(unsure, np.inf, bound)


HIT_SPHERE = Family(
    "hit of a sphere",
    "8 u (|v| + r) + 16 u r (r + |v|) / h metres, h half the chord",
    ray_and_sphere,
    _hit,
    _true_hit,
    _hit_bound,
)


def segment_and_sphere(rng, n):
    """Segments that end near a sphere's surface, or near its centre's foot, or far beyond."""
    inputs = ray_and_sphere(rng, n)
    w, v, r = inputs["w"], inputs["v"], inputs["r"]
    d = w / length(w)
    foot = np.abs(dot(d, v))
    half = np.sqrt(np.maximum((r - length(cross(d, v))) * (r + length(cross(d, v))), 0.0))
    end = np.where(rng.random(n) < 0.5, foot, np.abs(foot - half)) * near_one(rng, n)
    return {"w": d * np.maximum(end, 1e-12), "v": v, "r": r}


def _true_block(m, w, v, r):
    """Margin in metres: the surface cuts a segment that comes nearer than r, and farther than r."""
    ww, foot = dot(w, w), dot(w, v)
    nearest = m.norm(cross(w, v)) / m.sqrt(ww)
    nearest = better.where(foot <= 0, m.norm(v), nearest)
    nearest = better.where(foot >= ww, m.norm(v - w), nearest)
    first, last = m.norm(v), m.norm(v - w)
    farthest = better.where(first > last, first, last)
    return better.where(r - nearest < farthest - r, r - nearest, farthest - r)


BLOCKS_SEGMENT = Family(
    "sphere before a segment",
    "16 u (r + |v|) metres: nearer to contact the answer may be either",
    segment_and_sphere,
    lambda w, v, r: quadric.sphere_blocks_segment(w, v, r),
    _true_block,
    lambda w, v, r: 16.0 * U * (r + length(v)),
)


def cone_and_sphere(rng, n):
    """Cones whose rim is near a sphere's outline, from outside or from within; points outside."""
    v = unit(rng, n) * spread(rng, -6, 6, n)
    far = length(v)
    r = far * np.minimum(np.where(rng.random(n) < 0.7, spread(rng, -12, 0, n), near_one(rng, n)), 1)
    alpha = np.arcsin(np.minimum(r / far, 1.0))
    half = np.where(rng.random(n) < 0.5, spread(rng, -12, 0.19, n), alpha * near_one(rng, n))
    half = np.minimum(half, 0.5 * np.pi)
    turn = np.abs(alpha + rng.choice([-1.0, 1.0], n) * half * near_one(rng, n)) % np.pi
    a = v / far
    axis = np.cos(turn) * a + np.sin(turn) * across(rng, a)
    axis /= length(axis)
    return {"axis": axis, "cosine": np.cos(half), "sine": np.sin(half), "v": v, "r": r}


def _cone_slack(v, r):
    vv = dot(v, v)
    tangent = np.sqrt(np.maximum(vv - r * r, 0.0))
    return quadric.CONE_OPERATIONS * U * vv / np.maximum(tangent, np.sqrt(U * vv))


def _true_touch(m, axis, cosine, sine, v, r):
    """How much longer (metres, along the axis) v reaches than the touching cone's rim allows."""
    size = m.sqrt(cosine * cosine + sine * sine)
    tangent = m.sqrt(better.positive(dot(v, v) - r * r))
    rim = (tangent * cosine - r * sine) / size
    return dot(axis, v) / m.norm(axis) - rim


def _true_cover(m, axis, cosine, sine, v, r):
    size = m.sqrt(cosine * cosine + sine * sine)
    tangent = m.sqrt(better.positive(dot(v, v) - r * r))
    rim = (tangent * cosine + r * sine) / size
    wider = r - m.norm(v) * sine / size
    reach = dot(axis, v) / m.norm(axis) - rim
    return better.where(reach < wider, reach, wider)


CONE_TOUCHES = Family(
    "cone that a sphere touches",
    "decided for sure beyond 2 * 16 u |v|^2 / max(tangent, u^1/2 |v|) metres; never false no",
    cone_and_sphere,
    lambda axis, cosine, sine, v, r: quadric.cone_overlap(axis, cosine, sine, v, r)[0],
    _true_touch,
    lambda axis, cosine, sine, v, r: 2.0 * _cone_slack(v, r),
)
CONE_COVERED = Family(
    "cone that a sphere covers",
    "decided for sure beyond 2 * 16 u |v|^2 / max(tangent, u^1/2 |v|) metres; never false yes",
    cone_and_sphere,
    lambda axis, cosine, sine, v, r: quadric.cone_overlap(axis, cosine, sine, v, r)[1],
    _true_cover,
    lambda axis, cosine, sine, v, r: 2.0 * _cone_slack(v, r),
)


def ray_and_quad(rng, n):
    """Rays near an edge or a corner of thin, skew, tiny and vast parallelograms, grazing too."""
    a = unit(rng, n)
    skew = np.where(rng.random(n) < 0.7, 0.0, rng.uniform(-3.0, 3.0, n))
    b = (across(rng, a) + skew * a) * spread(rng, -6, 6, n)
    a = a * length(b) * spread(rng, -6, 6, n)
    size = 1e6 / np.maximum(length(a), length(b))
    shrink = np.minimum(1.0, size)
    a, b = a * shrink, b * shrink
    s = np.where(rng.random(n) < 0.5, rng.random(n), near_one(rng, n) - rng.integers(0, 2, n))
    t = np.where(rng.random(n) < 0.5, rng.random(n), near_one(rng, n) - rng.integers(0, 2, n))
    aim = s * a + t * b
    eye = unit(rng, n) * spread(rng, -6, 6, n)
    low = rng.random(n) < 0.3  # grazing
    side = cross(a, b) / length(cross(a, b))
    eye[:, low] -= ((1.0 - spread(rng, -12, 0, n)) * dot(eye, side) * side)[:, low]
    q = -(eye + aim * (rng.random(n) < 0.9))
    w = (q + aim) * spread(rng, -3, 3, n)
    return {"w": w, "q": q, "a": a, "b": b}


def _plane_sizes(q, a, b):
    """Products of lengths behind each of the four edge functions."""
    corner, far = length(q), (length(q + a), length(q + b))
    la, lb = length(a), length(b)
    return np.stack([corner * lb, corner * la, far[0] * lb, far[1] * la])


def _true_planes(m, w, q, a, b):
    normal = cross(a, b)
    side = better.where(dot(q, normal) < 0, -1, 1)
    ends = (cross(b, q), cross(q, a), cross(q + a, b), cross(a, q + b))
    return np.stack([side * dot(w, end) for end in ends])


def _core_planes(w, q, a, b):
    planes, _, _ = quad.edge_planes(q, a, b)
    return np.stack([dot(w, plane) for plane in planes])


def _planes_bound(w, q, a, b):
    height = np.abs(dot(q, cross(a, b)))
    known = height > 8.0 * U * length(q) * length(a) * length(b)  # else the side is not
    return np.where(known, 8.0 * U * length(w) * _plane_sizes(q, a, b), np.inf)


EDGE_PLANES = Family(
    "edge functions of a quad",
    "8 u |w| |corner| |edge|, 16 u |w||q||a||b| / |q.n| relative where it is seen edge-on",
    ray_and_quad,
    _core_planes,
    _true_planes,
    _planes_bound,
)


def _quad_depth(w, q, a, b):
    t = quad.intersect_quad(w, *quad.edge_planes(q, a, b))
    return np.where(np.isfinite(t), t, 0.0)


def _true_quad_depth(m, w, q, a, b):
    normal = cross(a, b)
    height, facing = dot(q, normal), dot(w, normal)
    inside = height != 0
    for plane in _true_planes(m, w, q, a, b):
        inside = inside & (plane >= 0)
    inside = inside & (height * facing > 0)
    return better.where(inside, height / better.where(inside, facing, 1), 0 * height)


def _quad_depth_bound(w, q, a, b):
    """As in `hit_quad`'s docstring; inf where rounding may have decided whether it hits."""
    normal = cross(a, b)
    sizes = length(a) * length(b)
    height, facing = np.abs(dot(q, normal)), np.abs(dot(w, normal))
    off_height, off_facing = 4.0 * U * length(q) * sizes, 4.0 * U * length(w) * sizes
    unsure = (height <= 2.0 * off_height) | (facing <= 2.0 * off_facing)
    unsure |= (np.abs(_core_planes(w, q, a, b)) <= _planes_bound(w, q, a, b)).any(axis=0)
    safe = np.where(unsure, 1.0, facing)
    bound = (off_height + height * (off_facing / safe)) / safe
    return np.where(unsure, np.inf, bound)


HIT_QUAD = Family(
    "hit of a quad",
    "4 u |a||b| (|q| + t |w|) / |w.n| in units of t",
    ray_and_quad,
    _quad_depth,
    _true_quad_depth,
    _quad_depth_bound,
)


def _true_in_front(m, w, q, a, b):
    """Margin, over the size of the terms, by which a quad cuts the segment from 0 to w."""
    normal = cross(a, b)
    height, facing = dot(q, normal), dot(w, normal)
    side = better.where(height < 0, -1, 1)
    size = m.norm(a) * m.norm(b) * (m.norm(w) + m.norm(q))
    margin = side * (facing - height) / size
    margin = better.where(abs(height) / size < margin, abs(height) / size, margin)
    scale = m.norm(w) * _true_sizes(m, q, a, b)
    for plane in _true_planes(m, w, q, a, b) / scale:
        margin = better.where(plane < margin, plane, margin)
    # on the other side of the plane all may be different
    return better.where(-margin > abs(height) / size, -abs(height) / size, margin)


def _true_sizes(m, q, a, b):
    corner, la, lb = m.norm(q), m.norm(a), m.norm(b)
    return np.stack([corner * lb, corner * la, m.norm(q + a) * lb, m.norm(q + b) * la])


def segment_and_quad(rng, n):
    inputs = ray_and_quad(rng, n)
    inputs["w"] = inputs["w"] / spread(rng, -3, 3, n)
    return inputs


QUAD_BLOCKS = Family(
    "quad before a segment",
    "8 u of the product of lengths behind each side: nearer to contact either answer",
    segment_and_quad,
    lambda w, q, a, b: quad.quad_blocks_segment(w, *quad.edge_planes(q, a, b)),
    _true_in_front,
    lambda w, q, a, b: np.full(w.shape[1], 8.0 * U),
)
