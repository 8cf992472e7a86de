# SPDX-License-Identifier: GPL-3.0-or-later
"""Two scenes like the paper's: its pictures are lost, so they are tuned to its flagged shares.

Metres, Z up. Penumbra: a = 27,901 / 90,000 = 0.31. Motion: a = 15,684 / 90,000 = 0.17.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import (
    Camera,
    Material,
    Motion,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    Vector,
)

__all__ = ["look_at", "motion_scene", "penumbra_scene"]

FLOOR = Quad(
    (-20.0, -20.0, 0.0),
    (40.0, 0.0, 0.0),
    (0.0, 40.0, 0.0),
    Material((0.62, 0.60, 0.56)),
    name="Floor",
)
BALLS = (
    Sphere((-2.5, 0.0, 0.95), 0.95, Material((0.72, 0.16, 0.12)), name="Left"),
    Sphere((0.0, -0.4, 0.95), 0.95, Material((0.80, 0.66, 0.16)), name="Middle"),
    Sphere((2.5, 0.0, 0.95), 0.95, Material((0.14, 0.50, 0.20)), name="Right"),
    Sphere((-1.3, 2.6, 0.95), 0.95, Material((0.14, 0.26, 0.72)), name="Behind left"),
    Sphere((1.3, 2.6, 0.95), 0.95, Material((0.55, 0.20, 0.60)), name="Behind right"),
)
CAMERA: tuple[Vector, Vector, float] = ((0.0, -8.5, 6.2), (0.0, 0.35, 0.25), 51.0)
"""Eye, target (metres) and focal length (mm): the plane fills the picture, so every pixel hits."""


def look_at(eye: Vector, target: Vector, focal_length: float, size: int) -> Camera:
    """A camera of size x size pixels at `eye` that looks at `target`, Z up; lens in mm."""
    back = np.subtract(eye, target)
    back /= np.linalg.norm(back)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    columns = np.stack([right, np.cross(back, right), back, eye], axis=1)
    matrix = (*(tuple(map(float, row)) for row in columns), (0.0, 0.0, 0.0, 1.0))
    return Camera(matrix=matrix, focal_length=focal_length, resolution=(size, size))


def quad_light(half: float, radiance: float) -> QuadLight:
    """A square light of side 2 * half (metres), above to the left, that shines straight down."""
    color = (radiance, 0.97 * radiance, 0.9 * radiance)
    return QuadLight((-1.8, -1.4, 5.5), (half, 0.0, 0.0), (0.0, -half, 0.0), color)


def penumbra_scene(size: int = 300) -> Scene:
    """Spheres on a plane under a quad light. Nothing moves."""
    return Scene(look_at(*CAMERA, size), (*BALLS, FLOOR), (quad_light(PENUMBRA_HALF, 14.0),))


def motion_scene(size: int = 300) -> Scene:
    """The middle one of several spheres moves right at constant speed."""
    motion = Motion((MOTION_PATH, 0.0, 0.0))
    balls = [replace(b, motion=motion) if b.name == "Middle" else b for b in BALLS]
    return Scene(look_at(*CAMERA, size), (*balls, FLOOR), (quad_light(0.5, 64.0),))


PENUMBRA_HALF = 1.63
"""Metres: half the quad light's side, tuned to the paper's share of penumbra pixels."""
MOTION_PATH = 1.43
"""Metres over the shutter, tuned to the paper's share of pixels with motion at order 1."""
