# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights in the tracer's terms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...adaptive_drt.scene.description import (
    DiskLight,
    EllipseLight,
    Issue,
    Light,
    PointLight,
    QuadLight,
    SphereLight,
    SpotLight,
    SunLight,
    Vector,
    vector_of,
)
from ...adaptive_drt.scene.light_records import LARGEST_SQUEEZE
from ...adaptive_drt.scene.units import (
    area_radiance,
    light_power,
    point_intensity,
    sphere_radiance,
)
from .baked import folding
from .light_table import BY_TYPE, CYCLES_LIGHT
from .links import Input, Source, Value, number_of, surface_of, value_of
from .listing import left_out
from .nodes import called, node_called, uses_nodes
from .shader import EMITTERS, Shader
from .shutter import TURNED, Matrix, Track, path_of

SQUARE = 1e-5
"""Cosine between an area light's axes: less is float32's rounding."""

SHEARED = (
    "its parents shear it; it shines evenly with all of its power, while Cycles' picture of such "
    "lights depends on how they are sampled"
)

BEAM = math.radians(1.0)
"""Spread of an area light, in radians, that stands for all narrower ones. The edge of its beam is
as wide as a sixtieth of the way from the light."""

UNEVEN = 1e-5
"""Relative difference of the scales along a spot's axes: less is float32's rounding."""

ROUND = ("DISK", "ELLIPSE")
"""Shapes of area lights whose sizes are diameters."""

AREAS = {QuadLight: 4.0, EllipseLight: math.pi}
"""Areas in units of the product of their half edges or half axes."""

WHITE: Vector = (1.0, 1.0, 1.0)

INSTANCERS_COUNT = (4, 5, 0)
"""First Blender whose Cycles asks a light's instancer for Ray Visibility, too; 4.4 does not."""


def gives_light(thing: Any, instancer: Any | None) -> bool:
    """Whether a light object lights surfaces that scatter light evenly, by its Ray Visibility."""
    return _meets(thing, instancer, "visible_diffuse")


def is_seen(thing: Any, instancer: Any | None) -> bool:
    """Whether the camera may see a light object, by its Ray Visibility."""
    return _meets(thing, instancer, "visible_camera")


def _meets(thing: Any, instancer: Any | None, rays: str) -> bool:
    counts = instancer is not None and bpy.app.version >= INSTANCERS_COUNT
    return bool(getattr(thing, rays) and (not counts or getattr(instancer, rays)))


@dataclass(frozen=True)
class Lamp:
    """What a light's datablock says, however many objects show it.

    Attributes
    ----------
    power : radiant power (RGB).
    missing : why none of the objects gives light, though it would in Blender.
    is_dark : whether they give none in Blender either.
    """

    power: Vector = (0.0, 0.0, 0.0)
    missing: tuple[str, ...] = ()
    is_dark: bool = False


def lamp_of(light: Any, issues: list[Issue]) -> Lamp:
    """Return what an evaluated light datablock says, and append what of it is simplified."""
    if light.type not in BY_TYPE:  # of a Blender to come
        return Lamp(missing=(f"lights of type {light.type.title()} are left out",))
    # a change of an add-on's settings does not reach the evaluated copy
    cycles = getattr(light.original, "cycles", None)
    found = [
        *left_out(BY_TYPE[light.type], light),
        *left_out(CYCLES_LIGHT, cycles),
    ]
    missing = tuple(reason for reason, is_missing in found if is_missing)
    if missing:
        return Lamp(missing=missing)
    if light.type == "AREA" and getattr(cycles, "is_portal", False):
        return Lamp(is_dark=True)
    reasons = [reason for reason, _ in found]
    power = _power(light, reasons)
    said = called("Light", light.name)
    issues.extend(Issue(said, r, kind="LIGHT", target=light.name) for r in reasons)
    return Lamp(power)


def light_of(thing: Any, lamp: Lamp, track: Track, name: str, issues: list[Issue]) -> Light | None:
    """Return the light of an evaluated light object, or None if it gives no light here.

    Parameters
    ----------
    lamp : what its datablock says.
    """
    light, tell = thing.data, _Teller(name, thing.original.name, issues)
    if not np.isfinite(track.middle).all():
        tell("its matrix is not finite: check its location and scale", missing=True)
        return None
    for reason in lamp.missing:
        tell(reason, missing=True)
    if lamp.missing or lamp.is_dark:
        return None
    if light.type == "POINT":
        return _point(light, lamp.power, track, tell)
    if light.type == "SUN":
        return _sun(light, lamp.power, track, tell)
    if light.type == "SPOT":
        return _spot(light, lamp.power, track, tell)
    return _area(light, lamp.power, track, tell)


@dataclass(frozen=True)
class _Teller:
    """Appends issues of one light object, which is shown as `name`."""

    name: str
    target: str
    issues: list[Issue]

    def __call__(self, reason: str | None, missing: bool = False) -> None:
        if reason:
            self.issues.append(Issue(self.name, reason, missing, "OBJECT", self.target))


def _power(light: Any, reasons: list[str]) -> Vector:
    warm = getattr(light, "use_temperature", False)
    r, g, b = light_power(
        light.energy,
        vector_of(light.color),
        getattr(light, "exposure", 0.0),
        vector_of(light.temperature_color) if warm else WHITE,
    )
    u, v, w = emission_of(light, reasons)
    return (r * u, g * v, b * w)


def emission_of(light: Any, reasons: list[str]) -> Vector:
    """Return the factor (RGB) that a light's own nodes put on its power."""
    if not uses_nodes(light):
        return WHITE
    source = surface_of(light.node_tree)
    if source.node is None:  # nor does it shine in Cycles
        return (0.0, 0.0, 0.0)
    used, known = "its own power and colour shine", folding(_falloff)
    if source.node.bl_idname not in EMITTERS:
        value = known(source)
        if value is None:
            reasons.append(f"its {node_called(source.node)} is left out; {used}")
            return WHITE
        return vector_of(np.broadcast_to(value, 3))
    linked: list[str] = []
    factor = Shader(source, known).emission(linked)
    reasons.extend(f"{said}; {used}" for said in linked)
    return WHITE if linked else factor


def _falloff(source: Source) -> Value | None:
    """Return the output of a Light Falloff node that changes nothing of how light falls off."""
    node, socket = source.node, source.socket
    if node is None or node.bl_idname != "ShaderNodeLightFalloff" or socket is None:
        return None
    inputs = {s.identifier: Input(s, source.groups) for s in node.inputs}
    if socket.identifier != "Quadratic" or number_of(inputs["Smooth"], folding()) != 0.0:
        return None
    return value_of(inputs["Strength"], folding())


def _point(
    light: Any, power: Vector, track: Track, tell: _Teller
) -> PointLight | SphereLight | DiskLight:
    path = path_of(track)
    tell(path.reason)
    normalize, shadow = getattr(light, "normalize", True), bool(light.use_shadow)
    radius, name = float(light.shadow_soft_size), tell.name
    if radius == 0.0:
        intensity = point_intensity(power, normalize)
        return PointLight(path.position, intensity, path.motion, shadow, name)
    radiance = sphere_radiance(power, radius, normalize)
    # before 4.0 there was no soft falloff; 4.2 and later have the attribute
    kind = DiskLight if getattr(light, "use_soft_falloff", False) else SphereLight
    return kind(path.position, radius, radiance, path.motion, shadow, name)


def _spot(light: Any, power: Vector, track: Track, tell: _Teller) -> SpotLight | None:
    linear = track.middle[:3, :3]
    size = np.linalg.norm(linear, axis=0)
    if not size.all() or not abs(np.linalg.det(linear / size)) > 1.0 / LARGEST_SQUEEZE:
        tell("its scale is zero along an axis; such spot lights are left out", missing=True)
        return None
    frame = None
    if float(size.max() - size.min()) > UNEVEN * float(size.max()) or _sheared(linear):
        x, y, z = (vector_of(row) for row in np.linalg.inv(linear))
        frame = (x, y, z)
    path = path_of(track, shape=np.array([[0.0, 0.0, -1.0]]).T)
    tell(path.reason)
    normalize, radius = getattr(light, "normalize", True), float(light.shadow_soft_size)
    intensity = point_intensity(power, normalize)
    if radius:
        area = math.pi * radius * radius
        r, g, b = sphere_radiance(power, radius, normalize)
        intensity = (r * area, g * area, b * area)
    return SpotLight(
        path.position,
        vector_of(-linear[:, 2]),
        intensity,
        min(float(light.spot_size), math.pi),  # pi as a float32 is more
        float(light.spot_blend),
        radius,
        bool(getattr(light, "use_soft_falloff", False)),
        path.motion,
        bool(light.use_shadow),
        tell.name,
        frame=frame,
    )


def _area(
    light: Any, power: Vector, track: Track, tell: _Teller
) -> QuadLight | EllipseLight | None:
    size_x = float(light.size)
    size_y = size_x if light.shape in ("SQUARE", "DISK") else float(light.size_y)
    kind = EllipseLight if light.shape in ROUND else QuadLight
    # the light shines along its own -Z, and cross(X, -Y) = -Z
    half = np.array([[size_x, 0.0, 0.0], [0.0, -size_y, 0.0]]).T / 2.0
    half_u, half_v = (track.middle[:3, :3] @ half).T
    area = AREAS[kind] * float(np.linalg.norm(np.cross(half_u, half_v)))
    flat = not float(np.linalg.norm(track.middle[:3, 2]))
    if area == 0.0 or flat:  # measured: Cycles renders no light of either
        what = "scale along its Z axis" if flat else "size"
        tell(f"its {what} is zero, so it gives no light, nor does it in Cycles")
        return None
    if _is_sampled_unevenly(track.middle[:3, :3], kind, float(light.spread)):
        tell(SHEARED)
    forward = -track.middle[:3, 2]
    if float(np.cross(half_u, half_v) @ forward) < 0.0:  # a mirrored object
        half_u, half_v = half_v, half_u
    path = path_of(track, shape=half)
    tell(path.reason)
    radiance = area_radiance(power, area, getattr(light, "normalize", True))
    spread = min(float(light.spread), math.pi)  # pi as a float32 is more
    if spread < BEAM:
        degrees, least = math.degrees(spread), math.degrees(BEAM)
        tell(
            f"its spread is {degrees:.2g}°; it is rendered as one of {least:.2g}°, softer at edges"
        )
    return kind(
        path.position,
        vector_of(half_u),
        vector_of(half_v),
        radiance,
        path.motion,
        bool(light.use_shadow),
        tell.name,
        spread=max(spread, BEAM),
    )


def _sun(light: Any, power: Vector, track: Track, tell: _Teller) -> SunLight | None:
    way = _sun_direction(track.middle)
    if way is None:  # measured: Cycles renders no light of it
        tell("its scale along its Z axis is zero, so it gives no light, nor does it in Cycles")
        return None
    ends = [_sun_direction(end) for end in (track.opens, track.closes) if end is not None]
    if any(end is None or float(np.abs(end - way).max()) > TURNED for end in ends):
        tell("it turns during the shutter; it is rendered as at its middle")
    angle = min(float(light.angle), math.pi)  # pi as a float32 is more
    # the power is the irradiance at right angles; with `normalize` off it is the radiance, unless
    # the sun is a point
    bare = angle > 0.0 and not getattr(light, "normalize", True)
    factor = math.pi * math.sin(angle / 2.0) ** 2 if bare else 1.0
    r, g, b = power
    irradiance = (r * factor, g * factor, b * factor)
    return SunLight(vector_of(way), irradiance, angle, None, bool(light.use_shadow), tell.name)


def _sun_direction(matrix: Matrix) -> Matrix | None:
    """Return the unit vector along which a sun of a world matrix shines, its own -Z; or None."""
    way = -matrix[:3, 2]
    size = float(np.linalg.norm(way))
    direction: Matrix = way / size if size else way
    return direction if size else None


def _sheared(linear: Matrix) -> bool:
    return float(np.abs(_cosines(linear)).max()) > SQUARE


def _cosines(linear: Matrix) -> Matrix:
    """Cosines (3, 3) between the axes, and 0 between each and itself."""
    unit = linear / np.linalg.norm(linear, axis=0)
    cosines: Matrix = unit.T @ unit - np.eye(3)
    return cosines


def _is_sampled_unevenly(
    linear: Matrix, kind: type[QuadLight | EllipseLight], spread: float
) -> bool:
    """Whether Cycles samples a sheared area light unevenly.

    Measured: it takes the sides of rectangles for orthogonal, so that its picture was 20 % brighter
    than that of a parallelogram. Z is the normal of disks, and where the spread is limited.
    """
    cosines = np.abs(_cosines(linear))
    square, upright = float(cosines[0, 1]) <= SQUARE, float(cosines[2].max()) <= SQUARE
    if kind is QuadLight:
        return not square or (spread < math.pi and not upright)
    return not upright
