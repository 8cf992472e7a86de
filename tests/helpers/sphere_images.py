# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of the sphere of directions for tests, and sums over them that share no code."""

from __future__ import annotations

import numpy as np

from adaptive_drt.scene.description import EnvironmentLight

__all__ = ["brute_force", "glow", "noise", "radiance_of", "random_turn", "unit"]


def unit(rng, *shape):
    vector = rng.normal(size=(3, *shape))
    return vector / np.sqrt((vector * vector).sum(axis=0))


def random_turn(rng):
    """The rows of a random rotation."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return tuple(map(tuple, turn * np.sign(np.linalg.det(turn))))


def glow(rows=24, columns=48):
    """A bluish sky with a warm glow over dark ground."""
    y, x = np.meshgrid(
        (np.arange(rows) + 0.5) / rows, (np.arange(columns) + 0.5) / columns, indexing="ij"
    )
    spot = np.exp(-(((y - 0.3) ** 2) / 0.02 + ((x - 0.6) ** 2) / 0.01))
    sky = 0.2 + 0.8 / (1.0 + np.exp(40.0 * (y - 0.5)))
    return spot[..., None] * (6.0, 5.0, 3.0) + sky[..., None] * (0.4, 0.6, 1.0)


def noise(rng, rows=12, columns=24):
    return rng.random((rows, columns, 3)) ** 3


def radiance_of(light: EnvironmentLight, way):
    """Radiance (3, ...) in unit directions (3, ...), pixel by pixel as the record describes it."""
    rows, columns, _ = light.pixels.shape
    x, y, z = np.einsum("ij,j...->i...", np.array(light.rotation), way)
    u = (0.5 - np.arctan2(y, x) / (2.0 * np.pi)) * columns - 0.5
    v = np.arccos(np.clip(z, -1.0, 1.0)) / np.pi * rows - 0.5
    i, j = np.floor(u).astype(int), np.floor(v).astype(int)
    a, b = (u - i)[..., None], (v - j)[..., None]
    at = lambda dj, di: light.pixels[(j + dj) % rows, (i + di) % columns]  # noqa: E731
    upper, lower = (1 - a) * at(0, 0) + a * at(0, 1), (1 - a) * at(1, 0) + a * at(1, 1)
    return np.moveaxis(((1 - b) * upper + b * lower) * light.radiance, -1, 0)


def brute_force(light, normal, hides, count=400_000):
    """Integral (3,) of L max(0, n.w) over the directions that nothing hides, and its deviation.

    hides : tells of directions (3, m) which are hidden.
    """
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    psi = 2.0 * np.pi * index * (np.sqrt(5.0) - 1.0) / 2.0
    aside = np.sqrt(1.0 - z * z)
    way = np.array([aside * np.cos(psi), aside * np.sin(psi), z])
    seen = np.maximum(normal @ way, 0.0) * ~hides(way)
    return 4.0 * np.pi * (radiance_of(light, way) * seen).mean(axis=1)
