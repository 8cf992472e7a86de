# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over lights: is a light visible from a point as a whole, in part, or not at all?

The shapes tell how much of the light each of them hides (`ShapeSet.occlusion`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..parallel.call_progress import report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, cache_sized_chunks, receivers_of
from .separating_planes import out_of_light

__all__ = [
    "LightVisibility",
    "classify_horizon",
    "classify_light_visibility",
    "classify_occluders",
]


@dataclass(frozen=True)
class LightVisibility:
    """Visibility of a light from n points at one shutter time.

    Attributes
    ----------
    dark : (n,) the light contributes nothing: it is below the point's horizon, or faces away.
    hidden : (n,) one object occludes all of the light.
    partial : (n,) the light may be visible in part, so rays have to be distributed over it.
    pairs : pairs of partially lit points and their possible occluders, sorted by point.
    """

    dark: Mask
    hidden: Mask
    partial: Mask
    pairs: Pairs

    def take(self, rows: Ints) -> LightVisibility:
        """The visibility from some of the points, given by ascending indices."""
        pairs = self.pairs.for_pixels(rows, self.dark.size)
        return LightVisibility(self.dark[rows], self.hidden[rows], self.partial[rows], pairs)


def classify_light_visibility(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    time: Array | float = 0.0,
    unknown: Mask | None = None,
    closely: bool = False,
) -> LightVisibility:
    """Classify the visibility of a light from n points.

    Parameters
    ----------
    light : as it casts shadows (`Plan.as_shadow_caster`).  pairs : candidate occluders.
    time : shutter times of the points, a number or (n,).
    unknown : as that of `classify_occluders`.
    closely : whether planes are tried that separate occluders from the light.
    """
    dark, horizon = classify_horizon(light, light.to_center(surface.point, time), surface)
    live = pairs.take(~dark[pairs.pixel])
    when = time[live.pixel] if isinstance(time, np.ndarray) else time
    none, full = classify_occluders(plan, surface, light, live, when, unknown)
    blocked = np.zeros(dark.size, dtype=np.bool_)
    blocked[live.pixel[full]] = True
    kept = live.take(~none & ~blocked[live.pixel])
    if closely and light.extended:
        kept = kept.take(~out_of_light(plan, surface, light, kept, np.zeros(dark.size)))
    partial = np.zeros(dark.size, dtype=np.bool_)
    partial[kept.pixel] = True
    partial |= horizon & ~blocked
    if not light.extended or not light.casts_shadow:
        partial[:] = False
    return LightVisibility(dark, blocked, partial, kept)


def classify_horizon(
    light: Emitter,
    to: Array,
    surface: Surface,
    reach: Array | float = 0.0,
    bend: Array | float = 0.0,
) -> tuple[Mask, Mask]:
    """Where a light contributes nothing, and where the point's horizon cuts it: (n,) each.

    The parameters are those of `Emitter.horizon`.
    """
    dark, cut = light.horizon(to, surface.point, surface.normal, reach, bend)
    nothing = light.receives_nothing(surface.item)
    if nothing is not None:
        dark, cut = dark | nothing, cut & ~nothing
    return dark, cut


def classify_occluders(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    time: Array | float,
    unknown: Mask | None = None,
) -> tuple[Mask, Mask]:
    """Whether each occluder certainly hides nothing of the light, or certainly all of it.

    Parameters
    ----------
    pairs : (m) points and objects.
    time : shutter time of light and occluders, a number or (m,).
    unknown : (objects,) objects that are not classified, as they stand for others; None for none.

    Returns
    -------
    none, full : (m,) bool; both are false where the occluder may hide a part.
    """
    m = pairs.item.size
    none, full = np.zeros(m, dtype=np.bool_), np.zeros(m, dtype=np.bool_)
    if unknown is not None:
        known = (~unknown[pairs.item]).nonzero()[0]
        when = time[known] if isinstance(time, np.ndarray) else time
        part = pairs.take(known)
        none[known], full[known] = classify_occluders(plan, surface, light, part, when)
        return none, full
    done = 0
    for shapes, all_rows, all_index in plan.shapes.groups(pairs.item):
        chunks = zip(cache_sized_chunks(all_rows), cache_sized_chunks(all_index), strict=True)
        for rows, index in chunks:
            plan.raise_if_cancelled()
            report_progress(done / m)
            done += rows.size
            receivers = receivers_of(surface, pairs.take(rows))
            when = time[rows] if isinstance(time, np.ndarray) else time
            none[rows], full[rows] = shapes.occlusion(
                index, light, receivers, when, plan.settings.order
            )
    return none, full
