# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of many flat faces over a floor."""

from __future__ import annotations

import numpy as np

from adaptive_drt.scene.description import Camera, Material, Quad, QuadLight, Quads, Scene, SkyLight

__all__ = ["cubes", "flat_scene", "picket_fence"]

AREA = QuadLight((1.0, -2.0, 4.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0), (20.0, 20.0, 20.0))
SKY = SkyLight((1.0, 1.0, 1.0))


def cubes(seed: int, count: int) -> Quads:
    """Boxes on the ground that turn about the vertical, six faces each."""
    rng = np.random.default_rng(seed)
    rows = int(np.ceil(np.sqrt(count)))
    size = 1.2 / np.sqrt(count)
    place = (np.array(divmod(np.arange(count), rows)) - 0.5 * rows + 0.5) * 4.0 / rows
    place = place + rng.uniform(-0.5, 0.5, (2, count)) * size
    u, v, w = size * rng.uniform(0.4, 1.0, (3, count)) * np.array([[1.0], [1.0], [2.0]])
    turn, zero = rng.uniform(0.0, np.pi, count), np.zeros(count)
    x = np.array([np.cos(turn), np.sin(turn), zero]) * u
    y = np.array([-np.sin(turn), np.cos(turn), zero]) * v
    z = np.array([zero, zero, w])
    a = np.array([*place, zero]) - 0.5 * (x + y)
    sides = [(a, y, x), (a + z, x, y), (a, x, z), (a + y, z, x), (a, z, y), (a + x, y, z)]
    return _quads(sides)


def picket_fence(bars: int, part: float) -> Quads:
    """Upright bars of three sides, 3 m in all, of which they fill a part."""
    x, width = -1.5 + 3.0 * np.arange(bars) / bars, 3.0 / bars * part
    zero = np.zeros(bars)
    corner = [
        np.array([x + a * width, zero + b * width, zero]) for a, b in ((0, 0), (1, 0), (0.5, 1))
    ]
    up = np.array([zero, zero, zero + 1.8])
    return _quads([(corner[k], corner[(k + 1) % 3] - corner[k], up) for k in range(3)])


def flat_scene(faces: Quads, light: QuadLight | SkyLight, size: tuple[int, int]) -> Scene:
    """Faces on a floor, seen from 7 m away and above."""
    back = np.array([3.0, -6.0, 3.5])
    z = back / np.linalg.norm(back)
    x = np.cross([0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x)
    axes = np.stack([x, np.cross(z, x), z, back + np.array([0.0, 0.0, 0.5])], axis=1)
    matrix = tuple(map(tuple, np.vstack([axes, [0.0, 0.0, 0.0, 1.0]]).tolist()))
    floor = Quad((-5.0, -5.0, 0.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0), Material((0.7, 0.7, 0.7)))
    return Scene(Camera(matrix=matrix, resolution=size), (floor, faces), (light,))


def _quads(sides: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> Quads:
    corner, u, v = (np.concatenate(each, axis=1) for each in zip(*sides, strict=True))
    none = np.zeros(corner.shape[1], dtype=np.int64)
    return Quads(corner, u, v, none, (Material((0.6, 0.6, 0.6)),))
