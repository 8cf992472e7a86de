# SPDX-License-Identifier: GPL-3.0-or-later
"""Records of lights, in metres and in SI units of radiometry.

Positions hold at the middle of the shutter: see `description`.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from .values import (
    SMALLEST_SIZE,
    Motion,
    Vector,
    area_defect,
    convexity_defect,
    is_finite,
    motion_defect,
    radius_defect,
    scaled_color,
    vector_defect,
)

__all__ = [
    "LARGEST_SQUEEZE",
    "LEAST_SPREAD",
    "DiskLight",
    "EllipseLight",
    "EnvironmentLight",
    "Light",
    "PointLight",
    "PolygonLight",
    "QuadLight",
    "SkyLight",
    "SphereLight",
    "SpotLight",
    "SunLight",
]

IDENTITY: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Rows of the matrix that turns nothing."""
MAX_PIXEL = 1e30
"""Largest value of a pixel, beyond which squares of it come near the end of float64."""
ROTATION_TOLERANCE = 1e-6
"""Largest difference of the product of a rotation and its transpose from the identity: rotations
are stored in float32."""


LEAST_SPREAD = 0.01
"""Least spread of a flat light, in radians. Narrower ones are nearly parallel beams, at whose edges
pixels take a number of points that grows as the spread falls: 100 a pixel on average at 5 degrees,
480 at 2."""

LARGEST_SQUEEZE = 1e3
"""Largest ratio of the scales of a spot light along its axes."""


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
            return f"its spread is {self.spread:g} radians; it must be within {LEAST_SPREAD} to pi"
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
class PolygonLight(_ColoredLight):
    """A convex planar polygon of light.

    It emits `radiance` (W / m^2 / sr, RGB) on the side from which its `vertices`, metres, are seen
    anticlockwise.
    """

    vertices: tuple[Vector, ...]
    radiance: Vector
    motion: Motion | None = None
    casts_shadow: bool = True
    name: str = "Polygon"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        if len(self.vertices) < 3:
            return "it has fewer than three vertices"
        if not all(map(is_finite, self.vertices)):
            return "its vertices are not finite"
        return (
            vector_defect(self, "radiance")
            or motion_defect(self.motion)
            or convexity_defect(np.array(self.vertices))
        )


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
    frame : of a light that is scaled unevenly, rows of the matrix that maps directions, which are
        vectors of the scene, to its own frame, in which it shines along -Z. The cosine is then that
        of the mapped direction. None: the cone is circular.
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
    frame: tuple[Vector, Vector, Vector] | None = field(default=None, kw_only=True)

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        if not 0.0 < self.angle <= math.pi:
            return f"its angle is {self.angle:g} radians; it must be above 0, and pi at most"
        if not 0.0 <= self.blend <= 1.0:
            return f"its blend is {self.blend:g}; it must be within 0 to 1"
        if is_finite(self.direction) and math.hypot(*self.direction) < SMALLEST_SIZE:
            return "its direction has no length"
        if self.frame is not None and not _is_frame(np.array(self.frame)):
            return f"its scales are not finite, or their ratio is beyond {LARGEST_SQUEEZE:g}"
        return (
            vector_defect(self, "center", "direction", "intensity")
            or motion_defect(self.motion)
            or (radius_defect(self.radius) if self.radius else None)
        )


def _is_frame(rows: NDArray[np.float64]) -> bool:
    """Whether a matrix (3, 3) maps directions to a frame that is not squeezed too much."""
    if rows.shape != (3, 3) or not np.isfinite(rows).all():
        return False
    size = np.linalg.svd(rows, compute_uv=False)
    return bool(size[0] <= LARGEST_SQUEEZE * size[-1])


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


@dataclass(frozen=True, eq=False)
class EnvironmentLight(_ColoredLight):
    """A light whose radiance depends on the direction: an image of the whole sphere.

    In the image's own frame a direction has the longitude atan2(y, x), from pi at the left end of
    the image to -pi at its right end, and a latitude from 90 degrees at the top to -90 at the
    bottom. Radiance is interpolated linearly between the middles of the pixels, and the image
    repeats. It lights what is open to it, and is not seen: `Scene.backdrop` is. It does not move.

    pixels : (rows, columns, 3) from the top down, not below 0; they must not be changed.
    radiance : W / m^2 / sr (RGB) of a pixel of 1.
    rotation : rows of the rotation from the world's axes to those of the image.
    error : error of the irradiance by the image, in units of its pixels' radiance times sr.
    """

    pixels: NDArray[np.float32] | NDArray[np.float64]
    radiance: Vector = (1.0, 1.0, 1.0)
    rotation: tuple[Vector, Vector, Vector] = IDENTITY
    motion: None = None
    casts_shadow: bool = True
    name: str = "World"
    error: float = 0.0

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        shape = self.pixels.shape
        if len(shape) != 3 or shape[2] != 3 or not shape[0] or not shape[1]:
            return "its image has no pixels"
        if not np.isfinite(self.pixels).all() or float(np.abs(self.pixels).max()) > MAX_PIXEL:
            return "its image is not finite"
        turn = np.array(self.rotation)
        if not np.allclose(turn @ turn.T, np.eye(3), rtol=0.0, atol=ROTATION_TOLERANCE):
            return "its rotation is none"
        return vector_defect(self, "radiance")

    def __eq__(self, other: object) -> bool:
        """Whether both are alike to the last bit."""
        return isinstance(other, EnvironmentLight) and repr(self) == repr(other)

    def __hash__(self) -> int:
        """Hash of all the content."""
        return hash(repr(self))

    def __repr__(self) -> str:
        """Text that stands for all the content: the pixels are given by a digest."""
        pixels = np.ascontiguousarray(self.pixels)
        digest = hashlib.blake2b(pixels.tobytes(), digest_size=16).hexdigest()
        rest = f"{self.radiance}, {self.rotation}, {self.casts_shadow}, {self.name!r}"
        rest += f", {self.error}" if self.error else ""
        return f"EnvironmentLight({pixels.shape}, {pixels.dtype}, {digest}, {rest})"
