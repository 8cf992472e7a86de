# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene description: objects, lights and a camera, in metres, as frozen records.

Positions hold at the middle of the shutter. `Motion` adds linear motion: at shutter
time t, from -1/2 (opens) to +1/2 (closes), an item is at its position + t * displacement.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Camera",
    "DiskLight",
    "Issue",
    "Light",
    "Material",
    "Motion",
    "PointLight",
    "Quad",
    "QuadLight",
    "Quads",
    "Scene",
    "SceneError",
    "Shape",
    "ShapeRecord",
    "SkyLight",
    "Sphere",
    "SphereLight",
    "SunLight",
    "Vector",
    "checked_camera",
    "single_shapes",
    "validate",
    "vector_of",
]

Vector: TypeAlias = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)

LARGEST_COORDINATE = 1e30
"""Largest magnitude of a coordinate, in metres, and of a component of a colour. Beyond it the
fourth powers inside discriminants overflow float64."""
SMALLEST_SIZE = 1e-60
"""Smallest radius or edge length, in metres. Below it the fourth powers inside discriminants
underflow."""
MIN_EDGE_SINE = 2.0**-50
"""Smallest sine of the angle between two edges. Below it their cross product is mostly rounding
error."""
UNSUSPECTED_SIZE, UNSUSPECTED_SINE = 1e-30, 2.0**-40
"""Edge length in metres, and sine of the angle between edges, above which the area of one of many
parallelograms is not tested closely: they are far above `SMALLEST_SIZE` and `MIN_EDGE_SINE`."""
LARGEST_RATIO = 1e9
"""Largest ratio of sensor size to focal length and of a pixel's sides, the inverse ratios included,
and largest shift of the camera. Beyond it the directions of neighbouring pixels cannot be
distinguished in float64."""


def vector_of(values: Iterable[float]) -> Vector:
    """Return three numbers, such as an array (3,), as a tuple of floats."""
    x, y, z = values
    return (float(x), float(y), float(z))


class SceneError(ValueError):
    """The scene cannot be rendered at all; the message says what the user should do."""


@dataclass(frozen=True)
class Issue:
    """A part of the scene that the picture omits, or renders differently from its settings.

    Attributes
    ----------
    name : what is concerned, as the user knows it: an object's name, or 'Material "Red"'.
    reason : what is missing or different, and what to do.
    missing : True: the item is not in the picture, which counts as an error. False: the
        item is there, simplified, which counts as a note.
    kind : Blender's kind of datablock, such as 'OBJECT', 'MATERIAL', 'WORLD', 'SCENE'.
    target : name of that datablock; "" where `name` is it.
    """

    name: str
    reason: str
    missing: bool = False
    kind: str = "OBJECT"
    target: str = ""


@dataclass(frozen=True)
class Material:
    """Lambertian material: `color` is the diffuse albedo, scene-linear RGB."""

    color: Vector = (0.8, 0.8, 0.8)


@dataclass(frozen=True)
class Motion:
    """Linear motion: displacement in metres from shutter open to shutter close."""

    displacement: Vector


@dataclass(frozen=True)
class Sphere:
    """Sphere: centre and radius in metres. Shaded alike on both sides."""

    center: Vector
    radius: float
    material: Material = Material()
    motion: Motion | None = None
    name: str = "Sphere"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return (
            _vector_defect(self, "center")
            or _motion_defect(self.motion)
            or _color_defect(self.material)
            or _radius_defect(self.radius)
        )

    def numbers(self) -> NDArray[np.float64]:
        """Return numbers (4, 1) that tell its place and size."""
        return np.array([*self.center, self.radius])[:, None]


@dataclass(frozen=True)
class Quad:
    """Parallelogram: `corner` + u * `edge_u` + v * `edge_v`, u and v in 0..1. Two-sided."""

    corner: Vector
    edge_u: Vector
    edge_v: Vector
    material: Material = Material()
    motion: Motion | None = None
    name: str = "Quad"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return (
            _vector_defect(self, "corner", "edge_u", "edge_v")
            or _motion_defect(self.motion)
            or _color_defect(self.material)
            or _area_defect(self.edge_u, self.edge_v)
        )

    def numbers(self) -> NDArray[np.float64]:
        """Return numbers (9, 1) that tell its place and size."""
        return np.array([*self.corner, *self.edge_u, *self.edge_v])[:, None]


@dataclass(frozen=True, eq=False, repr=False)
class Quads:
    """n parallelograms of one object, as `Quad` describes one. The arrays must not be changed.

    Attributes
    ----------
    corner, edge_u, edge_v : (3, n) float64, metres.
    slot : (n,) int64, index of the material of each among `materials`.
    """

    corner: NDArray[np.float64]
    edge_u: NDArray[np.float64]
    edge_v: NDArray[np.float64]
    slot: NDArray[np.int64]
    materials: tuple[Material, ...]
    motion: Motion | None = None
    name: str = "Quads"

    def __eq__(self, other: object) -> bool:
        """Whether all parallelograms are the same, in the same order."""
        return isinstance(other, Quads) and repr(self) == repr(other)

    def __hash__(self) -> int:
        """Hash of all the content."""
        return hash(repr(self))

    def __repr__(self) -> str:
        """Text that stands for all the content: arrays are given by a digest."""
        digest = hashlib.blake2b(digest_size=16)
        for array in (self.corner, self.edge_u, self.edge_v, self.slot):
            digest.update(array.tobytes())
        rest = f"{self.materials!r}, {self.motion!r}, {self.name!r}"
        return f"Quads({self.count}, {digest.hexdigest()}, {rest})"

    @property
    def count(self) -> int:
        """Number of parallelograms."""
        return int(self.slot.size)

    def take(self, kept: NDArray[np.bool_] | NDArray[np.int64]) -> Quads:
        """Return the parallelograms selected by a mask or an index array."""
        corner, u, v = (each[:, kept] for each in (self.corner, self.edge_u, self.edge_v))
        return replace(self, corner=corner, edge_u=u, edge_v=v, slot=self.slot[kept])

    def records(self) -> Iterator[Quad]:
        """Yield each parallelogram as a record of its own."""
        for k, slot in enumerate(self.slot.tolist()):
            corner, u, v = (
                vector_of(each[:, k]) for each in (self.corner, self.edge_u, self.edge_v)
            )
            yield Quad(corner, u, v, self.materials[slot], self.motion, self.name)

    def numbers(self) -> NDArray[np.float64]:
        """Return numbers (9, n) that tell the place and size of each."""
        return np.concatenate([self.corner, self.edge_u, self.edge_v])

    def suspects(self) -> NDArray[np.int64]:
        """Indices, ascending, of all parallelograms that may have a defect."""
        if _motion_defect(self.motion) or any(map(_color_defect, self.materials)):
            return np.arange(self.count)
        vectors = self.numbers()
        u, v = self.edge_u, self.edge_v
        with np.errstate(all="ignore"):
            finite = (np.abs(vectors) <= LARGEST_COORDINATE).all(axis=0)
            size_u, size_v = np.sqrt((u * u).sum(axis=0)), np.sqrt((v * v).sum(axis=0))
            sine = np.linalg.norm(np.cross(u / size_u, v / size_v, axis=0), axis=0)
            fine = finite & (np.minimum(size_u, size_v) > UNSUSPECTED_SIZE)
            fine &= sine > UNSUSPECTED_SINE
        index: NDArray[np.int64] = (~fine).nonzero()[0]
        return index


@dataclass(frozen=True)
class QuadLight:
    """Parallelogram light: `center` + u * `half_u` + v * `half_v`, u and v in -1..1.

    It emits `radiance` (W / m^2 / sr, RGB) on the side of cross(half_u, half_v) only.
    """

    center: Vector
    half_u: Vector
    half_v: Vector
    radiance: Vector
    motion: Motion | None = None
    casts_shadow: bool = True
    name: str = "Area"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return (
            _vector_defect(self, "center", "half_u", "half_v", "radiance")
            or _motion_defect(self.motion)
            or _area_defect(self.half_u, self.half_v)
        )

    def brightened(self, factor: float) -> QuadLight:
        """Return the light so many times as bright."""
        return replace(self, radiance=_times(self.radiance, factor))


@dataclass(frozen=True)
class SphereLight:
    """Spherical light of uniform `radiance` (W / m^2 / sr, RGB). It blocks no light."""

    center: Vector
    radius: float
    radiance: Vector
    motion: Motion | None = None
    casts_shadow: bool = True
    name: str = "Point"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return (
            _vector_defect(self, "center", "radiance")
            or _motion_defect(self.motion)
            or _radius_defect(self.radius)
        )

    def brightened(self, factor: float) -> SphereLight:
        """Return the light so many times as bright."""
        return replace(self, radiance=_times(self.radiance, factor))


@dataclass(frozen=True)
class DiskLight:
    """Blender's soft point light: a disk of `radius` that always faces the shaded point."""

    center: Vector
    radius: float
    radiance: Vector
    motion: Motion | None = None
    casts_shadow: bool = True
    name: str = "Point"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return (
            _vector_defect(self, "center", "radiance")
            or _motion_defect(self.motion)
            or _radius_defect(self.radius)
        )

    def brightened(self, factor: float) -> DiskLight:
        """Return the light so many times as bright."""
        return replace(self, radiance=_times(self.radiance, factor))


@dataclass(frozen=True)
class PointLight:
    """Point light of radiant `intensity` (W / sr, RGB)."""

    center: Vector
    intensity: Vector
    motion: Motion | None = None
    casts_shadow: bool = True
    name: str = "Point"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return _vector_defect(self, "center", "intensity") or _motion_defect(self.motion)

    def brightened(self, factor: float) -> PointLight:
        """Return the light so many times as bright."""
        return replace(self, intensity=_times(self.intensity, factor))


@dataclass(frozen=True)
class SunLight:
    """A disk of uniform radiance at infinity, which shines along `direction`, of any length.

    It is seen in a cone of `angle` radians from side to side, 0 for a light without penumbrae, and
    gives surfaces that face it the `irradiance` (W / m^2, RGB). It does not move.
    """

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
        if _finite(self.direction) and math.hypot(*self.direction) < SMALLEST_SIZE:
            return "its direction has no length"
        return _vector_defect(self, "direction", "irradiance")

    def brightened(self, factor: float) -> SunLight:
        """Return the light so many times as bright."""
        return replace(self, irradiance=_times(self.irradiance, factor))


@dataclass(frozen=True)
class SkyLight:
    """A light of uniform `radiance` (W / m^2 / sr, RGB) from all directions, beyond all shapes.

    It lights what is open to it, and is not seen: `Scene.background` is. It does not move.
    """

    radiance: Vector
    motion: None = None
    casts_shadow: bool = True
    name: str = "World"

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return _vector_defect(self, "radiance")

    def brightened(self, factor: float) -> SkyLight:
        """Return the light so many times as bright."""
        return replace(self, radiance=_times(self.radiance, factor))


Shape: TypeAlias = Sphere | Quad
ShapeRecord: TypeAlias = Shape | Quads
"""Record of one shape, or of several."""
"""A record of a shape."""


class Light(Protocol):
    """A record of a light, of a kind that `lights.registry` knows.

    Attributes
    ----------
    name : the light's name.  motion : its linear motion, or None.
    casts_shadow : whether objects hide it.
    """

    @property
    def name(self) -> str: ...
    @property
    def motion(self) -> Motion | None: ...
    @property
    def casts_shadow(self) -> bool: ...

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""

    def brightened(self, factor: float) -> Light:
        """Return the light so many times as bright."""


@dataclass(frozen=True)
class Camera:
    """Perspective camera with Blender's parameters.

    Attributes
    ----------
    matrix : camera-to-world transform, four rows of four; the camera looks along its -Z, +Y is up.
        Its scale is ignored, as Blender does.
    focal_length, sensor_width, sensor_height : millimetres.
    sensor_fit : 'AUTO', 'HORIZONTAL' or 'VERTICAL'.
    shift_x, shift_y : in units of the fitted sensor side.
    pixel_aspect : width and height of a pixel, in any unit.
    resolution : pixels (width, height) of the whole picture.
    border : pixels (left, bottom, right, top) to render, right and top exclusive; None = all.
    motion : the camera's own linear motion.
    """

    matrix: tuple[tuple[float, float, float, float], ...] = (
        (1.0, 0.0, 0.0, 0.0),
        (0.0, 1.0, 0.0, 0.0),
        (0.0, 0.0, 1.0, 0.0),
        (0.0, 0.0, 0.0, 1.0),
    )
    focal_length: float = 50.0
    sensor_width: float = 36.0
    sensor_height: float = 24.0
    sensor_fit: str = "AUTO"
    shift_x: float = 0.0
    shift_y: float = 0.0
    pixel_aspect: tuple[float, float] = (1.0, 1.0)
    resolution: tuple[int, int] = (300, 300)
    border: tuple[int, int, int, int] | None = None
    motion: Motion | None = None

    @property
    def region(self) -> tuple[int, int, int, int]:
        """Pixels (left, bottom, right, top) that are rendered."""
        return self.border or (0, 0, *self.resolution)


@dataclass(frozen=True)
class Scene:
    """The input of a render. `background` is the radiance (RGB) of rays that hit nothing."""

    camera: Camera | None = None
    shapes: tuple[ShapeRecord, ...] = ()
    lights: tuple[Light, ...] = ()
    background: Vector = ZERO
    transparent: bool = False
    issues: tuple[Issue, ...] = field(default=())


def validate(scene: Scene) -> Scene:
    """Return the scene without the items that cannot be rendered, each reported as an `Issue`.

    Raises
    ------
    SceneError
        There is no camera, or the camera cannot form a picture.
    """
    checked_camera(scene)
    issues = list(scene.issues)
    shapes = tuple(_renderable_shapes(scene.shapes, issues))
    lights = tuple(_renderable_items(scene.lights, issues))
    background = scene.background
    if not _finite(background):
        issues.append(
            Issue(
                "World",
                "its background colour is not a finite number; black is used",
                kind="WORLD",
            )
        )
        background = ZERO
    return replace(scene, shapes=shapes, lights=lights, background=background, issues=tuple(issues))


def checked_camera(scene: Scene) -> Camera:
    """Return the scene's camera if it is valid; raises as `validate`."""
    if scene.camera is None:
        raise SceneError("The scene has no camera: add one, or make one active")
    _check_camera(scene.camera)
    return scene.camera


def single_shapes(shapes: Iterable[ShapeRecord]) -> tuple[Shape, ...]:
    """Return shapes with each of `Quads` as a record of its own."""
    singles: list[Shape] = []
    for shape in shapes:
        singles.extend(shape.records() if isinstance(shape, Quads) else [shape])
    return tuple(singles)


def _renderable_shapes(shapes: Iterable[ShapeRecord], issues: list[Issue]) -> list[ShapeRecord]:
    """Return the shapes that can be rendered, and append an issue for each other one."""
    kept: list[ShapeRecord] = []
    for shape in shapes:
        if not isinstance(shape, Quads):
            kept += _renderable_items([shape], issues)
        elif (whole := _renderable_quads(shape, issues)).count:
            kept.append(whole)
    return kept


Item = TypeVar("Item", Shape, Light)


def _renderable_items(things: Iterable[Item], issues: list[Issue]) -> list[Item]:
    """Return the items that can be rendered, and append an issue for each other one."""
    kept: list[Item] = []
    for thing in things:
        reason = thing.defect()
        if reason:
            issues.append(Issue(thing.name, reason, missing=True))
        else:
            kept.append(thing)
    return kept


def _renderable_quads(quads: Quads, issues: list[Issue]) -> Quads:
    """Return those of many parallelograms that can be rendered, and append issues."""
    suspects = quads.suspects()
    kept = np.ones(quads.count, dtype=np.bool_)
    for index, quad in zip(suspects.tolist(), quads.take(suspects).records(), strict=True):
        reason = quad.defect()
        if reason:
            issues.append(Issue(quad.name, reason, missing=True))
            kept[index] = False
    return quads if kept.all() else quads.take(kept)


def _vector_defect(record: object, *names: str) -> str | None:
    """Return what is wrong with the vectors of these names, or None."""
    for name in names:
        if not _finite(getattr(record, name)):
            return f"its {name} is not finite (or beyond {LARGEST_COORDINATE:g} m)"
    return None


def _motion_defect(motion: Motion | None) -> str | None:
    """Return what is wrong with a motion, or None."""
    if motion is not None and not _finite(motion.displacement):
        return f"its motion is not finite (or beyond {LARGEST_COORDINATE:g} m)"
    return None


def _color_defect(material: Material) -> str | None:
    """Return what is wrong with a material, or None."""
    return None if _finite(material.color) else "its colour is not finite"


def _radius_defect(radius: float) -> str | None:
    """Return what is wrong with a radius, or None."""
    if not math.isfinite(radius) or not 0.0 < radius < LARGEST_COORDINATE:
        return f"its radius is {radius:g}; it must be a positive number"
    if radius < SMALLEST_SIZE:
        return f"its radius is {radius:g} m, less than {SMALLEST_SIZE:g} m"
    return None


def _area_defect(u: Vector, v: Vector) -> str | None:
    """Return what is wrong with the edges of a parallelogram, or None."""
    return None if _has_area(u, v) else "it has no area"


def _times(color: Vector, factor: float) -> Vector:
    """Return a colour times a factor."""
    return (color[0] * factor, color[1] * factor, color[2] * factor)


def _finite(vector: Vector) -> bool:
    """Whether a vector has three components of magnitude up to `LARGEST_COORDINATE`."""
    return len(vector) == 3 and all(abs(x) <= LARGEST_COORDINATE for x in vector)


def _has_area(u: Vector, v: Vector) -> bool:
    """Whether two edges span a parallelogram large enough and wide enough to have a normal."""
    size = math.hypot(*u), math.hypot(*v)
    if min(size) < SMALLEST_SIZE:
        return False
    u, v = _divided(u, size[0]), _divided(v, size[1])
    sine = math.hypot(
        u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    )
    # the normal's length is squared once more
    return sine > MIN_EDGE_SINE and sine * size[0] * size[1] > SMALLEST_SIZE * SMALLEST_SIZE


def _divided(vector: Vector, length: float) -> Vector:
    """Return a vector divided by a length."""
    return vector[0] / length, vector[1] / length, vector[2] / length


def _check_camera(camera: Camera) -> None:
    """Raise `SceneError` if the camera cannot form a picture."""
    rows = camera.matrix
    if len(rows) not in (3, 4) or any(len(row) != 4 for row in rows):
        raise SceneError("The camera's matrix must have 3 or 4 rows of 4 numbers")
    if not all(abs(x) <= LARGEST_COORDINATE for row in rows for x in row):
        raise SceneError(
            "The camera's matrix is not finite: check its location, rotation and scale"
        )
    axes = [(rows[0][k], rows[1][k], rows[2][k]) for k in range(3)]
    sizes = [math.hypot(*axis) for axis in axes]
    if not all(sizes):
        raise SceneError("The camera is scaled to zero: set its scale to 1")
    x, y, z = (_divided(axis, size) for axis, size in zip(axes, sizes, strict=True))
    turn = (y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0])
    if not abs(x[0] * turn[0] + x[1] * turn[1] + x[2] * turn[2]) > 1.0 / LARGEST_RATIO:
        raise SceneError("The camera is squashed flat: check the scale and shear of its parents")
    if camera.motion is not None and not _finite(camera.motion.displacement):
        raise SceneError("The camera's motion is not finite: check its keyframes")
    if min(camera.resolution) < 1:
        raise SceneError("The picture has no pixels: raise the resolution or its percentage")
    left, bottom, right, top = camera.region
    width, height = camera.resolution
    if not (0 <= left < right <= width and 0 <= bottom < top <= height):
        raise SceneError("The render border holds no pixel: draw it again")
    lens = (camera.focal_length, camera.sensor_width, camera.sensor_height, *camera.pixel_aspect)
    if not all(math.isfinite(x) and x > 0.0 for x in lens):
        raise SceneError("The camera's focal length, sensor and pixel aspect must be above zero")
    if not all(abs(shift) <= LARGEST_RATIO for shift in (camera.shift_x, camera.shift_y)):
        raise SceneError(f"The camera's shift is not finite (or beyond {LARGEST_RATIO:g})")
    _check_ratio("sensor and focal length", camera.sensor_width, camera.focal_length)
    _check_ratio("sensor and focal length", camera.sensor_height, camera.focal_length)
    _check_ratio("pixel aspect", *camera.pixel_aspect)
    if camera.sensor_fit not in ("AUTO", "HORIZONTAL", "VERTICAL"):
        raise SceneError(f"The camera's sensor fit is {camera.sensor_fit!r}, which is unknown")


def _check_ratio(what: str, a: float, b: float) -> None:
    """Raise `SceneError` if two positive lengths differ by more than `LARGEST_RATIO`."""
    if not a / LARGEST_RATIO <= b <= a * LARGEST_RATIO:
        raise SceneError(f"The camera's {what} are {a:g} and {b:g}: too far apart for a picture")
