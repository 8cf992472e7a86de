# SPDX-License-Identifier: GPL-3.0-or-later
"""Points that stand for parts of cells: their centroids, or stars around them.

A centroid is right for radiance linear in x, y and t; the mean over a star, whose arms are as long
as second moments say, for quadratic radiance. How far either may be off is foreseen from the
centroid alone: from there a patch as wide as the part is looked at, once and not for each arm.
That also says of which parts a star is worth its points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns, place
from ..numerics.vector import dot
from ..parallel.call_progress import part_of_call
from ..shading.direct_light import Shaded, shade, shade_among
from ..shading.footprint import make_patch
from ..shading.variation import no_variation
from ..tracing.closest_approach import hits_or_near
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, surface
from ..tracing.occluder_culling import Occluders
from ..visibility.fragments import Regions
from ..visibility.line_intervals import TIME
from .limb_correction import rim_gains
from .node_clipping import kept_parts
from .nodes import Arms, make_arms
from .posteriori import weigh
from .regions import sums

__all__ = ["IN_VAIN", "Parts", "Samples", "join", "left_by_stars", "sample"]


STAR = np.array([[0.005, 0.05, 0.09, 0.35], [0.02, 0.09, 0.15, 0.5], [0.02, 0.13, 0.2, 0.5]])
"""Of the deviation of a centroid's sample: that of a star's mean, by number of axes and by kind. Of
a power 3/2, a kink and a step at random places stars leave 0.032, 0.088 and 0.35 in an interval,
0.071, 0.15 and 0.35 in a square, 0.13, 0.22 and 0.38 in a cube; of bends what was measured. (Means
over the shutter at 0.01 %, as blocks use them: at 0.02 for an interval they were off by 0.1 to 0.4
of what was estimated, with a tenth more points a pixel; at 0.005 by 0.3 to 0.6.)"""
MARGIN = 1.6
"""Of a part's extent: how far shadows' edges are looked for from its centroid. Patches are laid out
as steps on a plane, and an occluder's angle as if it grew by steps; near contact both do faster
(135 random scenes at 0.1 %: the worst at 1.21 of the tolerance without, 0.97 with)."""
NEEDED = 0.1
"""Of a pixel's goal, over the root of its cells' number: what may be foreseen of a part without a
star. Stars see what was not foreseen (400 spheres, 0.01 %: at 0.01, 0.05 and 0.2 the picture is
off by 0.46, 0.50 and 0.64 of the tolerance, with 19.2, 18.6 and 18.1 points a pixel; 210 random
scenes are as far off at 0.1 as at 0.01)."""
LOOKED = 0.5
"""Of what sampling takes, for a progress bar: the centroids."""
NOWHERE = -1.0
"""Metres: how far what was found around a centroid serves, where nothing was looked for."""
IN_VAIN = 1.5
"""Times its pixel's goal: what is foreseen of a cell's stars when it is split in any case."""


@dataclass(frozen=True)
class Parts:
    """m parts of cells, each on one object, that are to be shaded.

    Attributes
    ----------
    place : (3, m) centroids in x, y, t.  spread : (6, m) lower triangular roots of their second
        moments: xx, yx, yy, tx, ty, tt.  half : (3, m) half the extents of their boxes.
    item : (m,) objects.  cell : (m,) the cells' numbers.
    star : (m,) whether stars may sample them.  turn : (m,) how those are turned.
    stake : (m,) of its pixel's goal, what an error of 1 in the radiance of the part is.
    crowd : (m,) cells of its pixel.
    known : (m,) whether the centroid has been shaded; those k that have, to `color` (3, k) and
        `deviation` (4, 3, k).
    """

    place: Array
    spread: Array
    half: Array
    item: Ints
    cell: Ints
    star: Mask
    turn: Ints
    stake: Array
    crowd: Ints
    known: Mask
    color: Array
    deviation: Array


@dataclass(frozen=True)
class Samples:
    """m parts sampled.

    Attributes
    ----------
    light : their mean radiance, and what that may be off by.
    points : (m,) shaded for each, besides the centroids that were known.
    vain : (m,) whether no star was tried, as it would not have settled the part's cell.
    lost : (m,) part of a part's points that none saw where it should be.
    """

    light: Shaded
    points: Ints
    vain: Mask
    lost: Array


@dataclass(frozen=True)
class _Centers:
    """The centroids of m parts: `hits` there, their `light`, how far (m,) its candidates serve
    (`reach`, metres), and the cosines between normals and rays (`slant`)."""

    hits: Surface
    light: Shaded
    reach: Array
    slant: Array


def join(one: Parts, other: Parts) -> Parts:
    """The parts of both, those of one first."""
    fields = [
        np.concatenate([getattr(one, name), getattr(other, name)], axis=-1)
        for name in Parts.__dataclass_fields__
    ]
    return Parts(*fields)


def sample(plan: Plan, occluders: Occluders, parts: Parts, found: Regions, hit: Ints) -> Samples:
    """Sample m parts, by their centroids or, where that is worth it, by stars.

    found, hit : all regions of cells, and which of them the first parts are.
    """
    size, wide = parts.item.size, parts.half > 0.0
    axes, box = wide.sum(axis=0), np.arange(size) >= hit.size
    with part_of_call(0.0, LOOKED):
        centers = _look(plan, occluders, parts)
    needed, vain = _worth(parts, centers.light.deviation, axes, box)
    arms = make_arms(parts.place, parts.spread, wide, needed & ~vain, box, parts.turn)
    left, stray = _kept(plan, parts, found, hit, arms)
    star, part = arms.count > 1, 1.0 / arms.count[arms.region]
    points, lost = arms.count + star - parts.known, sums(arms.region, part * stray, size)
    light = centers.light
    if star.any():
        with part_of_call(LOOKED, 1.0):
            light = _by_stars(plan, occluders, parts, centers, arms, left, axes)
    return Samples(light, points, vain, lost)


def _kept(plan: Plan, parts: Parts, found: Regions, hit: Ints, arms: Arms) -> tuple[Array, Mask]:
    """What is left of each sample's arm, and whether it is lost: (k,) each."""
    left, stray = np.ones(arms.region.size), np.zeros(arms.region.size, dtype=np.bool_)
    if hit.size:
        own = slice(int(arms.count[: hit.size].sum()))
        region = arms.region[own]
        left[own], stray[own] = kept_parts(
            plan, found, hit[region], columns(parts.place, region), arms.offset[:, own],
            columns(parts.half, region), arms.lot[own],
        )  # fmt: skip
    return left, stray


def _by_stars(
    plan: Plan,
    occluders: Occluders,
    parts: Parts,
    centers: _Centers,
    arms: Arms,
    left: Array,
    axes: Ints,
) -> Shaded:
    """Mean light of m parts, some of which have stars.

    left : (k,) of the samples' arms.  axes : (m,) how many the parts extend along.
    """
    size, region, star = axes.size, arms.region, arms.count > 1
    center, foreseen, offset = centers.light.color, centers.light.deviation, left * arms.offset
    part = 1.0 / arms.count[region]
    shown, slant = columns(center, region), centers.slant[region]
    rows = star[region].nonzero()[0]
    spots = columns(parts.place, region[rows]) + columns(offset, rows)
    light, slant[rows] = _look_around(plan, occluders, parts, centers, spots, region[rows])
    place(shown, rows, light)
    color = np.array([sums(region, part * row, size) for row in shown])
    color += arms.middle * (center - color)
    round_ = (star & (parts.item < plan.sphere_count)).nonzero()[0]
    if round_.size:
        gain = _at_rims((slant, centers.slant), round_, arms, left, axes[round_])
        off = columns(color - center, round_)
        color[:, round_] = np.maximum(columns(center, round_) + gain * off, 0.0)
    best, short = STAR[axes - 1].T, sums(region, part * (1.0 - left * left), size)
    deviation = foreseen * np.where(star, best + (1.0 - best) * short, 1.0)[:, None]
    rows = star.nonzero()[0]
    deviation[..., rows] = weigh(
        columns(deviation, rows, -1),
        columns(foreseen, rows, -1),
        columns(center - color, rows),
        *_shown(shown - columns(color, region), offset, parts.half, region, star),
    )
    return Shaded(color, deviation)


def _worth(parts: Parts, foreseen: Array, axes: Ints, box: Mask) -> tuple[Mask, Mask]:
    """Which parts (m,) need stars, and whose cells stars would not settle either.

    foreseen : (4, 3, m) of their centroids.  axes : (m,) how many they extend along.
    box : (m,) which are boxes, not regions of them.
    """
    lasting = parts.half[TIME] > 0.0
    with np.errstate(over="ignore"):  # lights of 1e30 beside a picture of 1e-214
        each = parts.stake * foreseen.sum(axis=(0, 1))
        # what moves is foreseen less well: a moving caster's nodes were 3 times as far off
        needed = each * np.sqrt(parts.crowd) > np.where(lasting, 0.0, NEEDED)
        # regions in time may be in pieces, some far from the centroid
        needed |= lasting & ~box
        left = parts.stake * left_by_stars(foreseen, axes)
        vain = sums(parts.cell, left, int(parts.cell.max(initial=-1)) + 1) > IN_VAIN
    return parts.star & needed, vain[parts.cell]


def left_by_stars(foreseen: Array, axes: Ints) -> Array:
    """What stars leave (m,) of deviations (4, 3, m), by how many axes they extend along."""
    left: Array = (STAR[axes - 1].T * foreseen.sum(axis=1)).sum(axis=0)
    return left


def _at_rims(slant: tuple[Array, Array], rows: Ints, arms: Arms, left: Array, axes: Ints) -> Array:
    """`rim_gains` of some stars; slants at samples and centroids, and what is left of arms."""
    number = np.full(arms.count.size, -1)
    number[rows] = np.arange(rows.size)
    own = number[arms.region]
    # an arm that is given up says nothing
    some = ((own >= 0) & (left > 0.0)).nonzero()[0]
    own, region = own[some], arms.region[some]
    weight = (1.0 - arms.middle[region]) / arms.count[region]
    return rim_gains(slant[0][some], slant[1][rows], weight, left[some], own, axes)


def _shown(
    away: Array, offset: Array, half: Array, region: Ints, star: Mask
) -> tuple[Ints, Array, Array]:
    """Of samples of stars: which star, their radiance less its mean, and where they lie in it."""
    rows = star[region].nonzero()[0]
    own = region[rows]
    place = columns(offset, rows) / np.maximum(columns(half, own), TINY)
    return np.cumsum(star)[own] - 1, columns(away, rows), place


def _look(plan: Plan, occluders: Occluders, parts: Parts) -> _Centers:
    """The centroids of m parts, and what is foreseen of the parts from there."""
    hits, w, t, time = _hits(plan, parts.place, parts.item)
    slant, known = _slant(hits, w), parts.known
    if not known.any():
        light, reach = _foreseen(plan, occluders, hits, w, t, time, parts.half)
        return _Centers(hits, light, reach, slant)
    rows, same = (~known).nonzero()[0], known.nonzero()[0]
    when = time[rows] if isinstance(time, np.ndarray) else time
    near = hits.take(rows), columns(w, rows), t[rows], when, columns(parts.half, rows)
    light, far = _foreseen(plan, occluders, *near)
    reach = np.full(known.size, NOWHERE)
    reach[rows] = far
    color, deviation = np.empty((3, known.size)), no_variation(known.size)
    place(color, rows, light.color)
    place(color, same, parts.color)
    place(deviation, rows, light.deviation)
    place(deviation, same, parts.deviation)
    found = tuple(Pairs(rows[pairs.pixel], pairs.item) for pairs in light.candidates)
    return _Centers(hits, Shaded(color, deviation, found), reach, slant)


def _foreseen(
    plan: Plan,
    occluders: Occluders,
    hits: Surface,
    w: Array,
    t: Array,
    time: Array | float,
    half: Array,
) -> tuple[Shaded, Array]:
    """Light at hits, with what is foreseen of boxes of half extents (3, m) around them, and how
    far, metres, its candidates serve: (m,)."""
    with np.errstate(over="ignore", invalid="ignore"):  # sizes that only estimates hang on
        patch = replace(make_patch(plan, w, t, hits, half), margin=MARGIN)
    return shade(plan, occluders, hits, time, patch), patch.reach


def _look_around(
    plan: Plan,
    occluders: Occluders,
    parts: Parts,
    centers: _Centers,
    spots: Array,
    region: Ints,
) -> tuple[Array, Array]:
    """Radiance (3, k) and slants at spots (3, k) in x, y and t of parts `region` (k,)."""
    hits, w, _, time = _hits(plan, spots, parts.item[region])
    away = hits.point - columns(centers.hits.point, region)
    farthest = np.zeros(parts.item.size)
    np.maximum.at(farthest, region, np.sqrt(dot(away, away)))
    around = [
        _served(occluders, plan.shadow_light(light), centers, known, farthest)
        for light, known in zip(plan.lights, centers.light.candidates, strict=True)
    ]
    candidates = [pairs.of(region, parts.item.size) for pairs in around]
    return shade_among(plan, hits, time, candidates), _slant(hits, w)


def _served(
    occluders: Occluders, light: Emitter, centers: _Centers, known: Pairs, farthest: Array
) -> Pairs:
    """Occluders that serve all points of parts so far (m,) from their centroids.

    light : as it casts shadows.  known : those that serve the patches, sorted by part.
    """
    # arms may end farther off than their parts do
    beyond = farthest > centers.reach
    rows = beyond.nonzero()[0]
    if not rows.size:
        return known
    more = occluders.find(light, centers.hits.take(rows), farthest[rows])
    near = known.take(~beyond[known.pixel])
    pixel = np.concatenate([near.pixel, rows[more.pixel]])
    item = np.concatenate([near.item, more.item])
    return Pairs(pixel, item).take(np.argsort(pixel, kind="stable"))


def _hits(plan: Plan, spots: Array, item: Ints) -> tuple[Surface, Array, Array, Array | float]:
    """Where objects are seen at spots (3, k) in x, y and t: hits, rays, parameters and times."""
    w = plan.lens.directions(spots[0], spots[1])
    time: Array | float = spots[2] if plan.motion else 0.0
    t = hits_or_near(plan, w, item, time)
    return surface(plan, w, t, item, time), w, t, time


def _slant(hits: Surface, w: Array) -> Array:
    """Cosines (k,) between normals and rays."""
    slant: Array = np.abs(dot(hits.normal, w)) / np.sqrt(dot(w, w))
    return slant
