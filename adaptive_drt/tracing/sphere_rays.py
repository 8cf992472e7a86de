# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays and camera rays against all spheres of a scene at once.

Scenes of very many spheres have so many occluders at each point that closed forms, and even the
list of the occluders, cost more than the rays that a goal asks for. Here the spheres are traced as
one set by embree (`geometry.embree_spheres`), and need no list of candidates. The few other objects
are tested one by one as everywhere else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.embree_library import native_library
from ..geometry.embree_spheres import SphereScene
from ..geometry.shape_table import ShapeTable
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..scene.settings import Settings

__all__ = ["SphereTracer", "find_traced_spheres"]


MIN_SPHERES = 96
"""Number of spheres from which they are traced as one set. With fewer, closed forms cost less than
the first rays of a pixel."""
MIN_SPHERES_BY_MESHES = 4
"""The same where the scene has meshes, whose pixels are sampled anyway. Twenty cubes under a sky
take with 4 spheres 6.7 s so and 8.9 s where each is tested by itself, with 11 6.3 and 16 s."""
MAX_OTHERS = 24
"""Largest number of other objects, which are tested one by one for each point."""
LARGE = 64.0
"""Radius from which a sphere is tested as the other objects are, in median radii: it would set the
size of the scene, and with it what float32 rounds away of the small ones."""
MIN_COLORED_TOLERANCE = 2e-3
"""Tolerance down to which spheres are traced as one set under coloured environments: their closed
form then takes each channel by itself, which is up to three times as long."""
MAX_FACE_SIZE = 16.0
"""Largest distance of their corners from the middle of the spheres along each axis, as a multiple
of the spheres' extent: embree rounds them by a sixteenth of what rays begin above surfaces."""
MAX_ROUNDING = 2.0**-9
"""Largest rounding of embree's rays as a fraction of the radius of the smallest sphere. Errors of
single rays near outlines have random signs and are this small a part of the outline's sphere."""


def find_traced_spheres(
    table: ShapeTable, lights: tuple[Emitter, ...], settings: Settings
) -> Mask | None:
    """Which objects (n,) are traced as one set of spheres; None if none are.

    It is so in scenes of many spheres and few other objects, of method 'EXACT', whose lights
    have a size and are hidden by all of these spheres alike.
    """
    if settings.method != "EXACT" or settings.accelerator == "ARRAYS":
        return None
    least = MIN_SPHERES_BY_MESHES if table.sampled.any() else MIN_SPHERES
    if not settings.use_penumbra or table.proxied < least:
        return None
    if native_library() is None:
        return None
    radius = table.bounding_spheres[1]
    traced = np.zeros(table.count, dtype=np.bool_)
    traced[: table.proxied] = True
    traced &= radius <= LARGE * float(np.median(radius[: table.proxied]))
    if (~traced).sum() > MAX_OTHERS:
        return None
    for light in lights:
        passes = light.passes is not None and bool(light.passes[traced].any())
        colored = light.channel_count > 1
        if passes or (colored and settings.tolerance < MIN_COLORED_TOLERANCE):
            return None
    if not any(light.extended and light.casts_shadow for light in lights):
        return None
    spheres = _spheres(table, traced.nonzero()[0])
    rounding = SphereScene.rounding_of(SphereScene.extent(*spheres)[1])
    if rounding > MAX_ROUNDING * float(spheres[1].min()):
        return None
    return traced


def _spheres(table: ShapeTable, item: Ints) -> tuple[Array, Array, Array | None]:
    """Centres (3, n), radii (n,) and displacements (3, n) of the spheres among the objects.

    They are views where the numbers of the spheres, ascending, are consecutive.
    """
    (center, radius), d = table.bounding_spheres, table.displacement
    chosen: slice | Ints = item
    if item.size and int(item[-1]) - int(item[0]) == item.size - 1:
        chosen = slice(int(item[0]), int(item[-1]) + 1)
    return columns(center, chosen), radius[chosen], None if d is None else columns(d, chosen)


def _scene(
    table: ShapeTable, traced: Mask, spheres: tuple[Array, Array, Array | None]
) -> tuple[SphereScene, Mask]:
    """The traced spheres in embree with some faces, and which objects (n,) are in it."""
    held, others = traced.copy(), (~traced).nonzero()[0]
    middle, sides = SphereScene.extent(*spheres)
    corners = [np.zeros((3, 4, 0))]
    for shapes, rows, index in table.groups(others):
        each = shapes.quad_corners(index)
        if each is None:
            continue
        inside = (np.abs(each - middle[:, :, None]) <= MAX_FACE_SIZE * sides.max()).all(axis=(0, 1))
        inside &= ~shapes.moves[index]
        corners.append(each[:, :, inside])
        held[others[rows[inside]]] = True
    return SphereScene(*spheres, np.concatenate(corners, axis=2)), held


class SphereTracer:
    """Traces rays against those objects that are traced as one set of spheres."""

    def __init__(self, table: ShapeTable, traced: Mask) -> None:
        """Take the objects that `find_traced_spheres` has found.

        `holds_all` then tells whether the few other objects are faces at rest, which `open_rays`
        traces with them.
        """
        self.traced = traced
        self._item = traced.nonzero()[0]
        spheres = _spheres(table, self._item)
        self._center, self._radius = table.bounding_spheres
        self._shift = table.displacement
        self._scene, held = _scene(table, traced, spheres)
        self.holds_all = bool(held.all())

    @property
    def items(self) -> Ints:
        """Numbers of the objects, ascending."""
        return self._item

    def blocked(self, point: Array, normal: Array, to: Array, time: Array | float) -> Mask:
        """Whether spheres block segments from points of surfaces: see `SphereScene.blocked`."""
        return self._scene.blocked(point, normal, to, time)

    def is_near(self, point: Array) -> Mask:
        """Whether `open_rays` may be asked for points (3, n): (n,)."""
        return self._scene.is_near(point)

    def open_rays(
        self, point: Array, normal: Array, a: Array, b: Array, ways: bool
    ) -> tuple[Mask, NDArray[np.float32] | None]:
        """Which of few directions from points are open: see `SphereScene.open_rays`."""
        return self._scene.open_rays(point, normal, a, b, ways)

    def first_blocking(self, point: Array, normal: Array, to: Array) -> Ints:
        """Objects (n,) that block segments first, or -1: see `SphereScene.first_blocking`."""
        found = self._scene.first_blocking(point, normal, to)
        return np.where(found < 0, -1, self._item[found])

    def nearest(self, w: Array, time: Array | float) -> tuple[Array, Ints]:
        """Ray parameters (...) and objects of the first hits of rays from the camera, inf and -1.

        w : (3, ...) directions.  time : shutter times (...) or one number.
        """
        way = w.reshape(3, -1)
        when = np.broadcast_to(np.asarray(time, dtype=np.float64), w.shape[1:]).reshape(-1)
        found = self._scene.nearest(way, when)
        t, item = np.full(found.size, np.inf), np.full(found.size, -1)
        rows = (found >= 0).nonzero()[0]
        number = self._item[found[rows]]
        way, v = columns(way, rows), columns(self._center, number)
        if self._shift is not None:
            v = v + when[rows] * columns(self._shift, number)
        ww, along = dot(way, way), dot(way, v)
        # a ray that only rounding lets meet its sphere passes it at its limb
        aside = v - (along / ww) * way
        room = np.maximum(self._radius[number] ** 2 - dot(aside, aside), 0.0)
        half = np.sqrt(room / ww)
        inside = dot(v, v) < self._radius[number] ** 2
        t[rows] = along / ww + np.where(inside, half, -half)
        item[rows] = number
        return t.reshape(w.shape[1:]), item.reshape(w.shape[1:])
