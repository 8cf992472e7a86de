# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tracer asks of a light: the interface that each kind of light implements."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..geometry.axial_profile import AxialProfile
from ..geometry.light_plane import LightPlane
from ..geometry.light_protocol import LinearSpan
from ..geometry.planar_faces import PlanarFaces
from ..geometry.silhouettes import OpenSilhouette
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.vector import dot
from ..scene.description import Light, Motion, Shape, vector_of
from .bounds import LightBounds
from .coplanarity import planes_through_ball
from .environment_factor import Environment

__all__ = ["Emitter", "LightContact", "LightMotion", "ProfileEdge", "column"]


@dataclass(frozen=True)
class LightContact:
    """Where n shaded points are relative to the surface of a light that may pass through them.

    Attributes
    ----------
    gap : (n,) metres from that surface, or from the plane of a flat light; negative within the
        light or behind it.
    away : (3, n) unit vectors in which the gap grows.
    clearance : (n,) metres to the nearest point of the light.
    step : (n,) by how much the irradiance factor jumps where a point passes through the surface.
    """

    gap: Array
    away: Array
    clearance: Array
    step: Array


@dataclass(frozen=True)
class ProfileEdge:
    """Where n points are relative to the edge of a light's profile, as seen from the light.

    Attributes
    ----------
    gap : (n,) radians by which a point would have to turn to reach directions in which the
        radiance changes with the direction; at most 0 within them.
    onset : (n,) radians from the nearest direction in which that change begins or ends.
    width : (n,) radians over which it changes.
    """

    gap: Array
    onset: Array
    width: Array


@dataclass(frozen=True, kw_only=True)
class Emitter(LightBounds, ABC):
    """A light, relative to the tracer's origin, at the middle of the shutter.

    No caller may assume that the light is at a finite distance: vectors to its centre come from
    `to_center`. Methods take arrays, components first. In their parameters,

    - to : (3, ...) metres, vectors from points to the light's centre, at the time of each point.
    - point : (3, ...) metres, the points.  normal : (3, ...) unit normals on their lit side.
    - reach : (n,) metres; an answer then holds for all surface points within it of each point.
    - bend : (n,) curvature of the surfaces, 1 / m; 0 for planes.

    Attributes
    ----------
    name : the light's name in the scene.
    power : (3,) radiance (W / m^2 / sr) of an extended light; intensity (W / sr) of a point; both
        in the middle of its profile.
    casts_shadow : whether occluders hide it.
    coplanar : (objects,) which objects are planar and lie in the light's plane, so that they
        cannot occlude it; None if there are none.
    touched : (objects,) whose surfaces the light may reach or pass through during the shutter;
        None if there are none.
    passes : (objects,) which objects hide nothing of the light by their `Visibility`; None if there
        are none.
    unlit : (objects,) which objects it does not light by their `Visibility`; None if there are
        none.
    """

    name: str
    power: Array
    casts_shadow: bool = True
    coplanar: Mask | None = None
    touched: Mask | None = None
    passes: Mask | None = None
    unlit: Mask | None = None

    # --- distance -------------------------------------------------------------------------

    def distance_or(self, distance: Array, local: Array) -> Array:
        """Length (n,) metres by which lengths on the way to the light count as small.

        It is the distance to the light; a light at infinity has none, and `local` is returned.
        """
        return distance

    @property
    def occluder_inflation(self) -> float:
        """By how much (metres) to enlarge occluders so that lines to the light's centre meet them.

        All balls that may occlude some of the light then do; inf where no enlargement suffices.
        """
        return self.swept_radius

    def visible_shapes(self, reach: float) -> tuple[Shape, ...]:
        """Return what the camera sees of the light: shapes of one kind, relative to the origin.

        They are those of the middle of the shutter, with the light's motion. There are none where
        the light has no size, or only its dark side is seen. The radiance is `power`, times the
        `profile`.

        reach : metres, beyond which there are no objects.
        """
        del reach
        return ()

    @property
    def relative_motion(self) -> Motion | None:
        """Return the light's motion relative to the camera."""
        d = self.displacement
        return None if d is None else Motion(vector_of(d[:, 0]))

    # --- lights that replace this one in some questions -----------------------------------

    @abstractmethod
    def as_point(self) -> Emitter:
        """Return the light reduced to its centre, whose shadows have no penumbrae."""

    @abstractmethod
    def point_at(self, *offsets: Array) -> Emitter:
        """Return the same for other points of the light, at its centre plus each of the offsets.

        offsets : (3, n) metres.
        """

    def swept_bounds(self) -> LightBounds:
        """Return bounds at rest whose view cones enclose the light during the whole shutter."""
        return LightBounds(center=self.center, radius=self.swept_radius)

    def bounds_from_anywhere(self) -> LightBounds:
        """Return bounds that contain the light as every point sees it.

        They are the light itself unless that turns towards each point.
        """
        return self

    # --- extent ---------------------------------------------------------------------------

    @property
    def fills_cone(self) -> bool:
        """Whether the light is seen as a circle, which fills its view cone."""
        return False

    @property
    def solid(self) -> bool:
        """Whether the light is a ball, which points and occluders may lie within."""
        return False

    @property
    def surrounds(self) -> bool:
        """Whether the light surrounds all points, each of which sees what is above its horizon."""
        return False

    @property
    def uniform_hemisphere(self) -> bool:
        """Whether the light has one radiance in all directions above each point's horizon."""
        return False

    def outline_error(self, to: Array, normal: Array) -> Array | None:
        """Errors (n,) of irradiance factors where occluders hide a part of the light, or None.

        They are those of a silhouette that is not quite the light's outline.
        """
        return None

    @abstractmethod
    def extent(self, vector: Array) -> Array:
        """Largest |(L - centre).vector| over points L of the light, for vectors (3, n): (n,)."""

    @abstractmethod
    def half_angle(self, distance: Array) -> Array:
        """Half the angle (n,), in radians, of the light's view cone, at distances of its centre."""

    def half_angle_along(self, toward: Array, distance: Array) -> Array:
        """Half the angle (n,) of the light along unit vectors (3, n) across the line of sight."""
        return self.half_angle(distance)

    def outline_clearance(self, axis: Array, direction: Array, distance: Array) -> Array | None:
        """Angles (n,) from directions (3, n) to the nearest side of the light, negative outside.

        None where the light's extent towards the direction tells it, as for round lights.

        axis : (3, n) unit vectors to the centre.  distance : (n,) metres to it.
        """
        return None

    def falloff_offset(self, point: Array, time: float | None = None) -> tuple[Array, Array]:
        """Vectors (3, n) metres, by whose length irradiance falls off, and clear distances (n,).

        The vectors lead to the points from the part of the light that is nearest, or from the
        centre of a round light. The clear distances are those to the light's surface.
        """
        away = -self.to_center(point, time)
        return away, np.maximum(np.sqrt(dot(away, away)) - self.radius, 0.0)

    def coplanar_faces(self, faces: PlanarFaces, origin: Array) -> Mask:
        """Which planar shapes lie in the plane of the light, during the whole shutter: (n,).

        See `coplanarity`. `origin` (3, 1) metres is the tracer's origin in world space.
        """
        return planes_through_ball(self.center, self.radius, self.displacement, faces, origin)

    def is_coplanar(self, item: Ints) -> Mask:
        """Which of objects (...), given by index, lie in the light's plane; never for index -1."""
        if self.coplanar is None:
            return np.zeros(item.shape, dtype=np.bool_)
        found: Mask = self.coplanar[item] & (item >= 0)
        return found

    # --- sides ----------------------------------------------------------------------------

    def edge_on(self, item: Ints) -> Mask:
        """Which of objects (...), given by index, see the light edge-on: they receive nothing."""
        return np.zeros(item.shape, dtype=np.bool_)

    def receives_nothing(self, item: Ints) -> Mask | None:
        """Which of objects (...), given by index, the light does not light from any place.

        They see it edge-on, or are excluded. None if there are none; never for index -1.
        """
        if self.coplanar is None and self.unlit is None:
            return None
        dark = np.zeros(item.shape, dtype=np.bool_)
        if self.coplanar is not None:
            dark |= self.edge_on(item)
        if self.unlit is not None:
            dark |= self.unlit[item] & (item >= 0)
        return dark

    def front_sine(self, to: Array, distance: Array) -> Array | None:
        """Sine (n,) of the points' elevations over the plane of a light that emits to one side.

        distance : (n,) the length of `to`.  None for other lights.
        """
        return None

    @abstractmethod
    def plane(self, to: Array) -> LightPlane:
        """Return the plane behind which occluders block none of the light, seen from points."""

    @abstractmethod
    def horizon(
        self,
        to: Array,
        point: Array,
        normal: Array,
        reach: Array | float = 0.0,
        bend: Array | float = 0.0,
    ) -> tuple[Mask, Mask]:
        """Where the light contributes nothing, and where the horizon cuts it: (n,) each.

        A light that lies in the horizon up to rounding contributes nothing. The first answer holds
        for all points within reach, the second for the points themselves.
        """

    @abstractmethod
    def is_above_horizon(
        self, to: Array, point: Array, normal: Array, reach: Array, bend: Array
    ) -> Mask:
        """Where all of the light is above the horizon of all surface points within reach: (n,).

        A light that emits to one side must also face all of them.
        """

    def height_variation(self, to: Array, reach: Array | float, bend: Array | float) -> Array:
        """Bound (n,) in metres on the change of the light's height above the horizon within reach.

        On a plane the height does not change. On a sphere of centre C and radius r the height of a
        point L is n.(L - C) - r, and the normal n turns by reach / r.
        """
        if isinstance(reach, float) and reach == 0.0:
            return np.zeros(to.shape[1:])
        turn = np.minimum(reach * bend, 2.0)
        safe = np.where(np.asarray(bend) > 0.0, bend, 1.0)
        radius = np.where(np.asarray(bend) > 0.0, 1.0 / safe, 0.0)
        tilt: Array = turn * (np.sqrt(dot(to, to)) + self.radius + radius)
        return tilt

    @property
    def probe_sides(self) -> tuple[Array, Array] | None:
        """Two vectors (3, 1) metres: the centre plus or less half of one of them is on the light.

        None where points of the light depend on the place that sees it, as on round lights.
        """
        return None

    @property
    def line_span(self) -> LinearSpan | None:
        """The parallelogram along whose `half_u` lines run across the light, if they may."""
        return None

    def chords(self, b: Array) -> tuple[Array, Array]:
        """Ends (n,) each of lines on the light, from 0 to 1 along `line_span`; equal where none is.

        b : (n,) places of the lines across it, from 0 to 1.
        """
        raise NotImplementedError

    def line_sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """`sample` at places a, b (n, k) of `line_span`, as if the light filled it."""
        raise NotImplementedError

    def contact(self, to: Array, normal: Array) -> LightContact | None:
        """Return where points are relative to the light's surface; None if it has no fixed one.

        On the surface itself half of all directions are lit: those beyond the light's tangent
        plane, whose irradiance is pi (1 + cosine) / 2 by the cosine of the normals of both.
        """
        return None

    # --- angular profile ------------------------------------------------------------------

    @property
    def profile(self) -> AxialProfile | None:
        """Return how the radiance depends on the direction; None where it does not."""
        return None

    def profile_edge(self, to: Array) -> ProfileEdge | None:
        """Return where points are relative to the edge of the light's profile, None without one."""
        return None

    # --- environment ----------------------------------------------------------------------

    @property
    def environment(self) -> Environment | None:
        """Return how the radiance of a light around all points depends on the direction, or None.

        With one of k > 1 channels all irradiance factors are (k, n) instead of (n,).
        """
        return None

    @property
    def channel_count(self) -> int:
        """Number of channels of the irradiance factors."""
        return 1 if self.environment is None else self.environment.map.channel_count

    @property
    def channel_of(self) -> tuple[Environment, int] | None:
        """Return the environment of which the light is a channel and its number, or None."""
        return None

    @property
    def factor_error(self) -> float:
        """Return the error of the irradiance factors of the unhidden light; 0 for closed forms."""
        return 0.0

    def channels(self) -> tuple[Emitter, ...]:
        """Return lights of one channel, each with factors (n,), that add up to this one."""
        return (self,)

    def prepared(self, tolerance: float) -> Emitter:
        """Return the light with the tables that a picture of a tolerance needs."""
        return self

    # --- radiometry -----------------------------------------------------------------------

    @abstractmethod
    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance from the unoccluded light over its power, (n,); 0 where it is not visible.

        Error bounds are relative to exact arithmetic on the float64 inputs, in units of u = 2^-53,
        and hold for sizes and distances of 1e-6 to 1e6 and aspect ratios to 1e6.
        """

    @abstractmethod
    def normal_incidence_factor(self, square: Array, half: Array) -> Array:
        """Approximate irradiance factor (n,) of the light if it faced the point, from the zenith.

        square : (n,) squared distances of the centre.  half : (n,) of `half_angle`.
        """

    @abstractmethod
    def sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """Sample points of an extended light as seen from surface points, with weights.

        Parameters
        ----------
        to, point, normal : (3, n, 1), or `to` (3, n, k).  a, b : (n, k) in [0, 1).

        Returns
        -------
        to : (3, n, k) vectors from the points to points of the light.
        weight : (n, k) >= 0, the sample's contribution to the irradiance factor if it is visible;
            the factor is the mean of the weights. Samples are uniform over a quad's area and over
            the solid angle of a round light, at most 32 u (distance + size) metres off the light,
            u = 2^-53.
        """

    def silhouette(self, to: Array, normal: Array) -> OpenSilhouette:
        """Return the light's outline as seen from n points.

        It is asked only where `has_silhouette`.

        to, normal : (3, n), vectors to the light's centre, and unit normals on the points' lit
            sides.
        """
        raise NotImplementedError

    def has_silhouette(self, to: Array) -> Mask:
        """Where the light's outline is known (n,); elsewhere rays are distributed over it."""
        return np.zeros(to.shape[1:], dtype=np.bool_)


@dataclass(frozen=True)
class LightMotion:
    """How light records become emitters: relative to the camera, which then is at the origin.

    Attributes
    ----------
    origin, drift : (3,) metres, the camera's position and its displacement over the shutter. Both
        are subtracted, so that the camera is static at the origin.
    moving : False ignores the light's own motion, leaving it at its position at mid-shutter.
    """

    origin: Array
    drift: Array
    moving: bool = True

    def placed(
        self, light: Light, center: tuple[float, float, float], power: tuple[float, float, float]
    ) -> dict[str, Any]:
        """Return the fields of an emitter at a finite distance that do not depend on its kind."""
        move = -self.drift
        if self.moving and light.motion is not None:
            move = move + _displacement(light.motion)
        return {
            "name": light.name,
            "center": column(center) - self.origin[:, None],
            "power": np.array(power, dtype=np.float64),
            "displacement": move[:, None] if move.any() else None,
            "casts_shadow": light.casts_shadow,
        }


def _displacement(motion: Motion) -> Array:
    return np.array(motion.displacement, dtype=np.float64)


def column(vector: tuple[float, float, float]) -> Array:
    """Return three numbers as a column (3, 1)."""
    return np.array(vector, dtype=np.float64)[:, None]
