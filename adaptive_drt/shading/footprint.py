# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch of surface, and the stretch of time, that one shaded point stands for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.floats import TINY
from ..numerics.vector import dot
from ..tracing.compile import Plan
from ..tracing.intersect import Surface
from ..visibility.line_intervals import TIME

__all__ = ["FLAT", "Patch", "make_patch"]


FLAT = 2.0**-52
"""Cosine between normal and ray: the least that a plane is seen at."""
RIM = 2.0**-16
"""The same of a sphere. A ray that just misses one stands for its rim, where the cosine is nothing
but rounding, sign and all; a chord ends the steps long before."""


@dataclass(frozen=True)
class Patch:
    """How far n points stand for: half the extents of boxes in pixel x, y and shutter time.

    Attributes
    ----------
    steps : (3, 3, n) metres, how the hit moves from the box's middle to its side: axis x, y, t
        first, then components. On a moving object it moves along its ray.
    slides : (3, n) metres, how far it moves over the object's own surface.
    cross : (3, n) metres across the view, what the object moves against the ray.
    time : (n,) half the box's extent in shutter times.
    bend : (n,) curvature of the surface, 1 / m; 0 for planes.
    slant : (n,) cosine between the surface's normal and the ray, at least `FLAT` or `RIM`.
    axes : those that any of the boxes extends along; along others all steps are 0.
    margin : times its extent, how far around a patch shadows' edges are looked for.
    """

    steps: Array
    slides: Array
    cross: Array
    time: Array
    bend: Array
    slant: Array
    axes: tuple[int, ...]
    margin: float = 1.0

    @cached_property
    def reach(self) -> Array:
        """How far (metres) the patch reaches from its point: (n,)."""
        total: Array = np.zeros_like(self.time)
        for axis in self.axes:
            step = self.steps[axis]
            total += np.sqrt(dot(step, step))
        return total


def make_patch(plan: Plan, w: Array, t: Array, surface: Surface, half: Array) -> Patch:
    """The patches around hits.

    Parameters
    ----------
    w : (3, n) directions.  t : (n,) ray parameters of the hits.  surface : the hits.
    half : (3, n) half the boxes' extents in pixel x, y and shutter time.
    """
    lens, normal = plan.lens, surface.normal
    length = np.sqrt(dot(w, w))
    along = dot(normal, w)
    bend, least = np.zeros(t.size), np.full(t.size, FLAT)
    ball = (surface.item < plan.sphere_count).nonzero()[0]
    bend[ball], least[ball] = 1.0 / plan.spheres.radius[surface.item[ball]], RIM
    slant = np.maximum(np.abs(along) / length, least)
    safe = np.where(along <= least * length, -slant, slant) * length
    steps, slides, cross = np.zeros((3, 3, t.size)), np.zeros((3, t.size)), np.zeros((3, t.size))
    axes = tuple((half > 0.0).any(axis=1).nonzero()[0].tolist())
    for axis, step in ((0, lens.right), (1, lens.up)):
        if axis not in axes:
            continue
        against = (t * half[axis]) * step[:, None]
        cross[axis] = np.sqrt(dot(against, against))
        # the tangent plane at the hit
        moved = against - w * (dot(normal, against) / safe)
        slides[axis], part = _on_chord(moved, cross[axis], bend)
        steps[axis] = moved * part
    if TIME in axes:
        drift = _drift(plan, surface.item) * half[2]
        along = w * (dot(normal, drift) / safe)
        across = drift - w * (dot(w, drift) / (length * length))
        cross[2] = np.sqrt(dot(across, across))
        slides[2], part = _on_chord(drift - along, cross[2], bend)
        # how much deeper or nearer: no more than it moves and its surface bends
        deep = np.sqrt(dot(along, along))
        most = np.sqrt(dot(drift, drift)) + slides[2]
        steps[2] = along * np.minimum(1.0, most / np.maximum(deep, TINY))
    return Patch(steps, slides, cross, half[2], bend, slant, axes)


def _on_chord(moved: Array, cross: Array, bend: Array) -> tuple[Array, Array]:
    """Lengths (n,) of steps (3, n) on a tangent plane, no longer than a sphere's chord allows.

    Returns with them what part of each step that is.
    """
    size = np.sqrt(dot(moved, moved))
    radius = 1.0 / np.where(bend > 0.0, bend, 1.0)
    chord = np.where(bend > 0.0, cross + np.sqrt(2.0 * cross * radius), np.inf)
    short = np.minimum(size, chord)
    return short, short / np.maximum(size, TINY)


def _drift(plan: Plan, item: Ints) -> Array:
    """Displacements (3, n) of objects over the shutter."""
    drift = np.zeros((3, item.size))
    count = plan.sphere_count
    for part, chosen, first in (
        (plan.spheres, item < count, 0),
        (plan.quads, item >= count, count),
    ):
        rows = chosen.nonzero()[0]
        if part.displacement is not None and rows.size:
            drift[:, rows] = part.displacement[:, item[rows] - first]
    return drift
