# SPDX-License-Identifier: GPL-3.0-or-later
"""Candidate occluders by embree.

Embree works in float32: it returns candidates only, and which of them occlude is decided in
float64. Each object that fills its bounding sphere (`ShapeTable.proxied`) is replaced by a proxy,
an icosahedron around that sphere, inflated by a bound on the float32 rounding errors. embreex
returns only the nearest triangle and has no minimum distance, so each ray is restarted behind each
hit until it has passed its end.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..geometry.embree import make_embree_scene
from ..numerics.arrays import Array, Ints
from ..numerics.floats import FLOAT32_ROUNDOFF

__all__ = ["ProxyScene"]


GOLDEN_RATIO = (1.0 + 5.0**0.5) / 2.0
"""The golden ratio, of which the coordinates of an icosahedron's corners are made."""
ICOSAHEDRON_INSPHERE = 0.7946544722917661
"""Radius of the inscribed sphere of an icosahedron whose corners lie on the unit sphere."""
PROXY_INFLATION = 64.0 * FLOAT32_ROUNDOFF
"""Length added to the radius of each proxy, as a fraction of the scene's size.

It is a generous bound on the float32 rounding of corners, rays and hits."""
RAY_ADVANCE = 16.0 * FLOAT32_ROUNDOFF
"""Distance behind a hit at which a ray is restarted, as a fraction of the scene's size.

A proxy that the ray enters within this gap is hit on its far side. One that it also leaves within
the gap is only grazed: the ray passes through PROXY_INFLATION alone."""


class ProxyScene:
    """An embree scene of icosahedra around bounding spheres."""

    def __init__(self, center: Array, radius: Array) -> None:
        """Build the proxies of n bounding spheres.

        Parameters
        ----------
        center : (3, n) metres.  radius : (n,) metres.
        """
        low = (center - radius).min(axis=1)
        high = (center + radius).max(axis=1)
        self._middle = 0.5 * (low + high)
        self._size = float(np.max(high - low)) or 1.0
        corners, faces = _icosahedron()
        unit = (center - self._middle[:, None]) / self._size
        reach = (radius / self._size + PROXY_INFLATION) / ICOSAHEDRON_INSPHERE
        vertices = unit.T[:, None, :] + reach[:, None, None] * corners[None]
        index = faces[None] + (len(corners) * np.arange(radius.size))[:, None, None]
        self._scene: Any = make_embree_scene(vertices.reshape(-1, 3).T, index.reshape(-1, 3).T)
        self._faces = len(faces)
        self._count = radius.size
        self._outer = reach * self._size
        self._widest = 2.0 * float(reach.max())

    @property
    def circumradius(self) -> Array:
        """Circumradii (n,) of the proxies, metres. A ray that starts within may miss the proxy."""
        return self._outer

    def intersected_by(self, start: Array, to: Array) -> tuple[Ints, Ints]:
        """The proxies that the segments from `start` (3, n) to `start + to` enter, metres.

        Proxies around a segment's start (within `circumradius` of their centre) may be missing: the
        ray hits only their far side, which may lie within the gap behind another hit.

        Returns
        -------
        segment, item : (m,) numbers of segments and objects, each pair once.
        """
        begin = ((start - self._middle[:, None]) / self._size).T
        way = (to / self._size).T
        length = np.sqrt(way[:, 0] ** 2 + way[:, 1] ** 2 + way[:, 2] ** 2)
        alive = (length > 0.0).nonzero()[0]
        way[alive] /= length[alive, None]
        gone = np.zeros(length.size)
        found: list[Ints] = []
        while alive.size:
            origin = begin[alive] + gone[alive, None] * way[alive]
            # the ray is not ended at the light: it must hit the far side of a proxy around it too
            hit = self._scene.run(
                origin.astype(np.float32), way[alive].astype(np.float32), output=1
            )
            met = (hit["primID"] >= 0).nonzero()[0]
            alive, prim = alive[met], hit["primID"][met].astype(np.int64)
            item = prim // self._faces
            found.append(alive * self._count + item)
            gone[alive] += hit["tfar"][met].astype(np.float64) + RAY_ADVANCE
            # a ray from inside a proxy hits its far side only, at most a diameter behind the end
            alive = alive[gone[alive] <= length[alive] + self._widest]
        if not found:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        segment, item = np.divmod(np.unique(np.concatenate(found)), self._count)
        return segment, item


def _icosahedron() -> tuple[Array, Ints]:
    """Corners (12, 3) on the unit sphere and faces (20, 3) of an icosahedron."""
    g = GOLDEN_RATIO
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
