# SPDX-License-Identifier: GPL-3.0-or-later
"""The faces of one mesh: hits of rays in float64, shading normals and where shadow rays begin.

Embree tells which face a ray meets; the hit is then computed in float64 in the plane of that face.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.vector import cross, dot, normalize
from ..camera import PinholeCamera
from ..light_protocol import LightBall
from ..line_crossings import LightLines, LineCrossings
from ..smooth_surface import SmoothSurface
from .bvh import face_clusters
from .edges import MeshEdges
from .outline_edges import OutlineEdges
from .outline_shafts import OutlineShafts
from .raster import ProjectedPolygons
from .tracer import START_OFFSET, FaceTracer

__all__ = ["MeshFaces", "barycentric", "smooth_normals"]


EDGE_SLACK = 1e-3
"""Barycentric coordinate by which a hit may lie outside of the face that embree found, by float32's
rounding; a hit farther outside is moved to this one."""


@dataclass(frozen=True)
class MeshFaces:
    """The faces of one mesh of one material, relative to the camera at mid-shutter.

    Attributes
    ----------
    vertices : (3, v) metres.  faces : (3, f), all with an area.
    normals : (3, 3, f) unit shading normals of the corners: corner, component, face; None for flat
        shading.
    """

    vertices: Array
    faces: Ints
    normals: Array | None

    @classmethod
    def make(cls, vertices: Array, faces: Ints, normals: Array | None) -> MeshFaces:
        """The faces that have an area, and the vertices that these use."""
        a, b, c = (columns(vertices, each) for each in faces)
        kept = (cross(b - a, c - a) != 0.0).any(axis=0).nonzero()[0]
        used, place = np.unique(faces[:, kept], return_inverse=True)
        corners = None if normals is None else columns(normals, kept, -1)
        if corners is not None:
            corners = np.array([_unit_or(each, cross(b - a, c - a)[:, kept]) for each in corners])
        return cls(columns(vertices, used), place.reshape(3, -1), corners)

    def __getstate__(self) -> dict[str, Any]:
        """Pickled state, without what is made again by who needs it."""
        made = ("_picture", "_before_lights")
        return {name: value for name, value in self.__dict__.items() if name not in made}

    def on_picture(self, camera: PinholeCamera) -> PictureOfMesh:
        """The faces and edges on the picture of a camera; those of the last one are kept."""
        kept = self.__dict__.get("_picture")
        if isinstance(kept, PictureOfMesh) and kept.camera is camera:
            return kept
        made = PictureOfMesh.make(self, camera)
        self.__dict__["_picture"] = made
        return made

    @property
    def is_empty(self) -> bool:
        """Whether there are no faces."""
        return not self.faces.size

    @property
    def face_count(self) -> int:
        """Number of faces."""
        return int(self.faces.shape[1])

    @property
    def build_seconds(self) -> float:
        """Seconds that embree's tree took to build in this process; 0 before its first ray."""
        tracer = self.__dict__.get("tracer")
        return tracer.build_seconds if isinstance(tracer, FaceTracer) else 0.0

    @property
    def bytes(self) -> int:
        """Memory of the faces' own arrays; embree's tree comes on top."""
        arrays = (self.vertices, self.faces, self.normals)
        return sum(each.nbytes for each in arrays if each is not None)

    @cached_property
    def tracer(self) -> FaceTracer:
        """Rays against these faces."""
        return FaceTracer(self.vertices, self.faces)

    @cached_property
    def edges(self) -> MeshEdges:
        """The edges of the faces."""
        return MeshEdges.make(self.vertices, self.faces, self.normals)

    @cached_property
    def outlines(self) -> OutlineEdges:
        """Outlines as seen from surface points."""
        return OutlineEdges.make(self.vertices, self.faces)

    @cached_property
    def clusters(self) -> tuple[Array, Array]:
        """Centres (3, c) and radii (c,), metres, of balls that together enclose the faces."""
        return face_clusters(self.vertices, self.faces)[1:]

    @cached_property
    def planes(self) -> tuple[Array, Array]:
        """Unit normals (3, f) of the faces, and the first corner (3, f) of each, metres."""
        a, b, c = (columns(self.vertices, each) for each in self.faces)
        size = np.maximum(np.abs(b - a).max(axis=0), np.abs(c - a).max(axis=0))
        return normalize(cross((b - a) / size, (c - a) / size)), a

    @cached_property
    def ball(self) -> tuple[Array, float]:
        """Centre (3,) and radius, metres, of a ball that encloses the faces."""
        if not self.faces.size:
            return np.zeros(3), 0.0
        low, high = self.vertices.min(axis=1), self.vertices.max(axis=1)
        middle = 0.5 * (low + high)
        gap = self.vertices - middle[:, None]
        return middle, float(np.sqrt(dot(gap, gap).max())) * (1.0 + 2.0**-50)

    def intersect(self, start: Array, w: Array, time: Array | float = 0.0) -> Array:
        """Ray parameters (n,) of the first hits of rays from `start` along w (3, n), or inf.

        The mesh is at rest at all times.
        """
        del time
        if not self.faces.size:
            return np.full(w.shape[1], np.inf)
        face = self.tracer.nearest(start, w)
        t = np.full(face.size, np.inf)
        rows = (face >= 0).nonzero()[0]
        t[rows] = self.depths(start[:, rows], w[:, rows], face[rows])
        return t

    def second_hits(self, w: Array, t: Array) -> Array:
        """Ray parameters (n,) of the hits behind the first ones at t (n,), from the camera; or inf.

        Hits so near the first one that embree cannot tell them apart are passed over.
        """
        step = START_OFFSET * self.tracer.size / np.maximum(np.sqrt(dot(w, w)), TINY)
        start = t + step
        return start + self.intersect(start * w, w)

    def depths(self, start: Array, w: Array, face: Ints) -> Array:
        """Ray parameters (n,) at which rays from `start` along w (3, n) meet faces (n,) that embree
        has found."""
        a, b, c = (columns(self.vertices, columns(each[None], face)[0]) for each in self.faces)
        normal = cross(b - a, c - a)
        slope = dot(normal, w)
        height = dot(normal, a - start)
        edge_on = np.abs(slope) <= TINY
        t = np.where(edge_on, 0.0, height) / np.where(edge_on, 1.0, slope)
        # of a face that is seen edge-on the plane gives any depth: it lies between its corners'
        depths = [dot(corner - start, w) / np.maximum(dot(w, w), TINY) for corner in (a, b, c)]
        low, high = np.minimum.reduce(depths), np.maximum.reduce(depths)
        slack = EDGE_SLACK * (high - low)
        depth: Array = np.maximum(np.clip(t, low - slack, high + slack), TINY)
        return depth

    def surface(
        self, start: Array, w: Array, point: Array, time: Array | float = 0.0
    ) -> tuple[Array, Array, SmoothSurface | None]:
        """Points and unit normals (3, n) on the viewer's side, of hits of rays.

        Points lie above the faces by what embree's rounding needs. Where shading is smooth, the
        surface that the normals stand for is returned with them.

        Parameters
        ----------
        start, w : (3, n) the rays.
        point : (3, n) points on them near the mesh, metres, relative to it at rest as `start` is.
        """
        del time
        face = self.tracer.nearest(start, w) if self.faces.size else np.full(w.shape[1], -1)
        # a point beside the mesh faces the viewer
        normal = -normalize(w)
        place = point.copy()
        smooth = None if self.normals is None else SmoothSurface(np.zeros_like(w), normal.copy())
        rows = (face >= 0).nonzero()[0]
        if not rows.size:
            return place, normal, smooth
        face = face[rows]
        plain = columns(self.planes[0], face)
        side = np.where(dot(plain, columns(w, rows)) > 0.0, -1.0, 1.0)
        at, plain = columns(point, rows), side * plain
        place[:, rows] = at + START_OFFSET * self.tracer.size * plain
        normal[:, rows] = plain
        if self.normals is not None and smooth is not None:
            corners = [columns(self.vertices, self.faces[k, face]) for k in range(3)]
            turned = [side * columns(self.normals[k], face) for k in range(3)]
            normal[:, rows], smooth.rise[:, rows] = smooth_normals(at, corners, turned, plain)
            smooth.facet[:, rows] = plain
        return place, normal, smooth

    def outline_crossings(self, point: Array, lines: LightLines) -> LineCrossings | None:
        """Where outlines seen from points (3, n), near each other, cross lines on a light."""
        half_u, half_v = 0.5 * lines.along, 0.5 * lines.across
        light = lines.origin + half_u + half_v, half_u, half_v
        key = np.concatenate(light).tobytes()
        kept: dict[bytes, OutlineEdges] = self.__dict__.setdefault("_before_lights", {})
        if key not in kept:
            kept[key] = self.outlines.before(self.outlines.sides_of(*light))
        return kept[key].crossings(point, lines)

    def outline_shafts(self, light: LightBall) -> OutlineShafts:
        """What tells whether outlines reach shafts to a light at rest."""
        a, b, c = (columns(self.vertices, each) for each in self.faces)
        return OutlineShafts.make(self.outlines, (a, b, c), light)

    def blocked(self, start: Array, to: Array, time: Array | float = 0.0, group: int = 1) -> Mask:
        """Whether a face lies between `start` (3, n) and `start + to`: (n,).

        `group` is that of `InstancedFaces.blocked`.
        """
        del time, group
        if not self.faces.size:
            return np.zeros(to.shape[1], dtype=np.bool_)
        return self.tracer.blocked(start, to)


@dataclass(frozen=True)
class PictureOfMesh:
    """The faces of a mesh, and the edges of its picture, on the picture of a camera."""

    camera: PinholeCamera
    faces: ProjectedPolygons
    edges: ProjectedPolygons

    @classmethod
    def make(cls, mesh: MeshFaces, camera: PinholeCamera) -> PictureOfMesh:
        """Project a mesh."""
        corners = [columns(mesh.vertices, each) for each in mesh.faces]
        chosen = mesh.edges.seen_from_origin(mesh.vertices)
        ends = [columns(mesh.vertices, mesh.edges.ends[k, chosen]) for k in range(2)]
        faces, edges = (ProjectedPolygons.make(each, camera) for each in (corners, ends))
        return cls(camera, faces, edges)


def smooth_normals(
    point: Array, corners: list[Array], normals: list[Array], plain: Array
) -> tuple[Array, Array]:
    """Interpolated unit normals (3, n) at points of faces, and what rises to the smooth surface.

    The surface is on the viewer's side, also where the normals of a mesh whose faces are not turned
    alike point away from the viewer: light from there is behind the face, which hides it.

    Parameters
    ----------
    point, plain : (3, n) points, and unit normals of the faces, metres.
    corners, normals : three of (3, n) each, corners of the faces and their unit normals.
    """
    share = barycentric(point, corners)
    mean: Any = sum(part * each for part, each in zip(share, normals, strict=True))
    side = np.where(dot(mean, plain) < 0.0, -1.0, 1.0)
    upward = [side * each for each in normals]
    height = _smooth_heights(point, share, corners, upward, mean)
    return _unit_or(mean, plain), height * side * mean


def _unit_or(vector: Array, other: Array) -> Array:
    """Unit vectors (3, n) along vectors, or along others (3, n) where those have no length."""
    short = dot(vector, vector) <= TINY
    return normalize(np.where(short, other, vector))


def barycentric(point: Array, corners: list[Array]) -> tuple[Array, Array, Array]:
    """Barycentric coordinates (n,) of points in their triangles, limited to 0 to 1."""
    a, b, c = corners
    u, v, p = b - a, c - a, point - a
    uu, uv, vv, pu, pv = dot(u, u), dot(u, v), dot(v, v), dot(p, u), dot(p, v)
    area = np.maximum(uu * vv - uv * uv, TINY)
    with np.errstate(over="ignore"):  # in faces whose area underflows
        y = np.clip((vv * pu - uv * pv) / area, 0.0, 1.0)
        z = np.clip((uu * pv - uv * pu) / area, 0.0, 1.0 - y)
    return 1.0 - y - z, y, z


def _smooth_heights(
    point: Array,
    share: tuple[Array, Array, Array],
    corners: list[Array],
    normals: list[Array],
    smooth: Array,
) -> Array:
    """Heights (n,) of the smooth surface over points of faces, in units of the interpolated normal.

    Shadow rays from a coarse face would meet its neighbours where the smooth surface is lit. They
    begin on a parabolic approximation of that surface instead, within its local linear envelope, as
    Cycles does near the terminator (`shadow_ray_smooth_surface_offset`, kernel/light/sample.h).
    """
    (u, v, _), (p, q, r), (first, second, third) = share, corners, normals
    a, b = dot(third - first, p - r), dot(third - second, q - r)
    c = dot(second - first, q - p)
    parabola = a * u * (u - 1.0) + (a + b + c) * u * v + b * v * (v - 1.0)
    tops = []
    for own, normal, one, other in (
        (p, first, q, r),
        (q, second, p, r),
        (r, third, p, q),
    ):
        rise = np.maximum(np.maximum(dot(one - own, normal), dot(other - own, normal)), 0.0)
        tops.append(np.maximum(dot(own - point, normal) + rise, 0.0))
    height: Array = np.maximum(np.minimum.reduce(tops), 0.5 * parabola)
    limit = np.sqrt(dot(smooth, smooth))
    return np.where(limit > 0.0, np.maximum(height, 0.0), 0.0)
