# SPDX-License-Identifier: GPL-3.0-or-later
"""Families of kernels of light: open lights in closed form."""

from itertools import pairwise

import numpy as np

from adaptive_drt.geometry.light_protocol import LinearSpan
from adaptive_drt.geometry.sphere.kernels import surface_tolerance
from adaptive_drt.lights import form_factor as light
from adaptive_drt.lights.disk_light import DiskEmitter
from adaptive_drt.lights.point_light import PointEmitter
from adaptive_drt.lights.quad_light import QuadEmitter
from adaptive_drt.lights.sphere_light import SphereEmitter
from kernel_families import Family, U, across, length, near_one, spread, unit
from oracle import kernels as better
from oracle.numbers import LONG, cross, dot

HOUSE = np.ones(3)


def emitter(kind, radius=0.0, a=None, b=None):
    """A light at the origin; its arrays may hold one light for each point."""
    fields = {"name": "", "center": np.zeros((3, 1)), "power": HOUSE, "radius": radius}
    if a is not None:
        normal = cross(a, b)
        normal = normal / np.maximum(length(normal), 1e-300)
        fields["span"] = LinearSpan(a, b, normal)
    if kind is QuadEmitter:
        fields["offsets"] = np.hstack([u * a + v * b for u, v in light.QUAD_CORNERS])
    return kind(**fields)


def each(kernel, n, *lights):
    """A kernel run once for each of the lights that share it out: (..., n).

    `lights` are arrays (..., n) that stay the same over runs; `kernel(rows, *light)` gets one of
    each with a last axis of 1.
    """
    change = np.zeros(n, dtype=bool)
    for array in lights:
        rows = array.reshape(-1, n)
        change[1:] |= (rows[:, 1:] != rows[:, :-1]).any(axis=0)
    starts = [0, *np.flatnonzero(change), n]
    parts = []
    for first, last in pairwise(starts):
        parts.append(kernel(slice(first, last), *(x[..., first : first + 1] for x in lights)))
    return np.concatenate(parts, axis=-1)


def shared(array, n):
    """An array (..., k) of k lights, each repeated for its share of n points."""
    k = array.shape[-1]
    return np.repeat(array, -(-n // k), axis=-1)[..., :n]


def parallelograms(rng, n):
    """Half edges (3, n) of parallelograms of all sizes, aspects and skews, some of them alike."""
    k = int(np.sqrt(n))
    a = unit(rng, k)
    skew = np.where(rng.random(k) < 0.7, 0.0, rng.uniform(-2.0, 2.0, k))
    b = across(rng, a) + skew * a
    aspect = np.where(rng.random(k) < 0.5, 1.0, spread(rng, -6, 6, k))
    size = spread(rng, -6, 6, k) / np.maximum(1.0, aspect)
    return shared(a * size * aspect, n), shared(b * size, n)


def quad_and_point(rng, n):
    """Quads seen steeply, flatly, near and far, above the horizon and cut by it."""
    a, b = parallelograms(rng, n)
    normal = cross(a, b)
    normal /= length(normal)
    far = np.where(
        rng.random(n) < 0.5, (length(a) + length(b)) * spread(rng, -1, 4, n), spread(rng, -6, 6, n)
    )
    to = unit(rng, n)
    flat = rng.random(n) < 0.2
    to[:, flat] -= ((1 - spread(rng, -6, 0, n)) * dot(to, normal) * normal)[:, flat]
    to = np.where(dot(to, normal) > 0.0, -to, to) * np.clip(far, 1e-6, 1e6)
    up = unit(rng, n)
    horizon = rng.random(n) < 0.4
    aim = to + rng.uniform(-1, 1, n) * a + rng.uniform(-1, 1, n) * b
    aim /= np.maximum(length(aim), 1e-300)
    up[:, horizon] -= (dot(up, aim) * aim)[:, horizon]
    up /= length(up)
    return {"to": to, "a": a, "b": b, "up": up}


def _quad_factor(to, a, b, up):
    def run(rows, a, b):
        lamp = emitter(QuadEmitter, a=a, b=b)
        return lamp.irradiance_factor(to[:, rows], np.zeros((3, 1)), up[:, rows])

    return each(run, to.shape[1], a, b)


def _true_quad_factor(m, to, a, b, up):
    facing = -dot(to, cross(a, b))
    full = better.lambert(m, better.quad_corners(to, a, b), up)
    if m is LONG:
        rows = np.flatnonzero(length(a) + length(b) < 2.0 * light.SMALL_QUAD_RATIO * length(to))
        full[rows] = better.small_quad(m, *(x[:, rows] for x in (to, a, b, up)))
    return better.where(facing > 0, full, 0 * full)


def nearest_edge(corners, up):
    """Distance of the nearest point of a polygon's outline, and of the horizon's line on it."""
    heights = [dot(up, c) for c in corners]
    nearest = np.full(up.shape[1], np.inf)
    marks = []
    for k, start in enumerate(corners):
        edge, h0, h1 = corners[k - 1] - start, heights[k], heights[k - 1]
        nearest = np.minimum(nearest, away(start, edge))
        crosses = (h0 > 0.0) != (h1 > 0.0)
        meet = start + h0 / np.where(crosses, h0 - h1, 1.0) * edge
        marks.append(np.where(crosses, meet, np.nan))
    for k, p in enumerate(marks):
        for q in marks[:k]:
            nearest = np.fmin(nearest, away(p, q - p))
    return nearest


def away(start, edge):
    """Distance of a segment from the origin."""
    square = dot(edge, edge)
    share = np.clip(-dot(start, edge) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return length(start + share * edge)


def _quad_factor_bound(to, a, b, up):
    size, far = length(a) + length(b), length(to)
    small = 48.0 * U * length(a) * length(b) / (far * far)
    h = nearest_edge(better.quad_corners(to, a, b), up)
    bound = 16.0 * U * (size / np.maximum(h, U * size))
    bound = np.where(size < light.SMALL_QUAD_RATIO * far, small, bound)
    # in the light's own plane, up to rounding, it counts as dark
    normal = cross(a, b)
    height = np.abs(dot(to, normal)) / length(normal)
    return np.where(height < 2.0 * surface_tolerance(0.0 * to, size), np.inf, bound)


QUAD_LIGHT = Family(
    "irradiance of a quad light",
    "16 u (|a| + |b|) / h sr; 48 u |a||b| / d^2 for small ones",
    quad_and_point,
    _quad_factor,
    _true_quad_factor,
    _quad_factor_bound,
)


def _polygon(to, a, b, up):
    return light.polygon_factor(better.quad_corners(to, a, b), up)


def _true_polygon(m, to, a, b, up):
    # from the corners as they are rounded: they are what the kernel is given
    to, a, b = (np.asarray(x).astype(np.float64) for x in (to, a, b))
    return better.lambert(m, [m.lift(c) for c in better.quad_corners(to, a, b)], up)


def _polygon_bound(to, a, b, up):
    corners = better.quad_corners(to, a, b)
    h = np.maximum(nearest_edge(corners, up), U * (length(a) + length(b)))
    return 16.0 * U * (length(a) + length(b)) / h


POLYGON = Family(
    "irradiance of a polygon",
    "16 u (|a| + |b|) / h sr",
    quad_and_point,
    _polygon,
    _true_polygon,
    _polygon_bound,
)


def cone_and_normal(rng, n):
    """Cones of 1e-6 to 90 degrees, many of them cut by the horizon, or nearly."""
    half = np.where(rng.random(n) < 0.5, spread(rng, -6, 0.19, n), rng.uniform(0.0, 1.5707, n))
    sine = np.sin(half)
    cosine = np.where(
        rng.random(n) < 0.5, rng.uniform(-1, 1, n), rng.choice([-1.0, 1.0], n) * near_one(rng, n)
    )
    cosine = np.clip(cosine * np.where(rng.random(n) < 0.8, sine, 1.0), -1.0, 1.0)
    return {"cosine": cosine, "sine": sine, "other": np.cos(half)}


CAP = Family(
    "irradiance of a circular cone",
    "32 u sin^2 sr",
    cone_and_normal,
    lambda cosine, sine, other: light.cap_factor(cosine, sine, other),
    lambda m, cosine, sine, other: better.cap(m, cosine, sine, other),
    lambda cosine, sine, other: 32.0 * U * sine * sine,
)


def ball_and_point(rng, n):
    """Balls of all sizes, seen from near their surface to far off, the horizon across them."""
    k = int(np.sqrt(n))
    radius = shared(spread(rng, -6, 6, k), n)
    far = np.where(
        rng.random(n) < 0.5, radius * (1.0 + spread(rng, -15, 5, n)), spread(rng, -6, 6, n)
    )
    far = np.clip(far, 1e-6, 1e6)
    axis = unit(rng, n)
    side = across(rng, axis)
    lift = np.where(
        rng.random(n) < 0.5, rng.uniform(-1, 1, n), rng.choice([-1.0, 1.0], n) * near_one(rng, n)
    )
    lift = np.clip(lift * np.minimum(radius / far, 1.0), -1, 1)
    up = lift * axis + np.sqrt((1 - lift) * (1 + lift)) * side
    return {"to": far * axis, "radius": radius, "up": up / length(up)}


def _round(kind):
    def factor(to, radius, up):
        def run(rows, r):
            lamp = emitter(kind, float(r[0]))
            return lamp.irradiance_factor(to[:, rows], np.zeros((3, 1)), up[:, rows])

        return each(run, to.shape[1], radius)

    return factor


def _true_sphere(m, to, radius, up):
    far = m.norm(to)
    inside = far <= radius
    far = better.where(inside, radius, far)
    root = m.sqrt((far - radius) * (far + radius))
    full = better.cap(m, dot(up, to) / m.norm(to), radius / far, root / far)
    return better.where(inside, m.pi + 0 * far, full)


def _sphere_bound(to, radius, up):
    far = length(to)
    sine = np.minimum(radius / far, 1.0)
    # on the surface either side is right: from within, the whole of the upper half shines
    tangent = np.sqrt(np.maximum((far - radius) * (far + radius), 0.0)) / far
    bound = 32.0 * U * sine * sine / np.where(far < radius, 1.0, np.maximum(tangent, U**0.5))
    return np.where(np.abs(far - radius) <= 4.0 * U * far, np.inf, bound)


def _true_disk(m, to, radius, up):
    far = m.norm(to)
    slant = m.sqrt(far * far + radius * radius)
    return better.cap(m, dot(up, to) / far, radius / slant, far / slant)


def _disk_bound(to, radius, up):
    return 32.0 * U * radius * radius / (dot(to, to) + radius * radius)


SPHERE_LIGHT = Family(
    "irradiance of a spherical light",
    "32 u sin^2 a / cos a sr, a half the angle it is seen in; pi from within",
    ball_and_point,
    _round(SphereEmitter),
    _true_sphere,
    _sphere_bound,
)
DISK_LIGHT = Family(
    "irradiance of a disk that faces the point",
    "32 u r^2 / (d^2 + r^2) sr",
    ball_and_point,
    _round(DiskEmitter),
    _true_disk,
    _disk_bound,
)
POINT_LIGHT = Family(
    "irradiance of a point",
    "8 u / d^2",
    ball_and_point,
    lambda to, radius, up: emitter(PointEmitter).irradiance_factor(to, np.zeros((3, 1)), up),
    lambda m, to, radius, up: better.positive(dot(up, to)) / m.norm(to) ** 3,
    lambda to, radius, up: 8.0 * U / dot(to, to),
)
