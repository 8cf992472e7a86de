# SPDX-License-Identifier: GPL-3.0-or-later
"""Depths of shadows in environments: as deep as what is behind the occluder is bright."""

from __future__ import annotations

import numpy as np

from ..lights.emitter import Emitter
from ..numerics.arrays import Array
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface

__all__ = ["shadow_emphasis"]


def shadow_emphasis(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs) -> Array:
    """Brightness (m,) of what lies behind occluders, relative to the mean over all directions that
    light the point: the factor by which their shadows are deeper than in a uniform sky.

    pairs : (m,) points and occluders.
    """
    environment = light.environment
    assert environment is not None
    item = pairs.item
    center, radius = plan.shapes.bounding_spheres
    way = columns(center, item) - columns(surface.point, pairs.pixel)
    distance = np.maximum(np.sqrt(dot(way, way)), TINY)
    half = np.arcsin(np.minimum(radius[item] / distance, 1.0))
    behind = environment.brightness(way / distance, half)
    rows, group = np.unique(pairs.pixel, return_inverse=True)
    point = columns(surface.point, rows)
    factor = np.atleast_2d(
        light.irradiance_factor(light.to_center(point), point, columns(surface.normal, rows))
    )
    most = np.maximum(factor, TINY) / np.pi
    emphasis: Array = (behind / columns(most, group)).max(axis=0)
    return emphasis
