# SPDX-License-Identifier: GPL-3.0-or-later
"""From which patches of surface may the visible part of a light change: where outlines reach.

Meshes at rest tell by their outlines (`geometry.mesh.outline_shafts`), other shapes by bounds.
Under lights that surround the points, before moving lights and before instances of meshes nothing
is proven, but that a light without occluders is visible as a whole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.mesh.outline_shafts import OutlineShafts, ReachedBlocks, Shafts
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.vector import dot
from .compile import Plan
from .intersect import Pairs, Surface, receivers_of

__all__ = ["OutlinesNear", "ShadowOutlines", "may_shadow"]


RISE_MARGIN = 4.0
"""Height over facets at which shadow rays may begin, as a multiple of that of the smooth surface
over a point of the patch."""
START_HEIGHT = 4e-6
"""Height over a surface at which its shadow rays may begin, as a fraction of its mesh's size, with
a margin: see `geometry.mesh.tracer.START_OFFSET`."""


@dataclass(frozen=True)
class OutlinesNear:
    """Outlines of occluders near the shafts from n patches to a light.

    Attributes
    ----------
    near : (n,) whether the visible part of the light may change over the patch.
    unsure : (n,) of these, where that is not known by outlines, and stays.
    parts : of each mesh its outlines, the numbers of the patches (k,) before which it lies, their
        shafts, and the blocks of those.
    """

    near: Mask
    unsure: Mask
    parts: list[tuple[OutlineShafts, Ints, Shafts, ReachedBlocks]]

    def reached(self, wanted: Mask, dark: Mask) -> Mask:
        """Whether single outlines reach the shafts of patches that are wanted, or near ones those
        of the others: (n,).

        dark : (n,) patches from which nothing is seen of the light; they are not looked at closely
            behind many outlines.
        """
        found = self.unsure | (self.near & ~wanted)
        for outlines, rows, shafts, blocks in self.parts:
            found[rows[blocks.within & blocks.crowded & dark[rows]]] = True
            reached = outlines.reached(shafts, blocks, wanted[rows] & ~found[rows])
            found[rows[reached]] = True
        return found


class ShadowOutlines:
    """The outlines of all objects of a scene before its lights."""

    def __init__(self, plan: Plan) -> None:
        """Nothing is found of any object yet."""
        self._plan = plan
        self._known: dict[tuple[int, int], OutlineShafts | None] = {}

    def before(
        self,
        number: int,
        hits: Surface,
        reach: Array,
        pairs: Pairs,
        sides: tuple[Array, Array] | None = None,
    ) -> OutlinesNear:
        """Outlines between n patches and a light.

        Parameters
        ----------
        number : the light's.  hits : points of the patches.
        reach : (n,) metres, bounds on the distance of the patches' other points.
        pairs : patches and occluders that may hide some of the light, sorted by patch.
        sides : two of (3, n) metres: of patches that lie in parallelograms, from the points to the
            middles of the sides; 0 for other patches.
        """
        plan, light = self._plan, self._plan.as_shadow_caster(self._plan.lights[number])
        near, unsure = np.zeros((2, reach.size), dtype=np.bool_)
        parts: list[tuple[OutlineShafts, Ints, Shafts, ReachedBlocks]] = []
        if light.surrounds or light.displacement is not None:
            unsure[pairs.pixel] = True
            return OutlinesNear(unsure.copy(), unsure, parts)
        sampled = plan.shapes.sampled[pairs.item]
        others = pairs.take(~sampled)
        unsure[others.pixel[may_shadow(plan, hits, light, others, reach)]] = True
        span = reach
        if hits.smooth is not None:
            rise = np.sqrt(dot(hits.smooth.rise, hits.smooth.rise))
            span = reach + RISE_MARGIN * rise
            own = np.zeros(reach.size, dtype=np.bool_)
            own[pairs.pixel] = True
            unsure |= own & (rise > 0.0) & ~_all_above_facets(light, hits)
        for item in np.unique(pairs.item[sampled]).tolist():
            rows = pairs.pixel[pairs.item == item]
            rows = rows[~unsure[rows]]
            outlines = self._outlines(number, light, item)
            if outlines is None or outlines.touches_light:
                unsure[rows] = True
            elif rows.size and outlines.count:
                size = float(plan.shapes.bounding_spheres[1][item])
                wide = span[rows] + START_HEIGHT * size
                flat = None if sides is None else (sides[0][:, rows], sides[1][:, rows])
                shafts = Shafts.make(hits.point[:, rows], wide, light, flat)
                blocks = outlines.reached_blocks(shafts)
                near[rows[blocks.within]] = True
                parts.append((outlines, rows, shafts, blocks))
        return OutlinesNear(near | unsure, unsure, parts)

    def _outlines(self, number: int, light: Emitter, item: int) -> OutlineShafts | None:
        key = (number, item)
        if key not in self._known:
            shapes, index = self._plan.shapes.locate(item)
            self._known[key] = shapes.outline_shafts(index, light.bounds_from_anywhere())
        return self._known[key]


def may_shadow(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array) -> Mask:
    """Whether objects may hide some of a light at rest from patches at some time: (m,).

    Parameters
    ----------
    surface : n points.  light : as it casts shadows.  pairs : m patches and objects.
    reach : (n,) metres, bound on the distance of each patch's points from its point.
    """
    touched = np.zeros(pairs.item.size, dtype=np.bool_)
    for shapes, rows, index in plan.shapes.groups(pairs.item):
        receivers = receivers_of(surface, pairs.take(rows), reach)
        touched[rows] = shapes.may_shadow(index, light, receivers)
    return touched


def _all_above_facets(light: Emitter, hits: Surface) -> Mask:
    """Whether all of a light is above the planes of the facets at points: (n,)."""
    assert hits.smooth is not None
    facet = hits.smooth.facet
    height = light.height_over_planes(facet, dot(facet, hits.point))
    extent = np.full(height.size, float(light.radius))
    if light.span is not None:
        extent = np.abs(dot(facet, light.span.half_u)) + np.abs(dot(facet, light.span.half_v))
    above: Mask = height > extent
    return above
