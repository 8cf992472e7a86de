# SPDX-License-Identifier: GPL-3.0-or-later
"""Points that stand for parts of cells: their centroids, or stars around them.

A centroid is right for radiance linear in x, y and t; the mean over a star, whose arms are as long
as second moments say, for quadratic radiance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .ahead import hits_or_near
from .cells import sums
from .columns import columns
from .lines import TIME
from .occluder import Occluders
from .patch import make_patch
from .plan import Plan
from .primary import places, surface
from .regions import Regions
from .shade import Shaded, shade
from .stray import kept_parts

__all__ = ["Parts", "join", "sample"]

Array: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

STAR = np.array([0.04, 0.15, 0.5])
"""Of the deviation of a centroid's sample: that of a star's mean, by kind: about
twice what was measured, 0.02, 0.07 and 0.3."""
CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
"""Of a cube: the star in three dimensions, (samples, axes). Exact for quadratics as six arms along
the axes are, in four samples, and not as far out."""
INSIDE = 1.0 - 2.0**-10
"""Of a star's arms: of a box or a triangle they would end on a side. Whether a point on an outline
is hit, or one on a seam is inside another object, is for rounding to say; this keeps the points
off, and the quadrature's second moments to a five hundredth."""
ASIDE = 2.0**-30
"""Of the shutter: regions whose centroids are nearer to its middle lie in it but for rounding."""


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
    size = parts.item.size
    region, offset, lot = _arms(parts.place[2], parts.spread, parts.half > 0.0, parts.star)
    count = np.bincount(region, minlength=size)
    at, half = columns(parts.place, region), columns(parts.half, region)
    short, lost = np.zeros(region.size), np.zeros(region.size)
    if hit.size:
        own = slice(int(count[: hit.size].sum()))
        kept, stray = kept_parts(
            plan, found, hit[region[own]], at[:, own], offset[:, own], half[:, own], lot[own]
        )
        offset[:, own] *= kept
        short[own], lost[own] = 1.0 - kept * kept, stray
    light = _look(plan, occluders, at + offset, half, parts.item[region], count)
    part = 1.0 / count[region]

    def mean(values: Array) -> Array:
        return np.stack([sums(region, part * row, size) for row in values])

    gain = np.where(count[region] > 1, STAR[:, None] + (1.0 - STAR[:, None]) * short, 1.0)
    deviation = np.stack([mean(kind * g) for kind, g in zip(light.deviation, gain, strict=True)])
    return Shaded(mean(light.color), deviation), count, sums(region, part * lost, size)


def _arms(time: Array, spread: Array, wide: Mask, star: Mask) -> tuple[Ints, Array, Ints]:
    """Samples of regions (m,) at times; wide : (3, m) axes that they extend along.

    A tetrahedron has a sense of direction. It follows the side of the shutter that a region lies
    on, so that a reversed shutter gives the same picture; one that lies on both gets a star.

    Returns
    -------
    region : (k,) which one each stands for.  offset : (3, k) from its centroid.
    lot : (k,) numbers of those samples that balance each other.
    """
    axes = wide.sum(axis=0)
    side = np.where(np.abs(time) > ASIDE, np.sign(time), 0.0)
    cube = star & (axes == 3) & (side != 0.0)
    count = np.where(star & (axes > 0), np.where(cube, len(CORNERS), 2 * axes), 1)
    region = np.repeat(np.arange(count.size), count)
    number = places(count)
    inner = cube[region]
    many, sign = count[region] > 1, np.where(number % 2 == 0, 1.0, -1.0)
    # which axis an arm is along: the k-th of those that are wide
    order = np.cumsum(wide, axis=0) - 1
    offset = np.zeros((3, region.size))
    for axis, entries in ((0, (0, 1, 3)), (1, (-1, 2, 4)), (2, (-1, -1, 5))):
        own = many & wide[axis, region] & (inner | (order[axis, region] == number // 2))
        rows = np.flatnonzero(own)
        which = region[rows]
        corner = CORNERS[number[rows] % len(CORNERS), axis]
        if axis == TIME:
            corner = corner * side[which]
        length = np.where(inner[rows], corner, sign[rows] * np.sqrt(axes[which]))
        for along, column in enumerate(entries):
            if column >= 0:
                offset[along, rows] += length * spread[column, which] * INSIDE
    first = np.where(inner, number == 0, number % 2 == 0)
    return region, offset, np.cumsum(first) - 1


def _look(
    plan: Plan, occluders: Occluders, place: Array, half: Array, item: Ints, sizes: Ints
) -> Shaded:
    """Light from objects at places (3, m) in x, y and t that stand for boxes of half extents.

    `sizes` are numbers of places that belong together.
    """
    w = plan.lens.directions(place[0], place[1])
    time: Array | float = place[2] if plan.motion else 0.0
    t = hits_or_near(plan, w, item, time)
    hits = surface(plan, w, t, item, time)
    with np.errstate(over="ignore", invalid="ignore"):  # sizes that only estimates hang on
        patch = make_patch(plan, w, t, hits, half)
    return shade(plan, occluders, hits, time, patch, sizes=sizes)
