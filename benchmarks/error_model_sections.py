# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of the polygons that stand for spheres which the plane of a light cuts.

Random spheres in the planes of random lights are replaced by polygons of as many corners as the
tracer's, of half as many and of very many, and the light that is left is compared.
"""

from __future__ import annotations

import numpy as np
from error_model_rules import Samples, rms, together

from adaptive_drt.geometry.light_plane import LightPlane
from adaptive_drt.geometry.silhouettes import CircularSilhouette
from adaptive_drt.geometry.sphere.plane_section import clipped_sphere_polygons
from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.occluded_form_factor import visible_factor
from adaptive_drt.lights.registry import make_emitter
from adaptive_drt.numerics.arrays import Array
from adaptive_drt.scene.description import DiskLight, QuadLight
from adaptive_drt.shading.partial_occlusion import SECTION_CORNERS

__all__ = ["section_errors"]

LIGHTS = (
    QuadLight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, -0.6, 0.0), (1.0, 1.0, 1.0)),
    DiskLight((0.0, 0.0, 0.0), 1.0, (1.0, 1.0, 1.0)),
)
"""Lights about the origin that face down or, the disk, each point."""
POINTS = 1_500
"""Points that see each light, each with a sphere of its own."""
MANY_CORNERS = 16 * SECTION_CORNERS
"""Corners of the polygons that count as exact: their errors are less by 16^2 at least."""
CROSSED, SECTION_ONLY = 0, 1
"""Bins: another outline crosses the polygon, or it lies within the light."""


def section_errors(rng: np.random.Generator) -> Samples:
    """Errors of visible factors over the unhidden ones, beside the differences to rough polygons.

    Both are divided by the geometric mean of both RMS over all spheres of a light, so that no light
    decides for the other.
    """
    return together([_errors_of(light, rng) for light in LIGHTS])


def _errors_of(record: QuadLight | DiskLight, rng: np.random.Generator) -> Samples:
    """Errors for the points and spheres of one light."""
    light = make_emitter(record, LightMotion(np.zeros(3), np.zeros(3)))
    point = rng.uniform(-1.5, 1.5, (3, POINTS))
    point[2] = -rng.uniform(0.5, 3.0, POINTS)
    normal = rng.normal(size=(3, POINTS))
    normal[2] = np.abs(normal[2])
    normal /= np.sqrt((normal * normal).sum(axis=0))
    to = -point
    plane, outline = light.plane(to), light.silhouette(to)
    radius = 10.0 ** rng.uniform(-1.0, 0.3, POINTS)
    # centres near the light, in front of its plane or behind it by less than a radius
    center = rng.uniform(-1.2, 1.2, (3, POINTS))
    height = plane.height_of(center + to)
    center += plane.normal * (rng.uniform(-0.98, 0.98, POINTS) * radius - height)
    v = center + to
    outside = (v * v).sum(axis=0) > 1.05 * radius * radius
    whole = _visible(outline, normal, np.zeros((0, 3, 3, POINTS)))
    seen = [
        _visible(outline, normal, clipped_sphere_polygons(plane, v[None], radius[None], number))
        for number in (MANY_CORNERS, SECTION_CORNERS, SECTION_CORNERS // 2)
    ]
    some = outside & (whole > 0.0)
    true, unit = (seen[1] - seen[0])[some] / whole[some], (seen[2] - seen[1])[some] / whole[some]
    crossed = _crosses(plane, v, radius, light.radius)[some]
    bins = np.where(crossed, CROSSED, SECTION_ONLY)
    scale = np.sqrt(rms(true) * rms(unit))
    return Samples(true / scale, unit / scale, bins)


def _crosses(plane: LightPlane, v: Array, radius: Array, size: float) -> Array:
    """Whether the circles in which spheres and planes meet leave the ball around the light."""
    height = plane.height_of(v)
    foot = v - height * plane.normal - plane.point
    section = np.sqrt(np.maximum(radius * radius - height * height, 0.0))
    result: Array = np.sqrt((foot * foot).sum(axis=0)) + section > size
    return result


def _visible(outline: Array | CircularSilhouette, normal: Array, polygons: Array) -> Array:
    """Factors (n,) of the light that polygons leave."""
    nothing = np.zeros((0, 3, POINTS)), np.zeros((0, POINTS))
    return visible_factor(outline, normal, nothing, polygons)
