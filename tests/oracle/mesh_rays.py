# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of triangles by brute force, in float64: each ray tests all triangles, but for those in
groups of neighbours whose ball it misses.

Parallelograms count as two triangles. Normals of smooth meshes are interpolated. Shadow rays leave
the flat face itself, which does not block them; from smooth meshes they leave the smooth surface
where light is near the horizon, by the rule of Cycles (`shadow_ray_offset` of kernel/light/sample.h
and what it calls), which is written here once more, from Cycles' description.
"""

import math
from itertools import pairwise

import numpy as np
from numba import njit
from scipy.stats.qmc import Sobol

from adaptive_drt.geometry.camera import make_pinhole_camera
from adaptive_drt.scene.description import PointLight, Quad, QuadLight, SphereLight

__all__ = ["converged_mesh_pictures", "sampled_mesh_picture", "triangles_of"]

NEAR = 1e-9
"""Part of a shadow ray at both of its ends that meets nothing."""
TERMINATOR = 0.1
"""Cosine of the light's direction below which shadow rays leave the smooth surface."""
GROUP = 16
"""Number of consecutive triangles of a shape that a ball encloses."""
BESIDE = 1e-7
"""Height over a face, in metres, of the start of shadow rays that it may block itself."""
KINDS = {QuadLight: 0, SphereLight: 1, PointLight: 2}


def triangles_of(scene):
    """Corners (n, 3, 3), corner normals (n, 3, 3), colours (n, 3) and motion (n, 3) of triangles,
    and whether their shading is smooth (n,): of all those of a scene."""
    corners, normals, colors, moves, rounded = [], [], [], [], []
    for shape in scene.shapes:
        if isinstance(shape, Quad):
            q, u, v = (np.array(x) for x in (shape.corner, shape.edge_u, shape.edge_v))
            own = np.array([[q, q + u, q + u + v], [q, q + u + v, q + v]])
            smooth, slot, materials = None, np.zeros(2, dtype=int), (shape.material,)
        else:
            own = shape.vertices[:, shape.faces].transpose(2, 1, 0)
            smooth, slot, materials = shape.normals, shape.face_slot, shape.materials
        flat = np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0])
        flat = np.repeat(flat[:, None], 3, axis=1)
        facing = flat if smooth is None else smooth.transpose(2, 0, 1)
        corners.append(own)
        normals.append(facing / np.linalg.norm(facing, axis=2, keepdims=True))
        colors.append(np.array([m.color for m in materials])[slot])
        way = (0.0, 0.0, 0.0) if shape.motion is None else shape.motion.displacement
        moves.append(np.tile(np.array(way), (len(own), 1)))
        rounded.append(np.full(len(own), smooth is not None))
    parts = (corners, normals, colors, moves, rounded)
    return tuple(np.ascontiguousarray(np.concatenate(x)) for x in parts)


def _groups(plain):
    """Balls around groups of triangles, (g, 6): centre, squared radius, first and last triangle."""
    corners = np.stack([plain[:, :3], plain[:, :3] + plain[:, 3:6], plain[:, :3] + plain[:, 6:9]])
    rows = []
    for first in range(0, len(plain), GROUP):
        own = plain[first : first + GROUP]
        # groups do not hold triangles that move in different ways
        cuts = [0, *(np.flatnonzero((own[1:, 9:] != own[:-1, 9:]).any(axis=1)) + 1), len(own)]
        for a, b in pairwise(cuts):
            points = corners[:, first + a : first + b].reshape(-1, 3)
            middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
            square = ((points - middle) ** 2).sum(axis=1).max() * (1.0 + 1e-9)
            rows.append([*middle, square, first + a, first + b])
    return np.array(rows)


def sampled_mesh_picture(scene, samples, seed=0):
    """Picture (3, height, width) of a scene of quads and meshes, by `samples` points a pixel."""
    packed, shifts = _packed(scene), _shifts(scene, seed)
    return _picture(*packed, shifts, samples).transpose(2, 0, 1)


def converged_mesh_pictures(scene, goal, most, least=512):
    """Two independent pictures (2, 3, height, width), each the mean of two estimates.

    Estimates are by Sobol's sequence, scrambled (Owen) and shifted for each pixel and estimate.

    Parameters
    ----------
    goal : standard error of the four estimates of a pixel at which it is done, over the pictures'
        mean; it must be so small at two numbers of points in turn.
    most, least : largest and smallest number of points a pixel, in each estimate.
    """
    packed = _packed(scene)
    shifts = np.array([_shifts(scene, seed) for seed in range(4)])
    scale = _picture(*packed, shifts[0], least // 4).mean()
    points = np.ascontiguousarray(Sobol(5, scramble=True, seed=0).random(most))
    found = _converged(*packed, points, shifts, goal * scale, least)
    return found.reshape(2, 2, *found.shape[1:]).mean(axis=1).transpose(0, 3, 1, 2)


def _shifts(scene, seed):
    """Shifts (height, width, 5) of the points of all pixels."""
    width, height = scene.camera.resolution
    return np.random.default_rng(seed).random((height, width, 5))


def _packed(scene):
    """The arrays of a scene that `_radiance` needs."""
    camera = make_pinhole_camera(scene.camera)
    lights = np.array([_light(light) for light in scene.lights])
    rays = np.array([camera.origin, camera.base, camera.right, camera.up])
    corners, normals, colors, moves, rounded = triangles_of(scene)
    edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    plain = np.concatenate([corners[:, 0], *edges, moves], axis=1)
    background = np.array(scene.background)
    return plain, _groups(plain), normals, colors, rounded, lights, background, rays


def _light(light):
    """Kind, centre, two vectors or a radius, and radiance of a light: 13 numbers."""
    kind = KINDS[type(light)]
    if kind == 0:
        return [kind, *light.center, *light.half_u, *light.half_v, *light.radiance]
    size = light.radius if kind == 1 else 0.0
    power = light.radiance if kind == 1 else light.intensity
    return [kind, *light.center, size, 0.0, 0.0, 0.0, 0.0, 0.0, *power]


@njit(fastmath=False)
def _hit(plain, k, o0, o1, o2, d0, d1, d2, t):
    """Ray parameter and barycentric coordinates of triangle k; inf where the ray misses it."""
    u0, u1, u2, v0, v1, v2 = (
        plain[k, 3], plain[k, 4], plain[k, 5], plain[k, 6], plain[k, 7], plain[k, 8],
    )  # fmt: skip
    p0, p1, p2 = d1 * v2 - d2 * v1, d2 * v0 - d0 * v2, d0 * v1 - d1 * v0
    det = u0 * p0 + u1 * p1 + u2 * p2
    if det == 0.0:
        return math.inf, 0.0, 0.0
    g0 = o0 - plain[k, 0] - t * plain[k, 9]
    g1 = o1 - plain[k, 1] - t * plain[k, 10]
    g2 = o2 - plain[k, 2] - t * plain[k, 11]
    y = (g0 * p0 + g1 * p1 + g2 * p2) / det
    if y < 0.0 or y > 1.0:
        return math.inf, 0.0, 0.0
    q0, q1, q2 = g1 * u2 - g2 * u1, g2 * u0 - g0 * u2, g0 * u1 - g1 * u0
    z = (d0 * q0 + d1 * q1 + d2 * q2) / det
    if z < 0.0 or y + z > 1.0:
        return math.inf, 0.0, 0.0
    return (v0 * q0 + v1 * q1 + v2 * q2) / det, y, z


@njit
def _meets(plain, groups, g, o, d, t):
    """Whether the line of a ray meets the ball around a group."""
    k = int(groups[g, 4])
    c0 = groups[g, 0] + t * plain[k, 9] - o[0]
    c1 = groups[g, 1] + t * plain[k, 10] - o[1]
    c2 = groups[g, 2] + t * plain[k, 11] - o[2]
    length = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    along = c0 * d[0] + c1 * d[1] + c2 * d[2]
    return (c0 * c0 + c1 * c1 + c2 * c2 - groups[g, 3]) * length <= along * along


@njit
def _blocked(plain, groups, own, o, d, t):
    for g in range(groups.shape[0]):
        if not _meets(plain, groups, g, o, d, t):
            continue
        for k in range(int(groups[g, 4]), int(groups[g, 5])):
            if k != own:
                s = _hit(plain, k, o[0], o[1], o[2], d[0], d[1], d[2], t)[0]
                if NEAR < s < 1.0 - NEAR:
                    return True
    return False


@njit
def _sample(light, point, a, b):
    """Vector to a point of a light, and the weight of its radiance without the surface's cosine."""
    to = light[1:4] - point
    if light[0] == 0.0:
        u, v = light[4:7], light[7:10]
        to = to + (2.0 * a - 1.0) * u + (2.0 * b - 1.0) * v
        n0, n1, n2 = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
        area = 4.0 * math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
        far = math.sqrt(to[0] ** 2 + to[1] ** 2 + to[2] ** 2)
        facing = -(n0 * to[0] + n1 * to[1] + n2 * to[2]) / (far * area / 4.0)
        return to, max(facing, 0.0) * area / (far * far)
    far = math.sqrt(to[0] ** 2 + to[1] ** 2 + to[2] ** 2)
    if light[0] == 2.0:
        return to, 1.0 / (far * far)
    axis = to / far
    sine = light[4] / far
    least = math.sqrt(max(1.0 - sine * sine, 0.0))
    c = 1.0 - a * (1.0 - least)
    s = math.sqrt(max(1.0 - c * c, 0.0))
    other = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.5 else np.array([0.0, 1.0, 0.0])
    x = np.array(
        [
            axis[1] * other[2] - axis[2] * other[1],
            axis[2] * other[0] - axis[0] * other[2],
            axis[0] * other[1] - axis[1] * other[0],
        ]
    )
    x /= math.sqrt(x[0] ** 2 + x[1] ** 2 + x[2] ** 2)
    y = np.array(
        [
            axis[1] * x[2] - axis[2] * x[1],
            axis[2] * x[0] - axis[0] * x[2],
            axis[0] * x[1] - axis[1] * x[0],
        ]
    )
    w = c * axis + s * (math.cos(2 * math.pi * b) * x + math.sin(2 * math.pi * b) * y)
    reach = far * c - math.sqrt(max(light[4] ** 2 - far * far * s * s, 0.0))
    return reach * w, 2.0 * math.pi * (1.0 - least)


@njit
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit
def _lift(v, n, share, point, facing):
    """Way from a point of a face to the smooth surface that its normals stand for.

    v, n : corners and their normals, (3, 3) each.  share : barycentric coordinates of the point.
    facing : the face's normal on the viewer's side.
    """
    mean = share[0] * n[0] + share[1] * n[1] + share[2] * n[2]
    sign = 1.0 if _dot(mean, facing) > 0.0 else -1.0
    bow, cap = 0.0, math.inf
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        # each edge bends by the difference of its normals; the middle of it lies highest
        bow += share[i] * share[j] * _dot(n[j] - n[i], v[j] - v[i])
        own = sign * n[i]
        edge = max(_dot(v[j] - v[i], own), _dot(v[k] - v[i], own), 0.0)
        cap = min(cap, max(_dot(v[i] - point, own) + edge, 0.0))
    return mean * sign * max(cap, 0.5 * sign * bow)


@njit
def _start(plain, normals, face, share, point, n, facing, way):
    """Start of a shadow ray along a unit vector, and the face that does not block it, or -1."""
    shaded, flat = _dot(n, way), _dot(facing, way)
    if shaded < TERMINATOR:
        part = 2.0 - (flat + shaded) / TERMINATOR
    else:
        part = 1.0 - flat / TERMINATOR
    part = min(max(part, 0.0), 1.0)
    if part == 0.0:
        return point, face
    v = np.empty((3, 3))
    # the ray has met the face at a time of its own: corners follow from the point
    u, w = plain[face, 3:6], plain[face, 6:9]
    v[0] = point - share[1] * u - share[2] * w
    v[1], v[2] = v[0] + u, v[0] + w
    start = point + part * _lift(v, normals[face], share, point, facing)
    return (start, face) if flat > 0.0 else (start + BESIDE * facing, -1)


@njit
def _radiance(plain, groups, normals, colors, rounded, lights, background, o, d, spot):
    t = spot[2] - 0.5
    best, face, by, bz = math.inf, -1, 0.0, 0.0
    for g in range(groups.shape[0]):
        if not _meets(plain, groups, g, o, d, t):
            continue
        for k in range(int(groups[g, 4]), int(groups[g, 5])):
            s, y, z = _hit(plain, k, o[0], o[1], o[2], d[0], d[1], d[2], t)
            if 0.0 < s < best:
                best, face, by, bz = s, k, y, z
    if face < 0:
        return background.copy()
    point = o + best * d
    flat = np.array([0.0, 0.0, 0.0])
    u, v = plain[face, 3:6], plain[face, 6:9]
    flat[0], flat[1] = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2]
    flat[2] = u[0] * v[1] - u[1] * v[0]
    flat /= math.sqrt(_dot(flat, flat))
    n = normals[face, 0] * (1.0 - by - bz) + normals[face, 1] * by + normals[face, 2] * bz
    n /= math.sqrt(_dot(n, n))
    if _dot(flat, d) > 0.0:
        n, flat = -n, -flat
    share = np.array([1.0 - by - bz, by, bz])
    total = np.zeros(3)
    for k in range(lights.shape[0]):
        a, b = (spot[3] + 0.37 * k) % 1.0, (spot[4] + 0.71 * k) % 1.0
        to, weight = _sample(lights[k], point, a, b)
        far = math.sqrt(to[0] ** 2 + to[1] ** 2 + to[2] ** 2)
        cosine = (n[0] * to[0] + n[1] * to[1] + n[2] * to[2]) / far
        if cosine <= 0.0 or weight <= 0.0:
            continue
        start, own = point, face
        if rounded[face]:
            start, own = _start(plain, normals, face, share, point, n, flat, to / far)
        if not _blocked(plain, groups, own, start, point + to - start, t):
            total += weight * cosine * lights[k, 10:13] * colors[face] / math.pi
    return total


@njit
def _picture(plain, groups, normals, colors, rounded, lights, background, rays, shifts, samples):
    height, width = shifts.shape[:2]
    picture = np.zeros((height, width, 3))
    root = 1.0
    for _ in range(64):
        root = (1.0 + root) ** (1.0 / 6.0)
    steps = np.array([root ** -(k + 1.0) for k in range(5)])
    for y in range(height):
        for x in range(width):
            for i in range(samples):
                spot = (i * steps + shifts[y, x]) % 1.0
                d = rays[1] + (x + spot[0]) * rays[2] + (y + spot[1]) * rays[3]
                picture[y, x] += _radiance(
                    plain, groups, normals, colors, rounded, lights, background, rays[0], d, spot
                )
            picture[y, x] /= samples
    return picture


@njit
def _converged(
    plain, groups, normals, colors, rounded, lights, background, rays, points, shifts, goal, least
):
    kinds, height, width = shifts.shape[:3]
    found = np.zeros((kinds, height, width, 3))
    for y in range(height):
        for x in range(width):
            sums, done, close = np.zeros((kinds, 3)), 0, 0
            while done < len(points) and close < 2:
                end = max(least, 2 * done)
                for k in range(kinds):
                    for i in range(done, end):
                        spot = (points[i] + shifts[k, y, x]) % 1.0
                        d = rays[1] + (x + spot[0]) * rays[2] + (y + spot[1]) * rays[3]
                        sums[k] += _radiance(
                            plain, groups, normals, colors, rounded, lights, background, rays[0],
                            d, spot,
                        )  # fmt: skip
                done = end
                off = 0.0
                for c in range(3):
                    off = max(off, sums[:, c].std() / (done * math.sqrt(kinds - 1.0)))
                close = close + 1 if off <= goal else 0
            found[:, y, x] = sums / done
    return found
