# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the edges of a mesh's picture cross horizontal lines within pixels."""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Ints
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.vector import cross, dot
from ..camera import PinholeCamera
from .faces import MeshFaces
from .raster import NEAREST, PixelWindow, meeting_pixels

__all__ = ["edges_on_lines"]


def edges_on_lines(
    mesh: MeshFaces, camera: PinholeCamera, x: Ints, y: Ints, count: int
) -> tuple[Ints, Array]:
    """Crossings of `count` lines in each of n pixels by outlines, borders and creases.

    Lines lie at heights (j + 0.5) / count within a pixel. Edges that others hide are included.

    Parameters
    ----------
    x, y : (n,) pixel coordinates, ascending by y and x or in any other order.

    Returns
    -------
    line : (m,) number of the line, pixel * count + j.  place : (m,) from 0 to 1 along it.
    """
    edges = mesh.edges
    window = PixelWindow.around(x, y)
    number = np.full(window.width * window.height, -1)
    number[(y - window.bottom) * window.width + (x - window.left)] = np.arange(x.size)
    chosen = edges.seen_from_origin(mesh.vertices)
    ends = [columns(mesh.vertices, edges.ends[k, chosen]) for k in range(2)]
    edge, pixel, _, _ = meeting_pixels(ends, camera, window)
    own = number[pixel]
    kept = (own >= 0).nonzero()[0]
    edge, own = edge[kept], own[kept]
    (xa, ya), (xb, yb) = _on_picture([columns(end, edge) for end in ends], camera)
    # coordinates within the pixels
    xa, xb, ya, yb = xa - x[own], xb - x[own], ya - y[own], yb - y[own]
    first, last = (
        np.clip(np.ceil(each * count - 0.5), 0, count).astype(np.int64)
        for each in (np.minimum(ya, yb), np.maximum(ya, yb))
    )
    crossed = last - first
    row = np.repeat(np.arange(own.size), crossed)
    line = first[row] + np.arange(row.size) - np.repeat(np.cumsum(crossed) - crossed, crossed)
    part = ((line + 0.5) / count - ya[row]) / (yb - ya)[row]
    place = xa[row] + part * (xb - xa)[row]
    inside = ((place > 0.0) & (place < 1.0)).nonzero()[0]
    return own[row[inside]] * count + line[inside], place[inside]


def _on_picture(ends: list[Array], camera: PinholeCamera) -> list[tuple[Array, Array]]:
    """Pixel coordinates of segments' ends (3, m), moved before the camera where they are not."""
    axis = cross(camera.right, camera.up)[:, None]
    axis = axis / float(dot(camera.base[:, None], axis)[0])
    depths = [dot(axis, end) for end in ends]
    least = NEAREST * max(float(max(depth.max(initial=0.0) for depth in depths)), TINY)
    found = []
    for one, other in ((0, 1), (1, 0)):
        low = depths[one] < least
        rise = np.where(low, depths[other] - depths[one], 1.0)
        part = np.where(low, (least - depths[one]) / np.where(rise != 0.0, rise, 1.0), 0.0)
        place = ends[one] + part * (ends[other] - ends[one])
        depth = np.where(low, least, depths[one])
        found.append(
            tuple(
                dot(step[:, None], place) / depth / dot(step, step)
                - dot(step, camera.base) / dot(step, step)
                for step in (camera.right, camera.up)
            )
        )
    return [(x, y) for x, y in found]
