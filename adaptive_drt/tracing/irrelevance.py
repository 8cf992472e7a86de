# SPDX-License-Identifier: GPL-3.0-or-later
"""What cannot matter to a picture: lights that face away, and objects in no shaft to a light.

All that shades is visible to the camera, in the pyramid of its rays. So a light that emits to one
side is left out if all visible objects, or all of the pyramid, lie behind its plane. Of planar
objects at rest only what lies in the pyramid counts, and is not behind another one. An object that
the camera does not see is left out if a plane separates it from what is seen and from every light
that casts shadows: then it is in no shaft from what is seen to a light. Bounds hold over the whole
shutter, and for the whole picture, whatever part of it is rendered.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry.camera import PinholeCamera
from ..geometry.planar_faces import NO_SOLID
from ..geometry.shape_table import ShapeTable
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.axes import SHUTTER_ENDS
from ..numerics.vector import cross, dot

__all__ = ["SeenBounds"]


PICTURE_BORDER = 12.0
"""Pixels around the picture in which objects count as seen: blocks of 8 that hold a frame's border
of 3 reach up to 10 beyond it."""
MAX_CLIPPED = 48
"""Largest number of planar objects of a kind of which only what may be seen counts."""
SEPARATION = 2.0**-30
"""Least gap to a separating plane, as a fraction of the distances from the camera: far more than
their rounding."""


@dataclass(frozen=True)
class SeenBounds:
    """Bounds of what the camera sees of the objects, relative to the camera.

    Attributes
    ----------
    table : all objects.  seen : (n,) whether the camera may see the object.
    corner : (3, 4) directions of rays through the corners of the picture with its border, in order.
    """

    table: ShapeTable
    seen: Mask
    corner: Array

    @classmethod
    def make(
        cls,
        table: ShapeTable,
        camera: PinholeCamera,
        resolution: tuple[int, int],
        visible: Mask | None,
    ) -> SeenBounds:
        """Find the objects that may be seen, of those that are `visible` to the camera (n,)."""
        spans = [shapes.screen_span(camera) for shapes in table.sets if shapes.count]
        seen = np.ones(table.count, dtype=np.bool_) if visible is None else visible.copy()
        for axis, size in enumerate(resolution if spans else ()):
            low, high = (np.concatenate([span[axis][k] for span in spans]) for k in (0, 1))
            seen &= (high >= -PICTURE_BORDER) & (low <= size + PICTURE_BORDER)
        x, y = (np.array([-PICTURE_BORDER, size + PICTURE_BORDER]) for size in resolution)
        corner = camera.directions(x[[0, 1, 1, 0]], y[[0, 0, 1, 1]])
        return cls(table, seen & ~_hidden(table, seen), corner)

    def faces_away(self, light: Emitter) -> bool:
        """Whether nothing that is seen lies before a light that emits to one side."""
        if light.span is None or not self.seen.any():
            return False
        normal, d = light.span.normal, light.displacement
        drift = 0.0 if d is None else 0.5 * float(np.abs(dot(normal, d))[0])
        height = float(dot(normal, light.center)[0]) - drift
        if height > 0.0 and not (dot(normal, self.corner) > 0.0).any():
            return True
        if any(
            float((normal.T @ center + radius).max()) >= height
            for center, radius in self._round_balls
        ):
            return False
        high = -self._lowest(-normal)
        return high < height - SEPARATION * (abs(high) + abs(height))

    def idle_objects(self, lights: Sequence[Emitter]) -> Mask:
        """Objects (n,) that are not seen, and in no shaft from what is seen to any of the lights.

        Faces of a closed solid are left out together.
        """
        idle = ~self.seen
        casting = [light for light in lights if light.casts_shadow]
        if not idle.any() or not casting or any(light.surrounds for light in casting):
            return np.zeros_like(idle)
        center, radius = _swept_balls(self.table)
        rows = idle.nonzero()[0]
        normals = self._separating_normals
        least = [self._lowest(normal[:, None]) for normal in normals.T]
        # what is seen lies within the pyramid
        inward = normals.shape[1] - self.corner.shape[1]
        least[inward:] = [max(each, 0.0) for each in least[inward:]]
        far = normals.T @ center[:, rows] + radius[rows]
        size = SEPARATION * (np.sqrt(dot(center[:, rows], center[:, rows])) + radius[rows])
        for light in casting:
            bounds = light.bounds_from_anywhere()
            near = dot(normals, bounds.center) - bounds.swept_radius
            apart = far + size < np.minimum(least, near)[:, None]
            idle[rows] &= apart.any(axis=0)
        return self._whole_solids(idle)

    @cached_property
    def _round_balls(self) -> list[tuple[Array, Array]]:
        """Centres (3, k) and radii (k,) of the spheres that are seen, at mid-shutter."""
        first = self.seen[: self.table.proxied].nonzero()[0]
        center, radius = self.table.bounding_spheres
        return [(center[:, first], radius[first])] if first.size else []

    @cached_property
    def _separating_normals(self) -> Array:
        """Unit normals (3, k) of planes that may separate: along the axes, then of the pyramid."""
        axes = np.concatenate([np.eye(3), -np.eye(3)], axis=1)
        return np.concatenate([axes, self._pyramid], axis=1)

    @cached_property
    def _pyramid(self) -> Array:
        """Unit normals (3, 4) of the sides of the pyramid, which point into it."""
        sides = _side_normals(self.corner)
        inward: Array = sides / np.sqrt(dot(sides, sides))
        return inward

    @cached_property
    def _visible_parts(self) -> dict[int, Array]:
        """Vertices (3, k) of what may be seen of each planar set's objects, by the set's number."""
        found: dict[int, Array] = {}
        polygons = _polygons(self.table, self.seen)
        covers = [part for _, part, opaque in polygons if opaque]
        for number, part, _ in polygons:
            for side in self._pyramid.T:
                part = _clipped(part, side, 0.0)
            for cover in covers:
                part = _without_hidden(part, cover)
            found[number] = np.concatenate([found.get(number, part[:, :0]), part], axis=1)
        return found

    def _lowest(self, normal: Array) -> float:
        """Least dot product of a vector (3, 1) with what is seen; infinite if nothing is."""
        least = np.inf
        for number, shapes in enumerate(self.table.sets):
            first = self.table.firsts[number]
            index = self.seen[first : first + shapes.count].nonzero()[0]
            if not index.size:
                continue
            if shapes.faces is not None and number in self._visible_parts:
                least = min(
                    least, float(dot(normal, self._visible_parts[number]).min(initial=least))
                )
                continue
            along = np.broadcast_to(normal, (3, index.size))
            for time in SHUTTER_ENDS if shapes.displacement is not None else (0.0,):
                when = np.full(index.size, time)
                least = min(least, float(shapes.extent(index, along, when)[0].min()))
        return least

    def _whole_solids(self, idle: Mask) -> Mask:
        """The idle objects without faces of solids that have others."""
        solid: Ints = self.table.solid
        kept = np.zeros(idle.size, dtype=np.bool_)
        faces = (solid != NO_SOLID).nonzero()[0]
        kept[solid[faces[~idle[faces]]]] = True
        left: Mask = idle.copy()
        left[faces] &= ~kept[solid[faces]]
        return left


def _swept_balls(table: ShapeTable) -> tuple[Array, Array]:
    """Centres (3, n) and radii (n,), metres, of balls around objects during the whole shutter."""
    center, radius = table.bounding_spheres
    d = table.displacement
    return center, radius if d is None else radius + 0.5 * np.sqrt(dot(d, d))


def _polygons(table: ShapeTable, seen: Mask) -> list[tuple[int, Array, bool]]:
    """The planar objects that are seen, of kinds of which few are, and none moves.

    Each has its set's number, its vertices (3, k), and whether it fills these.
    """
    polygons = []
    for number, shapes in enumerate(table.sets):
        first = table.firsts[number]
        rows = seen[first : first + shapes.count].nonzero()[0]
        if not 0 < rows.size <= MAX_CLIPPED:
            continue
        faces = shapes.faces
        if faces is None or shapes.moves.any():
            continue
        for k in rows.tolist():
            part = np.stack([vertex[:, k] for vertex in faces.vertices], axis=1)
            polygons.append((number, part, shapes.fills_vertices))
    return polygons


def _facing_plane(cover: Array) -> tuple[Array, float] | None:
    """Unit normal (3,) of the side of a polygon's plane that the camera is on, and its offset.

    It is None for a polygon without an area, or whose plane the camera is in; else the offset is
    negative.
    """
    normal = cross(cover[:, 1] - cover[:, 0], cover[:, 2] - cover[:, 0])
    length = float(np.sqrt(dot(normal, normal)))
    if not 0.0 < length < np.inf:
        return None
    normal /= length
    offset = float(normal @ cover[:, 0])
    if not abs(offset) > SEPARATION * float(np.abs(cover).max()):
        return None
    return (normal, offset) if offset < 0.0 else (-normal, -offset)


def _side_normals(corner: Array) -> Array:
    """Normals (3, k) of the sides of the pyramid over a polygon (3, k), which point into it."""
    sides = cross(corner, np.roll(corner, -1, axis=1))
    inward: Array = sides * np.sign(dot(sides, corner.mean(axis=1, keepdims=True)))
    return inward


def _hidden(table: ShapeTable, seen: Mask) -> Mask:
    """Objects (n,) that a single polygon hides from the camera."""
    hidden = np.zeros(seen.size, dtype=np.bool_)
    covers = [part for _, part, fills in _polygons(table, seen) if fills]
    rows = seen.nonzero()[0]
    if not covers or rows.size <= len(covers):
        return hidden
    center, radius = _swept_balls(table)
    center, radius = center[:, rows], radius[rows]
    slack = SEPARATION * (np.sqrt(dot(center, center)) + radius)
    for cover in covers:
        plane = _facing_plane(cover)
        if plane is None:
            continue
        behind = plane[0] @ center + radius < plane[1] - slack
        if not behind.any():
            continue
        sides = _side_normals(cover)
        sizes = np.sqrt(dot(sides, sides))
        if (sizes > 0.0).all():
            within = (sides / sizes).T @ center > radius + slack
            hidden[rows[behind & within.all(axis=0)]] = True
    return hidden


def _clipped(polygon: Array, normal: Array, offset: float) -> Array:
    """The part of a convex polygon (3, k) where normal . x >= offset: its vertices (3, m).

    Whatever is within rounding of the plane stays.
    """
    if not polygon.shape[1]:
        return polygon
    height = normal @ polygon - offset
    slack = SEPARATION * float(np.abs(polygon).max())
    after = np.roll(height, -1)
    kept = height >= -slack
    cut = kept != np.roll(kept, -1)
    share = height[cut] / (height[cut] - after[cut])
    edge = np.roll(polygon, -1, axis=1)[:, cut] - polygon[:, cut]
    met = polygon[:, cut] + share * edge
    # vertices and cuts in the order of the edges
    place = np.concatenate([np.arange(kept.size)[kept], np.arange(kept.size)[cut] + 0.5])
    left: Array = np.concatenate([polygon[:, kept], met], axis=1)[:, np.argsort(place)]
    return left


def _without_hidden(polygon: Array, cover: Array) -> Array:
    """A polygon (3, k) without its part behind the plane of a cover (3, j), if that hides it."""
    plane = _facing_plane(cover)
    if plane is None or not polygon.shape[1]:
        return polygon
    normal, offset = plane
    behind = _clipped(polygon, -normal, -offset)
    slack = SEPARATION * float(max(np.abs(polygon).max(), np.abs(cover).max()))
    if not behind.shape[1] or float((normal @ behind).min()) >= offset - slack:
        return polygon
    crossing = behind * (offset / np.minimum(normal @ behind, offset))
    edges = np.roll(cover, -1, axis=1) - cover
    for k in range(cover.shape[1]):
        inward = cross(normal, edges[:, k])
        inward *= np.sign(inward @ (cover.mean(axis=1) - cover[:, k]))
        inside = inward @ (crossing - cover[:, k : k + 1])
        if float(inside.min()) < slack * float(np.abs(inward).max()):
            return polygon
    return _clipped(polygon, normal, offset)
