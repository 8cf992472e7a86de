# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes around the instances of a mesh, and the order in which rays meet them.

Embree finds the boxes as triangles: each ray is restarted behind each side that it meets. It works
in float32, so boxes are inflated by more than its rounding. Without embree a tree in NumPy finds
all boxes of a ray at once.
"""

from __future__ import annotations

import threading
from typing import Any, Protocol

import numpy as np

from ...numerics.arrays import Array, Ints
from ...numerics.floats import FLOAT32_ROUNDOFF, TINY
from ..embree import has_embree, make_embree_scene
from .bvh import BoxTree
from .tracer import entering_rays

__all__ = ["BoxWalk", "InstanceBoxes"]


INFLATION = 64.0 * FLOAT32_ROUNDOFF
"""Distance by which the sides of boxes are moved outwards, as a fraction of the size of all: a
generous bound on the float32 rounding of corners, rays and hits."""
ADVANCE = 16.0 * FLOAT32_ROUNDOFF
"""Distance behind a side at which a ray is restarted, as a fraction of the size of all boxes. A box
that the ray enters within this gap is met where the ray leaves it; one that it also leaves within
the gap is met in what `INFLATION` adds to it only."""
REMEMBERED = 3
"""Number of boxes that a ray has met last and does not return again: their other sides."""
FACES = np.array(
    [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ]
).T  # fmt: skip
"""Corners (3, 12) of the triangles of a box, whose corner 4 x + 2 y + z is high along those axes
whose digit is 1."""


class BoxWalk(Protocol):
    """Rays on their way through boxes."""

    def step(self) -> tuple[Ints, Ints] | None:
        """Go on to the next box of each ray: rays and boxes (m,), no ray twice; None at the end.

        A ray may meet a box more than once.
        """

    def shorten(self, ray: Ints, length: Array) -> None:
        """End rays (m,) at ray parameters, or -1 for those that need not go on."""


class InstanceBoxes:
    """Boxes around n instances; some of them may be empty, and are never met."""

    def __init__(self, low: Array, high: Array) -> None:
        """Take boxes (3, n), metres; what embree needs is built when the first ray is traced."""
        self._low, self._high = low, high
        least, most = low.min(axis=1), high.max(axis=1)
        self._middle = (0.5 * (least + most))[:, None]
        self._size = float((most - least).max()) or 1.0
        self._radius = 0.5 * float(np.sqrt((((most - least) / self._size) ** 2).sum())) + 1e-3
        self._lock = threading.Lock()
        self._scene: Any = None

    def __getstate__(self) -> dict[str, Any]:
        """Pickled state, without embree's own."""
        return {k: v for k, v in self.__dict__.items() if k not in ("_lock", "_scene")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the pickled state; embree's is built again when it is needed."""
        self.__dict__.update(state, _lock=threading.Lock(), _scene=None)

    def walk(self, start: Array, way: Array, length: Array) -> BoxWalk:
        """Begin a walk of rays from `start` (3, n) along `way` (3, n), metres.

        length : (n,) ray parameters at which they end.
        """
        far = np.sqrt((way * way).sum(axis=0))
        scaled = length * (np.maximum(far, TINY) / self._size)
        entry = entering_rays((start - self._middle) / self._size, way, scaled, self._radius)
        scene = self._built()
        if isinstance(scene, BoxTree):
            return _TreeWalk(scene, entry, scaled, far / self._size)
        widest = float(np.sqrt((((self._high - self._low) / self._size) ** 2).sum(axis=0).max()))
        return _EmbreeWalk(scene, entry, scaled, far / self._size, widest + 4.0 * INFLATION)

    def _built(self) -> Any:
        """Embree's scene of the boxes, or the tree that stands for it, built once."""
        with self._lock:
            if self._scene is None:
                self._scene = self._build()
        return self._scene

    def _build(self) -> Any:
        low, high = (
            (each - self._middle) / self._size + sign * INFLATION
            for each, sign in ((self._low, -1.0), (self._high, 1.0))
        )
        if not has_embree():
            return BoxTree(low, high)
        bounds = low, high
        corners = [
            np.array([bounds[number >> (2 - axis) & 1][axis] for axis in range(3)])
            for number in range(8)
        ]
        vertices = np.stack(corners, axis=2).reshape(3, -1)
        faces = FACES[:, None, :] + 8 * np.arange(low.shape[1])[None, :, None]
        scene = make_embree_scene(vertices, faces.reshape(3, -1))
        # the first query builds embree's tree, which no two threads may do
        ray = np.zeros((1, 3), dtype=np.float32)
        scene.run(ray, ray + np.float32(1.0), query="OCCLUDED")
        return scene


class _EmbreeWalk:
    """A walk by embree: see `BoxWalk`."""

    def __init__(
        self,
        scene: Any,
        entry: tuple[Ints, Array, Array, Array],
        length: Array,
        scale: Array,
        widest: float,
    ) -> None:
        """Begin with rays from where they enter the sphere around all boxes.

        Parameters
        ----------
        entry : see `entering_rays`.  length : (n,) lengths of all rays, in sizes of all boxes.
        scale : (n,) length of a unit of the ray parameter, in those sizes.
        widest : diagonal of the largest box: a box around a ray's start is met within it.
        """
        ray, origin, way, gone = entry
        self._scene, self._scale, self._length, self._widest = scene, scale, length.copy(), widest
        self._ray = ray
        self._origin = np.ascontiguousarray(origin.T)
        self._way = np.ascontiguousarray(way.T)
        self._before, self._gone = gone, np.zeros(ray.size)
        self._met = np.full((ray.size, REMEMBERED), -1)

    def step(self) -> tuple[Ints, Ints] | None:
        """See `BoxWalk.step`."""
        while True:
            end = self._length[self._ray] + self._widest
            alive = (self._before + self._gone <= end) & (self._length[self._ray] >= 0.0)
            self._keep(alive.nonzero()[0])
            if not self._ray.size:
                return None
            place = self._origin + self._gone[:, None] * self._way
            hit = self._scene.run(place.astype(np.float32), self._way.astype(np.float32), output=1)
            some = (hit["primID"] >= 0).nonzero()[0]
            self._keep(some)
            if not some.size:
                return None
            self._gone += hit["tfar"][some].astype(np.float64) + ADVANCE
            box = hit["primID"][some].astype(np.int64) // FACES.shape[1]
            new = (self._met != box[:, None]).all(axis=1)
            self._met = np.concatenate([box[:, None], self._met[:, :-1]], axis=1)
            if new.any():
                return self._ray[new], box[new]

    def shorten(self, ray: Ints, length: Array) -> None:
        """See `BoxWalk.shorten`."""
        self._length[ray] = np.minimum(self._length[ray], length * self._scale[ray])

    def _keep(self, rows: Ints) -> None:
        if rows.size == self._ray.size:
            return
        names = ("_ray", "_origin", "_way", "_before", "_gone", "_met")
        self.__dict__.update({name: getattr(self, name)[rows] for name in names})


class _TreeWalk:
    """A walk by a tree in NumPy: see `BoxWalk`."""

    def __init__(
        self, tree: BoxTree, entry: tuple[Ints, Array, Array, Array], length: Array, scale: Array
    ) -> None:
        """Find all boxes of the rays; the parameters are those of `_EmbreeWalk`."""
        ray, origin, way, gone = entry
        with np.errstate(divide="ignore"):
            row, box = tree.meeting(origin, 1.0 / way, np.maximum(length[ray] - gone, 0.0))
        order = np.argsort(row, kind="stable")
        row, box = row[order], box[order]
        rank = np.arange(row.size) - np.searchsorted(row, row)
        order = np.argsort(rank, kind="stable")
        self._ray, self._box, rank = ray[row[order]], box[order], rank[order]
        self._ends = np.searchsorted(rank, np.arange(rank[-1] + 2 if rank.size else 1)).tolist()
        self._next, self._over = 0, np.zeros(length.size, dtype=np.bool_)
        del scale

    def step(self) -> tuple[Ints, Ints] | None:
        """See `BoxWalk.step`."""
        while self._next < len(self._ends) - 1:
            rows = slice(self._ends[self._next], self._ends[self._next + 1])
            self._next += 1
            ray, box = self._ray[rows], self._box[rows]
            alive = (~self._over[ray]).nonzero()[0]
            if alive.size:
                return ray[alive], box[alive]
        return None

    def shorten(self, ray: Ints, length: Array) -> None:
        """See `BoxWalk.shorten`."""
        self._over[ray[length < 0.0]] = True
