# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact direct light at surface points: closed forms, and rays only where none is known.

Unblocked light has its own closed form, a light that one object hides brings nothing, and one
that is hidden in part is summed over the arcs that bound what is seen of it. Left to rays are
occluders that reach through the light itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .columns import columns
from .emitter import POINT, Emitter
from .gather import unblocked
from .hidden import hide
from .occluder import Occluders
from .open_variation import open_variation
from .patch import Patch
from .plan import Plan
from .primary import Pairs, Surface, places
from .shadow import Shadow, detect_shadows
from .variation import BENDS, KINKS, no_variation, shadow_variation
from .vector import dot

__all__ = ["Shaded", "shade", "unshadowed"]

Array: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]


LARGEST = 1e100
"""Radiance: the largest deviation that is told from others."""


@dataclass(frozen=True)
class Shaded:
    """Direct light that n surface points send to the camera.

    Attributes
    ----------
    color : (3, n) radiance.
    deviation : (3, 3, n) estimated deviations from the mean over each point's patch by kind (see
        `variation`) and axis x, y and t, root mean square over the channels.
    """

    color: Array
    deviation: Array


def shade(
    plan: Plan,
    occluders: Occluders,
    surface: Surface,
    time: Array | float,
    patch: Patch,
    known: Sequence[tuple[Shadow, Pairs]] | None = None,
    sizes: Ints | None = None,
) -> Shaded:
    """Exact direct light at n points, and how far it may be from the mean over their patches.

    Parameters
    ----------
    surface : n points.  time : shutter times, a number or (n,).
    known : for each light how the points see it, and the occluders that serve the whole patches.
    sizes : (k,) numbers of points, each lot on one object and near each other: their occluders
        are sought together.
    """
    total = np.zeros((3, surface.item.size))
    albedo = columns(plan.color, surface.item) / np.pi
    spread = no_variation(surface.item.size)
    for index, light in enumerate(plan.lights):
        if known is None:
            seen = _see(plan, occluders, surface, light, time, patch, sizes)
        else:
            seen = known[index]
        factor, varies = _light(plan, surface, light, time, patch, *seen)
        total += light.power[:, None] * factor
        weight = albedo * light.power[:, None]
        with np.errstate(over="ignore", invalid="ignore"):
            spread += np.sqrt(dot(weight, weight) / 3.0) * varies
    # a size that leaves float64's range says no more than that it is large
    spread = np.minimum(np.nan_to_num(spread, copy=False, nan=0.0), LARGEST)
    return Shaded(total * albedo, spread)


def unshadowed(plan: Plan, surface: Surface, time: Array | float, hidden: Sequence[Mask]) -> Array:
    """Radiance (3, n) of n points that nothing shadows, but for lights that are hidden: (n,) each.

    time : shutter times, a number or (n,).
    """
    total = np.zeros((3, surface.item.size))
    for light, away in zip(plan.lights, hidden, strict=True):
        factor = unblocked(light, plan.shadow_light(light), light.moved(time), surface)
        total += light.power[:, None] * np.where(away, 0.0, factor)
    radiance: Array = total * (columns(plan.color, surface.item) / np.pi)
    return radiance


def _see(
    plan: Plan,
    occluders: Occluders,
    surface: Surface,
    light: Emitter,
    time: Array | float,
    patch: Patch,
    sizes: Ints | None,
) -> tuple[Shadow, Pairs]:
    """How points see a light, and the occluders that serve their patches."""
    shape = plan.shadow_light(light)
    if sizes is None:
        pairs = occluders.find(shape, surface, patch.reach)
    else:
        pairs = _find_together(occluders, shape, surface, patch.reach, sizes)
    return detect_shadows(plan, surface, shape, pairs, time), pairs


def _find_together(
    occluders: Occluders, shape: Emitter, surface: Surface, reach: Array, sizes: Ints
) -> Pairs:
    """Candidates of lots of points, found for the first of each and a ball around it."""
    starts = np.cumsum(sizes) - sizes
    lot = np.repeat(np.arange(sizes.size), sizes)
    away = surface.point - columns(surface.point, starts[lot])
    wide = np.sqrt(dot(away, away)) + reach
    found = occluders.find(shape, surface.take(starts), np.maximum.reduceat(wide, starts))
    number = np.bincount(found.pixel, minlength=sizes.size)
    first = np.cumsum(number) - number
    copies = number[lot]
    point = np.repeat(np.arange(lot.size), copies)
    return Pairs(point, found.item[np.repeat(first[lot], copies) + places(copies)])


def _light(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    time: Array | float,
    patch: Patch,
    shadow: Shadow,
    pairs: Pairs,
) -> tuple[Array, Array]:
    """Irradiance factors (n,) of a light, shadows included, and their variation over patches."""
    shape = plan.shadow_light(light)
    center = light.moved(time)
    factor = unblocked(light, shape, center, surface)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # sizes: see `shade`
        varies = open_variation(light, center, surface, patch, factor)
    if not light.casts_shadow:
        return factor, varies
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        when = _at(time, pairs.pixel)
        shadows, hidden = shadow_variation(plan, surface, patch, shape, pairs, when)
    varies[..., hidden] = 0.0
    # a shadow that is only beside the point: no difference between points shows it
    aside = np.flatnonzero(~shadow.partial)
    shadows[KINKS][:, aside] += columns(shadows[BENDS], aside)
    shadows[BENDS][:, aside] = 0.0
    varies += factor * shadows
    factor = np.where(shadow.blocked, 0.0, factor)
    if shape.kind != POINT:
        live = shadow.pairs.take(factor[shadow.pairs.pixel] > 0.0)
        hide(plan, surface, light, live, time, factor)
    return factor, varies


def _at(time: Array | float, rows: Ints) -> Array | float:
    return time[rows] if isinstance(time, np.ndarray) else time
