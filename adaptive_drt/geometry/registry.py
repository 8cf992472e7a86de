# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of shapes that are rendered, in the order in which their objects are numbered."""

from __future__ import annotations

from collections.abc import Sequence

from ..numerics.arrays import Array
from ..scene.description import (
    Cylinder,
    Ellipse,
    Ellipsoid,
    Quad,
    ShapeBatch,
    ShapeRecord,
    Sphere,
    Triangle,
)
from ..scene.triangle_mesh import TriangleMesh
from .cylinder.ends import with_ends
from .cylinder.shape import CylinderSet
from .ellipse.shape import EllipseSet
from .ellipsoid.shape import EllipsoidSet
from .mesh.shape import MeshSet
from .polygon.shape import ParallelogramSet
from .polygon.triangle import TriangleSet
from .shape import ShapeSet
from .sphere.shape import SphereSet

__all__ = ["SHAPES", "faces_of", "kind_of"]

SHAPES: tuple[tuple[type, type[ShapeSet]], ...] = (
    (Sphere, SphereSet),
    (Quad, ParallelogramSet),
    (Triangle, TriangleSet),
    (Ellipse, EllipseSet),
    (Ellipsoid, EllipsoidSet),
    (Cylinder, CylinderSet),
    (TriangleMesh, MeshSet),
)
"""For each kind, the record of the scene description and the set that renders it. Kinds that fill
their bounding spheres come first: embree's proxies are those of the first objects."""


def kind_of(record: object) -> type:
    """The record of a single shape that a record is, or is many of."""
    return record.single if isinstance(record, ShapeBatch) else type(record)


def faces_of(records: Sequence[ShapeRecord], camera: tuple[Array, Array]) -> list[ShapeRecord]:
    """The shapes, with the faces of solids that are rendered as shapes of their own.

    camera : (3,) metres, its place at mid-shutter, and its displacement over the shutter.
    """
    return with_ends(records, camera)
