# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays and camera rays against all spheres of a scene at once.

Scenes of very many spheres have so many occluders at each point that closed forms, and even the
list of the occluders, cost more than the rays that a goal asks for. Here the spheres are traced as
one set by embree (`geometry.embree_spheres`), and need no list of candidates. The few other objects
are tested one by one as everywhere else.
"""

from __future__ import annotations

import numpy as np

from ..geometry.embree_spheres import SphereScene, native_library
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
MAX_OTHERS = 24
"""Largest number of other objects, which are tested one by one for each point."""
LARGE = 64.0
"""Radius from which a sphere is tested as the other objects are, in median radii: it would set the
size of the scene, and with it what float32 rounds away of the small ones."""
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
    if not settings.use_penumbra or table.proxied < MIN_SPHERES:
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
        if light.channel_count > 1 or passes:
            return None
    if not any(light.extended and light.casts_shadow for light in lights):
        return None
    spheres = _spheres(table, traced.nonzero()[0])
    rounding = SphereScene.rounding_of(SphereScene.extent(*spheres)[1])
    if rounding > MAX_ROUNDING * float(spheres[1].min()):
        return None
    return traced


def _spheres(table: ShapeTable, item: Ints) -> tuple[Array, Array, Array | None]:
    """Centres (3, n), radii (n,) and displacements (3, n) of the spheres among the objects."""
    (center, radius), d = table.bounding_spheres, table.displacement
    return columns(center, item), radius[item], None if d is None else columns(d, item)


class SphereTracer:
    """Traces rays against those objects that are traced as one set of spheres."""

    def __init__(self, table: ShapeTable, traced: Mask) -> None:
        """Take the objects that `find_traced_spheres` has found."""
        self.traced = traced
        self._item = traced.nonzero()[0]
        self._center, self._radius, self._shift = _spheres(table, self._item)
        self._scene = SphereScene(self._center, self._radius, self._shift)

    @property
    def items(self) -> Ints:
        """Numbers of the objects, ascending."""
        return self._item

    def blocked(self, point: Array, normal: Array, to: Array, time: Array | float) -> Mask:
        """Whether spheres block segments from points of surfaces: see `SphereScene.blocked`."""
        return self._scene.blocked(point, normal, to, time)

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
        number = found[rows]
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
        item[rows] = self._item[number]
        return t.reshape(w.shape[1:]), item.reshape(w.shape[1:])
