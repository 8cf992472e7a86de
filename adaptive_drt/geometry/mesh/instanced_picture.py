# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances of a mesh on the picture of a camera: what they cover, and where their edges are.

The largest instances on the picture are drawn face by face, up to a number of faces that bounds
memory. Of all others only rectangles are known: an edge may be anywhere within them. Which
instances these are depends on the camera alone, so that all parts of a picture agree.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.gather import columns
from ...numerics.vector import dot
from ..camera import PinholeCamera
from ..pixel_coverage import PixelCoverage
from ..shape import ball_span
from .faces import MeshFaces
from .pixel_coverage import depth_bounds, edge_depths, pixel_coordinates
from .raster import PIXEL_MARGIN, PixelWindow

__all__ = ["InstancedPicture"]


MOST_DRAWN_FACES = 1 << 18
"""Number of faces of all instances that are drawn face by face."""
LEAST_AREA = 32.0
"""Area in pixels of the rectangle around an instance from which it is drawn face by face: nearly
all pixels of smaller ones have an edge."""
SMALL_AREA = 64
"""Number of pixels of a rectangle up to which all of its pixels are listed."""


class Instances(Protocol):
    """What is asked of the instances of a mesh: see `InstancedFaces`."""

    @property
    def is_empty(self) -> bool:
        """Whether there are no faces."""

    @property
    def face_count(self) -> int:
        """Number of faces of one instance."""

    @property
    def balls(self) -> tuple[Array, Array]:
        """Balls around the instances."""

    def baked(self, some: Ints) -> MeshFaces:
        """Some of the instances as a mesh of their own."""

    def intersect(self, start: Array, w: Array) -> Array:
        """Ray parameters of first hits."""

    def second_hits(self, w: Array, t: Array) -> Array:
        """Ray parameters of the hits behind first ones."""


@dataclass(frozen=True)
class InstancedPicture:
    """Instances on the picture of a camera.

    Attributes
    ----------
    bounds : (4, n) columns and rows of pixels: left, bottom, right, top, of which the last two are
        exclusive, around each instance.  near : (n,) lower bounds on their depths.
    drawn : those instances that are drawn, as one mesh; None for none.  rest : (k,) the others.
    """

    camera: PinholeCamera
    bounds: Array
    near: Array
    drawn: MeshFaces | None
    rest: Ints

    @classmethod
    def make(cls, faces: Instances, camera: PinholeCamera) -> InstancedPicture:
        """Project the instances as they are at mid-shutter."""
        center, radius = faces.balls
        spans = [
            ball_span(camera, step, fixed, [center], radius)
            for step, fixed in ((camera.right, camera.up), (camera.up, camera.right))
        ]
        low = np.floor(np.array([span[0] for span in spans]) - PIXEL_MARGIN)
        high = np.floor(np.array([span[1] for span in spans]) + PIXEL_MARGIN) + 1.0
        near = np.maximum(dot(camera.forward[:, None], center) - radius, 0.0)
        # the picture is about twice as large as what lies between its corner and the camera's axis
        middle = _on_axis(camera)
        inside = [np.clip(each, -middle[:, None], 3.0 * middle[:, None]) for each in (low, high)]
        area = np.maximum(inside[1] - inside[0], 0.0).prod(axis=0)
        order = np.argsort(-area, kind="stable")
        most = MOST_DRAWN_FACES // max(faces.face_count, 1)
        chosen = np.sort(order[:most][area[order[:most]] >= LEAST_AREA])
        rest = np.setdiff1d(np.arange(area.size), chosen)
        drawn = faces.baked(chosen) if chosen.size else None
        if drawn is not None and drawn.is_empty:
            drawn = None
        return cls(camera, np.concatenate([low, high]), near, drawn, rest)

    def coverage(self, faces: Instances, w: Array) -> PixelCoverage:
        """See `InstancedFaces.coverage`."""
        m = w.shape[1]
        if faces.is_empty:
            none = np.zeros(m, dtype=np.bool_)
            return PixelCoverage(none, none.copy(), np.full(m, np.inf), np.full(m, np.inf))
        x, y = pixel_coordinates(w, self.camera)
        window = PixelWindow.around(x, y)
        place = (y - window.bottom) * window.width + (x - window.left)
        near, far = np.full(m, np.inf), np.full(m, -np.inf)
        met = np.zeros(m, dtype=np.bool_)
        edge = self._least_depths(self.rest, window)[place]
        lone = np.isfinite(edge)
        if self.drawn is not None:
            near, far, met = depth_bounds(self.drawn, self.camera, window, place)
            edge = np.minimum(edge, edge_depths(self.drawn, self.camera, window)[place])
        rows = (met & (edge > far)).nonzero()[0]
        t = np.full(m, np.inf)
        start = np.zeros((3, rows.size))
        t[rows] = faces.intersect(start, columns(w, rows))
        covers = np.isfinite(t)
        rows = covers.nonzero()[0]
        second = faces.second_hits(columns(w, rows), t[rows])
        covers[rows[second <= far[rows]]] = False
        near = np.where(lone, np.minimum(near, edge), near)
        return PixelCoverage(met | lone, covers, near, np.where(covers, far, np.inf))

    def may_meet(self, w: Array) -> tuple[Mask, Array]:
        """See `InstancedFaces.may_meet`."""
        x, y = pixel_coordinates(w, self.camera)
        window = PixelWindow.around(x, y)
        every = np.arange(self.near.size)
        place = (y - window.bottom) * window.width + (x - window.left)
        near = self._least_depths(every, window)[place]
        return np.isfinite(near), near

    def _least_depths(self, some: Ints, window: PixelWindow) -> Array:
        """Least depth of the rectangles of instances in each pixel of a window; inf for none."""
        depth = np.full(window.width * window.height, np.inf)
        sides = (
            window.left,
            window.bottom,
            window.left + window.width,
            window.bottom + window.height,
        )
        bounds = columns(self.bounds, some)
        left, right = (np.clip(bounds[k], sides[0], sides[2]) - sides[0] for k in (0, 2))
        bottom, top = (np.clip(bounds[k], sides[1], sides[3]) - sides[1] for k in (1, 3))
        area = np.maximum(right - left, 0.0) * np.maximum(top - bottom, 0.0)
        small = ((area > 0.0) & (area <= SMALL_AREA)).nonzero()[0]
        size = area[small].astype(np.int64)
        one = np.repeat(small, size)
        number = np.arange(one.size) - np.repeat(np.cumsum(size) - size, size)
        row, column = np.divmod(number, (right - left)[one].astype(np.int64))
        pixel = (bottom[one] + row) * window.width + left[one] + column
        np.minimum.at(depth, pixel.astype(np.int64), self.near[some[one]])
        picture = depth.reshape(window.height, window.width)
        for one_large in (area > SMALL_AREA).nonzero()[0].tolist():
            x0, x1, y0, y1 = (int(side[one_large]) for side in (left, right, bottom, top))
            part = picture[y0:y1, x0:x1]
            np.minimum(part, self.near[some[one_large]], out=part)
        return depth


def _on_axis(camera: PinholeCamera) -> Array:
    """Pixel coordinates (2,) of the point on the camera's axis, at least 1."""
    away = camera.forward - camera.base
    place = [dot(step, away) / dot(step, step) for step in (camera.right, camera.up)]
    return np.maximum(np.array(place), 1.0)
