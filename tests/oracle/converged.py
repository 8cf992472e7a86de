# SPDX-License-Identifier: GPL-3.0-or-later
"""Converged pictures: the truth that renders are measured against. Needs numba.

Shares no code with the core. Shapes and lights must not touch each other (see `light_jit`).
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from .cells_jit import means
from .rays_jit import pack

__all__ = ["Truth", "converged", "relative_rmse"]

CHUNK = 64
"""Pixels that a thread takes at a time."""


@dataclass(frozen=True)
class Truth:
    """Pixels (n, 2) as columns x, y; their radiance (n, 3); the rays that each took (n,)."""

    pixels: np.ndarray
    color: np.ndarray
    work: np.ndarray

    def picture(self, camera):
        """(3, height, width), if all pixels of the region are there."""
        left, bottom, right, top = camera.region
        out = np.full((3, top - bottom, right - left), np.nan)
        x, y = self.pixels.T
        out[:, y - bottom, x - left] = self.color.T
        return out


def converged(scene, pixels=None, goal=1e-4, threads=2, scale=None):
    """Truth of a scene.

    Parameters
    ----------
    pixels : (n, 2) columns x, y; None = all of the region, row by row from the bottom.
    goal : error, relative to the picture's mean radiance, at which an interval of a pixel is not
        halved any more. The RMSE reached is about a tenth of it.
    scale : the mean radiance, if known; otherwise that of a quick look at some pixels.
    """
    left, bottom, right, top = scene.camera.region
    if pixels is None:
        grid = np.meshgrid(np.arange(left, right), np.arange(bottom, top))
        pixels = np.stack(grid, axis=-1).reshape(-1, 2)
    packed = pack(scene)
    if scale is None:
        rng = np.random.default_rng(0)
        some = rng.integers((left, bottom), (right, top), (400, 2))
        still = scene_stands(scene)
        color, _ = _run(packed, some, 0.05 * max(_brightest(packed, some), 1e-300), threads, still)
        scale = float(color.mean())
    still = scene_stands(scene)
    color, work = _run(packed, pixels, goal * max(scale, 1e-300), threads, still)
    return Truth(pixels, color, work)


def scene_stands(scene):
    """Whether nothing moves within the shutter."""
    things = (*scene.shapes, *scene.lights, scene.camera)
    return not any(x.motion is not None and any(x.motion.displacement) for x in things)


def _brightest(packed, pixels):
    """A first idea of how bright the picture is: rough means of some pixels."""
    color, _ = _run(packed, pixels[:50], np.inf, 1, True)
    return float(color.max())


def _run(packed, pixels, goal, threads, still):
    balls, quads = packed[0].shape[0], packed[1].shape[0]
    most = 8 + balls + 6 * quads
    color, work = np.zeros((len(pixels), 3)), np.zeros(len(pixels))
    spots = np.ascontiguousarray(pixels, dtype=float)

    def chunk(start):
        rows = slice(start, start + CHUNK)
        means(packed, spots[rows], goal, not still, most, color[rows], work[rows])

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(chunk, range(0, len(pixels), CHUNK)))
    return color, work


def relative_rmse(color, truth):
    """RMSE of radiances (n, 3) over the truth's mean."""
    return float(np.sqrt(((color - truth) ** 2).mean()) / truth.mean())
