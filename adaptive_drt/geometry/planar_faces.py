# SPDX-License-Identifier: GPL-3.0-or-later
"""The planes of planar shapes, and the closed solids that they are faces of."""

from __future__ import annotations

from dataclasses import dataclass

from ..numerics.arrays import Array, Ints

__all__ = ["NO_SOLID", "PlanarFaces"]


NO_SOLID = -1
"""Number of the solid of a shape that is no face of a closed solid."""


@dataclass(frozen=True)
class PlanarFaces:
    """n planar shapes, relative to the camera, at mid-shutter.

    Attributes
    ----------
    vertices : points (3, n) of each shape's plane, metres, whose convex hull holds the shape.
    normal : (3, n) unit normals; those of faces of a closed solid point out of it.
    size : (n,) metres, the shortest edge of each shape.
    displacement : (3, n) metres over the shutter, or None if no shape moves.
    solid : (n,) number of the closed convex solid that each shape is a face of: the index of its
        first face in the set, or `NO_SOLID`.
    """

    vertices: tuple[Array, ...]
    normal: Array
    size: Array
    displacement: Array | None
    solid: Ints
