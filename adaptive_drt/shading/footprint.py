# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch of surface and the interval of time that a shaded point represents."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.axes import TIME
from ..numerics.floats import TINY
from ..numerics.vector import dot
from ..tracing.compile import Plan
from ..tracing.intersect import Surface

__all__ = ["MIN_PLANE_COSINE", "Patch", "make_patch"]


MIN_PLANE_COSINE = 2.0**-52
"""Least cosine between the normal of a plane and a ray."""
MIN_SPHERE_COSINE = 2.0**-16
"""Least cosine between the normal of a sphere and a ray. A ray that just misses a sphere stands for
its limb, where the cosine is only rounding, sign included; the steps are limited by a chord of the
sphere long before."""


@dataclass(frozen=True)
class Patch:
    """Patches around n points: the projections of half the boxes in pixel x, y and shutter time.

    Attributes
    ----------
    steps : (3, 3, n) metres, motion of the hit from the middle of the box to its side: first index
    axis x, y, t, then components. On a moving object the hit moves along its ray.
    slides : (3, n) metres, distance over the object's own surface by which the hit moves, by axis.
    cross : (3, n) metres, motion of the object relative to the ray and normal to it, by axis.
    time : (n,) half the box's extent in shutter times.
    bend : (n,) curvature of the surface, 1 / m; 0 for planes.
    slant : (n,) cosine between the surface's normal and the ray, at least `MIN_PLANE_COSINE` or
        `MIN_SPHERE_COSINE`.
    axes : axes along which any of the boxes extends; along others all steps are 0.
    margin : extent of the region in which shadow edges are searched, in units of the patch's
    extent.
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
        """Radii of the patches around their points in metres, (n,): the sum of the lengths of the
        steps."""
        total: Array = np.zeros_like(self.time)
        for axis in self.axes:
            step = self.steps[axis]
            total += np.sqrt(dot(step, step))
        return total


def make_patch(plan: Plan, w: Array, t: Array, surface: Surface, half: Array) -> Patch:
    """Patches around hits.

    Parameters
    ----------
    w : (3, n) directions.  t : (n,) ray parameters of the hits.  surface : the hits.
    half : (3, n) half the boxes' extents in pixel x, y and shutter time.
    """
    lens, normal = plan.lens, surface.normal
    length = np.sqrt(dot(w, w))
    along = dot(normal, w)
    bend, least = np.zeros(t.size), np.full(t.size, MIN_PLANE_COSINE)
    ball = (surface.item < plan.sphere_count).nonzero()[0]
    bend[ball], least[ball] = 1.0 / plan.spheres.radius[surface.item[ball]], MIN_SPHERE_COSINE
    slant = np.maximum(np.abs(along) / length, least)
    safe = np.where(along <= least * length, -slant, slant) * length
    steps, slides, cross = np.zeros((3, 3, t.size)), np.zeros((3, t.size)), np.zeros((3, t.size))
    axes = tuple((half > 0.0).any(axis=1).nonzero()[0].tolist())
    for axis, step in ((0, lens.right), (1, lens.up)):
        if axis not in axes:
            continue
        against = (t * half[axis]) * step[:, None]
        cross[axis] = np.sqrt(dot(against, against))
        # project the step along the ray onto the tangent plane at the hit
        moved = against - w * (dot(normal, against) / safe)
        slides[axis], part = _limit_to_chord(moved, cross[axis], bend)
        steps[axis] = moved * part
    if TIME in axes:
        drift = _displacements(plan, surface.item) * half[2]
        along = w * (dot(normal, drift) / safe)
        across = drift - w * (dot(w, drift) / (length * length))
        cross[2] = np.sqrt(dot(across, across))
        slides[2], part = _limit_to_chord(drift - along, cross[2], bend)
        # limit the change of depth by the motion of the object and the distance over its surface
        deep = np.sqrt(dot(along, along))
        most = np.sqrt(dot(drift, drift)) + slides[2]
        steps[2] = along * np.minimum(1.0, most / np.maximum(deep, TINY))
    return Patch(steps, slides, cross, half[2], bend, slant, axes)


def _limit_to_chord(moved: Array, cross: Array, bend: Array) -> tuple[Array, Array]:
    """Lengths (n,) of steps (3, n) in a tangent plane, limited by the length of a chord of the
    sphere.

    Returns with them the ratio of the limited and the original length.
    """
    size = np.sqrt(dot(moved, moved))
    radius = 1.0 / np.where(bend > 0.0, bend, 1.0)
    chord = np.where(bend > 0.0, cross + np.sqrt(2.0 * cross * radius), np.inf)
    short = np.minimum(size, chord)
    return short, short / np.maximum(size, TINY)


def _displacements(plan: Plan, item: Ints) -> Array:
    """Displacements (3, n) of objects over the shutter time."""
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
