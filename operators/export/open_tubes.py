# SPDX-License-Identifier: GPL-3.0-or-later
"""Tubes without ends: those whose ends lie within balls or ellipsoids are rendered as cylinders.

The two ends of such a tube are discs that nothing outside of these sees and that no light
passes, as nothing sees or passes what of opaque balls is around them. So the tube, the balls and
all else look the same with and without ends. All other tubes show their inner sides, and are
rendered with their faces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...adaptive_drt.geometry.cylinder.ends import hidden_ends
from ...adaptive_drt.scene.cylinder_recognition import MeshCylinder
from ...adaptive_drt.scene.description import Camera, Cylinder, Issue, ShapeRecord
from .copies import Copies
from .mesh import shapes_of, stays_cylinder, turns
from .shading import facets_left_out
from .shutter import Track

__all__ = ["OpenTubes"]

Entry = tuple[ShapeRecord | Copies, frozenset[str]]


@dataclass(frozen=True)
class _Candidate:
    """A tube that may be rendered as a cylinder, one of the places of its copies."""

    copies: Copies
    place: tuple[Track, str]
    shape: Cylinder
    issues: tuple[Issue, ...]


@dataclass
class OpenTubes:
    """Copies of meshes in the form of tubes without ends, and the forms."""

    found: list[tuple[Copies, MeshCylinder]] = field(default_factory=list)

    def settle(self, entries: list[Entry], camera: Camera) -> list[Issue]:
        """Make cylinders of the tubes whose ends are hidden; returns what is to be told of them.

        entries : shapes and copies of meshes, with the names by which collections hold their
            objects; the cylinders are appended, and copies that they stand for have no place.
        """
        tubes = [each for copies, form in self.found for each in _candidates(copies, form)]
        shapes = [shape for shape, _ in entries if not isinstance(shape, Copies)]
        while tubes:
            solids = [each.shape for each in tubes]
            hidden = hidden_ends(solids, shapes, _eye(camera)).all(axis=0)
            # a tube that another one is continued by must be one itself
            tubes = [each for each, fits in zip(tubes, hidden.tolist(), strict=True) if fits]
            if hidden.all():
                break
        issues: list[Issue] = []
        for each in tubes:
            each.copies.places.remove(each.place)
            entries.append((each.shape, each.copies.names))
            issues += each.issues
        return issues


def _candidates(copies: Copies, form: MeshCylinder) -> Sequence[_Candidate]:
    """The copies of a tube that stay cylinders where they stand."""
    found = []
    for track, name in copies.places:
        if not stays_cylinder(form, track.middle) or turns(form, track):
            continue
        issues = [Issue(name, reason) for reason in facets_left_out(form)]
        for shape in shapes_of(form, track, copies.worn, name, issues):
            assert isinstance(shape, Cylinder)
            seen = replace(shape, visibility=copies.visibility)
            found.append(_Candidate(copies, (track, name), seen, tuple(issues)))
    return found


def _eye(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Place (3,) of a camera at mid-shutter, metres, and its displacement over the shutter."""
    move = (0.0, 0.0, 0.0) if camera.motion is None else camera.motion.displacement
    return np.array([row[3] for row in camera.matrix[:3]]), np.array(move)
