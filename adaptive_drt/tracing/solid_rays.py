# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays and camera rays against all round solids of a scene at once.

Scenes of very many balls, sticks or ellipsoids have so many occluders at each point that closed
forms, and even the list of the occluders, cost more than the rays that a goal asks for. Here the
solids are traced as one set by embree (`geometry.embree_solids`), and need no list of candidates.
The few other objects are tested one by one as everywhere else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.embree_library import native_library
from ..geometry.embree_solids import SolidScene
from ..geometry.native_solids import NativeSolids
from ..geometry.shape_table import ShapeTable
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..scene.settings import Settings
from .ray_costs import REFERENCE_TOLERANCE, UNKNOWN_FORM_COST, occluder_costs

__all__ = ["SolidTracer", "find_traced_solids"]


MIN_SOLIDS = 96
"""Number of solids, by their costs in closed form (`occluder_costs`), from which they are traced as
one set. With fewer, closed forms cost less than the first rays of a pixel."""
MIN_SOLIDS_BY_MESHES = 4
"""The same where the scene has meshes, whose pixels are sampled anyway. Twenty cubes under a sky
take with 4 spheres 6.7 s so and 8.9 s where each is tested by itself, with 11 6.3 and 16 s."""
MAX_OTHERS = 240
"""Largest number of other objects at `REFERENCE_TOLERANCE`. They are tested one by one, for rays
whose number grows as the tolerance falls: the number is proportional to the tolerance. Sixty sticks
and 20 cubes under an area light take at 1 % 2.3 s by rays and 3.7 s in closed form, at 0.1 % 14.6
and 5.6 s."""
LARGE = 64.0
"""Radius from which a solid is tested as the other objects are, in median radii: it would set the
size of the scene, and with it what float32 rounds away of the small ones."""
MIN_COLORED_TOLERANCE = 2e-3
"""Tolerance down to which solids are traced as one set under coloured environments: their closed
form then takes each channel by itself, which is up to three times as long."""
MAX_FACE_SIZE = 16.0
"""Largest distance of their corners from the middle of the solids along each axis, as a multiple
of the solids' extent: embree rounds them by a sixteenth of what rays begin above surfaces."""
MAX_ROUNDING = 2.0**-6
"""Largest rounding of embree's rays as a fraction of the thickness of a solid; thinner ones are
tested as the other objects are. Single rays err within this part of the solid from its outline, as
often to one side as to the other: what remains of the mean is the square, 2^-12 of its shadow."""


def find_traced_solids(
    table: ShapeTable, lights: tuple[Emitter, ...], settings: Settings
) -> Mask | None:
    """Which objects (n,) are traced as one set: solids and their flat ends; None if none are.

    It is so in scenes of many solids and few other objects, of method 'EXACT', whose lights
    have a size and are hidden by all of these solids alike.
    """
    if settings.method != "EXACT" or settings.accelerator == "ARRAYS":
        return None
    traced = _round(table)
    lights = tuple(each for each in lights if each.extended and each.casts_shadow)
    if not (settings.use_penumbra and traced.any() and lights) or native_library() is None:
        return None
    costs = np.max([occluder_costs(table, each) for each in lights], axis=0)
    least = MIN_SOLIDS_BY_MESHES if table.sampled.any() else MIN_SOLIDS
    if costs[traced].sum() < least:
        return None
    radius = table.bounding_spheres[1]
    traced &= radius <= LARGE * float(np.median(radius[traced]))
    traced &= ~_are_thin(table, traced)
    ends, solid = _ends_of(table)
    traced[ends] = traced[solid]
    most = MAX_OTHERS * settings.tolerance / REFERENCE_TOLERANCE
    if (~traced).sum() > most or not traced.any():
        return None
    colored = any(each.channel_count > 1 for each in lights)
    known = costs[traced].max() < UNKNOWN_FORM_COST
    if colored and known and settings.tolerance < MIN_COLORED_TOLERANCE:
        return None
    if any(each.passes is not None and each.passes[traced].any() for each in lights):
        return None
    return traced


def _are_thin(table: ShapeTable, some: Mask) -> Mask:
    """Which of some objects (n,) are too thin for what embree rounds of rays."""
    item = some.nonzero()[0]
    solids = _solids(table, item)
    rounding = SolidScene.rounding_of(SolidScene.extent(solids)[1])
    thickness = np.concatenate([each.thickness for each in solids])
    thin = np.zeros(table.count, dtype=np.bool_)
    thin[item[rounding > MAX_ROUNDING * thickness]] = True
    return thin


def _round(table: ShapeTable) -> Mask:
    """Which objects (n,) embree traces as they are."""
    return np.repeat([each.traced_natively for each in table.sets], np.diff(table.firsts))


def _ends_of(table: ShapeTable) -> tuple[Ints, Ints]:
    """Objects (m,) that are flat ends of round solids, and the solids (m,) that they belong to."""
    bodies = np.full(table.count, -1)
    for shapes, first in zip(table.sets, table.firsts[:-1], strict=True):
        if shapes.bodies is not None:
            bodies[first : first + shapes.count] = shapes.bodies
    solid = _round(table)
    one = np.flatnonzero(solid & (bodies >= 0))
    place = np.full(int(bodies.max(initial=0)) + 1, -1)
    place[bodies[one]] = one
    ends = np.flatnonzero(~solid & (bodies >= 0))
    return ends, place[bodies[ends]]


def _solids(table: ShapeTable, item: Ints) -> list[NativeSolids]:
    """The solids among the objects, given by ascending numbers, by kind.

    They are views where the numbers of a kind are consecutive.
    """
    found = []
    for shapes, _, index in table.groups(item):
        chosen: slice | Ints = index
        if int(index[-1]) - int(index[0]) == index.size - 1:
            chosen = slice(int(index[0]), int(index[-1]) + 1)
        found.append(shapes.native_solids(chosen))
    return found


def _scene(table: ShapeTable, traced: Mask, item: Ints) -> tuple[SolidScene, Mask]:
    """The traced solids in embree with some faces, and which objects (n,) are in it."""
    held, others, solids = traced.copy(), (~traced).nonzero()[0], _solids(table, item)
    middle, sides = SolidScene.extent(solids)
    corners = [np.zeros((3, 4, 0))]
    for shapes, rows, index in table.groups(others):
        each = shapes.quad_corners(index)
        if each is None:
            continue
        inside = (np.abs(each - middle[:, :, None]) <= MAX_FACE_SIZE * sides.max()).all(axis=(0, 1))
        inside &= ~shapes.moves[index]
        corners.append(each[:, :, inside])
        held[others[rows[inside]]] = True
    return SolidScene(solids, np.concatenate(corners, axis=2)), held


class SolidTracer:
    """Traces rays against those objects that are traced as one set of solids."""

    def __init__(self, table: ShapeTable, traced: Mask) -> None:
        """Take the objects that `find_traced_solids` has found.

        `holds_all` then tells whether the few other objects are faces at rest, which `open_rays`
        traces with them.
        """
        self.traced = traced
        self._table = table
        self._item = (traced & _round(table)).nonzero()[0]
        self._ends = np.full((2, table.count), -1)
        ends, solid = _ends_of(table)
        order = np.argsort(solid, kind="stable")
        ends, solid = ends[order], solid[order]
        second = np.zeros(solid.size, dtype=np.int64)
        second[1:] = solid[1:] == solid[:-1]
        self._ends[second, solid] = ends
        self._scene, held = _scene(table, traced, self._item)
        self.holds_all = bool(held.all())

    @property
    def items(self) -> Ints:
        """Numbers of the solids, ascending, without their ends."""
        return self._item

    def blocked(self, point: Array, normal: Array, to: Array, time: Array | float) -> Mask:
        """Whether solids block segments from points of surfaces: see `SolidScene.blocked`."""
        return self._scene.blocked(point, normal, to, time)

    def is_near(self, point: Array) -> Mask:
        """Whether `open_rays` may be asked for points (3, n): (n,)."""
        return self._scene.is_near(point)

    def open_rays(
        self, point: Array, normal: Array, a: Array, b: Array, ways: bool
    ) -> tuple[Mask, NDArray[np.float32] | None]:
        """Which of few directions from points are open: see `SolidScene.open_rays`."""
        return self._scene.open_rays(point, normal, a, b, ways)

    def first_blocking(self, point: Array, normal: Array, to: Array) -> Ints:
        """Objects (n,) that block segments first, or -1: see `SolidScene.first_blocking`."""
        found = self._scene.first_blocking(point, normal, to)
        return np.where(found < 0, -1, self._item[found])

    def nearest(self, w: Array, time: Array | float) -> tuple[Array, Ints]:
        """Ray parameters (...) and objects of the first hits of rays from the camera, inf and -1.

        w : (3, ...) directions.  time : shutter times (...) or one number.
        """
        way = w.reshape(3, -1)
        when = np.broadcast_to(np.asarray(time, dtype=np.float64), w.shape[1:]).reshape(-1)
        found, reach = self._scene.nearest(way, when)
        t, item = np.full(found.size, np.inf), np.full(found.size, -1)
        rows = (found >= 0).nonzero()[0]
        number = self._item[found[rows]]
        t[rows], item[rows] = self._hits(columns(way, rows), number, when[rows], reach[rows])
        return t.reshape(w.shape[1:]), item.reshape(w.shape[1:])

    def _hits(self, way: Array, number: Ints, when: Array, reach: Array) -> tuple[Array, Ints]:
        """Ray parameters and objects (m,) of the hits of rays with solids that embree has found.

        reach : (m,) embree's ray parameters, for rays that only rounding lets meet their solids.
        """
        t, item = np.empty(number.size), number.copy()
        for shapes, rows, index in self._table.groups(number):
            ways = columns(way, rows)
            if shapes.fills_bounding_sphere:
                t[rows] = self._ball_hits(ways, number[rows], when[rows])
                continue
            nearest = shapes.intersect(index, ways, when[rows])
            for end in self._ends:
                own = end[number[rows]]
                for disks, some, disk in self._table.groups(own):
                    at = disks.intersect(disk, columns(ways, some), when[rows[some]])
                    closer = some[at < nearest[some]]
                    nearest[closer] = at[at < nearest[some]]
                    item[rows[closer]] = own[closer]
            t[rows] = np.where(np.isfinite(nearest), nearest, reach[rows])
        return t, item

    def _ball_hits(self, way: Array, number: Ints, when: Array) -> Array:
        """Ray parameters (m,) of hits with balls."""
        center, radius = self._table.bounding_spheres
        v = columns(center, number)
        if self._table.displacement is not None:
            v = v + when * columns(self._table.displacement, number)
        ww, along = dot(way, way), dot(way, v)
        # a ray that only rounding lets meet its sphere passes it at its limb
        aside = v - (along / ww) * way
        room = np.maximum(radius[number] ** 2 - dot(aside, aside), 0.0)
        half = np.sqrt(room / ww)
        inside = dot(v, v) < radius[number] ** 2
        t: Array = along / ww + np.where(inside, half, -half)
        return t
