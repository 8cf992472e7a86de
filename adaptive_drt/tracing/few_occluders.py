# SPDX-License-Identifier: GPL-3.0-or-later
"""Few candidate occluders where rays find the light: enough of them to detect what they do.

Light that rays are traced for needs no list of all occluders (`solid_rays`), and under a sky such
a list is long. Detection asks only whether there is any, for the mask of penumbrae, and which ones
may touch a pixel's patch of surface, for sharp shadow edges.
"""

from __future__ import annotations

import threading
from functools import cached_property
from weakref import WeakKeyDictionary, proxy

import numpy as np

from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.low_discrepancy import sequence_points
from ..numerics.vector import dot
from .ball_groups import BallGroups
from .intersect import Pairs, Surface
from .occluder_culling import Occluders, merge_pairs, pairs_by_blocks

__all__ = ["FewOccluders"]


WITNESS_DIRECTIONS = 256
"""Number of directions of which the farthest spheres are witnesses that a point's sky is hidden."""
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
"""Angle in radians between consecutive directions of a spherical spiral."""
TOUCH_MARGIN = 1.0 + 2.0**-40
"""Factor on the distance at which a patch may touch a sphere: far above rounding."""
PROBES = 16
"""Largest number of places of a light that are tried for each point, for a sphere that hides one.
Points from which none is hidden have few candidates, as a rule."""
COUNTED_SPHERES = 512
"""Number of spheres in the sample by which those above a horizon are counted; their number is then
known to some 3 %."""
COUNTED_SHARE = 32
"""Largest number of spheres for each that is in the sample of those before a light, which are few
of very many: of a million balls 3,000 hide a light, and a sample of 512 has none of them at every
fifth point."""
COUNTED_PAIRS = 1 << 20
"""Number of pairs of points and spheres that are looked at in one call, to count them: it bounds
memory."""
LISTED_PAIRS, MIN_LISTED = 1 << 22, 256
"""Number of pairs of points and spheres of which all that may matter are listed in one call, and
least number of points: it bounds memory."""


def _chunks(points: int, spheres: int) -> list[slice]:
    """Slices of so many points that all their pairs with so many spheres fit memory."""
    size = max(1, COUNTED_PAIRS // spheres)
    return [slice(first, min(first + size, points)) for first in range(0, points, size)]


_made: WeakKeyDictionary[Occluders, FewOccluders] = WeakKeyDictionary()
_making = threading.Lock()


class FewOccluders:
    """Finds few candidates of points among the solids that are traced as one set."""

    def __init__(self, occluders: Occluders) -> None:
        """Take the occluders of a scene that has a tracer."""
        assert occluders.tracer is not None
        self._plan = occluders.plan
        # these are kept for as long as the occluders are
        self._occluders: Occluders = proxy(occluders)
        self._item = occluders.tracer.items
        self._traced = occluders.tracer.traced.nonzero()[0]
        self._center, self._radius = occluders.center, occluders.radius

    @cached_property
    def _witness(self) -> Ints:
        """Those of the spheres that are the farthest in some direction."""
        number = np.arange(WITNESS_DIRECTIONS) + 0.5
        z, turn = 1.0 - 2.0 * number / WITNESS_DIRECTIONS, GOLDEN_ANGLE * number
        aside = np.sqrt(1.0 - z * z)
        best, (center, radius) = [], self._balls(self._item)
        for direction in np.array([aside * np.cos(turn), aside * np.sin(turn), z]).T:
            self._plan.raise_if_cancelled()
            best.append(int((direction @ center + radius).argmax()))
        return np.unique(best)

    def _balls(self, item: Ints) -> tuple[Array, Array]:
        """Centres (3, k) and radii (k,) of objects, metres."""
        return columns(self._center, item), self._radius[item]

    @classmethod
    def of(cls, occluders: Occluders) -> FewOccluders:
        """Those of a scene's occluders, made once."""
        with _making:
            found = _made.get(occluders)
            if found is None:
                found = _made[occluders] = cls(occluders)
            return found

    def find(
        self, light: Emitter, surface: Surface, reach: Array, far: Array | None = None
    ) -> Pairs:
        """Enough candidates to detect what a light does at n points.

        They hold for all surface points within `reach` (n,) metres. A point that has candidates
        among the traced spheres has at least one of them; those that may touch its patch, and
        other objects, are all among them. Sorted by point. For patches of which spheres only hide
        light from the points within `far` (n,) metres, not more than `reach`, others are left out.
        """
        count = surface.item.size
        if not count:
            return self._occluders.find_candidates(light, surface, reach)
        objects = self._occluders.radius.size
        witnesses = (
            self._highest_witnesses(surface)
            if light.surrounds
            else self._blocking_witnesses(light, surface)
        )
        pairs = merge_pairs([self._touching(surface, reach), witnesses], count, objects)
        found = self._occluders.select(light, surface, reach, pairs)
        others = self._occluders.find_untraced(light, surface, reach)
        unknown = np.ones(count, dtype=np.bool_)
        # the first sphere before a light's centre hides a part of it; one that is touched may not
        sure = (
            found if light.surrounds else self._occluders.select(light, surface, reach, witnesses)
        )
        unknown[sure.pixel] = False
        if light.extended and not light.surrounds:
            found = merge_pairs([found, self._probed(light, surface, unknown)], count, objects)
        wide = reach if far is None else far
        every = self._every_candidate(light, surface, wide, unknown.nonzero()[0])
        return merge_pairs([found, others, *every], count, objects)

    def _probed(self, light: Emitter, surface: Surface, unknown: Mask) -> Pairs:
        """Pairs of points and spheres that hide a point of a light, one for each point at most.

        unknown : (n,) points that ask for one; those that get one are removed.
        """
        tracer = self._occluders.tracer
        assert tracer is not None
        pixels, items = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
        for place in np.array(sequence_points(0, 0, PROBES, 2)).T:
            rows = unknown.nonzero()[0]
            if not rows.size:
                break
            some = surface.take(rows)
            point, normal = some.point, some.normal
            a, b = np.repeat(place[:, None, None], rows.size, axis=1)
            each = point[:, :, None], normal[:, :, None], a, b
            to, weight = light.sample(light.to_center(point)[:, :, None], *each)
            item = tracer.first_blocking(point, normal, np.ascontiguousarray(to[:, :, 0]))
            hits = ((item >= 0) & (weight[:, 0] > 0.0)).nonzero()[0]
            # where embree's rounding lets a ray meet a sphere that it passes, another place tells
            start, way, met = columns(point, hits), columns(to[:, :, 0], hits), item[hits]
            sure = np.zeros(hits.size, dtype=np.bool_)
            for shapes, own, index in self._plan.shapes.groups(met):
                sure[own] = shapes.blocks(index, columns(start, own), columns(way, own), 0.0)
            sure &= (met != some.item[hits]) | some.inside[hits]
            pixels.append(rows[hits[sure]])
            items.append(met[sure])
            unknown[pixels[-1]] = False
        return Pairs(np.concatenate(pixels), np.concatenate(items))

    def _every_candidate(
        self, light: Emitter, surface: Surface, reach: Array, rows: Ints
    ) -> list[Pairs]:
        """All candidates of the points `rows`, in parts so small that their pairs fit memory."""
        parts = []
        step = max(MIN_LISTED, LISTED_PAIRS // self._item.size)
        for first in range(0, rows.size, step):
            some = rows[first : first + step]
            found = self._occluders.find_candidates(light, surface.take(some), reach[some])
            parts.append(Pairs(some[found.pixel], found.item))
        return parts

    def count_above_horizons(self, surface: Surface, cost: Array) -> Array:
        """Number of solids above the horizons of n points, by a sample of them: (n,).

        cost : (objects,) what each object counts as.
        """
        step = -(-self._item.size // COUNTED_SPHERES)
        center, radius = self._balls(self._item[::step])
        each = cost[self._item[::step]]
        count = np.empty(surface.item.size)
        for rows in _chunks(count.size, radius.size):
            normal = surface.normal[:, rows]
            lowest = dot(normal, surface.point[:, rows])[:, None] - radius
            count[rows] = (normal.T @ center > lowest) @ each * float(step)
        return count

    def count_before(
        self, light: Emitter, surface: Surface, cost: Array, reach: Array | float = 0.0
    ) -> Array:
        """Number of solids that may hide a light from n points, by a sample of them: (n,).

        cost : as that of `count_above_horizons`.
        reach : (n,) metres; all count that may hide it from surface points within.
        """
        reach = np.broadcast_to(np.asarray(reach, dtype=np.float64), (surface.item.size,))
        step, count = -(-self._item.size // COUNTED_SPHERES), surface.item.size
        if step > COUNTED_SHARE:
            pairs = self._occluders.find_among(light, surface, reach, self._sample)
            return float(COUNTED_SHARE) * np.bincount(pairs.pixel, cost[pairs.item], count)
        sample, number = self._item[::step], np.zeros(count)
        for part in _chunks(count, sample.size):
            rows = np.arange(count)[part]
            point = np.repeat(np.arange(rows.size), sample.size)
            pairs = Pairs(point, np.tile(sample, rows.size))
            own = surface.take(rows)
            found = self._occluders.select(light, own, reach[rows], pairs)
            number[rows] = np.bincount(found.pixel, cost[found.item], rows.size)
        return number * float(step)

    @cached_property
    def _sample(self) -> BallGroups:
        """A sample of the spheres, of which those before a light are counted."""
        item = self._item[::COUNTED_SHARE]
        return BallGroups(*self._balls(item), item)

    @property
    def items(self) -> Ints:
        """Numbers of the solids that are traced as one set."""
        return self._item

    def _highest_witnesses(self, surface: Surface) -> Pairs:
        """Pairs of points and the witness that is highest above the horizon."""
        item = self._item[self._witness]
        center, radius = self._balls(item)
        highest = np.empty(surface.item.size, dtype=np.int64)
        for rows in _chunks(highest.size, item.size):
            height = surface.normal[:, rows].T @ center + radius
            height[item == surface.item[rows, None]] = -np.inf
            highest[rows] = item[height.argmax(axis=1)]
        return Pairs(np.arange(highest.size), highest)

    def _blocking_witnesses(self, light: Emitter, surface: Surface) -> Pairs:
        """Pairs of points and the first sphere that hides the centre of a light from them."""
        tracer = self._occluders.tracer
        assert tracer is not None
        item = tracer.first_blocking(surface.point, surface.normal, light.to_center(surface.point))
        rows = (item >= 0).nonzero()[0]
        return Pairs(rows, item[rows])

    def _touching(self, surface: Surface, reach: Array) -> Pairs:
        """Pairs of points and spheres that their patches may touch."""

        def near(balls: tuple[Array, Array], middle: Array, span: Array, number: Ints) -> Mask:
            self._plan.raise_if_cancelled()
            gap = columns(balls[0], number) - middle
            wide = TOUCH_MARGIN * (balls[1][number] + span)
            close: Mask = dot(gap, gap) <= wide * wide
            return close

        def touches(balls: tuple[Array, Array], at: Ints, number: Ints) -> Mask:
            return near(balls, columns(surface.point, at), reach[at], number)

        groups, tracer = self._occluders.groups, self._occluders.tracer
        if groups is not None and tracer is not None:
            pairs = Pairs(*groups.pairs(reach.size, touches))
            return pairs.take(tracer.traced[pairs.item])
        balls = self._balls(self._traced)
        pairs = pairs_by_blocks(
            surface.point, reach, self._traced.size, lambda *block: near(balls, *block)
        )
        return Pairs(pairs.pixel, self._traced[pairs.item])
