# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at surface points, in closed form where one is known and else by distributed rays.

Unoccluded light has a closed form of its own. A light that a single object hides contributes
nothing. A light that is hidden in part is integrated over the arcs that bound its visible part.
Distributed rays remain for the cases of `partial_occlusion`, such as occluders that intersect the
light.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..detection.occlusion import Shadow, detect_shadows
from ..lights.emitter import POINT, QUAD, Emitter
from ..numerics.arrays import Array, Mask
from ..numerics.gather import columns
from ..numerics.vector import rms
from ..parallel.call_progress import each_of, part_of_call
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from ..tracing.occluder_culling import Occluders
from .footprint import Patch
from .partial_occlusion import hide
from .ratio_estimator import unblocked
from .unoccluded_variation import open_variation
from .variation import BENDS, KINKS, no_variation, shadow_variation

__all__ = ["Shaded", "shade", "shade_among", "unshadowed"]


SEEN, VARIED = 0.1, 0.4
"""Positions of a progress bar, as fractions of the work on one light.

At `SHADOW_STEP` its candidate occluders are known, at twice that which of them hide it, and at
`VARIATION_END`
its variation; the rest is the work on the parts of it that are hidden.
"""
LARGEST = 1e100
"""Largest deviation, as a radiance; larger ones count as this, so that they stay finite."""


@dataclass(frozen=True)
class Shaded:
    """Direct light that n surface points send to the camera.

    Attributes
    ----------
    color : (3, n) radiance.
    deviation : (4, 3, n) estimated deviations from the mean over each patch by kind (see
    `variation`) and axis x, y and t, root mean square over the channels.
    candidates : for each light, the candidate occluders for the whole patches.
    """

    color: Array
    deviation: Array
    candidates: tuple[Pairs, ...] = ()


def shade(
    plan: Plan,
    occluders: Occluders,
    surface: Surface,
    time: Array | float,
    patch: Patch,
    known: Sequence[tuple[Shadow, Pairs]] | None = None,
) -> Shaded:
    """Direct light at n points, and estimates of its deviation from the mean over their patches.

    Parameters
    ----------
    surface : n points.  time : shutter times, a number or (n,).  patch : of each point.
    known : for each light its shadow at the points, and the candidate occluders for the whole
    patches, if known already.
    """
    total, albedo = np.zeros((3, surface.item.size)), _albedo(plan, surface)
    spread = no_variation(surface.item.size)
    candidates = []
    for index, light in enumerate(each_of(plan.lights)):
        plan.go_on()
        if known is None:
            with part_of_call(0.0, SEEN):
                shape = plan.shadow_light(light)
                pairs = occluders.find(shape, surface, patch.reach)
            with part_of_call(SEEN, 2.0 * SEEN):
                shadow = detect_shadows(plan, surface, shape, pairs, time)
        else:
            shadow, pairs = known[index]
        candidates.append(pairs)
        whole = _unblocked(plan, surface, light, time)
        with part_of_call(2.0 * SEEN, VARIED):
            varies = _variation(plan, surface, light, time, patch, shadow, pairs, whole)
        with part_of_call(VARIED, 1.0):
            seen = _visible(plan, surface, light, time, shadow, whole)
        total += light.power[:, None] * seen
        weight = albedo * light.power[:, None]
        with np.errstate(over="ignore", invalid="ignore"):
            spread += rms(weight) * varies
    # an estimate that overflows counts as a large one
    spread = np.minimum(np.nan_to_num(spread, copy=False, nan=0.0), LARGEST)
    return Shaded(total * albedo, spread, tuple(candidates))


def shade_among(
    plan: Plan, surface: Surface, time: Array | float, candidates: Sequence[Pairs]
) -> Array:
    """Direct light (3, n) at n points whose candidate occluders are known, for each light.

    time : shutter times, a number or (n,).
    """
    total = np.zeros((3, surface.item.size))
    for light, pairs in each_of(tuple(zip(plan.lights, candidates, strict=True))):
        with part_of_call(0.0, VARIED):
            shadow = detect_shadows(plan, surface, plan.shadow_light(light), pairs, time)
        whole = _unblocked(plan, surface, light, time)
        with part_of_call(VARIED, 1.0):
            seen = _visible(plan, surface, light, time, shadow, whole)
        total += light.power[:, None] * seen
    radiance: Array = total * _albedo(plan, surface)
    return radiance


def unshadowed(plan: Plan, surface: Surface, time: Array | float, hidden: Sequence[Mask]) -> Array:
    """Radiance (3, n) of n points without shadows, other than of lights that are wholly hidden.

    Parameters
    ----------
    time : shutter times, a number or (n,).
    hidden : for each light, whether it is wholly hidden from the points, (n,).
    """
    total = np.zeros((3, surface.item.size))
    for light, away in zip(plan.lights, hidden, strict=True):
        factor = _unblocked(plan, surface, light, time)
        total += light.power[:, None] * np.where(away, 0.0, factor)
    radiance: Array = total * _albedo(plan, surface)
    return radiance


def _albedo(plan: Plan, surface: Surface) -> Array:
    """Radiance (3, n) of a diffuse surface for an irradiance of 1: its albedo over pi."""
    albedo: Array = columns(plan.color, surface.item) / np.pi
    return albedo


def _unblocked(plan: Plan, surface: Surface, light: Emitter, time: Array | float) -> Array:
    """Irradiance factors (n,) of a light without shadows."""
    return unblocked(light, plan.shadow_light(light), light.moved(time), surface)


def _visible(
    plan: Plan, surface: Surface, light: Emitter, time: Array | float, shadow: Shadow, whole: Array
) -> Array:
    """Irradiance factors (n,) of a light with shadows; `whole` holds those without."""
    if not light.casts_shadow:
        return whole
    factor = np.where(shadow.blocked, 0.0, whole)
    if plan.shadow_light(light).kind != POINT:
        live = shadow.pairs.take(factor[shadow.pairs.pixel] > 0.0)
        hide(plan, surface, light, live, time, factor)
    return factor


def _variation(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    time: Array | float,
    patch: Patch,
    shadow: Shadow,
    pairs: Pairs,
    whole: Array,
) -> Array:
    """Deviations (4, 3, n) of a light's irradiance factors from their means over patches.

    pairs : candidate occluders for the patches.  whole : irradiance factors (n,) without shadows.
    """
    # estimates may overflow: see `shade`
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        varies = open_variation(light, light.moved(time), surface, patch, whole)
        if light.kind == QUAD and light.touching is not None:
            varies[..., light.touches(surface.item)] = 0.0
        if not light.casts_shadow:
            return varies
        shape = plan.shadow_light(light)
        when = time[pairs.pixel] if isinstance(time, np.ndarray) else time
        shadows, hidden = shadow_variation(plan, surface, patch, shape, pairs, when)
    varies[..., hidden] = 0.0
    # no shadow edge at the point, only beside it: differences between points do not show a smooth
    # edge there, so it counts as a kink
    aside = (~shadow.partial).nonzero()[0]
    shadows[KINKS][:, aside] += columns(shadows[BENDS], aside)
    shadows[BENDS][:, aside] = 0.0
    varies += whole * shadows
    return varies
