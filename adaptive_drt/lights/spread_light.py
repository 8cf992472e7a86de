# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat lights whose spread is limited, by a profile about their normal: see `SpreadProfile`.

Unoccluded as well as behind occluders they are integrated by quadrature along the arcs that bound
what is seen of them, wherever the profile varies over the light.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ..geometry.light_protocol import LinearSpan
from ..geometry.spread_profile import SpreadProfile, spread_gain
from ..numerics.arrays import Array
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..scene.description import EllipseLight, QuadLight
from .ellipse_light import EllipseEmitter, make_ellipse_emitter
from .emitter import LightMotion
from .flat_light import FlatEmitter
from .occluded_form_factor import visible_factor
from .quad_light import QuadEmitter, make_quad_emitter
from .spot_light import SpotEmitter

__all__ = ["make_spread_ellipse_emitter", "make_spread_quad_emitter"]


SIDES = 64
"""Number of sides of the polygons that stand for ellipses whose visible part is integrated."""
OUTLINE_ERROR = 1.5e-5
"""Largest error of what is seen in part of a polygon of 64 sides instead of a circle at a distance
of several radii, as a fraction of the whole light. An outline that crosses the ellipse cuts off a
part of a side's circular segment more or less, of which each is 2 pi^3 / (3 SIDES^3) of the area.
Measured: it grows as in `SpreadEllipseEmitter.outline_error`; see the tests of elliptic lights."""


@dataclass(frozen=True, kw_only=True)
class _SpreadEmitter(SpotEmitter):
    """A flat light of limited spread."""

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance over the radiance along the light's normal, (n,) in sr."""
        plain = super().irradiance_factor(to, point, normal)  # type: ignore[safe-super]
        cone = self.view_cone(to)
        level, varies = self.beam.at(cone.axis, np.arctan2(cone.sine, cone.cosine))
        factor: Array = level * plain
        rows = (varies & (plain > 0.0)).nonzero()[0]
        if rows.size:
            n = columns(normal, rows)
            none = np.zeros((0, 3, rows.size)), np.zeros((0, rows.size))
            flat = np.zeros((0, 4, 3, rows.size))
            outline = self.silhouette(columns(to, rows), n)
            factor[rows] = visible_factor(outline, n, none, flat, self.beam)
        return factor

    def sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """Sample the light uniformly over its area, weighted with its profile."""
        way, weight = super().sample(to, point, normal, a, b)  # type: ignore[safe-super]
        return way, weight * self._relative(way / np.maximum(np.sqrt(dot(way, way)), TINY))


@dataclass(frozen=True, kw_only=True)
class SpreadQuadEmitter(_SpreadEmitter, QuadEmitter):
    """A parallelogram of limited spread."""


@dataclass(frozen=True, kw_only=True)
class SpreadEllipseEmitter(_SpreadEmitter, EllipseEmitter):
    """An ellipse of limited spread. Its outline is a polygon of the same area."""

    span: LinearSpan

    def outline_error(self, to: Array, normal: Array) -> Array:
        """Errors (n,) in sr of what is seen of the light behind occluders.

        They are fractions of the light's solid angle, times the largest cosine with the normal.
        The fractions grow with the square of the ratio of the axes, and where the light is closer
        than its shorter half axis with that of the distance.
        """
        shortest = float(np.sqrt(dot(self.span.half_v, self.span.half_v))[0])
        away = self._from_nearest(to)
        square = np.maximum(dot(away, away), TINY)
        fraction = (self.radius / shortest) ** 2 * (1.0 + shortest * shortest / square)
        height = np.maximum(-dot(self.span.normal, to), 0.0)
        length = np.maximum(np.sqrt(dot(to, to)), TINY)
        solid = np.minimum(np.pi * self.radius * shortest * height / length**3, 2.0 * np.pi)
        risen = np.maximum(dot(normal, to) + self.extent(normal), 0.0)
        error: Array = OUTLINE_ERROR * fraction * solid * np.minimum(risen / np.sqrt(square), 1.0)
        return error

    def corners(self, to: Array, sides: int = SIDES) -> list[Array]:
        """Corners (3, n) metres from the points, in order, of a polygon of the same area."""
        size = math.sqrt(2.0 * math.pi / (sides * math.sin(2.0 * math.pi / sides)))
        turn = 2.0 * math.pi * (np.arange(sides) + 0.5) / sides
        rows = zip(size * np.cos(turn), size * np.sin(turn), strict=True)
        return [to + a * self.span.half_u + b * self.span.half_v for a, b in rows]

    def silhouette(self, to: Array, normal: Array) -> Array:
        """Return the corners (`SIDES`, 3, n) of a polygon, in metres from the points."""
        return np.array(self.corners(to))


def make_spread_quad_emitter(light: QuadLight, motion: LightMotion) -> QuadEmitter:
    """Return a parallelogram light's emitter, whatever its spread."""
    plain = make_quad_emitter(light, motion)
    if light.spread >= math.pi:
        return plain
    return SpreadQuadEmitter(**_spread_fields(plain, light.spread))


def make_spread_ellipse_emitter(light: EllipseLight, motion: LightMotion) -> EllipseEmitter:
    """Return an elliptic light's emitter, whatever its spread."""
    plain = make_ellipse_emitter(light, motion)
    if light.spread >= math.pi:
        return plain
    return SpreadEllipseEmitter(**_spread_fields(plain, light.spread))


def _spread_fields(plain: FlatEmitter, spread: float) -> dict[str, Any]:
    """Fields of a light of the same power as one without a limit."""
    found = {each.name: getattr(plain, each.name) for each in fields(plain)}
    found["power"] = plain.power * spread_gain(spread)
    found["beam"] = SpreadProfile(-plain.span.normal, math.cos(0.5 * spread), 1.0)
    return found
