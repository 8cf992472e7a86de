# SPDX-License-Identifier: GPL-3.0-or-later
"""Random cylinders before a camera at the origin that looks along -z, and plain facts of them."""

from __future__ import annotations

import numpy as np

from adaptive_drt.geometry.cylinder.shape import CylinderSet
from adaptive_drt.scene.description import Camera, Cylinder, Motion, Scene, SphereLight, vector_of
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan

SIZE = 24
CAMERA = Camera(resolution=(SIZE, SIZE))
LAMP = SphereLight((3.0, -2.0, 9.0), 0.5, (10.0, 10.0, 10.0))
EYE = np.zeros((3, 1))


def random_cylinder(rng, moving=False, around=False, tapers=False):
    """A cylinder in sight; `around`: the camera may be within it; `tapers`: a cone, truncated or
    not, either end of which may be the larger one.
    """
    middle = rng.normal(size=3) * 0.5 + (0.0, 0.0, 0.0 if around else -4.0)
    half = rng.normal(size=3) * 10 ** rng.uniform(-1.0, 0.5)
    radius = float(10 ** rng.uniform(-1.0, 0.3)) * (2.0 if around else 0.6)
    motion = None
    if moving and rng.random() < 0.7:
        motion = Motion(vector_of(rng.normal(size=3) * 0.4))
    end = random_taper(rng) * radius if tapers else None
    ends = vector_of(middle - half), vector_of(middle + half)
    return Cylinder(*ends, radius, motion=motion, end_radius=end)


def random_taper(rng):
    """The ratio of the radii of a cone's ends: 0 in a third of them."""
    return float(rng.choice([0.0, rng.uniform(0.05, 0.95), rng.uniform(1.05, 2.0)]))


def planned(*shapes):
    """A plan of shapes before the camera."""
    return make_plan(Scene(CAMERA, shapes, (LAMP,)), Settings(threads=1))


def cylinders_of(plan):
    """The sides of the cylinders of a plan."""
    return next(one for one in plan.shapes.sets if isinstance(one, CylinderSet))


def random_set(rng, count, spread=1.0, tapers=False):
    """A set of cylinders, or cones, about the origin, none of which moves."""
    records = []
    for _ in range(count):
        middle, half = rng.normal(size=(2, 3)) * spread
        radius = float(10 ** rng.uniform(-1.5, 0.0))
        end = random_taper(rng) * radius if tapers else None
        ends = vector_of(middle - half), vector_of(middle + half)
        records.append(Cylinder(*ends, radius, end_radius=end))
    return CylinderSet.from_records(records, EYE, None), records


def sizes_of(shapes, index):
    """Axes, half lengths, radii in the middle and slopes of solids, as the kernels take them."""
    return shapes.axis[:, index], shapes.half[index], shapes.radius[index], shapes.slope[index]
