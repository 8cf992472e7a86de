# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights prepared for tracing: one record for all kinds, bounding cones, and sampling."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.sphere.kernels import surface_tolerance
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.vector import cross, dot
from ..scene.description import DiskLight, Light, PointLight, QuadLight

__all__ = ["Emitter", "height_above_quad_light", "make_emitter", "sample_emitter", "view_cone"]

QUAD, SPHERE, DISK, POINT = "QUAD", "SPHERE", "DISK", "POINT"
"""Kinds of lights, values of `Emitter.kind`."""


@dataclass(frozen=True)
class Emitter:
    """A light, relative to the tracer's origin, at the middle of the shutter.

    Attributes
    ----------
    kind : 'QUAD', 'SPHERE', 'DISK' (always faces the shaded point) or 'POINT'.
    center : (3, 1) metres.
    half_u, half_v : (3, 1) metres, from a quad's centre to the middles of its sides; 0 otherwise.
    normal : (3, 1) unit vector of the side that a quad emits to; 0 otherwise.
    radius : metres, of a ball around the centre that encloses the light.
    power : (3,) radiance (W / m^2 / sr); a point light's intensity (W / sr).
    displacement : (3, 1) metres over the shutter, or None for a static light.
    touching : (objects,) which objects are quads in the light's plane, which cannot occlude it;
        None if there are none.
    """

    name: str
    kind: str
    center: Array
    half_u: Array
    half_v: Array
    normal: Array
    radius: float
    power: Array
    displacement: Array | None
    casts_shadow: bool
    touching: Mask | None = None

    def touches(self, item: Ints) -> Mask:
        """Which of objects (...), given by index, lie in the light's plane; never for index -1."""
        if self.touching is None:
            return np.zeros(item.shape, dtype=np.bool_)
        found: Mask = self.touching[item] & (item >= 0)
        return found

    def moved(self, time: Array | float) -> Array:
        """Centre at shutter times (...): (3, ...), or (3, 1, ...) for a static light."""
        shape = (3,) + (1,) * max(np.ndim(time), 1)
        center = self.center.reshape(shape)
        if self.displacement is None:
            return center
        return center + time * self.displacement.reshape(shape)

    @property
    def extended(self) -> bool:
        """Whether the light has a size, so that it casts penumbrae."""
        return self.kind != POINT

    @property
    def ball(self) -> float:
        """Radius (metres) of a ball around the centre that encloses the light and its motion."""
        d = self.displacement
        return self.radius if d is None else self.radius + 0.5 * _length(d)

    def pinpoint(self) -> Emitter:
        """Return the light reduced to a point at its centre, whose shadows have no penumbrae."""
        return replace(self, kind=POINT, radius=0.0)


def make_emitter(light: Light, origin: Array, drift: Array, moving: bool = True) -> Emitter:
    """Return a validated light as an emitter.

    Parameters
    ----------
    origin, drift : (3,) metres, the camera's position and its displacement over the shutter. Both
        are subtracted, so that the camera is static at the origin.
    moving : False ignores the light's own motion, leaving it at its position at mid-shutter.
    """
    move = -drift
    if moving and light.motion is not None:
        move = move + np.array(light.motion.displacement, dtype=np.float64)
    zero = np.zeros((3, 1))
    half_u = half_v = normal = zero
    if isinstance(light, QuadLight):
        half_u, half_v = _column(light.half_u), _column(light.half_v)
        normal = cross(half_u, half_v)
        normal = normal / np.sqrt(dot(normal, normal))
        corner = max(_length(half_u + half_v), _length(half_u - half_v))
        kind, radius = QUAD, corner
    elif isinstance(light, PointLight):
        kind, radius = POINT, 0.0
    else:
        kind, radius = (DISK if isinstance(light, DiskLight) else SPHERE), light.radius
    power = light.intensity if isinstance(light, PointLight) else light.radiance
    return Emitter(
        name=light.name,
        kind=kind,
        center=_column(light.center) - origin[:, None],
        half_u=half_u,
        half_v=half_v,
        normal=normal,
        radius=radius,
        power=np.array(power, dtype=np.float64),
        displacement=move[:, None] if move.any() else None,
        casts_shadow=light.casts_shadow,
    )


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


def view_cone(emitter: Emitter, center: Array, point: Array) -> ViewCone:
    """Return the cones of directions that enclose a light, seen from points.

    Parameters
    ----------
    center : (3, ...) the light's centre at the time of each point.  point : (3, ...) metres.

    With u = 2^-53 and t the half angle, errors are at most 4 u: of the distance for it and `near`,
    of the sine, of 1 / cos t for the cosine, of (distance + radius) / cos t for `far`.
    """
    to = center - point
    dd = dot(to, to)
    distance = np.sqrt(dd)
    safe = np.where(distance > 0.0, distance, 1.0)
    axis = to / safe
    r = emitter.radius
    if emitter.kind == DISK:
        slant = np.sqrt(dd + r * r)
        return ViewCone(axis, distance, distance / slant, r / slant, distance, slant)
    inside = distance <= r if r > 0.0 else np.zeros(distance.shape, dtype=np.bool_)
    sine = np.where(inside, 1.0, r / safe)
    tangent = np.sqrt(np.maximum((distance - r) * (distance + r), 0.0))
    cosine = np.where(inside, -1.0, tangent / safe)
    near = np.where(inside, 0.0, distance - r)
    far = tangent if emitter.kind == SPHERE else distance + r
    return ViewCone(axis, distance, cosine, sine, near, np.where(inside, distance + r, far))


def height_above_quad_light(emitter: Emitter, to: Array, point: Array) -> Array:
    """Signed distance (metres) of points in front of a quad light's plane, negative behind it.

    It is 0 for points within the surface tolerance of the plane: a surface in the plane of a light,
    on or beside it, receives nothing from it.

    Parameters
    ----------
    to : (3, ...) from the points to the light's centre.  point : (3, n) the points.
    """
    normal = emitter.normal.reshape((3,) + (1,) * (to.ndim - 1))
    height = -dot(normal, to)
    graze = surface_tolerance(point, emitter.radius)
    return np.where(np.abs(height) > graze, height, 0.0)


def sample_emitter(
    emitter: Emitter, center: Array, point: Array, normal: Array, a: Array, b: Array
) -> tuple[Array, Array]:
    """Sample points of an extended light as seen from surface points, with weights.

    Parameters
    ----------
    center, point, normal : (3, n, 1) metres; unit normals on the lit side.
    a, b : (n, k) in [0, 1).

    Returns
    -------
    to : (3, n, k) vectors from the points to points of the light.
    weight : (n, k) >= 0, the sample's contribution to the irradiance factor if it is visible; the
        factor is the mean of the weights. Samples are uniform over a quad's area and over the solid
        angle of a round light, at most 32 u (distance + size) metres off the light, u = 2^-53.
    """
    if emitter.kind == QUAD:
        half_u, half_v = emitter.half_u[:, :, None], emitter.half_v[:, :, None]
        to = (center - point) + ((2.0 * a - 1.0) * half_u + (2.0 * b - 1.0) * half_v)
        square = dot(to, to)
        away = np.maximum(height_above_quad_light(emitter, to, point), 0.0)
        edge = cross(half_u, half_v)
        area = 4.0 * np.sqrt(dot(edge, edge))
        return to, np.maximum(dot(normal, to), 0.0) * away * area / (square * square)
    direction, cosine, opening = _cone_directions(emitter, center, point, normal, a, b)
    d = np.sqrt(dot(center - point, center - point))
    r = emitter.radius
    if emitter.kind == DISK:
        length = d / cosine
    else:
        # the hit on the ball: its near side from outside, its far side from inside; from 1 - cosine
        # as sampled, since the cosine of a small ball has lost those digits
        drop = a * opening
        half = np.sqrt(np.maximum(r * r - d * d * (drop * (2.0 - drop)), 0.0))
        length = d * cosine + np.where(d > r, -half, half)
    return direction * length, (2.0 * np.pi) * opening * np.maximum(dot(normal, direction), 0.0)


def _cone_directions(
    emitter: Emitter, center: Array, point: Array, normal: Array, a: Array, b: Array
) -> tuple[Array, Array, Array]:
    """Unit directions (3, n, k), uniform over a round light's solid angle, and their cosines.

    The third result is 1 less the cosine of the cone's half angle.
    """
    cone = view_cone(emitter, center, point)
    # 1 - cos without cancellation; every direction where the point lies inside the light
    opening = np.where(cone.cosine < 0.0, 2.0, cone.sine**2 / (1.0 + np.abs(cone.cosine)))
    drop = a * opening
    cosine = 1.0 - drop
    sine = np.sqrt(np.maximum(drop * (2.0 - drop), 0.0))
    u, v = _frame(cone.axis, normal, point)
    turn = (2.0 * np.pi) * b
    direction = cosine * cone.axis + (sine * np.cos(turn)) * u + (sine * np.sin(turn)) * v
    return direction, cosine, opening


MIN_FRAME_SINE = 2.0**-26
"""Smallest sine of the angle between an axis and a normal at which a frame is aligned with the
normal: below it rounding decides the direction, and the frame uses the world's axes instead. Also
the smallest distance from the camera, as a fraction of the point's, of the plane of axis and normal
at which the camera's side of that plane is certain."""


def _frame(axis: Array, normal: Array, point: Array) -> tuple[Array, Array]:
    """Unit vectors that complete frames with axes (3, ...), covariant with rotation and reflection.

    The first is the normal's part perpendicular to the axis, the second points away from the
    camera, which is the origin. Where the axis is along the normal, the frame is built from world
    axes: Duff and others 2017, "Building an orthonormal basis, revisited".
    """
    x, y, z = axis
    sign = np.where(z < 0.0, -1.0, 1.0)
    p = -1.0 / (sign + z)
    q = x * y * p
    u = np.array([1.0 + sign * x * x * p, sign * q, -sign * x])
    v = np.array([q, sign + y * y * p, -y])
    lean = normal - dot(normal, axis) * axis
    size = np.sqrt(dot(lean, lean))
    leans = size > MIN_FRAME_SINE
    lean = lean / np.where(leans, size, 1.0)
    # again: where the vector was short, rounding left a component along the axis
    lean = lean - dot(lean, axis) * axis
    lean = lean / np.where(leans, np.sqrt(dot(lean, lean)), 1.0)
    aside = cross(axis, lean)
    far = np.sqrt(dot(point, point))
    aside = aside * np.where(dot(aside, point) < -MIN_FRAME_SINE * far, -1.0, 1.0)
    return np.where(leans, lean, u), np.where(leans, aside, v)


def _column(vector: tuple[float, float, float]) -> Array:
    return np.array(vector, dtype=np.float64)[:, None]


def _length(column: Array) -> float:
    return float(np.sqrt(dot(column, column))[0])
