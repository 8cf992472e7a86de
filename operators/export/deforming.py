# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that change their form while the shutter is open."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .hair_curves import strands_of
from .instances import key_of
from .mesh import Layout, layout_of
from .point_cloud import cloud_of
from .shutter import Matrix, blurs

DEFORMS = "it deforms during the shutter; it is rendered as at the middle of the shutter"
VELOCITY = 'its "velocity" attribute moves it during the shutter; it is rendered without that'

STEADY = 1e-5
"""Of a mesh's extent: less change of its vertices is not seen."""

ROUNDINGS = 8.0 * float(np.finfo(np.float32).eps)
"""Of the largest coordinate: what modifiers' float32 takes from a mesh that stays the same."""


@contextmanager
def mesh_of(thing: Any) -> Iterator[Any]:
    """Yield an evaluated object's mesh; one in Edit Mode has its faces only in a copy of it."""
    if not thing.data.is_editmode:
        yield thing.data
        return
    try:
        yield thing.to_mesh()
    finally:
        thing.to_mesh_clear()


class LayoutReader:
    """Reads copies of meshes, points and hair as they are now; instances of one share its copy."""

    def __init__(self) -> None:
        self._read: dict[int, Layout] = {}

    def layout(self, thing: Any) -> Layout:
        """Return the copy of an evaluated object: a mesh, a point cloud or hair."""
        data = thing.data
        pointer = data.as_pointer()
        if pointer not in self._read:
            if thing.type == "POINTCLOUD":
                self._read[pointer] = cloud_of(data).layout
            elif thing.type == "CURVES":
                self._read[pointer] = strands_of(data).layout
            else:
                with mesh_of(thing) as mesh:
                    self._read[pointer] = layout_of(mesh)
        return self._read[pointer]


@dataclass(frozen=True)
class Snapshot:
    """All instances at one time of the shutter.

    Attributes
    ----------
    rows : the rows of the arrays, by the keys of the instances and of the camera.
    matrices : world matrices (n, 4, 4); the last one is of no instance, and not finite.
    layouts : what each row has for geometry; the last one has none.
    """

    rows: dict[Hashable, int]
    matrices: Matrix
    layouts: list[Layout | None]

    def matrix(self, key: Hashable) -> Matrix | None:
        """Return the world matrix (4, 4) of an instance, or None where it is not there."""
        row = self.rows.get(key)
        return None if row is None else self.matrices[row]

    def layout(self, key: Hashable) -> Layout | None:
        return self.layouts[self.rows.get(key, -1)]


@dataclass
class Deforming:
    """Tells which meshes change between the ends and the middle of the shutter."""

    opens: Snapshot
    closes: Snapshot
    _known: dict[tuple[int, ...], tuple[str, ...]] = field(default_factory=dict)

    def reasons(self, instance: Any, mesh: Any, layout: Layout) -> tuple[str, ...]:
        """Return what to tell of an instance's geometry: nothing of what stays the same.

        Parameters
        ----------
        mesh : the mesh, point cloud or hair.
        layout : its own at the middle of the shutter.
        """
        if not self.concerns(instance):
            return ()
        ends, known = self._ends(instance, key_of(instance))
        if known not in self._known:
            self._known[known] = _compare(mesh, layout, ends)
        return self._known[known]

    def concerns(self, instance: Any) -> bool:
        """Whether motion blur of what deforms is on for an instance and for its instancer."""
        things = instance.object, instance.parent
        return blurs(*things) and blurs(*things, switch="use_deform_motion")

    def knows(self, instance: Any, key: Hashable) -> bool:
        """Whether `reasons` has been asked of another instance of the same meshes."""
        return self._ends(instance, key)[1] in self._known

    def _ends(
        self, instance: Any, key: Hashable
    ) -> tuple[tuple[Layout | None, ...], tuple[int, ...]]:
        """Return the layouts at both ends of the shutter, and by what `_known` holds an answer."""
        ends = self.opens.layout(key), self.closes.layout(key)
        return ends, (instance.object.data.as_pointer(), *map(id, ends))


def _compare(mesh: Any, layout: Layout, ends: tuple[Layout | None, ...]) -> tuple[str, ...]:
    if any(end is not None and _differ(layout, end) for end in ends):
        return (DEFORMS,)
    return (VELOCITY,) if _has_velocity(mesh) else ()


def _differ(one: Layout, other: Layout) -> bool:
    if one is other:
        return False
    if one.faces != other.faces or one.points.shape != other.points.shape:
        return True
    if np.array_equal(one.points, other.points):
        return False
    points: NDArray[np.float32] = one.points
    with np.errstate(all="ignore"):  # coordinates may be of any size, or no numbers
        allowed = STEADY * float(np.ptp(points, axis=0).max())
        allowed += ROUNDINGS * float(np.abs(points).max())
        return not float(np.abs(points - other.points).max()) <= allowed


def _has_velocity(mesh: Any) -> bool:
    """Whether Cycles moves a mesh's vertices or points by the attribute that simulations leave."""
    attribute = mesh.attributes.get("velocity")
    if attribute is None or (attribute.domain, attribute.data_type) != ("POINT", "FLOAT_VECTOR"):
        return False
    ways = np.zeros(len(attribute.data) * 3, dtype=np.float32)
    attribute.data.foreach_get("vector", ways)
    return bool(ways.any())
