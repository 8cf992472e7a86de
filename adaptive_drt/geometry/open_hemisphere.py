# SPDX-License-Identifier: GPL-3.0-or-later
"""Cosine integral over the part of a hemisphere that many circular caps, and polygons, leave open.

The horizon counts as one more cap, of 90 degrees about the reversed normal. What is not covered is
bounded by arcs between vertices: points where two circles cross, and corners of polygons, which lie
in no third cap and no other polygon. The edges of polygons are arcs of circles of 90 degrees.
Of k caps some hundreds of pairs cross, but only some tens of vertices are visible: products of
matrices find both, and angles are computed of the visible vertices only.

A circle of axis a and half angle alpha is the vector (a, cos alpha) / sin alpha of a Lorentz space.
With the product M of two of them, whose last terms count negatively, circles cross where |M| < 1,
are nested where M > 1 and apart where M < -1 (Lie's geometry of circles).

Vertices within rounding of a third circle count as visible. Such a vertex either bounds arcs no
longer than rounding, or it stands beside another one that it must not be joined with. So an arc
runs from the end of one cap to the start of the next one, only where these follow each other, and
only if the arc's middle lies in no cap.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY, UNIT_ROUNDOFF
from ..numerics.gather import columns
from ..numerics.vector import cross, dot, perpendicular_pair
from .covered_circles import circles_to_keep, mean_overlaps
from .crossing_circles import order_on_rings
from .silhouettes import PolygonSilhouettes

__all__ = ["open_hemisphere_factor", "polygons_in_general_position"]


BLOCK_PAIRS = 1 << 21
"""Number of pairs of caps, all points together, that are compared at a time; a quarter of them
in one product: 4 MB."""
PADDING = 8
"""Numbers of caps are rounded up to multiples of this, so that points fall into few groups."""
CONTAINERS = 12
"""Number of the largest caps of a point in which others are looked for first, that lie within them:
in a heap of spheres these are most."""
COVER_STEPS = (0, 8, 32, 128)
"""Numbers of the largest caps that vertices are compared with first, and next: they cover most."""
MANY_CIRCLES, SMALL_BLOCK = 96, 8
"""Number of caps from which those circles are left out first that others cover all around, and
number of points at a time whose arrays then stay in the cache."""
LEAST_OVERLAPS = 4.0
"""Mean number of the caps that cover the middle of another one, from which that pays. Of packed
balls it is some 8, and of a gas 1."""
MANY_CAPS, NEIGHBOURS = 96, 16
"""Number of caps from which a direction on a circle is compared with up to `NEIGHBOURS` of those
that this circle meets before all others: of so many caps it meets few. Measured."""
STRIPS = 4
"""Number of parts of the products of all pairs of circles, of which each pair is needed once."""
PRODUCT_ROUNDING = 64.0 * UNIT_ROUNDOFF
"""Bound on the rounding error of M, times the product of the sines."""
COVERED = 2.0**-44
"""Cosine by which a direction must be inside a cap to be covered by it, far above rounding. For
vertices of circles whose axes are g apart, it is this over sin g: so well are they known."""
COINCIDENT = 2.0**-30
"""Distance of axes, and difference of half angles, below which circles are taken for the same one,
in units of the sine of their half angle: the vertices of circles so near lie where rounding puts
them. What is left out is no more than this times the cap's circumference."""
TOUCHING, TOUCHING_ROUNDING = 2.0**-40, 2.0**-49
"""Squared half chord of two circles up to which they only touch, as fractions of the smaller and of
the larger versine: the caps then have 1e-18 of the smaller one in common, or all but that, and
rounding decides which of the two vertices is the first."""
SIZE_LEVELS, RANK_BITS = 1 << 16, 24
"""Number of sizes that are told apart where caps are sorted by size, and number of bits of their
numbers, by which those of equal size are sorted."""
SAMPLE_ANGLE = 0.7371
"""Angle in radians of the point by which a circle without vertices is judged to be open or covered,
chosen so that no symmetry puts it on another circle."""
PARALLEL, PLANE_ERROR = 1e-9, 1e-12
"""One minus the cosine of the angle of two edges' planes from which they count as distinct, and
bound in radians on the error of these planes. Where edges coincide, rounding would decide which of
them is visible; `occluded_form_factor` has rules for that."""
LEAST_FACTOR = 2.0**-40
"""Factor in sr below which nothing counts as open, as in `occluded_form_factor`."""
SMALL_CHORD = 2.0**-24
"""Length of a chord below which it does not tell the direction of the middle of its arc."""
TWO_PI = 2.0 * float(np.pi)


@dataclass(frozen=True)
class _Block:
    """The circles of n points: k caps each, the horizon first and then by size, and e edges.

    Attributes
    ----------
    normal : (3, n) unit.  axis : (3, n, k + e) unit.
    sine, cosine, versine : (n, k + e).  used : (n, k + e) bool.
    caps : number k of caps whose circles may be visible.
    test : (n, 4, all) axes and negative cosines of these and of all other caps: the products with
        (w, 1) are above 0 in the caps.
    edge_test : (n, 4, e) the same for edges; above 0 for all edges of a polygon that covers w.
    corner : (3, n, e) unit, where each edge begins, anticlockwise around its polygon.
    sides : number of edges of a polygon.
    """

    normal: Array
    axis: Array
    sine: Array
    cosine: Array
    versine: Array
    used: Mask
    caps: int
    test: Array
    edge_test: Array
    corner: Array
    sides: int

    @property
    def rings(self) -> int:
        """Number of circles of each point."""
        return self.sine.shape[1]


@dataclass(frozen=True)
class _Vertices:
    """m points where two circles cross, or that stand for a whole circle.

    place : (3, m) unit.  point : (m,) row in the block.  ends, starts : (m,) circles, numbered
    through all points, along which a cap ends there, and along which one starts; -1 for none.
    slack : (m,) cosine by which a cap must cover them.
    """

    place: Array
    point: Ints
    ends: Ints
    starts: Ints
    slack: Array

    def take(self, rows: Ints) -> _Vertices:
        """Some of the vertices."""
        return _Vertices(
            columns(self.place, rows),
            self.point[rows],
            self.ends[rows],
            self.starts[rows],
            self.slack[rows],
        )


def open_hemisphere_factor(
    normal: Array,
    axis: Array,
    sine: Array,
    cosine: Array,
    point: Ints,
    polygons: PolygonSilhouettes | None = None,
) -> Array:
    """Integral of max(0, n.w) over the directions that nothing covers: (n,) in sr.

    Parameters
    ----------
    normal : (3, n) unit vectors.
    axis : (3, m) unit vectors, of the caps.  sine, cosine : (m,) of their half angles, below 90
        degrees.
    point : (m,) ascending, the number of each cap's point.
    polygons : of the n points, for which `polygons_in_general_position` is true; or None.

    The error is some 1e-12 sr, measured; see `COINCIDENT` for circles that almost coincide.
    """
    total = np.zeros(normal.shape[1])
    rows = (dot(columns(normal, point), axis) > -sine).nonzero()[0]
    point = point[rows]
    number = np.bincount(point, minlength=total.size)
    first = np.cumsum(number) - number
    # the largest first: they cover most
    size = ((1.0 - sine[rows]) * SIZE_LEVELS).astype(np.int64)
    rank = np.arange(rows.size) - np.repeat(first, number)
    rows = rows[np.argsort(((point * SIZE_LEVELS + size) << RANK_BITS) + rank)]
    # and an unused cap behind the last: no direction has a cosine above 2
    caps = tuple(
        np.concatenate([columns(each, rows, -1), np.full((*each.shape[:-1], 1), unused)], axis=-1)
        for each, unused in ((axis, 0.0), (sine, 1.0), (cosine, 2.0))
    )
    if number.max(initial=0) > CONTAINERS:
        number, first, caps = _without_nested(number, first, caps)
    if polygons is None:
        total[number == 0] = np.pi
        number = np.where(number > 0, number, -1)
    for some, index in _blocks(number, first, caps[1].size - 1):
        for rows, block in _make_blocks(columns(normal, some), caps, index, polygons, some):
            total[rows] = _factor(block)
    return total


def _without_nested(
    number: Ints, first: Ints, caps: tuple[Array, ...]
) -> tuple[Ints, Ints, tuple[Array, ...]]:
    """Numbers, first ones, and caps that do not lie within one of the largest of their point."""
    axis, sine, cosine = caps
    scaled = np.concatenate([axis, -cosine[None]]) / sine
    kept = np.ones(sine.size, dtype=np.bool_)
    for _, index in _blocks(np.where(number > CONTAINERS, number, -1), first, sine.size - 1):
        own = scaled.take(index.T, axis=1)
        outer = own[:, :CONTAINERS].copy()
        outer[3] *= -1.0
        least = sine.take(index).min(axis=1)
        # rows of points last: the products of all of them in each call
        nested = np.zeros(index.T.shape, dtype=np.bool_)
        for row in range(outer.shape[1]):
            product = outer[0, row] * own[0, row + 1 :]
            for part in range(1, 4):
                product += outer[part, row] * own[part, row + 1 :]
            nested[row + 1 :] |= product > 1.0 + PRODUCT_ROUNDING / (least * least)
        kept[index.T[nested]] = False
    kept[-1] = True
    rows = kept.nonzero()[0]
    point = np.repeat(np.arange(number.size), number)[rows[:-1]]
    left = np.bincount(point, minlength=number.size)
    return left, np.cumsum(left) - left, tuple(columns(each, rows, -1) for each in caps)


def polygons_in_general_position(normal: Array, polygons: PolygonSilhouettes) -> Mask:
    """Whether no two edges of different polygons of a point, nor an edge and its horizon, coincide.

    Edges of which the planes are known less precisely than by `PLANE_ERROR` count as coincident.

    normal : (3, n) unit vectors.
    """
    planes = polygons.segments.planes
    most = np.abs(dot(planes.normal, normal[:, None])).max(axis=0)
    sides = planes.angle_error.shape[0] // polygons.edge_on.shape[0]
    for turn in range(1, polygons.edge_on.shape[0]):
        other = np.roll(planes.normal, turn * sides, axis=1)
        for side in range(sides):
            each = np.roll(other.reshape(3, -1, sides, normal.shape[1]), side, axis=2)
            near = np.abs(dot(planes.normal, each.reshape(planes.normal.shape)))
            most = np.maximum(most, near.max(axis=0))
    bare = dot(planes.normal, planes.normal) == 0.0
    rough = ((planes.angle_error > PLANE_ERROR) & ~bare).any(axis=0)
    clear: Mask = (most < 1.0 - PARALLEL) & ~rough & ~polygons.edge_on.any(axis=0)
    return clear


def _blocks(number: Ints, first: Ints, none: int) -> Iterator[tuple[Ints, Ints]]:
    """Yield points (n,), and indices (n, k) of their caps, of which the unused ones are `none`.

    number : (points,) number of caps, -1 for points that are left out.
    """
    width = -(-number // PADDING) * PADDING
    width[number < 0] = -1
    for k in np.unique(width[number >= 0]).tolist():
        points = (width == k).nonzero()[0]
        step = max(1, BLOCK_PAIRS // ((k + 1) * min(k + 1, MANY_CIRCLES)))
        for begin in range(0, points.size, step):
            some = points[begin : begin + step]
            index = first[some, None] + np.arange(k)
            index[np.arange(k) >= number[some, None]] = none
            yield some, index


def _make_blocks(
    normal: Array,
    caps: tuple[Array, ...],
    index: Ints,
    polygons: PolygonSilhouettes | None,
    some: Ints,
) -> Iterator[tuple[Ints, _Block]]:
    """Yield points of `some` (n,) and their caps, with their horizons and polygons.

    index : (n, k) of the caps.  Of points where many caps overlap only those circles are taken that
    others do not cover all around.
    """
    n, k = index.shape[0], index.shape[1] + 1
    axis, sine, cosine = np.empty((3, n, k)), np.empty((n, k)), np.empty((n, k))
    for part, own, horizon in zip((axis, sine, cosine), caps, (-normal, 1.0, 0.0), strict=True):
        part[..., 0] = horizon
        part[..., 1:] = own.take(index, axis=-1)
    crowded = np.zeros(n, dtype=np.bool_)
    if k > MANY_CIRCLES:
        crowded = mean_overlaps(axis[..., 1:], cosine[:, 1:]) > LEAST_OVERLAPS
    for chosen, most in ((~crowded, n), (crowded, SMALL_BLOCK)):
        rows = chosen.nonzero()[0]
        while rows.size:
            at, number = rows[:most], k
            some_caps = axis[:, at], sine[at], cosine[at]
            if chosen is crowded:
                some_caps, number = _kept_first(some_caps)
            at = at[: max(1, BLOCK_PAIRS // (number * number))]
            fit = np.s_[..., : at.size, :]
            block_caps = some_caps[0][fit], some_caps[1][fit], some_caps[2][fit]
            yield some[at], _make_block(columns(normal, at), block_caps, number, polygons, some[at])
            rows = rows[at.size :]


def _kept_first(caps: tuple[Array, Array, Array]) -> tuple[tuple[Array, Array, Array], int]:
    """Caps (..., n, k), those first whose circles may be visible; and the most of these a point."""
    axis, sine, cosine = caps
    kept = circles_to_keep(axis, sine, cosine)
    kept[:, 0] = True  # the horizon
    order = np.argsort(~kept, axis=1, kind="stable")
    flat = (order + sine.shape[1] * np.arange(sine.shape[0])[:, None]).ravel()
    first = columns(axis.reshape(3, -1), flat).reshape(axis.shape)
    sizes = [each.ravel()[flat].reshape(each.shape) for each in (sine, cosine)]
    return (first, sizes[0], sizes[1]), int(kept.sum(axis=1).max())


def _make_block(
    normal: Array,
    caps: tuple[Array, Array, Array],
    number: int,
    polygons: PolygonSilhouettes | None,
    some: Ints,
) -> _Block:
    """Points `some` (n,) with their caps: axes (3, n, all), sines and cosines (n, all).

    number : of the first caps of each point, whose circles may be visible.
    """
    n = normal.shape[1]
    e, sides = 0, 1
    if polygons is not None:
        e = polygons.segments.half_angle.shape[0]
        sides = e // polygons.edge_on.shape[0]
    test = np.concatenate([caps[0], -caps[2][None]]).swapaxes(0, 1).copy()
    axis, sine, cosine = (each[..., :number] for each in caps)
    used = cosine <= 1.0
    edge_test, corner = np.zeros((n, 4, e)), np.empty((3, n, e))
    if polygons is not None:
        own = polygons.segments.planes.normal.take(some, axis=2).swapaxes(1, 2)
        bare = dot(own, own) == 0.0  # an edge of no length bounds nothing
        axis, used = np.concatenate([axis, own], axis=2), np.concatenate([used, ~bare], axis=1)
        sine = np.concatenate([sine, np.ones((n, e))], axis=1)
        cosine = np.concatenate([cosine, np.zeros((n, e))], axis=1)
        edge_test[:, :3], edge_test[:, 3] = own.swapaxes(0, 1), bare
        half = polygons.segments.half_angle[:, some].T
        middle, along = (
            each.take(some, axis=2).swapaxes(1, 2)
            for each in (polygons.segments.middle, polygons.segments.along)
        )
        corner = np.cos(half) * middle - np.sin(half) * along
    axis, sine, cosine = (np.ascontiguousarray(each) for each in (axis, sine, cosine))
    versine = sine * sine / (1.0 + cosine)
    return _Block(normal, axis, sine, cosine, versine, used, number, test, edge_test, corner, sides)


def _factor(block: _Block) -> Array:
    """The factor (n,) of the points of a block."""
    n, k = block.sine.shape
    crossings, near = _crossings(block)
    parts = [crossings]
    if block.rings > block.caps:
        parts.append(_corners(block))
    parts = [part.take((~_covered(block, part, near)).nonzero()[0]) for part in parts]
    visible = parts[0] if len(parts) == 1 else _concatenate(*parts)
    ring, value = _arcs(block, visible, near)
    # a circle without vertices is open as a whole or not at all
    samples = _ring_samples(block)
    crossed = np.zeros(n * k, dtype=np.bool_)
    crossed[visible.ends] = True
    crossed[visible.starts] = True
    samples = samples.take((~crossed[samples.ends]).nonzero()[0])
    rings = samples.ends[~_covered(block, samples, near)]
    at = rings // k
    axis = columns(block.axis.reshape(3, -1), rings)
    square = block.sine.ravel()[rings] ** 2
    whole = np.pi * square * dot(columns(block.normal, at), axis)
    total = np.zeros(n)
    total -= np.bincount(ring // k, weights=value, minlength=n)
    total -= np.bincount(at, weights=whole, minlength=n)
    # as in `visible_factor`: less is what rounding leaves of a hemisphere that is wholly covered
    total[total < LEAST_FACTOR] = 0.0
    return total


def _crossings(block: _Block) -> tuple[_Vertices, _Neighbours | None]:
    """The points where circles cross, two for each pair; and, of many caps, which ones meet."""
    k = block.rings
    row, other = _meeting_pairs(block)
    point = row // k
    axes, versines = block.axis.reshape(3, -1), block.versine.ravel()
    a, b = columns(axes, row), columns(axes, other)
    va, vb = versines[row], versines[other]
    apart = b - a
    v, d = 0.5 * dot(apart, apart), vb - va
    _drop_coincident(block, row, other, v, d)
    square = v * (2.0 * (va + vb - va * vb) - v) - d * d
    sine2 = v * (2.0 - v)
    least = TOUCHING * np.minimum(va, vb) + TOUCHING_ROUNDING * np.maximum(va, vb)
    used = block.used.ravel()
    near = _Neighbours.make(block, row, other) if block.caps > MANY_CAPS else None
    keep = ((square > sine2 * least) & used[row] & used[other]).nonzero()[0]
    if keep.size < row.size:
        row, other, point, v, d, square, sine2, va, vb = (
            each[keep] for each in (row, other, point, v, d, square, sine2, va, vb)
        )
        a, b, apart = columns(a, keep), columns(b, keep), columns(apart, keep)
    # on the plane of both axes: (1 - va) at the first, (1 - vb) at the second
    base = a * (((1.0 - va) + (1.0 - vb)) / (2.0 - v)) + apart * ((v * (1.0 - va) - d) / sine2)
    aside = cross(a, b) * (np.sqrt(square) / sine2)
    slack = COVERED / np.sqrt(sine2)
    # anticlockwise about the first axis the second cap ends on the side of the axes' product
    found = _Vertices(
        np.stack([base + aside, base - aside], axis=-1).reshape(3, -1),
        np.repeat(point, 2),
        np.stack([row, other], axis=-1).ravel(),
        np.stack([other, row], axis=-1).ravel(),
        np.repeat(slack, 2),
    )
    if block.rings == block.caps:
        return found, near
    on_edges = np.ones(found.point.size, dtype=np.bool_)
    for ring in (found.ends, found.starts):
        rows = (ring % k >= block.caps).nonzero()[0]
        on_edges[rows] &= _on_edges(block, found.take(rows), ring[rows])
    return found.take(on_edges.nonzero()[0]), near


def _meeting_pairs(block: _Block) -> tuple[Ints, Ints]:
    """Pairs (m,) of circles that may cross, numbered through all points, each pair once."""
    k = block.rings
    caps = block.test[..., : block.caps]
    scaled = np.concatenate([caps, block.edge_test], axis=2) / block.sine[:, None]
    scaled[:, 3, block.caps :] = 0.0
    mirrored = scaled.swapaxes(1, 2).copy()
    mirrored[..., 3] *= -1.0
    least = float(np.where(block.used, block.sine, 1.0).min())
    most = 1.0 + PRODUCT_ROUNDING / (least * least)
    rows, others = [], []
    number = np.arange(k)
    # edges of the same polygon have the same number
    polygon = np.where(
        number < block.caps, number, block.caps + (number - block.caps) // block.sides
    )
    step = -(-k // STRIPS)
    for first in range(0, k, step):
        # circles and those after them
        product = np.matmul(mirrored[:, first : first + step], scaled[..., first:])
        found = (product > -most).ravel().nonzero()[0]
        row, second = np.divmod(found, k - first)
        point, one = np.divmod(row, product.shape[1])
        one += first
        second += first
        keep = (polygon[one] < polygon[second]).nonzero()[0]
        one, second, point = one[keep], second[keep], point[keep]
        within = product.ravel()[found[keep]] >= most
        _drop_caps(block, point, second, (within & (second < block.caps)).nonzero()[0])
        keep = (~within).nonzero()[0]
        rows.append(point[keep] * k + one[keep])
        others.append(point[keep] * k + second[keep])
    row, other = np.concatenate(rows), np.concatenate(others)
    used = block.used.ravel()
    order = np.argsort(row // k, kind="stable")
    row, other = row[order], other[order]
    keep = (used[row] & used[other]).nonzero()[0]
    return row[keep], other[keep]


def _on_edges(block: _Block, vertices: _Vertices, ring: Ints) -> Mask:
    """Whether vertices (m,) on the great circles `ring` of edges lie on these edges themselves."""
    number = ring % block.rings - block.caps
    first = number - number % block.sides
    on = np.ones(ring.size, dtype=np.bool_)
    edges = block.edge_test.swapaxes(0, 1).reshape(4, -1)
    for side in range(block.sides):
        own = columns(edges, vertices.point * block.edge_test.shape[2] + first + side)
        on &= dot(own[:3], vertices.place) + own[3] >= -vertices.slack
    return on


def _corners(block: _Block) -> _Vertices:
    """The corners of the polygons of a block."""
    n, e = block.edge_test.shape[0], block.edge_test.shape[2]
    point, number = np.divmod(np.arange(n * e), e)
    first = number - number % block.sides
    ring = point * block.rings + block.caps
    # an edge of no length has no vertices: the one before it ends where the one after it begins
    used = block.used[:, block.caps :].ravel()
    back = first + (number - 1 - first) % block.sides
    for _ in range(block.sides - 2):
        bare = ~used[point * e + back]
        back = np.where(bare, first + (back - 1 - first) % block.sides, back)
    rows = used.nonzero()[0]
    corner = columns(block.corner.reshape(3, -1), rows)
    slack = np.full(rows.size, COVERED)
    return _Vertices(corner, point[rows], (ring + number)[rows], (ring + back)[rows], slack)


def _drop_coincident(block: _Block, row: Ints, other: Ints, v: Array, d: Array) -> None:
    """Mark circles of a block as unused that coincide with an earlier one, in place.

    v : (m,) versines of the angles between the axes of pairs.  d : differences of their versines.
    """
    sine = block.sine.ravel()[row]
    limit = COINCIDENT * sine
    same = ((v <= 0.5 * limit * limit) & (np.abs(d) <= limit * sine)).nonzero()[0]
    at, column = np.divmod(other, block.rings)
    _drop_caps(block, at, column, same[column[same] < block.caps])


def _drop_caps(block: _Block, point: Ints, cap: Ints, rows: Ints) -> None:
    """Mark caps of a block as unused, in place: those of some rows of points and their caps (m,).

    They cover nothing that others do not cover, and no arc of their circles is visible.
    """
    block.used[point[rows], cap[rows]] = False
    block.test[point[rows], :, cap[rows]] = (0.0, 0.0, 0.0, -2.0)


@dataclass(frozen=True)
class _Neighbours:
    """The caps that each circle of a block meets: those that may cover points of it.

    Attributes
    ----------
    cap : (m,) their columns in `test`, by circle.  first, number : (n (k + e),) for each circle.
    test : (4, n all) as in the block.
    """

    cap: Ints
    first: Ints
    number: Ints
    test: Array

    @classmethod
    def make(cls, block: _Block, row: Ints, other: Ints) -> _Neighbours:
        """From pairs (m,) of circles that meet, each pair once."""
        ring, cap = np.concatenate([row, other]), np.concatenate([other, row])
        point, column = np.divmod(cap, block.rings)
        kept = (column < block.caps).nonzero()[0]
        ring, cap = ring[kept], (point * block.test.shape[2] + column)[kept]
        order = np.argsort(ring, kind="stable")
        number = np.bincount(ring, minlength=block.sine.size)
        test = block.test.swapaxes(0, 1).reshape(4, -1)
        return cls(cap[order], np.cumsum(number) - number, number, test)

    def covered(self, vertices: _Vertices) -> tuple[Mask, Ints]:
        """Whether directions (m,) on circles are covered; and of which that is not decided yet."""
        covered = np.zeros(vertices.point.size, dtype=np.bool_)
        first, number = self.first[vertices.ends], self.number[vertices.ends]
        rows = (number > 0).nonzero()[0]
        for rank in range(NEIGHBOURS):
            if not rows.size:
                break
            own = columns(self.test, self.cap[first[rows] + rank])
            inside = dot(own[:3], columns(vertices.place, rows)) + own[3] > vertices.slack[rows]
            covered[rows[inside]] = True
            rows = rows[~inside & (number[rows] > rank + 1)]
        return covered, rows


def _ring_samples(block: _Block) -> _Vertices:
    """One point of each cap's circle that is in use."""
    k = block.rings
    ring = block.used.ravel().nonzero()[0]
    ring = ring[ring % k < block.caps]
    axis = columns(block.axis.reshape(3, -1), ring)
    u, w = perpendicular_pair(axis)
    sine, cosine = block.sine.ravel()[ring], block.cosine.ravel()[ring]
    place = cosine * axis + sine * (np.cos(SAMPLE_ANGLE) * u + np.sin(SAMPLE_ANGLE) * w)
    return _Vertices(place, ring // k, ring, ring, np.full(ring.size, COVERED))


def _concatenate(one: _Vertices, other: _Vertices) -> _Vertices:
    """Two lists of vertices after each other."""
    names = ("place", "point", "ends", "starts", "slack")
    return _Vertices(
        *(np.concatenate([getattr(each, name) for each in (one, other)], axis=-1) for name in names)
    )


def _covered(block: _Block, vertices: _Vertices, neighbours: _Neighbours | None) -> Mask:
    """Whether directions (m,), ordered by their points, lie in a cap or polygon of their point.

    neighbours : of the circles on which the directions lie; None to compare them with all caps.
    """
    covered, every = np.zeros(vertices.point.size, dtype=np.bool_), block.test.shape[2]
    left = np.arange(covered.size)
    if neighbours is not None:
        covered, left = neighbours.covered(vertices)
        if every > block.caps:
            # the caps whose circles are left out are no neighbours
            left = (~covered).nonzero()[0]
    for first, last in pairwise((*COVER_STEPS, max(every, COVER_STEPS[-1]))):
        if every > first:
            rows = left[~covered[left]]
            few = columns(vertices.place, rows), vertices.point[rows], vertices.slack[rows]
            covered[rows] = _covered_by(block.test[..., first:last], *few)
    if block.rings > block.caps:
        rows = (~covered).nonzero()[0]
        few = columns(vertices.place, rows), vertices.point[rows], vertices.slack[rows]
        covered[rows] = _covered_by(block.edge_test, *few, block.sides)
    return covered


def _covered_by(test: Array, place: Array, point: Ints, slack: Array, sides: int = 1) -> Mask:
    """Whether directions (m,), ordered by their points, lie in one of some caps (n, 4, k).

    sides : number of consecutive tests that a direction must pass.
    """
    count = test.shape[0]
    if not point.size:
        return np.zeros(0, dtype=np.bool_)
    number = np.bincount(point, minlength=count)
    most = int(number.max(initial=0))
    # position of each direction in a table (n, most)
    at = np.arange(point.size) + np.repeat(
        np.arange(count) * most - np.cumsum(number) + number, number
    )
    table = np.zeros((count, 4, most))
    for row, part in zip(range(3), place, strict=True):
        own = np.zeros(count * most)
        own[at] = part
        table[:, row] = own.reshape(count, most)
    table[:, 3] = 1.0
    depth = np.matmul(test.swapaxes(1, 2), table)
    if sides > 1:
        depth = depth.reshape(count, -1, sides, most).min(axis=2)
    depth = depth.max(axis=1, initial=-1.0)
    covered: Mask = depth.ravel()[at] > slack
    return covered


def _arcs(block: _Block, vertices: _Vertices, neighbours: _Neighbours | None) -> tuple[Ints, Array]:
    """Circles (m,) of the arcs between visible vertices, and their integrals of n.(w x dw) / 2."""
    k = block.sine.shape[1]
    m = vertices.point.size
    ring = np.concatenate([vertices.ends, vertices.starts])
    vertex = np.concatenate([np.arange(m), np.arange(m)])
    axes = block.axis.reshape(3, -1)
    u, w = perpendicular_pair(columns(axes, ring))
    place = columns(vertices.place, vertex)
    angle = np.arctan2(dot(w, place), dot(u, place))
    order = order_on_rings(ring, angle)
    own, end = ring[order], order < m
    # the next vertex on each circle, the first one after the last
    begins = np.diff(own, prepend=-1).nonzero()[0]
    following = np.arange(1, own.size + 1)
    following[np.append(begins[1:], own.size)[: begins.size] - 1] = begins
    gap = (end & ~end[following]).nonzero()[0]
    one, two = order[gap], order[following[gap]]
    turn = angle[two] - angle[one]
    turn += TWO_PI * (following[gap] <= gap)
    ring = own[gap]
    x, y, axis = columns(place, one), columns(place, two), columns(axes, ring)
    sine, cosine = block.sine.ravel()[ring], block.cosine.ravel()[ring]
    middle = _middles(axis, sine, cosine, x, y, turn)
    at = ring // k
    slack = np.full(ring.size, COVERED)
    middles = _Vertices(middle, at, ring, ring, slack)
    open_ = (~_covered(block, middles, neighbours)).nonzero()[0]
    ring, turn, at = ring[open_], turn[open_], at[open_]
    axis, chord = columns(axis, open_), columns(y, open_) - columns(x, open_)
    normal = columns(block.normal, at)
    sine, cosine = sine[open_], cosine[open_]
    value = sine * sine * turn * dot(normal, axis) - cosine * dot(axis, cross(normal, chord))
    return ring, 0.5 * value


def _middles(axis: Array, sine: Array, cosine: Array, x: Array, y: Array, turn: Array) -> Array:
    """Middles (3, m) of arcs from x to y anticlockwise about the axes of their circles."""
    aside = cross(y - x, axis)
    length = np.sqrt(dot(aside, aside))
    aside /= np.maximum(length, TINY)
    short = (length < SMALL_CHORD * sine).nonzero()[0]
    if short.size:
        # almost no arc, or almost the whole circle
        out = columns(x, short) - cosine[short] * columns(axis, short)
        aside[:, short] = out * (np.where(turn[short] > np.pi, -1.0, 1.0) / sine[short])
    middle: Array = cosine * axis + sine * aside
    return middle
