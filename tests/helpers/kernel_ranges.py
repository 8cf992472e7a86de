# SPDX-License-Identifier: GPL-3.0-or-later
"""Families of kernels of the ground floor: ranges of polynomials, of discriminants over a light,
and lengths of vectors."""

import numpy as np

from adaptive_drt.geometry.sphere.kernels import discriminant, discriminant_rounding
from adaptive_drt.numerics import vector
from adaptive_drt.numerics.jet import Jet
from adaptive_drt.numerics.taylor_range import rectangle_range
from kernel_families import Family, U, across, length, near_one, spread, unit
from oracle import kernels as better
from oracle.numbers import cross, dot


def polynomials(rng, n):
    """Quadratics of two variables over a rectangle, many nearly of rank one or with a flat side."""
    k = spread(rng, -3, 3, n)
    value, gx, gy, xx, xy, yy = rng.normal(size=(6, n)) * k
    line = rng.random(n) < 0.4
    s, t = rng.normal(size=(2, n))
    for part, add in ((0, s * s), (1, s * t), (2, t * t)):
        h = (xx, xy, yy)[part]
        h[line] = (k * add * (1.0 + spread(rng, -16, 0, n)))[line]
    some = rng.random(n) < 0.3
    gx[some], gy[some] = (0.3 * k * s * s)[some], (0.3 * k * s * t)[some]
    xy[rng.random(n) < 0.1] = 0.0
    return {
        "value": value,
        "g": np.stack([gx, gy]),
        "h": np.stack([xx, xy, yy]),
        "half": spread(rng, -3, 0.5, n),
    }


def _range(value, g, h, half):
    # the rectangle is that of a batch: scale the polynomial instead
    jet = Jet(value, tuple(g * half), tuple(h * half * half))
    return np.stack(rectangle_range(jet, 1.0, 1.0))


def _true_range(m, value, g, h, half):
    (gx, gy), (xx, xy, yy) = g * half, h * half * half

    def at(x, y):
        return value + gx * x + gy * y + (xx * x * x + yy * y * y) / 2 + xy * x * y

    one = 1 + 0 * value
    spots = [(x * one, y * one) for x in (-1, 1) for y in (-1, 1)]
    for side in (-one, one):
        for g0, cross_term, bend, upright in ((gy, xy, yy, True), (gx, xy, xx, False)):
            spot = -(g0 + cross_term * side) / better.where(bend == 0, one, bend)
            spot = better.where(abs(spot) < 1, spot, one)
            spots.append((side, spot) if upright else (spot, side))
    det = xx * yy - xy * xy
    safe = better.where(det == 0, one, det)
    x = y = 0 * value
    for _ in range(3):  # a nearly singular system costs digits: refined
        sx, sy = gx + xx * x + xy * y, gy + xy * x + yy * y
        x, y = x + (xy * sy - yy * sx) / safe, y + (xy * sx - xx * sy) / safe
    inside = (abs(x) < 1) & (abs(y) < 1) & (det != 0)
    spots.append((better.where(inside, x, one), better.where(inside, y, one)))
    low = high = at(*spots[0])
    for spot in spots[1:]:
        here = at(*spot)
        low, high = better.where(here < low, here, low), better.where(here > high, here, high)
    return np.stack([low, high])


def _range_bound(value, g, h, half):
    size = np.abs(value) + (np.abs(g) * half).sum(axis=0) + (np.abs(h) * half * half).sum(axis=0)
    return 8.0 * U * np.stack([size, size])


RANGES = Family(
    "range of a quadratic over a rectangle",
    "8 u (|f| + |f_x| + |f_y| + |f_xx| + |f_xy| + |f_yy|), half sides of 1",
    polynomials,
    _range,
    _true_range,
    _range_bound,
)


def light_and_ball(rng, n):
    """Parallelograms of lights, and spheres that nearly touch a line to their outline."""
    to = unit(rng, n) * spread(rng, -6, 6, n)
    size = length(to) * spread(rng, -3, 0.5, n)
    a, b = unit(rng, n) * size, unit(rng, n) * size * spread(rng, -1, 0, n)
    aim = to + rng.choice([-1.0, 1.0], n) * a + rng.uniform(-1, 1, n) * b
    ray = aim / length(aim)
    where = rng.uniform(0.1, 0.9, n) * length(aim)
    r = spread(rng, -8, -0.5, n) * where
    upright = cross(ray, b)
    upright /= np.maximum(length(upright), 1e-300)
    side = np.where(rng.random(n) < 0.8, upright, across(rng, ray))
    v = where * ray + rng.choice([-1.0, 1.0], n) * r * near_one(rng, n) * side
    return {"to": to, "a": a, "b": b, "v": v, "r": r}


def _ball_range(to, a, b, v, r):
    return np.stack(rectangle_range(discriminant(Jet.linear(to, (a, b), 2), v, r), 1.0, 1.0))


def _true_ball_range(m, to, a, b, v, r):
    def at(x, y):
        w = to + x * a + y * b
        side = cross(w, v)
        return r * r * dot(w, w) - dot(side, side)

    value = at(0, 0)
    p, q, s, t = at(1, 0), at(-1, 0), at(0, 1), at(0, -1)
    xy = (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / 4
    bends = np.stack([p + q - 2 * value, xy, s + t - 2 * value])
    return _true_range(m, value, np.stack([(p - q) / 2, (s - t) / 2]), bends, 1 + 0 * value)


def _ball_range_bound(to, a, b, v, r):
    reach = np.maximum(length(a + b), length(a - b))
    far, away = length(to) + reach, length(v)
    miss = length(cross(to, v)) + reach * away
    bound = discriminant_rounding(far * far, away * away, r, miss)
    return np.stack([bound, bound])


BALL_RANGE = Family(
    "range of a discriminant over a quad light",
    "32 u (r^2 |w|^2 + max(r |w|, |w x v|) |w||v|), the greatest w of the light",
    light_and_ball,
    _ball_range,
    _true_ball_range,
    _ball_range_bound,
)


def vectors(rng, n):
    return {"a": rng.normal(size=(3, n)) * spread(rng, -6, 6, (3, n))}


LENGTHS = Family(
    "length and direction of a vector",
    "4 u relative",
    vectors,
    lambda a: np.concatenate([vector.norm(a)[None], vector.normalize(a)]),
    lambda m, a: np.concatenate([m.norm(a)[None], a / m.norm(a)]),
    lambda a: 4.0 * U * np.concatenate([length(a)[None], np.abs(a) / length(a)]),
)
