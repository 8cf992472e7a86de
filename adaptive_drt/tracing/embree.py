# SPDX-License-Identifier: GPL-3.0-or-later
"""The only file that knows embreex: it finds candidates, and float64 decides.

Each object stands as a closed proxy of triangles around its bounding sphere, inflated by all
that float32 may lose. embreex returns the nearest triangle only and has no minimum distance,
so a ray is sent on from behind each hit until nothing is left before its end.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..numerics.arrays import Array, Ints

__all__ = ["ProxyScene"]


GOLDEN = (1.0 + 5.0**0.5) / 2.0
ICOSAHEDRON_INSPHERE = 0.7946544722917661
"""Radius of the sphere inside an icosahedron whose corners lie on the unit sphere."""
FLOAT32_ROUNDOFF = 2.0**-24
INFLATION = 64.0 * FLOAT32_ROUNDOFF
"""Relative to the scene's size: rounding of corners, rays and hits in float32, generously."""
ADVANCE = 16.0 * FLOAT32_ROUNDOFF
"""Relative to the scene's size: how far behind a hit a ray goes on. A proxy that is entered in this
gap is met on its far side; one that is left in it as well is only grazed, within INFLATION."""


class ProxyScene:
    """Bounding spheres as embree sees them."""

    def __init__(self, center: Array, radius: Array) -> None:
        """Build the proxies.

        Parameters
        ----------
        center : (3, n) metres.  radius : (n,) metres.
        """
        from embreex import rtcore_scene  # the native library loads on the first use only
        from embreex.mesh_construction import TriangleMesh

        low = (center - radius).min(axis=1)
        high = (center + radius).max(axis=1)
        self._middle = 0.5 * (low + high)
        self._size = float(np.max(high - low)) or 1.0
        corners, faces = _icosahedron()
        unit = (center - self._middle[:, None]) / self._size
        reach = (radius / self._size + INFLATION) / ICOSAHEDRON_INSPHERE
        vertices = unit.T[:, None, :] + reach[:, None, None] * corners[None]
        index = faces[None] + (len(corners) * np.arange(radius.size))[:, None, None]
        self._scene: Any = rtcore_scene.EmbreeScene()
        TriangleMesh(
            self._scene,
            np.ascontiguousarray(vertices.reshape(-1, 3), dtype=np.float32),
            np.ascontiguousarray(index.reshape(-1, 3), dtype=np.int32),
        )
        self._faces = len(faces)
        self._count = radius.size
        self._outer = reach * self._size
        self._widest = 2.0 * float(reach.max())

    @property
    def outer(self) -> Array:
        """Radii (n,) metres around the proxies: from within, a proxy may be missed."""
        return self._outer

    def along(self, start: Array, end: Array) -> tuple[Ints, Ints]:
        """Every proxy that the segments from `start` (3, n) to `end` (3, 1) enter.

        Not those around their starts (within `outer` of a centre): all that is left of these is
        a far side, which may lie right behind another hit.

        Returns
        -------
        (segment, object) : pairs, each once, in no order.
        """
        begin = ((start - self._middle[:, None]) / self._size).T
        stop = ((end - self._middle[:, None]) / self._size).T
        way = stop - begin
        length = np.sqrt(way[:, 0] ** 2 + way[:, 1] ** 2 + way[:, 2] ** 2)
        alive = (length > 0.0).nonzero()[0]
        way[alive] /= length[alive, None]
        gone = np.zeros(length.size)
        found: list[Ints] = []
        while alive.size:
            origin = begin[alive] + gone[alive, None] * way[alive]
            # not capped at the light: the far side of a proxy around it must be met as well
            hit = self._scene.run(
                origin.astype(np.float32), way[alive].astype(np.float32), output=1
            )
            met = (hit["primID"] >= 0).nonzero()[0]
            alive, prim = alive[met], hit["primID"][met].astype(np.int64)
            item = prim // self._faces
            found.append(alive * self._count + item)
            gone[alive] += hit["tfar"][met].astype(np.float64) + ADVANCE
            # a start inside a proxy meets its far side only, at most a diameter behind the end
            alive = alive[gone[alive] <= length[alive] + self._widest]
        if not found:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        segment, item = np.divmod(np.unique(np.concatenate(found)), self._count)
        return segment, item


def _icosahedron() -> tuple[Array, Ints]:
    """Corners (12, 3) on the unit sphere and faces (20, 3)."""
    g = GOLDEN
    corners = np.array(
        [(0.0, s, t * g) for s in (-1, 1) for t in (-1, 1)]
        + [(s, t * g, 0.0) for s in (-1, 1) for t in (-1, 1)]
        + [(t * g, 0.0, s) for s in (-1, 1) for t in (-1, 1)]
    )
    corners /= np.sqrt(1.0 + g * g)
    gaps = np.sum((corners[:, None] - corners[None]) ** 2, axis=2)
    near = gaps < 1.5 * np.min(gaps[gaps > 0.0])
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    return corners, np.array(faces, dtype=np.int64)
