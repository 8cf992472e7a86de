# SPDX-License-Identifier: GPL-3.0-or-later
"""Spherical lights."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.light_plane import LightPlane
from ..geometry.light_protocol import ViewCone
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.vector import dot
from ..scene.description import Shape, Sphere, SphereLight, vector_of
from .bounds import LightBounds, ball_cone
from .emitter import LightContact, LightMotion
from .form_factor import cap_factor
from .round_light import RoundEmitter, cone_directions

__all__ = ["SphereEmitter", "make_sphere_emitter"]


@dataclass(frozen=True, kw_only=True)
class SphereEmitter(RoundEmitter):
    """A ball of uniform radiance."""

    @property
    def solid(self) -> bool:
        """Whether points and occluders may lie within the light: they may."""
        return True

    def visible_shapes(self, reach: float) -> tuple[Shape, ...]:
        """Return the ball."""
        del reach
        center = vector_of(self.center[:, 0])
        return (Sphere(center, self.radius, motion=self.relative_motion, name=self.name),)

    def bounds_from_anywhere(self) -> LightBounds:
        """Return the ball, whose far side counts: what is visible of it depends on the point."""
        return LightBounds(center=self.center, radius=self.radius, displacement=self.displacement)

    def view_cone(self, to: Array) -> ViewCone:
        """Return the cones of directions to the ball, of which the near side is visible."""
        cone, far = ball_cone(to, self.radius)
        return replace(cone, far=far)

    def half_angle(self, distance: Array) -> Array:
        """Half the angle (n,) of the ball, in radians."""
        half: Array = np.arcsin(np.minimum(self.radius / distance, 1.0))
        return half

    def has_silhouette(self, to: Array) -> Mask:
        """Where the points lie outside the ball: from inside, no cone contains it."""
        outside: Mask = ~(np.sqrt(dot(to, to)) <= self.radius)
        return outside

    def plane(self, to: Array) -> LightPlane:
        """Return the planes of the circles that are the ball's silhouettes."""
        square = np.maximum(dot(to, to), TINY)
        axis = to / np.sqrt(square)
        near = np.maximum(1.0 - self.radius**2 / square, 0.0)
        return LightPlane(-axis, to * near, np.full(to.shape[1], self.radius))

    def contact(self, to: Array, normal: Array) -> LightContact:
        """Return where points are relative to the ball; from within it fills the hemisphere."""
        distance = np.sqrt(dot(to, to))
        away = -to / np.maximum(distance, TINY)
        gap = distance - self.radius
        return LightContact(gap, away, np.abs(gap), 0.5 * np.pi * (1.0 + dot(normal, away)))

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance over the radiance, (n,) in sr, seen at half angle t: pi from within.

        The error is at most 32 u sin^2 t / cos t sr.
        """
        dd = dot(to, to)
        distance = np.sqrt(dd)
        cosine = dot(normal, to) / np.maximum(distance, TINY)
        r = self.radius
        tangent = np.sqrt(np.maximum((distance - r) * (distance + r), 0.0))
        safe = np.maximum(distance, TINY)
        outside = cap_factor(cosine, np.minimum(r / safe, 1.0), tangent / safe)
        # from inside the ball the light fills the whole hemisphere
        return np.where(distance <= r, np.pi, outside)

    def sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """Sample the visible side of the ball, uniformly over its solid angle."""
        cone = self.view_cone(to)
        direction, cosine, opening = cone_directions(cone, point, normal, a, b)
        d, r = cone.distance, self.radius
        # the hit on the ball: its near side from outside, its far side from inside; from 1 - cosine
        # as sampled, since the cosine of a small ball has lost those digits
        drop = a * opening
        half = np.sqrt(np.maximum(r * r - d * d * (drop * (2.0 - drop)), 0.0))
        length = d * cosine + np.where(d > r, -half, half)
        return direction * length, (2.0 * np.pi) * opening * np.maximum(dot(normal, direction), 0.0)


def make_sphere_emitter(light: SphereLight, motion: LightMotion) -> SphereEmitter:
    """Return a spherical light's emitter."""
    return SphereEmitter(**motion.placed(light, light.center, light.radiance), radius=light.radius)
