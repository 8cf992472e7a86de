# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface of shapes: what the tracer asks of a set of shapes of one kind.

A kind of shape is a subclass of `ShapeSet` in a folder of its own and one entry in `registry`. The
abstract methods are all that a new kind has to answer; the others have defaults that follow from
bounding spheres and are conservative.

Rays leave the camera, which is the tracer's origin; their directions are not normalised. Objects of
a set are selected by `index`, integers of shape (m,) that broadcast against the other arguments: an
index of one element stands for all of them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.axes import SHUTTER_ENDS
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from .camera import PinholeCamera
from .implicit_surface import ImplicitPlane, ImplicitSurface
from .light_plane import LightPlane
from .light_protocol import AreaLight, LightBall, LightShape
from .line_crossings import LightLines, LineCrossings
from .line_forms import BoxRays, LineForms
from .mesh.outline_shafts import OutlineShafts
from .native_solids import NativeSolids
from .occluder_outline import RAYS
from .pixel_coverage import PixelCoverage
from .planar_faces import PlanarFaces
from .receivers import Receivers
from .shaded_patches import ShadedPatches
from .shadow_edges import ShadowEdges
from .smooth_surface import SmoothSurface
from .sphere.light_occlusion import moving_sphere_may_shadow
from .sphere.pixel_coverage import moving_sphere_coverage, sphere_coverage
from .sphere.shadow_edges import enclosed_shadow_edges

__all__ = ["MIN_PLANE_COSINE", "UNKNOWN_CURVATURE", "ShapeSet", "Span", "shutter_ends"]

Span = tuple[tuple[Array, Array], tuple[Array, Array]]
"""Least and largest x, and least and largest y, in pixels: (n,) each."""

MIN_PLANE_COSINE = 2.0**-52
"""Least cosine between the normal of a plane and a ray."""
UNKNOWN_CURVATURE = 2.0**256
"""Curvature, in 1 / m, of surfaces without a bound on theirs: larger than any that matters, and
finite, so that its product with an extent of 0 is 0."""


class ShapeSet(ABC):
    """n shapes of one kind as arrays, relative to the camera, at the middle of the shutter.

    Attributes
    ----------
    displacement : (3, n) metres over the shutter, or None if no shape moves.
    planar : whether each shape lies in a plane.
    fills_bounding_sphere : whether shapes fill so much of their bounding spheres that a search by
        bounding spheres finds few others. Such kinds come first in the registry.
    sampled : whether what shapes cover and hide is known by rays only. Method 'EXACT' then samples
        pixels that may show them, or that they may shade in part, and asks for no `line_forms`.
    traced_natively : whether embree has solids of this kind: see `native_solids`.
    occluder_cost : what the closed form of a light behind one of many such shapes costs, relative
        to that behind a sphere.
    has_elliptic_outlines : whether shapes hide lights behind outlines that are ellipses, or partly.
    uneven : whether what shapes cover and hide is bounded by larger shapes, so that planes which
        separate them by `extent` prove more (`detection.separating_planes`).
    """

    displacement: Array | None
    planar: ClassVar[bool] = False
    fills_bounding_sphere: ClassVar[bool] = False
    sampled: ClassVar[bool] = False
    traced_natively: ClassVar[bool] = False
    occluder_cost: ClassVar[float] = 1.0
    has_elliptic_outlines: ClassVar[bool] = False
    uneven: ClassVar[bool] = False

    @classmethod
    @abstractmethod
    def from_records(
        cls, records: Sequence[Any], origin: Array, displacement: Array | None
    ) -> ShapeSet:
        """Make the set from records of the scene description.

        Parameters
        ----------
        records : of this kind.  origin : (3, 1) metres, the camera in world space.
        displacement : (3, n) metres over the shutter, relative to the camera; None if none moves.
        """

    @property
    @abstractmethod
    def bounding_spheres(self) -> tuple[Array, Array]:
        """Centres (3, n) and radii (n,), metres, of spheres that enclose the shapes at rest."""

    @abstractmethod
    def intersect(self, index: Ints, w: Array, time: Array | float) -> Array:
        """Ray parameters of the first hits of rays from the camera, inf for a miss.

        Parameters
        ----------
        index : (m,) or (m, 1).  w : (3, m) or (3, m, k) directions.
        time : shutter times, a number or (m, k).
        """

    @abstractmethod
    def surface(
        self, index: Ints, w: Array, point: Array, time: Array | float
    ) -> tuple[Array, Array, Mask]:
        """Surface points of hits.

        Parameters
        ----------
        w, point : (3, m) directions and points t * w of the hits, metres.
        time : shutter times, a number or (m,).

        Returns
        -------
        point : (3, m) projected onto the surface.  normal : (3, m) unit, on the viewer's side.
        inside : (m,) whether the shape may hide light from these points of itself: where the inner
            side of a closed surface was hit, and on shapes that are not convex.
        """

    def smooth_surface(
        self, index: Ints, w: Array, point: Array, time: Array | float
    ) -> tuple[tuple[Array, Array, Mask], SmoothSurface | None]:
        """Surface points as `surface` gives them, with the smooth surface that facets stand for.

        The default has none.
        """
        return self.surface(index, w, point, time), None

    @abstractmethod
    def blocks(self, index: Ints, start: Array, to: Array, time: Array | float) -> Mask:
        """Whether shapes intersect the open segments from `start` to `start + to`: (m, k).

        Parameters
        ----------
        index : (m, 1).  start : (3, m, 1) metres, or (3, m, k) for kinds that are `sampled`.
        to : (3, m, k) metres.
        time : shutter times, a number or (m, k).
        """

    @abstractmethod
    def line_forms(self, index: Ints, rows: Ints, rays: BoxRays) -> LineForms:
        """Shapes seen through boxes in pixel and shutter time, as polynomials.

        Parameters
        ----------
        index : (m,).  rows : (m,) positions among all candidates, for `LineForms.rows`.
        rays : the camera's rays through the box of each.
        """

    @property
    def count(self) -> int:
        """Number of shapes."""
        return int(self.bounding_spheres[1].size)

    @property
    def curvature(self) -> Array:
        """Upper bounds (n,) on the curvatures of the surfaces, 1 / m; 0 for planes."""
        return np.full(self.count, 0.0 if self.planar else UNKNOWN_CURVATURE)

    def curvature_at(self, index: Ints, point: Array, certain: bool) -> Array:
        """Curvatures (m,) at points of shapes whose `curvature` has no bound, 1 / m.

        Parameters
        ----------
        point : (3, m) metres, hits at any time of the shutter.
        certain : whether they are such that normals turn by no more than their products with a
            distance, within any distance; else they are estimates.
        """
        del point, certain
        return self.curvature[index]

    @property
    def min_cosine(self) -> Array:
        """Least cosine (n,) between a ray and the normal at its hit that is taken for certain."""
        return np.full(self.count, MIN_PLANE_COSINE)

    @property
    def moves(self) -> Mask:
        """Whether each shape (n,) moves relative to the camera during the shutter."""
        if self.displacement is None:
            return np.zeros(self.count, dtype=np.bool_)
        moves: Mask = self.displacement.any(axis=0)
        return moves

    @property
    def moves_under_fixed_ray(self) -> Mask:
        """Whether the point (n,) that a fixed ray hits may move during the shutter."""
        return self.moves

    def implicit_surface(self, index: Ints) -> ImplicitSurface | None:
        """Planes or spheres on which shapes lie at mid-shutter; None for other surfaces."""
        del index
        return None

    def plane(self, index: Ints) -> tuple[Array, Array]:
        """Normals (3, m), of any length, of the planes of shapes, and a point (3, m) of each plane.

        Points are those at mid-shutter, metres. Only kinds that are `planar` have planes: those of
        their `implicit_surface`.
        """
        surface = self.implicit_surface(index)
        if not isinstance(surface, ImplicitPlane):
            raise NotImplementedError(f"{type(self).__name__} does not lie in planes")
        return surface.normal, surface.point

    def extent(self, index: Ints, direction: Array, time: Array | float) -> tuple[Array, Array]:
        """Least and greatest dot product (m,) of the points of shapes with vectors (3, m).

        The default is the extent of the bounding spheres.
        """
        center, radius = self.bounding_spheres
        place = columns(center, index)
        if self.displacement is not None:
            place = place + time * columns(self.displacement, index)
        middle = dot(place, direction)
        reach = radius[index] * np.sqrt(dot(direction, direction))
        return middle - reach, middle + reach

    @property
    def fills_vertices(self) -> bool:
        """Whether planar shapes fill the convex hulls of the vertices in `faces`, in that order."""
        return False

    @property
    def faces(self) -> PlanarFaces | None:
        """The planes of planar shapes; None for sets of other shapes."""
        return None

    @property
    def bodies(self) -> Ints | None:
        """Numbers (n,) of the convex solids that shapes of several sets are faces of, -1 for none.

        From the outer side of a face all of its solid is below the horizon. None: there are none.
        """
        return None

    def native_solids(self, index: Ints | slice) -> NativeSolids:
        """Solids in the form that embree traces, of sets that say so (`traced_natively`)."""
        raise NotImplementedError(f"{type(self).__name__} are not traced by embree as they are")

    @property
    def inner_radii(self) -> Array:
        """Radii (n,), metres, of balls inside the shapes, around the bounding spheres' centres.

        All that such a ball hides from outside of it is hidden by the shape; 0 for no ball.
        """
        return np.zeros(self.count)

    def enclosing_balls(self, index: int) -> tuple[Array, Array] | None:
        """Centres (3, c) and radii (c,), metres, of balls that together enclose a shape at rest.

        The default is None: the bounding sphere is all that there is. A shape of many balls
        occludes only what one of its balls may.
        """
        del index
        return None

    def screen_span(self, camera: PinholeCamera) -> Span:
        """Bounds of the shapes on the screen over the shutter, in pixels.

        The span is (-inf, inf) for a shape that meets the plane through the camera parallel to the
        image, and (inf, -inf) for one behind that plane.
        """
        center, radius = self.bounding_spheres
        d = self.displacement
        ends = [center] if d is None else [center + time * d for time in shutter_ends(d)]
        across = ball_span(camera, camera.right, camera.up, ends, radius)
        return across, ball_span(camera, camera.up, camera.right, ends, radius)

    def depth_over_pixels(
        self, index: int, camera: PinholeCamera, x: Array, y: Array
    ) -> tuple[Array, Array]:
        """Ray parameters and unit normals of a shape at mid-shutter that fills blocks of pixels.

        Parameters
        ----------
        x, y : (1, s, n) and (s, 1, n) pixel coordinates.

        Returns
        -------
        depth : (s, s, n).  normal : (3, s, s, n), or an array that broadcasts to it.
        """
        shape = np.broadcast_shapes(x.shape, y.shape)
        w = camera.directions(*(np.broadcast_to(at, shape).ravel() for at in (x, y)))
        rows = np.full(w.shape[1], index)
        t = self.intersect(rows, w, 0.0)
        normal = self.surface(rows, w, t * w, 0.0)[1]
        return t.reshape(shape), normal.reshape(3, *shape)

    def coverage(self, index: Ints, w: Array, camera: PinholeCamera, order: int) -> PixelCoverage:
        """Coverage of m pixels by shapes at mid-shutter; the default follows from bounding spheres.

        w : (3, m) directions through the pixels' centres.  order : the order of jets.
        """
        center, radius = self.bounding_spheres
        v, r = columns(center, index), radius[index]
        return sphere_coverage(v, r, w, camera, order).of_enclosed(dot(v, v) <= r * r)

    def block_coverage(
        self, index: Ints, w: Array, camera: PinholeCamera, order: int
    ) -> PixelCoverage:
        """`coverage`, of pixels that stand for blocks of pixels: it may say less, to be quicker."""
        return self.coverage(index, w, camera, order)

    def moving_coverage(
        self, index: Ints, w: Array, camera: PinholeCamera, order: int, whole_pixel: bool
    ) -> PixelCoverage:
        """Coverage of m pixels during the shutter; the default follows from bounding spheres.

        whole_pixel : whether all rays of a pixel count, or only its centre's.
        """
        v, r = (part.take(index, axis=-1) for part in self.bounding_spheres)
        d = np.zeros_like(v) if self.displacement is None else columns(self.displacement, index)
        bound = moving_sphere_coverage(v, d, r, w, camera, order, whole_pixel)
        return bound.of_enclosed(np.zeros_like(bound.may_hit))

    def least_cosine(self, index: Ints, cosine: Array, turn: Array, point: Array) -> Array:
        """Lower bounds (m,) on the cosines between rays of pixels and the normals at their hits.

        The default is 0, no bound.

        Parameters
        ----------
        cosine : (m,) the cosine for the centre ray.  turn : (m,) bound on the sine of the angle
            between the centre ray and the others.
        point : (3, m) metres, the hits of the centre rays.
        """
        del index, turn, point
        return np.zeros_like(cosine)

    def occlusion(
        self,
        index: Ints,
        light: LightShape,
        receivers: Receivers,
        time: Array | float,
        order: int,
    ) -> tuple[Mask, Mask]:
        """Whether shapes certainly hide nothing, or certainly all of a light from points.

        Where a shape may hide a part, both are false; the default is false everywhere.

        Parameters
        ----------
        light : the light as it casts shadows.  receivers : m points; their reach does not count.
        time : shutter times of the light and the shapes, a number or (m,).  order : of jets.

        Returns
        -------
        none, full : (m,) bool.
        """
        del light, receivers, time, order
        none, full = np.zeros((2, index.size), dtype=np.bool_)
        return none, full

    def hides_from_patch(
        self, index: Ints, light: LightShape, receivers: Receivers, time: float
    ) -> Mask:
        """Whether shapes that hide a light from the receivers' points do so from whole patches.

        The default is nowhere. The answer does not hold for patches that a closed shape cuts, of
        which some points are inside it, as the light may be.

        Parameters
        ----------
        light : the light as it casts shadows.  receivers : m patches with a reach.
        time : the shutter time of the light and the shapes.
        """
        del light, receivers, time
        return np.zeros(index.size, dtype=np.bool_)

    def may_shadow(self, index: Ints, light: LightShape, receivers: Receivers) -> Mask:
        """Whether shapes may hide some of a light at rest from patches at some time: (m,).

        The default follows from the bounding spheres and the paths of their centres.
        """
        center, r = (part.take(index, axis=-1) for part in self.bounding_spheres)
        d = self.displacement
        moved = np.zeros_like(center) if d is None else columns(d, index)
        return moving_sphere_may_shadow(light, receivers, center, moved, r)

    def outline_crossings(
        self, index: int, point: Array, lines: LightLines
    ) -> LineCrossings | None:
        """Where outlines of one shape, seen from points (3, n), cross lines across a light.

        None where that is not known, as for most shapes, or where the shape moves.
        """
        return None

    def outline_shafts(self, index: int, light: LightBall) -> OutlineShafts | None:
        """What tells whether outlines of one shape reach shafts to a light at rest.

        None where that is not known, as for most shapes, or where the shape moves.
        """
        return None

    def edges_on_lines(
        self, index: int, camera: PinholeCamera, x: Ints, y: Ints, count: int
    ) -> tuple[Ints, Array] | None:
        """Where edges of one shape's picture cross horizontal lines within pixels.

        There are `count` lines in each of the pixels x, y (n,), at heights (j + 0.5) / count.
        Returns the number of the line, pixel * count + j, and the place along it, from 0 to 1, of
        each crossing; or None where they are not known, as for most shapes.
        """
        return None

    @property
    def has_instances(self) -> bool:
        """Whether one of the objects is many copies of a mesh, at rest, which are stored once."""
        return False

    def figures(self) -> dict[str, Any]:
        """Figures for the statistics, such as numbers of faces; none for most kinds."""
        return {}

    def casts_sharp_edge(
        self, index: Ints, light: LightShape, receivers: Receivers, order: int
    ) -> Mask:
        """Whether shapes at mid-shutter may hide all of a light from one point of a patch and
        nothing from another: (m,). The default is everywhere.

        An edge where the shape itself cuts the patch may be missed: the coverage of pixels has it.

        Parameters
        ----------
        light : the light as it casts shadows, or points of it.  order : of jets.
        receivers : m patches of single pixels.
        """
        del light, receivers, order
        return np.ones(index.size, dtype=np.bool_)

    def hides_from_footprint(self, index: Ints, light: LightShape, receivers: Receivers) -> Mask:
        """Whether shapes at mid-shutter certainly hide a point light from whole footprints: (m,).

        The default is nowhere.
        """
        del light, receivers
        return np.zeros(index.size, dtype=np.bool_)

    def may_reach_light(self, index: Ints, light: LightShape) -> Mask:
        """Whether shapes at mid-shutter may come within the light's radius of its centre: (m,).

        The default follows from the bounding spheres.
        """
        center, r = (part.take(index, axis=-1) for part in self.bounding_spheres)
        gap = light.to_center(center)
        near: Mask = np.sqrt(dot(gap, gap)) <= r + light.radius
        return near

    def at_time(self, place: Array, index: Ints, time: Array | float) -> Array:
        """Points (3, ...) of shapes `index` at shutter times that broadcast against it.

        place : (3, n) metres, the points of all shapes at the middle of the shutter.
        """
        own: Array = columns(place, index)
        if self.displacement is None or (isinstance(time, float) and time == 0.0):
            return own
        return own + time * columns(self.displacement, index)

    def displacements(self, index: Ints) -> Array | None:
        """Displacements (3, m) over the shutter, metres, or None if no shape of the set moves."""
        d = self.displacement
        return None if d is None else columns(d, index)

    def shadow_edges(self, index: Ints, receivers: ShadedPatches, light: AreaLight) -> ShadowEdges:
        """Shadow edges that shapes cast over m patches; the default follows from bounding spheres.

        light : as it casts shadows.
        """
        center, radius = self.bounding_spheres
        place, d = columns(center, index), self.displacements(index)
        if d is not None:
            place = place + receivers.time * d
        return enclosed_shadow_edges(place, radius[index], d, receivers, light)

    def outline_kind(
        self, index: Ints, point: Array, own: Mask, light: AreaLight, time: Array | float
    ) -> Ints:
        """How each shape hides an extended light from a point: (m,) kinds of `occluder_outline`.

        The default is `RAYS`: no closed form is known.

        Parameters
        ----------
        point : (3, m) metres.  own : (m,) whether the point lies on the shape itself.
        time : shutter times, a number or (m,).
        """
        del point, own, light, time
        return np.full(index.size, RAYS)

    def circular_outline(
        self, index: Ints, point: Array, time: Array | float
    ) -> tuple[Array, Array]:
        """Spheres of the same outlines: centres (3, ...) from the points, and radii (...), metres.

        It is asked only where `outline_kind` is `CIRCLE`. point : (3, ...) and time : (...) or a
        number, which broadcast against the index.
        """
        raise NotImplementedError

    def elliptic_outline(
        self, index: Ints, point: Array, time: Array | float
    ) -> tuple[Array, Array, Array]:
        """Flat ellipses of the same outlines: centres and two half axes (3, ...), metres.

        It is asked only where `outline_kind` is `ELLIPSE`; parameters as above. Centres are from
        the points; half axes are any two conjugate ones.
        """
        raise NotImplementedError

    def polygonal_outline(
        self, index: Ints, point: Array, time: Array | float
    ) -> tuple[Array, ...]:
        """Corners (3, ...) of shapes, metres from the points, in order; parameters as above.

        It is asked only where `outline_kind` is `POLYGON`.
        """
        raise NotImplementedError

    def quad_corners(self, index: Ints) -> Array | None:
        """Corners (3, 4, m) of flat shapes at mid-shutter, in order; of triangles the last one
        twice. None for kinds that are no such shapes.
        """
        return None

    def outline_in_plane(
        self, index: Ints, point: Array, time: Array | float, plane: LightPlane, corners: int
    ) -> Array:
        """Polygons (k, corners, 3, n) that cut shapes hide of the light's plane, seen from points.

        It is asked only where `outline_kind` is `CUT`.

        Parameters
        ----------
        index : (k, n).  point : (3, 1, n) metres.  time : (n,).
        plane : of the light, as seen from the n points.
        corners : number of corners of the polygons.
        """
        raise NotImplementedError

    def closest_points(self, index: Ints, w: Array, time: Array | float) -> Array:
        """Ray parameters (m,) of the points of rays (3, m) that are nearest to shapes they miss.

        The default is the point nearest to the centre of the bounding sphere.
        """
        center = columns(self.bounding_spheres[0], index)
        if self.displacement is not None:
            center = center + time * columns(self.displacement, index)
        nearest: Array = dot(w, center) / dot(w, w)
        return nearest


def shutter_ends(displacement: Array | None) -> tuple[float, ...]:
    """Shutter times between whose positions shapes move; only mid-shutter if none moves."""
    return (0.0,) if displacement is None else SHUTTER_ENDS


def ball_span(
    camera: PinholeCamera, step: Array, fixed: Array, ends: list[Array], r: Array
) -> tuple[Array, Array]:
    """Least and largest pixel coordinate along `step` of swept balls, (n,) each.

    The plane through the camera and the pixels of one coordinate x touches the ball where
    ((lower_left + x step) x fixed . v)^2 = r^2 |(lower_left + x step) x fixed|^2, a quadratic in x.
    A swept ball is the convex hull of the ball at both ends of the shutter, and so is its image.

    Parameters
    ----------
    step, fixed : (3,) changes of direction per pixel along the coordinate and along the other one.
    ends : the centres (3, n) at the ends of the shutter, metres.  r : (n,) radii, metres.
    """
    n0, n1 = cross(camera.base, fixed), cross(step, fixed)
    first, last = np.full(r.size, np.inf), np.full(r.size, -np.inf)
    whole = np.zeros(r.size, dtype=np.bool_)
    behind = np.zeros(r.size, dtype=np.int64)
    for v in ends:
        depth = dot(camera.forward[:, None], v)
        a, b = dot(n0[:, None], v), dot(n1[:, None], v)
        qa = b * b - r * r * dot(n1, n1)
        qb = a * b - r * r * dot(n0, n1)
        qc = a * a - r * r * dot(n0, n0)
        ahead = (depth > r) & (qa > 0.0)
        root = np.sqrt(np.maximum(qb * qb - qa * qc, 0.0))
        safe = np.where(ahead, qa, 1.0)
        first = np.where(ahead, np.minimum(first, (-qb - root) / safe), first)
        last = np.where(ahead, np.maximum(last, (-qb + root) / safe), last)
        back = depth < -r
        behind += back
        whole |= ~ahead & ~back
    whole |= (behind > 0) & (behind < len(ends))
    return np.where(whole, -np.inf, first), np.where(whole, np.inf, last)
