# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch of surface and the interval of time that a shaded point represents."""

from __future__ import annotations

import numpy as np

from ..geometry.patch import Patch
from ..geometry.shape import UNKNOWN_CURVATURE
from ..numerics.arrays import Array, Ints
from ..numerics.axes import TIME
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..tracing.compile import Plan
from ..tracing.intersect import Surface

__all__ = ["make_patch"]


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
    bend = plan.shapes.curvature_at(surface.item, surface.point, certain=False)
    least = plan.shapes.min_cosine[surface.item]
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
    sphere. Without a bound on the curvature they are not limited.

    Returns with them the ratio of the limited and the original length.
    """
    curved = (bend > 0.0) & (bend < UNKNOWN_CURVATURE)
    size = np.sqrt(dot(moved, moved))
    radius = 1.0 / np.where(curved, bend, 1.0)
    chord = np.where(curved, cross + np.sqrt(2.0 * cross * radius), np.inf)
    short = np.minimum(size, chord)
    return short, short / np.maximum(size, TINY)


def _displacements(plan: Plan, item: Ints) -> Array:
    """Displacements (3, n) of objects over the shutter time."""
    displacement = plan.shapes.displacement
    return np.zeros((3, item.size)) if displacement is None else columns(displacement, item)
