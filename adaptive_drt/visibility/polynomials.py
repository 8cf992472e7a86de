# SPDX-License-Identifier: GPL-3.0-or-later
"""Candidates: objects that may be seen in boxes in pixel and shutter time, as polynomials.

Each kind of shape has polynomials of its own; here they are in groups, one a kind, in the order of
the registry. The expansion about the middles of boxes keeps precision: outlines are off by some
1e-12 of a pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.line_forms import BoxCoverage, BoxRays, LineForms
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.box_polynomials import Boxes
from ..numerics.vector import dot
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs

__all__ = ["CandidatePolynomials", "make_polynomials"]


@dataclass(frozen=True)
class CandidatePolynomials:
    """m candidates as polynomials, in groups of one kind of shape each.

    Attributes
    ----------
    kind : (m,) the group of each candidate.
    index : (m,) position of each candidate within its group.
    groups : the candidates of each kind that is present, in the order of the registry.
    """

    kind: Ints
    index: Ints
    groups: tuple[LineForms, ...]

    @property
    def count(self) -> int:
        """Number of candidates m."""
        return self.kind.size

    @property
    def surface(self) -> Ints:
        """Surface (m,) of each candidate: see `geometry.line_forms.DepthSurface`."""
        return np.array([group.surface for group in self.groups], dtype=np.int64)[self.kind]

    def take(self, rows: Ints) -> CandidatePolynomials:
        """Select candidates by index and renumber their rows."""
        kind = self.kind[rows]
        if len(self.groups) == 1:
            every = np.arange(rows.size)
            return CandidatePolynomials(kind, every, (self.groups[0].take(rows, every),))
        chosen, index, groups = self.index[rows], np.empty(rows.size, dtype=np.int64), []
        for number, group in enumerate(self.groups):
            own = (kind == number).nonzero()[0]
            index[own] = np.arange(own.size)
            groups.append(group.take(chosen[own], own))
        return CandidatePolynomials(kind, index, tuple(groups))

    def swap_axes(self, swapped: Mask) -> None:
        """Exchange x and y for the candidates chosen by a mask (m,), in place."""
        for group in self.groups:
            index = swapped[group.rows].nonzero()[0]
            if index.size:
                group.swap_axes(index)


def make_polynomials(
    plan: Plan, boxes: Boxes, pairs: Pairs
) -> tuple[CandidatePolynomials, BoxCoverage]:
    """Write the candidates `pairs` (box, object) as polynomials, and bound how they cover the
    boxes."""
    m = pairs.item.size
    size = _apparent_size(plan, boxes, pairs)
    kind, place = np.empty((2, m), dtype=np.int64)
    groups: list[LineForms] = []
    parts: list[tuple[Ints, BoxCoverage]] = []
    for shapes, rows, index in plan.shapes.groups(pairs.item):
        kind[rows], place[rows] = len(groups), np.arange(rows.size)
        group = shapes.line_forms(index, rows, BoxRays.make(plan.lens, boxes, pairs.pixel[rows]))
        groups.append(group)
        parts.append((rows, group.coverage(size if rows.size == m else size[:, rows])))
    return CandidatePolynomials(kind, place, tuple(groups)), BoxCoverage.join(parts, m)


def _apparent_size(plan: Plan, boxes: Boxes, pairs: Pairs) -> Array:
    """Half the apparent sizes (2, m) of candidates along x and y, in units of their boxes' sizes.

    They follow from the angular sizes of bounding spheres at mid-shutter as seen from the camera.
    """
    center, radius = plan.shapes.bounding_spheres
    away = np.maximum(np.sqrt(dot(center, center)), np.finfo(np.float64).tiny)
    with np.errstate(over="ignore"):  # overflow where the camera is at its center
        ratio = (radius / away)[pairs.item]
    middle, size = boxes.middle, boxes.size
    w = plan.lens.directions(middle[0], middle[1])
    length = np.sqrt(dot(w, w))
    apparent = np.empty((2, pairs.item.size))
    for k, step in ((0, plan.lens.right), (1, plan.lens.up)):
        across = size[k] * np.sqrt(dot(step, step))
        wide = np.where(across > 0.0, length, np.inf) / np.where(across > 0.0, across, 1.0)
        with np.errstate(over="ignore"):
            apparent[k] = ratio * wide[pairs.pixel]
    return apparent
