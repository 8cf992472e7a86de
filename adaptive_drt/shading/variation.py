# SPDX-License-Identifier: GPL-3.0-or-later
"""How far one sample of light may be from its mean over a patch: estimates, axis by axis.

Not bounds but sizes: what a midpoint is off by where the integrand bends (second derivatives,
1/6 of the half width squared each) and where it steps (the deviation of a step at a random
place). They come from where the outlines of occluders stand to the light, so a shadow's edge is
found before any sample has met it.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..parallel.call_progress import tell
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, in_cache
from .footprint import Patch
from .silhouette_rates import SHARPEST, Shadows
from .variation_past_quads import past_quads
from .variation_past_spheres import past_spheres

__all__ = ["BENDS", "KINKS", "ROOTS", "STEPS", "no_variation", "shadow_variation", "standing"]


BEND = 0.5
"""Of a shadow's depth and of its square of (half extent / width): a midpoint over a smooth step is
off by h^2/24 V'', and V'' = 6 - 12 u over a width of 1 has a mean square of 12."""
KINK = 0.14
"""Of (half extent / width), where a shadow begins or is whole within the patch: a ramp's kink at a
random place in a cell of h leaves its midpoint off by 0.07 h times the slope, RMS."""
ROOT = 0.15
"""The same of a shadow that begins as c u^(3/2), of c (half extent / width)^(3/2): at a random
place in a cell of h that leaves the midpoint off by 0.052 h^(3/2), RMS."""
AWAY = 0.125
"""Of c (half extent / width)^2 over the root of the distance u to where it begins: a midpoint is
off by h^2/24 V'', and V'' = 3/4 c u^(-1/2)."""
STEP = 0.29
"""Of a step's height: the deviation of its midpoint sample at a random place, 1 / sqrt(12). An edge
that crosses cells at one angle would leave errors of one sign; `nodes` turns their stars."""
ROUGH = 0.5
"""Of a shadow's width: a half extent from which the shadow is a step within the cell."""


KINDS = 4
BENDS, ROOTS, KINKS, STEPS = range(KINDS)
"""Kinds of deviations: of what bends (they add up, and fall with the square of the extent), of
what begins with the power 3/2 at a random place, has a kink there, or steps (their signs are
random)."""


def no_variation(count: int) -> Array:
    """Nothing varies at n points: deviations (4, 3, n), by kind and by axis x, y, t."""
    return np.zeros((KINDS, 3, count))


def standing(steps: Array) -> Array:
    """Of steps (3, n), what those across the picture leave once the shutter is averaged.

    What moves farther in the shutter than a pixel is wide is spread over that distance: a share a
    of x and y beside one of b in time falls to a^2 / b at most. Returns (n,).
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
    """Of the part of a light that is seen past occluders, relative to the unblocked factor.

    Parameters
    ----------
    light : as it casts shadows.  pairs : (m) candidate occluders, sorted by point, that serve
        the whole patches.  time : (m,) or a number, shutter times of the points.

    Returns
    -------
    deviations : (4, 3, n); hidden : (n,) one occluder hides the light from the whole patch.
    """
    count = surface.item.size
    total = no_variation(count)
    hidden = np.zeros(count, dtype=np.bool_)
    ball = pairs.item < plan.sphere_count
    for rows, part in ((ball.nonzero()[0], past_spheres), ((~ball).nonzero()[0], past_quads)):
        if not rows.size:
            continue
        found = []
        for some in in_cache(rows):
            plan.go_on()
            tell(some[0] / pairs.item.size)
            when = time[some] if isinstance(time, np.ndarray) else time
            found.append(part(plan, surface, patch, light, pairs.take(some), when))
        shadow, pixel = _joined(found), pairs.pixel[rows]
        hidden[pixel[shadow.covers]] = True
        _collect(total, pixel, shadow)
    total[..., hidden] = 0.0
    return total, hidden


def _joined(parts: list[Shadows]) -> Shadows:
    each = (
        np.concatenate([getattr(part, one.name) for part in parts], axis=-1)
        for one in fields(Shadows)
    )
    return Shadows(*each)


def _collect(total: Array, pixel: Ints, shadow: Shadows) -> None:
    """Add the deviations of shadows to their points'."""
    live = (shadow.depth > 0.0).nonzero()[0]
    pixel, depth, shifts = pixel[live], shadow.depth[live], columns(shadow.shifts, live)
    width = np.maximum(shadow.width[live], shifts.max(axis=0) / SHARPEST)
    square = (shifts / np.maximum(width, TINY)) ** 2
    across = square.sum(axis=0)
    step = across >= ROUGH * ROUGH
    extent = np.sqrt(across)
    power, away = shadow.power[live], shadow.away[live] / np.maximum(width, TINY)
    round_ = np.isfinite(power)
    ends = shadow.ends[live] & ~step
    # as 3/2 where that is less than a ramp
    root = ROOT * power * np.sqrt(extent)
    kink = ends & ~(root < KINK)
    root = np.where(kink, KINK, root) * extent
    curve = np.where(round_, AWAY * power / np.sqrt(np.maximum(away, TINY)), BEND)
    bend = np.where(step, BEND, curve) * across
    bend = np.where(ends, np.where(round_, root, np.maximum(root, BEND * across)), bend)
    share = depth * np.minimum(bend, STEP) * square / np.maximum(across, TINY)
    count = total.shape[2]
    kinds = (BENDS, ~(ends | step)), (ROOTS, ends & ~kink), (KINKS, kink), (STEPS, step)
    for kind, mask in kinds:
        chosen = mask.nonzero()[0]
        if chosen.size:
            for axis in range(3):
                total[kind, axis] += np.bincount(
                    pixel[chosen], weights=share[axis, chosen], minlength=count
                )
