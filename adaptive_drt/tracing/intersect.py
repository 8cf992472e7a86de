# SPDX-License-Identifier: GPL-3.0-or-later
"""Camera rays: the candidate objects of each pixel, and the nearest hit among them.

There is no acceleration structure for camera rays. The screen-space bounds of each object over the
whole shutter give the pairs (pixel, object) that have to be tested. The same pairs are used for the
centre ray, for detection and for the distributed rays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry.camera import PinholeCamera
from ..geometry.parallelogram import PlaneNormals, edge_planes, intersect_quad
from ..geometry.sphere import intersect_sphere
from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from .compile import Plan

__all__ = [
    "Pairs",
    "Surface",
    "Tile",
    "curvature",
    "find_candidates",
    "intersect_pairs",
    "nearest_hits",
    "positions_in_runs",
    "screen_bounds",
    "split_by_shape_kind",
    "surface",
]


SCREEN_BOUND_PADDING = 2.0**-16
"""Width by which screen-space bounds are enlarged, in pixels: far more than their rounding."""

LONG_RUN_LENGTH = 1_024
"""Mean number of consecutive pairs with the same object from which each run is one call."""

PAIRS_PER_CHUNK = 1 << 13
"""Number of pairs in a chunk, chosen so that what is gathered for them stays in the cache.

Finding occluders took 80 ns a pair in such chunks, and 460 in chunks of a million pairs."""

INNER_HIT_OFFSET = 2.0**-37
"""Distance from the surface at which hits on the inner side of a sphere are placed, in radii.

It keeps them inside by more than the margin `sphere.GRAZE`: the camera is inside as well, so such a
hit is at most two radii away from it."""


@dataclass(frozen=True)
class Tile:
    """Every `step`-th row of the rendered region: interlaced, so that tiles cost about the same.

    Attributes
    ----------
    x, y : (n,) pixel coordinates of the pixels' centres in the image.
    index : (n,) numbers of the pixels in the whole image, which their random numbers depend on.
    first, step : the first row within the region, and the number of rows to the next.
    """

    x: Array
    y: Array
    index: Ints
    first: int
    step: int

    @classmethod
    def make(cls, plan: Plan, first: int, step: int) -> Tile:
        """The tile of rows first, first + step, ... of the rendered region."""
        left, bottom, right, top = plan.region
        j, i = np.mgrid[bottom + first : top : step, left:right]
        i, j = i.ravel(), j.ravel()
        return cls(i + 0.5, j + 0.5, j * plan.picture[0] + i, first, step)


@dataclass(frozen=True)
class Pairs:
    """Candidate pairs of pixels (or points) and objects that may be seen from them.

    Attributes
    ----------
    pixel : (m,) number of the pixel or point within its batch.  item : (m,) number of the object.
    """

    pixel: Ints
    item: Ints

    def take(self, keep: NDArray[np.bool_] | Ints) -> Pairs:
        """The pairs selected by a mask or an index array."""
        return Pairs(self.pixel[keep], self.item[keep])

    def of(self, pixel: Ints, count: int) -> Pairs:
        """The pairs of k chosen pixels. These pairs must be sorted by pixel.

        Parameters
        ----------
        pixel : (k,) chosen pixels.  count : number of pixels in the batch.

        Returns
        -------
        Pairs whose `pixel` is the position of the pixel among the k chosen.
        """
        number = np.bincount(self.pixel, minlength=count)
        first = np.cumsum(number) - number
        copies = number[pixel]
        place = np.repeat(np.arange(pixel.size), copies)
        return Pairs(place, self.item[run_indices(first[pixel], copies)])


def cache_sized_chunks(rows: Ints) -> list[Ints]:
    """Split row numbers into chunks so small that what is gathered for them stays in the cache."""
    return [rows[first : first + PAIRS_PER_CHUNK] for first in range(0, rows.size, PAIRS_PER_CHUNK)]


@dataclass(frozen=True)
class Surface:
    """Surface points that n rays hit.

    Attributes
    ----------
    point : (3, n) metres, relative to the camera.  normal : (3, n) unit, on the viewer's side.
    item : (n,) number of the object.
    inside : (n,) whether the ray hit the inner side of a sphere.
    """

    point: Array
    normal: Array
    item: Ints
    inside: NDArray[np.bool_]

    def take(self, keep: NDArray[np.bool_] | Ints) -> Surface:
        """The surface points selected by a mask or an index array."""
        return Surface(
            columns(self.point, keep),
            columns(self.normal, keep),
            self.item[keep],
            self.inside[keep],
        )


def screen_bounds(plan: Plan) -> Ints:
    """Bounds of objects in pixels, within the region: (left, bottom, right, top), (4, objects).

    The right and top ends are exclusive. An object that intersects the plane through the camera
    parallel to the image may be seen anywhere: its bounds are the whole region. The bounds of an
    object behind that plane are empty.
    """
    lens = plan.lens
    left, bottom, right, top = plan.region
    spans = []
    across, up = _quad_span(plan, lens)
    for step, fixed, low, high, (c, d) in (
        (lens.right, lens.up, left, right, across),
        (lens.up, lens.right, bottom, top, up),
    ):
        a, b = _sphere_span(plan, lens, step, fixed)
        first = np.concatenate([a, c])
        last = np.concatenate([b, d])
        with np.errstate(invalid="ignore"):  # an empty span is (inf, -inf)
            first = np.floor(np.clip(first - SCREEN_BOUND_PADDING, low, high))
            last = np.floor(np.clip(last + SCREEN_BOUND_PADDING, low - 1, high - 1)) + 1.0
        spans.append((first, np.maximum(first, last)))
    (x0, x1), (y0, y1) = spans
    bounds: Ints = np.array([x0, y0, x1, y1]).astype(np.int64)
    return bounds


def _sphere_span(plan: Plan, lens: PinholeCamera, step: Array, fixed: Array) -> tuple[Array, Array]:
    """Least and largest pixel coordinate along `step` of spheres over the shutter, (n,) each.

    The plane through the camera and the pixels of one coordinate x touches the sphere where
    ((base + x step) x fixed . v)^2 = r^2 |(base + x step) x fixed|^2, a quadratic in x. A swept
    sphere is the convex hull of the sphere at both ends of the shutter, and so is its image.
    """
    n0, n1 = cross(lens.base, fixed), cross(step, fixed)
    r = plan.spheres.radius
    first, last = np.full(r.size, np.inf), np.full(r.size, -np.inf)
    ends = (0.0,) if plan.spheres.displacement is None else (-0.5, 0.5)
    index = np.arange(r.size)
    whole = np.zeros(r.size, dtype=np.bool_)
    behind = np.zeros(r.size, dtype=np.int64)
    for time in ends:
        v = plan.spheres.moved(index, time)
        depth = dot(lens.forward[:, None], v)
        a, b = dot(n0[:, None], v), dot(n1[:, None], v)
        qa = b * b - r * r * dot(n1, n1)
        qb = a * b - r * r * dot(n0, n1)
        qc = a * a - r * r * dot(n0, n0)
        ahead = (depth > r) & (qa > 0.0)
        root = np.sqrt(np.maximum(qb * qb - qa * qc, 0.0))
        safe = np.where(ahead, qa, 1.0)
        first = np.where(ahead, np.minimum(first, (-qb - root) / safe), first)
        last = np.where(ahead, np.maximum(last, (-qb + root) / safe), last)
        back = depth < -r
        behind += back
        whole |= ~ahead & ~back
    whole |= (behind > 0) & (behind < len(ends))
    return np.where(whole, -np.inf, first), np.where(whole, np.inf, last)


def _quad_span(plan: Plan, lens: PinholeCamera) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Least and largest x, and least and largest y, in pixels, of quads over the shutter."""
    quads = plan.quads
    count = quads.corner.shape[1]
    ends = (0.0,) if quads.displacement is None else (-0.5, 0.5)
    corners = []
    for time in ends:
        q = quads.moved(np.arange(count), time)
        corners += [q, q + quads.edge_u, q + quads.edge_v, q + quads.edge_u + quads.edge_v]
    depth = np.array([dot(lens.forward[:, None], c) for c in corners])
    behind = (depth <= 0.0).all(axis=0)
    whole = (depth <= 0.0).any(axis=0) & ~behind
    # rows of the inverse of (base, right, up). LAPACK is avoided: its threads spin for 20 ms
    base, right, up = (v[:, None] for v in (lens.base, lens.right, lens.up))
    rows = cross(up, base), cross(base, right)
    volume = dot(base, cross(right, up))
    spans = []
    for row in rows:
        safe = np.where(depth > 0.0, depth, 1.0)
        with np.errstate(over="ignore"):  # a corner in the camera's plane has its image at infinity
            at = np.array([dot(row / volume, c) for c in corners]) / safe
        first = np.where(whole, -np.inf, np.where(behind, np.inf, at.min(axis=0, initial=np.inf)))
        last = np.where(whole, np.inf, np.where(behind, -np.inf, at.max(axis=0, initial=-np.inf)))
        spans.append((first, last))
    return spans[0], spans[1]


def find_candidates(plan: Plan, bounds: Ints, tile: Tile) -> Pairs:
    """The candidate pairs of a tile, sorted by object.

    Parameters
    ----------
    bounds : (4, objects) as `screen_bounds` returns them.
    """
    left, bottom, right, _ = plan.region
    width = right - left
    # the tile's rows are bottom + first + step * k: the range of k for each object, rounded up
    start = bottom + tile.first
    k0 = np.maximum(-((start - bounds[1]) // tile.step), 0)
    k1 = np.maximum(-((start - bounds[3]) // tile.step), 0)
    items = ((bounds[2] > bounds[0]) & (k1 > k0)).nonzero()[0]
    x0, y0 = bounds[0][items], k0[items]
    wide = bounds[2][items] - x0
    count = wide * (k1[items] - y0)
    which = np.repeat(np.arange(items.size), count)
    offset = positions_in_runs(count)
    row, column = np.divmod(offset, wide[which])
    pixel = (y0[which] + row) * width + (x0[which] + column - left)
    return Pairs(pixel, items[which])


def positions_in_runs(size: Ints) -> Ints:
    """0, 1, ..., size - 1 for each run, concatenated: (sum of size,)."""
    return np.arange(size.sum()) - np.repeat(np.cumsum(size) - size, size)


def run_indices(first: Ints, size: Ints) -> Ints:
    """first, first + 1, ..., first + size - 1 for each run, concatenated: (sum of size,)."""
    return np.repeat(first, size) + positions_in_runs(size)


def intersect_pairs(plan: Plan, w: Array, item: Ints, time: Array | float = 0.0) -> Array:
    """Ray parameters of the hits of rays with their candidate objects, inf for a miss.

    Parameters
    ----------
    w : (3, m) or (3, m, k) directions.  item : (m,) objects.
    time : shutter time, a number or (m, k).

    Returns
    -------
    (m,) or (m, k).
    """
    t = np.full(w.shape[1:], np.inf)
    for rows, ids in split_by_shape_kind(plan, item):
        when = time[rows] if isinstance(time, np.ndarray) else time
        part = ids[:, None] if w.ndim == 3 else ids
        if ids[0] < plan.sphere_count:
            v, r = plan.spheres.moved(part, when), plan.spheres.radius[part]
            t[rows] = intersect_sphere(columns(w, rows), v, r)
        else:
            planes = _quad_planes(plan, part - plan.sphere_count, when)
            t[rows] = intersect_quad(columns(w, rows), *planes)
    return t


def split_by_shape_kind(plan: Plan, item: Ints) -> list[tuple[slice | Ints, Ints]]:
    """Split candidate objects (m,) into parts that have one kind of shape each.

    Returns
    -------
    [(rows, objects), ...]. If runs of one object are long on average, each run is a part: its rows
    are a slice, which copies nothing, and `objects` is an array of one element, which broadcasts.
    Otherwise there is one part for spheres and one for quads, with an index array of rows.
    """
    if not item.size:
        return []
    starts = [0, *((item[1:] != item[:-1]).nonzero()[0] + 1).tolist()]
    if item.size >= LONG_RUN_LENGTH * len(starts):
        ends = [*starts[1:], item.size]
        return [(slice(a, b), item[a : a + 1]) for a, b in zip(starts, ends, strict=True)]
    kinds = ((item < plan.sphere_count).nonzero()[0], (item >= plan.sphere_count).nonzero()[0])
    return [(rows, item[rows]) for rows in kinds if rows.size]


def _quad_planes(plan: Plan, ids: Ints, time: Array | float) -> tuple[PlaneNormals, Array, Array]:
    """`edge_planes` of quads from the camera; computed once per quad unless times differ by ray."""
    quads = plan.quads
    if isinstance(time, np.ndarray) and quads.displacement is not None:
        q = quads.moved(ids, time)
        return edge_planes(q, columns(quads.edge_u, ids), columns(quads.edge_v, ids))
    every = np.arange(quads.corner.shape[1])
    when = 0.0 if isinstance(time, np.ndarray) else time
    planes, normal, height = edge_planes(quads.moved(every, when), quads.edge_u, quads.edge_v)
    a, b, c, d = (columns(plane, ids) for plane in planes)
    return (a, b, c, d), columns(normal, ids), height[ids]


def nearest_hits(count: int, pairs: Pairs, t: Array) -> tuple[Array, Ints]:
    """The nearest hit of each of `count` pixels among its candidate pairs.

    Where several objects have the same ray parameter, the one with the lowest number is taken, so
    that the result does not depend on the order of the pairs.

    Returns
    -------
    t : (count,) ray parameter, inf for none.  item : (count,) object, -1 for none.
    """
    best = np.full(count, np.inf)
    np.minimum.at(best, pairs.pixel, t)
    item = np.full(count, np.iinfo(np.int64).max)
    first = ((t == best[pairs.pixel]) & np.isfinite(t)).nonzero()[0]
    np.minimum.at(item, pairs.pixel[first], pairs.item[first])
    return best, np.where(np.isfinite(best), item, -1)


def surface(plan: Plan, w: Array, t: Array, item: Ints, time: Array | float = 0.0) -> Surface:
    """The surface points of hits.

    Parameters
    ----------
    w : (3, n) directions.  t : (n,) finite ray parameters.  item : (n,) objects.
    time : shutter time, a number or (n,).
    """
    point = t * w
    normal = np.empty_like(point)
    inside = np.zeros(item.shape, dtype=np.bool_)
    ball = (item < plan.sphere_count).nonzero()[0]
    if ball.size:
        ids = item[ball]
        center = plan.spheres.moved(ids, _times_at(time, ball))
        out = columns(point, ball) - center
        out /= np.sqrt(dot(out, out))
        # project onto the sphere: the error is then a few roundoffs of its size, not of t w
        within = dot(center, center) < plan.spheres.radius[ids] ** 2
        radius = plan.spheres.radius[ids] * np.where(within, 1.0 - INNER_HIT_OFFSET, 1.0)
        point[:, ball] = center + radius * out
        normal[:, ball] = np.where(within, -out, out)
        inside[ball] = within
    flat = (item >= plan.sphere_count).nonzero()[0]
    if flat.size:
        ids = item[flat] - plan.sphere_count
        unit = cross(plan.quads.edge_u, plan.quads.edge_v)
        unit /= np.sqrt(dot(unit, unit))
        across = columns(unit, ids)
        away = dot(across, columns(w, flat)) > 0.0
        normal[:, flat] = np.where(away, -across, across)
    return Surface(point, normal, item, inside)


def _times_at(time: Array | float, rows: Ints) -> Array | float:
    return time[rows] if isinstance(time, np.ndarray) else time


def curvature(plan: Plan, surface: Surface) -> Array:
    """Curvature (n,) of the surfaces, 1 / m; 0 on planes and where no object is given (-1)."""
    bend = np.zeros(surface.item.size)
    ball = ((surface.item >= 0) & (surface.item < plan.sphere_count)).nonzero()[0]
    bend[ball] = 1.0 / plan.spheres.radius[surface.item[ball]]
    return bend
