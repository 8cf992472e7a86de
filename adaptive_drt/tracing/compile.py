# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiling a scene: its arrays, the effects that have to be computed, and those skipped."""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry.axial_profile import AxialProfile
from ..geometry.camera import PinholeCamera, make_pinhole_camera
from ..geometry.embree_library import native_version
from ..geometry.registry import SHAPES, faces_of, kind_of
from ..geometry.shape_table import ShapeTable
from ..lights.emitter import Emitter, LightMotion
from ..lights.environment_map import EnvironmentMap, make_environment_map
from ..lights.registry import make_emitter, split_lights
from ..numerics.arrays import Array
from ..numerics.low_discrepancy import splitmix64
from ..numerics.vector import dot
from ..parallel.cancellation import RenderCancelled
from ..scene.description import Motion, Scene, ShapeBatch, ShapeRecord
from ..scene.mesh_instances import MeshInstances
from ..scene.settings import Settings
from ..scene.values import ZERO
from .ball_groups import MANY_OBJECTS
from .irrelevance import SeenBounds
from .solid_rays import find_traced_solids

__all__ = ["Plan", "make_plan"]


EMBREE_CROSSOVER = 2_000
"""Number of proxies from which embree finds candidate occluders faster than NumPy arrays do.

Measured by `benchmarks/crossover.py` with spheres."""
EMBREE_MAX_LIGHT_SIZE = 4.0
"""Largest radius of a light, with its path, for which embree is used, in mean radii of the
objects that have proxies.

Embree's proxies are inflated by the light's radius, so a ray towards a large light intersects many
of them, and each hit costs one call."""

IDLE = "the camera does not see them, and they are before no light of what it sees"
"""Why objects are left out, for the statistics."""
MAX_BATCH_PAIRS = 1 << 22
"""Largest number of pairs of pixels and objects in a batch under a light that surrounds the scene.

Every object above a point's horizon then is a candidate occluder, with some 100 bytes."""
MIN_BATCH = 256
"""Least number of pixels in a batch; the time of a call is lost in the work on so many."""


@dataclass(frozen=True)
class Plan:
    """A compiled scene. Positions are relative to the camera, which is at rest at the origin.

    Objects are numbered by kind: see `ShapeTable`.

    Attributes
    ----------
    settings : the settings of the render.  lens : the camera's rays.
    shapes : the objects, relative to the camera, metres.
    albedo : (3, objects) albedo.
    is_moving : (objects,) bool, whether the object moves relative to the camera during the shutter.
    region : pixels (left, bottom, right, top) to render; picture : width and height of the image.
    lights : the lights that light surfaces and whose power is not zero.
    background : (3,) colour.  transparent : whether the background is.
    backdrop : what is seen instead of the colour, which then is black; or None.
    penumbra, motion, edges : whether the effect is enabled and the scene has it.
    may_use_embree : whether embree may find candidate occluders; `uses_embree` says for which
        lights.
    threads : number of threads.
    skipped : the effects and objects that are left out, each with the reason.
    seen_lights : the lights that the camera may see: see `light_layers`.
    emission : (3, objects) radiance that objects emit, W / m^2 / sr; None if none does.
    emission_profile : how all that depends on the direction to the camera; None where it does not.
    seen : (objects,) bool, whether the camera sees the object; None if it sees all.
    holdout : (objects,) bool, which objects have no coverage, and are black; None if none has.
    traced : (objects,) bool, the solids, with their flat ends, that rays are traced against as one
        set where light is sampled: see `solid_rays`; None if there are none.
    faces_by_rays : number of flat faces that meshes stand for: see `scene.face_meshes`.
    stop : set to cancel the render: loops over chunks of work call `raise_if_cancelled` before
        each chunk.
    """

    settings: Settings
    lens: PinholeCamera
    region: tuple[int, int, int, int]
    resolution: tuple[int, int]
    shapes: ShapeTable
    albedo: Array
    is_moving: NDArray[np.bool_]
    lights: tuple[Emitter, ...]
    background: Array
    backdrop: EnvironmentMap | None
    transparent: bool
    penumbra: bool
    motion: bool
    edges: bool
    may_use_embree: bool
    threads: int
    skipped: tuple[dict[str, str], ...] = field(default=())
    seen_lights: tuple[Emitter, ...] = ()
    emission: Array | None = None
    emission_profile: AxialProfile | None = None
    seen: NDArray[np.bool_] | None = None
    holdout: NDArray[np.bool_] | None = None
    traced: NDArray[np.bool_] | None = None
    faces_by_rays: int = 0
    stop: threading.Event = field(default_factory=threading.Event)

    def __getstate__(self) -> dict[str, Any]:
        """Pickled state, without `stop`: a worker process is killed when its call is cancelled."""
        return {name: value for name, value in self.__dict__.items() if name != "stop"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the pickled state, with a new event for `stop`."""
        self.__dict__.update(state, stop=threading.Event())

    def raise_if_cancelled(self) -> None:
        """Raise `RenderCancelled` if the render was cancelled."""
        if self.stop.is_set():
            raise RenderCancelled

    @property
    def least_radiance(self) -> float:
        """Radiance below which no pixel may be: 0, unless a light has a negative power."""
        takes = any((light.power < 0.0).any() for light in (*self.lights, *self.seen_lights))
        return -np.inf if takes or (self.background < 0.0).any() else 0.0

    @property
    def object_count(self) -> int:
        """Number of objects."""
        return self.albedo.shape[1]

    @property
    def may_sample(self) -> bool:
        """Whether pixels may be sampled by rays: see `cubature.sampled_pixels`."""
        return self.traced is not None or bool(self.shapes.sampled.any())

    def opacity(self, item: NDArray[np.int64]) -> Array:
        """Coverage (...) where objects are seen, given by number; -1 stands for the background."""
        clear = (item < 0) & self.transparent
        if self.holdout is not None:
            clear |= self.holdout[item] & (item >= 0)
        return np.where(clear, 0.0, 1.0)

    def uses_embree(self, light: Emitter) -> bool:
        """Whether embree, rather than NumPy arrays, finds the candidate occluders of a light."""
        if not self.may_use_embree or not self.shapes.proxied or not light.casts_shadow:
            return False
        inflation = self.as_shadow_caster(light).occluder_inflation
        if self.settings.accelerator == "EMBREE":
            return math.isfinite(inflation)
        radius = self.shapes.bounding_spheres[1][: self.shapes.proxied]
        return inflation <= EMBREE_MAX_LIGHT_SIZE * float(radius.mean())

    @property
    def foresees_errors(self) -> bool:
        """Whether few rays leave each point of sampled pixels, and a law foresees their errors.

        It is so where nearly all pixels are sampled to many points: of sets of spheres, and of many
        instances of a mesh. These then take 0.7 to 0.8 of the time. The law: `heap_limits`.
        """
        return self.traced is not None or any(each.has_instances for each in self.shapes.sets)

    @property
    def all_shadows_soft(self) -> bool:
        """Whether every light that casts shadows has a size, so that all shadows have penumbrae."""
        casting = (light for light in self.lights if light.casts_shadow)
        return all(self.as_shadow_caster(light).extended for light in casting)

    @property
    def any_mesh(self) -> bool:
        """Whether any object is sampled: its outlines then tell where shadows may change."""
        return bool(self.shapes.sampled.any())

    def as_shadow_caster(self, light: Emitter) -> Emitter:
        """The light as it casts shadows: reduced to its centre where penumbrae are not computed."""
        return light if self.penumbra else light.as_point()

    def summary(self) -> dict[str, Any]:
        """The compiled scene in figures, for the statistics."""
        kinds = [getattr(record, "plural", f"{record.__name__.lower()}s") for record, _ in SHAPES]
        counts = [shapes.count for shapes in self.shapes.sets]
        return {
            **dict(zip(kinds, counts, strict=True)),
            **{k: v for shapes in self.shapes.sets for k, v in shapes.figures().items()},
            **self._environment_summary(),
            "lights": len(self.lights),
            "penumbra": self.penumbra,
            "motion": self.motion,
            "edges": self.edges,
            "accelerator": sorted(
                {"EMBREE" if self.uses_embree(light) else "ARRAYS" for light in self.lights}
            ),
            "flat_faces_by_rays": self.faces_by_rays,
            "solid_rays": native_version() if self.traced is not None else "none",
            "threads": self.threads,
        }

    def _environment_summary(self) -> dict[str, Any]:
        """What the tables of environments take, if there are any."""
        maps = [light.environment.map for light in self.lights if light.environment is not None]
        if not maps:
            return {}
        return {
            "environment texels": max(each.values[..., 0].size for each in maps),
            "environment megabytes": round(sum(each.table_bytes for each in maps) / 2.0**20, 1),
            "environment reduction error": max(each.reduction_error for each in maps),
        }


def make_plan(scene: Scene, settings: Settings, reduced: bool = False) -> Plan:
    """Compile a validated scene; `reduced` without what cannot matter: see `irrelevance`."""
    assert scene.camera is not None  # `validate` has checked it
    moving = settings.use_motion
    drift = _displacement(scene.camera.motion if moving else None)
    skipped: list[dict[str, str]] = []
    distinct = _without_duplicates(_timed(scene.shapes, moving), skipped)
    distinct = faces_of(distinct, (make_pinhole_camera(scene.camera).origin, drift))
    return _telling(_make_plan(scene, distinct, settings, reduced), skipped)


def _make_plan(
    scene: Scene, distinct: Sequence[ShapeRecord], settings: Settings, reduced: bool
) -> Plan:
    """The plan for a scene whose shapes are replaced by others, which all differ."""
    camera, moving, skipped = scene.camera, settings.use_motion, list[dict[str, str]]()
    assert camera is not None
    lens, drift = make_pinhole_camera(camera), _displacement(camera.motion if moving else None)
    records = [[s for s in distinct if kind_of(s) is record] for record, _ in SHAPES]
    shapes = [shape for kind in records for shape in kind]
    counts = [_count(s) for s in shapes]
    origin, drifts = lens.origin[:, None], _displacements(shapes, counts, moving, drift)
    table = _make_shape_table(records, origin, drifts)
    lights, seen_lights = _make_emitters(scene, moving, lens.origin, drift, skipped)
    visible = _mask(shapes, lambda shape: shape.visibility.camera, True)
    if reduced:
        bounds = SeenBounds.make(table, lens, camera.resolution, visible)
        lights = _without_averted(lights, bounds, skipped)
        kept = _without_idle(shapes, counts, bounds.idle_objects(lights), skipped)
        if len(kept) < len(shapes) or sum(map(_count, kept)) < sum(counts):
            return _telling(_make_plan(scene, kept, settings, reduced), skipped)
    penumbra = _has_penumbra(settings, lights, sum(counts), skipped)
    motion = moving and (bool(table.moves.any()) or any(x.displacement is not None for x in lights))
    skipped += _skipped_effects(settings, motion, sum(counts))
    lights = _with_shapes(lights, shapes, table, origin)
    traced = find_traced_solids(table, lights, settings)
    lights = _prepared(lights, settings, traced is not None or bool(table.sampled.any()))
    return Plan(
        settings=_with_feasible_batches(settings, lights, sum(counts), motion or traced is None),
        lens=lens,
        region=camera.region,
        resolution=camera.resolution,
        shapes=table,
        albedo=_colors(shapes),
        is_moving=table.moves,
        lights=lights,
        backdrop=None if scene.backdrop is None else make_environment_map(scene.backdrop, False),
        background=np.array(scene.background if scene.backdrop is None else ZERO, dtype=np.float64),
        transparent=scene.transparent,
        penumbra=penumbra,
        motion=motion,
        edges=settings.use_edges and bool(shapes),
        may_use_embree=_wants_embree(settings, table),
        threads=settings.threads or os.cpu_count() or 1,
        skipped=tuple(skipped),
        seen_lights=seen_lights,
        emission=_emissions(shapes),
        seen=visible,
        holdout=_mask(shapes, lambda shape: shape.visibility.holdout, False),
        traced=traced,
    )


def _without_averted(
    lights: Iterable[Emitter], bounds: SeenBounds, skipped: list[dict[str, str]]
) -> tuple[Emitter, ...]:
    """The lights without those that face away from all that is seen; these go to `skipped`.

    All stay where none would: an unlit picture costs little, and keeps its depths to the last bit.
    """
    away = [(light, bounds.faces_away(light)) for light in lights]
    if all(averted for _, averted in away):
        return tuple(light for light, _ in away)
    why = "the light faces away from all that is seen"
    skipped += [{"what": light.name, "why": why} for light, averted in away if averted]
    return tuple(light for light, averted in away if not averted)


def _telling(plan: Plan, skipped: list[dict[str, str]]) -> Plan:
    """A plan that also tells of what was skipped before it was made."""
    before = [each for each in skipped if each not in plan.skipped]
    return replace(plan, skipped=(*before, *plan.skipped))


def _without_idle(
    records: Sequence[ShapeRecord],
    counts: Sequence[int],
    idle: NDArray[np.bool_],
    skipped: list[dict[str, str]],
) -> tuple[ShapeRecord, ...]:
    """The shapes without those that a mask (n,) tells of; their number is added to `skipped`."""
    if not idle.any():
        return tuple(records)
    skipped.append({"what": f"{idle.sum():,} objects", "why": IDLE})
    remaining: list[ShapeRecord] = []
    parts = np.split(~idle, np.cumsum(counts)[:-1])
    for record, own in zip(records, parts, strict=True):
        if own.all():
            remaining.append(record)
        elif own.any():
            assert isinstance(record, ShapeBatch)
            remaining.append(record.take(own))
    return tuple(remaining)


def _with_shapes(
    lights: Sequence[Emitter], shapes: Sequence[ShapeRecord], table: ShapeTable, origin: Array
) -> tuple[Emitter, ...]:
    """The lights, which then know which shapes they light, pass through, lie in and touch."""
    return tuple(
        _with_touched_shapes(_with_coplanar_faces(light, table, origin), table)
        for light in (_with_visibility(light, shapes) for light in lights)
    )


def _make_shape_table(
    records: Sequence[Sequence[ShapeRecord]], origin: Array, displacement: Array
) -> ShapeTable:
    """The shapes as arrays, from their records by kind.

    displacement : (3, n) of all of them over the shutter, metres.
    """
    sets, first = [], 0
    for own, (_, kind) in zip(records, SHAPES, strict=True):
        end = first + sum(map(_count, own))
        d = displacement[:, first:end]
        sets.append(kind.from_records(own, origin, d.copy() if d.any() else None))
        first = end
    return ShapeTable(tuple(sets))


def _count(record: ShapeRecord) -> int:
    """Number of shapes in a record."""
    return record.count if isinstance(record, ShapeBatch) else 1


def _shown(record: ShapeRecord) -> float:
    """Factor of the colours of a shape: holdouts are black."""
    return 0.0 if record.visibility.holdout else 1.0


def _colors(records: Sequence[ShapeRecord]) -> Array:
    """Albedo (3, n) of each shape."""
    colors = [
        _shown(record)
        * (
            record.colors()
            if isinstance(record, ShapeBatch)
            else np.reshape(record.material.color, (3, 1))
        )
        for record in records
    ]
    return np.concatenate(colors, axis=1, dtype=np.float64) if colors else np.zeros((3, 0))


def _emissions(records: Sequence[ShapeRecord]) -> Array | None:
    """Emission (3, n) of each shape, or None if none shines."""
    parts = [
        _shown(record)
        * (
            _columns([m.emission for m in record.materials])[:, record.slot]
            if isinstance(record, ShapeBatch)
            else np.reshape(np.array(record.material.emission, dtype=np.float64), (3, 1))
        )
        for record in records
    ]
    found = np.concatenate(parts, axis=1) if parts else np.zeros((3, 0))
    return found if found.any() else None


def _mask(
    records: Sequence[ShapeRecord], answer: Callable[[ShapeRecord], bool], usual: bool
) -> NDArray[np.bool_] | None:
    """What is true of each shape (n,) by its record; None if it is `usual` for all of them."""
    each = [answer(record) for record in records]
    if all(one is usual for one in each):
        return None
    return np.repeat(each, [_count(record) for record in records])


def _with_visibility(light: Emitter, shapes: Sequence[ShapeRecord]) -> Emitter:
    """The light, which then knows which shapes it does not light, and which do not hide it."""

    def passes(shape: ShapeRecord) -> bool:
        return not shape.visibility.shadow or light.name in shape.visibility.passed_by

    unlit = _mask(shapes, lambda shape: light.name in shape.visibility.unlit_by, False)
    through = _mask(shapes, passes, False)
    if unlit is None and through is None:
        return light
    return replace(light, unlit=unlit, passes=through)


def _timed(records: Sequence[ShapeRecord], moving: bool) -> Sequence[ShapeRecord]:
    """The shapes, of which instances are at rest unless motion is wanted."""
    if moving:
        return records
    return [each.at_rest() if isinstance(each, MeshInstances) else each for each in records]


def _without_duplicates(
    records: Sequence[ShapeRecord], skipped: list[dict[str, str]]
) -> list[ShapeRecord]:
    """The shapes without those equal to an earlier one. These are added to `skipped`."""
    repeated = [np.zeros(_count(record), dtype=np.bool_) for record in records]
    for kind, _ in SHAPES:
        own = [k for k, record in enumerate(records) if kind_of(record) is kind]
        if own:
            found = _repeated(np.concatenate([_motion_and_place(records[k]) for k in own], axis=1))
            ends = np.cumsum([repeated[k].size for k in own])[:-1]
            for k, part in zip(own, np.split(found, ends), strict=True):
                repeated[k] = part
    kept: list[ShapeRecord] = []
    for record, again in zip(records, repeated, strict=True):
        why = {"what": record.name, "why": "another object is in the very same place"}
        skipped += [why] * int(again.sum())
        if not again.any():
            kept.append(record)
        elif isinstance(record, ShapeBatch) and not again.all():
            kept.append(record.take(~again))
    return kept


def _motion_and_place(record: ShapeRecord) -> Array:
    """Numbers (k, n), equal for shapes of one kind in the same place that move alike."""
    numbers = record.numbers()
    own = record.displacements() if isinstance(record, ShapeBatch) else None
    if own is not None:
        return np.concatenate([own.any(axis=0)[None].astype(np.float64), own, numbers])
    motion = (0.0,) * 4 if record.motion is None else (1.0, *record.motion.displacement)
    return np.concatenate([np.repeat(np.array(motion)[:, None], numbers.shape[1], axis=1), numbers])


def _repeated(columns: Array) -> NDArray[np.bool_]:
    """Whether each column (k, n) is equal to an earlier one: (n,)."""
    # 0 is added so that -0 becomes 0; columns are then equal if their bytes are
    rows = np.ascontiguousarray(columns.T) + 0.0
    if _are_distinct(rows):
        return np.zeros(len(rows), dtype=np.bool_)
    repeated = np.ones(len(rows), dtype=np.bool_)
    if len(rows):
        keys = rows.view(np.dtype((np.void, rows.itemsize * rows.shape[1])))[:, 0]
        repeated[np.unique(keys, return_index=True)[1]] = False
    return repeated


def _are_distinct(rows: Array) -> bool:
    """Whether hashes prove that no two rows (n, k) have the same bytes: much faster than sorting.

    Hashes of different rows may agree, so False proves nothing.
    """
    found = np.zeros(len(rows), dtype=np.uint64)
    for column in rows.view(np.uint64).T:
        found = splitmix64(found ^ column)
    found.sort()
    return bool((found[1:] != found[:-1]).all())


def _make_emitters(
    scene: Scene, moving: bool, origin: Array, drift: Array, skipped: list[dict[str, str]]
) -> tuple[tuple[Emitter, ...], tuple[Emitter, ...]]:
    """The lights with non-zero power, as emitters. The others are added to `skipped`.

    Returns those that light surfaces, and those that the camera may see.
    """
    lighting, seen = [], []
    motion = LightMotion(origin, drift, moving)
    for light in split_lights(scene.lights):
        emitter = make_emitter(light, motion)
        if not emitter.power.any():
            skipped.append({"what": light.name, "why": "the light has no power"})
            continue
        if light.lights_surfaces:
            lighting.append(emitter)
        if light.seen:
            seen.append(emitter)
    return tuple(lighting), tuple(seen)


def _prepared(lights: Iterable[Emitter], settings: Settings, sampled: bool) -> tuple[Emitter, ...]:
    """Lights with what they keep for a picture, each channel apart where rays are distributed.

    sampled : whether rays find light by method 'EXACT' as well.
    """
    if settings.method == "RAYS" or sampled:
        # distributed rays estimate one number a light
        lights = [part for light in lights for part in light.channels()]
    return tuple(light.prepared(settings.tolerance) for light in lights)


def _with_touched_shapes(light: Emitter, table: ShapeTable) -> Emitter:
    """The light, which then knows which shapes it may reach into, by balls and planes."""
    if light.surrounds:
        return light
    parts = []
    for shapes in table.sets:
        center, radius = shapes.bounding_spheres
        sweep = np.full(shapes.count, light.swept_radius - light.radius)
        d = shapes.displacement
        if d is not None:
            sweep += 0.5 * np.sqrt(dot(d, d))
        gap = light.to_center(center)
        touched = np.sqrt(dot(gap, gap)) <= radius + light.radius + sweep
        faces = shapes.faces
        if faces is not None:
            height = np.abs(dot(faces.normal, light.center - faces.vertices[0]))
            touched &= height <= light.extent(faces.normal) + sweep
        parts.append(touched)
    found = np.concatenate(parts)
    return replace(light, touched=found) if found.any() else light


def _with_coplanar_faces(light: Emitter, table: ShapeTable, origin: Array) -> Emitter:
    """The light with its list of the planar objects in its plane, which occlude nothing of it."""
    parts = []
    for shapes in table.sets:
        faces = shapes.faces
        none = np.zeros(shapes.count, dtype=np.bool_)
        parts.append(none if faces is None else light.coplanar_faces(faces, origin))
    coplanar = np.concatenate(parts)
    return replace(light, coplanar=coplanar) if coplanar.any() else light


def _with_feasible_batches(
    settings: Settings, lights: Sequence[Emitter], objects: int, listed: bool
) -> Settings:
    """The settings with batches so small that all pairs of their pixels and objects fit memory.

    listed : whether all occluders of a light that surrounds the scene are listed.
    """
    if not listed or not any(light.surrounds for light in lights):
        return settings
    most = max(MIN_BATCH, MAX_BATCH_PAIRS // max(objects, 1))
    return replace(settings, batch=min(settings.batch, most))


def _has_penumbra(
    settings: Settings, lights: Sequence[Emitter], objects: int, skipped: list[dict[str, str]]
) -> bool:
    """Whether penumbrae are computed. If not, the reason is added to `skipped`."""
    sized = any(light.extended and light.casts_shadow for light in lights)
    hard = "switched off: lights shadow from their centres"
    if any(light.surrounds for light in lights):
        hard += ", and what surrounds the scene casts no shadows"
    for absent, why in (
        (not settings.use_penumbra, hard),
        (not objects, "there is no object"),
        (not sized, "no light with a size casts shadows"),
    ):
        if absent:
            skipped.append({"what": "penumbrae", "why": why})
            return False
    return True


def _skipped_effects(settings: Settings, motion: bool, objects: int) -> list[dict[str, str]]:
    """Motion blur and edges, each where it is skipped, with the reason."""
    skipped = []
    if not motion:
        off = "switched off" if not settings.use_motion else "nothing moves during the shutter"
        skipped.append({"what": "motion blur", "why": off})
    if not settings.use_edges or not objects:
        off = "switched off" if not settings.use_edges else "there is no object"
        skipped.append({"what": "edges", "why": off})
    return skipped


def _wants_embree(settings: Settings, table: ShapeTable) -> bool:
    """Whether embree may be used, by the setting and the number of objects that have proxies."""
    proxied = table.proxied
    if settings.accelerator == "AUTO":
        if table.count >= MANY_OBJECTS:
            return False  # groups of them cost less time and memory
        # without embreex the image is the same, but takes longer
        return proxied >= EMBREE_CROSSOVER and find_spec("embreex") is not None
    return settings.accelerator == "EMBREE" and proxied > 0


def _displacement(motion: Motion | None) -> Array:
    """Displacement (3,) over the shutter, metres; 0 without motion."""
    return np.array((0.0, 0.0, 0.0) if motion is None else motion.displacement, dtype=np.float64)


def _displacements(
    records: Sequence[ShapeRecord], counts: Sequence[int], moving: bool, drift: Array
) -> Array:
    """Displacements (3, n) of all shapes over the shutter, metres, less the camera's drift."""
    shift = [_displacement(s.motion if moving else None) - drift for s in records]
    found = np.repeat(_columns(shift), counts, axis=1)
    first = 0
    for record, count in zip(records if moving else (), counts, strict=False):
        own = record.displacements() if isinstance(record, ShapeBatch) else None
        if own is not None:
            found[:, first : first + count] = own - drift[:, None]
        first += count
    return found


def _columns(vectors: Sequence[Sequence[float] | Array]) -> Array:
    """Vectors as the columns of an array (3, n), also for n = 0."""
    return np.ascontiguousarray(np.array(vectors, dtype=np.float64).reshape(-1, 3).T)
