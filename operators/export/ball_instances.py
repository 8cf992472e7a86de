# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances of one ball by the hundred thousand: read as arrays, and rendered as one batch.

What is done for each instance in Python is to find its group; all the rest is done for the first
instance of a group, and for the arrays of all.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.scene.description import Issue, Material, ShapeRecord, Sphere
from ...adaptive_drt.scene.primitive_recognition import MeshSphere
from ...adaptive_drt.scene.sphere_batch import Spheres
from .copies import Copies
from .deforming import Deforming, Snapshot
from .instances import key_of
from .mesh import UNIFORM, Layout, shapes_of
from .shutter import CURVED, TURNED, Matrix, Track, instance_matrices


@dataclass(frozen=True)
class Motions:
    """What tells how instances move during the shutter.

    Attributes
    ----------
    opens, closes : all instances at its ends.
    deforming : tells which meshes change.
    """

    opens: Snapshot
    closes: Snapshot
    deforming: Deforming

    @cached_property
    def growing(self) -> list[bool]:
        """Whether the size of what has a row at the opening changes until the closing."""
        then = np.full(len(self.opens.matrices), -1)
        for key, row in self.opens.rows.items():
            then[row] = self.closes.rows.get(key, -1)
        found: list[bool] = _grow(self.opens.matrices, self.closes.matrices[then]).tolist()
        return found


@dataclass(frozen=True)
class Entry:
    """What an instance has come to.

    Attributes
    ----------
    place : its index among all entries.  shape : a record, or copies of a mesh.
    form : what its mesh stands for.
    """

    place: int
    shape: ShapeRecord | Copies
    form: Any


@dataclass
class _Group:
    """Instances that differ only in where they are.

    Attributes
    ----------
    place : index of the first one among all entries; the batch takes its place.
    ball : the shape of the first one.  form : the ball in the mesh's own space.
    moves : whether their motion is rendered.  deforms : whether a change of the mesh is told.
    numbers : of the instances in the depsgraph.
    opens, closes : their matrices (4, 4) at the ends of the shutter; None for an instance that is
        not there then.
    """

    place: int
    ball: Sphere
    form: MeshSphere
    moves: bool
    deforms: bool
    numbers: list[int] = field(default_factory=list)
    opens: list[int] = field(default_factory=list)
    closes: list[int] = field(default_factory=list)
    layouts: tuple[Layout | None, Layout | None] | None = None


class BallInstances:
    """Gathers the instances of balls.

    Parameters
    ----------
    depsgraph : at the middle of the shutter.
    motions : None without motion blur.
    """

    def __init__(self, depsgraph: Any, motions: Motions | None) -> None:
        self._depsgraph = depsgraph
        self._motions = motions
        self._groups: dict[Hashable, _Group] = {}

    @cached_property
    def _matrices(self) -> Matrix:
        """World matrices (n, 4, 4) of all instances, in their order."""
        return instance_matrices(self._depsgraph)

    @cached_property
    def _scales(self) -> Matrix:
        """The uniform scale (n,) of each instance; 0 where a ball would not stay one."""
        with np.errstate(all="ignore"):
            return _uniform_scales(self._matrices)

    @cached_property
    def _regular(self) -> list[bool]:
        """Whether each instance of a ball is a ball, and is shown."""
        shown = np.empty(len(self._scales), dtype=np.bool_)
        self._depsgraph.object_instances.foreach_get("show_self", shown)
        found: list[bool] = (shown & (self._scales > 0.0)).tolist()
        return found

    def take(self, number: int, instance: Any, key: Hashable) -> bool:
        """Whether an instance is another one of a group, which then has it.

        key : its `repetition_of`.
        """
        group = self._groups.get(key)
        return group is not None and self._regular[number] and self._enter(group, number, instance)

    def start(
        self, number: int, instance: Any, key: Hashable | None, entry: Entry, moves: bool
    ) -> None:
        """Let an instance that has been read be the first of a group, if it is a ball.

        Parameters
        ----------
        key : its `repetition_of`.  entry : its only one.
        moves : whether motion blur is on for it and for its instancer.
        """
        shape, form = entry.shape, entry.form
        if not (isinstance(shape, Sphere) and isinstance(form, MeshSphere)):
            return
        if key is None or not self._regular[number]:
            return
        if any(shape.material.emission) or key in self._groups:
            return  # what shines is a light of its own; what has a group was read by itself
        motions = self._motions if moves else None
        deforms = motions is not None and motions.deforming.concerns(instance)
        group = _Group(entry.place, shape, form, motions is not None, deforms)
        if self._enter(group, number, instance):
            self._groups[key] = group

    def _enter(self, group: _Group, number: int, instance: Any) -> bool:
        """Enter an instance into a group; returns False where it must be read by itself."""
        motions = self._motions
        if group.moves and motions is not None:
            key = key_of(instance)
            opens, closes = motions.opens.rows.get(key, -1), motions.closes.rows.get(key, -1)
            if group.deforms:
                one, other = motions.opens.layouts[opens], motions.closes.layouts[closes]
                known = group.layouts
                if known is None or one is not known[0] or other is not known[1]:
                    if not motions.deforming.knows(instance, key):
                        return False
                    group.layouts = one, other
            if motions.growing[opens]:
                return False
            group.opens.append(opens)
            group.closes.append(closes)
        group.numbers.append(number)
        return True

    def finish(
        self, entries: list[tuple[ShapeRecord | Copies, frozenset[str]]], passing: str
    ) -> list[Issue]:
        """Put the batches in the place of the first instances; returns what to tell of them.

        passing : what is told of an instance that is not there all the shutter.
        """
        issues: list[Issue] = []
        for group in self._groups.values():
            if len(group.numbers) > 1:
                names = entries[group.place][1]
                entries[group.place] = self._batch(group, passing, issues), names
        return issues

    def _batch(self, group: _Group, passing: str, issues: list[Issue]) -> Spheres:
        ball, form = group.ball, group.form
        matrices = self._matrices[group.numbers]
        center = np.array(form.center)
        place = _moved(matrices, center)
        way = None
        motions = self._motions
        if group.moves and motions is not None:
            ends = [
                motions.opens.matrices[group.opens],
                motions.closes.matrices[group.closes],
            ]
            if any(not np.isfinite(each).all() for each in ends):
                issues.append(Issue(ball.name, passing))
            place, way = _straight(place, *(_moved(each, center) for each in ends))
            for index in _worth_telling(matrices, *ends, center):
                track = Track(matrices[index], *(each[index] for each in ends))
                shapes_of(form, track, {form.slot: Material()}, ball.name, issues)
        radius = form.radius * self._scales[group.numbers]
        slot = np.zeros(radius.size, dtype=np.int64)
        return Spheres(
            np.ascontiguousarray(place.T), radius, slot, (ball.material,), None, ball.name,
            ball.visibility, displacement=way,
        )  # fmt: skip


def _uniform_scales(matrices: Matrix) -> Matrix:
    """Return the scale (n,) of each matrix that turns, mirrors and scales alike; 0 of others."""
    axes = [matrices[:, :3, k] for k in range(3)]
    squares = [(axis * axis).sum(axis=1) for axis in axes]
    square = (squares[0] + squares[1] + squares[2]) / 3.0
    slants = [np.abs((axes[j] * axes[k]).sum(axis=1)) for j, k in ((0, 1), (0, 2), (1, 2))]
    uneven = np.max([*(np.abs(each - square) for each in squares), *slants], axis=0)
    fine = np.isfinite(matrices).all(axis=(1, 2)) & (uneven <= 2.0 * UNIFORM * square)
    found: Matrix = np.where(fine, np.sqrt(square), 0.0)
    return found


def _grow(opens: Matrix, closes: Matrix) -> NDArray[np.bool_]:
    """Whether sizes change between matrices (n, 4, 4): such balls are rendered as meshes.

    What is not there at both ends, and has no finite matrix, does not.
    """
    with np.errstate(all="ignore"):
        sizes = [np.linalg.norm(each[:, :3, :3], axis=1) for each in (opens, closes)]
        found: NDArray[np.bool_] = np.abs(sizes[1] - sizes[0]).max(axis=1) > TURNED * sizes[0].max(
            axis=1
        )
    return found


def _moved(matrices: Matrix, point: Matrix) -> Matrix:
    """Return where each matrix (n, 4, 4) puts a point (3,): (n, 3)."""
    moved: Matrix = matrices[:, :3, :3] @ point + matrices[:, :3, 3]
    return moved


def _straight(middle: Matrix, start: Matrix, end: Matrix) -> tuple[Matrix, Matrix | None]:
    """Return the places (n, 3) of straight motions, and their ways (3, n); None if nothing moves.

    What is not there all the shutter stays at its middle, as in `shutter.path_of`.
    """
    way = np.where(np.isfinite(start) & np.isfinite(end), end - start, 0.0)
    moving = way.any(axis=1)
    if not moving.any():
        return middle, None
    place = np.where(moving[:, None], (start + end) / 2.0, middle)
    return place, np.ascontiguousarray(way.T)


def _worth_telling(middle: Matrix, opens: Matrix, closes: Matrix, center: Matrix) -> list[int]:
    """Return the first instance of each kind of which a sphere's path has something to tell."""
    at, start, end = (_moved(each, center) for each in (middle, opens, closes))
    with np.errstate(invalid="ignore"):
        there = np.isfinite(opens).all(axis=(1, 2)) & np.isfinite(closes).all(axis=(1, 2))
        still = (start == end).all(axis=1)
        bend = np.linalg.norm(at - (start + end) / 2.0, axis=1)
        bent = ~still & (bend > CURVED * np.linalg.norm(end - start, axis=1))
        back = still & (start != at).any(axis=1)
    found: list[NDArray[np.int64]] = [np.flatnonzero(m & there)[:1] for m in (bent, back)]
    return np.unique(np.concatenate(found)).tolist()
