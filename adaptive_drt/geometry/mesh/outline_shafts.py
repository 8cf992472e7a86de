# SPDX-License-Identifier: GPL-3.0-or-later
"""Do outlines of a mesh reach the shafts from patches of surface to a light?

The shaft is the convex hull of a ball around a patch and one around the light (Haines and Wallace
1991). From all points of a patch, the number of faces before each point of the light is the same if
no outline reaches its shaft. A segment from the patch to the light meets an edge only if the planes
of both faces lie between its ends. So an edge of two faces, oriented alike, is an outline for a
segment only if the light is on different sides of the faces, as the patch is: edges that are no
outlines as seen from the light are left out from the first.

Edges are kept in a hierarchy of clusters along the Morton curve, with enclosing balls. Both the
distance from a convex shaft and its bisection along an edge are conservative.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.morton import morton_order
from ...numerics.vector import cross, dot, normalize
from ..light_protocol import LightBall
from .outline_edges import SIDE_MARGIN, OutlineEdges, sure_sides

__all__ = ["OutlineShafts", "ReachedBlocks", "Shafts"]

Pairs: TypeAlias = tuple[Ints, Ints]
"""Numbers of two kinds."""

FANOUT = 16
"""Number of edges of the smallest clusters, and of clusters of each larger one."""
BLOCK_SIZES, LEVELS_OF_BLOCKS = (256, 32, 8), (1, 0, 0)
"""Numbers of patches, consecutive along the Morton curve, that share one shaft at each step, and
the levels of clusters that are tested against it last."""
MOST_AT_ONCE = 16
"""Largest number of clusters of a shaft that are tested before it may count as reached."""
PAIRS_PER_CHUNK = 1 << 15
"""Number of pairs of shafts and edges or clusters in one batch of work: it stays in the cache."""
MANY_CLUSTERS = 16
"""Number of clusters near a block from which outlines reach nearly all shafts that see nothing of
the light (a ball with bumps: 85 %)."""
BISECTIONS = 14
"""Largest number of bisections of an edge; one that then still may reach a shaft counts as reaching
it."""
ANGLE_MARGIN = 1e-9
"""Rounding error of angles between directions, in radians, with a margin."""
CORNERS = ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0))
"""Corners of a flat light, in its own coordinates."""
SHAFT_MARGIN = 1e-9
"""Width, relative to the lengths involved, by which shafts are widened against rounding."""


@dataclass(frozen=True)
class Shafts:
    """Shafts from n patches of surface to a light.

    Attributes
    ----------
    point : (3, n) metres, the middles of the balls that hold the patches.  span : (n,) their radii.
    to : (3, n) metres, from there to the light's centre.
    light : at rest.
    sides : two of (3, n) metres: of patches that lie in parallelograms, from their middles to those
        of the sides; 0 for other patches. None if there are none.
    """

    point: Array
    span: Array
    to: Array
    light: LightBall
    sides: tuple[Array, Array] | None = None

    @classmethod
    def make(
        cls,
        point: Array,
        span: Array,
        light: LightBall,
        sides: tuple[Array, Array] | None = None,
    ) -> Shafts:
        """The shafts from patches to a light at rest."""
        to = light.to_center(point)
        wide = span + SHAFT_MARGIN * np.sqrt(dot(point, point))
        return cls(point, wide, to, light, sides)

    def take(self, rows: Ints) -> Shafts:
        """Some of the shafts."""
        sides = self.sides
        if sides is not None:
            sides = columns(sides[0], rows), columns(sides[1], rows)
        return Shafts(
            columns(self.point, rows), self.span[rows], columns(self.to, rows), self.light, sides
        )

    def joined(self, size: int) -> Shafts:
        """Shafts that enclose those of `size` consecutive patches each."""
        first = np.arange(0, self.span.size, size)
        low = np.minimum.reduceat(self.point - self.span, first, axis=1)
        high = np.maximum.reduceat(self.point + self.span, first, axis=1)
        middle, gap = 0.5 * (low + high), high - low
        return Shafts.make(middle, 0.5 * np.sqrt(dot(gap, gap)), self.light)

    def distances_of_balls(self, at: Ints, center: Array, radius: Array) -> Array:
        """Bounds (k,) on the distances of balls, (3, k) and (k,), from the shafts `at` (k,), above
        0 only where they do not meet."""
        distance = self._distances(at, center)[0]
        distance -= radius
        rows = (distance <= 0.0).nonzero()[0]
        center, radius = columns(center, rows), radius[rows]
        for normal, height in self._side_planes:
            beyond = dot(columns(normal, at[rows]), center) - height[at[rows]] - radius
            distance[rows] = np.maximum(distance[rows], beyond)
        return distance

    def may_meet_segments(self, at: Ints, start: Array, end: Array) -> Mask:
        """Whether segments (3, k) may meet the shafts `at` (k,).

        The distance from a shaft is a convex function along a segment: its slope tells in which
        half its minimum lies, and the distance at a middle less half the length is below it.
        """
        may = np.zeros(at.size, dtype=np.bool_)
        rows = np.arange(at.size)
        for normal, height in self._side_planes:
            some = columns(normal, at[rows])
            lowest = np.minimum(dot(some, columns(start, rows)), dot(some, columns(end, rows)))
            rows = rows[lowest <= height[at[rows]]]
        if rows.size:
            between = self._between_planes(at[rows], columns(start, rows), columns(end, rows))
            rows = rows[between]
        start, end = columns(start, rows), columns(end, rows)
        for _ in range(BISECTIONS):
            if not rows.size:
                return may
            middle, way = 0.5 * (start + end), 0.5 * (end - start)
            distance, foot = self._distances(at[rows], middle)
            apart = distance > np.sqrt(dot(way, way)) * (1.0 + SHAFT_MARGIN)
            may[rows[distance <= 0.0]] = True
            left = (~apart & (distance > 0.0)).nonzero()[0]
            rows, middle, way = rows[left], columns(middle, left), columns(way, left)
            slope = self._slopes(at[rows], middle, way, foot[left])
            start = np.where(slope > 0.0, columns(start, left), middle)
            end = np.where(slope > 0.0, middle, columns(end, left))
        may[rows] = True
        return may

    @cached_property
    def _frames(self) -> tuple[Array, Array, Array, Array]:
        """Unit vectors (3, n) to the light's centre, distances (n,) of it, and sines and cosines
        (n,) of the angles by which the shafts widen."""
        length = np.maximum(np.sqrt(dot(self.to, self.to)), TINY)
        sine = np.clip((float(self.light.radius) - self.span) / length, -1.0, 1.0)
        return self.to / length, length, sine, np.sqrt((1.0 - sine) * (1.0 + sine))

    def _distances(self, at: Ints, place: Array) -> tuple[Array, Array]:
        """Distances (k,) of points (3, k) from the shafts `at` (k,), below 0 within these.

        Returns with them where along the shafts they are taken: below 0 from the patch's ball,
        above 1 from the light's.
        """
        axis, length, sine, cosine = self._frames
        v = place - columns(self.point, at)
        along = dot(columns(axis, at), v)
        off = np.sqrt(np.maximum(dot(v, v) - along * along, 0.0))
        sine, cosine, span = sine[at], cosine[at], self.span[at]
        distance = off * cosine
        distance -= along * sine
        distance -= span
        foot = along * cosine
        foot += off * sine
        with np.errstate(over="ignore"):
            # beyond either end where the patch's ball holds the light, or nearly so
            foot /= np.maximum(length[at] * cosine, TINY)
        rows = (foot < 0.0).nonzero()[0]
        distance[rows] = np.sqrt(dot(v[:, rows], v[:, rows])) - span[rows]
        rows = (foot > 1.0).nonzero()[0]
        gap = v[:, rows] - columns(self.to, at[rows])
        distance[rows] = np.sqrt(dot(gap, gap)) - float(self.light.radius)
        return distance, foot

    def _slopes(self, at: Ints, place: Array, way: Array, foot: Array) -> Array:
        """Slopes (k,) of the distances of points (3, k) that move along vectors (3, k)."""
        axis, _, sine, cosine = self._frames
        axis, v = columns(axis, at), place - columns(self.point, at)
        along = dot(axis, v)
        aside = v - along * axis
        out = aside / np.maximum(np.sqrt(dot(aside, aside)), TINY)
        slope = dot(out, way) * cosine[at] - dot(axis, way) * sine[at]
        slope = np.where(foot < 0.0, dot(v, way), slope)
        found: Array = np.where(foot > 1.0, dot(v - columns(self.to, at), way), slope)
        return found

    def _between_planes(self, at: Ints, start: Array, end: Array) -> Mask:
        """Whether no plane through a segment (3, k) has a patch and the light on one side: (k,).

        Seen along the segment, there is one if the directions to both lie within a half turn.
        """
        along = normalize(end - start)
        to = columns(self.point, at) - start
        center = to + columns(self.to, at)
        ahead = to - dot(to, along) * along
        far = np.sqrt(dot(ahead, ahead))
        first = ahead / np.maximum(far, TINY)
        second = cross(along, first)
        low, high = self._angles_of_patches(at, to, far, (first, second))
        light = self.light.span
        if light is None:
            x, y = dot(center, first), dot(center, second)
            angle, half = np.arctan2(y, x), _half_angles(float(self.light.radius), np.hypot(x, y))
            low, high = np.minimum(low, angle - half), np.maximum(high, angle + half)
        else:
            for a, b in CORNERS:
                way = center + a * light.half_u + b * light.half_v
                angle = np.arctan2(dot(way, second), dot(way, first))
                low, high = np.minimum(low, angle), np.maximum(high, angle)
        between: Mask = high - low >= np.pi - ANGLE_MARGIN
        return between

    def _angles_of_patches(
        self, at: Ints, to: Array, far: Array, axes: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """Ranges (k,) of the angles at which patches are seen along segments.

        to : (3, k) to the middles of the patches, at distances `far` (k,) along the first axis.
        """
        high = _half_angles(self.span[at], far)
        low = -high
        if self.sides is None:
            return low, high
        u, v = (columns(side, at) for side in self.sides)
        flat = (u != 0.0).any(axis=0).nonzero()[0]
        if flat.size:
            u, v, to = columns(u, flat), columns(v, flat), columns(to, flat)
            first, second = (columns(axis, flat) for axis in axes)
            angles = []
            for a, b in CORNERS:
                way = to + a * u + b * v
                angles.append(np.arctan2(dot(way, second), dot(way, first)))
            low[flat], high[flat] = np.minimum.reduce(angles), np.maximum.reduce(angles)
        return low, high

    @cached_property
    def _side_planes(self) -> list[tuple[Array, Array]]:
        """Normals (3, n) and offsets (n,) of planes through the sides of a flat light that touch
        the patches' balls: the shafts lie below them."""
        span = self.light.span
        if span is None:
            return []
        found = []
        for side, way in ((span.half_u, span.half_v), (span.half_v, span.half_u)):
            along = normalize(side)
            for sign in (-1.0, 1.0):
                to = self.to + sign * way
                to = to - dot(along, to) * along
                far = np.sqrt(dot(to, to))
                first = to / np.maximum(far, TINY)
                second = cross(np.broadcast_to(along, first.shape), first)
                sine = np.minimum(self.span / np.maximum(far, TINY), 1.0)
                turn = np.where(sign * dot(second, way) < 0.0, -1.0, 1.0)
                normal = sine * first + turn * np.sqrt(1.0 - sine * sine) * second
                height = dot(normal, self.point) + self.span
                # none where the ball reaches the line of the side
                height = np.where(far > self.span, height * (1.0 + SHAFT_MARGIN), np.inf)
                found.append((normal, height))
        return found


@dataclass(frozen=True)
class ReachedBlocks:
    """Blocks of n shafts, neighbours along the Morton curve, and clusters of edges near them.

    Attributes
    ----------
    order : (n,) the shafts, block after block.
    first : (blocks + 1,) the first cluster of each block, and the end of the last one's.
    cluster : (k,) clusters near the blocks, block after block.
    reached : (blocks,) whether outlines may reach a block's shaft.
    """

    order: Ints
    first: Ints
    cluster: Ints
    reached: Mask

    @property
    def within(self) -> Mask:
        """Which shafts (n,) lie in blocks that outlines may reach."""
        found = np.zeros(self.order.size, dtype=np.bool_)
        found[self.order] = np.repeat(self.reached, BLOCK_SIZES[-1])[: found.size]
        return found

    @property
    def crowded(self) -> Mask:
        """Which shafts (n,) lie in blocks near many clusters."""
        found = np.zeros(self.order.size, dtype=np.bool_)
        many = np.diff(self.first) > MANY_CLUSTERS
        found[self.order] = np.repeat(many, BLOCK_SIZES[-1])[: found.size]
        return found


@dataclass(frozen=True)
class OutlineShafts:
    """The m edges of a mesh at rest that may be outlines as seen from some point of a light.

    Attributes
    ----------
    start, end : (3, m) metres, the ends of the edges.
    planes : two of (4, m), of the faces that meet in each edge: normal and offset, with
        normal.x = offset.
    sides : two of (m,): on which side of these all of the light lies, 1 or -1; 0 where that is not
        sure.
    open : (m,) whether an edge is an outline from wherever it is seen, such as a border.
    levels : centres (3, c) and radii (c,) of balls that enclose clusters, the smallest first.
    touches_light : whether a face may reach the light: then nothing is sure.
    """

    start: Array
    end: Array
    planes: tuple[Array, Array]
    sides: tuple[Array, Array]
    open: Mask
    levels: tuple[tuple[Array, Array], ...]
    touches_light: bool

    @classmethod
    def make(
        cls, edges: OutlineEdges, corners: tuple[Array, Array, Array], light: LightBall
    ) -> OutlineShafts:
        """The edges that may be outlines before a light at rest.

        corners : three of (3, f) metres, of all faces of the mesh.
        """
        shape = edges.start.shape[1:]
        sides = [_sides_of_light(light, plane.reshape(4, -1)) for plane in edges.planes]
        kept = edges.before((sides[0].reshape(shape), sides[1].reshape(shape)))
        rows = (kept.turn != 0.0).any(axis=0).ravel().nonzero()[0]
        start, end = (columns(each.reshape(3, -1), rows) for each in (kept.start, kept.end))
        one, other = (columns(plane.reshape(4, -1), rows) for plane in kept.planes)
        turn = columns(kept.turn.reshape(2, -1), rows)
        # an edge's missing second face counts as its first
        planes = one, np.where(turn[1] != 0.0, other, one)
        sides = [_sides_of_light(light, plane) for plane in planes]
        return cls(
            start, end, planes, (sides[0], sides[1]), turn[0] + turn[1] != 0.0,
            _levels(start, end), _touches(light, corners),
        )  # fmt: skip

    @property
    def count(self) -> int:
        """Number of edges."""
        return int(self.open.size)

    def reached_blocks(self, shafts: Shafts) -> ReachedBlocks:
        """Blocks of shafts that outlines may reach.

        Larger clusters are tested against shafts from larger blocks first.
        """
        order = morton_order(shafts.point)
        inner = shafts.take(order)
        top = len(self.levels) - 1
        count = self.levels[top][1].size
        block, cluster = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        for number, size in enumerate(BLOCK_SIZES):
            joined = inner.joined(size)
            if not number:
                block = np.repeat(np.arange(joined.span.size), count)
                cluster = np.tile(np.arange(count), joined.span.size)
            else:
                ratio = BLOCK_SIZES[number - 1] // size
                block, cluster = _parts(block, ratio, joined.span.size, cluster)
            kept, distance = self._reaching(top, cluster, joined, block)
            block, cluster = block[kept], cluster[kept]
            while top > LEVELS_OF_BLOCKS[number]:
                top -= 1
                cluster, block = _parts(cluster, FANOUT, self.levels[top][1].size, block)
                kept, distance = self._reaching(top, cluster, joined, block)
                block, cluster = block[kept], cluster[kept]
        # those that lie deepest in a shaft come first
        sort = np.lexsort((distance, block))
        first = np.searchsorted(block[sort], np.arange(joined.span.size + 1))
        every, cluster = np.arange(joined.span.size), cluster[sort]
        reached = self._reached(joined, every, cluster, (first[:-1], first[1:]))
        return ReachedBlocks(order, first, cluster, reached)

    def reached(self, shafts: Shafts, blocks: ReachedBlocks, wanted: Mask) -> Mask:
        """Whether outlines may reach those of the shafts of blocks (n,) that are wanted: (n,)."""
        place = (wanted & blocks.within)[blocks.order].nonzero()[0]
        block, row = place // BLOCK_SIZES[-1], blocks.order[place]
        ends = blocks.first[block], blocks.first[block + 1]
        return self._reached(shafts, row, blocks.cluster, ends)

    def _reached(self, shafts: Shafts, row: Ints, clusters: Ints, ends: tuple[Ints, Ints]) -> Mask:
        """Whether edges of clusters reach some of n shafts: (n,).

        row : (k,) the shafts.  ends : (k,) where the clusters before each begin and end.
        """
        found = np.zeros(shafts.span.size, dtype=np.bool_)
        # few clusters of each shaft at a time: most shafts are reached by one of the first
        (low, high), number = ends, 1
        row, low, high = (each[low < high] for each in (row, low, high))
        while row.size:
            each = low[:, None] + np.arange(number)
            real = (each < high[:, None]).ravel().nonzero()[0]
            at, cluster = row.repeat(number)[real], clusters[each.ravel()[real]]
            self._mark(shafts, at, cluster, found)
            low = low + number
            left = ((low < high) & ~found[row]).nonzero()[0]
            row, low, high = row[left], low[left], high[left]
            number = min(2 * number, MOST_AT_ONCE)
        return found

    def _reaching(self, level: int, cluster: Ints, shafts: Shafts, own: Ints) -> tuple[Ints, Array]:
        """Indices of the pairs (k,) of clusters of a level and of shafts that may meet, and the
        distances of these."""
        center, radius = self.levels[level]
        kept, found = [np.zeros(0, dtype=np.int64)], [np.zeros(0)]
        for first in range(0, cluster.size, PAIRS_PER_CHUNK):
            some = slice(first, first + PAIRS_PER_CHUNK)
            balls = columns(center, cluster[some]), radius[cluster[some]]
            distance = shafts.distances_of_balls(own[some], *balls)
            near = (distance <= 0.0).nonzero()[0]
            kept.append(first + near)
            found.append(distance[near])
        return np.concatenate(kept), np.concatenate(found)

    def _mark(self, shafts: Shafts, at: Ints, cluster: Ints, found: Mask) -> None:
        """Mark the shafts (n,) that edges of clusters may reach, of pairs (k,) of both."""
        kept, _ = self._reaching(0, cluster, shafts, at)
        step = PAIRS_PER_CHUNK // FANOUT
        for first in range(0, kept.size, step):
            some = kept[first : first + step]
            edge, own = _parts(cluster[some], FANOUT, self.count, at[some])
            found[own[self._edges_may_reach(edge, shafts, own)]] = True

    def _edges_may_reach(self, edge: Ints, shafts: Shafts, at: Ints) -> Mask:
        """Whether edges (k,) may be outlines that reach the shafts `at` (k,)."""
        may = self._may_be_outlines(edge, columns(shafts.point, at), shafts.span[at])
        rows = may.nonzero()[0]
        if rows.size:
            ends = columns(self.start, edge[rows]), columns(self.end, edge[rows])
            may[rows] = shafts.may_meet_segments(at[rows], *ends)
        return may

    def _may_be_outlines(self, edge: Ints, point: Array, span: Array) -> Mask:
        """Whether edges (k,) may be outlines before the light from patches, (3, k) and (k,)."""
        own, between = [], []
        for plane, light in zip(self.planes, self.sides, strict=True):
            a, b, c, offset = columns(plane, edge)
            height = a * point[0]
            height += b * point[1]
            height += c * point[2]
            slack = span + SIDE_MARGIN * np.abs(height)
            height -= offset
            side = np.sign(height) * (np.abs(height) > slack)
            own.append(side)
            between.append((side == 0.0) | (side != light[edge]))
        different = (own[0] == 0.0) | (own[1] == 0.0) | (own[0] != own[1])
        may: Mask = between[0] & between[1] & (different | self.open[edge])
        return may


def _sides_of_light(light: LightBall, plane: Array) -> Array:
    """On which side of planes (4, m) all of a light lies: (m,) 1 or -1; 0 where none is sure."""
    height = light.height_over_planes(plane[:3], plane[3])
    extent = np.full(height.size, float(light.radius))
    if light.span is not None:
        half = light.span.half_u, light.span.half_v
        extent = np.abs(dot(plane[:3], half[0])) + np.abs(dot(plane[:3], half[1]))
    return sure_sides(height, extent, plane[3])


def _touches(light: LightBall, corners: tuple[Array, Array, Array]) -> bool:
    """Whether one of f faces, with corners (3, f) each, may reach a light."""
    a, b, c = corners
    normal = normalize(cross(b - a, c - a))
    cut = (_sides_of_light(light, np.concatenate([normal, dot(normal, a)[None]])) == 0.0).nonzero()
    a, b, c, normal = (columns(each, cut[0]) for each in (a, b, c, normal))
    near = np.ones(a.shape[1], dtype=np.bool_)
    for first, last in ((a, b), (b, c), (c, a)):
        outwards = normalize(cross(last - first, normal))
        near &= light.height_over_planes(outwards, dot(outwards, first)) <= light.radius
    return bool(near.any())


def _levels(start: Array, end: Array) -> tuple[tuple[Array, Array], ...]:
    """Enclosing balls of clusters of edges, and of clusters of those, the smallest first."""
    low, high = np.minimum(start, end), np.maximum(start, end)
    levels: list[tuple[Array, Array]] = []
    while low.shape[1] > 1 or not levels:
        if not low.shape[1]:
            break
        first = np.arange(0, low.shape[1], FANOUT)
        low = np.minimum.reduceat(low, first, axis=1)
        high = np.maximum.reduceat(high, first, axis=1)
        gap = high - low
        levels.append((0.5 * (low + high), 0.5 * np.sqrt(dot(gap, gap)) * (1.0 + SHAFT_MARGIN)))
    return tuple(levels)


def _half_angles(radius: Array | float, far: Array) -> Array:
    """Half the angles (k,) of circles at distances; pi of those that hold the point."""
    sine = np.minimum(radius / np.maximum(far, TINY), 1.0)
    found: Array = np.where(sine < 1.0, np.arcsin(sine), np.pi)
    return found


def _parts(whole: Ints, ratio: int, count: int, other: Ints) -> Pairs:
    """Replace numbers (k,) of groups by those of their `ratio` parts, of which there are `count`.

    Returns with them the numbers that belong to each.
    """
    part = (whole[:, None] * ratio + np.arange(ratio)).ravel()
    real = (part < count).nonzero()[0]
    return part[real], other.repeat(ratio)[real]
