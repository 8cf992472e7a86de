# SPDX-License-Identifier: GPL-3.0-or-later
"""Record of many spheres of one object as arrays, such as a point cloud or a ball's instances."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .description import (
    EVERYWHERE,
    Material,
    Motion,
    ShapeBatch,
    Sphere,
    Visibility,
    vector_of,
)
from .values import LARGEST_COORDINATE, SMALLEST_SIZE

__all__ = ["Spheres"]


@dataclass(frozen=True, eq=False, repr=False)
class Spheres(ShapeBatch):
    """n spheres of one object, as `Sphere` describes one: see `ShapeBatch`.

    Attributes
    ----------
    center : (3, n) float64, metres.
    radius : (n,) float64, metres.
    albedo : (3, n) float64, the diffuse albedo of each sphere in place of its material's colour.
        None: the materials' colours are used.
    displacement : (3, n) float64, metres from shutter open to shutter close, of each sphere in
        place of `motion`. None: `motion` is that of all spheres.
    """

    center: NDArray[np.float64]
    radius: NDArray[np.float64]
    slot: NDArray[np.int64]
    materials: tuple[Material, ...]
    motion: Motion | None = None
    name: str = "Spheres"
    visibility: Visibility = EVERYWHERE
    albedo: NDArray[np.float64] | None = None
    displacement: NDArray[np.float64] | None = None
    single: ClassVar[type] = Sphere
    arrays: ClassVar[tuple[str, ...]] = ("center", "radius")
    optional: ClassVar[tuple[str, ...]] = ("albedo", "displacement")

    def colors(self) -> NDArray[np.float64]:
        """Return the diffuse albedo (3, n) of each sphere."""
        return super().colors() if self.albedo is None else self.albedo

    def displacements(self) -> NDArray[np.float64] | None:
        """Return the displacement (3, n) of each sphere, metres; None: `motion` is that of all."""
        return self.displacement

    def record(self, index: int) -> Sphere:
        """Return one of the spheres as a record of its own."""
        material, motion = self.materials[self.slot[index]], self.motion
        if self.albedo is not None:
            material = replace(material, color=vector_of(self.albedo[:, index]))
        if self.displacement is not None:
            way = self.displacement[:, index]
            motion = Motion(vector_of(way)) if way.any() else None
        place, radius = vector_of(self.center[:, index]), float(self.radius[index])
        return Sphere(place, radius, material, motion, self.name, self.visibility)

    def suspects(self) -> NDArray[np.int64]:
        """Indices, ascending, of all spheres that may have a defect."""
        if self.has_common_defect():
            return np.arange(self.count)
        fine = (self.radius >= SMALLEST_SIZE) & (self.radius < LARGEST_COORDINATE)
        for vectors in (self.center, self.albedo, self.displacement):
            if vectors is not None:
                fine &= (np.abs(vectors) <= LARGEST_COORDINATE).all(axis=0)
        return np.flatnonzero(~fine)
