# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures by very many plain rays, whose own error is known: for all shapes of degree two.

A point of a pixel, a time and a point of the light make a ray each, by a Kronecker sequence that is
shifted at random in each of several replicates; pixels whose replicates differ most take more.
Shares no code with the core, nor with the other oracles. Needs numba. Shapes are taken to be
solids that hold neither the camera nor the light; a point of one is not hidden by the shape itself.
"""

import math

import numpy as np
from numba import njit

from adaptive_drt.scene.description import (
    Cylinder,
    Ellipsoid,
    Quad,
    QuadLight,
    SkyLight,
    Sphere,
    SphereLight,
)

__all__ = ["dense_picture"]

REPLICATES = 8
"""Number of random shifts, whose spread tells the error."""
FIRST, MOST_TAKEN = 2048, 16
"""Points of a replicate of every pixel at first, and doublings of them at most."""
SHARE = 0.9
"""Share of the squared error whose pixels take more points in a round."""
BALL, BOX, TUBE = 0, 1, 2
"""Kinds: the image of a unit ball, a parallelogram, a solid cone with flat ends."""
AREA, ROUND, AROUND = 0, 1, 2
"""Kinds of lights: parallelogram, ball, sky."""
STEP = 1.0 / np.array([1.1347241384015194**k for k in range(1, 6)])
"""The root of x^6 = x + 1, and its powers: a sequence of five dimensions of low discrepancy."""


def _packed(scene):
    """Rows (k, 21): kind, place, matrix to the unit shape, displacement, colour, two radii."""
    eye = np.array([row[3] for row in scene.camera.matrix[:3]])
    rows = []
    for shape in scene.shapes:
        way = np.zeros(3) if shape.motion is None else np.array(shape.motion.displacement)
        radii = (0.0, 0.0)
        if isinstance(shape, Sphere):
            kind, place, axes = BALL, shape.center, np.eye(3) * shape.radius
        elif isinstance(shape, Ellipsoid):
            kind, place = BALL, shape.center
            axes = np.array([shape.half_u, shape.half_v, shape.half_w]).T
        elif isinstance(shape, Quad):
            kind, place = BOX, shape.corner
            normal = np.cross(shape.edge_u, shape.edge_v)
            axes = np.array([shape.edge_u, shape.edge_v, normal / np.linalg.norm(normal)]).T
        else:
            assert isinstance(shape, Cylinder)
            kind, place, radii = TUBE, shape.start, shape.radii
            axis = np.subtract(shape.end, shape.start)
            frame = np.linalg.svd(axis[None] / np.linalg.norm(axis))[2]
            # the third axis has the length of the solid, the others are of 1 m
            axes = np.array([frame[1], frame[2], axis]).T
        inverse = np.linalg.inv(axes)
        place = np.array(place) - eye
        rows.append((kind, *place, *inverse.ravel(), *way, *shape.material.color, *radii))
    (light,) = scene.lights
    zero = (0.0, 0.0, 0.0)
    if isinstance(light, QuadLight):
        lamp = AREA, *(np.array(light.center) - eye), *light.half_u, *light.half_v, 0.0
    elif isinstance(light, SphereLight):
        lamp = ROUND, *(np.array(light.center) - eye), *zero, *zero, light.radius
    else:
        assert isinstance(light, SkyLight)
        lamp = AROUND, *zero, *zero, *zero, 0.0
    return np.array(rows), np.array((*lamp, *light.radiance)), np.array(scene.background)


def _view(camera):
    """Rows: the direction through picture point (0, 0), and its changes by x and y."""
    step = camera.sensor_width / camera.focal_length / max(camera.resolution)
    width, height = camera.resolution
    turn = np.array(camera.matrix)[:3, :3]
    local = np.array(
        [(-0.5 * width * step, -0.5 * height * step, -1.0), (step, 0, 0), (0, step, 0)]
    )
    return local @ turn.T


@njit(cache=True, nogil=True)
def _local(row, p, d, t):
    """Origin and direction of a ray in the space of a shape at a time."""
    q = np.empty(6)
    x, y, z = p[0] - row[1] - t * row[13], p[1] - row[2] - t * row[14], p[2] - row[3] - t * row[15]
    for i in range(3):
        q[i] = row[4 + 3 * i] * x + row[5 + 3 * i] * y + row[6 + 3 * i] * z
        q[3 + i] = row[4 + 3 * i] * d[0] + row[5 + 3 * i] * d[1] + row[6 + 3 * i] * d[2]
    return q


@njit(cache=True, nogil=True)
def _hit(row, p, d, t, normal):
    """How far a ray from outside meets a shape first, inf for never; its normal there, outwards."""
    q = _local(row, p, d, t)
    kind, best = row[0], math.inf
    m0 = m1 = m2 = 0.0
    if kind == BOX:
        if q[5] != 0.0:
            s = -q[2] / q[5]
            a, b = q[0] + s * q[3], q[1] + s * q[4]
            if s > 0.0 and 0.0 <= a <= 1.0 and 0.0 <= b <= 1.0:
                best, m2 = s, 1.0
    elif kind == BALL:
        dd = q[3] * q[3] + q[4] * q[4] + q[5] * q[5]
        b = -(q[0] * q[3] + q[1] * q[4] + q[2] * q[5]) / dd
        x, y, z = q[0] + b * q[3], q[1] + b * q[4], q[2] + b * q[5]
        gap = 1.0 - x * x - y * y - z * z
        if gap > 0.0:
            s = b - math.sqrt(gap / dd)
            if s > 0.0:
                best = s
                m0, m1, m2 = q[0] + s * q[3], q[1] + s * q[4], q[2] + s * q[5]
    else:
        wide, rate = row[19], row[20] - row[19]
        size, growth = wide + rate * q[2], rate * q[5]
        a = q[3] * q[3] + q[4] * q[4] - growth * growth
        b = q[0] * q[3] + q[1] * q[4] - size * growth
        c = q[0] * q[0] + q[1] * q[1] - size * size
        square = b * b - a * c
        if square > 0.0 and a != 0.0:
            root = math.sqrt(square)
            for sign in (-1.0, 1.0):
                s = (-b + sign * root) / a
                h = q[2] + s * q[5]
                if 0.0 < s < best and 0.0 <= h <= 1.0:
                    best = s
                    x, y = q[0] + s * q[3], q[1] + s * q[4]
                    m0, m1, m2 = x, y, -rate * (wide + rate * h)
        if q[5] != 0.0:
            for h in (0.0, 1.0):
                s = (h - q[2]) / q[5]
                x, y, r = q[0] + s * q[3], q[1] + s * q[4], wide + rate * h
                if 0.0 < s < best and x * x + y * y <= r * r:
                    best, m0, m1, m2 = s, 0.0, 0.0, 2.0 * h - 1.0
    # normals are covectors: those of the local space times its matrix
    for i in range(3):
        normal[i] = m0 * row[4 + i] + m1 * row[7 + i] + m2 * row[10 + i]
    return best


@njit(cache=True, nogil=True)
def _sample(lamp, p, n, a, b, way):
    """A direction to the light, into `way`; the distance, and the irradiance if it is open."""
    if lamp[0] == AREA:
        a, b = 2.0 * a - 1.0, 2.0 * b - 1.0
        for i in range(3):
            way[i] = lamp[1 + i] + a * lamp[4 + i] + b * lamp[7 + i] - p[i]
        far = math.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)
        x = lamp[5] * lamp[9] - lamp[6] * lamp[8]
        y = lamp[6] * lamp[7] - lamp[4] * lamp[9]
        z = lamp[4] * lamp[8] - lamp[5] * lamp[7]
        out = -(x * way[0] + y * way[1] + z * way[2])
        cosine = (n[0] * way[0] + n[1] * way[1] + n[2] * way[2]) / far
        for i in range(3):
            way[i] /= far
        return far, 4.0 * max(out, 0.0) * max(cosine, 0.0) / far**3
    if lamp[0] == ROUND:
        z0, z1, z2 = lamp[1] - p[0], lamp[2] - p[1], lamp[3] - p[2]
        dd = z0 * z0 + z1 * z1 + z2 * z2
        d, r = math.sqrt(dd), lamp[10]
        z0, z1, z2 = z0 / d, z1 / d, z2 / d
        cone = math.sqrt(1.0 - r * r / dd)
        above = r * r / dd / (1.0 + cone)
        cosine, full = 1.0 - a * above, 2.0 * math.pi * above
    else:
        z0, z1, z2 = n[0], n[1], n[2]
        cosine, full = math.sqrt(a), math.pi
        d, dd, r = math.inf, math.inf, 0.0
    sine, phi = math.sqrt(max(1.0 - cosine * cosine, 0.0)), 2.0 * math.pi * b
    # a frame about z
    if abs(z0) < 0.6:
        x0, x1, x2 = 0.0, z2, -z1
    else:
        x0, x1, x2 = -z2, 0.0, z0
    size = math.sqrt(x0 * x0 + x1 * x1 + x2 * x2)
    x0, x1, x2 = x0 / size, x1 / size, x2 / size
    y0, y1, y2 = z1 * x2 - z2 * x1, z2 * x0 - z0 * x2, z0 * x1 - z1 * x0
    u, v = sine * math.cos(phi), sine * math.sin(phi)
    way[0] = u * x0 + v * y0 + cosine * z0
    way[1] = u * x1 + v * y1 + cosine * z1
    way[2] = u * x2 + v * y2 + cosine * z2
    if lamp[0] == AROUND:
        return math.inf, full
    far = d * cosine - math.sqrt(max(r * r - dd * sine * sine, 0.0))
    return far, full * max(n[0] * way[0] + n[1] * way[1] + n[2] * way[2], 0.0)


@njit(cache=True, nogil=True)
def _add(rows, lamp, back, view, pixel, first, count, shifts, sums):
    """Add the radiances of points first to first + count of each replicate to its sums (r, 3)."""
    d, p, n, way, none = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    origin = np.zeros(3)
    for replicate in range(sums.shape[0]):
        for k in range(first, first + count):
            u = np.empty(5)
            for i in range(5):
                u[i] = (shifts[replicate, i] + k * STEP[i]) % 1.0
            x, y, t = pixel[0] + u[0], pixel[1] + u[1], u[2] - 0.5
            for i in range(3):
                d[i] = view[0, i] + x * view[1, i] + y * view[2, i]
            best, own = math.inf, -1
            for j in range(rows.shape[0]):
                s = _hit(rows[j], origin, d, t, none)
                if s < best:
                    best, own = s, j
                    n[:] = none
            if own < 0:
                for i in range(3):
                    sums[replicate, i] += back[i]
                continue
            size = math.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
            if n[0] * d[0] + n[1] * d[1] + n[2] * d[2] > 0.0:
                size = -size
            for i in range(3):
                n[i] /= size
                p[i] = best * d[i]
            far, factor = _sample(lamp, p, n, u[3], u[4], way)
            if factor == 0.0:
                continue
            shut = False
            for j in range(rows.shape[0]):
                if j != own and _hit(rows[j], p, way, t, none) < far:
                    shut = True
                    break
            if not shut:
                for i in range(3):
                    sums[replicate, i] += factor / math.pi * lamp[11 + i] * rows[own, 16 + i]


def dense_picture(scene, goal, seed=0, most=2e8):
    """Colour (3, height, width), and its standard error (3, height, width).

    goal : root mean square of the errors over the mean up to which points are added.
    most : number of rays at which it gives up.
    """
    width, height = scene.camera.resolution
    pixels = np.array([(x, y) for y in range(height) for x in range(width)], dtype=float)
    packed, view = _packed(scene), _view(scene.camera)
    shifts = np.random.default_rng(seed).random((len(pixels), REPLICATES, 5))
    sums, counts = np.zeros((len(pixels), REPLICATES, 3)), np.zeros(len(pixels), dtype=int)
    chosen = np.arange(len(pixels))
    while True:
        for k in chosen.tolist():
            more = max(counts[k], FIRST)
            _add(*packed, view, pixels[k], counts[k], more, shifts[k], sums[k])
            counts[k] += more
        means = sums / counts[:, None, None]
        square = means.var(axis=1, ddof=1) / REPLICATES
        color, each = means.mean(axis=1), square.mean(axis=1)
        error = math.sqrt(each.mean()) / color.mean()
        if error <= goal or counts.sum() * REPLICATES > most:
            break
        order = np.argsort(-each)
        among = np.searchsorted(np.cumsum(each[order]), SHARE * each.sum()) + 1
        chosen = order[:among]
        chosen = chosen[counts[chosen] < FIRST << MOST_TAKEN]
        if not chosen.size:
            break
    shape = (3, height, width)
    return color.T.reshape(shape), np.sqrt(square).T.reshape(shape)
