# SPDX-License-Identifier: GPL-3.0-or-later
"""Planar convex polygons as a kind of shape, and parallelograms as the first of them.

A polygon lies in the plane corner + x * edge_u + y * edge_v. A subclass tells which part of that
plane it is by its vertices, its edges and the planes through them.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, TypeVar

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.axes import SHUTTER_ENDS
from ...numerics.box_polynomials import linear_coefficients
from ...numerics.gather import columns
from ...numerics.vector import cross, dot
from ...scene.description import Quad, Quads
from ..camera import PinholeCamera
from ..implicit_surface import ImplicitPlane
from ..light_protocol import AreaLight, LightShape
from ..line_forms import BoxRays
from ..occluder_outline import POLYGON, RAYS
from ..pixel_coverage import PixelCoverage
from ..planar_faces import NO_SOLID, PlanarFaces
from ..receivers import Receivers
from ..shaded_patches import ShadedPatches
from ..shadow_edges import ShadowEdges
from ..shape import ShapeSet, Span, shutter_ends
from ..sphere.kernels import surface_tolerance
from .closed_boxes import find_boxes, outward_sign
from .kernels import (
    PlaneNormals,
    distance_to_polygon,
    distance_to_quad,
    edge_planes,
    intersect_quad,
    moves_in_own_plane,
    plane_hits,
    quad_blocks_segment,
    quad_edges,
    snapped_height,
)
from .light_occlusion import (
    moving_polygon_may_shadow,
    polygon_casts_sharp_edge,
    polygon_hides_from_patch,
    polygon_occlusion,
)
from .line_polynomials import (
    PolygonForms,
    edge_functions,
    parallelogram_edge_functions,
    polygon_forms,
)
from .pixel_coverage import moving_polygon_coverage, polygon_coverage
from .shadow_edges import polygon_shadow_edges
from .view import PolygonView

__all__ = ["ParallelogramSet", "PolygonSet", "PolygonView"]

QUAD_CORNERS = 4
"""Number of corners of quadrilaterals."""

Polygons = TypeVar("Polygons", bound="PolygonSet")


@dataclass(frozen=True)
class PolygonSet(ShapeSet):
    """Convex polygons of one number of edges: see `ShapeSet`.

    Attributes
    ----------
    corner : (3, n) metres, the first vertex.
    edge_u, edge_v : (3, n) metres, the edges that leave it.
    boxes : (n,) index of the first face of the closed box that each polygon is a face of, or
        `NO_SOLID`; None if there are no boxes.
    """

    corner: Array
    edge_u: Array
    edge_v: Array
    displacement: Array | None
    boxes: Ints | None = None
    planar: ClassVar[bool] = True

    @staticmethod
    @abstractmethod
    def vertices(q: Array, u: Array, v: Array) -> PlaneNormals:
        """Vertices (3, ...) in order, of polygons with corner q and edges u, v."""

    @staticmethod
    @abstractmethod
    def edges(q: Array, u: Array, v: Array) -> tuple[PlaneNormals, PlaneNormals]:
        """Start points and vectors (3, ...) of the edges, in the order of `planes`."""

    @staticmethod
    @abstractmethod
    def planes(q: Array, u: Array, v: Array) -> tuple[PlaneNormals, Array, Array]:
        """Planes through the origin and the edges, normal and height: see `edge_planes`."""

    @staticmethod
    @abstractmethod
    def distance(q: Array, u: Array, v: Array) -> Array:
        """Distances (m,), metres, from the origin to polygons with corner q and edges u, v."""

    @staticmethod
    def bounding_ball(q: Array, u: Array, v: Array) -> tuple[Array, Array]:
        """Centres (3, ...) and radii (...) of balls around polygons with corner q and edges u, v.

        They enclose the whole parallelogram q + x u + y v, x and y in 0..1; a kind of polygon that
        reaches beyond it has to override them.
        """
        plus, minus = u + v, u - v
        radius = 0.5 * np.sqrt(np.maximum(dot(plus, plus), dot(minus, minus)))
        return q + 0.5 * plus, radius

    def corners_at(self, index: Ints, time: Array | float) -> Array:
        """First vertices (3, ...) of polygons `index` at shutter times that broadcast with it."""
        return self.at_time(self.corner, index, time)

    def view(self, index: Ints, point: Array | float, time: Array | float) -> PolygonView:
        """Polygons as seen from points (3, ...), metres; 0 stands for the camera."""
        q = self.corners_at(index, time) - point
        u, v = columns(self.edge_u, index), columns(self.edge_v, index)
        planes, normal, height = self.planes(q, u, v)
        return PolygonView(
            q, u, v, self.vertices(q, u, v), *self.edges(q, u, v), planes, normal, height
        )

    def take(self: Polygons, index: Ints) -> Polygons:
        """The polygons selected by an index, without their boxes."""
        q, u, v = (columns(each, index) for each in (self.corner, self.edge_u, self.edge_v))
        d = self.displacement
        return type(self)(q, u, v, None if d is None else columns(d, index))

    @cached_property
    def unit_normal(self) -> Array:
        """Unit normals (3, n) along edge_u x edge_v."""
        unit = cross(self.edge_u, self.edge_v)
        unit /= np.sqrt(dot(unit, unit))
        return unit

    @property
    def fills_vertices(self) -> bool:
        """See `ShapeSet.fills_vertices`."""
        return True

    @cached_property
    def faces(self) -> PlanarFaces:
        """See `ShapeSet.faces`."""
        q, u, v, normal = self.corner, self.edge_u, self.edge_v, self.unit_normal
        solid = np.full(self.count, NO_SOLID) if self.boxes is None else self.boxes
        if self.boxes is not None:
            normal = normal * outward_sign(q, u, v, solid)
        size = np.sqrt(np.minimum.reduce([dot(edge, edge) for edge in self.edges(q, u, v)[1]]))
        return PlanarFaces(self.vertices(q, u, v), normal, size, self.displacement, solid)

    @property
    def bounding_spheres(self) -> tuple[Array, Array]:
        """Spheres around the middles of edge_u + edge_v: (3, n) and (n,), metres."""
        return self.bounding_ball(self.corner, self.edge_u, self.edge_v)

    def screen_span(self, camera: PinholeCamera) -> Span:
        """See `ShapeSet.screen_span`; from the vertices at both ends of the shutter."""
        index = np.arange(self.corner.shape[1])
        vertices: list[Array] = []
        for time in shutter_ends(self.displacement):
            vertices += self.vertices(self.corners_at(index, time), self.edge_u, self.edge_v)
        depth = np.array([dot(camera.forward[:, None], c) for c in vertices])
        behind = (depth <= 0.0).all(axis=0)
        whole = (depth <= 0.0).any(axis=0) & ~behind
        # rows of the inverse of (base, right, up). LAPACK is avoided: its threads spin for 20 ms
        base, right, up = (v[:, None] for v in (camera.base, camera.right, camera.up))
        rows = cross(up, base), cross(base, right)
        volume = dot(base, cross(right, up))
        spans = []
        for row in rows:
            safe = np.where(depth > 0.0, depth, 1.0)
            with np.errstate(over="ignore"):  # a vertex in the camera's plane has no finite image
                at = np.array([dot(row / volume, c) for c in vertices]) / safe
            low, high = at.min(axis=0, initial=np.inf), at.max(axis=0, initial=-np.inf)
            first = np.where(whole, -np.inf, np.where(behind, np.inf, low))
            last = np.where(whole, np.inf, np.where(behind, -np.inf, high))
            spans.append((first, last))
        return spans[0], spans[1]

    @property
    def moves_under_fixed_ray(self) -> Mask:
        """See `ShapeSet.moves_under_fixed_ray`: not where a polygon moves within its own plane."""
        d = self.displacement
        if d is None:
            return np.zeros(self.count, dtype=np.bool_)
        moves: Mask = d.any(axis=0) & ~moves_in_own_plane(d, self.edge_u, self.edge_v)
        return moves

    def implicit_surface(self, index: Ints) -> ImplicitPlane:
        """See `ShapeSet.implicit_surface`: edge_u x edge_v and the corner."""
        normal = cross(columns(self.edge_u, index), columns(self.edge_v, index))
        return ImplicitPlane(normal, columns(self.corner, index))

    def coverage(self, index: Ints, w: Array, camera: PinholeCamera, order: int) -> PixelCoverage:
        """See `ShapeSet.coverage`. Edge functions are linear, so jets are not needed."""
        del order
        q, u, v = (columns(part, index) for part in (self.corner, self.edge_u, self.edge_v))
        planes, normal, height = self.planes(q, u, v)
        return polygon_coverage(self.vertices(q, u, v), planes, normal, height, w, camera)

    def moving_coverage(
        self, index: Ints, w: Array, camera: PinholeCamera, order: int, whole_pixel: bool
    ) -> PixelCoverage:
        """See `ShapeSet.moving_coverage`."""
        del order
        u, v = columns(self.edge_u, index), columns(self.edge_v, index)
        corners = [self.corners_at(index, time) for time in SHUTTER_ENDS]
        normal = cross(u, v)
        planes = [self.planes(q, u, v)[0] for q in corners]
        height = [dot(q, normal) for q in corners]
        return moving_polygon_coverage(planes, height, normal, w, camera, whole_pixel)

    def least_cosine(self, index: Ints, cosine: Array, turn: Array, point: Array) -> Array:
        """See `ShapeSet.least_cosine`: the normal is the same everywhere."""
        del index, point
        return cosine - turn

    def depth_over_pixels(
        self, index: int, camera: PinholeCamera, x: Array, y: Array
    ) -> tuple[Array, Array]:
        """See `ShapeSet.depth_over_pixels`; the reciprocal of the depth is linear in x and y."""
        across = cross(self.edge_u[:, index], self.edge_v[:, index])
        height = float(across @ self.corner[:, index])
        facing = (across @ camera.base + x * (across @ camera.right)) + y * (across @ camera.up)
        # facing the camera
        unit = across / np.sqrt(across @ across) * (-1.0 if height > 0.0 else 1.0)
        return height / facing, unit[:, None, None, None]

    def intersect(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.intersect`. Planes are made once a polygon unless times differ by ray."""
        if isinstance(time, np.ndarray) and self.displacement is not None:
            q = self.corners_at(index, time)
            own = self.planes(q, columns(self.edge_u, index), columns(self.edge_v, index))
            return intersect_quad(w, *own)
        every = np.arange(self.corner.shape[1])
        when = 0.0 if isinstance(time, np.ndarray) else time
        planes, normal, height = self.planes(self.corners_at(every, when), self.edge_u, self.edge_v)
        chosen = tuple(columns(plane, index) for plane in planes)
        return intersect_quad(w, chosen, columns(normal, index), height[index])

    def surface(
        self, index: Ints, w: Array, point: Array, time: Array | float
    ) -> tuple[Array, Array, Mask]:
        """See `ShapeSet.surface`."""
        across = columns(self.unit_normal, index)
        away = dot(across, w) > 0.0
        return point, np.where(away, -across, across), np.zeros(index.size, dtype=np.bool_)

    def blocks(self, index: Ints, start: Array, to: Array, time: Array | float) -> Mask:
        """See `ShapeSet.blocks`."""
        q = self.corners_at(index, time) - start
        u, v = columns(self.edge_u, index), columns(self.edge_v, index)
        planes, normal, height = self.planes(q, u, v)
        graze = surface_tolerance(start, np.sqrt(dot(q, q)))
        return quad_blocks_segment(to, planes, normal, snapped_height(height, normal, graze))

    def occlusion(
        self,
        index: Ints,
        light: LightShape,
        receivers: Receivers,
        time: Array | float,
        order: int,
    ) -> tuple[Mask, Mask]:
        """See `ShapeSet.occlusion`. Edge functions are linear, so jets are not needed."""
        del order
        point = receivers.point
        q = self.corners_at(index, time) - point
        u, v = columns(self.edge_u, index), columns(self.edge_v, index)
        planes, normal, height = self.planes(q, u, v)
        height = snapped_height(height, normal, surface_tolerance(point, np.sqrt(dot(q, q))))
        to = light.to_center(point, time)
        if not light.extended:
            block = quad_blocks_segment(to, planes, normal, height)
            return ~block, block
        vertices, edges = self.vertices(q, u, v), self.edges(q, u, v)
        return polygon_occlusion(light, to, vertices, edges, planes, normal, height)

    def hides_from_patch(
        self, index: Ints, light: LightShape, receivers: Receivers, time: float
    ) -> Mask:
        """See `ShapeSet.hides_from_patch`."""
        point = receivers.point
        q = self.corners_at(index, time) - point
        u, v = columns(self.edge_u, index), columns(self.edge_v, index)
        planes, normal, height = self.planes(q, u, v)
        to, edges = light.to_center(point, time), self.edges(q, u, v)
        return polygon_hides_from_patch(light, to, receivers.reach, edges, planes, normal, height)

    def may_shadow(self, index: Ints, light: LightShape, receivers: Receivers) -> Mask:
        """See `ShapeSet.may_shadow`."""
        u, v = columns(self.edge_u, index), columns(self.edge_v, index)
        q = columns(self.corner, index) - receivers.point
        d = self.displacement
        corners = [q if d is None else q + time * columns(d, index) for time in SHUTTER_ENDS]
        planes = [self.planes(corner, u, v)[0] for corner in corners]
        to, edges = light.to_center(receivers.point), self.edges(np.zeros_like(q), u, v)
        return moving_polygon_may_shadow(
            light, to, receivers.reach, corners, edges, planes, cross(u, v)
        )

    def casts_sharp_edge(
        self, index: Ints, light: LightShape, receivers: Receivers, order: int
    ) -> Mask:
        """See `ShapeSet.casts_sharp_edge`."""
        del order
        q = columns(self.corner, index) - receivers.point
        u, v = columns(self.edge_u, index), columns(self.edge_v, index)
        planes, normal, height = self.planes(q, u, v)
        return polygon_casts_sharp_edge(
            light, receivers, self.edges(q, u, v), planes, normal, height
        )

    def may_reach_light(self, index: Ints, light: LightShape) -> Mask:
        """See `ShapeSet.may_reach_light`; from the distance to the polygon's plane."""
        normal = cross(columns(self.edge_u, index), columns(self.edge_v, index))
        height = dot(light.to_center(columns(self.corner, index)), normal)
        near: Mask = np.abs(height) <= light.radius * np.sqrt(dot(normal, normal))
        return near

    def shadow_edges(self, index: Ints, receivers: ShadedPatches, light: AreaLight) -> ShadowEdges:
        """See `ShapeSet.shadow_edges`."""
        view = self.view(index, receivers.places, receivers.time)
        motion = self.displacements(index)
        return polygon_shadow_edges(
            view, motion, receivers, light, self.distance, self.bounding_ball
        )

    def outline_kind(
        self, index: Ints, point: Array, own: Mask, light: AreaLight, time: Array | float
    ) -> Ints:
        """See `ShapeSet.outline_kind`: polygons that reach into a solid light have none."""
        del point, own
        kind = np.full(index.size, POLYGON)
        if light.solid:
            corner = -light.to_center(self.corners_at(index, time), time)
            u, v = columns(self.edge_u, index), columns(self.edge_v, index)
            away = distance_to_polygon(self.vertices(corner, u, v))
            kind[away < light.radius] = RAYS
        return kind

    def polygonal_outline(
        self, index: Ints, point: Array, time: Array | float
    ) -> tuple[Array, ...]:
        """See `ShapeSet.polygonal_outline`."""
        q = self.corners_at(index, time) - point
        return self.vertices(q, columns(self.edge_u, index), columns(self.edge_v, index))

    def quad_corners(self, index: Ints) -> Array | None:
        """See `ShapeSet.quad_corners`."""
        corners = self.vertices(
            *(each[:, index] for each in (self.corner, self.edge_u, self.edge_v))
        )
        if len(corners) > QUAD_CORNERS:
            return None
        last = len(corners) - 1
        return np.stack([corners[min(k, last)] for k in range(QUAD_CORNERS)], axis=1)

    def closest_points(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.closest_points`: here the hits on the polygons' planes."""
        q, u, v = (
            self.corners_at(index, time),
            columns(self.edge_u, index),
            columns(self.edge_v, index),
        )
        return plane_hits(w, cross(u, v), q, self.vertices(q, u, v))

    def extent(self, index: Ints, direction: Array, time: Array | float) -> tuple[Array, Array]:
        """See `ShapeSet.extent`; from the vertices."""
        u, v = columns(self.edge_u, index), columns(self.edge_v, index)
        vertices = self.vertices(self.corners_at(index, time), u, v)
        along = np.array([dot(vertex, direction) for vertex in vertices])
        return along.min(axis=0), along.max(axis=0)

    def line_forms(self, index: Ints, rows: Ints, rays: BoxRays) -> PolygonForms:
        """See `ShapeSet.line_forms`."""
        d = None if self.displacement is None else columns(self.displacement, index)
        corner = rays.positions(columns(self.corner, index), d)
        u, v = columns(self.edge_u, index), columns(self.edge_v, index)
        normal = cross(u, v)
        normal_dot = linear_coefficients(rays.directions, normal)[None]
        edges = self.edge_functions(rays, corner, u, v, normal_dot)
        return polygon_forms(rows, edges, normal_dot, corner, normal)

    def edge_functions(
        self,
        rays: BoxRays,
        corner: tuple[Array, Array | None],
        u: Array,
        v: Array,
        normal_dot: Array,
    ) -> tuple[Array, ...]:
        """Edge functions of polygons in boxes: see `line_polynomials.edge_functions`.

        Parameters
        ----------
        corner : (3, m) in the middle of the boxes, and its change over their times.
        u, v : (3, m) the edges that leave the corner.  normal_dot : (1, 3, m) w.normal.
        """
        del normal_dot
        return edge_functions(rays, self.vertices(corner[0], u, v), corner[1])


@dataclass(frozen=True)
class ParallelogramSet(PolygonSet):
    """Parallelograms corner + x * edge_u + y * edge_v, x and y in 0..1."""

    @classmethod
    def from_records(
        cls, records: Sequence[Quad | Quads], origin: Array, displacement: Array | None
    ) -> ParallelogramSet:
        """Parallelograms relative to the camera at `origin` (3, 1), metres."""
        q, u, v = (
            np.concatenate(
                [np.asarray(vector, dtype=np.float64).reshape(3, -1) for vector in part], axis=1
            )
            if part
            else np.zeros((3, 0))
            for part in (
                [r.corner for r in records],
                [r.edge_u for r in records],
                [r.edge_v for r in records],
            )
        )
        counts = [r.count if isinstance(r, Quads) else 1 for r in records]
        names = np.repeat(np.array([r.name for r in records], dtype=np.str_), counts)
        seen = [(r.visibility.camera, r.visibility.shadow, r.visibility.passed_by) for r in records]
        number = {each: k for k, each in enumerate(dict.fromkeys(seen))}
        met = np.repeat(np.array([number[each] for each in seen], dtype=np.int64), counts)
        boxes = find_boxes(q - origin, u, v, displacement, names, met)
        return cls(q - origin, u, v, displacement, boxes)

    @staticmethod
    def vertices(q: Array, u: Array, v: Array) -> PlaneNormals:
        """See `PolygonSet.vertices`."""
        return (q, q + u, q + u + v, q + v)

    @staticmethod
    def edges(q: Array, u: Array, v: Array) -> tuple[PlaneNormals, PlaneNormals]:
        """See `PolygonSet.edges`."""
        return quad_edges(q, u, v)

    @staticmethod
    def planes(q: Array, u: Array, v: Array) -> tuple[PlaneNormals, Array, Array]:
        """See `PolygonSet.planes`."""
        return edge_planes(q, u, v)

    @staticmethod
    def distance(q: Array, u: Array, v: Array) -> Array:
        """See `PolygonSet.distance`."""
        return distance_to_quad(q, u, v)

    def extent(self, index: Ints, direction: Array, time: Array | float) -> tuple[Array, Array]:
        """See `ShapeSet.extent`."""
        corner = dot(self.corners_at(index, time), direction)
        u = dot(columns(self.edge_u, index), direction)
        v = dot(columns(self.edge_v, index), direction)
        low = corner + np.minimum(u, 0.0) + np.minimum(v, 0.0)
        return low, corner + np.maximum(u, 0.0) + np.maximum(v, 0.0)

    def edge_functions(
        self,
        rays: BoxRays,
        corner: tuple[Array, Array | None],
        u: Array,
        v: Array,
        normal_dot: Array,
    ) -> tuple[Array, ...]:
        """See `PolygonSet.edge_functions`; opposite edges share their products."""
        return parallelogram_edge_functions(rays, corner, u, v, normal_dot)
