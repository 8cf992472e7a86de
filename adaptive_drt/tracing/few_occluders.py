# SPDX-License-Identifier: GPL-3.0-or-later
"""Few candidate occluders where rays find the light: enough of them to detect what they do.

Light that rays are traced for needs no list of all occluders (`sphere_rays`), and under a sky such
a list is long. Detection asks only whether there is any, for the mask of penumbrae, and which ones
may touch a pixel's patch of surface, for sharp shadow edges.
"""

from __future__ import annotations

from weakref import WeakKeyDictionary, proxy

import numpy as np

from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot
from .intersect import Pairs, Surface
from .occluder_culling import Occluders, merge_pairs, pairs_by_blocks

__all__ = ["FewOccluders"]


WITNESS_DIRECTIONS = 256
"""Number of directions of which the farthest spheres are witnesses that a point's sky is hidden."""
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
"""Angle in radians between consecutive directions of a spherical spiral."""
TOUCH_MARGIN = 1.0 + 2.0**-40
"""Factor on the distance at which a patch may touch a sphere: far above rounding."""
COUNTED_SPHERES = 512
"""Number of spheres in the sample by which those above a horizon are counted; their number is then
known to some 3 %."""


_made: WeakKeyDictionary[Occluders, FewOccluders] = WeakKeyDictionary()


class FewOccluders:
    """Finds few candidates of points among the spheres that are traced as one set."""

    def __init__(self, occluders: Occluders) -> None:
        """Take the occluders of a scene that has a tracer."""
        assert occluders.tracer is not None
        self._plan = occluders.plan
        # these are kept for as long as the occluders are
        self._occluders: Occluders = proxy(occluders)
        self._item = occluders.tracer.items
        self._center = columns(occluders.center, self._item)
        self._radius = occluders.radius[self._item]
        number = np.arange(WITNESS_DIRECTIONS) + 0.5
        z, turn = 1.0 - 2.0 * number / WITNESS_DIRECTIONS, GOLDEN_ANGLE * number
        aside = np.sqrt(1.0 - z * z)
        direction = np.array([aside * np.cos(turn), aside * np.sin(turn), z])
        best = [int((each @ self._center + self._radius).argmax()) for each in direction.T]
        self._witness = np.unique(best)

    @classmethod
    def of(cls, occluders: Occluders) -> FewOccluders:
        """Those of a scene's occluders, made once."""
        found = _made.get(occluders)
        if found is None:
            found = _made[occluders] = cls(occluders)
        return found

    def find(self, light: Emitter, surface: Surface, reach: Array) -> Pairs:
        """Enough candidates, under a light that surrounds n points, to detect what they do there.

        They hold for all surface points within `reach` (n,) metres. A point that has candidates
        among the traced spheres has at least one of them; those that may touch its patch, and
        other objects, are all among them. Sorted by point.
        """
        count = surface.item.size
        if not count:
            return self._occluders.find_candidates(light, surface, reach)
        objects = self._occluders.radius.size
        pairs = [self._touching(surface, reach), self._highest_witnesses(surface)]
        found = self._occluders.select(light, surface, reach, merge_pairs(pairs, count, objects))
        others = self._occluders.find_untraced(light, surface, reach)
        unknown = np.ones(count, dtype=np.bool_)
        unknown[found.pixel] = False
        rows = unknown.nonzero()[0]
        rest = self._occluders.find_candidates(light, surface.take(rows), reach[rows])
        every = Pairs(rows[rest.pixel], rest.item)
        return merge_pairs([found, others, every], count, objects)

    def count_above_horizons(self, surface: Surface) -> Array:
        """Number of spheres above the horizons of n points, by a sample of them: (n,)."""
        step = -(-self._item.size // COUNTED_SPHERES)
        lowest = dot(surface.normal, surface.point)[:, None] - self._radius[::step]
        above = surface.normal.T @ self._center[:, ::step] > lowest
        count: Array = above.sum(axis=1) * float(step)
        return count

    @property
    def count(self) -> int:
        """Number of spheres that are traced as one set."""
        return self._item.size

    def _highest_witnesses(self, surface: Surface) -> Pairs:
        """Pairs of points and the witness that is highest above the horizon."""
        center, radius = columns(self._center, self._witness), self._radius[self._witness]
        item = self._item[self._witness]
        height = surface.normal.T @ center + radius
        height[item == surface.item[:, None]] = -np.inf
        return Pairs(np.arange(surface.item.size), item[height.argmax(axis=1)])

    def _touching(self, surface: Surface, reach: Array) -> Pairs:
        """Pairs of points and spheres that their patches may touch."""

        def near(middle: Array, span: Array, item: Ints) -> Mask:
            self._plan.raise_if_cancelled()
            gap = columns(self._center, item) - middle
            wide = TOUCH_MARGIN * (self._radius[item] + span)
            close: Mask = dot(gap, gap) <= wide * wide
            return close

        pairs = pairs_by_blocks(surface.point, reach, self._item.size, near)
        return Pairs(pairs.pixel, self._item[pairs.item])
