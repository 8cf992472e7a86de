# SPDX-License-Identifier: GPL-3.0-or-later
"""Families of light that occluders hide in part: what must add up, does.

`tests/lights/test_occluded_form_factor.py` holds these against quadrature; here it is the same
light, whole and in two halves, and the same occluders, nearer and farther, over sizes that
quadrature cannot reach.
"""

import numpy as np

from adaptive_drt.geometry.silhouettes import CircularSilhouette
from adaptive_drt.lights.occluded_form_factor import visible_factor
from kernel_families import Family, U, across, length, spread, unit
from oracle.numbers import cross, dot

BALLS, SHEETS = 3, 2


def _occluders(rng, n, to, size):
    """Spheres and quads before a light, as large as it looks to 1e-6 of that, near its outline."""
    far = length(to)
    place, radius, quads = [], [], []
    for _ in range(BALLS):
        t = rng.uniform(0.1, 0.9, n)
        r = t * size * spread(rng, -6, 0.5, n)
        aim = to + size * rng.uniform(0, 1.2, n) * across(rng, to / far)
        r = np.minimum(r, 0.9 * t * length(aim))
        place.append(t * aim + r * rng.uniform(0, 1, n) * unit(rng, n))
        radius.append(np.minimum(r, 0.99 * length(place[-1])))
    for _ in range(SHEETS):
        t = rng.uniform(0.1, 0.8, n)
        c = t * (to + size * rng.uniform(0, 1, n) * across(rng, to / far))
        a = t * size * spread(rng, -3, 0.3, n) * unit(rng, n)
        b = t * size * spread(rng, -3, 0.3, n) * unit(rng, n)
        quads.append(np.stack([c + a + b, c - a + b, c - a - b, c + a - b]))
    return {"place": np.stack(place, 1), "radius": np.stack(radius), "quads": np.stack(quads, 2)}


def _facing(rng, n):
    """A direction and distance to a light, and a normal that mostly looks at it."""
    axis = unit(rng, n)
    up = axis + rng.uniform(0, 1.5, n) * across(rng, axis)
    return axis * spread(rng, -6, 6, n), up / length(up)


def quad_and_occluders(rng, n):
    to, up = _facing(rng, n)
    far = length(to)
    size = far * spread(rng, -5, 0, n)
    a = across(rng, to / far)
    b = cross(to / far, a) + rng.uniform(-1, 1, n) * (to / far)
    aspect = spread(rng, -2, 0, n)
    inputs = {"to": to, "up": up, "a": a * size, "b": b * size * aspect}
    return {**inputs, **_occluders(rng, n, to, size)}


def _corners(c, a, b):
    return np.stack([c + a + b, c - a + b, c - a - b, c + a - b])


def _halves(to, up, a, b, place, radius, quads):
    """A light and its halves along either side: what is left of the sum."""
    spheres, sheets = (place.swapaxes(0, 1), radius), quads.transpose(2, 0, 1, 3)
    whole = visible_factor(_corners(to, a, b), up, spheres, sheets)
    first = [
        visible_factor(_corners(to + s * a, a / 2, b), up, spheres, sheets) for s in (-0.5, 0.5)
    ]
    second = [
        visible_factor(_corners(to + s * b, a, b / 2), up, spheres, sheets) for s in (-0.5, 0.5)
    ]
    return np.stack([sum(first) - whole, sum(second) - whole, np.minimum(whole, 0.0)])


def _halves_bound(to, up, a, b, **_):
    far = length(to)
    return np.stack([64.0 * U * (length(a) + length(b)) / far] * 3)


PARTLY_HIDDEN_QUAD = Family(
    "partly hidden quad light and its halves",
    "64 u (|a| + |b|) / d sr",
    quad_and_occluders,
    _halves,
    lambda m, to, **_: m.lift(np.zeros((3, to.shape[1]))),
    _halves_bound,
)


def cone_and_occluders(rng, n):
    to, up = _facing(rng, n)
    half = np.where(rng.random(n) < 0.7, spread(rng, -5, 0.1, n), rng.uniform(0.1, 1.5, n))
    size = length(to) * np.minimum(np.tan(half), 1.0)
    return {"to": to, "up": up, "half": half, **_occluders(rng, n, to, size)}


def _nearer(to, up, half, place, radius, quads):
    """A round light behind occluders, and behind the same twice, at other depths."""
    light = CircularSilhouette(to / length(to), np.cos(half), np.sin(half))
    sheets = quads.transpose(2, 0, 1, 3)
    once = visible_factor(light, up, (place.swapaxes(0, 1), radius), sheets)
    more = np.concatenate([place, 0.37 * place], axis=1), np.concatenate([radius, 0.37 * radius])
    both = np.concatenate([0.61 * sheets, sheets])
    twice = visible_factor(light, up, (more[0].swapaxes(0, 1), more[1]), both)
    none = visible_factor(light, up, (place.swapaxes(0, 1)[:0], radius[:0]), sheets[:0])
    return np.stack([twice - once, np.maximum(once - none, 0.0), np.minimum(once, 0.0)])


def _nearer_bound(half, quads, **_):
    """Sheets that coincide cut each other's edges off at places that a thin one leaves open."""
    first, second = quads[1] - quads[0], quads[2] - quads[1]
    side = np.maximum(length(first), length(second))
    far = np.min([length(corner) for corner in quads], axis=0)
    farthest = np.max([length(corner) for corner in quads], axis=0)
    thin = np.abs(dot(cross(first, second), quads[0])) / (side * farthest**2)
    loose = np.minimum(side / far, 1.0) / np.maximum(thin, 1e-300)
    return np.stack([64.0 * U * (np.sin(half) + loose.sum(axis=0))] * 3)


PARTLY_HIDDEN_CONE = Family(
    "partly hidden round light, occluders doubled",
    "64 u (sin a + length over width as seen, of each sheet) sr",
    cone_and_occluders,
    _nearer,
    lambda m, to, **_: m.lift(np.zeros((3, to.shape[1]))),
    _nearer_bound,
)
