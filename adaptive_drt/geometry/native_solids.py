# SPDX-License-Identifier: GPL-3.0-or-later
"""Solids that embree traces as they are: balls, ellipsoids, cylinders and truncated cones.

Each kind says which box it fills, and hands embree its geometry in units of a scene: relative to
the scene's middle and divided by its size. What moves is given at both ends of the shutter.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..numerics.arrays import Array
from .embree_library import (
    FLOAT3X4_COLUMNS,
    FLOAT4,
    INDICES,
    INSTANCE_ARRAY,
    TRANSFORMS,
    VERTICES,
    geometry_buffer,
    native_library,
    scene_of,
)

__all__ = ["Balls", "Cones", "Ellipsoids", "NativeSolids"]


SPHERE_POINTS, CONE_CURVES = 50, 15
"""Embree's numbers of spheres, and of linear curves of cones, which it closes with flat ends."""
UINT1 = 0x5001
"""Embree's number of the format of the first vertices of curves."""


class NativeSolids(ABC):
    """n solids of one kind.

    Attributes
    ----------
    displacement : (3, n) metres, over the shutter; None at rest.
    instanced : whether embree has them as instances: hits then have the numbers of these.
    """

    displacement: Array | None
    instanced: ClassVar[bool] = False

    @property
    @abstractmethod
    def count(self) -> int:
        """Number of solids."""

    @property
    @abstractmethod
    def thickness(self) -> Array:
        """Least half extents (n,), metres, that what embree rounds of rays is compared with."""

    @abstractmethod
    def _rest_box(self) -> tuple[Array, Array]:
        """Least and greatest coordinates (3, n) of solids at mid-shutter, metres."""

    @abstractmethod
    def geometry(self, middle: Array, size: float) -> int:
        """Embree's geometry, not committed.

        middle : (3, 1) metres.  size : metres, the unit.
        """

    def box(self) -> tuple[Array, Array]:
        """Least and greatest coordinates (3,) of all over the shutter, metres."""
        low, high = self._rest_box()
        path = 0.0 if self.displacement is None else 0.5 * np.abs(self.displacement)
        return (low - path).min(axis=1), (high + path).max(axis=1)

    @property
    def _ends(self) -> tuple[float, ...]:
        """The shutter times at which embree gets places."""
        return (0.0,) if self.displacement is None else (-0.5, 0.5)

    def _fill_places(
        self, values: Array, place: Array, end: float, middle: Array, size: float
    ) -> None:
        """Write points (3, n) metres, at a shutter time, into rows of a buffer (n, 3 or more)."""
        for axis in range(3):
            column = (place[axis] - middle[axis]) / size
            if self.displacement is not None:
                column += end * (self.displacement[axis] / size)
            values[:, axis] = column

    def _new_geometry(self, kind: int) -> int:
        """A geometry of so many time steps."""
        library = native_library()
        assert library is not None
        geometry: int = library.rtcNewGeometry(library.device, kind)
        library.rtcSetGeometryTimeStepCount(geometry, len(self._ends))
        return geometry


@dataclass(frozen=True)
class Balls(NativeSolids):
    """Balls of centres (3, n) and radii (n,), metres."""

    center: Array
    radius: Array
    displacement: Array | None = None

    @property
    def count(self) -> int:
        """See `NativeSolids.count`."""
        return self.radius.size

    @property
    def thickness(self) -> Array:
        """See `NativeSolids.thickness`."""
        return self.radius

    def _rest_box(self) -> tuple[Array, Array]:
        return self.center - self.radius, self.center + self.radius

    def geometry(self, middle: Array, size: float) -> int:
        """See `NativeSolids.geometry`."""
        made = self._new_geometry(SPHERE_POINTS)
        for slot, end in enumerate(self._ends):
            shape = (self.count, 4)
            values = geometry_buffer(made, VERTICES, FLOAT4, np.float32, shape, slot)
            self._fill_places(values, self.center, end, middle, size)
            values[:, 3] = self.radius / size
        return made


@dataclass(frozen=True)
class Cones(NativeSolids):
    """Cylinders and truncated cones with flat ends.

    Attributes
    ----------
    ends : (2, 3, n) metres, the centres of the ends.  radii : (2, n) metres, there; one may be 0.
    """

    ends: Array
    radii: Array
    displacement: Array | None = None

    @property
    def count(self) -> int:
        """See `NativeSolids.count`."""
        return self.radii.shape[1]

    @property
    def thickness(self) -> Array:
        """See `NativeSolids.thickness`."""
        way = self.ends[1] - self.ends[0]
        thickness: Array = np.minimum(
            self.radii.max(axis=0), 0.5 * np.sqrt((way * way).sum(axis=0))
        )
        return thickness

    def _rest_box(self) -> tuple[Array, Array]:
        radii = self.radii[:, None]
        return (self.ends - radii).min(axis=0), (self.ends + radii).max(axis=0)

    def geometry(self, middle: Array, size: float) -> int:
        """See `NativeSolids.geometry`."""
        made = self._new_geometry(CONE_CURVES)
        for slot, moment in enumerate(self._ends):
            shape = (2 * self.count, 4)
            values = geometry_buffer(made, VERTICES, FLOAT4, np.float32, shape, slot)
            for which in range(2):
                rows = values[which::2]
                self._fill_places(rows, self.ends[which], moment, middle, size)
                rows[:, 3] = self.radii[which] / size
        first = geometry_buffer(made, INDICES, UINT1, np.uint32, (self.count, 1))
        first[:, 0] = 2 * np.arange(self.count)
        return made


@dataclass(frozen=True)
class Ellipsoids(NativeSolids):
    """Ellipsoids: images of a unit ball.

    Attributes
    ----------
    center : (3, n) metres.  half_axes : (3, 3, n) metres, whose second axis counts the half axes.
    shortest : (n,) metres, the shortest principal half axes.
    """

    center: Array
    half_axes: Array
    shortest: Array
    displacement: Array | None = None
    instanced: ClassVar[bool] = True

    @property
    def count(self) -> int:
        """See `NativeSolids.count`."""
        return self.shortest.size

    @property
    def thickness(self) -> Array:
        """See `NativeSolids.thickness`."""
        return self.shortest

    def _rest_box(self) -> tuple[Array, Array]:
        reach = np.sqrt((self.half_axes**2).sum(axis=1))
        return self.center - reach, self.center + reach

    def geometry(self, middle: Array, size: float) -> int:
        """See `NativeSolids.geometry`: instances of one ball.

        Half axes are replaced by the principal ones. As these are perpendicular, each row of a
        matrix's inverse, which embree computes, is rounded relative to its own size.
        """
        library = native_library()
        assert library is not None
        ball = Balls(np.zeros((3, 1)), np.ones(1))
        inner = scene_of(ball.geometry(np.zeros((3, 1)), 1.0))
        made = self._new_geometry(INSTANCE_ARRAY)
        library.rtcSetGeometryInstancedScene(made, inner)
        library.rtcReleaseScene(inner)  # the geometry holds it
        turn, lengths, _ = np.linalg.svd(np.moveaxis(self.half_axes, -1, 0))
        # one column of a matrix after the other
        axes = np.swapaxes(turn * lengths[:, None], 1, 2).reshape(-1, 9)
        for slot, end in enumerate(self._ends):
            shape = (self.count, 12)
            values = geometry_buffer(made, TRANSFORMS, FLOAT3X4_COLUMNS, np.float32, shape, slot)
            values[:, :9] = axes / size
            self._fill_places(values[:, 9:], self.center, end, middle, size)
        return made
