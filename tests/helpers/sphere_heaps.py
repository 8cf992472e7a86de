# SPDX-License-Identifier: GPL-3.0-or-later
"""Heaps of many balls on a floor, whose light rays find."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import (
    Light,
    Material,
    Motion,
    Quad,
    QuadLight,
    Scene,
    SkyLight,
    Sphere,
    vector_of,
)
from random_scenes import look_at

LIGHTS: dict[str, Light] = {
    "sky": SkyLight((1.0, 1.0, 1.0)),
    "square": QuadLight((2.0, -2.0, 9.0), (2.0, 0.0, 0.0), (0.0, -2.0, 0.0), (9.0,) * 3),
}


def sphere_heap(
    seed: int, count: int, light: str = "sky", size: tuple[int, int] = (32, 24)
) -> Scene:
    """So many balls, of which some overlap, on a floor, and a camera that they fill."""
    rng = np.random.default_rng(seed)
    half = 0.35 * count ** (1.0 / 3.0)
    colors = rng.uniform(0.3, 0.85, (6, 3)).tolist()
    balls = [
        Sphere(
            vector_of(rng.uniform((-half, -half, 0.0), (half, half, 2.0 * half))),
            rng.uniform(0.2, 0.5),
            Material(tuple(colors[k % 6])),
        )
        for k in range(count)
    ]
    floor = Quad((-9.0, -9.0, -0.5), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
    camera = look_at((0.0, -5.0 * half, 3.0 * half), (0.0, 0.0, half), resolution=size)
    return Scene(camera, (floor, *balls), (LIGHTS[light],))


def moving_heap(scene: Scene, path: float = 0.5) -> Scene:
    """The scene with every other ball moving, by up to a length in metres along each axis."""
    rng = np.random.default_rng(5)
    shapes = tuple(
        replace(shape, motion=Motion(vector_of(rng.uniform(-path, path, 3))))
        if isinstance(shape, Sphere) and k % 2
        else shape
        for k, shape in enumerate(scene.shapes)
    )
    return replace(scene, shapes=shapes)
