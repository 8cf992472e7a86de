# SPDX-License-Identifier: GPL-3.0-or-later
"""Render driver: runs the chosen method over threads and yields progress."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import closing
from dataclasses import asdict, dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .cost_model import predicted_ratio
from .detection.detect import CenterRays, DetectionFlags, detect, flag_everywhere, trace_center_rays
from .detection.occlusion import LightVisibility
from .distributed import ResolvedPixels, Resolver, resolve_tile
from .exact import ExactRender
from .image.schedule import StageTimer
from .parallel.call_progress import progress_range, report_progress
from .parallel.executor import CallProgress, RenderExecutor, run_in_thread
from .parallel.pool import Call, SharedArguments, worker_pool
from .scene.description import Issue, Scene, checked_camera, validate
from .scene.film import Film
from .scene.settings import Settings
from .tracing.compile import Plan, make_plan
from .tracing.intersect import Pairs, Tile, find_candidates, screen_bounds
from .tracing.occluder_culling import Occluders

__all__ = ["Progress", "render", "render_image"]

ALLOCATOR_HINT = 33_000_000
"""Bytes of a block that is allocated once and freed, never touched. glibc keeps freed memory up to
twice the largest block it has ever unmapped (at most 32 MiB); freeing this one spares 17 of 18
thousand page faults a picture."""
READING_STAGE = "Reading the scene"
"""Name of the first stage, for the user."""
WORKERS_PIXELS = 32_768
"""Number of pixels of a picture from which worker processes are started, which takes each 0.3 s."""
CAMERA_RAYS_DONE, DETECTION_DONE, PENUMBRAE_DONE = 0.05, 0.3, 0.6
"""Fractions of the work of a tile that are done after its camera rays, after detection and after
penumbrae, roughly; for a progress bar."""
TIMING_PIXELS = 8_192
"""Number of pixels of the plain pass that measures t'n: enough that the overhead of NumPy calls
does not dominate."""

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


@dataclass
class _TileResult:
    """Results of method RAYS for one tile, and the seconds of each stage."""

    tile: Tile
    pixels: ResolvedPixels
    mask: NDArray[np.bool_]
    depth: NDArray[np.float64]
    normal: NDArray[np.float64]
    seconds: dict[str, float] = field(default_factory=dict)


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
    began = time.perf_counter()
    np.empty(ALLOCATOR_HINT, dtype=np.uint8)
    left, bottom, right, top = checked_camera(scene).region
    film = Film(right - left, top - bottom)
    size, most = film.width * film.height, 0
    yield Progress(0, size, READING_STAGE, film)
    with closing(run_in_thread(_compile_scene, scene, settings)) as reading:
        scene, plan = yield from _await_call(reading, READING_STAGE, film)
    if size >= WORKERS_PIXELS:
        worker_pool.muster(plan.threads - 1)
    with closing(run_in_thread(Occluders, plan)) as preparing:
        occluders = yield from _await_call(preparing, "Preparing", film)
    totals = _Statistics()
    totals.seconds["prepare"] = time.perf_counter() - began
    render_pixels = _render_exact if settings.method == "EXACT" else _render_rays
    with closing(render_pixels(plan, occluders, film, totals)) as steps:
        for done, stage in steps:
            # completed fractions and finished results may be entered out of step
            most = max(most, done)
            yield Progress(most, size, stage, film)
    film.stats = totals.statistics(plan, film, scene.issues + _scene_warnings(plan))
    if settings.method == "RAYS":
        with closing(run_in_thread(_measure_pixel_seconds, plan, occluders)) as measuring:
            sample = yield from _await_call(measuring, "Measuring", film, most)
        _add_cost_model(film, totals, sample)
    totals.finish(film, began)
    return film


def _compile_scene(scene: Scene, settings: Settings) -> tuple[Scene, Plan]:
    """Validate a scene and compile it for rendering."""
    scene = validate(scene)
    return scene, make_plan(scene, settings)


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


def _render_rays(
    plan: Plan, occluders: Occluders, film: Film, totals: _Statistics
) -> Generator[tuple[int, str], None, None]:
    """Method RAYS, tile by tile: yields the number of pixels done and the stage."""
    size, parts = film.width * film.height, CallProgress()
    done, tiles = 0, _tile_count(plan)
    share = SharedArguments((plan, occluders, screen_bounds(plan)))
    jobs = [Call(_render_tile, share, (first, tiles)) for first in range(tiles)]
    with closing(RenderExecutor(plan.stop, plan.threads)) as hands:
        for outcome in hands.results(jobs, parts):
            if outcome is not None:
                _, result = outcome
                done += _write_tile(film, result)
                totals.add(result)
            yield done + int(sum(parts.copy().values()) * (size - 1) / tiles), "Tracing rays"


def _render_exact(
    plan: Plan, occluders: Occluders, film: Film, totals: _Statistics
) -> Generator[tuple[int, str], None, None]:
    """Method EXACT: yields the fraction of the work done, times the number of pixels, and the
    stage.
    """
    exact = ExactRender(plan, occluders)
    with closing(exact.run(film)) as steps:
        for done in steps:
            yield round(done * film.width * film.height), exact.stage
    totals.seconds.update(exact.work.seconds)
    totals.rays = {"camera": film.width * film.height, "shaded": exact.work.shaded}
    totals.more = {"tolerance": plan.settings.tolerance, "error_estimate": exact.error_estimate}


def render_image(scene: Scene, settings: Settings | None = None) -> Film:
    """Render a scene to the end and return the film; raises the errors of `render`."""
    steps = render(scene, settings)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            film: Film = end.value
            return film


def _tile_count(plan: Plan) -> int:
    """Number of tiles of at most `batch` pixels, if possible a multiple of the threads' number."""
    left, bottom, right, top = plan.region
    height = top - bottom
    most = max(1, plan.settings.batch // (right - left))
    count = -(-height // most)
    return min(height, -(-count // plan.threads) * plan.threads)


def _render_tile(
    plan: Plan, occluders: Occluders, bounds: NDArray[np.int64], first: int, step: int
) -> _TileResult:
    """Trace, detect and resolve one tile: every `step`-th row of the picture from row `first`."""
    clock = StageTimer()
    tile = Tile.make(plan, first, step)
    center = trace_center_rays(plan, tile.x, tile.y, find_candidates(plan, bounds, tile))
    clock("camera rays")
    report_progress(CAMERA_RAYS_DONE)
    with progress_range(CAMERA_RAYS_DONE, DETECTION_DONE):
        flags = _flags(plan, occluders, center, clock)
    resolver = Resolver(plan, occluders, tile, center, flags)
    with progress_range(DETECTION_DONE, PENUMBRAE_DONE):
        resolver.plain()
    clock("one-ray pixels and penumbrae")
    with progress_range(PENUMBRAE_DONE, 1.0):
        resolver.distributed()
    clock("motion and edges")
    normal = np.zeros((3, tile.index.size))
    normal[:, center.rows] = center.hits.normal
    return _TileResult(tile, resolver.out, flags.mask, center.depth, normal, clock.seconds)


def _flags(
    plan: Plan, occluders: Occluders, center: CenterRays, clock: StageTimer
) -> DetectionFlags:
    """Which domains are distributed in which pixels: by detection, or everywhere."""
    if plan.settings.distribution == "EVERYWHERE":
        return flag_everywhere(plan, center)
    return detect(plan, occluders, center, clock)


def _write_tile(film: Film, result: _TileResult) -> int:
    """Copy the results of a tile into the film; returns its number of pixels."""
    rows = slice(result.tile.first, None, result.tile.step)
    pixels = result.pixels
    shape = (-1, film.width)
    film.color[:, rows] = pixels.color.reshape(3, *shape)
    film.alpha[rows] = pixels.alpha.reshape(shape)
    film.mask[:, rows] = result.mask.reshape(3, *shape)
    film.samples[rows] = pixels.samples.reshape(shape)
    hit = np.isfinite(result.depth).reshape(shape)
    film.depth[rows] = np.where(hit, result.depth.reshape(shape), film.depth[rows])
    film.normal[:, rows] = result.normal.reshape(3, *shape)
    return result.tile.index.size


@dataclass
class _Statistics:
    """Statistics summed over tiles."""

    rays: dict[str, int] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    more: dict[str, Any] = field(default_factory=dict)

    def add(self, result: _TileResult) -> None:
        for kind, count in result.pixels.rays.items():
            self.rays[kind] = self.rays.get(kind, 0) + count
        for stage, span in result.seconds.items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + span

    def finish(self, film: Film, began: float) -> None:
        """Write the times into the statistics; `began` is the time when the render began."""
        self.seconds["total"] = time.perf_counter() - began
        film.stats["seconds"] = {k: round(v, 6) for k, v in self.seconds.items()}

    def statistics(self, plan: Plan, film: Film, issues: tuple[Issue, ...]) -> dict[str, Any]:
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
            "rays": self.rays,
            "skipped": list(plan.skipped),
            "issues": [asdict(issue) for issue in issues],
            "plan": plan.summary(),
            **self.more,
        }


def _scene_warnings(plan: Plan) -> tuple[Issue, ...]:
    """Issues of a scene that renders, but cannot show anything."""
    advice = []
    if not plan.object_count:
        said = "there is no object to render: add a sphere or a plane"
        advice.append(Issue("Scene", said, kind="SCENE"))
    if not plan.lights:
        said = "there is no light that shines: objects stay black"
        advice.append(Issue("Scene", said, kind="SCENE"))
    return tuple(advice)


def _measure_pixel_seconds(plan: Plan, occluders: Occluders) -> tuple[float, float]:
    """Measure the time of a pixel traced without derivatives, and of its shading alone.

    It is measured on a sample of the picture's rows.

    Returns
    -------
    plain : seconds a pixel without results of detection: one camera ray, one ray a light.
    shading : seconds to shade a pixel whose lights are known to be visible.
    """
    settings = replace(plan.settings, distribution="EVERYWHERE", light_rays=1)
    plain = replace(plan, settings=settings, penumbra=False, motion=False, edges=False)
    left, bottom, right, top = plan.region
    rows = max(1, min(top - bottom, TIMING_PIXELS // (right - left)))
    tile = Tile.make(plain, 0, max(1, (top - bottom) // rows))
    bounds = screen_bounds(plan)
    clock = StageTimer()
    center = trace_center_rays(plain, tile.x, tile.y, find_candidates(plain, bounds, tile))
    flags = flag_everywhere(plain, center)
    resolve_tile(plain, occluders, tile, center, flags)
    clock("plain")
    none = np.zeros(center.rows.size, dtype=np.bool_)
    nothing = np.zeros(0, dtype=np.int64)
    known = LightVisibility(none, none, none, Pairs(nothing, nothing))
    shadows = (known,) * len(plain.lights)
    resolve_tile(plain, occluders, tile, center, replace(flags, visibilities=shadows))
    clock("shading")
    count = tile.index.size
    return clock.seconds["plain"] / count, clock.seconds["shading"] / count


def _add_cost_model(film: Film, totals: _Statistics, sample: tuple[float, float]) -> None:
    """Write a, b, c and the prediction of equation 10 into the statistics.

    b is t_n over t'_n: the time of camera ray, detection and shading, nothing distributed, over
    that of a pixel of the plain tracer. Where rays are distributed everywhere no derivatives are
    computed: b = 1.
    """
    plain, shading = sample
    pixels = film.mask[0].size
    flagged = film.mask.any(axis=0)
    a = float(flagged.sum()) / pixels
    c = float(film.samples[flagged].mean()) if flagged.any() else 1.0
    detection = sum(s for stage, s in totals.seconds.items() if stage.startswith("detect"))
    b = 1.0
    if detection and plain > 0.0:
        traced = totals.seconds.get("camera rays", 0.0) + detection
        b = (traced / pixels + shading) / plain
    film.stats.update(a=a, b=b, c=c, predicted_ratio=predicted_ratio(a, b, c))
    film.stats["pixel_seconds"] = {"plain": plain, "shading": shading}
