# SPDX-License-Identifier: GPL-3.0-or-later
"""What renders of random scenes tell of the error model: predictions beside what they came to.

A render is watched at the place where it sets its goal and at its end: then each pixel's predicted
error, the estimate with which it ends and, from a picture of a much smaller tolerance, its true
error are known.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from adaptive_drt.cubature import error_budget
from adaptive_drt.cubature.adaptive import shade_initial_cells
from adaptive_drt.cubature.heap_limits import SamplingErrors
from adaptive_drt.exact import ExactRender
from adaptive_drt.image import biquadratic_blocks as blocks
from adaptive_drt.image import frame as frames
from adaptive_drt.image.frame import Frame
from adaptive_drt.numerics.arrays import Array, Ints, Mask
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    DiskLight,
    Material,
    Motion,
    Quad,
    Scene,
    Sphere,
    vector_of,
)
from adaptive_drt.scene.settings import Settings
from random_scenes import look_at, random_scene

POWER = error_budget.GOAL_POWER


@dataclass
class Watched:
    """A render as it was watched.

    Attributes
    ----------
    color : (3, height, width).  frame : its buffers at the end.
    goal : error goal.  rows : pixels of the buffers that the goal was set for.
    asked : the arguments of `make_goal`.  estimate : of the whole picture, relative to its mean.
    begun : first estimates of the pixels of which nothing was known but outlines, over the
        contrast, and whether these are crowded.
    blocks : sides of blocks that were considered, and their pixels, nodes and check points.
    """

    color: Array
    frame: Frame
    goal: error_budget.Goal
    rows: Ints
    asked: dict[str, Any]
    estimate: float
    shaded: int
    begun: tuple[Array, Mask]
    blocks: list[tuple[int, Ints, Ints, Ints]]


@contextmanager
def replaced(owner: Any, name: str, value: Any) -> Iterator[None]:
    """Replace an attribute for a while."""
    before = getattr(owner, name)
    setattr(owner, name, value)
    try:
        yield
    finally:
        setattr(owner, name, before)


def watch(scene: Scene, settings: Settings, outlines: bool = False) -> Watched | None:
    """Render a scene and watch; None if no goal was set from pixels, as in the dark.

    outlines : whether to evaluate the pixels that are cut by outlines for a first time.
    """
    seen: dict[str, Any] = {"blocks": []}
    goal, make, estimate = Frame.goal, frames.make_goal, Frame.estimate_error
    take, settle = ExactRender._take_goal, blocks.BiquadraticBlocks.settle

    def watched_goal(frame: Frame, inside: Mask, found: Any = None) -> error_budget.Goal:
        index = frame.region_pixels(inside)
        seen["rows"], seen["found"] = index[~frame.settled[index]], found
        seen["goal"] = goal(frame, inside, found)
        result: error_budget.Goal = seen["goal"]
        return result

    def watched_make(
        tolerance: float, color: Array, error: Array, starred: Array, cut: Mask,
        rest: tuple[float, int], motion: error_budget.MotionErrors | None,
        by_rays: SamplingErrors | None = None,
    ) -> error_budget.Goal:  # fmt: skip
        seen["asked"] = {"error": error, "starred": starred, "cut": cut, "motion": motion}
        return make(tolerance, color, error, starred, cut, rest, motion, by_rays)

    def watched_take(render: ExactRender, frame: Frame, inside: Mask) -> None:
        take(render, frame, inside)
        if outlines and "begun" not in seen and np.isfinite(render.goal.error):
            seen["begun"] = first_estimates(render, frame)

    def watched_settle(some: blocks.BiquadraticBlocks) -> None:
        seen["blocks"].append((some.side, some.pixels, some._nodes, some._checks))
        settle(some)

    def watched_estimate(frame: Frame) -> float:
        seen["frame"] = frame
        return estimate(frame)

    with (
        replaced(Frame, "goal", watched_goal),
        replaced(Frame, "estimate_error", watched_estimate),
        replaced(ExactRender, "_take_goal", watched_take),
        replaced(frames, "make_goal", watched_make),
        replaced(blocks.BiquadraticBlocks, "settle", watched_settle),
    ):
        film = render_image(scene, settings)
    if seen.get("found") is not None or not np.isfinite(seen["goal"].error):
        return None
    none = np.zeros(0), np.zeros(0, dtype=np.bool_)
    return Watched(
        np.array(film.color), seen["frame"], seen["goal"], seen["rows"], seen["asked"],
        float(film.stats["error_estimate"]), int(film.stats["rays"]["shaded"]),
        seen.get("begun", none), seen["blocks"],
    )  # fmt: skip


def first_estimates(render: ExactRender, frame: Frame) -> tuple[Array, Mask]:
    """First estimates of the pixels that outlines cut, over the contrast, and which are crowded."""
    rows = (frame.unknown & ~frame.settled & frame.inner() & (frame.visibility_key < 0)).nonzero()[
        0
    ]
    if not rows.size:
        return np.zeros(0), np.zeros(0, dtype=np.bool_)
    ((part, task),) = frame.tasks(rows, render.goal, rows.size)
    begun = shade_initial_cells(render.plan, render.occluders, task)
    crowded = frame._candidate_counts[part] > frames.MAX_REFINED_CANDIDATES
    return begun.error / render.goal.contrast, crowded


def true_picture(scene: Scene, tolerance: float, edges: bool = True) -> Array:
    """Picture of a scene at a small tolerance; without edges, of the centres of pixels."""
    settings = Settings(tolerance=tolerance, threads=1, use_edges=edges)
    return np.array(render_image(scene, settings).color)


def block_scene(seed: int) -> Scene | None:
    """Random scene in which something moves, of twice as many pixels a side; None if all is
    still."""
    scene = random_scene(seed)
    things = (*scene.shapes, *scene.lights, scene.camera)
    if not any(x.motion is not None and any(x.motion.displacement) for x in things):
        return None
    width, height = scene.camera.resolution
    return replace(scene, camera=replace(scene.camera, resolution=(2 * width, 2 * height)))


def crowd_scene(seed: int) -> Scene:
    """Random scene with a heap of small moving spheres before the camera's target."""
    rng = np.random.default_rng([seed, 7])
    scene = random_scene(seed)
    spheres = tuple(
        Sphere(
            vector_of(rng.normal(size=3) * 0.6 + (0.0, 0.0, 0.8)),
            float(rng.uniform(0.1, 0.3)),
            Material(vector_of(rng.uniform(0.1, 1.0, 3))),
            Motion(vector_of(rng.normal(size=3) * 0.3)),
        )
        for _ in range(30)
    )
    floor = Quad((-9.0, -9.0, -1.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0), Material((0.6, 0.6, 0.6)))
    light = DiskLight((2.0, -3.0, 6.0), float(rng.uniform(0.1, 1.0)), (9.0, 9.0, 9.0))
    camera = look_at((6.0, -4.0, 3.0), (0.0, 0.0, 0.8), focal_length=50.0, resolution=(32, 32))
    return replace(scene, camera=camera, shapes=(*spheres, floor), lights=(light,))


# the law of what refinement leaves


@dataclass(frozen=True)
class Pixels:
    """Refined pixels of renders.

    Attributes
    ----------
    slow : (n,) whether something moves, or outlines cut them and nothing else is known.
    kind : (n,) 0 where an error is predicted, 1 where only outlines are known, 2 where those are
        of many objects.
    grown : (n,) c^`GOAL_POWER` over that of the goal: the predicted number of cells to the power
        `GOAL_GROWTH`, if it is 1 or more; for coefficients of 1 where `slow`.
    end, true : (n,) the estimates with which they end, and their true errors, over the goal.
    scene : (n,) seeds.
    """

    slow: Mask
    kind: Ints
    grown: Array
    end: Array
    true: Array
    scene: Ints


def pixels_of(seen: Watched, truth: Array, seed: int) -> Pixels:
    """Pixels of a render that were refined."""
    motion, cut = seen.asked["motion"], seen.asked["cut"]
    kind = cut.astype(np.int64)
    if motion is not None:
        kind[cut & motion.crowded] = 2
    known = np.where(cut, seen.goal.contrast, seen.asked["error"])
    with replaced(error_budget, "MOTION_ERROR_SHARE", 1.0):
        every = np.ones(known.size, dtype=np.bool_)
        model = error_budget._ErrorModel.make(known, seen.asked["starred"], cut, motion, every)
    level, first = seen.goal.error, model.first
    if model.steps is not None:
        first = np.where(model.steps[0] > level, model.steps[1], first)
    frame = seen.frame
    y, x = np.divmod(seen.rows, frame.width)
    y, x = y - frame.region_slices[0].start, x - frame.region_slices[1].start
    off = np.sqrt(((seen.color[:, y, x] - truth[:, y, x]) ** 2).mean(axis=0))
    some = model.error > level
    grown, end = first * level**-POWER, frame.error[seen.rows] / level
    return Pixels(
        model.uses_motion_law[some], kind[some], grown[some], end[some], (off / level)[some],
        np.full(int(some.sum()), seed),
    )  # fmt: skip


def joined(parts: list[Pixels]) -> Pixels:
    """Pixels of several renders."""
    fields = [
        np.concatenate([getattr(part, name) for part in parts])
        for name in Pixels.__dataclass_fields__
    ]
    return Pixels(*fields)


# blocks of means over the shutter


@dataclass(frozen=True)
class Blocks:
    """Blocks of pixels that might be interpolated, over the picture's mean radiance.

    Attributes
    ----------
    true : (n,) RMS error of the interpolated means of pixels.
    residual, difference : (n,) largest miss at the check points after and before the cubic
        correction.
    """

    true: Array
    residual: Array
    difference: Array


def blocks_of(seen: Watched, truth: Array, centers: Array) -> Blocks:
    """Blocks that a render considered, interpolated between true means at the centres of pixels."""
    frame, found = seen.frame, []
    for side, pixels, nodes, checks in seen.blocks:
        places = [np.divmod(rows, frame.width) for rows in (pixels, nodes, checks)]
        y, x = (
            np.concatenate([place[k] - frame.region_slices[k].start for place in places])
            for k in (0, 1)
        )
        inside = ((y >= 0) & (x >= 0) & (y < truth.shape[1]) & (x < truth.shape[2])).all(axis=0)
        y, x = y[:, inside], x[:, inside]
        if not y.shape[1]:
            continue
        size = len(pixels)
        value = centers[:, y, x]
        at, check = value[:, size : size + 9], value[:, size + 9 :]
        weights = blocks._weights(blocks.CHECK_POINTS)
        miss = check - blocks._tensor_sums(at, weights, weights)
        up, across, left = blocks._cubic_terms(miss)
        means = blocks._means(at, side, True) + blocks._cubic_means(up, across, side, True)
        off = means - truth[:, y[:size], x[:size]]
        sizes = [np.sqrt((each**2).mean(axis=0)).max(axis=0) for each in (left, miss)]
        found.append((np.sqrt((off**2).mean(axis=(0, 1))), *sizes))
    mean = float(truth.mean())
    if not found:
        return Blocks(np.zeros(0), np.zeros(0), np.zeros(0))
    return Blocks(*(np.concatenate(each) / mean for each in zip(*found, strict=True)))


def joined_blocks(parts: list[Blocks]) -> Blocks:
    """Blocks of several renders."""
    names = Blocks.__dataclass_fields__
    return Blocks(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
