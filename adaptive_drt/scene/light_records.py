# SPDX-License-Identifier: GPL-3.0-or-later
"""Records of lights, in metres and in SI units of radiometry.

Positions hold at the middle of the shutter: see `description`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Protocol, Self

from .values import (
    SMALLEST_SIZE,
    Motion,
    Vector,
    area_defect,
    is_finite,
    motion_defect,
    radius_defect,
    scaled_color,
    vector_defect,
)

__all__ = [
    "LEAST_SPREAD",
    "DiskLight",
    "EllipseLight",
    "Light",
    "PointLight",
    "QuadLight",
    "SkyLight",
    "SphereLight",
    "SpotLight",
    "SunLight",
]


LEAST_SPREAD = 0.01
"""Least spread of a flat light, in radians. Narrower ones are nearly parallel beams."""


class Light(Protocol):
    """A record of a light, of a kind that `lights.registry` knows.

    Attributes
    ----------
    name : the light's name.  motion : its linear motion, or None.
    casts_shadow : whether objects hide it.
    seen, lights_surfaces : whether the camera sees it, and whether it lights anything.
    """

    @property
    def name(self) -> str: ...
    @property
    def motion(self) -> Motion | None: ...
    @property
    def casts_shadow(self) -> bool: ...
    @property
    def seen(self) -> bool: ...
    @property
    def lights_surfaces(self) -> bool: ...

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""

    def brightened(self, factor: float) -> Light:
        """Return the light so many times as bright."""

    def met(self, seen: bool, lights_surfaces: bool) -> Light:
        """Return the light as the camera sees it, or not, and as it lights surfaces, or not."""


@dataclass(frozen=True)
class _ColoredLight:
    """A record whose light is proportional to one of its colours.

    seen : whether the camera sees it, as light that is added to what is behind. Points, whose
        radius is 0, and skies are not seen.
    lights_surfaces : whether it lights anything.
    """

    COLOR_FIELD: ClassVar[str] = "radiance"
    """Name of that field."""

    seen: bool = field(default=False, kw_only=True)
    lights_surfaces: bool = field(default=True, kw_only=True)

    def brightened(self, factor: float) -> Self:
        """Return the light so many times as bright."""
        changed: dict[str, Any] = {
            self.COLOR_FIELD: scaled_color(getattr(self, self.COLOR_FIELD), factor)
        }
        return replace(self, **changed)

    def met(self, seen: bool, lights_surfaces: bool) -> Self:
        """Return the light as the camera sees it, or not, and as it lights surfaces, or not."""
        return replace(self, seen=seen, lights_surfaces=lights_surfaces)


@dataclass(frozen=True)
class _AreaLight(_ColoredLight):
    """A flat light of a fixed place, spanned by two half axes around its centre.

    spread : radians. Below pi the light shines within half of it around its normal only: at an
        angle t by 1 - tan t / tan(spread / 2), and brighter, so that its power is the same.
    """

    center: Vector
    half_u: Vector
    half_v: Vector
    radiance: Vector
    motion: Motion | None = None
    casts_shadow: bool = True
    name: str = "Area"
    spread: float = field(default=math.pi, kw_only=True)

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        if not LEAST_SPREAD <= self.spread <= math.pi:
            return f"its spread is {self.spread:g} radians; it must be within 0.01 to pi"
        return (
            vector_defect(self, "center", "half_u", "half_v", "radiance")
            or motion_defect(self.motion)
            or area_defect(self.half_u, self.half_v)
        )


@dataclass(frozen=True)
class _RoundLight(_ColoredLight):
    """A light that looks like a disk from everywhere outside it."""

    center: Vector
    radius: float
    radiance: Vector
    motion: Motion | None = None
    casts_shadow: bool = True
    name: str = "Point"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return (
            vector_defect(self, "center", "radiance")
            or motion_defect(self.motion)
            or radius_defect(self.radius)
        )


@dataclass(frozen=True)
class QuadLight(_AreaLight):
    """Parallelogram light: `center` + u * `half_u` + v * `half_v`, u and v in -1..1.

    It emits `radiance` (W / m^2 / sr, RGB) on the side of cross(half_u, half_v) only.
    """


@dataclass(frozen=True)
class EllipseLight(_AreaLight):
    """Elliptic light: `center` + u * `half_u` + v * `half_v`, u^2 + v^2 up to 1.

    It emits `radiance` (W / m^2 / sr, RGB) on the side of cross(half_u, half_v) only.
    """


@dataclass(frozen=True)
class SphereLight(_RoundLight):
    """Spherical light of uniform `radiance` (W / m^2 / sr, RGB). It blocks no light."""


@dataclass(frozen=True)
class DiskLight(_RoundLight):
    """Blender's soft point light: a disk of `radius` that always faces the shaded point."""


@dataclass(frozen=True)
class PointLight(_ColoredLight):
    """Point light of radiant `intensity` (W / sr, RGB)."""

    COLOR_FIELD: ClassVar[str] = "intensity"

    center: Vector
    intensity: Vector
    motion: Motion | None = None
    casts_shadow: bool = True
    name: str = "Point"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return vector_defect(self, "center", "intensity") or motion_defect(self.motion)


@dataclass(frozen=True)
class SpotLight(_ColoredLight):
    """A point, ball or facing disk that shines along `direction`, of any length, in a cone.

    A ball or disk of `radius` metres has the radiance intensity / (pi radius^2) in the middle of
    the cone; `faces` tells whether it is a disk that always faces the shaded point, as Blender's
    soft spots are. Directions count by their cosine c with the axis: by smoothstep, from 0 at
    cos(angle / 2) to 1 at a `blend` of the way to 1. Light that reaches points within the ball is
    not attenuated.

    intensity : W / sr, RGB.  angle : radians, of the whole cone.  blend : 0 to 1.
    """

    COLOR_FIELD: ClassVar[str] = "intensity"

    center: Vector
    direction: Vector
    intensity: Vector
    angle: float
    blend: float
    radius: float = 0.0
    faces: bool = True
    motion: Motion | None = None
    casts_shadow: bool = True
    name: str = "Spot"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        if not 0.0 < self.angle <= math.pi:
            return f"its angle is {self.angle:g} radians; it must be above 0, and pi at most"
        if not 0.0 <= self.blend <= 1.0:
            return f"its blend is {self.blend:g}; it must be within 0 to 1"
        if is_finite(self.direction) and math.hypot(*self.direction) < SMALLEST_SIZE:
            return "its direction has no length"
        return (
            vector_defect(self, "center", "direction", "intensity")
            or motion_defect(self.motion)
            or (radius_defect(self.radius) if self.radius else None)
        )


@dataclass(frozen=True)
class SunLight(_ColoredLight):
    """A disk of uniform radiance at infinity, which shines along `direction`, of any length.

    It is seen in a cone of `angle` radians from side to side, 0 for a light without penumbrae, and
    gives surfaces that face it the `irradiance` (W / m^2, RGB). It does not move.
    """

    COLOR_FIELD: ClassVar[str] = "irradiance"

    direction: Vector
    irradiance: Vector
    angle: float = 0.00918
    motion: None = None
    casts_shadow: bool = True
    name: str = "Sun"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        if not 0.0 <= self.angle <= math.pi:
            return f"its angle is {self.angle:g} radians; it must be within 0 to pi"
        if is_finite(self.direction) and math.hypot(*self.direction) < SMALLEST_SIZE:
            return "its direction has no length"
        return vector_defect(self, "direction", "irradiance")


@dataclass(frozen=True)
class SkyLight(_ColoredLight):
    """A light of uniform `radiance` (W / m^2 / sr, RGB) from all directions, beyond all shapes.

    It lights what is open to it, and is not seen: `Scene.background` is. It does not move.
    """

    radiance: Vector
    motion: None = None
    casts_shadow: bool = True
    name: str = "World"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return vector_defect(self, "radiance")
