# SPDX-License-Identifier: GPL-3.0-or-later
"""Candidate occluders: the objects that may occlude a light from surface points, over the shutter.

The culling is conservative: an object is dropped only where a bounding test proves that it occludes
no point of the light at any time. Blocks of neighbouring points are tested together first (shaft
culling, Haines and Wallace 1991); with very many objects embree replaces that part.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import numpy as np

from ..geometry.shape_table import ShapeTable
from ..geometry.sphere.kernels import cone_touches
from ..lights.bounds import LightBounds
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.morton import morton_order
from ..numerics.vector import dot
from ..parallel.call_progress import progress_range, report_progress
from .ball_groups import MANY_OBJECTS, BallGroups
from .compile import Plan
from .embree import ProxyScene
from .face_planes import FacePlanes
from .intersect import Pairs, Surface, cache_sized_chunks, curvature, run_indices
from .light_view import LightView
from .point_blocks import BLOCK_BITS, group_balls
from .shadow_outlines import ShadowOutlines, may_shadow
from .shadowed_occluders import hidden_by_spheres
from .solid_rays import SolidTracer

__all__ = [
    "Occluders", "all_pairs_unculled", "find_group_candidates", "may_shadow", "merge_pairs",
    "pairs_by_blocks",
]  # fmt: skip

BallTest: TypeAlias = Callable[[Array, Array, Ints], Mask]

BLOCK_SIZES = (256, 32, 8)
"""Numbers of points, consecutive in Morton order, that share one culling test at each level."""
LEVEL_COUNT = len(BLOCK_SIZES) + 1
"""Number of levels of tests, with that of single points. All take about the same time."""
MAX_PAIRS_WITHOUT_BLOCKS = 6_144
"""Largest number of pairs of points and objects that are all tested in one call, without blocks.

Calls then cost more than pairs: 7 objects took 0.3 of the time with 30 points and 0.9 with 1,000;
33 objects took 0.3 with 30 points and 0.6 with 150."""
MAX_OBJECTS_WITHOUT_BLOCKS = 16
"""Largest number of objects that are each tested against all points, without blocks.

That costs 15 ns a pair, and 80 where points are gathered. With 48 it took a fifth longer."""
MAX_BALLS = 8
"""Number of balls of an object from which a block of points counts as occluded by it without a
closer look: in the middle of a shadow there are many."""
POINTS_PER_CHUNK = 1 << 16
"""Number of points in a chunk of such a test.

Chunks of 8,192 stay in the cache and are a tenth faster on one thread, but a fifth slower on two,
which wait for each other at every call (300 x 300)."""
FEW_POINTS = 0.5
"""Largest fraction of the points of such a chunk that are gathered to be tested alone."""
MANY_PAIRS = 0.9
"""Fraction of the pairs of a chunk from which all are tested, instead of gathering some."""
FLAGS_PER_PAIR = 64
"""Largest ratio of possible pairs and pairs found at which these are sorted by a table of flags, of
all possible pairs, and not by comparisons."""
MOST_FLAGS = 1 << 27
"""Largest number of flags (bytes) of such a table: it bounds memory."""


class Occluders:
    """Finds candidate occluders by the bounding spheres of all objects over the shutter."""

    def __init__(self, plan: Plan) -> None:
        """Compute the bounding spheres, and build embree's proxies for the lights that use them."""
        self.plan = plan
        self.center, radius = plan.shapes.bounding_spheres
        d = plan.shapes.displacement
        path = 0.0 if d is None else 0.5 * np.sqrt(dot(d, d))
        self.radius = radius if d is None else radius + path
        # what of the spheres is solid during the whole shutter
        self._solid = np.maximum(radius - path, 0.0)
        self._solid[plan.shapes.proxied :] = 0.0
        self._planes = FacePlanes.make(plan.shapes)
        self._balls = _enclosing_balls(plan.shapes)
        self.tracer = None if plan.traced is None else SolidTracer(plan.shapes, plan.traced)
        many = self.radius.size >= MANY_OBJECTS
        self.groups = BallGroups(self.center, self.radius) if many else None
        self.outlines = ShadowOutlines(plan)
        self._proxies: dict[float, ProxyScene] = {}  # by the inflation of the spheres
        proxied = plan.shapes.proxied
        for light in plan.lights:
            if plan.uses_embree(light):
                reach = plan.as_shadow_caster(light).occluder_inflation
                self._proxies[reach] = ProxyScene(
                    self.center[:, :proxied], self.radius[:proxied] + reach
                )

    def __reduce__(self) -> tuple[type[Occluders], tuple[Plan]]:
        """Pickle the compiled scene only: the receiving process builds embree's proxies again."""
        return Occluders, (self.plan,)

    def find_candidates(
        self, light: Emitter, surface: Surface, reach: Array | float = 0.0
    ) -> Pairs:
        """Candidate pairs (point, object) for a light, sorted by point.

        Parameters
        ----------
        light : as it casts shadows (`Plan.as_shadow_caster`).
        surface : n points.
        reach : (n,) metres; the candidates hold for all surface points within it of each point.
        """
        count = surface.item.size
        none = np.zeros(0, dtype=np.int64)
        if not count or not self.radius.size or not light.casts_shadow:
            return Pairs(none, none)
        reach = np.broadcast_to(np.asarray(reach, dtype=np.float64), (count,))
        sight = LightView.make(light, surface, reach, curvature(self.plan, surface))
        return self._without_idle(light, sight, self._all_candidates(light, sight))

    def _without_idle(self, light: Emitter, sight: LightView, pairs: Pairs) -> Pairs:
        """The pairs without those that hide nothing by what the objects are."""
        pairs = self._planes.without_redundant_faces(sight, _without_passed(light, pairs))
        return _without_coplanar_faces(light, self._by_enclosing_balls(sight, pairs))

    def find_ray_candidates(self, light: Emitter, surface: Surface) -> Pairs:
        """Candidates of n points whose light rays find: without a tracer, as `find_candidates`.

        With one, a single sphere of each point stands for all that the tracer tests.
        """
        count = surface.item.size
        if self.tracer is None or not count or not light.casts_shadow:
            return self.find_candidates(light, surface)
        others = self.find_untraced(light, surface, np.zeros(count))
        spheres = Pairs(np.arange(count), np.full(count, self.tracer.items[0]))
        return merge_pairs([spheres, others], count, self.radius.size)

    def find_untraced(self, light: Emitter, surface: Surface, reach: Array) -> Pairs:
        """The candidates of `find_candidates` that the tracer does not test."""
        assert self.tracer is not None
        others = (~self.tracer.traced).nonzero()[0]
        found = _all_pairs(reach.size, others.size)
        return self.select(light, surface, reach, Pairs(found.pixel, others[found.item]))

    def find_among(
        self, light: Emitter, surface: Surface, reach: Array, groups: BallGroups
    ) -> Pairs:
        """The candidates of `find_candidates` that are among some objects' bounding spheres."""
        sight = LightView.make(light, surface, reach, curvature(self.plan, surface))
        found = groups.pairs(reach.size, partial(self._groups_may_occlude, sight))
        return self.select(light, surface, reach, Pairs(*found))

    def select(self, light: Emitter, surface: Surface, reach: Array, pairs: Pairs) -> Pairs:
        """Those of some pairs, sorted by point, that `find_candidates` does not drop."""
        sight = LightView.make(light, surface, reach, curvature(self.plan, surface))
        return self._without_idle(light, sight, self._filter_by_point(sight, pairs))

    def are_far(self, surface: Surface, pairs: Pairs, distance: Array) -> Mask:
        """Whether occluders (m,) are farther from their points than distances (n,), metres.

        surface : n points.  pairs : points and occluders.
        """
        v = columns(self.center, pairs.item) - columns(surface.point, pairs.pixel)
        far: Mask = np.sqrt(dot(v, v)) > self.radius[pairs.item] + distance[pairs.pixel]
        return far

    def _by_enclosing_balls(self, sight: LightView, pairs: Pairs) -> Pairs:
        """The pairs without objects of many balls of which none may occlude the light."""
        keep = np.ones(pairs.item.size, dtype=np.bool_)
        for item, (center, radius) in self._balls.items():
            rows = (pairs.item == item).nonzero()[0]
            if rows.size:
                keep[rows] = self._any_ball_may_occlude(
                    sight.take(pairs.pixel[rows]), center, radius
                )
        return pairs if keep.all() else pairs.take(keep)

    def _any_ball_may_occlude(self, sight: LightView, center: Array, radius: Array) -> Mask:
        """Whether one of several balls may occlude a light from points: (n,).

        Blocks of points are tested with all balls, and smaller ones with those that are left. A
        block with more than `MAX_BALLS` of these counts as occluded.
        """
        order = morton_order(sight.surface.point, BLOCK_BITS)
        point, reach = columns(sight.surface.point, order), sight.reach[order]
        count, bounds = order.size, sight.bounds
        kept = np.zeros(count, dtype=np.bool_)
        larger = -(-count // BLOCK_SIZES[0])
        block = np.repeat(np.arange(larger), radius.size)
        ball = np.tile(np.arange(radius.size), larger)
        levels = zip((*BLOCK_SIZES, 1), (*BLOCK_SIZES[1:], 1, 0), strict=True)
        balls = (*group_balls(point, reach, BLOCK_SIZES), (point, reach))
        for (middle, span), (size, smaller) in zip(balls, levels, strict=True):
            test = partial(_balls_hide_from_blocks, bounds, (center, radius))
            some = _passing_pairs(partial(_test_blocks, test, middle, span), block, ball)
            block, ball = block[some], ball[some]
            if not smaller:
                break
            many = np.bincount(block, minlength=span.size) > MAX_BALLS
            if size < BLOCK_SIZES[0]:
                kept |= np.repeat(many, size)[:count]
                block, ball = block[~many[block]], ball[~many[block]]
            first = block * (size // smaller)
            inside = np.minimum(first + size // smaller, -(-count // smaller)) - first
            block, ball = run_indices(first, inside), np.repeat(ball, inside)
        kept[block] = True
        found = np.empty(count, dtype=np.bool_)
        found[order] = kept
        return found

    def _all_candidates(self, light: Emitter, sight: LightView) -> Pairs:
        """The candidate pairs, including faces of solids that `needed` removes."""
        surface, reach = sight.surface, sight.reach
        count = reach.size
        proxies = None if (reach > 0.0).any() else self._proxies.get(light.occluder_inflation)
        if proxies is None and count * self.radius.size <= MAX_PAIRS_WITHOUT_BLOCKS:
            return self._filter_by_point(sight, _all_pairs(count, self.radius.size))
        first = 0
        parts: list[Pairs] = []
        if proxies is not None:
            # where bounding spheres are too large, embree would return objects for most rays
            first = self.plan.shapes.proxied
            parts.append(self._filter_by_point(sight, self._near_proxies(sight, proxies)))
            to = light.to_center(surface.point)
            met = Pairs(*proxies.intersected_by(surface.point, to))
            parts.append(self._filter_by_point(sight, met))
        if self.radius.size - first <= MAX_OBJECTS_WITHOUT_BLOCKS:
            parts += self._pairs_by_object(sight, first)
        else:
            parts.append(self._filter_by_point(sight, self._pairs_by_shafts(sight, first)))
        pairs = merge_pairs(parts, count, self.radius.size)
        if not light.surrounds:
            return pairs
        return pairs.take(~self._hidden(light, (surface.point, reach), pairs))

    def _hidden(self, light: Emitter, blocks: tuple[Array, Array], pairs: Pairs) -> Mask:
        """Whether other occluders hide those of pairs of blocks of points and objects: (m,).

        blocks : centres and radii of balls around the points of each block, metres.
        """
        # what the light passes through hides nothing
        solid = self._solid if light.passes is None else np.where(light.passes, 0.0, self._solid)
        balls = self.center, self.radius
        return hidden_by_spheres(*blocks, pairs.pixel, pairs.item, balls, solid)

    def _near_proxies(self, sight: LightView, proxies: ProxyScene) -> Pairs:
        """Pairs whose point lies within the object's proxy, where embree may miss it."""
        center, outer = self.center[:, : proxies.circumradius.size], proxies.circumradius

        def near(middle: Array, span: Array, item: Ints) -> Mask:
            gap = columns(center, item) - middle
            wide = outer[item] + span
            close: Mask = dot(gap, gap) <= wide * wide
            return close

        return pairs_by_blocks(sight.surface.point, sight.reach, outer.size, near)

    def _pairs_by_object(self, sight: LightView, first: int) -> list[Pairs]:
        """Candidate pairs of objects `first` and higher, each tested against all points."""
        parts = []
        count = sight.reach.size
        for begin in range(0, count, POINTS_PER_CHUNK):
            rows = slice(begin, min(begin + POINTS_PER_CHUNK, count))
            for item in range(first, self.radius.size):
                pixel = self._points_before(sight, rows, item)
                parts.append(Pairs(pixel, np.full(pixel.size, item)))
        return parts

    def _points_before(self, sight: LightView, rows: slice, item: int) -> Ints:
        """Those of the points `rows`, ascending, from which an object may occlude a light."""
        chosen = np.array([item])
        if self._planes.are_planar(chosen)[0]:
            apart: Ints = self._planes.may_separate(sight, rows, chosen).nonzero()[0] + rows.start
            if apart.size <= FEW_POINTS * (rows.stop - rows.start):
                return apart[self._balls_may_occlude(sight, apart, chosen)]
            kept = self._balls_may_occlude(sight, rows, chosen)
            apart = apart[kept[apart - rows.start]]
            return apart
        found: Ints = self._balls_may_occlude(sight, rows, chosen).nonzero()[0] + rows.start
        return found

    def _filter_by_point(self, sight: LightView, pairs: Pairs) -> Pairs:
        """The pairs that pass the test of single points."""
        return pairs.take(
            _passing_pairs(partial(self._may_occlude, sight), pairs.pixel, pairs.item)
        )

    def _pairs_by_shafts(self, sight: LightView, first_item: int) -> Pairs:
        """Candidate pairs of objects `first_item` and higher, by tests of blocks of points."""
        center, radius = self.center[:, first_item:], self.radius[first_item:]
        bounds = sight.bounds

        def seen(middle: Array, span: Array, item: Ints) -> Mask:
            self.plan.raise_if_cancelled()
            before = _balls_hide_from_blocks(bounds, (center, radius), middle, span, item)
            kept = before.nonzero()[0]
            flat = kept[self._planes.are_planar(item[kept] + first_item)]
            if flat.size:
                chosen, ends = item[flat] + first_item, (columns(middle, flat), span[flat])
                before[flat] = self._planes.part_balls(bounds, *ends, chosen)
            return before

        if sight.light.surrounds:
            return self._pairs_above_horizons(sight)
        point, reach = sight.surface.point, sight.reach
        if not first_item and self.groups is not None:
            return Pairs(*self.groups.pairs(reach.size, partial(self._groups_may_occlude, sight)))
        pairs = pairs_by_blocks(point, reach, radius.size, seen)
        return Pairs(pairs.pixel, pairs.item + first_item)

    def _pairs_above_horizons(self, sight: LightView) -> Pairs:
        """Candidate pairs under a light that surrounds the points, by tests of blocks of points.

        Dropped are objects below the horizons of all points of a block, and those that others hide.
        """
        order = morton_order(sight.surface.point, BLOCK_BITS)
        reach, count = sight.reach[order], order.size
        balls = group_balls(columns(sight.surface.point, order), reach, BLOCK_SIZES)
        # normals turn by no more than this within the reach
        turn = (sight.curvature[order] if sight.any_reach else 0.0) * reach
        normals = group_balls(columns(sight.surface.normal, order), turn, BLOCK_SIZES)
        pairs = _all_pairs(-(-count // BLOCK_SIZES[0]), self.radius.size)
        for level, (size, smaller) in enumerate(
            zip(BLOCK_SIZES, (*BLOCK_SIZES[1:], 1), strict=True)
        ):
            self.plan.raise_if_cancelled()
            report_progress(level / LEVEL_COUNT)
            above = partial(self._above_horizon, balls[level], normals[level])
            pairs = pairs.take(_passing_pairs(above, pairs.pixel, pairs.item))
            pairs = pairs.take(~self._hidden(sight.light, balls[level], pairs))
            within = np.arange(-(-count // smaller)) // (size // smaller)
            pairs = pairs.for_pixels(within, balls[level][1].size)
        return Pairs(order[pairs.pixel], pairs.item)

    def _above_horizon(
        self, ball: tuple[Array, Array], normals: tuple[Array, Array], block: Ints, item: Ints
    ) -> Mask:
        """Whether objects reach above the horizon of a point of their block: (m,).

        ball, normals : centres (3, b) and radii (b,) of balls that hold the points of the blocks,
        metres, and their normals.
        """
        v = columns(self.center, item) - columns(ball[0], block)
        rise = dot(columns(normals[0], block), v) + normals[1][block] * np.sqrt(dot(v, v))
        above: Mask = rise > -(self.radius[item] + ball[1][block])
        return above

    def _may_occlude(self, sight: LightView, at: Ints, item: Ints) -> Mask:
        """Whether objects, one for each of the points `at`, may occlude a light from them."""
        flat = self._planes.are_planar(item).nonzero()[0]
        if not flat.size:
            return self._balls_may_occlude(sight, at, item)
        keep = np.ones(item.size, dtype=np.bool_)
        keep[flat] = self._planes.may_separate(sight, at[flat], item[flat])
        rows = keep.nonzero()[0]
        if rows.size > MANY_PAIRS * item.size:
            return keep & self._balls_may_occlude(sight, at, item)
        keep[rows] = self._balls_may_occlude(sight, at[rows], item[rows])
        return keep

    def _balls_may_occlude(self, sight: LightView, at: Ints | slice, item: Ints) -> Mask:
        """Whether objects (one, or one for each point) may, by their bounding spheres alone."""
        surface = sight.surface
        center, radius = columns(self.center, item), self.radius[item] + sight.reach[at]
        keep = self._may_be_before(sight, at, center, radius)
        keep &= sight.before_light_plane(center, radius)
        # a convex object does not occlude light from itself, except on its inner side
        keep &= (item != surface.item[at]) | surface.inside[at]
        return keep

    def _groups_may_occlude(
        self, sight: LightView, balls: tuple[Array, Array], at: Ints, number: Ints
    ) -> Mask:
        """Whether any object within balls, one for each point, may occlude a light: (k,)."""
        center, radius = columns(balls[0], number), balls[1][number]
        return self._may_be_before(sight, at, center, radius + sight.reach[at], radius)

    def _may_be_before(
        self,
        sight: LightView,
        at: Ints | slice,
        center: Array,
        radius: Array,
        spread: Array | float = 0.0,
    ) -> Mask:
        """Whether balls lie before a light and above the horizon, for points `at`: (k,).

        spread : metres by which what is in a ball may be farther away than its centre.
        """
        self.plan.raise_if_cancelled()
        surface, cone = sight.surface, sight.cone
        v = center - columns(surface.point, at)
        vv = dot(v, v)
        axis, cosine, sine = columns(cone.axis, at), cone.cosine[at], cone.sine[at]
        keep = cone_touches(axis, cosine, sine, v, radius, vv)
        # drop objects beyond the light, but not those that contain the point
        limit = cone.far[at] + radius
        keep &= vv < limit * limit
        keep |= vv <= radius * radius
        # an object below the point's horizon occludes only light that does not reach the surface
        # (within `reach`, the normal of a sphere of radius r turns by reach / r)
        lowest = -radius
        if sight.any_reach:
            turn = sight.curvature[at] * sight.reach[at]
            lowest = lowest - turn * (np.sqrt(vv) + spread)
        keep &= dot(columns(surface.normal, at), v) > lowest
        return keep


def _enclosing_balls(table: ShapeTable) -> dict[int, tuple[Array, Array]]:
    """The balls of the objects that have many, by object, over the whole shutter."""
    found = {}
    for shapes, first in zip(table.sets, table.firsts[:-1], strict=True):
        for index in range(shapes.count if shapes.sampled else 0):
            balls = shapes.enclosing_balls(index)
            if balls is not None:
                d = shapes.displacement
                move = 0.0 if d is None else 0.5 * float(np.sqrt(dot(d[:, index], d[:, index])))
                found[first + index] = balls[0], balls[1] + move
    return found


def _balls_hide_from_blocks(
    bounds: LightBounds, balls: tuple[Array, Array], middle: Array, span: Array, number: Ints
) -> Mask:
    """Whether balls (k,), by number, may occlude a light from blocks of points (k,)."""
    cone = bounds.view_cone(bounds.to_center(middle))
    v, wide = columns(balls[0], number) - middle, balls[1][number] + span
    vv = dot(v, v)
    touch = cone_touches(cone.axis, cone.cosine, cone.sine, v, wide, vv)
    before: Mask = (vv <= wide * wide) | (touch & (np.sqrt(vv) - wide < cone.far))
    return before


def pairs_by_blocks(point: Array, reach: Array, objects: int, test: BallTest) -> Pairs:
    """Pairs of points and objects whose blocks of points pass a test at every level.

    Parameters
    ----------
    point, reach : (3, n) and (n,) metres, the points and the extent around them.
    test : takes centres (3, k) and radii (k,) of blocks' bounding balls and objects (k,), metres,
        and returns (k,) bool.
    """
    order = morton_order(point, BLOCK_BITS)
    count = order.size
    balls = group_balls(columns(point, order), reach[order], BLOCK_SIZES)
    larger = -(-count // BLOCK_SIZES[0])
    block, item = np.repeat(np.arange(larger), objects), np.tile(np.arange(objects), larger)
    for level, (size, smaller) in enumerate(zip(BLOCK_SIZES, (*BLOCK_SIZES[1:], 1), strict=True)):
        with progress_range(level / LEVEL_COUNT, (level + 1) / LEVEL_COUNT):
            kept = _passing_pairs(partial(_test_blocks, test, *balls[level]), block, item)
        first = block[kept] * (size // smaller)
        inside = np.minimum(first + size // smaller, -(-count // smaller)) - first
        block = run_indices(first, inside)
        item = np.repeat(item[kept], inside)
    return Pairs(order[block], item)


def _test_blocks(test: BallTest, middle: Array, span: Array, block: Ints, item: Ints) -> Mask:
    return test(columns(middle, block), span[block], item)


def _passing_pairs(test: Callable[[Ints, Ints], Mask], number: Ints, item: Ints) -> Ints:
    """Indices of the pairs (k,) of points or blocks and objects that pass a test, ascending."""
    kept = [np.zeros(0, dtype=np.int64)]
    for rows in cache_sized_chunks(np.arange(item.size)):
        report_progress(rows[0] / item.size)
        kept.append(rows[test(number[rows], item[rows])])
    return np.concatenate(kept)


def merge_pairs(parts: list[Pairs], points: int, objects: int) -> Pairs:
    """The union of lists of pairs, each pair once, sorted by point and then by object."""
    pixel = np.concatenate([part.pixel for part in parts])
    key = pixel * objects + np.concatenate([part.item for part in parts])
    if points * objects > min(FLAGS_PER_PAIR * key.size, MOST_FLAGS):
        return Pairs(*np.divmod(np.unique(key), objects))
    found = np.zeros(points * objects, dtype=np.bool_)
    found[key] = True
    return Pairs(*np.divmod(found.nonzero()[0], objects))


def find_group_candidates(
    occluders: Occluders, light: Emitter, surface: Surface, group: Ints
) -> Pairs:
    """Candidate occluders of points, found once for a ball around the points of each group.

    Parameters
    ----------
    light : as it casts shadows.  surface : m points.
    group : (m,) the group of each point, ascending, such as its pixel.
    """
    starts = np.diff(group, prepend=-1).nonzero()[0]
    if not starts.size:
        return Pairs(starts, starts)
    sizes = np.diff(starts, append=group.size)
    low = np.minimum.reduceat(surface.point, starts, axis=1)
    high = np.maximum.reduceat(surface.point, starts, axis=1)
    span = high - low
    reach = 0.5 * np.sqrt(dot(span, span))
    # the ball has no normal and no object: the points of a group may lie on several objects
    ball = Surface(
        0.5 * (low + high),
        np.zeros_like(low),
        np.full(starts.size, -1),
        np.zeros(starts.size, dtype=np.bool_),
    )
    found = occluders.find_candidates(light, ball, reach)
    if light.displacement is None:
        # the bounding spheres of others are themselves, and have been tested
        rows = (found.item >= occluders.plan.shapes.proxied).nonzero()[0]
        keep = np.ones(found.item.size, dtype=np.bool_)
        keep[rows] = may_shadow(occluders.plan, ball, light, found.take(rows), reach)
        found = found.take(keep)
    copies = sizes[found.pixel]
    point = run_indices(starts[found.pixel], copies)
    item = np.repeat(found.item, copies)
    keep = (item != surface.item[point]) | surface.inside[point]
    point, item = point[keep], item[keep]
    order = np.argsort(point, kind="stable")
    return Pairs(point[order], item[order])


def all_pairs_unculled(plan: Plan, light: Emitter, surface: Surface) -> Pairs:
    """Without culling: all pairs of points and objects, except a point's own object and planar
    objects in the light's plane."""
    pairs = _all_pairs(surface.item.size, plan.object_count)
    own = pairs.item == surface.item[pairs.pixel]
    pairs = _without_passed(light, pairs.take(~own | surface.inside[pairs.pixel]))
    return _without_coplanar_faces(light, pairs)


def _without_passed(light: Emitter, pairs: Pairs) -> Pairs:
    """The pairs without objects that do not hide the light by their `Visibility`."""
    return pairs if light.passes is None else pairs.take(~light.passes[pairs.item])


def _without_coplanar_faces(light: Emitter, pairs: Pairs) -> Pairs:
    """The pairs without planar objects in the plane of the light: they occlude nothing of it."""
    return pairs if light.coplanar is None else pairs.take(~light.is_coplanar(pairs.item))


def _all_pairs(points: int, objects: int) -> Pairs:
    """All pairs of points and objects, sorted by point and then by object."""
    pair = np.arange(points * objects)
    return Pairs(*np.divmod(pair, objects))
