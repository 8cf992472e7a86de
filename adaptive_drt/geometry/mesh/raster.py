# SPDX-License-Identifier: GPL-3.0-or-later
"""Conservative rasters of convex polygons: all pixels whose square they may meet.

A polygon is cut at a plane before the camera and projected; in each row of pixels its part within
the row's band has an exact interval of x, which is widened by more than rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.vector import cross, dot
from ..camera import PinholeCamera

__all__ = [
    "NEAREST",
    "PIXEL_MARGIN",
    "PixelWindow",
    "ProjectedPolygons",
    "meeting_pixels",
    "meeting_rectangles",
]


PIXEL_MARGIN = 2.0**-16
"""Width by which polygons are enlarged, in pixels: far more than their rounding."""
COORDINATE_ROUNDING = 2.0**-44
"""The same for pixel coordinates of large magnitude, relative to them."""
MOST_PAIRS = 1 << 22
"""Number of pairs of polygons and pixels that are to be found at once: each takes some 150 bytes
while depths are compared."""
NEAREST = 2.0**-24
"""Depth at which polygons are cut, as a fraction of the largest depth of a vertex."""


@dataclass(frozen=True)
class PixelWindow:
    """A rectangle of pixels.

    Attributes
    ----------
    left, bottom : the lowest pixel coordinates.  width, height : numbers of pixels.
    """

    left: int
    bottom: int
    width: int
    height: int

    @classmethod
    def around(cls, x: Ints, y: Ints) -> PixelWindow:
        """The least window that holds some pixels."""
        left, bottom = int(x.min()), int(y.min())
        return cls(left, bottom, int(x.max()) - left + 1, int(y.max()) - bottom + 1)

    def halves(self) -> list[PixelWindow]:
        """Two halves of a window of several pixels, across its longer side."""
        left, bottom, width, height = self.left, self.bottom, self.width, self.height
        if width > height:
            half = width // 2
            sides = (left, bottom, half, height), (left + half, bottom, width - half, height)
        else:
            half = height // 2
            sides = (left, bottom, width, half), (left, bottom + half, width, height - half)
        return [PixelWindow(*each) for each in sides]

    def within(self, part: PixelWindow) -> Ints:
        """Numbers in this window of the pixels of a part of it, row by row."""
        first = (part.bottom - self.bottom) * self.width + (part.left - self.left)
        down, across = np.arange(part.height)[:, None], np.arange(part.width)
        number: Ints = first + self.width * down + across
        return number.ravel()


def meeting_pixels(
    corners: list[Array], camera: PinholeCamera, window: PixelWindow
) -> tuple[Ints, Ints, Array, Array]:
    """Pairs of polygons and pixels of a window in which they may be seen.

    Parameters
    ----------
    corners : the k corners (3, n) of n convex polygons, two for segments, metres.

    Returns
    -------
    polygon : (m,) indices.  pixel : (m,) numbers in the window, row by row.
    near, far : (n,) least and greatest depths of the polygons before the camera: ray parameters.
    """
    polygons = ProjectedPolygons.make(corners, camera)
    return *polygons.meeting_pixels(window), polygons.near, polygons.far


@dataclass(frozen=True)
class ProjectedPolygons:
    """n convex polygons of k corners on the picture of a camera.

    Attributes
    ----------
    seen : (s,) those before the camera.
    x, y : (2 k, s) pixel coordinates of their corners: see `_projected`.
    margin : (s,) width by which they are enlarged, in pixels.
    first, last, left, right : (s,) rows and columns that bound them, the ends exclusive.
    near, far : (n,) least and greatest depths before the camera: ray parameters.
    """

    seen: Ints
    x: Array
    y: Array
    margin: Array
    first: Array
    last: Array
    left: Array
    right: Array
    near: Array
    far: Array

    @classmethod
    def make(cls, corners: list[Array], camera: PinholeCamera) -> ProjectedPolygons:
        """Project polygons, given by their corners (3, n)."""
        depths, cut = _depths(corners, camera)
        near, far = np.maximum(depths.min(axis=0), 0.0), depths.max(axis=0)
        seen = (far > cut).nonzero()[0]
        points = [columns(corner, seen) for corner in corners]
        xs, ys = _projected(points, depths[:, seen], cut, camera)
        size = np.maximum(np.abs(xs), np.abs(ys)).max(axis=0)
        margin = PIXEL_MARGIN + COORDINATE_ROUNDING * size
        first, left = (np.floor(each.min(axis=0) - margin) for each in (ys, xs))
        last, right = (np.floor(each.max(axis=0) + margin) + 1.0 for each in (ys, xs))
        return cls(seen, xs, ys, margin, first, last, left, right, near, far)

    def parts(self, window: PixelWindow) -> list[PixelWindow]:
        """Parts of a window in which there are at most `MOST_PAIRS` pairs, or single pixels."""
        if window.width * window.height <= 1 or self._most_pairs(window) <= MOST_PAIRS:
            return [window]
        return [part for half in window.halves() for part in self.parts(half)]

    def _most_pairs(self, window: PixelWindow) -> float:
        """Number of pairs of polygons' bounding rectangles and pixels of a window."""
        some = self._near_window(window)
        end, top = window.left + window.width, window.bottom + window.height
        wide = np.minimum(self.right[some], end) - np.maximum(self.left[some], window.left)
        high = np.minimum(self.last[some], top) - np.maximum(self.first[some], window.bottom)
        return float(wide @ high)

    def _near_window(self, window: PixelWindow) -> Ints:
        """Those polygons whose bounding rectangles meet a window."""
        end, top = window.left + window.width, window.bottom + window.height
        inside = (self.right > window.left) & (self.left < end)
        some: Ints = (inside & (self.last > window.bottom) & (self.first < top)).nonzero()[0]
        return some

    def meeting_pixels(self, window: PixelWindow) -> tuple[Ints, Ints]:
        """Pairs of polygons and pixels of a window: see the function `meeting_pixels`."""
        end, top = window.left + window.width, window.bottom + window.height
        some = self._near_window(window)
        first: Array = np.maximum(self.first[some], window.bottom)
        rows = (np.minimum(self.last[some], top) - first).astype(np.int64)
        one = np.repeat(np.arange(some.size), rows)
        y = first[one] + _positions(rows)
        one = some[one]
        margin = self.margin[one]
        x0, x1 = _spans(columns(self.x, one), columns(self.y, one), y, margin)
        left = np.clip(np.floor(x0 - margin), window.left, end)
        right = np.clip(np.floor(x1 + margin) + 1.0, window.left, end)
        wide = np.maximum(right - left, 0.0).astype(np.int64)
        start = (y - window.bottom) * window.width + (left - window.left)
        pixel = np.repeat(start.astype(np.int64), wide) + _positions(wide)
        return np.repeat(self.seen[one], wide), pixel


def meeting_rectangles(
    corners: list[Array], camera: PinholeCamera, window: PixelWindow
) -> tuple[Mask, float]:
    """Pixels (height, width) of a window that the bounding rectangle of a polygon meets, and the
    least depth of any polygon before the camera.

    The parameters are those of `meeting_pixels`.
    """
    depths, cut = _depths(corners, camera)
    seen = (depths.max(axis=0) > cut).nonzero()[0]
    points = [columns(corner, seen) for corner in corners]
    xs, ys = _projected(points, depths[:, seen], cut, camera)
    margin = PIXEL_MARGIN + COORDINATE_ROUNDING * np.maximum(np.abs(xs), np.abs(ys)).max(axis=0)
    bounds = []
    for values, low, size in ((xs, window.left, window.width), (ys, window.bottom, window.height)):
        first = np.floor(values.min(axis=0) - margin) - low
        last = np.floor(values.max(axis=0) + margin) + 1.0 - low
        bounds += [np.clip(each, 0, size).astype(np.int64) for each in (first, last)]
    left, right, bottom, top = bounds
    # sums of signs at the corners of rectangles are the numbers of rectangles over each pixel
    wide = window.width + 1
    change = np.zeros((window.height + 1) * wide)
    for row, column, sign in (
        (bottom, left, 1),
        (bottom, right, -1),
        (top, left, -1),
        (top, right, 1),
    ):
        change += sign * np.bincount(row * wide + column, minlength=change.size)
    count = change.reshape(window.height + 1, wide).cumsum(axis=0).cumsum(axis=1)
    met: Mask = count[:-1, :-1] > 0.5
    return met, max(float(depths.min(initial=np.inf)), 0.0)


def _depths(corners: list[Array], camera: PinholeCamera) -> tuple[Array, float]:
    """Depths (k, n) of polygons' corners before the camera, and the depth at which they are cut."""
    across = cross(camera.right, camera.up)[:, None]
    depths = np.array([dot(corner, across) for corner in corners])
    depths /= float(dot(camera.base[:, None], across)[0])
    return depths, NEAREST * max(float(depths.max(initial=0.0)), TINY)


def _positions(size: Ints) -> Ints:
    """0, 1, ..., size - 1 for each run, concatenated."""
    found: Ints = np.arange(size.sum()) - np.repeat(np.cumsum(size) - size, size)
    return found


def _projected(
    points: list[Array], depths: Array, cut: float, camera: PinholeCamera
) -> tuple[Array, Array]:
    """Pixel coordinates x and y, (2 k, n) each, of the corners of what lies before a depth.

    Each edge gives both of its ends, moved along it to that depth where they lie before it. Where
    both do, those of the edge before are repeated.
    """
    k = len(points)
    xs, ys = np.empty((2, 2 * k, points[0].shape[1]))
    steps = [step / dot(step, step) for step in (camera.right, camera.up)]
    for number in range(k):
        for side, (own, other) in enumerate(
            ((number, (number + 1) % k), ((number + 1) % k, number))
        ):
            a, b, ta, tb = points[own], points[other], depths[own], depths[other]
            behind = ta < cut
            part = np.where(behind & (tb > cut), (cut - ta) / np.where(tb > ta, tb - ta, 1.0), 0.0)
            place, depth = a + part * (b - a), np.where(behind, cut, ta)
            gone = behind & (tb <= cut)
            for values, step in ((xs, steps[0]), (ys, steps[1])):
                at = dot(step[:, None], place) / depth - dot(step, camera.base)
                values[2 * number + side] = np.where(gone, np.nan, at)
    for number in range(4 * k):
        one, before = number % (2 * k), (number - 1) % (2 * k)
        hole = np.isnan(xs[one])
        xs[one], ys[one] = (np.where(hole, v[before], v[one]) for v in (xs, ys))
    return xs, ys


def _spans(xs: Array, ys: Array, row: Array, margin: Array) -> tuple[Array, Array]:
    """Least and largest x (m,) of polygons within bands of y from `row` to `row` + 1,
    widened by `margin` (m,).

    xs, ys : (c, m) corners in order.
    """
    low, high = row - margin, row + 1.0 + margin
    least, most = np.full(row.size, np.inf), np.full(row.size, -np.inf)
    for number in range(len(xs)):
        xa, ya = xs[number], ys[number]
        xb, yb = xs[(number + 1) % len(xs)], ys[(number + 1) % len(xs)]
        slope = (xb - xa) / np.where(yb != ya, yb - ya, 1.0)
        meets = (np.minimum(ya, yb) <= high) & (np.maximum(ya, yb) >= low)
        for bound in (np.clip(ya, low, high), np.clip(yb, low, high)):
            x = np.clip(xa + (bound - ya) * slope, np.minimum(xa, xb), np.maximum(xa, xb))
            x = np.where(yb != ya, x, xa)
            least = np.where(meets, np.minimum(least, x), least)
            most = np.where(meets, np.maximum(most, x), most)
    return least, most
