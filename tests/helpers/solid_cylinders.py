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


def random_cylinder(rng, moving=False, around=False):
    """A cylinder in sight; `around`: the camera may be within it."""
    middle = rng.normal(size=3) * 0.5 + (0.0, 0.0, 0.0 if around else -4.0)
    half = rng.normal(size=3) * 10 ** rng.uniform(-1.0, 0.5)
    radius = float(10 ** rng.uniform(-1.0, 0.3)) * (2.0 if around else 0.6)
    motion = None
    if moving and rng.random() < 0.7:
        motion = Motion(vector_of(rng.normal(size=3) * 0.4))
    return Cylinder(vector_of(middle - half), vector_of(middle + half), radius, motion=motion)


def planned(*shapes):
    """A plan of shapes before the camera."""
    return make_plan(Scene(CAMERA, shapes, (LAMP,)), Settings(threads=1))


def cylinders_of(plan):
    """The sides of the cylinders of a plan."""
    return next(one for one in plan.shapes.sets if isinstance(one, CylinderSet))


def random_set(rng, count, spread=1.0):
    """A set of cylinders about the origin, none of which moves."""
    records = []
    for _ in range(count):
        middle, half = rng.normal(size=(2, 3)) * spread
        radius = float(10 ** rng.uniform(-1.5, 0.0))
        records.append(Cylinder(vector_of(middle - half), vector_of(middle + half), radius))
    return CylinderSet.from_records(records, EYE, None), records
