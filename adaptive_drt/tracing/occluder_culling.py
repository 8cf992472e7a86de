# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects may come between surface points and a light, during the whole shutter.

Conservative candidates: an object is dropped only where a bounding test proves that it matters
for no point of the light at no time. Blocks of neighbouring points are tested as one first
(shaft culling, Haines and Wallace 1991); with very many objects embree does that part.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np

from ..geometry.closed_boxes import NO_SOLID, outward
from ..geometry.sphere import cone_touch, graze_of
from ..lights.emitter import QUAD, Cone, Emitter, view_cone
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from ..parallel.call_progress import part_of_call, tell
from .compile import Plan
from .embree import ProxyScene
from .intersect import Pairs, Surface, curvature, in_cache, runs

__all__ = ["Occluders", "every_pair"]

Test: TypeAlias = Callable[[Array, Array, Ints], Mask]

BLOCKS = (256, 32, 8)
"""Points that share one culling test, neighbours along a curve that fills space."""
LEVELS = len(BLOCKS) + 1
"""Of tests: those and the points themselves, which take alike."""
CURVE_BITS = 10
CURVE_CELLS = 1 << CURVE_BITS
"""Cells on a side of that curve."""
FEW_PAIRS = 6_144
"""Up to so many pairs of points and objects all are tested at once: the calls count, not the pairs
(7 objects: 30 points in 0.3 of the time, 1,000 in 0.9; 33 objects: 30 in 0.3, 150 in 0.6)."""
DENSE_OBJECTS = 16
"""Up to so many objects each is tested against all points: 15 ns a pair, where gathering the points
of pairs costs 80 (48 took a fifth longer: all at once)."""
CACHED = 1 << 16
"""Points at a time in such a test. 8,192 stay in the cache and are a tenth faster on one thread,
but two threads then wait for each other at every call: a fifth slower (300 x 300)."""


class Occluders:
    """Bounding spheres of all objects over the shutter, ready to be asked for candidates."""

    def __init__(self, plan: Plan) -> None:
        """Prepare the bounds, and embree's proxies where the plan wants them."""
        self._plan = plan
        center, radius = plan.quads.bounds
        self.center = np.concatenate([plan.spheres.center, center], axis=1)
        radius = np.concatenate([plan.spheres.radius, radius])
        for part, first in ((plan.spheres, 0), (plan.quads, plan.sphere_count)):
            d = part.displacement
            if d is not None:
                radius[first : first + d.shape[1]] += 0.5 * np.sqrt(dot(d, d))
        self.radius = radius
        self._flats = _Flats.make(plan)
        self._proxies: dict[str, ProxyScene] = {}
        balls = plan.sphere_count
        for light in plan.lights:
            if plan.embree_finds(light):
                reach = plan.shadow_light(light).ball
                self._proxies[_key(light)] = ProxyScene(
                    self.center[:, :balls], self.radius[:balls] + reach
                )

    def __reduce__(self) -> tuple[type[Occluders], tuple[Plan]]:
        """For another process: embree's proxies are built anew."""
        return Occluders, (self._plan,)

    def find(self, light: Emitter, surface: Surface, reach: Array | float = 0.0) -> Pairs:
        """Candidate pairs (point, object) for a light, sorted by point.

        Parameters
        ----------
        light : as it casts shadows.
        surface : n points.
        reach : (n,) metres; the candidates also serve all points within it of each point.
        """
        count = surface.item.size
        none = np.zeros(0, dtype=np.int64)
        if not count or not self.radius.size or not light.casts_shadow:
            return Pairs(none, none)
        reach = np.broadcast_to(np.asarray(reach, dtype=np.float64), (count,))
        sight = _Sight.make(light, surface, reach, curvature(self._plan, surface))
        pairs = self._flats.needed(sight, self._found(light, sight))
        return _apart(light, pairs)

    def _found(self, light: Emitter, sight: _Sight) -> Pairs:
        """The pairs, whatever else hides the same."""
        surface, reach = sight.surface, sight.reach
        count = reach.size
        proxies = None if (reach > 0.0).any() else self._proxies.get(_key(light))
        if proxies is None and count * self.radius.size <= FEW_PAIRS:
            return self._kept(sight, _all_pairs(count, self.radius.size))
        first = 0
        parts: list[Pairs] = []
        if proxies is not None:
            # quads have wide bounding spheres: embree would find them everywhere
            first = self._plan.sphere_count
            parts.append(self._kept(sight, self._around(sight, proxies)))
            met = Pairs(*proxies.along(surface.point, light.center))
            parts.append(self._kept(sight, met))
        if self.radius.size - first <= DENSE_OBJECTS:
            parts += self._one_by_one(sight, first)
        else:
            parts.append(self._kept(sight, self._shafts(sight, first)))
        return _sorted(parts, self.radius.size)

    def _around(self, sight: _Sight, proxies: ProxyScene) -> Pairs:
        """Pairs whose point lies within the object's proxy, or in one block with such a point."""
        center, outer = self.center[:, : proxies.outer.size], proxies.outer

        def near(middle: Array, span: Array, item: Ints) -> Mask:
            gap = columns(center, item) - middle
            wide = outer[item] + span
            close: Mask = dot(gap, gap) <= wide * wide
            return close

        return _by_blocks(sight, outer.size, near)

    def _one_by_one(self, sight: _Sight, first: int) -> list[Pairs]:
        """Candidates from object `first` on, each tested against all points: no gathering."""
        parts = []
        count = sight.reach.size
        for begin in range(0, count, CACHED):
            rows = slice(begin, min(begin + CACHED, count))
            for item in range(first, self.radius.size):
                pixel = begin + self._matters(sight, rows, item).nonzero()[0]
                parts.append(Pairs(pixel, np.full(pixel.size, item)))
        return parts

    def _kept(self, sight: _Sight, pairs: Pairs) -> Pairs:
        """The pairs that stay when each point is tested by itself."""
        return pairs.take(_where(partial(self._matters, sight), pairs.pixel, pairs.item))

    def _shafts(self, sight: _Sight, first_item: int) -> Pairs:
        """Candidates from object `first_item` on, of blocks of points, spread to their points."""
        center, radius, ball = self.center[:, first_item:], self.radius[first_item:], sight.ball

        def seen(middle: Array, span: Array, item: Ints) -> Mask:
            self._plan.go_on()
            cone = view_cone(ball, ball.center, middle)
            v, wide = columns(center, item) - middle, radius[item] + span
            touch, _, _ = cone_touch(cone.axis, cone.cosine, cone.sine, v, wide)
            vv = dot(v, v)
            before: Mask = (vv <= wide * wide) | (touch & (np.sqrt(vv) - wide < cone.far))
            return before

        pairs = _by_blocks(sight, radius.size, seen)
        return Pairs(pairs.pixel, pairs.item + first_item)

    def _matters(self, sight: _Sight, at: Ints | slice, item: Ints | int) -> Mask:
        """Whether objects may hide light that counts from points `at`: one object, or one each."""
        self._plan.go_on()
        surface, cone = sight.surface, sight.cone
        chosen = np.atleast_1d(item)
        center, radius = columns(self.center, chosen), self.radius[chosen] + sight.reach[at]
        point = columns(surface.point, at)
        if isinstance(item, int) and item >= self._flats.first:
            apart = self._flats.part(sight, at, np.atleast_1d(item))
            if not apart.any():
                return apart
        v = center - point
        vv = dot(v, v)
        touch, _, _ = cone_touch(columns(cone.axis, at), cone.cosine[at], cone.sine[at], v, radius)
        # beyond the light; an object around the point is in front in any case
        limit = cone.far[at] + radius
        keep: Mask = ((vv < limit * limit) & touch) | (vv <= radius * radius)
        # what lies below the point's horizon hides only light that does not count
        # (a sphere's normal turns by reach / r within reach)
        lowest = -radius
        if sight.spread:
            lowest = lowest - sight.bend[at] * sight.reach[at] * np.sqrt(vv)
        keep &= dot(columns(surface.normal, at), v) > lowest
        keep &= sight.front(center, radius)
        if not isinstance(item, int) or item >= self._flats.first:
            keep &= self._flats.part(sight, at, chosen)
        # an object does not shadow itself but for the inner side of a sphere
        keep &= (item != surface.item[at]) | surface.inside[at]
        return keep


@dataclass(frozen=True)
class _Flats:
    """Planes of quads among all objects: they hide a light only from beyond.

    Attributes
    ----------
    first : number of the first quad.
    normal : (3, objects) unit, 0 for spheres.  offset : (objects,) metres from the origin.
    slack : (objects,) metres that the plane shifts either way during the shutter.
    solid : (objects,) the box that each is a face of: their normals point out of it.
    """

    first: int
    normal: Array
    offset: Array
    slack: Array
    solid: Ints

    @classmethod
    def make(cls, plan: Plan) -> _Flats:
        quads, first = plan.quads, plan.sphere_count
        normal = np.zeros((3, plan.object_count))
        across = cross(quads.edge_u, quads.edge_v) * outward(quads, plan.solid)
        normal[:, first:] = across / np.maximum(np.sqrt(dot(across, across)), TINY)
        offset, slack = np.zeros((2, plan.object_count))
        offset[first:] = dot(normal[:, first:], quads.corner)
        if quads.displacement is not None:
            slack[first:] = 0.5 * np.abs(dot(normal[:, first:], quads.displacement))
        solid = np.concatenate([np.full(first, NO_SOLID), plan.solid])
        return cls(first, normal, offset, slack, solid)

    def part(self, sight: _Sight, at: Ints | slice, item: Ints) -> Mask:
        """Whether a quad's plane may come between points and some of the light."""
        ball = sight.ball
        light = dot(columns(self.normal, item), ball.center) - self.offset[item]
        place, reach = self._places(sight, at, item)
        margin = ball.radius + self.slack[item]
        parts: Mask = (light <= margin) | (place < reach)
        parts &= (light >= -margin) | (place > -reach)
        parts |= item < self.first
        return parts

    def _places(self, sight: _Sight, at: Ints | slice, item: Ints) -> tuple[Array, Array]:
        """How far before planes points are, and how far they and the planes reach: metres."""
        point, offset = columns(sight.surface.point, at), self.offset[item]
        place = dot(columns(self.normal, item), point) - offset
        # points as near to the plane as rounding leaves open may lie on either side
        return place, self.slack[item] + sight.reach[at] + graze_of(point, np.abs(offset))

    def needed(self, sight: _Sight, pairs: Pairs) -> Pairs:
        """The pairs without faces of boxes that hide only what others of the same box do."""
        rows = (self.solid[pairs.item] != NO_SOLID).nonzero()[0]
        if not rows.size:
            return pairs
        at, item = pairs.pixel[rows], pairs.item[rows]
        place, reach = self._places(sight, at, item)
        box = np.unique(at * self.solid.size + self.solid[item], return_inverse=True)[1]
        outside = np.zeros(box.max() + 1, dtype=np.bool_)
        outside[box[place > reach]] = True
        spare = outside[box] & (place < -reach)
        # on a face, seen from outside, all of the box is behind it
        own = sight.surface.item[at]
        seen = dot(columns(sight.surface.normal, at), columns(self.normal, own)) > 0.0
        spare |= (self.solid[own] == self.solid[item]) & seen
        keep = np.ones(pairs.item.size, dtype=np.bool_)
        keep[rows[spare]] = False
        return pairs.take(keep)


@dataclass(frozen=True)
class _Sight:
    """A light from n points, during the whole shutter.

    `ball` holds the light and its path, `cone` is how it is seen; `reach` (n,) and `bend` (n,) are
    the extent and the curvature of the surfaces around the points; `spread`: any reach at all.
    """

    light: Emitter
    ball: Emitter
    cone: Cone
    surface: Surface
    reach: Array
    bend: Array
    spread: bool

    @classmethod
    def make(cls, light: Emitter, surface: Surface, reach: Array, bend: Array) -> _Sight:
        ball = _swept(light)
        cone = view_cone(ball, ball.center, surface.point)
        return cls(light, ball, cone, surface, reach, bend, bool((reach > 0.0).any()))

    def front(self, center: Array, radius: Array) -> Mask | bool:
        """A quad light emits to its front: what lies behind its plane is never between."""
        light = self.light
        if light.kind != QUAD:
            return True
        drift = 0.0
        if light.displacement is not None:
            drift = 0.5 * float(np.abs(dot(light.normal, light.displacement))[0])
        front: Mask = dot(light.normal, center - light.center) > -(radius + drift)
        return front


def _by_blocks(sight: _Sight, objects: int, test: Test) -> Pairs:
    """Pairs of points and objects that tests of blocks of points let through.

    Parameters
    ----------
    test : from middles (3, k) and radii (k,) of balls around blocks and objects (k,) to (k,) bool.
    """
    order = _along_curve(sight.surface.point)
    point, reach = columns(sight.surface.point, order), sight.reach[order]
    count = order.size
    larger = -(-count // BLOCKS[0])
    block, item = np.repeat(np.arange(larger), objects), np.tile(np.arange(objects), larger)
    for level, (size, smaller) in enumerate(zip(BLOCKS, (*BLOCKS[1:], 1), strict=True)):
        with part_of_call(level / LEVELS, (level + 1) / LEVELS):
            kept = _where(partial(_of_balls, test, *_balls(point, reach, size)), block, item)
        first = block[kept] * (size // smaller)
        inside = np.minimum(first + size // smaller, -(-count // smaller)) - first
        block = runs(first, inside)
        item = np.repeat(item[kept], inside)
    return Pairs(order[block], item)


def _of_balls(test: Test, middle: Array, span: Array, block: Ints, item: Ints) -> Mask:
    return test(columns(middle, block), span[block], item)


def _where(test: Callable[[Ints, Ints], Mask], number: Ints, item: Ints) -> Ints:
    """Which pairs (k,) of points or blocks and objects a test lets through, in order."""
    kept = [np.zeros(0, dtype=np.int64)]
    for rows in in_cache(np.arange(item.size)):
        tell(rows[0] / item.size)
        kept.append(rows[test(number[rows], item[rows])])
    return np.concatenate(kept)


def _balls(point: Array, reach: Array, size: int) -> tuple[Array, Array]:
    """Middles (3, b) and radii (b,) of balls around blocks of so many points and their reach."""
    starts = np.arange(0, reach.size, size)
    low = np.minimum.reduceat(point, starts, axis=1)
    high = np.maximum.reduceat(point, starts, axis=1)
    span = 0.5 * np.sqrt(dot(high - low, high - low)) + np.maximum.reduceat(reach, starts)
    return 0.5 * (low + high), span


def _along_curve(point: Array) -> Ints:
    """An order (n,) of points (3, n) in which neighbours lie near each other (Morton 1966)."""
    low = point.min(axis=1, keepdims=True)
    size = float((point.max(axis=1, keepdims=True) - low).max()) or 1.0
    cell = ((point - low) * (CURVE_CELLS / size)).astype(np.int64)
    cell = np.minimum(cell, CURVE_CELLS - 1)
    key = np.zeros(point.shape[1], dtype=np.int64)
    for bit in range(CURVE_BITS):
        for axis in range(3):
            key |= ((cell[axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(key, kind="stable")


def _sorted(parts: list[Pairs], objects: int) -> Pairs:
    """Pairs of several lists, each once, by point and then by object."""
    pixel = np.concatenate([part.pixel for part in parts])
    key = pixel * objects + np.concatenate([part.item for part in parts])
    return Pairs(*np.divmod(np.unique(key), objects))


def every_pair(plan: Plan, light: Emitter, surface: Surface) -> Pairs:
    """All pairs of points and objects, but a point's own object and what lies in the light's
    plane: what a plain tracer tests."""
    pairs = _all_pairs(surface.item.size, plan.object_count)
    own = pairs.item == surface.item[pairs.pixel]
    return _apart(light, pairs.take(~own | surface.inside[pairs.pixel]))


def _apart(light: Emitter, pairs: Pairs) -> Pairs:
    """The pairs without quads in the plane of the light: they hide nothing of it."""
    return pairs if light.touching is None else pairs.take(~light.touches(pairs.item))


def _all_pairs(points: int, objects: int) -> Pairs:
    """All pairs of points and objects, by point and then by object."""
    pair = np.arange(points * objects)
    return Pairs(*np.divmod(pair, objects))


def _swept(light: Emitter) -> Emitter:
    """A spherical light around a light and its path."""
    return replace(light, kind="BALL", radius=light.ball)


def _key(light: Emitter) -> str:
    return light.name + repr(light.center.tolist())
