# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes over pixels and shutter before a plain camera, and all candidates of each."""

from __future__ import annotations

import numpy as np

from adaptive_drt.scene.description import Camera, Motion, Quad, Scene, Sphere, SphereLight
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.visibility.fragments import Boxes

SIZE = 24
LAMP = SphereLight((3.0, -2.0, 9.0), 0.5, (10.0, 10.0, 10.0))
PLAIN = Camera(resolution=(SIZE, SIZE))  # at the origin, looks along -z
FLOOR = Quad((-50.0, -1.0, -50.0), (100.0, 0.0, 0.0), (0.0, 0.0, 100.0))


def planned(*shapes, camera=PLAIN):
    return make_plan(Scene(camera, tuple(shapes), (LAMP,)), Settings(threads=1))


def every_pair(plan, count):
    """All objects as candidates of all boxes, in no order."""
    box, item = np.divmod(np.arange(count * plan.object_count), max(plan.object_count, 1))
    order = np.random.default_rng(1).permutation(box.size)
    return Pairs(box[order], item[order])


def random_boxes(rng, count, moving):
    """Boxes of 0.1 to 2 pixels, anywhere in the picture, over any part of the shutter."""
    size = 10 ** rng.uniform(-1.0, 0.3, (3, count))
    size[2] = np.minimum(size[2], 1.0) if moving else 0.0
    middle = rng.uniform(0, SIZE, (3, count))
    middle[2] = rng.uniform(-0.5, 0.5, count) * (1 - size[2]) if moving else 0.0
    return Boxes(middle - size / 2, middle + size / 2)


def dense(found, boxes, items=16):
    """Weights as a table (boxes, 1 + items): the background first."""
    table = np.zeros((boxes.low.shape[1], 1 + items))
    table[found.box, found.item + 1] = found.weight
    return table


def all_pairs(pairs, boxes):
    """Of candidates sorted by box, any two of a box, of some boxes."""
    one, other = (pairs.pixel[:, None] == pairs.pixel).nonzero()
    kept = (one < other) & boxes[pairs.pixel[one]]
    return one[kept], other[kept]


def random_shapes(rng, moving):
    """Spheres (0.1 to 4 m) and quads before the plain camera; some hold it, some are tiny."""

    def motion(size):
        if not moving or rng.random() < 0.4:
            return None
        return Motion(tuple((rng.normal(size=3) * size * rng.random()).tolist()))

    shapes = []
    for _ in range(rng.integers(1, 6)):
        depth = 10 ** rng.uniform(-0.2, 1.2)
        place = np.array([*rng.uniform(-0.45, 0.45, 2), -1.0]) * depth
        radius = depth * 10 ** rng.uniform(-2.2, -0.4)
        shapes.append(Sphere(tuple(place.tolist()), float(radius), motion=motion(depth / 3)))
    if rng.random() < 0.15:
        shapes.append(Sphere((0.3, -0.2, 0.5), 3.0, motion=motion(3.0)))
    for _ in range(rng.integers(0, 4)):
        depth = 10 ** rng.uniform(-0.2, 1.2)
        u, v = rng.normal(size=(2, 3)) * depth * 10 ** rng.uniform(-1.5, 0.3, (2, 1))
        corner = np.array([*rng.uniform(-0.45, 0.45, 2), -1.0]) * depth - (u + v) / 2
        parts = (tuple(part.tolist()) for part in (corner, u, v))
        shapes.append(Quad(*parts, motion=motion(depth / 3)))
    if rng.random() < 0.5:
        shapes.append(Quad((-50.0, -1.0, -50.0), (100.0, 0.0, 0.0), (0.0, 0.0, 100.0)))
    return sorted(shapes, key=lambda shape: isinstance(shape, Quad))
