# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene description: objects, lights and a camera, in metres, as frozen records.

Positions hold at the middle of the shutter. `Motion` adds linear motion: at shutter
time t, from -1/2 (opens) to +1/2 (closes), an item is at its position + t * displacement.
"""

from __future__ import annotations

import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import ClassVar, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from .light_records import (
    DiskLight,
    EllipseLight,
    EnvironmentLight,
    Light,
    PointLight,
    PolygonLight,
    QuadLight,
    SkyLight,
    SphereLight,
    SpotLight,
    SunLight,
)
from .values import (
    LARGEST_COORDINATE,
    ZERO,
    Motion,
    Vector,
    area_defect,
    is_finite,
    length_defect,
    motion_defect,
    radius_defect,
    vector_defect,
    vector_of,
    volume_defect,
)

__all__ = [
    "EVERYWHERE",
    "Camera",
    "Cylinder",
    "DiskLight",
    "Ellipse",
    "EllipseLight",
    "Ellipsoid",
    "EnvironmentLight",
    "Issue",
    "Light",
    "Material",
    "Motion",
    "PointLight",
    "PolygonLight",
    "Quad",
    "QuadLight",
    "Quads",
    "Scene",
    "SceneError",
    "Shape",
    "ShapeBatch",
    "ShapeRecord",
    "SkyLight",
    "Sphere",
    "SphereLight",
    "SpotLight",
    "SunLight",
    "Triangle",
    "Triangles",
    "Vector",
    "Visibility",
    "checked_camera",
    "single_shapes",
    "validate",
    "vector_of",
]

UNSUSPECTED_SIZE, UNSUSPECTED_SINE = 1e-30, 2.0**-40
"""Edge length in metres, and sine of the angle between edges, above which the area of one of many
shapes is not tested closely: they are far above `SMALLEST_SIZE` and `MIN_EDGE_SINE`."""
LARGEST_RATIO = 1e9
"""Largest ratio of sensor size to focal length and of a pixel's sides, the inverse ratios included,
and largest shift of the camera. Beyond it the directions of neighbouring pixels cannot be
distinguished in float64."""


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
    """Lambertian material that may shine.

    Attributes
    ----------
    color : the diffuse albedo, scene-linear RGB.
    emission : radiance (W / m^2 / sr, RGB) that the camera sees on both sides. It lights nothing by
        itself: what it lights is told by lights of their own.
    """

    color: Vector = (0.8, 0.8, 0.8)
    emission: Vector = ZERO


@dataclass(frozen=True)
class Visibility:
    """By which rays a shape is met.

    Attributes
    ----------
    camera : whether the camera sees it.
    shadow : whether it hides lights from other shapes.
    unlit_by : names of the lights that do not light it.
    passed_by : names of the lights that it does not hide.
    holdout : whether it is a hole in the picture, black and of no coverage, that hides what is
        behind it.
    """

    camera: bool = True
    shadow: bool = True
    unlit_by: frozenset[str] = frozenset()
    passed_by: frozenset[str] = frozenset()
    holdout: bool = False


EVERYWHERE = Visibility()
"""Visibility of ordinary shapes: all rays meet them."""


@dataclass(frozen=True)
class Sphere:
    """Sphere: centre and radius in metres. Shaded alike on both sides."""

    center: Vector
    radius: float
    material: Material = Material()
    motion: Motion | None = None
    name: str = "Sphere"
    visibility: Visibility = EVERYWHERE

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return (
            vector_defect(self, "center")
            or motion_defect(self.motion)
            or _color_defect(self.material)
            or radius_defect(self.radius)
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
    visibility: Visibility = EVERYWHERE

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return (
            vector_defect(self, "corner", "edge_u", "edge_v")
            or motion_defect(self.motion)
            or _color_defect(self.material)
            or area_defect(self.edge_u, self.edge_v)
        )

    def numbers(self) -> NDArray[np.float64]:
        """Return numbers (9, 1) that tell its place and size."""
        return np.array([*self.corner, *self.edge_u, *self.edge_v])[:, None]


@dataclass(frozen=True)
class Triangle:
    """Triangle between three `vertices`, metres. Two-sided."""

    vertices: tuple[Vector, Vector, Vector]
    material: Material = Material()
    motion: Motion | None = None
    name: str = "Triangle"
    visibility: Visibility = EVERYWHERE

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        if not all(map(is_finite, self.vertices)):
            return f"its vertices are not finite (or beyond {LARGEST_COORDINATE:g} m)"
        a, b, c = self.vertices
        edges = (vector_of(x - y for x, y in zip(end, a, strict=True)) for end in (b, c))
        return motion_defect(self.motion) or _color_defect(self.material) or area_defect(*edges)

    def numbers(self) -> NDArray[np.float64]:
        """Return numbers (9, 1) that tell its place and size."""
        return np.reshape(self.vertices, (9, 1))


@dataclass(frozen=True)
class Ellipse:
    """Flat ellipse: `center` + u * `half_u` + v * `half_v`, u^2 + v^2 up to 1. Two-sided.

    body : number of the closed solid that it is a face of; -1 for an ellipse by itself.
    """

    center: Vector
    half_u: Vector
    half_v: Vector
    material: Material = Material()
    motion: Motion | None = None
    name: str = "Ellipse"
    visibility: Visibility = EVERYWHERE
    body: int = -1

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return (
            vector_defect(self, "center", "half_u", "half_v")
            or motion_defect(self.motion)
            or _color_defect(self.material)
            or area_defect(self.half_u, self.half_v)
        )

    def numbers(self) -> NDArray[np.float64]:
        """Return numbers (9, 1) that tell its place and size."""
        return np.array([*self.center, *self.half_u, *self.half_v])[:, None]


@dataclass(frozen=True)
class Ellipsoid:
    """Ellipsoid: `center` + u * `half_u` + v * `half_v` + w * `half_w`, u^2 + v^2 + w^2 up to 1.

    The half axes are any three that span space, metres: images of perpendicular radii of a ball.
    Shaded alike on both sides.
    """

    center: Vector
    half_u: Vector
    half_v: Vector
    half_w: Vector
    material: Material = Material()
    motion: Motion | None = None
    name: str = "Ellipsoid"
    visibility: Visibility = EVERYWHERE

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return (
            vector_defect(self, "center", "half_u", "half_v", "half_w")
            or motion_defect(self.motion)
            or _color_defect(self.material)
            or volume_defect(self.half_u, self.half_v, self.half_w)
        )

    def numbers(self) -> NDArray[np.float64]:
        """Return numbers (12, 1) that tell its place and size."""
        return np.array([*self.center, *self.half_u, *self.half_v, *self.half_w])[:, None]


@dataclass(frozen=True)
class Cylinder:
    """Solid right circular cylinder, truncated cone or cone with flat ends, metres.

    Attributes
    ----------
    start, end : the centres of the ends; where an end has no radius, the apex.
    radius : that at the start.
    end_radius : that at the end, 0 for a cone; None: the same.
    """

    start: Vector
    end: Vector
    radius: float
    material: Material = Material()
    motion: Motion | None = None
    name: str = "Cylinder"
    visibility: Visibility = EVERYWHERE
    end_radius: float | None = None

    @property
    def radii(self) -> tuple[float, float]:
        """The radii at the start and at the end, metres."""
        return self.radius, self.radius if self.end_radius is None else self.end_radius

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        return (
            vector_defect(self, "start", "end")
            or motion_defect(self.motion)
            or _color_defect(self.material)
            or radius_defect(self.radius)
            or (radius_defect(self.end_radius) if self.end_radius else None)
            or length_defect(self.start, self.end)
        )

    def numbers(self) -> NDArray[np.float64]:
        """Return numbers (8, 1) that tell its place and size."""
        return np.array([*self.start, *self.end, *self.radii])[:, None]


class ShapeBatch(ABC):
    """n shapes of one kind and one object, as arrays, which must not be changed.

    Attributes
    ----------
    single : the record of one such shape.
    arrays : names of the arrays (..., n) float64, metres, that tell the place and size of each.
    optional : names of further arrays (..., n) float64, each of which may be None.
    slot : (n,) int64, index of the material of each among `materials`.
    """

    single: ClassVar[type]
    arrays: ClassVar[tuple[str, ...]]
    optional: ClassVar[tuple[str, ...]] = ()
    slot: NDArray[np.int64]
    materials: tuple[Material, ...]
    motion: Motion | None
    name: str
    visibility: Visibility

    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return two edges (3, n) of each shape that span its area, metres; only of flat shapes."""
        raise NotImplementedError(f"{type(self).__name__} are not flat")

    @abstractmethod
    def record(self, index: int) -> Shape:
        """Return one of the shapes as a record of its own."""

    def __eq__(self, other: object) -> bool:
        """Whether all shapes are the same, in the same order."""
        return isinstance(other, ShapeBatch) and repr(self) == repr(other)

    def __hash__(self) -> int:
        """Hash of all the content."""
        return hash(repr(self))

    def __repr__(self) -> str:
        """Text that stands for all the content: arrays are given by a digest."""
        content = b"".join(getattr(self, name).tobytes() for name in (*self.arrays, "slot"))
        digest = hashlib.blake2b(content, digest_size=16)
        for name in self._given():
            digest.update(name.encode() + getattr(self, name).tobytes())
        rest = f"{self.materials!r}, {self.motion!r}, {self.name!r}, {self.visibility!r}"
        return f"{type(self).__name__}({self.count}, {digest.hexdigest()}, {rest})"

    @property
    def count(self) -> int:
        """Number of shapes."""
        return int(self.slot.size)

    def take(self: Batch, kept: NDArray[np.bool_] | NDArray[np.int64]) -> Batch:
        """Return the shapes selected by a mask or an index array."""
        names = (*self.arrays, *self._given(), "slot")
        some = {name: getattr(self, name)[..., kept] for name in names}
        return replace(self, **some)  # type: ignore[type-var]  # each subclass is a dataclass

    def records(self) -> Iterator[Shape]:
        """Yield each shape as a record of its own."""
        yield from map(self.record, range(self.count))

    def numbers(self) -> NDArray[np.float64]:
        """Return numbers (k, n) that tell the place and size of each, as those of `single` do."""
        parts = (getattr(self, name) for name in self.arrays)
        return np.vstack([np.reshape(part, (-1, self.count)) for part in parts])

    def colors(self) -> NDArray[np.float64]:
        """Return the diffuse albedo (3, n) of each shape."""
        colors = np.array([each.color for each in self.materials], dtype=np.float64)
        chosen: NDArray[np.float64] = colors.reshape(-1, 3).T[:, self.slot]
        return chosen

    def displacements(self) -> NDArray[np.float64] | None:
        """Return the displacement (3, n) of each shape, metres; None: `motion` is that of all."""
        return None

    def has_common_defect(self) -> bool:
        """Whether something is wrong with the motion or a material that shapes share."""
        return bool(motion_defect(self.motion)) or any(map(_color_defect, self.materials))

    def _given(self) -> list[str]:
        """Return the names of the optional arrays that there are."""
        return [name for name in self.optional if getattr(self, name) is not None]

    def suspects(self) -> NDArray[np.int64]:
        """Indices, ascending, of all shapes that may have a defect."""
        if self.has_common_defect():
            return np.arange(self.count)
        with np.errstate(all="ignore"):
            fine, (u, v) = (abs(self.numbers()) <= LARGEST_COORDINATE).all(axis=0), self.edges()
            size_u, size_v = np.sqrt((u * u).sum(axis=0)), np.sqrt((v * v).sum(axis=0))
            sine = np.linalg.norm(np.cross(u / size_u, v / size_v, axis=0), axis=0)
            fine &= (np.minimum(size_u, size_v) > UNSUSPECTED_SIZE) & (sine > UNSUSPECTED_SINE)
        return np.flatnonzero(~fine)


Batch = TypeVar("Batch", bound=ShapeBatch)


@dataclass(frozen=True, eq=False, repr=False)
class Quads(ShapeBatch):
    """n parallelograms of one object, as `Quad` describes one: see `ShapeBatch`.

    Attributes
    ----------
    corner, edge_u, edge_v : (3, n) float64, metres.
    """

    corner: NDArray[np.float64]
    edge_u: NDArray[np.float64]
    edge_v: NDArray[np.float64]
    slot: NDArray[np.int64]
    materials: tuple[Material, ...]
    motion: Motion | None = None
    name: str = "Quads"
    visibility: Visibility = EVERYWHERE
    single: ClassVar[type] = Quad
    arrays: ClassVar[tuple[str, ...]] = ("corner", "edge_u", "edge_v")

    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the edges (3, n) that leave the corners, metres."""
        return self.edge_u, self.edge_v

    def record(self, index: int) -> Quad:
        """Return one of the parallelograms as a record of its own."""
        corner, u, v = (vector_of(getattr(self, name)[:, index]) for name in self.arrays)
        return Quad(
            corner, u, v, self.materials[self.slot[index]], self.motion, self.name, self.visibility
        )


@dataclass(frozen=True, eq=False, repr=False)
class Triangles(ShapeBatch):
    """n triangles of one object, as `Triangle` describes one: see `ShapeBatch`.

    Attributes
    ----------
    vertices : (3, 3, n) float64, metres: the number of the vertex, then its components.
    """

    vertices: NDArray[np.float64]
    slot: NDArray[np.int64]
    materials: tuple[Material, ...]
    motion: Motion | None = None
    name: str = "Triangles"
    visibility: Visibility = EVERYWHERE
    single: ClassVar[type] = Triangle
    arrays: ClassVar[tuple[str, ...]] = ("vertices",)

    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the edges (3, n) that leave the first vertices, metres."""
        a, b, c = self.vertices
        return b - a, c - a

    def record(self, index: int) -> Triangle:
        """Return one of the triangles as a record of its own."""
        a, b, c = (vector_of(vertex[:, index]) for vertex in self.vertices)
        return Triangle(
            (a, b, c), self.materials[self.slot[index]], self.motion, self.name, self.visibility
        )


Shape: TypeAlias = Sphere | Quad | Triangle | Ellipse | Ellipsoid | Cylinder
"""Record of one shape."""
ShapeRecord: TypeAlias = Shape | ShapeBatch
"""Record of one shape, or of several."""


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
    """The input of a render.

    `background` is the radiance (RGB) of rays that hit nothing, unless `backdrop` is given, which
    then tells it by direction.
    """

    camera: Camera | None = None
    shapes: tuple[ShapeRecord, ...] = ()
    lights: tuple[Light, ...] = ()
    background: Vector = ZERO
    transparent: bool = False
    issues: tuple[Issue, ...] = field(default=())
    backdrop: EnvironmentLight | None = None


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
    if not is_finite(background):
        issues.append(
            Issue(
                "World",
                "its background colour is not a finite number; black is used",
                kind="WORLD",
            )
        )
        background = ZERO
    backdrop = scene.backdrop
    if backdrop is not None and (reason := backdrop.defect()):
        issues.append(Issue(backdrop.name, f"{reason}; it is not seen", kind="WORLD"))
        backdrop = None
    return replace(
        scene,
        shapes=shapes,
        lights=lights,
        background=background,
        backdrop=backdrop,
        issues=tuple(issues),
    )


def checked_camera(scene: Scene) -> Camera:
    """Return the scene's camera if it is valid; raises as `validate`."""
    if scene.camera is None:
        raise SceneError("The scene has no camera: add one, or make one active")
    _check_camera(scene.camera)
    return scene.camera


def single_shapes(shapes: Iterable[ShapeRecord]) -> tuple[Shape, ...]:
    """Return shapes with each of a `ShapeBatch` as a record of its own."""
    singles: list[Shape] = []
    for shape in shapes:
        singles.extend(shape.records() if isinstance(shape, ShapeBatch) else [shape])
    return tuple(singles)


def _renderable_shapes(shapes: Iterable[ShapeRecord], issues: list[Issue]) -> list[ShapeRecord]:
    """Return the shapes that can be rendered, and append an issue for each other one."""
    kept: list[ShapeRecord] = []
    for shape in shapes:
        if not isinstance(shape, ShapeBatch):
            kept += _renderable_items([shape], issues)
        elif (whole := _renderable_batch(shape, issues)).count:
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


def _renderable_batch(batch: Batch, issues: list[Issue]) -> Batch:
    """Return those of many shapes that can be rendered, and append issues."""
    suspects = batch.suspects()
    kept = np.ones(batch.count, dtype=np.bool_)
    for index, shape in zip(suspects.tolist(), batch.take(suspects).records(), strict=True):
        reason = shape.defect()
        if reason:
            issues.append(Issue(shape.name, reason, missing=True))
            kept[index] = False
    return batch if kept.all() else batch.take(kept)


def _color_defect(material: Material) -> str | None:
    """Return what is wrong with a material, or None."""
    if not is_finite(material.color):
        return "its colour is not finite"
    return None if is_finite(material.emission) else "its emission is not finite"


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
    x, y, z = (vector_of(c / n for c in axis) for axis, n in zip(axes, sizes, strict=True))
    turn = (y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0])
    if not abs(x[0] * turn[0] + x[1] * turn[1] + x[2] * turn[2]) > 1.0 / LARGEST_RATIO:
        raise SceneError("The camera is squashed flat: check the scale and shear of its parents")
    if camera.motion is not None and not is_finite(camera.motion.displacement):
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
