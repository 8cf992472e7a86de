# SPDX-License-Identifier: GPL-3.0-or-later
"""Points that stand for parts of cells: their centroids, or stars around them.

A centroid is right for radiance linear in x, y and t; the mean over a star, whose arms are as long
as second moments say, for quadratic radiance. How far either may be off is foreseen from the
centroid alone: from there a patch as wide as the part is looked at, once and not for each arm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .ahead import hits_or_near
from .arms import Arms, make_arms
from .cells import sums
from .columns import columns
from .occluder import Occluders
from .patch import make_patch
from .plan import Plan
from .primary import surface
from .regions import Regions
from .rim import rim_gains
from .shade import Lots, Shaded, shade
from .stray import kept_parts
from .surprise import weigh
from .vector import dot

__all__ = ["Parts", "join", "sample"]

Array: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

STAR = np.array([[0.02, 0.05, 0.09, 0.35], [0.02, 0.09, 0.15, 0.5], [0.02, 0.13, 0.2, 0.5]])
"""Of the deviation of a centroid's sample: that of a star's mean, by number of axes and by kind. Of
a power 3/2, a kink and a step at random places stars leave 0.035, 0.088 and 0.34 in an interval,
0.071, 0.15 and 0.35 in a square, 0.13, 0.22 and 0.38 in a cube; of bends what was measured."""
MARGIN = 1.6
"""Of a part's extent: how far shadows' edges are looked for from its centroid. Patches are laid out
as steps on a plane, and an occluder's angle as if it grew by steps; near contact both do faster
(135 random scenes at 0.1 %: the worst at 1.21 of the tolerance without, 0.97 with)."""
TINY = float(np.finfo(np.float64).tiny)


@dataclass(frozen=True)
class Parts:
    """m parts of cells, each on one object, that are to be shaded.

    Attributes
    ----------
    place : (3, m) centroids in x, y, t.  spread : (6, m) lower triangular roots of their second
        moments: xx, yx, yy, tx, ty, tt.  half : (3, m) half the extents of their boxes.
    item : (m,) objects.  star : (m,) whether stars sample them.
    """

    place: Array
    spread: Array
    half: Array
    item: Ints
    star: Mask


def join(one: Parts, other: Parts) -> Parts:
    """The parts of both, those of one first."""
    fields = [
        np.concatenate([getattr(one, name), getattr(other, name)], axis=-1)
        for name in Parts.__dataclass_fields__
    ]
    return Parts(*fields)


def sample(
    plan: Plan, occluders: Occluders, parts: Parts, found: Regions, hit: Ints
) -> tuple[Shaded, Ints, Array]:
    """Mean light of m parts, by their centroids or by stars, and the points (m,) that took.

    found, hit : all regions of cells, and which of them the first parts are.

    Returns with it the part (m,) of their points that none saw where it should be.
    """
    size, wide = parts.item.size, parts.half > 0.0
    axes, box = wide.sum(axis=0), np.arange(size) >= hit.size
    arms = make_arms(parts.place, parts.spread, wide, parts.star, box)
    region, offset, star = arms.region, arms.offset, arms.count > 1
    at = columns(parts.place, region)
    left, lost = np.ones(region.size), np.zeros(region.size)
    if hit.size:
        cut = slice(int(arms.count[: hit.size].sum()))
        half = columns(parts.half, region[cut])
        kept, stray = kept_parts(
            plan, found, hit[region[cut]], at[:, cut], offset[:, cut], half, arms.lot[cut]
        )
        offset[:, cut] *= kept
        left[cut], lost[cut] = kept, stray
    light, center, slant = _look(plan, occluders, parts, at + offset, arms.count)
    part = 1.0 / arms.count[region]

    def mean(values: Array) -> Array:
        return sums(region, part * values, size)

    color = np.stack([mean(row) for row in light.color])
    color += arms.middle * (center - color)
    round_ = np.flatnonzero(star & (parts.item < plan.sphere_count))
    if round_.size:
        gain = _at_rims(slant, round_, arms, left, axes[round_])
        off = columns(color - center, round_)
        color[:, round_] = np.maximum(columns(center, round_) + gain * off, 0.0)
    best = STAR[axes - 1].T
    gain = np.where(star, best + (1.0 - best) * mean(1.0 - left * left), 1.0)
    deviation = light.deviation * gain[:, None]
    rows = np.flatnonzero(star)
    if rows.size:
        deviation[..., rows] = weigh(
            columns(deviation, rows, -1),
            columns(light.deviation, rows, -1),
            columns(center - color, rows),
            *_shown(light.color - columns(color, region), offset, parts.half, region, star),
        )
    return Shaded(color, deviation), arms.count + star, mean(lost)


def _at_rims(slant: tuple[Array, Array], rows: Ints, arms: Arms, left: Array, axes: Ints) -> Array:
    """`rim_gains` of some stars; slants at samples and centroids, and what is left of arms."""
    number = np.full(arms.count.size, -1)
    number[rows] = np.arange(rows.size)
    own = number[arms.region]
    # an arm that is given up says nothing
    some = np.flatnonzero((own >= 0) & (left > 0.0))
    own, region = own[some], arms.region[some]
    weight = (1.0 - arms.middle[region]) / arms.count[region]
    return rim_gains(slant[0][some], slant[1][rows], weight, left[some], own, axes)


def _shown(
    away: Array, offset: Array, half: Array, region: Ints, star: Mask
) -> tuple[Ints, Array, Array]:
    """Of samples of stars: which star, their radiance less its mean, and where they lie in it."""
    rows = np.flatnonzero(star[region])
    own = region[rows]
    place = columns(offset, rows) / np.maximum(columns(half, own), TINY)
    return np.cumsum(star)[own] - 1, columns(away, rows), place


def _look(
    plan: Plan, occluders: Occluders, parts: Parts, place: Array, count: Ints
) -> tuple[Shaded, Array, tuple[Array, Array]]:
    """Light of m parts at places (3, k), `count` (m,) of each, and what is foreseen of each part.

    Returns with it the radiance (3, m) at the centroids, and the cosines between normals and rays
    at the places and there.
    """
    star = count > 1
    lots = Lots(count + star)
    first = lots.first
    arms = np.ones(int(lots.sizes.sum()), dtype=np.bool_)
    arms[first[star]] = False
    every = np.empty((3, arms.size))
    every[:, first], every[:, arms] = parts.place, place
    item = np.repeat(parts.item, lots.sizes)
    w = plan.lens.directions(every[0], every[1])
    time: Array | float = every[2] if plan.motion else 0.0
    t = hits_or_near(plan, w, item, time)
    hits = surface(plan, w, t, item, time)
    with np.errstate(over="ignore", invalid="ignore"):  # sizes that only estimates hang on
        patch = make_patch(plan, columns(w, first), t[first], hits.take(first), parts.half)
    patch = replace(patch, margin=MARGIN)
    light = shade(plan, occluders, hits, time, patch, lots=lots)
    slant = np.abs(dot(hits.normal, w)) / np.sqrt(dot(w, w))
    own = Shaded(columns(light.color, arms), light.deviation)
    return own, columns(light.color, first), (slant[arms], slant[first])
