# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at surface points, in closed form where one is known and else by distributed rays.

Unoccluded light has a closed form of its own. A light that a single object hides contributes
nothing. A light that is hidden in part is integrated over the arcs that bound its visible part.
Distributed rays remain for the cases of `partial_occlusion`, such as occluders that intersect the
light.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..detection.occlusion import LightVisibility, classify_light_visibility
from ..geometry.patch import Patch
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot, rms
from ..parallel.call_progress import iterate_with_progress, progress_range
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from ..tracing.occluder_culling import Occluders
from .partial_occlusion import apply_occluders
from .ratio_estimator import unoccluded_factor
from .sampled_occlusion import SAMPLING_ERROR_SHARE
from .unoccluded_variation import unoccluded_deviations
from .variation import KINK_KIND, SMOOTH_KIND, shadow_variation, zero_variation

__all__ = [
    "DirectLight",
    "add_emission",
    "diffuse_brdf",
    "emission",
    "interpolates_occlusion",
    "irradiance",
    "shade",
    "shade_with_candidates",
    "smooth_radiance",
]


SHADOW_STEP, VARIATION_END = 0.1, 0.4
"""Positions of a progress bar, as fractions of the work on one light.

At `SHADOW_STEP` its candidate occluders are known, at twice that which of them hide it, and at
`VARIATION_END`
its variation; the rest is the work on the parts of it that are hidden.
"""
MANY_OBJECTS = 64
"""Number of objects from which blocks of pixels are interpolated where they hide a part of a sky:
below it a point costs no more than what else is done for a pixel."""
MAX_DEVIATION = 1e100
"""Largest deviation, as a radiance; larger ones count as this, so that they stay finite."""


@dataclass(frozen=True)
class DirectLight:
    """Direct light that n surface points send to the camera.

    Attributes
    ----------
    color : (3, n) radiance.
    deviation : (4, 3, n) estimated deviations from the mean over each patch by kind (see
    `variation`) and axis x, y and t, root mean square over the channels.
    error : (n,) estimated error of the radiance itself, where the light that occluders hide in part
    has no closed form; RMS over the channels, summed over the lights.
    candidates : for each light, the candidate occluders for the whole patches.
    """

    color: Array
    deviation: Array
    error: Array
    candidates: tuple[Pairs, ...] = ()


def shade(
    plan: Plan,
    occluders: Occluders,
    surface: Surface,
    time: Array | float,
    patch: Patch,
    known: Sequence[tuple[LightVisibility, Pairs]] | None = None,
    allowed: float | None = None,
) -> DirectLight:
    """Direct light at n points, and estimates of its deviation from the mean over their patches.

    Parameters
    ----------
    surface : n points.  time : shutter times, a number or (n,).  patch : of each point.
    known : for each light its shadow at the points, and the candidate occluders for the whole
    patches, if known already.
    allowed : radiance error that distributed rays may have at a point before more are used; None
    for `SAMPLING_ERROR_SHARE` of the tolerance, relative to the point's own light.
    """
    brdf = diffuse_brdf(plan, surface.item)
    spread, error = zero_variation(surface.item.size), np.zeros(surface.item.size)
    factors, candidates = [], []
    for index, light in enumerate(iterate_with_progress(plan.lights)):
        plan.raise_if_cancelled()
        if known is None:
            with progress_range(0.0, SHADOW_STEP):
                shape = plan.as_shadow_caster(light)
                pairs = occluders.find_candidates(shape, surface, patch.radius)
            with progress_range(SHADOW_STEP, 2.0 * SHADOW_STEP):
                shadow = classify_light_visibility(plan, surface, shape, pairs, time)
        else:
            shadow, pairs = known[index]
        candidates.append(pairs)
        to = light.to_center(surface.point, time)
        whole = unoccluded_factor(light, plan.as_shadow_caster(light), to, surface)
        with progress_range(2.0 * SHADOW_STEP, VARIATION_END):
            weight = rms(brdf * light.power[:, None])
            level = _level(light, whole, brdf, weight)
            varies = _variation(plan, surface, light, to, time, patch, shadow, pairs, level)
        with progress_range(VARIATION_END, 1.0):
            most = _allowed_error(plan, level, weight, allowed)
            seen, off = _shadowed_factors(plan, surface, light, time, shadow, whole, most)
        factors.append(seen)
        with np.errstate(over="ignore", invalid="ignore"):
            varies *= weight
            spread += varies
            error += weight * off
    _limit_deviations(spread)
    color = _radiance(plan, surface, factors, brdf)
    return DirectLight(color, spread, np.minimum(error, MAX_DEVIATION), tuple(candidates))


def _limit_deviations(deviation: Array) -> None:
    """Replace deviations that overflow by large ones, and undefined ones by 0, in place."""
    with np.errstate(over="ignore", invalid="ignore"):
        if not np.isfinite(deviation.sum()):
            np.nan_to_num(deviation, copy=False, nan=0.0)
    np.minimum(deviation, MAX_DEVIATION, out=deviation)


def shade_with_candidates(
    plan: Plan,
    surface: Surface,
    time: Array | float,
    candidates: Sequence[Pairs],
    allowed: float | None = None,
) -> tuple[Array, Array]:
    """Direct light (3, n) at n points whose candidate occluders are known, for each light.

    Returns with it the error (n,) of the light itself: see `DirectLight`.

    time : shutter times, a number or (n,).  allowed : as that of `shade`.
    """
    factors, error = [], np.zeros(surface.item.size)
    brdf = diffuse_brdf(plan, surface.item)
    for light, pairs in iterate_with_progress(tuple(zip(plan.lights, candidates, strict=True))):
        with progress_range(0.0, VARIATION_END):
            shadow = classify_light_visibility(
                plan, surface, plan.as_shadow_caster(light), pairs, time
            )
        whole = _unoccluded_factors(plan, surface, light, time)
        with progress_range(VARIATION_END, 1.0):
            weight = rms(brdf * light.power[:, None])
            most = _allowed_error(plan, _level(light, whole, brdf, weight), weight, allowed)
            seen, off = _shadowed_factors(plan, surface, light, time, shadow, whole, most)
        factors.append(seen)
        with np.errstate(over="ignore"):
            error += weight * off
    return _radiance(plan, surface, factors, brdf), np.minimum(error, MAX_DEVIATION)


def interpolates_occlusion(plan: Plan, light: Emitter) -> bool:
    """Whether blocks of pixels are interpolated though occluders hide a part of a light.

    It is so for uniform skies that many objects hide: irradiance is smooth there but near contact,
    and the light at a point costs so much that blocks which prove not to be smooth cost little.
    """
    many = plan.object_count >= MANY_OBJECTS and not plan.motion and plan.penumbra
    return many and light.uniform_hemisphere and light.casts_shadow


def smooth_radiance(
    plan: Plan, occluders: Occluders, surface: Surface, time: Array | float, hidden: Sequence[Mask]
) -> tuple[Array, Mask]:
    """Radiance (3, n) of n points of smooth blocks, and whether it is in closed form: (n,).

    Only of lights for which `interpolates_occlusion` is true a part may be hidden.

    Parameters
    ----------
    time : shutter times, a number or (n,).
    hidden : for each light, whether it is wholly hidden from the points, (n,).
    """
    factors, exact = [], np.ones(surface.item.size, dtype=np.bool_)
    for light, away in zip(plan.lights, hidden, strict=True):
        whole = np.where(away, 0.0, _unoccluded_factors(plan, surface, light, time))
        if interpolates_occlusion(plan, light):
            pairs = occluders.find_candidates(light, surface)
            shadow = classify_light_visibility(plan, surface, light, pairs, time)
            most = np.full_like(whole, np.inf)
            whole, off = _shadowed_factors(plan, surface, light, time, shadow, whole, most)
            exact &= off == 0.0
        factors.append(whole)
    return _radiance(plan, surface, factors, diffuse_brdf(plan, surface.item)), exact


def _radiance(plan: Plan, surface: Surface, factors: Iterable[Array], brdf: Array) -> Array:
    """Radiance (3, n) that n points reflect and emit. factors : of each light."""
    color = irradiance(plan.lights, factors, surface.item.size) * brdf
    add_emission(plan, surface, color)
    return color


def irradiance(lights: Sequence[Emitter], factors: Iterable[Array], count: int) -> Array:
    """Irradiance (3, n) in W / m^2 of n points: the sum over lights of power times factor.

    Parameters
    ----------
    factors : for each light the irradiance factors (n,), or (3, n) where they differ by channel.
    count : number of points n.
    """
    total = np.zeros((3, count))
    for light, factor in zip(lights, factors, strict=True):
        total += light.power[:, None] * factor
    return total


def diffuse_brdf(plan: Plan, item: Ints) -> Array:
    """Radiance (3, n) of diffuse objects for an irradiance of 1: the albedo over pi."""
    brdf: Array = columns(plan.albedo, item) / np.pi
    return brdf


def emission(plan: Plan, surface: Surface) -> Array | None:
    """Radiance (3, n) that n surface points emit towards the camera; None if no object shines."""
    if plan.emission is None:
        return None
    glow: Array = columns(plan.emission, surface.item)
    if plan.emission_profile is None:
        return glow
    point = surface.point
    cosine = plan.emission_profile.cosine_along(point) / np.maximum(
        np.sqrt(dot(point, point)), TINY
    )
    return glow * plan.emission_profile.value(cosine)


def add_emission(plan: Plan, surface: Surface, color: Array) -> None:
    """Add to colours (3, n), in place, what their surface points emit towards the camera."""
    glow = emission(plan, surface)
    if glow is not None:
        color += glow


def _level(light: Emitter, factor: Array, brdf: Array, weight: Array) -> Array:
    """Factors (n,) that stand for all channels: times `weight` they give the radiance, RMS.

    factor : (n,), or (3, n) where they differ by channel.  weight : (n,) RMS of brdf times power.
    """
    if factor.ndim == 1:
        return factor
    level: Array = rms(brdf * light.power[:, None] * factor) / np.maximum(weight, TINY)
    return level


def _unoccluded_factors(plan: Plan, surface: Surface, light: Emitter, time: Array | float) -> Array:
    """Irradiance factors (n,) or (3, n) of a light without shadows."""
    to = light.to_center(surface.point, time)
    return unoccluded_factor(light, plan.as_shadow_caster(light), to, surface)


def _shadowed_factors(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    time: Array | float,
    shadow: LightVisibility,
    whole: Array,
    allowed: Array,
) -> tuple[Array, Array]:
    """Irradiance factors (n,) or (3, n) of a light with shadows, and their errors (n,).

    whole : factors without shadows.  allowed : (n,) see `apply_occluders`.
    """
    error = np.full(surface.item.size, light.factor_error)
    if not light.casts_shadow:
        return whole, error
    factor = np.where(shadow.hidden, 0.0, whole)
    if plan.as_shadow_caster(light).extended:
        lit = factor if factor.ndim == 1 else factor.max(axis=0)
        live = shadow.pairs.take(lit[shadow.pairs.pixel] > 0.0)
        apply_occluders(plan, surface, light, live, time, factor, error, allowed)
    return factor, error


def _allowed_error(plan: Plan, whole: Array, weight: Array, allowed: float | None) -> Array:
    """Errors (n,) that a light's irradiance factors may have by distributed rays.

    whole : (n,) factors without shadows.  weight : (n,) radiance for a factor of 1.
    """
    if allowed is None:
        return SAMPLING_ERROR_SHARE * plan.settings.tolerance * whole
    with np.errstate(over="ignore"):
        share: Array = allowed / (len(plan.lights) * np.maximum(weight, TINY))
    return share


def _variation(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    to: Array,
    time: Array | float,
    patch: Patch,
    shadow: LightVisibility,
    pairs: Pairs,
    whole: Array,
) -> Array:
    """Deviations (4, 3, n) of a light's irradiance factors from their means over patches.

    to : (3, n) metres, vectors to the light's centre.  pairs : candidate occluders for the patches.
    whole : irradiance factors (n,) without shadows.
    """
    # estimates may overflow: see `shade`
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        varies = unoccluded_deviations(light, to, surface, patch, whole)
        nothing = light.receives_nothing(surface.item)
        if nothing is not None:
            varies[..., nothing] = 0.0
        if not light.casts_shadow:
            return varies
        shape = plan.as_shadow_caster(light)
        when = time[pairs.pixel] if isinstance(time, np.ndarray) else time
        shadows, hidden = shadow_variation(plan, surface, patch, shape, pairs, when)
    varies[..., hidden] = 0.0
    # no shadow edge at the point, only beside it: differences between points do not show a smooth
    # edge there, so it counts as a kink
    aside, smooth, kink = ~shadow.partial, shadows[SMOOTH_KIND], shadows[KINK_KIND]
    np.add(kink, smooth, out=kink, where=aside)
    np.copyto(smooth, 0.0, where=aside)
    shadows *= whole
    varies += shadows
    return varies
