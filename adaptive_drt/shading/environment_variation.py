# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates of how far one sample of an environment's light may be from its mean over a patch.

An unhidden environment lights each normal differently, so it varies over curved surfaces only.
"""

from __future__ import annotations

import numpy as np

from ..geometry.patch import Patch
from ..lights.emitter import Emitter
from ..numerics.arrays import Array
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..tracing.intersect import Surface
from .variation import ROOT_KIND, SMOOTH_KIND, zero_variation

__all__ = ["environment_deviations"]


CURVATURE_COEFFICIENT = 1.0 / 6.0
"""Deviation by the turn of the normal, as a fraction of the second derivative of the irradiance
factor times the squared turn over the half extent. Derived: h^2/24 with h twice that."""
LEAST_TURN, LARGEST_TURN = 0.05, 0.5
"""Least and largest angle, in radians, of the differences that the derivatives are taken from: the
least is a few times the interpolation's steps over its accuracy."""
LIMB_RATIO = 0.3
"""As in `unoccluded_variation`: from where the normal turns by a square root within a patch."""


def environment_deviations(light: Emitter, to: Array, surface: Surface, patch: Patch) -> Array:
    """Deviations (4, 3, n) of the irradiance factors of a light that surrounds the points.

    to : (3, n) metres, vectors to the light's nominal centre.
    """
    result = zero_variation(patch.curvature.size)
    rows = (patch.curvature > 0.0).nonzero()[0]
    if not rows.size or light.environment is None:
        return result
    normal, point, to = (columns(v, rows) for v in (surface.normal, surface.point, to))
    slant, bend = patch.cosine[rows], patch.curvature[rows]
    middle = _factors(light, to, point, normal)
    slope = np.sqrt(np.maximum(1.0 - slant**2, 0.0)) * bend / slant**2
    for axis in patch.axes:
        turn = patch.surface_steps[axis, rows] * bend
        step = columns(patch.steps[axis], rows)
        across = step - normal * dot(normal, step)
        across /= np.maximum(np.sqrt(dot(across, across)), TINY)
        angle = np.clip(turn, LEAST_TURN, LARGEST_TURN)
        low, high = (
            _factors(light, to, point, np.cos(angle) * normal + side * np.sin(angle) * across)
            for side in (-1.0, 1.0)
        )
        second = np.abs(low - 2.0 * middle + high).max(axis=0) / (angle * angle)
        first = np.abs(high - low).max(axis=0) / (2.0 * angle)
        turn = np.minimum(turn, 1.0)
        result[SMOOTH_KIND, axis, rows] += CURVATURE_COEFFICIENT * second * turn * turn
        # near the limb the turn itself is not linear
        near = np.minimum(patch.view_steps[axis, rows] * slope, 1.0)
        size = CURVATURE_COEFFICIENT * first * turn * near
        kind = np.where(near < LIMB_RATIO, SMOOTH_KIND, ROOT_KIND)
        result[kind, axis, rows] += size
    return result


def _factors(light: Emitter, to: Array, point: Array, normal: Array) -> Array:
    """Unhidden irradiance factors (k, n)."""
    return np.atleast_2d(light.irradiance_factor(to, point, normal))
