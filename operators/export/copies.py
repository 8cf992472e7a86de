# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes in the places where they stand: many copies of one mesh share a record of it."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...adaptive_drt.scene.description import Issue, Material, ShapeRecord, Visibility
from ...adaptive_drt.scene.mesh_instances import MeshInstances, is_regular
from .shutter import Track, matrices_of
from .triangle_mesh import MeshForm, own_mesh, placed_mesh

FEWEST = 16
"""Number of copies of a mesh from which they share a record; fewer are meshes of their own."""


@dataclass
class Copies:
    """Copies of a mesh that wear the same materials and are met by the same rays.

    Attributes
    ----------
    worn : materials by the numbers of their slots.
    names : the names by which collections hold the objects.
    places : where the copies are, each with the name of its object.
    """

    form: MeshForm
    worn: Mapping[int, Material]
    visibility: Visibility
    names: frozenset[str]
    places: list[tuple[Track, str]] = field(default_factory=list)

    def key(self, by_names: bool) -> Hashable:
        """Return what is equal for those that may share a record.

        by_names : whether the names of their objects are to be the same, too.
        """
        worn = tuple(sorted(self.worn.items()))
        return id(self.form), worn, self.visibility, self.names if by_names else None

    def shapes(self, issues: list[Issue]) -> list[ShapeRecord]:
        """Return the records of the copies, and append issues of those that make none."""
        fit = np.zeros(len(self.places), dtype=np.bool_)
        if fit.size >= FEWEST:
            # what is flat has no inverse
            middle = np.array([track.middle[:3, :3] for track, _ in self.places])
            fit = is_regular(middle.transpose(1, 2, 0))
        found: list[ShapeRecord] = []
        for (track, name), shared in zip(self.places, fit.tolist(), strict=True):
            if not shared:
                found += placed_mesh(self.form, track, self.worn, name, issues)
        if fit.any():
            mesh, worn = own_mesh(self.form, self.worn)
            tracks = [self.places[index][0] for index in fit.nonzero()[0].tolist()]
            found.append(MeshInstances(mesh, matrices_of(tracks), worn, name=self.places[0][1]))
        return [replace(shape, visibility=self.visibility) for shape in found]


def placed_shapes(
    entries: Sequence[tuple[ShapeRecord | Copies, frozenset[str]]],
    by_names: bool,
    issues: list[Issue],
) -> tuple[list[ShapeRecord], list[frozenset[str]]]:
    """Return all shapes, copies of a mesh in the place of the first, and the names of each.

    Parameters
    ----------
    entries : shapes and copies of meshes, with the names by which collections hold their objects.
    by_names : see `Copies.key`.
    """
    groups: dict[Hashable, Copies] = {}
    order: list[tuple[ShapeRecord | Copies, frozenset[str]]] = []
    for entry, names in entries:
        if not isinstance(entry, Copies):
            order.append((entry, names))
            continue
        key = entry.key(by_names)
        if key in groups:
            groups[key].places += entry.places
        else:
            groups[key] = entry
            order.append((entry, names))
    shapes: list[ShapeRecord] = []
    members: list[frozenset[str]] = []
    for entry, names in order:
        found = entry.shapes(issues) if isinstance(entry, Copies) else [entry]
        shapes += found
        members += [names] * len(found)
    return shapes, members
