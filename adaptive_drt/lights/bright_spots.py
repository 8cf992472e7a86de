# SPDX-License-Identifier: GPL-3.0-or-later
"""Suns in images of the sphere, taken out of them as lights of their own.

A few pixels may light a scene as much as all others together, and cast sharp shadows, for which a
sun has closed forms. Each such spot becomes a disk of uniform radiance with the same irradiance,
direction and second moment; the pixels keep the radiance of those around them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Ints, Mask
from ..scene.description import EnvironmentLight, SunLight
from .environment_reduction import MOST_TEXELS

__all__ = ["split_bright_spots"]


BRIGHT = 20.0
"""Radiance of a spot, as a multiple of the mean over the sphere."""
LEAST_SHARE = 0.003
"""Least irradiance of a spot, as a fraction of that of the mean radiance."""
LARGEST_ANGLE = 0.15
"""Largest half angle of a spot, in radians: about 9 degrees."""
MOST_SPOTS = 8
"""Largest number of spots that are taken out of an image: each is a light."""
MOST_PIXELS = 20_000
"""Number of bright pixels above which the brightest of so many are looked at."""


def split_bright_spots(light: EnvironmentLight) -> tuple[EnvironmentLight, tuple[SunLight, ...]]:
    """Return an environment without its bright spots, and these as suns."""
    rows, count, _ = light.pixels.shape
    # large images are kept as they come, to bound memory
    large = rows * count > MOST_TEXELS
    pixels: Any = np.array(light.pixels, dtype=light.pixels.dtype if large else np.float64)
    theta = (np.arange(rows) + 0.5) * (np.pi / rows)
    area = np.sin(theta) * (2.0 * np.pi * np.pi / (rows * count))
    size = pixels.max(axis=2)
    mean = float((size.sum(axis=1) * area).sum() / (4.0 * np.pi))
    bright = size > BRIGHT * mean
    if not bright.any() or bright.sum() == bright.size:
        return light, ()
    if bright.sum() > MOST_PIXELS:
        bright &= size >= np.partition(size.ravel(), -MOST_PIXELS)[-MOST_PIXELS]
    found = []
    for y, x in _components(bright):
        around = _around(pixels, bright, y, x)
        excess = np.maximum(pixels[y, x] - around, 0.0) * area[y, None]
        share = float(excess.sum(axis=0).max()) / (np.pi * mean)
        found.append((share, y, x, around, excess))
    found.sort(key=lambda spot: -spot[0])
    suns: list[SunLight] = []
    for share, y, x, around, excess in found[:MOST_SPOTS]:
        way, half = _disk(theta, count, y, x, excess.sum(axis=1))
        if share < LEAST_SHARE or half > LARGEST_ANGLE:
            continue
        pixels[y, x] = np.minimum(pixels[y, x], around)
        # the image's frame to the world's, and against the light
        a, b, c = (float(v) for v in -(way @ np.array(light.rotation)))
        red, green, blue = (float(v) for v in excess.sum(axis=0) * np.array(light.radiance))
        shown = _spot_name(light.name, len(suns))
        suns.append(
            SunLight(
                (a, b, c), (red, green, blue), 2.0 * half,
                casts_shadow=light.casts_shadow, name=shown,
            )
        )  # fmt: skip
    return (replace(light, pixels=pixels), tuple(suns)) if suns else (light, ())


def _spot_name(name: str, number: int) -> str:
    """Return the name of a spot of a light."""
    return f"{name}, bright spot {number + 1}"


def _components(bright: Mask) -> Iterator[tuple[Ints, Ints]]:
    """Yield rows and columns of pixels that touch each other; the columns go around."""
    count = bright.shape[1]
    left = set(zip(*(index.tolist() for index in bright.nonzero()), strict=True))
    while left:
        todo, spot = [left.pop()], []
        while todo:
            y, x = todo.pop()
            spot.append((y, x))
            for j in (-1, 0, 1):
                for i in (-1, 0, 1):
                    other = (y + j, (x + i) % count)
                    if other in left:
                        left.remove(other)
                        todo.append(other)
        rows, columns = np.array(sorted(spot)).T
        yield rows, columns


def _around(pixels: Array, bright: Mask, y: Ints, x: Ints) -> Array:
    """Mean (3,) of the pixels around a spot that are not bright."""
    rows, count = bright.shape
    near: NDArray[np.bool_] = np.zeros_like(bright)
    for j in (-1, 0, 1):
        for i in (-1, 0, 1):
            near[np.clip(y + j, 0, rows - 1), (x + i) % count] = True
    ring = near & ~bright
    found: Array = pixels[ring].mean(axis=0) if ring.any() else np.zeros(3)
    return found


def _disk(theta: Array, count: int, y: Ints, x: Ints, weight: Array) -> tuple[Array, float]:
    """Direction (3,) in the image's frame, and half angle, of the disk with a spot's moments."""
    psi = np.pi - (x + 0.5) * (2.0 * np.pi / count)
    aside = np.sin(theta[y])
    way = np.array([aside * np.cos(psi), aside * np.sin(psi), np.cos(theta[y])])
    middle = (way * weight).sum(axis=1)
    middle = middle / np.sqrt((middle * middle).sum())
    # half a chord squared is 1 - cosine; between the middles of pixels radiance is linear
    square = 2.0 * np.maximum(1.0 - middle @ way, 0.0)
    step = np.pi / theta.size, 2.0 * np.pi / count
    square = square + (step[0] ** 2 + (step[1] * aside) ** 2) / 6.0
    half = np.sqrt(2.0 * float((square * weight).sum() / weight.sum()))
    return middle, float(half)
