# SPDX-License-Identifier: GPL-3.0-or-later
"""Candidate occluders: the objects that may occlude a light from surface points, over the shutter.

The culling is conservative: an object is dropped only where a bounding test proves that it occludes
no point of the light at any time. Blocks of neighbouring points are tested together first (shaft
culling, Haines and Wallace 1991); with very many objects embree replaces that part.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np

from ..geometry.light_protocol import ViewCone
from ..geometry.planar_faces import NO_SOLID
from ..geometry.shape_table import ShapeTable
from ..geometry.sphere.kernels import cone_overlap, surface_tolerance
from ..lights.bounds import LightBounds
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..parallel.call_progress import progress_range, report_progress
from .compile import Plan
from .embree import ProxyScene
from .intersect import Pairs, Surface, cache_sized_chunks, curvature, run_indices

__all__ = ["Occluders", "all_pairs_unculled", "find_group_candidates"]

BallTest: TypeAlias = Callable[[Array, Array, Ints], Mask]

BLOCK_SIZES = (256, 32, 8)
"""Numbers of points, consecutive in Morton order, that share one culling test at each level."""
LEVEL_COUNT = len(BLOCK_SIZES) + 1
"""Number of levels of tests, with that of single points. All take about the same time."""
MORTON_BITS = 10
MORTON_CELLS = 1 << MORTON_BITS
"""Number of cells of the Morton curve along each axis."""
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


class Occluders:
    """Finds candidate occluders by the bounding spheres of all objects over the shutter."""

    def __init__(self, plan: Plan) -> None:
        """Compute the bounding spheres, and build embree's proxies for the lights that use them."""
        self._plan = plan
        self.center, radius = plan.shapes.bounding_spheres
        d = plan.shapes.displacement
        self.radius = radius if d is None else radius + 0.5 * np.sqrt(dot(d, d))
        self._planes = _FacePlanes.make(plan.shapes)
        self._balls = _enclosing_balls(plan.shapes)
        self._proxies: dict[str, ProxyScene] = {}
        proxied = plan.shapes.proxied
        for light in plan.lights:
            if plan.uses_embree(light):
                reach = plan.as_shadow_caster(light).occluder_inflation
                self._proxies[_light_key(light)] = ProxyScene(
                    self.center[:, :proxied], self.radius[:proxied] + reach
                )

    def __reduce__(self) -> tuple[type[Occluders], tuple[Plan]]:
        """Pickle the compiled scene only: the receiving process builds embree's proxies again."""
        return Occluders, (self._plan,)

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
        sight = _LightView.make(light, surface, reach, curvature(self._plan, surface))
        pairs = self._planes.needed(sight, self._all_candidates(light, sight))
        return _without_coplanar_faces(light, self._by_enclosing_balls(sight, pairs))

    def _by_enclosing_balls(self, sight: _LightView, pairs: Pairs) -> Pairs:
        """The pairs without objects of many balls of which none may occlude the light."""
        keep = np.ones(pairs.item.size, dtype=np.bool_)
        for item, (center, radius) in self._balls.items():
            rows = (pairs.item == item).nonzero()[0]
            if rows.size:
                keep[rows] = self._any_ball_may_occlude(
                    sight.take(pairs.pixel[rows]), center, radius
                )
        return pairs if keep.all() else pairs.take(keep)

    def _any_ball_may_occlude(self, sight: _LightView, center: Array, radius: Array) -> Mask:
        """Whether one of several balls may occlude a light from points: (n,).

        Blocks of points are tested with all balls, and smaller ones with those that are left. A
        block with more than `MAX_BALLS` of these counts as occluded.
        """
        order = _morton_order(sight.surface.point)
        point, reach = columns(sight.surface.point, order), sight.reach[order]
        count, bounds = order.size, sight.bounds
        kept = np.zeros(count, dtype=np.bool_)
        larger = -(-count // BLOCK_SIZES[0])
        block = np.repeat(np.arange(larger), radius.size)
        ball = np.tile(np.arange(radius.size), larger)
        for size, smaller in zip((*BLOCK_SIZES, 1), (*BLOCK_SIZES[1:], 1, 0), strict=True):
            middle, span = _block_balls(point, reach, size)
            test = partial(_balls_may_occlude, bounds, (center, radius))
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

    def _all_candidates(self, light: Emitter, sight: _LightView) -> Pairs:
        """The candidate pairs, including faces of solids that `needed` removes."""
        surface, reach = sight.surface, sight.reach
        count = reach.size
        proxies = None if (reach > 0.0).any() else self._proxies.get(_light_key(light))
        if proxies is None and count * self.radius.size <= MAX_PAIRS_WITHOUT_BLOCKS:
            return self._filter_by_point(sight, _all_pairs(count, self.radius.size))
        first = 0
        parts: list[Pairs] = []
        if proxies is not None:
            # where bounding spheres are too large, embree would return objects for most rays
            first = self._plan.shapes.proxied
            parts.append(self._filter_by_point(sight, self._near_proxies(sight, proxies)))
            to = light.to_center(surface.point)
            met = Pairs(*proxies.intersected_by(surface.point, to))
            parts.append(self._filter_by_point(sight, met))
        if self.radius.size - first <= MAX_OBJECTS_WITHOUT_BLOCKS:
            parts += self._pairs_by_object(sight, first)
        else:
            parts.append(self._filter_by_point(sight, self._pairs_by_shafts(sight, first)))
        return _merge_pairs(parts, self.radius.size)

    def _near_proxies(self, sight: _LightView, proxies: ProxyScene) -> Pairs:
        """Pairs whose point lies within the object's proxy, where embree may miss it."""
        center, outer = self.center[:, : proxies.circumradius.size], proxies.circumradius

        def near(middle: Array, span: Array, item: Ints) -> Mask:
            gap = columns(center, item) - middle
            wide = outer[item] + span
            close: Mask = dot(gap, gap) <= wide * wide
            return close

        return _pairs_by_blocks(sight, outer.size, near)

    def _pairs_by_object(self, sight: _LightView, first: int) -> list[Pairs]:
        """Candidate pairs of objects `first` and higher, each tested against all points."""
        parts = []
        count = sight.reach.size
        for begin in range(0, count, POINTS_PER_CHUNK):
            rows = slice(begin, min(begin + POINTS_PER_CHUNK, count))
            for item in range(first, self.radius.size):
                pixel = begin + self._may_occlude(sight, rows, item).nonzero()[0]
                parts.append(Pairs(pixel, np.full(pixel.size, item)))
        return parts

    def _filter_by_point(self, sight: _LightView, pairs: Pairs) -> Pairs:
        """The pairs that pass the test of single points."""
        return pairs.take(
            _passing_pairs(partial(self._may_occlude, sight), pairs.pixel, pairs.item)
        )

    def _pairs_by_shafts(self, sight: _LightView, first_item: int) -> Pairs:
        """Candidate pairs of objects `first_item` and higher, by tests of blocks of points."""
        center, radius = self.center[:, first_item:], self.radius[first_item:]
        bounds = sight.bounds

        def seen(middle: Array, span: Array, item: Ints) -> Mask:
            self._plan.raise_if_cancelled()
            return _balls_may_occlude(bounds, (center, radius), middle, span, item)

        pairs = _pairs_by_blocks(sight, radius.size, seen)
        return Pairs(pairs.pixel, pairs.item + first_item)

    def _may_occlude(self, sight: _LightView, at: Ints | slice, item: Ints | int) -> Mask:
        """Whether objects (one, or one for each point) may occlude a light from points `at`."""
        self._plan.raise_if_cancelled()
        surface, cone = sight.surface, sight.cone
        chosen = np.atleast_1d(item)
        center, radius = columns(self.center, chosen), self.radius[chosen] + sight.reach[at]
        point = columns(surface.point, at)
        if isinstance(item, int) and self._planes.planar[item]:
            apart = self._planes.part(sight, at, np.atleast_1d(item))
            if not apart.any():
                return apart
        v = center - point
        vv = dot(v, v)
        touch, _, _ = cone_overlap(
            columns(cone.axis, at), cone.cosine[at], cone.sine[at], v, radius
        )
        # drop objects beyond the light, but not those that contain the point
        limit = cone.far[at] + radius
        keep: Mask = ((vv < limit * limit) & touch) | (vv <= radius * radius)
        # an object below the point's horizon occludes only light that does not reach the surface
        # (within `reach`, the normal of a sphere of radius r turns by reach / r)
        lowest = -radius
        if sight.spread:
            lowest = lowest - sight.bend[at] * sight.reach[at] * np.sqrt(vv)
        keep &= dot(columns(surface.normal, at), v) > lowest
        keep &= sight.front(center, radius)
        if not isinstance(item, int) or self._planes.planar[item]:
            keep &= self._planes.part(sight, at, chosen)
        # a convex object does not occlude light from itself, except on its inner side
        keep &= (item != surface.item[at]) | surface.inside[at]
        return keep


@dataclass(frozen=True)
class _FacePlanes:
    """Planes of planar objects: such an object occludes only light from the plane's other side.

    Attributes
    ----------
    planar : (objects,) whether the object lies in a plane.
    normal : (3, objects) unit, 0 for other objects.  offset : (objects,) metres from the origin.
    slack : (objects,) metres that the plane moves along its normal either way during the shutter.
    solid : (objects,) the closed solid that each is a face of: normals point out of it.
    """

    planar: Mask
    normal: Array
    offset: Array
    slack: Array
    solid: Ints

    @classmethod
    def make(cls, table: ShapeTable) -> _FacePlanes:
        normal = np.zeros((3, table.count))
        offset, slack = np.zeros((2, table.count))
        for shapes, first in zip(table.sets, table.firsts[:-1], strict=True):
            faces, own = shapes.faces, slice(first, first + shapes.count)
            if faces is None:
                continue
            normal[:, own] = faces.normal
            offset[own] = dot(faces.normal, faces.vertices[0])
            if faces.displacement is not None:
                slack[own] = 0.5 * np.abs(dot(faces.normal, faces.displacement))
        return cls(table.planar, normal, offset, slack, table.solid)

    def part(self, sight: _LightView, at: Ints | slice, item: Ints) -> Mask:
        """Whether the plane of an object may separate points from some of the light."""
        bounds = sight.bounds
        light = bounds.height_over_planes(columns(self.normal, item), self.offset[item])
        place, reach = self._places(sight, at, item)
        margin = bounds.radius + self.slack[item]
        parts: Mask = (light <= margin) | (place < reach)
        parts &= (light >= -margin) | (place > -reach)
        parts |= ~self.planar[item]
        return parts

    def _places(self, sight: _LightView, at: Ints | slice, item: Ints) -> tuple[Array, Array]:
        """Signed distances (metres) of points from planes, and bounds on their changes."""
        point, offset = columns(sight.surface.point, at), self.offset[item]
        place = dot(columns(self.normal, item), point) - offset
        # a point within rounding of the plane may lie on either side of it
        return place, self.slack[item] + sight.reach[at] + surface_tolerance(point, np.abs(offset))

    def needed(self, sight: _LightView, pairs: Pairs) -> Pairs:
        """The pairs without faces of closed solids that occlude only what other faces do."""
        rows = (self.solid[pairs.item] != NO_SOLID).nonzero()[0]
        if not rows.size:
            return pairs
        at, item = pairs.pixel[rows], pairs.item[rows]
        place, reach = self._places(sight, at, item)
        solid = np.unique(at * self.solid.size + self.solid[item], return_inverse=True)[1]
        outside = np.zeros(solid.max() + 1, dtype=np.bool_)
        outside[solid[place > reach]] = True
        spare = outside[solid] & (place < -reach)
        # from the outer side of a face, all of its solid is below the horizon
        own = sight.surface.item[at]
        seen = dot(columns(sight.surface.normal, at), columns(self.normal, own)) > 0.0
        spare |= (self.solid[own] == self.solid[item]) & seen
        keep = np.ones(pairs.item.size, dtype=np.bool_)
        keep[rows[spare]] = False
        return pairs.take(keep)


@dataclass(frozen=True)
class _LightView:
    """A light and n points, with bounds that hold during the whole shutter.

    `bounds` enclose the light and its path, `cone` is the cone of directions to them from each
    point. `reach` (n,) metres and `bend` (n,) 1 / m are the extent and the curvature of
    the surfaces around the points; `spread` is whether any reach is larger than 0.
    """

    light: Emitter
    bounds: LightBounds
    cone: ViewCone
    surface: Surface
    reach: Array
    bend: Array
    spread: bool

    @classmethod
    def make(cls, light: Emitter, surface: Surface, reach: Array, bend: Array) -> _LightView:
        bounds = light.swept_bounds()
        cone = bounds.view_cone(bounds.to_center(surface.point))
        return cls(light, bounds, cone, surface, reach, bend, bool((reach > 0.0).any()))

    def take(self, rows: Ints) -> _LightView:
        """The view from some of the points."""
        cone = ViewCone(
            *(columns(each, rows, -1) for each in (
                self.cone.axis, self.cone.distance, self.cone.cosine, self.cone.sine,
                self.cone.near, self.cone.far,
            ))
        )  # fmt: skip
        return replace(
            self,
            cone=cone,
            surface=self.surface.take(rows),
            reach=self.reach[rows],
            bend=self.bend[rows],
        )

    def front(self, center: Array, radius: Array) -> Mask | np.bool_:
        """Whether spheres reach before a light that emits to one side."""
        behind = self.light.is_behind(self.light.to_center(center), radius, path=True)
        return np.logical_not(behind)


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


def _balls_may_occlude(
    bounds: LightBounds, balls: tuple[Array, Array], middle: Array, span: Array, number: Ints
) -> Mask:
    """Whether balls (k,), by number, may occlude a light from blocks of points (k,)."""
    cone = bounds.view_cone(bounds.to_center(middle))
    v, wide = columns(balls[0], number) - middle, balls[1][number] + span
    touch, _, _ = cone_overlap(cone.axis, cone.cosine, cone.sine, v, wide)
    vv = dot(v, v)
    before: Mask = (vv <= wide * wide) | (touch & (np.sqrt(vv) - wide < cone.far))
    return before


def _pairs_by_blocks(sight: _LightView, objects: int, test: BallTest) -> Pairs:
    """Pairs of points and objects whose blocks of points pass a test at every level.

    Parameters
    ----------
    test : takes centres (3, k) and radii (k,) of blocks' bounding balls and objects (k,), metres,
        and returns (k,) bool.
    """
    order = _morton_order(sight.surface.point)
    point, reach = columns(sight.surface.point, order), sight.reach[order]
    count = order.size
    larger = -(-count // BLOCK_SIZES[0])
    block, item = np.repeat(np.arange(larger), objects), np.tile(np.arange(objects), larger)
    for level, (size, smaller) in enumerate(zip(BLOCK_SIZES, (*BLOCK_SIZES[1:], 1), strict=True)):
        with progress_range(level / LEVEL_COUNT, (level + 1) / LEVEL_COUNT):
            kept = _passing_pairs(
                partial(_test_blocks, test, *_block_balls(point, reach, size)), block, item
            )
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


def _block_balls(point: Array, reach: Array, size: int) -> tuple[Array, Array]:
    """Centres (3, b) and radii (b,) of balls around blocks of `size` points and their reach."""
    starts = np.arange(0, reach.size, size)
    low = np.minimum.reduceat(point, starts, axis=1)
    high = np.maximum.reduceat(point, starts, axis=1)
    span = 0.5 * np.sqrt(dot(high - low, high - low)) + np.maximum.reduceat(reach, starts)
    return 0.5 * (low + high), span


def _morton_order(point: Array) -> Ints:
    """Indices (n,) that sort points (3, n) along the Morton curve (Morton 1966)."""
    low = point.min(axis=1, keepdims=True)
    size = float((point.max(axis=1, keepdims=True) - low).max()) or 1.0
    cell = ((point - low) * (MORTON_CELLS / size)).astype(np.int64)
    cell = np.minimum(cell, MORTON_CELLS - 1)
    key = np.zeros(point.shape[1], dtype=np.int64)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            key |= ((cell[axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(key, kind="stable")


def _merge_pairs(parts: list[Pairs], objects: int) -> Pairs:
    """The union of lists of pairs, each pair once, sorted by point and then by object."""
    pixel = np.concatenate([part.pixel for part in parts])
    key = pixel * objects + np.concatenate([part.item for part in parts])
    return Pairs(*np.divmod(np.unique(key), objects))


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
    return _without_coplanar_faces(light, pairs.take(~own | surface.inside[pairs.pixel]))


def _without_coplanar_faces(light: Emitter, pairs: Pairs) -> Pairs:
    """The pairs without planar objects in the plane of the light: they occlude nothing of it."""
    return pairs if light.coplanar is None else pairs.take(~light.is_coplanar(pairs.item))


def _all_pairs(points: int, objects: int) -> Pairs:
    """All pairs of points and objects, sorted by point and then by object."""
    pair = np.arange(points * objects)
    return Pairs(*np.divmod(pair, objects))


def _light_key(light: Emitter) -> str:
    return light.name + repr(light.center.tolist())
