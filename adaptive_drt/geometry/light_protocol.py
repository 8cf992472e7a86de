# SPDX-License-Identifier: GPL-3.0-or-later
"""What shapes ask of a light to tell how much of it they hide.

Geometry does not know the kinds of lights: it takes any object with these attributes and methods.
`lights.bounds.LightBounds` has those of `LightBall`, and `lights.emitter.Emitter` has all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from ..numerics.arrays import Array, Mask
from .light_plane import LightPlane

__all__ = ["AreaLight", "LightBall", "LightShape", "LinearSpan", "ViewCone"]


@dataclass(frozen=True)
class ViewCone:
    """Circular cones of directions that enclose a light as seen from a batch of points.

    Attributes
    ----------
    axis : (3, ...) unit vectors to the light's centre.  distance : (...) metres to it.
    cosine, sine : of the half angle; (-1, 1) where the point lies inside the enclosing ball.
    near, far : (...) metres, bounds on the distance to the visible points of the light.

    For round lights the cone is the light's exact silhouette; a quad lies inside it.
    """

    axis: Array
    distance: Array
    cosine: Array
    sine: Array
    near: Array
    far: Array


@dataclass(frozen=True)
class LinearSpan:
    """The surface of a flat light that emits to one side.

    Its points are centre + a half_u + b half_v, with a and b in -1..1.

    Attributes
    ----------
    half_u, half_v : (3, 1) metres, from the centre to the middles of the sides.
    normal : (3, 1) unit vector of the side that it emits to.
    """

    half_u: Array
    half_v: Array
    normal: Array


class LightBall(Protocol):
    """A ball that encloses a light, of which nothing else needs to be known."""

    @property
    def radius(self) -> float:
        """Radius in metres."""

    @property
    def span(self) -> LinearSpan | None:
        """The light's surface if two coordinates span it linearly."""

    @property
    def extended(self) -> bool:
        """Whether the light has a size."""

    def to_center(self, point: Array, time: Array | float | None = None) -> Array:
        """Vectors (3, ...) metres from points to the centre, at shutter times."""

    def height_over_planes(self, normal: Array, offset: Array) -> Array:
        """Signed distances (n,) of the centre from planes normal.x = offset, in metres."""

    def view_cone(self, to: Array) -> ViewCone:
        """Cones that enclose the light, for vectors `to` (3, ...) metres to its centre."""

    def is_behind(self, to: Array, radius: Array) -> Mask | bool:
        """Whether balls (m,) lie wholly behind a light that emits to one side.

        to : (3, m) metres from the balls' centres.
        """


class LightShape(LightBall, Protocol):
    """A light whose extent along any direction is known."""

    @property
    def surrounds(self) -> bool:
        """Whether the light surrounds all points, each of which sees what is above its horizon."""

    @property
    def fills_cone(self) -> bool:
        """Whether the light is seen as a circle, which fills its view cone."""

    def as_point(self) -> LightBall:
        """The light reduced to its centre."""

    def extent(self, vector: Array) -> Array:
        """Largest |(L - centre).vector| (m,) over points L of the light, for vectors (3, m)."""

    def distance_or(self, distance: Array, local: Array) -> Array:
        """The distance (m,) metres to the light, or `local` if that is at infinity."""


class AreaLight(LightBall, Protocol):
    """A light of which occluders hide a part; `lights.emitter.Emitter` documents the parameters.

    Attributes
    ----------
    displacement : (3, 1) metres over the shutter, or None for a static light.
    solid : whether points and occluders may lie within the light.
    surrounds : whether the light surrounds all points, each of which sees what is above its
        horizon.
    """

    @property
    def displacement(self) -> Array | None:
        """See the class."""

    @property
    def solid(self) -> bool:
        """See the class."""

    @property
    def surrounds(self) -> bool:
        """See the class."""

    def half_angle(self, distance: Array) -> Array:
        """Half the angle (n,), in radians, of the light, at distances of its centre."""

    def half_angle_along(self, toward: Array, distance: Array) -> Array:
        """Half the angle (n,) of the light along unit vectors (3, n) across the line of sight."""

    def outline_clearance(self, axis: Array, direction: Array, distance: Array) -> Array | None:
        """Angles (n,) from directions to the nearest side of the light; None for round lights."""

    def distance_or(self, distance: Array, local: Array) -> Array:
        """The distance (m,) metres to the light, or `local` if that is at infinity."""

    def plane(self, to: Array) -> LightPlane:
        """Return the plane behind which occluders block none of the light, seen from points."""
