# SPDX-License-Identifier: GPL-3.0-or-later
"""Render driver: runs the chosen method over threads and yields progress."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from typing import Any, TypeVar

import numpy as np

from .cost_model import PixelCosts, affordable_pixels, measure_pixel_costs, predicted_ratio
from .detection.face_costs import rays_cost_less_than_faces
from .distributed import DistributedRender
from .exact import ExactRender
from .image.memory_bound import memory_bound
from .parallel.executor import run_in_thread
from .parallel.memory_use import MemoryWatch, return_freed_memory
from .parallel.pool import worker_pool
from .scene.description import Issue, Scene, checked_camera, validate
from .scene.face_meshes import faces_as_meshes, flat_faces
from .scene.film import Film
from .scene.settings import Settings
from .tracing.compile import Plan, make_plan
from .tracing.light_layers import LightLayer, make_light_layers
from .tracing.occluder_culling import Occluders

__all__ = ["Progress", "render", "render_image"]

ALLOCATOR_HINT = 33_000_000
"""Bytes of a block that is allocated once and freed, never touched. glibc keeps freed memory up to
twice the largest block it has ever unmapped (at most 32 MiB); freeing this one spares 17 of 18
thousand page faults a picture."""
LEAST_OBJECTS_TO_TRIM = 100_000
"""Number of objects from which memory that compiling them has freed is returned before rays are
traced: of a million balls it is 150 MB. With fewer, it is soon used again. From so many on, what
calls have freed is returned as well, whenever the process grows."""
LIGHTS_STAGE = "Lights in view"
"""Name of the stage that renders what the camera sees of lights, for the user."""
READING_STAGE = "Reading the scene"
"""Name of the first stage, for the user."""
WORKERS_PIXELS = 32_768
"""Number of pixels of a picture from which worker processes are started, which takes each 0.3 s."""

Result = TypeVar("Result")


@dataclass(frozen=True)
class Progress:
    """Progress of a render: `done` of `total` pixels. `film` holds what is finished.

    `done` never decreases. Where pixels are processed more than once, it is the fraction of the
    work done, times the number of pixels. `stage` tells in words what is being done.
    """

    done: int
    total: int
    stage: str
    film: Film


def render(scene: Scene, settings: Settings | None = None) -> Generator[Progress, None, Film]:
    """Render a scene.

    Yields progress at once, after each tile, and every `HEARTBEAT` seconds, and returns the film.
    Closing the generator cancels the render: work in progress ends within a chunk of rays, and the
    film of the last progress stays valid.

    Raises
    ------
    SceneError
        The scene has no camera that could form a picture.
    """
    settings = settings or Settings()
    began, memory = time.perf_counter(), MemoryWatch()
    np.empty(ALLOCATOR_HINT, dtype=np.uint8)
    left, bottom, right, top = checked_camera(scene).region
    film = Film(right - left, top - bottom)
    size, most = film.width * film.height, 0
    yield Progress(0, size, READING_STAGE, film)
    with closing(run_in_thread(_compile_scene, scene, settings)) as reading:
        scene, plan = yield from _await_call(reading, READING_STAGE, film)
    if size >= WORKERS_PIXELS:
        worker_pool.start_workers(plan.threads - 1)
    with closing(run_in_thread(_prepare_occluders, plan)) as preparing:
        occluders = yield from _await_call(preparing, "Preparing", film)
    prepared = time.perf_counter() - began
    make = ExactRender if settings.method == "EXACT" else DistributedRender
    method = make(plan, occluders)
    layers = make_light_layers(plan)
    share = size / (size + sum(layer.width * layer.height for layer in layers))
    with closing(method.run(film)) as steps:
        for done in steps:
            memory.look(trim=plan.object_count >= LEAST_OBJECTS_TO_TRIM)
            # completed fractions and finished results may be entered out of step
            most = max(most, round(share * done * size))
            yield Progress(most, size, method.stage, film)
    errors = [] if isinstance(method, DistributedRender) else [_absolute_error(method, film)]
    for layer in layers:
        errors += yield from _add_light(layer, occluders, film, most)
    issues = scene.issues + _scene_warnings(plan)
    film.stats = _statistics(plan, film, issues) | _method_statistics(method)
    if layers and errors:
        film.stats["error_estimate"] = _joint_error(errors, film)
    if isinstance(method, DistributedRender):
        costs = yield from _pixel_costs(method, film, most, time.perf_counter() - began)
        film.stats |= _cost_model(plan, film, costs)
    film.stats["memory"] = _memory_statistics(plan, memory)
    seconds = {"prepare": prepared, **method.seconds, "total": time.perf_counter() - began}
    film.stats["seconds"] = {stage: round(span, 6) for stage, span in seconds.items()}
    return film


def _memory_statistics(plan: Plan, memory: MemoryWatch) -> dict[str, float | None]:
    """The bound on a render's memory, and the peak that was seen, in megabytes of 2^20 bytes."""
    memory.look()
    bound = memory_bound(plan, len(worker_pool.process_ids))
    peak = None if memory.peak is None else round(memory.peak / 2.0**20, 1)
    return {"bound_megabytes": round(bound / 2.0**20, 1), "peak_megabytes": peak}


def _compile_scene(scene: Scene, settings: Settings) -> tuple[Scene, Plan]:
    """Validate a scene and compile it for rendering, with meshes for flat faces that cost more."""
    scene = validate(scene)
    plan = make_plan(scene, settings, reduced=True)
    if settings.method == "EXACT" and settings.accelerator != "ARRAYS":
        faces = flat_faces(scene.shapes)
        if rays_cost_less_than_faces(plan, faces):
            changed = replace(scene, shapes=faces_as_meshes(scene.shapes))
            plan = replace(make_plan(changed, settings, reduced=True), faces_by_rays=faces)
    return scene, plan


def _prepare_occluders(plan: Plan) -> Occluders:
    """Make a scene's occluders, and return what memory compiling many objects has freed."""
    found = Occluders(plan)
    if plan.object_count >= LEAST_OBJECTS_TO_TRIM:
        return_freed_memory()
    return found


def _add_light(
    layer: LightLayer, occluders: Occluders, film: Film, done: int
) -> Generator[Progress, None, list[float]]:
    """Render what the camera sees of a light, and add it to a film.

    Yields progress of `done` pixels, and returns the sum of the squared errors of its pixels, in a
    list that is empty where the method states none.
    """
    part = Film(layer.width, layer.height)
    make = ExactRender if layer.plan.settings.method == "EXACT" else DistributedRender
    method = make(layer.plan, occluders)
    with closing(method.run(part)) as steps:
        for _ in steps:
            yield Progress(done, film.width * film.height, LIGHTS_STAGE, film)
    rows = slice(layer.bottom, layer.bottom + layer.height)
    across = slice(layer.left, layer.left + layer.width)
    film.color[:, rows, across] += part.color
    film.mask[:, rows, across] |= part.mask
    film.samples[rows, across] += np.maximum(part.samples - 1, 0)
    return [] if isinstance(method, DistributedRender) else [_absolute_error(method, part)]


def _absolute_error(method: ExactRender, film: Film) -> float:
    """Sum of the squared estimated errors of a picture's pixels."""
    size = film.width * film.height
    return float((method.error_estimate * np.abs(film.color).mean()) ** 2 * size)


def _joint_error(errors: list[float], film: Film) -> float:
    """Estimated error of a picture, relative to its mean, from those of pictures that it sums."""
    mean = float(np.abs(film.color).mean())
    deviation = float(np.sqrt(sum(errors) / (film.width * film.height)))
    return deviation / mean if mean else 0.0


def _await_call(
    call: Generator[None, None, Result], stage: str, film: Film, done: int = 0
) -> Generator[Progress, None, Result]:
    """Yield progress at each heartbeat of a call, and return its result."""
    while True:
        try:
            next(call)
        except StopIteration as end:
            result: Result = end.value
            return result
        yield Progress(done, film.width * film.height, stage, film)


def render_image(scene: Scene, settings: Settings | None = None) -> Film:
    """Render a scene to the end and return the film; raises the errors of `render`."""
    steps = render(scene, settings)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            film: Film = end.value
            return film


def _statistics(plan: Plan, film: Film, issues: tuple[Issue, ...]) -> dict[str, Any]:
    """Statistics of a picture by either method."""
    penumbra, motion, edge = film.mask
    flagged = penumbra | motion | edge
    return {
        "pixels": int(film.mask[0].size),
        "counts": {
            "penumbra": int(np.count_nonzero(penumbra)),
            "motion": int(np.count_nonzero(motion)),
            "edge": int(np.count_nonzero(edge)),
            "distributed": int(np.count_nonzero(flagged)),
        },
        "skipped": list(plan.skipped),
        "issues": [asdict(issue) for issue in issues],
        "plan": plan.summary(),
    }


def _method_statistics(method: ExactRender | DistributedRender) -> dict[str, Any]:
    """Statistics of one method: the rays it traced, and the error that it states."""
    if isinstance(method, DistributedRender):
        return {"rays": method.rays}
    left, bottom, right, top = method.plan.region
    sampled, sampling_error = method.sampling_error
    rays = {
        kind if kind.startswith("solid") else f"mesh {kind}": count
        for kind, count in method.work.rays.items()
        if count
    }
    return {
        "rays": {"camera": (right - left) * (top - bottom), "shaded": method.work.shaded} | rays,
        "tolerance": method.plan.settings.tolerance,
        "error_estimate": method.error_estimate,
        "sampled_pixels": sampled,
        "sampling_error": sampling_error,
    }


def _scene_warnings(plan: Plan) -> tuple[Issue, ...]:
    """Issues of a scene that renders, but cannot show anything."""
    advice = []
    if not plan.object_count:
        said = "there is no object to render: add a sphere or a plane"
        advice.append(Issue("Scene", said, kind="SCENE"))
    if not (plan.lights or plan.seen_lights or plan.emission is not None):
        said = "there is no light that shines: objects stay black"
        advice.append(Issue("Scene", said, kind="SCENE"))
    return tuple(advice)


def _pixel_costs(
    method: DistributedRender, film: Film, done: int, seconds: float
) -> Generator[Progress, None, PixelCosts | None]:
    """Measure the costs of pixels after a render of so many seconds; None if it was too short.

    Where rays are distributed everywhere no derivatives are computed, and nothing is measured.
    """
    plan = method.plan
    if plan.settings.distribution == "EVERYWHERE":
        return None
    stages = method.seconds.items()
    traced = sum(s for stage, s in stages if stage == "camera rays" or stage.startswith("detect"))
    pixels = affordable_pixels(plan, seconds, traced / (film.width * film.height))
    if not pixels:
        return None
    with closing(run_in_thread(measure_pixel_costs, plan, method.occluders, pixels)) as call:
        return (yield from _await_call(call, "Measuring", film, done))


def _cost_model(plan: Plan, film: Film, costs: PixelCosts | None) -> dict[str, Any]:
    """The figures a, b, c of the paper's cost model and the prediction of equation 10.

    Figures that are not measured are None. Where rays are distributed everywhere no derivatives
    are computed, so b is 1.
    """
    flagged = film.mask.any(axis=0)
    a = float(flagged.mean())
    c = float(film.samples[flagged].mean()) if flagged.any() else 1.0
    b, spread = (costs.b, costs.spread) if costs is not None else (None, None)
    if plan.settings.distribution == "EVERYWHERE":
        b, spread = 1.0, 0.0
    return {
        "a": a,
        "b": b,
        "b_spread": spread,
        "c": c,
        "predicted_ratio": None if b is None else predicted_ratio(a, b, c),
        "pixel_seconds": None if costs is None else costs.summary(),
    }
