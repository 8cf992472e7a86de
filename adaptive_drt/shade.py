# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact direct light at surface points: closed forms, and rays only where none is known.

Unblocked light has its own closed form, a light that one object hides brings nothing, and one
that is hidden in part is summed over the arcs that bound what is seen of it. Left to rays are
occluders that reach through the light itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
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
from .vector import dot, rms

__all__ = ["Lots", "Shaded", "shade", "unshadowed"]

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
    deviation : (4, 3, m) estimated deviations from the mean over each patch by kind (see
        `variation`) and axis x, y and t, root mean square over the channels.
    """

    color: Array
    deviation: Array


@dataclass(frozen=True)
class Lots:
    """n points in m lots, each on one object and near each other.

    The first of a lot is where its patch is. Occluders are sought for a lot together.

    Attributes
    ----------
    sizes : (m,) numbers of points.
    """

    sizes: Ints

    @cached_property
    def first(self) -> Ints:
        """The first points: (m,)."""
        first: Ints = np.cumsum(self.sizes) - self.sizes
        return first


def shade(
    plan: Plan,
    occluders: Occluders,
    surface: Surface,
    time: Array | float,
    patch: Patch,
    known: Sequence[tuple[Shadow, Pairs]] | None = None,
    lots: Lots | None = None,
) -> Shaded:
    """Exact direct light at n points, and how far it may be from the mean over m patches.

    Parameters
    ----------
    surface : n points.  time : shutter times, a number or (n,).
    patch : of the first of each lot; without lots of each point.
    known : for each light how the points see it, and the occluders that serve the whole patches.
    """
    total = np.zeros((3, surface.item.size))
    albedo = columns(plan.color, surface.item) / np.pi
    of_patch = albedo if lots is None else columns(albedo, lots.first)
    spread = no_variation(of_patch.shape[1])
    for index, light in enumerate(plan.lights):
        if known is None:
            seen = _see(plan, occluders, surface, light, time, patch, lots)
        else:
            seen = known[index]
        factor, varies = _light(plan, surface, light, time, patch, lots, *seen)
        total += light.power[:, None] * factor
        weight = of_patch * light.power[:, None]
        with np.errstate(over="ignore", invalid="ignore"):
            spread += rms(weight) * varies
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
    lots: Lots | None,
) -> tuple[Shadow, Pairs]:
    """How points see a light, and the occluders that serve the patches."""
    shape = plan.shadow_light(light)
    if lots is None:
        found = pairs = occluders.find(shape, surface, patch.reach)
    else:
        found, pairs = _find_together(occluders, shape, surface, patch.reach, lots)
    return detect_shadows(plan, surface, shape, pairs, time), found


def _find_together(
    occluders: Occluders, shape: Emitter, surface: Surface, reach: Array, lots: Lots
) -> tuple[Pairs, Pairs]:
    """Candidates of lots, found for the first point of each and a ball around it: by lot, and
    by point."""
    lot = np.repeat(np.arange(lots.sizes.size), lots.sizes)
    away = surface.point - columns(surface.point, lots.first[lot])
    wide = np.maximum(np.maximum.reduceat(np.sqrt(dot(away, away)), lots.first), reach)
    found = occluders.find(shape, surface.take(lots.first), wide)
    number = np.bincount(found.pixel, minlength=lots.sizes.size)
    first = np.cumsum(number) - number
    copies = number[lot]
    point = np.repeat(np.arange(lot.size), copies)
    return found, Pairs(point, found.item[np.repeat(first[lot], copies) + places(copies)])


def _light(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    time: Array | float,
    patch: Patch,
    lots: Lots | None,
    shadow: Shadow,
    pairs: Pairs,
) -> tuple[Array, Array]:
    """Irradiance factors (n,) of a light, shadows included, and their variation over patches.

    pairs : of patches.
    """
    shape = plan.shadow_light(light)
    center = light.moved(time)
    factor = unblocked(light, shape, center, surface)
    middle, when, whole, partial = surface, time, factor, shadow.partial
    if lots is not None:
        first = lots.first
        middle, when, whole = surface.take(first), _at(time, first), factor[first]
        partial = partial[first]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # sizes: see `shade`
        varies = open_variation(light, light.moved(when), middle, patch, whole)
    if not light.casts_shadow:
        return factor, varies
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        shadows, hidden = shadow_variation(
            plan, middle, patch, shape, pairs, _at(when, pairs.pixel)
        )
    varies[..., hidden] = 0.0
    # a shadow that is only beside the point: no difference between points shows it
    aside = np.flatnonzero(~partial)
    shadows[KINKS][:, aside] += columns(shadows[BENDS], aside)
    shadows[BENDS][:, aside] = 0.0
    varies += whole * shadows
    factor = np.where(shadow.blocked, 0.0, factor)
    if shape.kind != POINT:
        live = shadow.pairs.take(factor[shadow.pairs.pixel] > 0.0)
        hide(plan, surface, light, live, time, factor)
    return factor, varies


def _at(time: Array | float, rows: Ints) -> Array | float:
    return time[rows] if isinstance(time, np.ndarray) else time
