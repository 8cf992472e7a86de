# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance of a flat light whose spread is limited, as Blender's area lights have it.

At an angle t from the light's normal the radiance counts by 1 - tan t / tan h up to the half spread
h, and not at all beyond. With c = cos t the integrals from t to h are elementary:

    of f dc    (cos t - cos h) - (A(h) - A(t)) / tan h,        A(t) = artanh(sin t) - sin t
    of f c dc  (sin^2 h - sin^2 t) / 2 - (B(h) - B(t)) / tan h, B(t) = (t - sin t cos t) / 2
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from ..numerics.arrays import Array
from .axial_profile import AxialProfile

__all__ = ["SpreadProfile", "spread_gain"]


SMALL_HALF_SPREAD = 0.05
"""Half spread in radians below which Cycles takes the first term of the series of the gain."""


@dataclass(frozen=True)
class SpreadProfile(AxialProfile):
    """Relative radiance of a flat light of limited spread; `outer` is cos h, and `inner` is 1."""

    peaked: ClassVar[bool] = True

    def value(self, cosine: Array) -> Array:
        """Relative radiance (...), from 0 to 1, at cosines (...) of the angle from the normal."""
        c = np.clip(cosine, self.outer, 1.0)
        tangent = np.sqrt((1.0 - c) * (1.0 + c)) / c
        value: Array = np.maximum(1.0 - tangent / self._tangent, 0.0)
        return value

    @property
    def _tangent(self) -> float:
        return math.sqrt((1.0 - self.outer) * (1.0 + self.outer)) / self.outer

    @cached_property
    def _rests(self) -> tuple[Array, Array]:
        """A and B at the half spread."""
        edge = math.sqrt((1.0 - self.outer) * (1.0 + self.outer))
        return _tangent_integrals(np.array(edge), np.array(self.outer))

    def integrals(self, cosine: Array) -> tuple[Array, Array]:
        """Integrals (...) of f and of f c over the cosine c, from `outer` on."""
        c = np.clip(cosine, self.outer, 1.0)
        s = np.sqrt((1.0 - c) * (1.0 + c))
        edge = math.sqrt((1.0 - self.outer) * (1.0 + self.outer))
        slope = 1.0 / self._tangent
        rest, first_rest = self._rests
        own, first_own = _tangent_integrals(s, c)
        plain: Array = (c - self.outer) - slope * (rest - own)
        first: Array = 0.5 * (edge * edge - s * s) - slope * (first_rest - first_own)
        return plain, first


def _tangent_integrals(sine: Array, cosine: Array) -> tuple[Array, Array]:
    """A(t) and B(t) of the module, (...) each."""
    angle = np.arctan2(sine, cosine)
    return np.arctanh(sine) - sine, 0.5 * (angle - sine * cosine)


def spread_gain(spread: float) -> float:
    """Radiance along the normal of a light of limited spread, over that of one of 180 degrees.

    Both have the same power, as in Cycles. spread : radians, above 0 and below pi.
    """
    half = 0.5 * spread
    tangent = math.tan(half)
    if half < SMALL_HALF_SPREAD:
        return tangent * 3.0 / half**3
    return tangent / (tangent - half)
