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
    """An ellipse of limited spread."""


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
