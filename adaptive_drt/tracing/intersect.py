# SPDX-License-Identifier: GPL-3.0-or-later
"""Camera rays: the candidate objects of each pixel, and the nearest hit among them.

There is no acceleration structure for camera rays. The screen-space bounds of each object over the
whole shutter give the pairs (pixel, object) that have to be tested. The same pairs are used for the
centre ray, for detection and for the distributed rays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..geometry.footprint import Footprint
from ..geometry.receivers import Receivers
from ..geometry.smooth_surface import SmoothSurface
from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns
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
    "receivers_of",
    "screen_bounds",
    "surface",
]


SCREEN_BOUND_PADDING = 2.0**-16
"""Width by which screen-space bounds are enlarged, in pixels: far more than their rounding."""
PAIRS_PER_CHUNK = 1 << 13
"""Number of pairs in a chunk, chosen so that what is gathered for them stays in the cache.

Finding occluders took 80 ns a pair in such chunks, and 460 in chunks of a million pairs."""


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
        return cls(i + 0.5, j + 0.5, j * plan.resolution[0] + i, first, step)


@dataclass(frozen=True)
class Pairs:
    """Candidate pairs of pixels (or points) and objects that may be seen from them.

    Attributes
    ----------
    pixel : (m,) number of the pixel or point within its batch.  item : (m,) number of the object.
    """

    pixel: Ints
    item: Ints

    def take(self, keep: NDArray[np.bool_] | Ints | slice) -> Pairs:
        """The pairs selected by a mask, an index array or a slice."""
        return Pairs(self.pixel[keep], self.item[keep])

    def numbered(self, count: int) -> tuple[Ints, Pairs]:
        """The pixels, of `count` in all, that have a pair, and the pairs with them numbered."""
        some = np.zeros(count, dtype=np.bool_)
        some[self.pixel] = True
        return some.nonzero()[0], Pairs((some.cumsum() - 1)[self.pixel], self.item)

    def for_pixels(self, pixel: Ints, count: int) -> Pairs:
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
    inside : (n,) whether the object may hide light from the point: see `ShapeSet.surface`.
    smooth : the smooth surfaces that facets stand for; None if there are none.
    """

    point: Array
    normal: Array
    item: Ints
    inside: NDArray[np.bool_]
    smooth: SmoothSurface | None = None

    def take(self, keep: NDArray[np.bool_] | Ints) -> Surface:
        """The surface points selected by a mask or an index array."""
        return Surface(
            columns(self.point, keep),
            columns(self.normal, keep),
            self.item[keep],
            self.inside[keep],
            None if self.smooth is None else self.smooth.take(keep),
        )

    def without_smooth(self) -> Surface:
        """The same points, as points of their facets: shadow rays begin there."""
        return self if self.smooth is None else replace(self, smooth=None)


def receivers_of(
    surface: Surface,
    pairs: Pairs,
    reach: Array | None = None,
    footprint: Footprint | None = None,
) -> Receivers:
    """The surface points of m pairs, as shapes are asked about them.

    Parameters
    ----------
    surface : n points.  reach : (n,) metres of the patches around them; None for 0.
    footprint : the footprints of the n pixels that show them, or None.
    """
    at = pairs.pixel
    return Receivers(
        point=columns(surface.point, at),
        own=pairs.item == surface.item[at],
        reach=np.zeros(at.size) if reach is None else reach[at],
        footprint=footprint,
        at=at,
    )


def screen_bounds(plan: Plan) -> Ints:
    """Bounds of objects in pixels, within the region: (left, bottom, right, top), (4, objects).

    The right and top ends are exclusive. An object that intersects the plane through the camera
    parallel to the image may be seen anywhere: its bounds are the whole region. The bounds of an
    object behind that plane are empty, and so are those of objects that the camera does not see.
    """
    left, bottom, right, top = plan.region
    kinds = [shapes.screen_span(plan.lens) for shapes in plan.shapes.sets]
    spans = []
    for axis, low, high in ((0, left, right), (1, bottom, top)):
        first = np.concatenate([span[axis][0] for span in kinds])
        last = np.concatenate([span[axis][1] for span in kinds])
        with np.errstate(invalid="ignore"):  # an empty span is (inf, -inf)
            first = np.floor(np.clip(first - SCREEN_BOUND_PADDING, low, high))
            last = np.floor(np.clip(last + SCREEN_BOUND_PADDING, low - 1, high - 1)) + 1.0
        spans.append((first, np.maximum(first, last)))
    (x0, x1), (y0, y1) = spans
    if plan.seen is not None:
        x1 = np.where(plan.seen, x1, x0)
    bounds: Ints = np.array([x0, y0, x1, y1]).astype(np.int64)
    return bounds


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
    for shapes, rows, index in plan.shapes.runs(item):
        when = time[rows] if isinstance(time, np.ndarray) else time
        part = index[:, None] if w.ndim == 3 else index
        t[rows] = shapes.intersect(part, columns(w, rows), when)
    return t


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
    smooth = None
    for shapes, rows, index in plan.shapes.groups(item):
        when = time[rows] if isinstance(time, np.ndarray) else time
        own, over = shapes.smooth_surface(index, columns(w, rows), columns(point, rows), when)
        point[:, rows], normal[:, rows], inside[rows] = own
        if over is not None:
            smooth = smooth or SmoothSurface(np.zeros_like(point), np.zeros_like(point))
            smooth.rise[:, rows], smooth.facet[:, rows] = over.rise, over.facet
    return Surface(point, normal, item, inside, smooth)


def curvature(plan: Plan, surface: Surface) -> Array:
    """Bounds (n,) on the curvature of the surfaces, 1 / m; 0 on planes and where no object is given
    (-1)."""
    return plan.shapes.curvature_at(surface.item, surface.point, certain=True)
