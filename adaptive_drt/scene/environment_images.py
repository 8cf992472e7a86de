# SPDX-License-Identifier: GPL-3.0-or-later
"""Environment lights from images of the sphere: their projections, their mapping, and their sums.

An equirectangular image that is only turned is taken as it is. All others are looked up on a finer
equirectangular grid.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .description import EnvironmentLight
from .values import ZERO, Vector

__all__ = [
    "EQUIRECTANGULAR",
    "MIRROR_BALL",
    "MappedImage",
    "make_environment_light",
    "tabulated",
]

Array = NDArray[np.float64]

EQUIRECTANGULAR, MIRROR_BALL = "EQUIRECTANGULAR", "MIRROR_BALL"
"""Projections of images of the sphere."""
FINER = 2
"""Rows of the grid for each row of an image that is looked up."""
MOST_ROWS = 1_024
"""Largest number of rows of such a grid."""
POINTS_A_SIDE = 2
"""Number of points, a side, whose mean is the value of a texel of the grid."""
TURN_TOLERANCE = 1e-5
"""Largest relative difference of a mapping from a rotation that still counts as one: its numbers
are stored in float32."""
NO_SHIFT = 1e-7
"""Largest shift of unit vectors that counts as none."""


@dataclass(frozen=True)
class MappedImage:
    """An image of the sphere, looked up at mapped directions.

    Attributes
    ----------
    pixels : (rows, columns, 3) from the top down, linear.
    projection : how unit vectors become places in the image.
    matrix : (3, 4) affine map from unit directions of the world to vectors that are looked up.
    color : factor (RGB) on the pixels, W / m^2 / sr.
    error : error of the irradiance of the pixels, in units of theirs times sr.
    """

    pixels: NDArray[np.float32]
    projection: str
    matrix: Array
    color: Vector
    error: float = 0.0

    def rotation(self) -> Array | None:
        """Return the orthogonal matrix that the map comes to, or None where it is another one."""
        linear, shift = self.matrix[:, :3], self.matrix[:, 3]
        size = float(np.cbrt(abs(np.linalg.det(linear))))
        if not size > 0.0 or np.abs(shift).max() > NO_SHIFT * size:
            return None
        turn = linear / size
        if np.abs(turn @ turn.T - np.eye(3)).max() > TURN_TOLERANCE:
            return None
        left, _, right = np.linalg.svd(turn)
        orthogonal: Array = left @ right
        return orthogonal

    def radiance(self, direction: Array) -> Array:
        """Return the radiance (..., 3) in unit directions (..., 3) of the world."""
        way = direction @ self.matrix[:, :3].T + self.matrix[:, 3]
        length = np.sqrt((way * way).sum(axis=-1, keepdims=True))
        way = way / np.where(length > 0.0, length, 1.0)
        u, v = _PROJECTIONS[self.projection](way)
        value: Array = _bilinear(self.pixels, u, v) * np.array(self.color)
        return value


def make_environment_light(
    images: Sequence[MappedImage], constant: Vector = ZERO, name: str = "World"
) -> EnvironmentLight:
    """Return the light of a sum of images and a constant radiance."""
    if len(images) == 1 and constant == ZERO and images[0].projection == EQUIRECTANGULAR:
        image = images[0]
        turn = image.rotation()
        if turn is not None:
            pixels = image.pixels
            if np.linalg.det(turn) < 0.0:
                # a mirrored sphere is the mirrored image
                turn, pixels = np.diag([1.0, -1.0, 1.0]) @ turn, pixels[:, ::-1]
            a, b, c = ((float(x), float(y), float(z)) for x, y, z in turn)
            return EnvironmentLight(pixels, image.color, (a, b, c), name=name, error=image.error)
    rows = min(FINER * max(image.pixels.shape[0] for image in images), MOST_ROWS)

    def radiance(direction: Array) -> Array:
        total: Array = np.zeros(direction.shape) + np.array(constant)
        for image in images:
            total += image.radiance(direction)
        return total

    error = sum(image.error * max(image.color) for image in images)
    return EnvironmentLight(tabulated(radiance, rows), name=name, error=error)


def tabulated(radiance: Callable[[Array], Array], rows: int) -> NDArray[np.float32]:
    """Return an equirectangular image (rows, 2 rows, 3) of radiance by unit direction (..., 3)."""
    fine = rows * POINTS_A_SIDE
    theta = (np.arange(fine) + 0.5) * (np.pi / fine)
    psi = np.pi - (np.arange(2 * fine) + 0.5) * (np.pi / fine)
    image = np.zeros((rows, 2 * rows, 3), dtype=np.float32)
    around = np.stack([np.cos(psi), np.sin(psi)], axis=-1)
    for row in range(rows):
        part = theta[row * POINTS_A_SIDE : (row + 1) * POINTS_A_SIDE, None]
        flat = np.sin(part)[..., None] * around
        up = np.broadcast_to(np.cos(part)[..., None], (*flat.shape[:2], 1))
        value = radiance(np.concatenate([flat, up], axis=-1))
        image[row] = value.reshape(POINTS_A_SIDE, 2 * rows, POINTS_A_SIDE, 3).mean(axis=(0, 2))
    return image


def _equirectangular(way: Array) -> tuple[Array, Array]:
    """Places (...) in an image, from 0 to 1, from the left and from the bottom."""
    x, y, z = np.moveaxis(way, -1, 0)
    u = 0.5 - np.arctan2(y, x) / (2.0 * np.pi)
    return u, 1.0 - np.arccos(np.clip(z, -1.0, 1.0)) / np.pi


def _mirror_ball(way: Array) -> tuple[Array, Array]:
    """The same on a mirror ball, which is seen along the y axis."""
    x, y, z = np.moveaxis(way, -1, 0)
    behind = y - 1.0
    size = 2.0 * np.sqrt(np.maximum(-0.5 * behind, 0.0))
    safe = np.where(size > 0.0, size, 1.0)
    return 0.5 * (x / safe + 1.0), 0.5 * (z / safe + 1.0)


_PROJECTIONS: dict[str, Callable[[Array], tuple[Array, Array]]] = {
    EQUIRECTANGULAR: _equirectangular,
    MIRROR_BALL: _mirror_ball,
}


def _bilinear(pixels: NDArray[np.float32], u: Array, v: Array) -> Array:
    """Values (..., 3) between the middles of pixels, of an image that repeats."""
    rows, columns, _ = pixels.shape
    x, y = u * columns - 0.5, (1.0 - v) * rows - 0.5
    left, top = np.floor(x), np.floor(y)
    a, b = (x - left)[..., None], (y - top)[..., None]
    i, j = left.astype(np.int64), top.astype(np.int64)

    def at(row: NDArray[np.int64], column: NDArray[np.int64]) -> Array:
        found: Array = pixels[row % rows, column % columns].astype(np.float64)
        return found

    upper = (1.0 - a) * at(j, i) + a * at(j, i + 1)
    lower = (1.0 - a) * at(j + 1, i) + a * at(j + 1, i + 1)
    mixed: Array = (1.0 - b) * upper + b * lower
    return mixed
