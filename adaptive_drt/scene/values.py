# SPDX-License-Identifier: GPL-3.0-or-later
"""Values in records of a scene: vectors and motion, and what is wrong with them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "LARGEST_COORDINATE",
    "MIN_EDGE_SINE",
    "SMALLEST_SIZE",
    "ZERO",
    "Motion",
    "Vector",
    "area_defect",
    "convexity_defect",
    "is_finite",
    "length_defect",
    "motion_defect",
    "radius_defect",
    "scaled_color",
    "vector_defect",
    "vector_of",
    "volume_defect",
]

Vector: TypeAlias = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)

LARGEST_COORDINATE = 1e30
"""Largest magnitude of a coordinate, in metres, and of a component of a colour. Beyond it the
fourth powers inside discriminants overflow float64."""
SMALLEST_SIZE = 1e-60
"""Smallest radius or edge length, in metres. Below it the fourth powers inside discriminants
underflow."""
MIN_EDGE_SINE = 2.0**-50
"""Smallest sine of the angle between two edges. Below it their cross product is mostly rounding
error."""

MIN_THICKNESS = 1e-6
"""Smallest ratio of the shortest to the longest half axis of an ellipsoid: in units of its half
axes, positions near a thinner one are known to few digits."""
PLANE_TOLERANCE = 1e-4
"""Largest distance of a planar polygon's vertices from its plane, as a fraction of its size, and
largest sine by which its outline may turn back: vertices come from float32, and from meshes whose
faces count as planar up to that angle."""


def vector_of(values: Iterable[float]) -> Vector:
    """Return three numbers, such as an array (3,), as a tuple of floats."""
    x, y, z = values
    return (float(x), float(y), float(z))


@dataclass(frozen=True)
class Motion:
    """Linear motion: displacement in metres from shutter open to shutter close."""

    displacement: Vector


def vector_defect(record: object, *names: str) -> str | None:
    """Return what is wrong with the vectors of these names, or None."""
    for name in names:
        if not is_finite(getattr(record, name)):
            return f"its {name} is not finite (or beyond {LARGEST_COORDINATE:g} m)"
    return None


def motion_defect(motion: Motion | None) -> str | None:
    """Return what is wrong with a motion, or None."""
    if motion is not None and not is_finite(motion.displacement):
        return f"its motion is not finite (or beyond {LARGEST_COORDINATE:g} m)"
    return None


def radius_defect(radius: float) -> str | None:
    """Return what is wrong with a radius, or None."""
    if not math.isfinite(radius) or not 0.0 < radius < LARGEST_COORDINATE:
        return f"its radius is {radius:g}; it must be a positive number"
    if radius < SMALLEST_SIZE:
        return f"its radius is {radius:g} m, less than {SMALLEST_SIZE:g} m"
    return None


def length_defect(start: Vector, end: Vector) -> str | None:
    """Return what is wrong with the ends of a segment, or None."""
    if not math.dist(start, end) > SMALLEST_SIZE:
        return "its ends are at the same place"
    return None


def area_defect(u: Vector, v: Vector) -> str | None:
    """Return what is wrong with the edges that span an area, or None."""
    return None if _has_area(u, v) else "it has no area"


def volume_defect(u: Vector, v: Vector, w: Vector) -> str | None:
    """Return what is wrong with the half axes of an ellipsoid, or None."""
    axes = np.array([u, v, w])
    largest = float(np.abs(axes).max())
    if largest < SMALLEST_SIZE:
        return f"it is smaller than {SMALLEST_SIZE:g} m"
    sizes = largest * np.linalg.svd(axes / largest, compute_uv=False)
    if sizes[2] < MIN_THICKNESS * sizes[0]:
        return f"it is thinner than {MIN_THICKNESS:g} of its length"
    return None if sizes[2] >= SMALLEST_SIZE else f"it is thinner than {SMALLEST_SIZE:g} m"


def convexity_defect(vertices: NDArray[np.float64]) -> str | None:
    """Return why vertices (k, 3), in order, are not those of a planar convex polygon, or None."""
    sides = np.roll(vertices, -1, axis=0) - vertices
    length = np.linalg.norm(sides, axis=1)
    if length.min() < SMALLEST_SIZE:
        return "two of its vertices are the same"
    # in units of its size: squares of coordinates may be out of range
    size = float(length.max())
    local = (vertices - vertices.mean(axis=0)) / size
    normal = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
    area = float(np.linalg.norm(normal))
    if not area > MIN_EDGE_SINE:
        return "it has no area"
    normal = normal / area
    if float(np.abs(local @ normal).max()) > PLANE_TOLERANCE:
        return "it is not planar"
    ways = sides / length[:, None]
    after = np.roll(ways, -1, axis=0)
    sine, cosine = np.cross(ways, after) @ normal, (ways * after).sum(axis=1)
    turns = float(np.arctan2(sine, cosine).sum()) / (2.0 * math.pi)
    convex = float(sine.min()) >= -PLANE_TOLERANCE and abs(turns - 1.0) < 0.5
    return None if convex else "it is not convex"


def scaled_color(color: Vector, factor: float) -> Vector:
    """Return a colour times a factor."""
    return (color[0] * factor, color[1] * factor, color[2] * factor)


def is_finite(vector: Vector) -> bool:
    """Whether a vector has three components of magnitude up to `LARGEST_COORDINATE`."""
    return len(vector) == 3 and all(abs(x) <= LARGEST_COORDINATE for x in vector)


def _has_area(u: Vector, v: Vector) -> bool:
    """Whether two edges span a parallelogram large enough and wide enough to have a normal."""
    size = math.hypot(*u), math.hypot(*v)
    if min(size) < SMALLEST_SIZE:
        return False
    u, v = vector_of(x / size[0] for x in u), vector_of(x / size[1] for x in v)
    sine = math.hypot(
        u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    )
    # the normal's length is squared once more
    return sine > MIN_EDGE_SINE and sine * size[0] * size[1] > SMALLEST_SIZE * SMALLEST_SIZE
