# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage of pixels by meshes at rest.

In a pixel that no outline, border or crease crosses, each sheet of the mesh is met by all rays or
by none, and what lies behind a sheet that covers the pixel does not matter. So the centre ray tells
whether the mesh covers it, and the faces in the pixel bound its depths: faces of one sheet that
meet in the pixel have depths that overlap, so the visible sheet lies within the first group of
overlapping intervals of depth. If the centre ray meets another sheet in that group, sheets may
cross each other, and the pixel counts as cut.
"""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.gather import columns
from ...numerics.vector import dot
from ..camera import PinholeCamera
from ..pixel_coverage import PixelCoverage
from .faces import MeshFaces
from .raster import PixelWindow, meeting_rectangles

__all__ = ["depth_bounds", "edge_depths", "may_meet", "mesh_coverage", "pixel_coordinates"]


DEPTH_MARGIN = 1e-6
"""Margin of the bounds on depths, as a fraction of the mesh's size in depth: more than the depth by
which embree's rounding may move a hit."""


def mesh_coverage(mesh: MeshFaces, w: Array, camera: PinholeCamera) -> PixelCoverage:
    """Coverage of m pixels by a mesh at rest; w (3, m) are directions through their centres."""
    m = w.shape[1]
    if not mesh.faces.size:
        none = np.zeros(m, dtype=np.bool_)
        return PixelCoverage(none, none.copy(), np.full(m, np.inf), np.full(m, np.inf))
    x, y = pixel_coordinates(w, camera)
    window = PixelWindow.around(x, y)
    place = (y - window.bottom) * window.width + (x - window.left)
    near, far, met = depth_bounds(mesh, camera, window, place)
    # edges behind the first group of depths are hidden: no sheet of that group ends in the pixel
    cut = edge_depths(mesh, camera, window)[place] <= far
    start = np.zeros((3, m))
    rows = (met & ~cut).nonzero()[0]
    t = np.full(m, np.inf)
    t[rows] = mesh.intersect(start[:, rows], columns(w, rows))
    covers = np.isfinite(t)
    rows = covers.nonzero()[0]
    second = mesh.second_hits(columns(w, rows), t[rows])
    covers[rows[second <= far[rows]]] = False
    return PixelCoverage(met, covers, near, np.where(covers, far, np.inf))


def may_meet(mesh: MeshFaces, w: Array, camera: PinholeCamera) -> tuple[Mask, Array]:
    """Whether faces may be seen in m pixels, and a lower bound on their depths, inf for none.

    w : (3, m) directions through the pixels' centres. Faces count by their bounding rectangles.
    """
    m = w.shape[1]
    if not mesh.faces.size:
        return np.zeros(m, dtype=np.bool_), np.full(m, np.inf)
    x, y = pixel_coordinates(w, camera)
    window = PixelWindow.around(x, y)
    corners = [columns(mesh.vertices, each) for each in mesh.faces]
    met, near = meeting_rectangles(corners, camera, window)
    found = met[y - window.bottom, x - window.left]
    return found, np.where(found, near, np.inf)


def pixel_coordinates(w: Array, camera: PinholeCamera) -> tuple[Ints, Ints]:
    """Pixels (m,) whose centres directions (3, m) pass through."""
    away = w - camera.base[:, None]
    x = dot(camera.right[:, None], away) / dot(camera.right, camera.right)
    y = dot(camera.up[:, None], away) / dot(camera.up, camera.up)
    return np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)


def edge_depths(mesh: MeshFaces, camera: PinholeCamera, window: PixelWindow) -> Array:
    """Lower bounds on the depths of edges of the picture in a window's pixels; inf for none."""
    edges = mesh.on_picture(camera).edges
    depth = np.full(window.width * window.height, np.inf)
    for part in edges.parts(window):
        edge, pixel = edges.meeting_pixels(part)
        np.minimum.at(depth, window.within(part)[pixel], edges.near[edge])
    return depth


def depth_bounds(
    mesh: MeshFaces, camera: PinholeCamera, window: PixelWindow, place: Ints
) -> tuple[Array, Array, Mask]:
    """Bounds (m,) on the depths of the visible sheet in pixels, and where any face may be.

    place : (m,) numbers of the pixels in the window.
    """
    number = np.full(window.width * window.height, -1)
    number[place] = np.arange(place.size)
    near, far = np.full(place.size, np.inf), np.full(place.size, -np.inf)
    faces = mesh.on_picture(camera).faces
    slack = DEPTH_MARGIN * float((faces.far - faces.near).max(initial=0.0) + np.ptp(faces.near))
    for part in faces.parts(window):
        _enter_depths(mesh, camera, part, number[window.within(part)], slack, (near, far))
    met = np.isfinite(near)
    return np.where(met, np.maximum(near, 0.0), np.inf), far, met


def _enter_depths(
    mesh: MeshFaces,
    camera: PinholeCamera,
    window: PixelWindow,
    number: Ints,
    slack: float,
    bounds: tuple[Array, Array],
) -> None:
    """Enter bounds on the depths of the visible sheet in pixels of a window; see `depth_bounds`.

    number : (pixels of the window,) positions in `bounds`, -1 for none.
    slack : width by which the depths of faces are enlarged.
    """
    (near, far), faces = bounds, mesh.on_picture(camera).faces
    face, pixel = faces.meeting_pixels(window)
    own = number[pixel]
    kept = (own >= 0).nonzero()[0]
    own, face = own[kept], face[kept]
    low, high = _within_pixels(mesh, camera, window, pixel[kept], face, (faces.near, faces.far))
    low, high = low - slack, high + slack
    np.minimum.at(near, own, low)
    # the end of the first group of overlapping intervals: raised while an interval begins before it
    order = np.lexsort((low, own))
    own, low, high = own[order], low[order], high[order]
    begins = np.append(True, own[1:] != own[:-1])
    reached = _running_max(high, begins)
    gap = ~begins & (low > np.append(np.inf, reached[:-1]))
    group = np.cumsum(begins | gap)
    first = group == group[begins.nonzero()[0]][np.cumsum(begins) - 1] if own.size else gap
    np.maximum.at(far, own[first], high[first])


def _running_max(values: Array, begins: Mask) -> Array:
    """Largest value so far in each run; `begins` marks the first of each."""
    if not values.size:
        return values
    # ranks are integers, so runs can be told apart exactly
    order = np.argsort(values, kind="stable")
    rank = np.empty(values.size, dtype=np.int64)
    rank[order] = np.arange(values.size)
    run = np.cumsum(begins)
    top = np.maximum.accumulate(rank + run * values.size) - run * values.size
    found: Array = values[order[top]]
    return found


def _within_pixels(
    mesh: MeshFaces,
    camera: PinholeCamera,
    window: PixelWindow,
    pixel: Ints,
    face: Ints,
    bounds: tuple[Array, Array],
) -> tuple[Array, Array]:
    """Bounds (m,) on the depths of faces within pixels, by their corners and by their planes."""
    normal, corner = mesh.planes
    y, x = np.divmod(pixel, window.width)
    w = camera.directions(x + window.left + 0.5, y + window.bottom + 0.5)
    n = columns(normal, face)
    slope, spread = camera.linear_range(w, n)
    height = dot(normal, corner)[face]
    side = np.where(slope < 0.0, -1.0, 1.0)
    slope, height = side * slope, side * height
    known = slope > spread * (1.0 + 1e-9)
    safe = np.where(known, slope - spread, 1.0)
    low = np.where(known, np.minimum(height / (slope + spread), height / safe), -np.inf)
    high = np.where(known, np.maximum(height / (slope + spread), height / safe), np.inf)
    return np.maximum(low, bounds[0][face]), np.minimum(high, bounds[1][face])
