# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays against the instances of a mesh.

Of instances at rest embree finds the hits (`instance_scene`), and what its float32 leaves open is
decided in the own spaces of the instances: whatever is near the start of a ray, and which face is
the first one near a hit. All others are found one after the other: a ray goes from box to box, is
mapped into the own space of the mesh in each, at its own time where the instance moves, and is
traced there; the ray parameter stays the same. There, what float32 rounds away is relative to the
mesh, as it is for a mesh that stands alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.vector import dot
from ..embree_library import native_library, native_version
from .box_grid import BoxGrid
from .faces import MeshFaces
from .instance_boxes import BoxWalk, InstanceBoxes
from .instance_scene import InstanceScene
from .placements import Placements

__all__ = ["InstanceHits", "InstanceTracer"]


RAYS_PER_CHUNK = 1 << 15
"""Number of rays that are followed together; it bounds memory."""
PAIRS_PER_CHUNK = 1 << 17
"""Number of pairs of rays and instances that are tested together near the starts of rays."""
REACH = 64.0
"""Distance from the start of a ray, and from a hit, within which rays are traced in the own spaces
of the instances, in bounds on embree's rounding. A ray that leaves a face at a smaller angle than
an arc sine of 1 / `REACH` may still meet it by rounding; little light comes from there."""
OVERLAP = 0.9
"""Fraction of that distance from which embree traces the ray."""
MAX_HITS = 64
"""Number of hits of one ray that are looked at. The next one is looked for where float64 does not
confirm a hit, because the ray passes beside the face by less than the rounding; a ray of so many
such hits meets nothing."""


class InstanceHits(NamedTuple):
    """First hits of n rays: ray parameters, instances and faces; infinite and -1 for none."""

    t: Array
    item: Ints
    face: Ints

    @classmethod
    def none(cls, count: int) -> InstanceHits:
        """No hits."""
        return cls(np.full(count, np.inf), np.full(count, -1), np.full(count, -1))

    def enter(self, rows: Ints, other: InstanceHits) -> None:
        """Enter hits of some rays."""
        self.t[rows], self.item[rows], self.face[rows] = other

    def part(self, rows: slice | Ints) -> InstanceHits:
        """The hits of some rays; of a slice they are views."""
        return InstanceHits(self.t[rows], self.item[rows], self.face[rows])


@dataclass(frozen=True)
class InstanceTracer:
    """Finds what rays meet.

    Attributes
    ----------
    shared : the mesh in its own space.  placements : of its n instances.
    low, high : (3, n) metres, boxes that hold the instances at all times.
    """

    shared: MeshFaces
    placements: Placements
    low: Array
    high: Array

    @property
    def engine(self) -> str:
        """What takes rays to the instances at rest: embree's version, or 'boxes'."""
        return "boxes" if self._scene is None else native_version()

    @cached_property
    def _in_scene(self) -> Mask:
        """Which instances (n,) embree holds."""
        places = self.placements
        if places.motion is not None or native_library() is None or self.shared.is_empty:
            return np.zeros(places.count, dtype=np.bool_)
        extent = float((self.high.max(axis=1) - self.low.min(axis=1)).max())
        return InstanceScene.suited(places, self.shared.tracer.size, extent)

    @cached_property
    def _numbers(self) -> Ints:
        """The instances that embree holds, in its order."""
        return self._in_scene.nonzero()[0]

    @cached_property
    def _scene(self) -> InstanceScene | None:
        """The instances that embree holds; None for none."""
        some = self._numbers
        if not some.size:
            return None
        shared, low, high = self.shared, columns(self.low, some), columns(self.high, some)
        box = low.min(axis=1), high.max(axis=1)
        return InstanceScene(shared.vertices, shared.faces, self.placements.take(some), box)

    @cached_property
    def _grid(self) -> BoxGrid:
        """Finds the boxes of the instances that embree holds."""
        return BoxGrid(columns(self.low, self._numbers), columns(self.high, self._numbers))

    @cached_property
    def _walked(self) -> Ints:
        """The instances that rays are taken to from box to box."""
        return (~self._in_scene).nonzero()[0]

    @cached_property
    def _boxes(self) -> InstanceBoxes:
        """The boxes around these."""
        return InstanceBoxes(columns(self.low, self._walked), columns(self.high, self._walked))

    def nearest(self, start: Array, way: Array, time: Array | float) -> InstanceHits:
        """First hits of rays from `start` along `way` (3, n), at times, a number or (n,)."""
        hits = InstanceHits.none(way.shape[1])
        for rows in _chunks(0 if self.shared.is_empty else way.shape[1], 1):
            when = time[rows] if isinstance(time, np.ndarray) else time
            found = hits.part(rows)
            if self._scene is not None:
                self._find_nearest(self._scene, start[:, rows], way[:, rows], found)
            if self._walked.size:
                self._walk_to_nearest(start[:, rows], way[:, rows], when, found)
        return hits

    def first_within(self, start: Array, way: Array, length: Array) -> InstanceHits:
        """First hits of rays from `start` along `way` (3, n) up to ray parameters `length` (n,),
        of instances at rest; the answers are as exact as those of a mesh that stands alone."""
        hits = self._near(start, way, length)
        if self._walked.size:
            self._walk_to_nearest(start, way, 0.0, hits)
            late = (hits.t > length).nonzero()[0]
            hits.enter(late, InstanceHits.none(late.size))
        return hits

    def blocked(self, start: Array, to: Array, time: Array | float, group: int = 1) -> Mask:
        """Whether a face lies between `start` (3, n) and `start + to`, at times: (n,).

        group : number of consecutive rays whose starts are near each other.
        """
        count = to.shape[1]
        found = np.zeros(count, dtype=np.bool_)
        for rows in _chunks(0 if self.shared.is_empty else count, group):
            when = time[rows] if isinstance(time, np.ndarray) else time
            own, way, part = start[:, rows], to[:, rows], found[rows]
            if self._scene is not None:
                reach = REACH * self._scene.rounding
                part[:] = self._scene.blocked(own, way, OVERLAP * reach)
                part |= self._blocked_near(own, way, reach, ~part, group)
            if self._walked.size:
                some = (~part).nonzero()[0]
                when = when[some] if isinstance(when, np.ndarray) else when
                part[some] = self._blocked_on_walk(own[:, some], way[:, some], when)
        return found

    def _find_nearest(
        self, scene: InstanceScene, start: Array, way: Array, hits: InstanceHits
    ) -> None:
        """Enter the first hits of rays with instances that embree holds."""
        scale = np.sqrt(np.maximum(dot(way, way), TINY))
        reach = REACH * scene.rounding / scale
        hits.enter(np.arange(scale.size), self._near(start, way, reach))
        rows, begin = (hits.item < 0).nonzero()[0], OVERLAP * reach
        for _ in range(MAX_HITS):
            own_start, own_way = columns(start, rows), columns(way, rows)
            item, face = scene.nearest(own_start, own_way, begin[rows] * scale[rows])
            some = (face >= 0).nonzero()[0]
            if not some.size:
                return
            rows, item, face = rows[some], self._numbers[item[some]], face[some]
            own_start, own_way = columns(own_start, some), columns(own_way, some)
            t = self._depths(own_start, own_way, item, face)
            hits.enter(rows, InstanceHits(t, item, face))
            # which face is the first one near the hit, and whether there is any
            back = np.maximum(t - reach[rows], 0.0)
            found = self._near(own_start + back * own_way, own_way, 2.0 * reach[rows])
            sure = found.item >= 0
            other = (sure & ((found.item != item) | (found.face != face))).nonzero()[0]
            first = found.part(other)
            depth = self._depths(own_start[:, other], own_way[:, other], first.item, first.face)
            hits.enter(rows[other], first._replace(t=depth))
            rows, t = rows[~sure], t[~sure]
            if not rows.size:
                return
            begin[rows] = np.maximum(t, begin[rows]) + OVERLAP * reach[rows]
            hits.enter(rows, InstanceHits.none(rows.size))

    def _depths(self, start: Array, way: Array, item: Ints, face: Ints) -> Array:
        """Ray parameters (n,) at which rays meet faces of instances."""
        return self.shared.depths(*self.placements.to_own(item, start, way, 0.0), face)

    def _near(self, start: Array, way: Array, length: Array) -> InstanceHits:
        """First hits with instances that embree holds, up to short ray parameters `length` (n,)."""
        hits = InstanceHits.none(length.size)
        if not self._numbers.size:
            return hits
        end = start + length * way
        ray, box = self._grid.overlapping(np.minimum(start, end), np.maximum(start, end))
        for first in range(0, ray.size, PAIRS_PER_CHUNK):
            part = slice(first, first + PAIRS_PER_CHUNK)
            self._enter_nearer(start, way, ray[part], self._numbers[box[part]], 0.0, length, hits)
        return hits

    def _enter_nearer(
        self,
        start: Array,
        way: Array,
        ray: Ints,
        item: Ints,
        time: Array | float,
        length: Array,
        hits: InstanceHits,
    ) -> Ints:
        """Trace pairs of rays and instances (m,) in own spaces, and enter hits that are nearer
        and up to ray parameters `length` (n,). Returns the rays that have met one.

        time : of the rays, a number or (n,).
        """
        when = time[ray] if isinstance(time, np.ndarray) else time
        own = self.placements.to_own(item, columns(start, ray), columns(way, ray), when)
        met = self.shared.tracer.nearest(*own)
        some = (met >= 0).nonzero()[0]
        ray, item, met = ray[some], item[some], met[some]
        t = self.shared.depths(columns(own[0], some), columns(own[1], some), met)
        some = ((t < hits.t[ray]) | ((t == hits.t[ray]) & (item < hits.item[ray]))) & (
            t <= length[ray]
        )
        ray, item, met, t = ray[some], item[some], met[some], t[some]
        # of the hits of one ray the last one is kept that is entered: the nearest
        order = np.lexsort((-item, -t))
        ray = ray[order]
        hits.enter(ray, InstanceHits(t[order], item[order], met[order]))
        return ray

    def _blocked_near(self, start: Array, to: Array, reach: float, asked: Mask, group: int) -> Mask:
        """Whether instances that embree holds block rays within `reach` metres: (n,).

        asked : (n,) the rays that are to be looked at.
        """
        found = np.zeros(asked.size, dtype=np.bool_)
        each = asked.reshape(-1, group).any(axis=1).nonzero()[0]
        places = columns(start.reshape(3, -1, group), each)
        low, high = places.min(axis=2) - reach, places.max(axis=2) + reach
        one, box = self._grid.overlapping(low, high)
        if not one.size:
            return found
        part = np.minimum(reach / np.sqrt(np.maximum(dot(to, to), TINY)), 1.0)
        most = max(1, PAIRS_PER_CHUNK // group)
        for first in range(0, one.size, most):
            own, item = one[first : first + most], self._numbers[box[first : first + most]]
            ray = (each[own, None] * group + np.arange(group)).ravel()
            item = np.repeat(item, group)
            some = (asked[ray] & ~found[ray]).nonzero()[0]
            ray, item = ray[some], item[some]
            mapped = self.placements.to_own(
                item, columns(start, ray), part[ray] * columns(to, ray), 0.0
            )
            found[ray[self.shared.tracer.blocked(*mapped)]] = True
        return found

    def _walk_to_nearest(
        self, start: Array, way: Array, time: Array | float, hits: InstanceHits
    ) -> None:
        """Enter hits with instances that rays are taken to from box to box, if they are nearer."""
        walk = self._boxes.walk(start, way, hits.t.copy())
        endless = np.full(way.shape[1], np.inf)
        for ray, item in self._steps(walk):
            met = self._enter_nearer(start, way, ray, item, time, endless, hits)
            walk.shorten(met, hits.t[met])

    def _blocked_on_walk(self, start: Array, to: Array, time: Array | float) -> Mask:
        """Whether instances that rays are taken to from box to box block rays: (n,)."""
        found = np.zeros(to.shape[1], dtype=np.bool_)
        walk = self._boxes.walk(start, to, np.ones(to.shape[1]))
        for ray, item in self._steps(walk):
            when = time[ray] if isinstance(time, np.ndarray) else time
            own = self.placements.to_own(item, columns(start, ray), columns(to, ray), when)
            ray = ray[self.shared.tracer.blocked(*own)]
            found[ray] = True
            walk.shorten(ray, np.full(ray.size, -1.0))
        return found

    def _steps(self, walk: BoxWalk) -> Iterator[tuple[Ints, Ints]]:
        """Yield the steps of a walk: rays and instances (m,), no ray twice."""
        while (step := walk.step()) is not None:
            yield step[0], self._walked[step[1]]


def _chunks(count: int, group: int) -> list[slice]:
    """Parts of `count` rays, of whole groups."""
    size = max(1, RAYS_PER_CHUNK // group) * group
    return [slice(first, first + size) for first in range(0, count, size)]
