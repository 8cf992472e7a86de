# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects seen through boxes in pixel x, y and shutter time t, written as polynomials.

Within a box, the normalized coordinates x, y and t run from -1/2 to 1/2. A ray's direction is
linear in x and y and an object's position is linear in t. The discriminant of a ray and a sphere
therefore has degree two in (x, y) and degree two in t, and the edge functions of a quad have degree
one in (x, y) and degree one in t. A polynomial is stored as an array of shape (T, k, m): for m
candidates, the coefficients of t^0, t^1, t^2 (T of them) times those of 1, x, y, xx, xy, yy (k of
them). The expansion about the middle of the box keeps precision: outlines are off by some 1e-12 of
a pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs

__all__ = [
    "Boxes",
    "CandidatePolynomials",
    "Coverage",
    "QuadPolynomials",
    "SpherePolynomials",
    "make_polynomials",
    "polynomial_range",
]


MONOMIAL_DEGREES = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
"""Degrees in (x, y) of the k monomials of a polynomial, in the order of storage."""
SWAPPED_COEFFICIENTS = ((1, 2), (3, 5))
"""Pairs of coefficients that are exchanged when x and y are exchanged: x with y and xx with yy. A
polynomial of three coefficients has only the first pair."""
TIME_NORMAL = np.array([[0.0], [0.0], [1.0]])
"""Unit normal, in (x, y, t), of an event that happens for all rays at the same time: the camera
enters a sphere or crosses the plane of a quad."""


@dataclass(frozen=True)
class Boxes:
    """Boxes in pixel x, y (picture coordinates) and shutter time t; a side may have length 0.

    Attributes
    ----------
    low, high : (3, n) lower and upper bounds on x, y, t.
    """

    low: Array
    high: Array

    @property
    def middle(self) -> Array:
        """Centers of the boxes, (3, n)."""
        middle: Array = 0.5 * (self.low + self.high)
        return middle

    @property
    def size(self) -> Array:
        """Lengths of the sides of the boxes, (3, n)."""
        size: Array = self.high - self.low
        return size


@dataclass(frozen=True)
class SpherePolynomials:
    """Sphere candidates as polynomials; v is the center relative to the camera, w the direction.

    Attributes
    ----------
    row : (m,) positions among all candidates.
    discriminant : of the ray and the sphere, positive where the line meets the sphere.
    along : w.v, positive where the center is ahead of the camera.
    square : w.w.
    gap : v.v less the squared radius, negative where the camera is inside the sphere.
    """

    row: Ints
    discriminant: Array
    along: Array
    square: Array
    gap: Array

    def take(self, index: Ints, row: Ints) -> SpherePolynomials:
        """Select candidates by index and give them new rows."""
        parts = (self.discriminant, self.along, self.square, self.gap)
        return SpherePolynomials(row, *(columns(part, index, -1) for part in parts))


@dataclass(frozen=True)
class QuadPolynomials:
    """Quad candidates as polynomials; q is a corner relative to the camera, w the direction.

    A ray hits the quad where all four edge functions and `facing` have the sign of `height`.

    Attributes
    ----------
    row : (m,) positions among all candidates.
    edges : four edge functions, linear in w, as in `polygon.kernels.edge_planes`.
    facing : w.normal.
    height : q.normal.
    """

    row: Ints
    edges: tuple[Array, Array, Array, Array]
    facing: Array
    height: Array

    def take(self, index: Ints, row: Ints) -> QuadPolynomials:
        """Select candidates by index and give them new rows."""
        a, b, c, d = (columns(edge, index, -1) for edge in self.edges)
        return QuadPolynomials(
            row, (a, b, c, d), columns(self.facing, index, -1), columns(self.height, index, -1)
        )


@dataclass(frozen=True)
class Coverage:
    """How m candidates cover their boxes, by bounds, and the orientation of their outlines there.

    Attributes
    ----------
    some, full : (m,) whether some ray of the box may hit the object, and whether all rays do.
    near, far : (m,) lower and upper bounds on the ray parameters of those hits.
    across : (3, m) components in x, y and t of a unit normal of the outline, absolute values, over
    the part that may be seen; ones where no outline is seen.
    reach : (2, m) half the apparent size of the object, in units of the box's size.
    turn : (m,) approximate angle in radians, at most 1, by which the outline turns within half the
    box.
    """

    some: Mask
    full: Mask
    near: Array
    far: Array
    across: Array
    reach: Array
    turn: Array

    def take(self, rows: Ints) -> Coverage:
        """Select candidates by index."""
        return Coverage(
            self.some[rows],
            self.full[rows],
            self.near[rows],
            self.far[rows],
            columns(self.across, rows),
            columns(self.reach, rows),
            self.turn[rows],
        )


@dataclass(frozen=True)
class CandidatePolynomials:
    """Candidates as polynomials, spheres and quads apart.

    Attributes
    ----------
    is_ball : (m,) whether the candidate is a sphere.
    place : (m,) position of each candidate in `balls` or `flats`.
    balls, flats : the sphere candidates and the quad candidates.
    """

    is_ball: Mask
    place: Ints
    balls: SpherePolynomials
    flats: QuadPolynomials

    def take(self, rows: Ints) -> CandidatePolynomials:
        """Select candidates by index and renumber their rows."""
        is_ball, place = self.is_ball[rows], self.place[rows]
        ball, flat = is_ball.nonzero()[0], (~is_ball).nonzero()[0]
        index = np.empty(rows.size, dtype=np.int64)
        index[ball], index[flat] = np.arange(ball.size), np.arange(flat.size)
        return CandidatePolynomials(
            is_ball,
            index,
            self.balls.take(place[ball], ball),
            self.flats.take(place[flat], flat),
        )

    def turn(self, some: Mask) -> None:
        """Exchange x and y for the candidates chosen by a mask (m,), in place."""
        balls, flats = self.balls, self.flats
        for row, forms in (
            (balls.row, (balls.discriminant, balls.along, balls.square)),
            (flats.row, (*flats.edges, flats.facing)),
        ):
            index = some[row].nonzero()[0]
            if not index.size:
                continue
            for form in forms:
                for x, y in SWAPPED_COEFFICIENTS[: form.shape[1] // 3]:
                    form[:, x, index], form[:, y, index] = form[:, y, index], form[:, x, index]


def make_polynomials(
    plan: Plan, boxes: Boxes, pairs: Pairs
) -> tuple[CandidatePolynomials, Coverage]:
    """Write the candidates `pairs` (box, object) as polynomials, and bound how they cover the
    boxes."""
    m = pairs.item.size
    cover = Coverage(
        np.zeros(m, dtype=np.bool_),
        np.zeros(m, dtype=np.bool_),
        np.zeros(m),
        np.full(m, np.inf),
        np.ones((3, m)),
        np.full((2, m), np.inf),
        np.zeros(m),
    )
    is_ball = pairs.item < plan.sphere_count
    ball, flat = is_ball.nonzero()[0], (~is_ball).nonzero()[0]
    place = np.empty(m, dtype=np.int64)
    place[ball], place[flat] = np.arange(ball.size), np.arange(flat.size)
    middle, size = boxes.middle, boxes.size
    w, x, y = _ray_directions(
        plan, columns(middle, pairs.pixel[ball]), columns(size, pairs.pixel[ball])
    )
    balls = _sphere_polynomials(plan, boxes, pairs.take(ball), ball, (w, x, y))
    _set_sphere_coverage(balls, cover)
    w, x, y = _ray_directions(
        plan, columns(middle, pairs.pixel[flat]), columns(size, pairs.pixel[flat])
    )
    flats = _quad_polynomials(plan, boxes, pairs.take(flat), flat, (w, x, y))
    _set_quad_coverage(flats, cover)
    _set_apparent_size(plan, pairs, middle, size, cover)
    wide = np.maximum(columns(cover.reach, ball).min(axis=0), 0.5)
    cover.turn[ball] = np.where(cover.full[ball], 0.0, 0.5 / wide)
    return CandidatePolynomials(is_ball, place, balls, flats), cover


def _ray_directions(plan: Plan, middle: Array, size: Array) -> tuple[Array, Array, Array]:
    """Ray directions through the middles of boxes and their changes over x and y, (3, m) each."""
    lens = plan.lens
    w = lens.directions(middle[0], middle[1])
    return w, size[0] * lens.right[:, None], size[1] * lens.up[:, None]


def _positions(
    place: Array, displacement: Array | None, boxes: Boxes, box: Ints, ids: Ints
) -> tuple[Array, Array | None]:
    """Positions (3, m) in the middle of the boxes' times, and their changes (3, m) over those
    times.

    The changes are None if no object moves.
    """
    if displacement is None:
        return columns(place, ids), None
    move = columns(displacement, ids)
    middle = 0.5 * (boxes.low[2] + boxes.high[2])
    change = (boxes.high[2] - boxes.low[2])[box] * move
    return columns(place, ids) + middle[box] * move, change if change.any() else None


def _product_coefficients(a: tuple[Array, Array, Array], b: tuple[Array, Array, Array]) -> Array:
    """Coefficients (6, m) of (a0 + a1 x + a2 y).(b0 + b1 x + b2 y)."""
    if a is b:
        pairs = ((0, 1), (0, 2), (1, 2))
        x, y, xy = (2.0 * dot(a[i], a[j]) for i, j in pairs)
        return np.array([dot(a[0], a[0]), x, y, dot(a[1], a[1]), xy, dot(a[2], a[2])])
    x, y, xy = (dot(a[i], b[j]) + dot(a[j], b[i]) for i, j in ((0, 1), (0, 2), (1, 2)))
    return np.array([dot(a[0], b[0]), x, y, dot(a[1], b[1]), xy, dot(a[2], b[2])])


def _sphere_polynomials(
    plan: Plan, boxes: Boxes, pairs: Pairs, row: Ints, ray: tuple[Array, Array, Array]
) -> SpherePolynomials:
    """Polynomials of spheres.

    With w x v = c + t e, the discriminant is r^2 |w|^2 - |c|^2 - 2 t c.e - t^2 |e|^2.
    """
    spheres = plan.spheres
    v, change = _positions(spheres.center, spheres.displacement, boxes, pairs.pixel, pairs.item)
    rr = spheres.radius[pairs.item] ** 2
    square = _product_coefficients(ray, ray)
    c = (cross(ray[0], v), cross(ray[1], v), cross(ray[2], v))
    d = [rr * square - _product_coefficients(c, c)]
    along = [np.array([dot(part, v) for part in ray])]
    gap = [(dot(v, v) - rr)[None]]
    if change is not None:
        e = (cross(ray[0], change), cross(ray[1], change), cross(ray[2], change))
        d += [-2.0 * _product_coefficients(c, e), -_product_coefficients(e, e)]
        along.append(np.array([dot(part, change) for part in ray]))
        gap += [2.0 * dot(v, change)[None], dot(change, change)[None]]
    return SpherePolynomials(row, np.array(d), np.array(along), square[None], np.array(gap))


def _quad_polynomials(
    plan: Plan, boxes: Boxes, pairs: Pairs, row: Ints, ray: tuple[Array, Array, Array]
) -> QuadPolynomials:
    """Polynomials of quads with edges a and b from the corner q.

    The first two edge functions are w.(b x q) and w.(q x a); each of the others is w.(a x b) less
    one of these.
    """
    quads, ids = plan.quads, pairs.item - plan.sphere_count
    q, change = _positions(quads.corner, quads.displacement, boxes, pairs.pixel, ids)
    a, b = columns(quads.edge_u, ids), columns(quads.edge_v, ids)
    normal = cross(a, b)
    facing = np.array([dot(part, normal) for part in ray])[None]
    height = [dot(q, normal)[None]]
    planes = [(cross(b, q), cross(q, a))]
    if change is not None:
        height.append(dot(change, normal)[None])
        planes.append((cross(b, change), cross(change, a)))
    first, second = (
        np.array([np.array([dot(part, plane[k]) for part in ray]) for plane in planes])
        for k in (0, 1)
    )
    third, fourth = -first, -second
    third[:1] += facing
    fourth[:1] += facing
    return QuadPolynomials(row, (first, second, third, fourth), facing, np.array(height))


def polynomial_range(form: Array) -> tuple[Array, Array]:
    """Lower and upper bounds (m,) on polynomials over the box, term by term."""
    low, high = form[0, 0].copy(), form[0, 0].copy()
    for power in range(form.shape[0]):
        for k in range(form.shape[1]):
            i, j = MONOMIAL_DEGREES[k]
            if power + i + j == 0:
                continue
            change = form[power, k] * 0.5 ** (power + i + j)
            if power % 2 or i % 2 or j % 2:
                change = np.abs(change)
                low -= change
                high += change
            else:
                low += np.minimum(change, 0.0)
                high += np.maximum(change, 0.0)
    return low, high


def _absolute_slopes(form: Array) -> Array:
    """Absolute changes (3, m) of polynomials across the box along x, y, t, at its middle."""
    time = form[1, 0] if form.shape[0] > 1 else np.zeros(form.shape[2])
    return np.array([np.abs(form[0, 1]), np.abs(form[0, 2]), np.abs(time)])


def _unit_vectors(slopes: Array) -> Array:
    """Unit vectors along `slopes` (3, m); all components are 1 where a slope is zero."""
    length = np.sqrt(dot(slopes, slopes))
    unit: Array = np.where(length > 0.0, slopes, 1.0) / np.where(length > 0.0, length, 1.0)
    return unit


def _set_sphere_coverage(balls: SpherePolynomials, cover: Coverage) -> None:
    """Fill in the coverage by spheres, all but `reach` and `turn`, in place."""
    row = balls.row
    low, high = polynomial_range(balls.discriminant)
    along_low, along_high = polynomial_range(balls.along)
    square_low, square_high = polynomial_range(balls.square)
    gap_low, gap_high = polynomial_range(balls.gap)
    some = ((high >= 0.0) & (along_high > 0.0)) | (gap_low < 0.0)
    full = ((low > 0.0) & (along_low > 0.0)) | (gap_high < 0.0)
    outside = gap_low > 0.0
    root_low, root_high = np.sqrt(np.maximum(low, 0.0)), np.sqrt(np.maximum(high, 0.0))
    last = np.maximum(along_high + np.where(outside, -root_low, root_high), 0.0)
    cover.some[row], cover.full[row] = some, full
    near = np.where(outside, np.maximum(along_low - root_high, 0.0), 0.0)
    cover.near[row] = near / square_high
    ahead = square_low > 0.0
    cover.far[row] = np.where(ahead, last, np.inf) / np.where(ahead, square_low, 1.0)
    across = np.where(full, 1.0, _unit_vectors(_absolute_slopes(balls.discriminant)))
    cover.across[:, row] = np.where((gap_low < 0.0) & (gap_high >= 0.0), TIME_NORMAL, across)


def _set_quad_coverage(flats: QuadPolynomials, cover: Coverage) -> None:
    """Fill in the coverage by quads, all but `reach`, in place."""
    row = flats.row
    height_low, height_high = polynomial_range(flats.height)
    sure = (height_low > 0.0) | (height_high < 0.0)
    side = np.where(height_low > 0.0, 1.0, -1.0)
    some, full = np.ones(row.size, dtype=np.bool_), sure.copy()
    across, crossing = np.ones((3, row.size)), np.zeros(row.size, dtype=np.int64)
    for edge in flats.edges:
        low, high = polynomial_range(side * edge)
        some &= ~sure | (high >= 0.0)
        full &= low >= 0.0
        crosses = (low < 0.0) & (high >= 0.0)
        crossing += crosses
        across = np.where(
            crosses, np.minimum(across, _unit_vectors(_absolute_slopes(edge))), across
        )
    some &= (height_low != 0.0) | (height_high != 0.0)
    facing_low, facing_high = polynomial_range(side * flats.facing)
    first = np.where(sure, np.minimum(np.abs(height_low), np.abs(height_high)), 0.0)
    last = np.maximum(np.abs(height_low), np.abs(height_high))
    cover.some[row], cover.full[row] = some, full
    near = np.where(facing_high > 0.0, first, 0.0) / np.where(facing_high > 0.0, facing_high, 1.0)
    cover.near[row] = near
    ahead = sure & (facing_low > 0.0)
    with np.errstate(over="ignore"):  # overflow where the quad is seen edge-on: no upper bound
        cover.far[row] = np.where(ahead, last, np.inf) / np.where(ahead, facing_low, 1.0)
    cover.across[:, row] = np.where(sure, across, TIME_NORMAL)
    # a single straight edge does not turn; at a corner the outline does
    cover.turn[row] = np.where(sure & (crossing < 2), 0.0, 1.0)


def _set_apparent_size(
    plan: Plan, pairs: Pairs, middle: Array, size: Array, cover: Coverage
) -> None:
    """Set `cover.reach` from the angular size of a ball around each object as seen from the
    camera."""
    center, radius = plan.quads.bounding_spheres
    centers = np.concatenate([plan.spheres.center, center], axis=1)
    away = np.maximum(np.sqrt(dot(centers, centers)), np.finfo(np.float64).tiny)
    with np.errstate(over="ignore"):  # overflow where the camera is at its center
        ratio = np.concatenate([plan.spheres.radius, radius]) / away
    lens = plan.lens
    w = lens.directions(middle[0], middle[1])
    length = np.sqrt(dot(w, w))
    for k, step in ((0, lens.right), (1, lens.up)):
        across = size[k] * np.sqrt(dot(step, step))
        wide = np.where(across > 0.0, length, np.inf) / np.where(across > 0.0, across, 1.0)
        with np.errstate(over="ignore"):
            cover.reach[k] = ratio[pairs.item] * wide[pairs.pixel]
