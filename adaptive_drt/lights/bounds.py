# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds of lights: what culling and the classification of occluders ask."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.light_protocol import LinearSpan, ViewCone
from ..numerics.arrays import Array, Mask
from ..numerics.vector import dot

__all__ = ["LightBounds", "ball_cone"]


@dataclass(frozen=True, kw_only=True)
class LightBounds:
    """A ball that encloses a light, relative to the tracer's origin, at the middle of the shutter.

    Lights implement the same questions more closely.

    Attributes
    ----------
    center : (3, 1) metres; of a light at infinity, a vector to it that is longer than all distances
        in a scene, and that `to_center` returns for every point.
    radius : metres, of a ball around the centre that encloses the light.
    displacement : (3, 1) metres over the shutter, or None for a static light.
    span : the light's surface if two coordinates span it linearly, so that it emits to one side,
        has straight edges, and jets in the two coordinates give ranges over it; else None.
    """

    center: Array
    radius: float
    displacement: Array | None = None
    span: LinearSpan | None = None

    def center_at(self, time: Array | float) -> Array:
        """Centre at shutter times (...): (3, ...), or (3, 1, ...) for a static light."""
        shape = (3,) + (1,) * max(np.ndim(time), 1)
        center = self.center.reshape(shape)
        if self.displacement is None:
            return center
        return center + time * self.displacement.reshape(shape)

    def to_center(self, point: Array, time: Array | float | None = None) -> Array:
        """Vectors from points (3, ...) to the centre: (3, ...) metres.

        time : shutter times that broadcast with the points'; None for the middle of the shutter.
        """
        center = self.center if time is None else self.center_at(time)
        to: Array = center.reshape(center.shape + (1,) * (point.ndim - center.ndim)) - point
        return to

    def height_over_planes(self, normal: Array, offset: Array) -> Array:
        """Signed distances (n,) of the centre from planes normal.x = offset, in metres."""
        height: Array = dot(normal, self.center) - offset
        return height

    @property
    def swept_radius(self) -> float:
        """Radius (metres) of a ball around the centre that encloses the light and its motion."""
        d = self.displacement
        return self.radius if d is None else self.radius + 0.5 * float(np.sqrt(dot(d, d))[0])

    @property
    def extended(self) -> bool:
        """Whether the light has a size, so that it casts penumbrae."""
        return True

    def view_cone(self, to: Array) -> ViewCone:
        """Return the cones of directions that enclose the light, seen from points.

        to : (3, ...) metres, vectors from the points to the centre.

        With u = 2^-53 and t the half angle, errors are at most 4 u: of the distance for it and
        `near`, of the sine, of 1 / cos t for the cosine, of (distance + radius) / cos t for `far`.
        """
        return ball_cone(to, self.radius)[0]

    def is_behind(self, to: Array, radius: Array, path: bool = False) -> Mask | bool:
        """Whether balls (n,) lie wholly behind a light that emits to one side.

        to : from the balls' centres.  path : whether the answer holds during the whole shutter.
        """
        return False


def ball_cone(to: Array, radius: float) -> tuple[ViewCone, Array]:
    """Return the cones of directions to a ball, and the lengths (...) of the tangents to it.

    The `far` of these cones is the distance of the ball's far side.
    """
    dd = dot(to, to)
    distance = np.sqrt(dd)
    if radius > 0.0 and (distance > radius).all():
        near, far = distance - radius, distance + radius
        tangent = near * far
        np.sqrt(tangent, out=tangent)
        cone = ViewCone(to / distance, distance, tangent / distance, radius / distance, near, far)
        return cone, tangent
    safe = np.where(distance > 0.0, distance, 1.0)
    axis = to / safe
    inside = distance <= radius if radius > 0.0 else np.zeros(distance.shape, dtype=np.bool_)
    sine = np.where(inside, 1.0, radius / safe)
    tangent = np.sqrt(np.maximum((distance - radius) * (distance + radius), 0.0))
    cosine = np.where(inside, -1.0, tangent / safe)
    near = np.where(inside, 0.0, distance - radius)
    far = distance + radius
    return ViewCone(axis, distance, cosine, sine, near, far), np.where(inside, far, tangent)
