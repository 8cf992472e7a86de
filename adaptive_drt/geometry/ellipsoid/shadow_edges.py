# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow edges of ellipsoids over patches: those of spheres of the same extent towards the light.

Where a shadow begins is told by the ellipsoid's extent along the line from the light's middle to
its own, as seen from the point; whether it hides all of the light, or lies within the light's
outline, by the balls within it and around it.
"""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array
from ...numerics.floats import TINY
from ...numerics.vector import dot, norm
from ..light_protocol import AreaLight
from ..shaded_patches import ShadedPatches
from ..shadow_edges import ShadowEdges
from ..sphere.shadow_edges import sphere_shadow_edges
from .unit_space import UnitSpace

__all__ = ["ellipsoid_shadow_edges"]


NEAREST = 0.995
"""Largest radius of the sphere that stands for an ellipsoid, as a fraction of the distance of its
centre from a point outside the ellipsoid, which must be outside that sphere as well."""


def ellipsoid_shadow_edges(
    center: Array,
    space: UnitSpace,
    displacement: Array | None,
    receivers: ShadedPatches,
    light: AreaLight,
) -> ShadowEdges:
    """Shadow edges of ellipsoids with centres (3, m) metres at the times of the patches."""
    point = receivers.places
    v = center - point
    place, length = space.coordinates(v), norm(v)
    outside = (dot(place, place) > 1.0) & ~receivers.own
    most = np.where(outside, NEAREST * length, np.inf)
    outer, inner = np.minimum(space.longest, most), np.minimum(space.shortest, most)
    r = outer
    if not light.surrounds:
        to = light.to_center(point, receivers.time)
        # across the line of sight, from the light's middle to the ellipsoid's
        across = v / np.maximum(length, TINY) - to / np.maximum(norm(to), TINY)
        across = across - (dot(across, v) / np.maximum(dot(v, v), TINY)) * v
        size = norm(across)
        extent = norm(space.covectors(across)) / np.maximum(size, TINY)
        r = np.clip(np.where(size > TINY, extent, outer), inner, outer)
    return sphere_shadow_edges(center, r, displacement, receivers, light, (inner, outer))
