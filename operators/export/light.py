# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights in the tracer's terms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...adaptive_drt.radiometry import (
    area_radiance,
    light_power,
    point_intensity,
    sphere_radiance,
)
from ...adaptive_drt.scene import (
    DiskLight,
    Issue,
    Light,
    PointLight,
    QuadLight,
    SphereLight,
    Vector,
    vector_of,
)
from .nodes import input_color, input_value, output_node, source_node, uses_nodes
from .shutter import Matrix, Track, path_of

FULL_SPREAD = math.pi - 1e-4
"""Radians: an area light of at least this spread is Lambertian; pi in float32 is no closer."""

SQUARE = 1e-5
"""Cosine between an area light's axes: less is float32's rounding."""


def light_of(thing: Any, track: Track, name: str, issues: list[Issue]) -> Light | None:
    """Return the light of an evaluated light object, or None with an issue that says why not."""
    light = thing.data
    if not np.isfinite(track.middle).all():
        reason = "its matrix is not finite: check its location and scale"
    else:
        reason = _unsupported(light)
    if reason is not None:
        issues.append(Issue(name, reason))
        return None
    power = _power(light, name, issues)
    if light.type == "POINT":
        return _point(light, power, track, name, issues)
    return _area(light, power, track, name, issues)


def _unsupported(light: Any) -> str | None:
    if light.type in ("SUN", "SPOT"):
        return f"{light.type.title()} lights are left out; use an Area or Point light"
    if light.type == "AREA":
        if light.shape not in ("SQUARE", "RECTANGLE"):
            return f"Area lights of shape {light.shape.title()} are left out; use a rectangle"
        if light.spread < FULL_SPREAD:
            degrees = math.degrees(light.spread)
            return f"its spread is {degrees:.0f}°: area lights below 180° are left out"
        if getattr(getattr(light, "cycles", None), "is_portal", False):
            return "it is a light portal, which gives no light of its own"
    elif light.type != "POINT":
        return f"lights of type {light.type.title()} are left out"
    return None


def _power(light: Any, name: str, issues: list[Issue]) -> Vector:
    warm = getattr(light, "use_temperature", False)
    r, g, b = light_power(
        light.energy,
        vector_of(light.color),
        getattr(light, "exposure", 0.0),
        vector_of(light.temperature_color) if warm else (1.0, 1.0, 1.0),
    )
    u, v, w = _shader(light, name, issues)
    return (r * u, g * v, b * w)


def _shader(light: Any, name: str, issues: list[Issue]) -> Vector:
    """Return the factor (RGB) that a light's own nodes put on its power."""
    white = (1.0, 1.0, 1.0)
    if not uses_nodes(light):
        return white
    output = output_node(light.node_tree)
    node = source_node(output.inputs["Surface"]) if output is not None else None
    strength = input_value(node.inputs["Strength"]) if _emits(node) else None
    color, exact = input_color(node.inputs["Color"]) if _emits(node) else (white, False)
    if strength is None or not exact:
        issues.append(Issue(name, "its shader nodes are left out; its own power and colour shine"))
        return white
    return (color[0] * strength, color[1] * strength, color[2] * strength)


def _emits(node: Any | None) -> bool:
    return node is not None and node.type == "EMISSION"


def _point(
    light: Any, power: Vector, track: Track, name: str, issues: list[Issue]
) -> PointLight | SphereLight | DiskLight:
    path = path_of(track)
    if path.reason:
        issues.append(Issue(name, path.reason))
    normalize, shadow = getattr(light, "normalize", True), bool(light.use_shadow)
    radius = float(light.shadow_soft_size)
    if radius == 0.0:
        intensity = point_intensity(power, normalize)
        return PointLight(path.position, intensity, path.motion, shadow, name)
    radiance = sphere_radiance(power, radius, normalize)
    # before 4.0 there was no soft falloff; 4.2 and later have the attribute
    kind = DiskLight if getattr(light, "use_soft_falloff", False) else SphereLight
    return kind(path.position, radius, radiance, path.motion, shadow, name)


def _area(
    light: Any, power: Vector, track: Track, name: str, issues: list[Issue]
) -> QuadLight | None:
    size_x = float(light.size)
    size_y = size_x if light.shape == "SQUARE" else float(light.size_y)
    # the light shines along its own -Z, and cross(X, -Y) = -Z
    half = np.array([[size_x, 0.0, 0.0], [0.0, -size_y, 0.0]]).T / 2.0
    half_u, half_v = (track.middle[:3, :3] @ half).T
    area = 4.0 * float(np.linalg.norm(np.cross(half_u, half_v)))
    if area == 0.0:
        issues.append(Issue(name, "its size is zero", missing=True))
        return None
    # a flattened depth changes no size, but leaves no direction to shine in; Cycles' is dark too
    if not track.middle[:3, 2].any():
        issues.append(Issue(name, "its scale along Z is zero, so it gives no light", missing=True))
        return None
    if _sheared(track.middle[:3, :3]):
        reason = "its parents shear it; sheared area lights are left out"
        issues.append(Issue(name, reason, missing=True))
        return None
    forward = -track.middle[:3, 2]
    if float(np.cross(half_u, half_v) @ forward) < 0.0:  # a mirrored object
        half_u, half_v = half_v, half_u
    path = path_of(track, shape=half)
    if path.reason:
        issues.append(Issue(name, path.reason))
    radiance = area_radiance(power, area, getattr(light, "normalize", True))
    return QuadLight(
        path.position,
        vector_of(half_u),
        vector_of(half_v),
        radiance,
        path.motion,
        bool(light.use_shadow),
        name,
    )


def _sheared(linear: Matrix) -> bool:
    length = np.linalg.norm(linear, axis=0)
    cosines = (linear / length).T @ (linear / length) - np.eye(3)
    return float(np.abs(cosines).max()) > SQUARE
