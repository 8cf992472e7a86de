# SPDX-License-Identifier: GPL-3.0-or-later
"""Families of kernels of light: the cone in which a light is seen, and points on it."""

import numpy as np

from adaptive_drt.lights.quad_light import QuadEmitter
from adaptive_drt.lights.sphere_light import SphereEmitter
from kernel_families import Family, U, length
from kernel_lights import ball_and_point, each, emitter, quad_and_point
from oracle import kernels as better
from oracle.numbers import cross, dot


def _true_cone(m, to, radius, up):
    far = m.norm(to)
    inside = far <= radius
    out = better.where(inside, radius, far)
    root = m.sqrt((out - radius) * (out + radius))
    one = 1 + 0 * far
    return np.stack(
        [
            far,
            better.where(inside, one, radius / far),
            better.where(inside, -one, root / far),
            better.positive(far - radius),
            better.where(inside, far + radius, root),
        ]
    )


def _cone(to, radius, up):
    def run(rows, r):
        lamp = emitter(SphereEmitter, float(r[0]))
        cone = lamp.view_cone(to[:, rows])
        return np.stack([cone.distance, cone.sine, cone.cosine, cone.near, cone.far])

    return each(run, to.shape[1], radius)


def _cone_bound(to, radius, up):
    far = length(to)
    tangent = np.sqrt(np.maximum((far - radius) * (far + radius), 0.0)) / far
    steep = np.where(far < radius, 1.0, np.maximum(tangent, U**0.5))
    unsure = np.abs(far - radius) <= 4.0 * U * far
    rows = [far, np.minimum(radius / far, 1.0), 1.0 / steep, far, (far + radius) / steep]
    return np.where(unsure, np.inf, 4.0 * U * np.stack(rows))


VIEW_CONE = Family(
    "cone in which a spherical light is seen",
    "4 u of: distance, sine, 1 / cosine, distance, distance / cosine",
    ball_and_point,
    _cone,
    _true_cone,
    _cone_bound,
)


def spots_on_quad(rng, n):
    return {**quad_and_point(rng, n), "x": rng.random(n), "y": rng.random(n)}


def spots_on_ball(rng, n):
    return {**ball_and_point(rng, n), "x": rng.random(n), "y": rng.random(n)}


def _spots(kind):
    def run_all(to, up, x, y, **shape):
        def run(rows, *part):
            lamp = emitter(kind, float(part[0][0])) if len(part) == 1 else emitter(kind, 0.0, *part)
            place, n = to[:, rows, None], up[:, rows, None]
            spot, weight = lamp.sample(place, np.zeros((3, 1, 1)), n, x[rows, None], y[rows, None])
            return np.concatenate([spot[:, :, 0], weight.T])

        return each(run, to.shape[1], *shape.values())

    return run_all


def _true_quad_spots(m, to, a, b, up, x, y):
    spot = to + (2 * x - 1) * a + (2 * y - 1) * b
    square, side = dot(spot, spot), cross(a, b)
    weight = better.positive(dot(up, spot)) * better.positive(-dot(side, spot)) * 4
    return np.concatenate([spot, (weight / (square * square))[None]])


def _quad_spots_bound(to, a, b, up, x, y):
    size = length(to) + length(a) + length(b)
    spot = length(to + (2 * x - 1) * a + (2 * y - 1) * b)
    near = np.maximum(spot, U * size)
    weight = length(a) * length(b) * size / near**3
    return np.stack([4.0 * U * size] * 3 + [32.0 * U * weight])


QUAD_SPOTS = Family(
    "points on a quad light",
    "4 u (d + |a| + |b|) metres; their light 32 u |a||b| (d + |a| + |b|) / distance^3",
    spots_on_quad,
    _spots(QuadEmitter),
    _true_quad_spots,
    _quad_spots_bound,
)


def _off_sphere(m, got, to, radius, up, x, y):
    """Distance of a spot from the light's surface, and from the share of the cone asked for."""
    spot = got[:3]
    off = m.norm(spot - to) - radius
    far = m.norm(to)
    inside = far <= radius
    out = better.where(inside, radius, far)
    sine = radius / out
    root = m.sqrt((out - radius) * (out + radius)) / out
    opening = better.where(inside, 2 + 0 * far, sine * sine / (1 + root))
    want = x * opening  # 1 - cos, and its sine
    apart = m.angle(spot, to)
    turn = m.atan2(m.sqrt(better.positive(want * (2 - want))), 1 - want)
    bright = 2 * m.pi * opening * better.positive(dot(up, spot) / m.norm(spot))
    return np.stack([off, apart - turn, got[3] - bright])


def _off_sphere_bound(to, radius, up, x, y):
    far = length(to)
    sine = np.minimum(radius / far, 1.0)
    tangent = np.sqrt(np.maximum((far - radius) * (far + radius), 0.0)) / far
    steep = np.where(far < radius, 1.0, np.maximum(tangent, U**0.5))
    # where a ray leaves the surface at a flat angle, its end is off by the root
    off = 32.0 * U * (far + radius)
    unsure = np.abs(far - radius) <= 4.0 * U * far
    turn = 32.0 * U / steep
    return np.where(unsure, np.inf, np.stack([off, turn, 64.0 * U * sine * sine / steep]))


SPHERE_SPOTS = Family(
    "points on a spherical light",
    "32 u (d + r) metres off its surface; 32 u / cos a rad; their light 64 u sin^2 a / cos a",
    spots_on_ball,
    _spots(SphereEmitter),
    None,
    _off_sphere_bound,
    _off_sphere,
)
