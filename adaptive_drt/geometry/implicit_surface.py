# SPDX-License-Identifier: GPL-3.0-or-later
"""Planes and spheres: the unbounded surfaces on which shapes lie, where they have a simple form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from ..numerics.arrays import Array
from ..numerics.vector import dot

__all__ = ["ImplicitPlane", "ImplicitSphere", "ImplicitSurface"]


@dataclass(frozen=True)
class ImplicitPlane:
    """Planes normal . P = offset, of m shapes each.

    Attributes
    ----------
    normal : (3, m), of any length.  point : (3, m) metres, a point of the plane.
    """

    normal: Array
    point: Array

    @property
    def offset(self) -> Array:
        """Products (m,) of the normal with the plane's points, metres times the normal's length."""
        return dot(self.normal, self.point)


@dataclass(frozen=True)
class ImplicitSphere:
    """Spheres |P - center| = radius: center (3, m), radius (m,), metres."""

    center: Array
    radius: Array


ImplicitSurface: TypeAlias = ImplicitPlane | ImplicitSphere
"""Surfaces of m shapes of one kind."""
