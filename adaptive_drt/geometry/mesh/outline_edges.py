# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines of a mesh as seen from surface points, on lines across a flat light.

Along a line on the light, the number of faces between a point and the light changes only where an
edge of the mesh is seen to cross the line. Where the two faces of an edge lie on different sides of
it, as seen from the point, the changes by them cancel. What is left are outlines, borders and edges
of more than two faces: the silhouette edges of soft shadow volumes (Laine, Aila, Assarsson,
Lehtinen and Akenine-Moeller 2005, "Soft shadow volumes for ray tracing").

All edges of a face use the same number for the side on which the face shows, and all edges at a
vertex the same projection of it, so that rounding moves changes but loses none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.morton import morton_order
from ...numerics.vector import cross, dot, normalize
from ..line_crossings import LightLines, LineCrossings
from .welding import welded_vertices

__all__ = ["SIDE_MARGIN", "OutlineEdges", "sure_sides"]


CLUSTER_SIZE = 16
"""Number of edges of a cluster, which are tested together against the shaft to the light."""
SHAFT_MARGIN = 1e-9
"""Width, relative to the lengths involved, by which shafts are widened against rounding."""
SIDE_MARGIN = 1e-12
"""Rounding error of the height of a point over the plane of a face, relative to its terms."""


@dataclass(frozen=True)
class OutlineEdges:
    """The edges of a mesh at rest, in c clusters of s each.

    Attributes
    ----------
    start, end : (3, c, s) metres, the ends of the edges.
    planes : two of (4, c, s), of the faces that meet in each edge: normal and offset, with
        normal.x = offset.
    turn : (2, c, s) whether each face passes the edge from its start to its end (1) or the other
        way (-1); 0 where there is no such face.
    clusters : bounds of the clusters.
    """

    start: Array
    end: Array
    planes: tuple[Array, Array]
    turn: Array
    clusters: _Clusters

    @classmethod
    def make(cls, vertices: Array, faces: Ints) -> OutlineEdges:
        """The edges of a mesh: vertices (3, v), faces (3, f). Vertices at one place are one."""
        ends, face, turn = _edges_of_faces(vertices, faces)
        order = morton_order(0.5 * (vertices[:, ends[0]] + vertices[:, ends[1]]))
        # the last cluster is filled up by edges that no face passes
        lacking = -order.size % CLUSTER_SIZE
        order = np.append(order, np.repeat(order[-1:], lacking))
        shape = (-1, CLUSTER_SIZE)
        ends, face = (each[:, order].reshape(2, *shape) for each in (ends, face))
        turn = turn[:, order]
        turn[:, order.size - lacking :] = 0.0
        a, b, c = (columns(vertices, each) for each in faces)
        normal = normalize(cross(b - a, c - a))
        plane = np.concatenate([normal, dot(normal, a)[None]])
        first, last = (columns(vertices, each.ravel()).reshape(3, *shape) for each in ends)
        one, other = (columns(plane, each.ravel()).reshape(4, *shape) for each in face)
        turn = turn.reshape(2, *shape)
        clusters = _Clusters.make(first, last, (one, other), turn)
        return cls(first, last, (one, other), turn, clusters)

    def before(self, sides: tuple[Array, Array]) -> OutlineEdges:
        """The edges that may be outlines for segments to a light.

        A segment from a point to a light meets an edge only if the planes of both faces lie between
        its ends. So an edge of two faces, oriented alike, is an outline for a segment only if the
        light is on different sides of the faces, as the point is.

        sides : two of (c, s): on which side of `planes` all of the light lies, 1 or -1; 0 where
            that is not sure.
        """
        kept = (self.turn[0] + self.turn[1] != 0.0) | (sides[0] != sides[1]) | (sides[0] == 0.0)
        return self._take((kept & (self.turn != 0.0).any(axis=0)).ravel().nonzero()[0])

    def sides_of(self, center: Array, half_u: Array, half_v: Array) -> tuple[Array, Array]:
        """On which side of `planes` a parallelogram lies: see `before`.

        center, half_u, half_v : (3, 1) metres, as those of `LinearSpan`.
        """
        found = []
        for plane in self.planes:
            normal = plane[:3].reshape(3, -1)
            height = (dot(normal, center) - plane[3].ravel()).reshape(plane.shape[1:])
            extent = np.abs(dot(normal, half_u)) + np.abs(dot(normal, half_v))
            found.append(sure_sides(height, extent.reshape(height.shape), plane[3]))
        return found[0], found[1]

    def _take(self, edges: Ints) -> OutlineEdges:
        """Some of the edges, ascending, in clusters of their own."""
        # the last cluster is filled up by edges that no face passes
        lacking = -edges.size % CLUSTER_SIZE
        order = np.append(edges, np.repeat(edges[-1:], lacking))
        shape = (-1, CLUSTER_SIZE)

        def taken(values: Array) -> Array:
            part: Array = columns(values.reshape(values.shape[0], -1), order)
            return part.reshape(values.shape[0], *shape)

        turn = taken(self.turn)
        turn.reshape(2, -1)[:, edges.size :] = 0.0
        first, last = taken(self.start), taken(self.end)
        one, other = (taken(plane) for plane in self.planes)
        clusters = _Clusters.make(first, last, (one, other), turn)
        return OutlineEdges(first, last, (one, other), turn, clusters)

    def crossings(self, point: Array, lines: LightLines) -> LineCrossings:
        """Where outlines seen from points (3, n), near each other, cross lines on a light."""
        at, ends, change = self.seen_before(point, lines.ball)
        away = [end - columns(point, at) for end in ends]
        return lines.crossings(at, (away[0], away[1]), change)

    def seen_before(
        self, point: Array, light: tuple[Array, float]
    ) -> tuple[Ints, tuple[Array, Array], Array]:
        """Outlines seen from points (3, n), near each other, that may be before a light.

        light : centre (3, 1) and radius of a ball around it.

        Returns
        -------
        The points (m,) that see them, both ends (3, m) of each, and the change (m,) of the number
        of faces: see `LightLines.crossings`.
        """
        low, high = point.min(axis=1), point.max(axis=1)
        middle, half = 0.5 * (low + high)[:, None], 0.5 * (high - low)[:, None]
        span = np.sqrt(dot(half, half)) * (1.0 + SHAFT_MARGIN)
        near = self.clusters.may_outline(middle, span, light)[:, 0].nonzero()[0]
        none = np.zeros(1)
        some, at = self.clusters.take(near).may_outline(point, none, light).nonzero()
        cluster = near[some]
        spot = columns(point, at)[:, :, None]
        sides = [self._sides(k, cluster, spot) for k in range(2)]
        turn = columns(self.turn, cluster, 1)
        change = sides[0] * turn[0] + sides[1] * turn[1]
        pair, edge = change.nonzero()
        cluster, at, change = cluster[pair], at[pair], change[pair, edge]
        place = cluster * CLUSTER_SIZE + edge
        first, last = (columns(each.reshape(3, -1), place) for each in (self.start, self.end))
        return at, (first, last), change

    def _sides(self, number: int, cluster: Ints, point: Array) -> Array:
        """On which side of the faces of clusters (m,) points (3, m, 1) lie: (m, s), 1 or -1.

        The same operations decide it for all edges of a face.
        """
        a, b, c, offset = columns(self.planes[number], cluster, 1)
        height = a * point[0]
        height += b * point[1]
        height += c * point[2]
        return np.where(height < offset, 1.0, -1.0)


def sure_sides(height: Array, extent: Array, offset: Array) -> Array:
    """On which side of planes (...) a body lies, 1 or -1; 0 where that is not sure.

    height, extent : (...) metres, of its middle over the planes, and its reach from there along
        their normals.  offset : (...) metres, of the planes.
    """
    reach = extent + SIDE_MARGIN * (np.abs(height) + np.abs(offset))
    found: Array = np.sign(height) * (np.abs(height) > reach)
    return found


def _edges_of_faces(vertices: Array, faces: Ints) -> tuple[Ints, Ints, Array]:
    """Ends (2, e), faces (2, e) and turns (2, e) of edges, as `OutlineEdges` has them."""
    place = welded_vertices(vertices)
    first, last = faces.ravel(), np.roll(faces, -1, axis=0).ravel()
    own = np.tile(np.arange(faces.shape[1]), 3)
    turned = place[first] > place[last]
    low, high = np.where(turned, last, first), np.where(turned, first, last)
    real = (place[low] != place[high]).nonzero()[0]
    key = (place[low] * np.int64(place.size) + place[high])[real]
    order = np.argsort(key, kind="stable")
    real, key = real[order], key[order]
    leads = np.append(True, key[1:] != key[:-1])[: key.size]
    begin = leads.nonzero()[0]
    count = np.diff(begin, append=key.size)
    # two faces share a row; of edges with more of them, each face has a row of its own
    paired = np.repeat(count == 2, count)
    one = (leads | ~paired).nonzero()[0]
    two = np.minimum(one + 1, max(key.size - 1, 0))
    turn = np.where(turned[real], -1.0, 1.0)
    ends = np.array([low[real[one]], high[real[one]]])
    face = np.array([own[real[one]], own[real[two]]])
    return ends, face, np.array([turn[one], np.where(paired[one], turn[two], 0.0)])


@dataclass(frozen=True)
class _Clusters:
    """Bounds of c clusters of edges.

    Attributes
    ----------
    center, radius : (3, c) and (c,) metres, balls that enclose the edges.
    axis, spread : (3, c) and (c,), balls that enclose the unit normals of the edges' faces.
    bulge : (c,) metres, the largest distance of the planes of those faces from the centre.
    open : (c,) whether an edge is an outline from wherever it is seen, such as a border.
    """

    center: Array
    radius: Array
    axis: Array
    spread: Array
    bulge: Array
    open: Mask

    @classmethod
    def make(cls, first: Array, last: Array, planes: tuple[Array, ...], turn: Array) -> _Clusters:
        """Bounds of clusters, from the arrays of `OutlineEdges`."""
        center, radius = _enclosing_balls(np.concatenate([first, last], axis=2))
        used = [turn[k] != 0.0 for k in range(2)]
        # an edge's missing second face counts as its first, and edges that fill up as the others
        normals = [np.where(used[k], planes[k], planes[0])[:3] for k in range(2)]
        axis, spread = _enclosing_balls(np.concatenate(normals, axis=2))
        bulge = np.zeros(radius.size)
        for plane in planes:
            away = np.abs(dot(plane[:3], center[:, :, None]) - plane[3])
            bulge = np.maximum(bulge, away.max(axis=1))
        filled = (turn != 0.0).any(axis=0)
        lone = ((turn[0] + turn[1] != 0.0) & filled).any(axis=1)
        return cls(center, radius, axis, spread, bulge, lone)

    def take(self, some: Ints) -> _Clusters:
        """Some of the clusters."""
        names = self.__dataclass_fields__
        return _Clusters(**{name: columns(getattr(self, name), some, -1) for name in names})

    def may_outline(self, point: Array, span: Array, light: tuple[Array, float]) -> Mask:
        """Whether clusters may hold outlines before a light, from balls of points: (c, n).

        point : (3, n) centres of the balls.  span : (n,) their radii.
        light : centre (3, 1) and radius of a ball.
        """
        way = light[0] - point
        length = np.sqrt(dot(way, way))
        axis = way / np.maximum(length, TINY)
        # balls that lie within each other have no cone around them
        sine = np.minimum((light[1] - span) / np.maximum(length, TINY), 1.0)
        cosine = np.sqrt(np.maximum(1.0 - sine * sine, 0.0))
        gap = self.center[:, :, None] - point[:, None]
        square = dot(gap, gap)
        along = dot(axis[:, None], gap)
        aside = np.sqrt(np.maximum(square - along * along, 0.0))
        far = np.sqrt(square)
        margin = SHAFT_MARGIN * (length + far) + (1.0 + SHAFT_MARGIN) * self.radius[:, None]
        may: Mask = aside * cosine - along * sine <= span + margin
        may &= along >= -(span + margin)
        may &= along <= length + light[1] + span + margin
        height = np.abs(dot(self.axis[:, :, None], gap))
        slack = self.spread[:, None] * (far + span) + span + self.bulge[:, None]
        sure = height > slack + SIDE_MARGIN * (far + span)
        may &= ~sure | self.open[:, None]
        return may


def _enclosing_balls(points: Array) -> tuple[Array, Array]:
    """Centres (3, c) and radii (c,) of balls that enclose points (3, c, k)."""
    center = 0.5 * (points.min(axis=2) + points.max(axis=2))
    gap = points - center[:, :, None]
    radius = np.sqrt(dot(gap, gap).max(axis=1)) * (1.0 + SHAFT_MARGIN)
    return center, radius
