# SPDX-License-Identifier: GPL-3.0-or-later
"""What rays hit, by plain formulas: nothing shared with the core."""

from __future__ import annotations

import numpy as np

from adaptive_drt.scene.description import Cylinder, Ellipse, Sphere, Triangle


def rays(camera, x, y):
    """Unit directions (3, n) through picture coordinates."""
    step = camera.sensor_width / camera.focal_length / max(camera.resolution)
    local = np.stack(
        [(x - camera.resolution[0] / 2) * step, (y - camera.resolution[1] / 2) * step, -1 + 0 * x]
    )
    ray = np.array(camera.matrix)[:3, :3] @ local
    return ray / np.linalg.norm(ray, axis=0)


def oracle_hits(camera, shapes, x, y, t):
    """The nearest shape (index into shapes, -1 for none) of rays at x, y, t."""
    ray, matrix = rays(camera, x, y), np.array(camera.matrix)
    best, nearest = np.full(x.size, np.inf), np.full(x.size, -1)
    for number, shape in enumerate(shapes):
        far = oracle_depth(shape, ray, t, matrix[:3, 3:])
        closer = far < best
        best[closer], nearest[closer] = far[closer], number
    return nearest


def oracle_depth(shape, ray, t, eye):
    """How far off the rays (3, n) from `eye` (3, 1) hit a shape at times t (n,); inf for never."""
    move = np.zeros(3) if shape.motion is None else np.array(shape.motion.displacement)
    shift = t * move[:, None] - eye
    if isinstance(shape, Sphere):
        return oracle_sphere(np.array(shape.center)[:, None] + shift, shape.radius, ray)
    if isinstance(shape, Triangle):
        return oracle_triangle([np.array(v)[:, None] + shift for v in shape.vertices], ray)
    if isinstance(shape, Ellipse):
        return oracle_ellipse(np.array(shape.center)[:, None] + shift, shape, ray)
    if isinstance(shape, Cylinder):
        return oracle_cylinder(*(np.array(end)[:, None] + shift for end in ends(shape)), shape, ray)
    return oracle_quad(np.array(shape.corner)[:, None] + shift, shape, ray)


def oracle_sphere(center, radius, ray):
    along = (center * ray).sum(axis=0)
    gap = ((center - along * ray) ** 2).sum(axis=0)
    half = np.sqrt(np.maximum(radius**2 - gap, 0.0))
    far = np.where(along - half > 0.0, along - half, along + half)
    return np.where((gap <= radius**2) & (far > 0.0), far, np.inf)


def oracle_quad(corner, quad, ray):
    far, a, b = oracle_plane(corner, quad.edge_u, quad.edge_v, ray)
    return np.where((a >= 0) & (a <= 1) & (b >= 0) & (b <= 1) & (far > 0), far, np.inf)


def oracle_ellipse(center, ellipse, ray):
    far, a, b = oracle_plane(center, ellipse.half_u, ellipse.half_v, ray)
    return np.where((a * a + b * b <= 1.0) & (far > 0.0), far, np.inf)


def ends(cylinder):
    """Both ends of a cylinder."""
    return cylinder.start, cylinder.end


def oracle_cylinder(start, end, cylinder, ray):
    """First hit of a solid cylinder or cone, in coordinates with the axis as the third: ends or
    side. The side's radius is wide + rate * height.
    """
    axis = np.array(cylinder.end) - np.array(cylinder.start)
    length = np.linalg.norm(axis)
    frame = np.linalg.svd(axis[None] / length)[2]  # the axis, or its opposite, and two others
    frame[0] = axis / length
    w, o = frame @ ray, -(frame @ start)
    wide, narrow = cylinder.radii
    rate = (narrow - wide) / length
    found = []
    size, growth = wide + rate * o[0], rate * w[0]
    a = w[1] ** 2 + w[2] ** 2 - growth**2
    b = w[1] * o[1] + w[2] * o[2] - growth * size
    square = b * b - a * (o[1] ** 2 + o[2] ** 2 - size**2)
    with np.errstate(all="ignore"):
        for sign in (-1.0, 1.0):
            t = (-b + sign * np.sqrt(square)) / a
            height = o[0] + t * w[0]
            found.append(np.where((height >= 0.0) & (height <= length) & (t > 0.0), t, np.inf))
        for height, radius in ((0.0, wide), (length, narrow)):
            t = (height - o[0]) / w[0]
            off = np.hypot(o[1] + t * w[1], o[2] + t * w[2])
            found.append(np.where((off <= radius) & (t > 0.0), t, np.inf))
    return np.nanmin(found, axis=0)


def oracle_plane(origin, u, v, ray):
    """Distances of hits of the plane of two vectors, and the coordinates of the hits in these."""
    u, v = np.array(u), np.array(v)
    normal = np.cross(u, v)
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (origin * normal[:, None]).sum(axis=0) / (normal @ ray)
        rest = far * ray - origin
        a = np.cross(v, normal) @ rest / (normal @ normal)
        b = np.cross(normal, u) @ rest / (normal @ normal)
    return far, a, b


def blocked(shapes, start, end, t, skip=()):
    """Whether a shape cuts the open segments from `start` to `end` (3, n) at times t (n,)."""
    way = end - start
    cut = np.zeros(way.shape[1], dtype=bool)
    length = np.linalg.norm(way, axis=0)
    for number, shape in enumerate(shapes):
        if number not in skip:
            far = oracle_depth(shape, way / length, t, start)
            cut |= (far > 1e-9 * length) & (far < length)
    return cut


def oracle_triangle(vertices, ray):
    corner, a, b = vertices[0], vertices[1] - vertices[0], vertices[2] - vertices[0]
    with np.errstate(all="ignore"):
        # Cramer's rule for s w = corner + x a + y b
        determinant = (np.cross(a, b, axis=0) * ray).sum(axis=0)
        far = (np.cross(a, b, axis=0) * corner).sum(axis=0) / determinant
        x = -(np.cross(ray, corner, axis=0) * b).sum(axis=0) / determinant
        y = (np.cross(ray, corner, axis=0) * a).sum(axis=0) / determinant
        hit = (x >= 0.0) & (y >= 0.0) & (x + y <= 1.0) & (far > 0.0)
    return np.where(hit, far, np.inf)
