# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates of how far one sample of light may be from its mean over a patch, by axis.

The estimates are typical deviations and not bounds. They are the error of a midpoint sample where
the integrand is curved (second derivatives, times 1/6 of the squared half extent) and where it has
a step (the standard deviation of a step at a random position). They follow from the position of the
occluders' outlines relative to the light, so that the edge of a shadow is found before any sample
has hit it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from ..geometry.patch import Patch
from ..geometry.shaded_patches import ShadedPatches
from ..geometry.shadow_edges import MAX_SHARPNESS, ShadowEdges
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..parallel.call_progress import report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, cache_sized_chunks
from .environment_shadows import shadow_emphasis

__all__ = [
    "KINK_KIND",
    "ROOT_KIND",
    "SMOOTH_COEFFICIENT",
    "SMOOTH_KIND",
    "STEP_COEFFICIENT",
    "STEP_EXTENT",
    "STEP_KIND",
    "pair_receivers",
    "shadow_variation",
    "steps_after_shutter",
    "zero_variation",
]


SMOOTH_COEFFICIENT = 1.0 / np.sqrt(3.0)
"""Deviation caused by a smooth shadow edge within a patch, as a fraction of the shadow's depth
times the squared ratio of half extent and width. Derived: a midpoint over a smooth step is off by
h^2/24 V'', with h twice the half extent, and V'' = 6 - 12 u over a width of 1 has a mean square of
12."""
KINK_COEFFICIENT = 1.0 / np.sqrt(80.0)
"""Deviation caused by the beginning or end of a linear shadow edge within a patch, as a fraction of
the shadow's depth times (half extent / width). Derived: the kink of a ramp at a random position in
a cell of size h causes a midpoint error of h / sqrt(320) times the slope, RMS, and h is twice the
half extent."""


def _root_error() -> float:
    """RMS error of the midpoint of a cell of size 2 for max(0, x - p)^(3/2), with p at a random
    position in the cell.
    """
    # in a cell of size 1: begins at p > 0 leave 2/5 (1/2 - p)^(5/2), others, with y = -p,
    # 2/5 (1/2 + y)^(5/2) - y^(3/2); the integral of the product of these two is taken in y^(1/2)
    count = 1_000
    root = np.sqrt(0.5) * (np.arange(count) + 0.5) / count
    mixed = np.sqrt(0.5) * ((0.5 + root**2) ** 2.5 * 2.0 * root**4).mean()
    return float(np.sqrt(8.0 * (1.0 / 2400.0 + 63.0 / 2400.0 + 1.0 / 64.0 - 0.8 * mixed)))


ROOT_COEFFICIENT = _root_error()
"""Deviation caused by a shadow edge that begins as c u^(3/2) within a patch, as a fraction of the
shadow's depth times c (half extent / width)^(3/2). Derived: see `_root_error`; it is 0.1475."""
DISTANT_ROOT_COEFFICIENT = 0.125
"""Deviation caused by a shadow edge that begins as c u^(3/2) outside a patch, at a distance of u
widths, as a fraction of the shadow's depth times c (half extent / width)^2 / sqrt(u). Derived: a
midpoint is off by h^2/24 V'', with h twice the half extent, and V'' = 3/4 c u^(-1/2)."""
STEP_COEFFICIENT = 1.0 / np.sqrt(12.0)
"""Deviation caused by a step within a patch, as a fraction of its height. Derived: the standard
deviation of a midpoint sample for a step at a random position. An edge that crosses many cells at
the same angle would give errors of the same sign; `cubature.nodes` rotates the nodes against
that."""
STEP_EXTENT = 0.5
"""Half extent of a patch, as a fraction of the shadow edge's width, from which the edge counts as a
step within the cell. Derived: from there on the cell is wider than the edge."""


KIND_COUNT = 4
"""Number of kinds of deviations."""
SMOOTH_KIND, ROOT_KIND, KINK_KIND, STEP_KIND = range(KIND_COUNT)
"""Kinds of deviations, by the behavior of the integrand within the patch.

It is smooth (such errors add linearly, and fall with the square of the extent), begins with a power
of 3/2 at a random position, has a kink there, or a step (the last three have random signs).
"""


def zero_variation(count: int) -> Array:
    """Zero deviations (4, 3, n) of n points, by kind and by axis x, y, t."""
    return np.zeros((KIND_COUNT, 3, count))


def steps_after_shutter(steps: Array) -> Array:
    """Deviations that are left of steps (3, n) across the picture after averaging over the shutter.

    A step that moves farther in the shutter time than a pixel is wide is spread over that distance:
    a deviation a along x and y together with one of b along time falls to a^2 / b at most. Returns
    (n,).
    """
    x, y, along = steps
    across = x + y
    spread = np.maximum(across, along)
    left: Array = across * across / np.where(spread > 0.0, spread, 1.0)
    return left


def shadow_variation(
    plan: Plan,
    surface: Surface,
    patch: Patch,
    light: Emitter,
    pairs: Pairs,
    time: Array | float,
) -> tuple[Array, Mask]:
    """Deviations of the visible fraction of a light, relative to the unoccluded irradiance factor.

    Parameters
    ----------
    light : as it casts shadows.  pairs : (m) candidate occluders, sorted by point, for the whole
    patches.  time : (m,) or a number, shutter times of the points of the pairs.

    Returns
    -------
    deviations : (4, 3, n); hidden : (n,) whether a single occluder hides the light from the whole
    patch.
    """
    count = surface.item.size
    total = zero_variation(count)
    hidden = np.zeros(count, dtype=np.bool_)
    for shapes, rows, index in plan.shapes.groups(pairs.item):
        found = []
        for some in cache_sized_chunks(np.arange(rows.size)):
            plan.raise_if_cancelled()
            chosen = rows[some]
            report_progress(chosen[0] / pairs.item.size)
            receivers = pair_receivers(surface, patch, pairs.take(chosen), _at(time, chosen))
            edges = shapes.shadow_edges(index[some], receivers, light)
            pixel = pairs.pixel[chosen]
            hidden[pixel[edges.hides_all]] = True
            live = (edges.depth > 0.0).nonzero()[0]
            edges = edges.take(live)
            if light.environment is not None and live.size:
                emphasis = shadow_emphasis(plan, surface, light, pairs.take(chosen[live]))
                edges = replace(edges, depth=np.minimum(edges.depth * emphasis, 1.0))
            found.append((pixel[live], edges))
        pixels, shadows = zip(*found, strict=True)
        _accumulate(total, np.concatenate(pixels), _concatenate(shadows))
    total[..., hidden] = 0.0
    return total, hidden


def _at(time: Array | float, rows: Ints) -> Array | float:
    """Times of some pairs, of times (m,) or one number."""
    return time[rows] if isinstance(time, np.ndarray) else time


def pair_receivers(
    surface: Surface, patch: Patch, pairs: Pairs, time: Array | float
) -> ShadedPatches:
    """Return the patches of pairs (m) of points and candidate occluders, as the latter see them.

    patch : of the points of `surface`.  time : shutter times, a number or (m,).
    """
    own = pairs.item == surface.item[pairs.pixel]
    place, normal = surface.point, surface.normal
    return ShadedPatches(place, normal, surface.inside, patch, pairs.pixel, own, time)


def _concatenate(parts: Sequence[ShadowEdges]) -> ShadowEdges:
    """Concatenate shadows of several batches."""
    if len(parts) == 1:
        return parts[0]
    each = (
        np.concatenate([getattr(part, one.name) for part in parts], axis=-1)
        for one in fields(ShadowEdges)
    )
    return ShadowEdges(*each)


def _accumulate(total: Array, pixel: Ints, shadow: ShadowEdges) -> None:
    """Add the deviations caused by shadows, whose depths are above 0, to those of their points."""
    shifts = shadow.shifts
    width = np.maximum(shadow.width, shifts.max(axis=0) / MAX_SHARPNESS)
    square = (shifts / np.maximum(width, TINY)) ** 2
    across = square.sum(axis=0)
    step = across >= STEP_EXTENT * STEP_EXTENT
    extent = np.sqrt(across)
    coefficient = shadow.coefficient
    away = shadow.bound_distance / np.maximum(width, TINY)
    round_ = np.isfinite(coefficient)
    kinked = shadow.has_kink & ~step
    # a power of 3/2 where that gives less than a ramp
    root = ROOT_COEFFICIENT * coefficient * np.sqrt(extent)
    kink = kinked & ~(root < KINK_COEFFICIENT)
    root = np.where(kink, KINK_COEFFICIENT, root) * extent
    curve = np.where(
        round_,
        DISTANT_ROOT_COEFFICIENT * coefficient / np.sqrt(np.maximum(away, TINY)),
        SMOOTH_COEFFICIENT,
    )
    bend = np.where(step, SMOOTH_COEFFICIENT, curve) * across
    bend = np.where(
        kinked, np.where(round_, root, np.maximum(root, SMOOTH_COEFFICIENT * across)), bend
    )
    share = shadow.depth * np.minimum(bend, STEP_COEFFICIENT) * square / np.maximum(across, TINY)
    count = total.shape[2]
    kinds = (
        (SMOOTH_KIND, ~(kinked | step)),
        (ROOT_KIND, kinked & ~kink),
        (KINK_KIND, kink),
        (STEP_KIND, step),
    )
    for kind, mask in kinds:
        chosen = mask.nonzero()[0]
        if chosen.size:
            for axis in range(3):
                total[kind, axis] += np.bincount(
                    pixel[chosen], weights=share[axis, chosen], minlength=count
                )
