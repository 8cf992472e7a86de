# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of triangles by brute force: each ray tests all triangles, in float64, without a tree.

Parallelograms count as two triangles. Normals of smooth meshes are interpolated; shadow rays leave
the flat face itself, which alone does not block them.
"""

import math

import numpy as np
from numba import njit

from adaptive_drt.geometry.camera import make_pinhole_camera
from adaptive_drt.scene.description import PointLight, Quad, QuadLight, SphereLight

__all__ = ["sampled_mesh_picture", "triangles_of"]

NEAR = 1e-9
KINDS = {QuadLight: 0, SphereLight: 1, PointLight: 2}


def triangles_of(scene):
    """Corners (n, 3, 3), corner normals (n, 3, 3), colours (n, 3) and motion (n, 3) of a scene."""
    corners, normals, colors, moves = [], [], [], []
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
    return tuple(np.ascontiguousarray(np.concatenate(x)) for x in (corners, normals, colors, moves))


def sampled_mesh_picture(scene, samples, seed=0):
    """Picture (3, height, width) of a scene of quads and meshes, by `samples` points a pixel."""
    camera = make_pinhole_camera(scene.camera)
    width, height = scene.camera.resolution
    lights = np.array([_light(light) for light in scene.lights])
    rays = np.array([camera.origin, camera.base, camera.right, camera.up])
    rng = np.random.default_rng(seed)
    shifts = rng.random((height, width, 5))
    corners, normals, colors, moves = triangles_of(scene)
    edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    plain = np.concatenate([corners[:, 0], *edges, moves], axis=1)
    background = np.array(scene.background)
    picture = _picture(plain, normals, colors, lights, rays, background, shifts, samples)
    return picture.transpose(2, 0, 1)


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
def _blocked(plain, own, o, d, t):
    for k in range(plain.shape[0]):
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
def _radiance(plain, normals, colors, lights, background, o, d, spot):
    t = spot[2] - 0.5
    best, face, by, bz = math.inf, -1, 0.0, 0.0
    for k in range(plain.shape[0]):
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
    n = normals[face, 0] * (1.0 - by - bz) + normals[face, 1] * by + normals[face, 2] * bz
    n /= math.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
    if flat[0] * d[0] + flat[1] * d[1] + flat[2] * d[2] > 0.0:
        n = -n
    total = np.zeros(3)
    for k in range(lights.shape[0]):
        a, b = (spot[3] + 0.37 * k) % 1.0, (spot[4] + 0.71 * k) % 1.0
        to, weight = _sample(lights[k], point, a, b)
        far = math.sqrt(to[0] ** 2 + to[1] ** 2 + to[2] ** 2)
        cosine = (n[0] * to[0] + n[1] * to[1] + n[2] * to[2]) / far
        if cosine > 0.0 and weight > 0.0 and not _blocked(plain, face, point, to, t):
            total += weight * cosine * lights[k, 10:13] * colors[face] / math.pi
    return total


@njit
def _picture(plain, normals, colors, lights, rays, background, shifts, samples):
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
                    plain, normals, colors, lights, background, rays[0], d, spot
                )
            picture[y, x] /= samples
    return picture
