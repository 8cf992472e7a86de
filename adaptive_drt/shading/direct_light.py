# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact direct light at surface points: closed forms, and rays only where none is known.

Unblocked light has its own closed form, a light that one object hides brings nothing, and one
that is hidden in part is summed over the arcs that bound what is seen of it. Left to rays are
occluders that reach through the light itself.
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
"""Of what shading by one light takes, for a progress bar: its candidate occluders, as long again to
see which hide it, and all but the parts of it that they hide."""
LARGEST = 1e100
"""Radiance: the largest deviation that is told from others."""


@dataclass(frozen=True)
class Shaded:
    """Direct light that n surface points send to the camera.

    Attributes
    ----------
    color : (3, n) radiance.
    deviation : (4, 3, n) estimated deviations from the mean over each patch by kind (see
        `variation`) and axis x, y and t, root mean square over the channels.
    candidates : for each light, the occluders that serve the whole patches.
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
    """Exact direct light at n points, and how far it may be from the mean over their patches.

    Parameters
    ----------
    surface : n points.  time : shutter times, a number or (n,).  patch : of each point.
    known : for each light how the points see it, and the occluders that serve the whole patches.
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
    # a size that leaves float64's range says no more than that it is large
    spread = np.minimum(np.nan_to_num(spread, copy=False, nan=0.0), LARGEST)
    return Shaded(total * albedo, spread, tuple(candidates))


def shade_among(
    plan: Plan, surface: Surface, time: Array | float, candidates: Sequence[Pairs]
) -> Array:
    """Exact direct light (3, n) at n points whose occluders are known, for each light.

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
    """Radiance (3, n) of n points that nothing shadows, but for lights that are hidden: (n,) each.

    time : shutter times, a number or (n,).
    """
    total = np.zeros((3, surface.item.size))
    for light, away in zip(plan.lights, hidden, strict=True):
        factor = _unblocked(plan, surface, light, time)
        total += light.power[:, None] * np.where(away, 0.0, factor)
    radiance: Array = total * _albedo(plan, surface)
    return radiance


def _albedo(plan: Plan, surface: Surface) -> Array:
    """Radiance (3, n) of an irradiance of 1."""
    albedo: Array = columns(plan.color, surface.item) / np.pi
    return albedo


def _unblocked(plan: Plan, surface: Surface, light: Emitter, time: Array | float) -> Array:
    return unblocked(light, plan.shadow_light(light), light.moved(time), surface)


def _visible(
    plan: Plan, surface: Surface, light: Emitter, time: Array | float, shadow: Shadow, whole: Array
) -> Array:
    """Irradiance factors (n,) of a light, shadows included; `whole` without them."""
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
    """How far a light's factors may be from their means over patches.

    pairs : of the patches.  whole : the factors (n,) without shadows.
    """
    # sizes: see `shade`
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
    # a shadow that is only beside the point: no difference between points shows it
    aside = (~shadow.partial).nonzero()[0]
    shadows[KINKS][:, aside] += columns(shadows[BENDS], aside)
    shadows[BENDS][:, aside] = 0.0
    varies += whole * shadows
    return varies
