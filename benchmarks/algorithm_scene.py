# SPDX-License-Identifier: GPL-3.0-or-later
"""The small scene of docs/algorithm.md, rendered so that what happens on the way can be drawn."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from paper_scenes import look_at

from adaptive_drt.exact import ExactRender
from adaptive_drt.image.first_pass import FirstPass
from adaptive_drt.image.frame import Frame
from adaptive_drt.numerics.arrays import Array, Mask
from adaptive_drt.parallel.executor import CallProgress
from adaptive_drt.scene.description import (
    Material,
    Motion,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    validate,
)
from adaptive_drt.scene.film import Film
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import Plan, make_plan
from adaptive_drt.tracing.intersect import Pairs, intersect_pairs, nearest_hits
from adaptive_drt.tracing.occluder_culling import Occluders

__all__ = ["SETTINGS", "Watched", "example_scene", "plan_of", "seen_at", "watch"]

SIZE = (288, 176)
SETTINGS = Settings(threads=2)
"""Two threads, whatever the machine has; the picture does not depend on it."""


def example_scene() -> Scene:
    """Two still spheres and one that moves, a floor, a wall, and a light of 1.4 x 1.4 m."""
    red, blue, gold = (0.75, 0.15, 0.11), (0.14, 0.28, 0.75), (0.85, 0.66, 0.14)
    balls = (
        Sphere((-1.7, 0.2, 1.0), 1.0, Material(red), name="Red"),
        Sphere((0.9, 1.6, 1.1), 1.1, Material(blue), name="Blue"),
        Sphere((1.9, -0.9, 0.7), 0.5, Material(gold), Motion((1.1, 0.0, 0.25)), "Moving"),
    )
    grey = Material((0.62, 0.60, 0.57))
    floor = Quad((-12.0, -12.0, 0.0), (24.0, 0.0, 0.0), (0.0, 24.0, 0.0), grey, name="Floor")
    wall = Quad((-4.4, 3.6, 0.0), (8.6, 0.0, 0.0), (0.0, 0.0, 3.0), grey, name="Wall")
    light = QuadLight((-2.4, -2.2, 5.6), (0.7, 0.0, 0.0), (0.0, -0.7, 0.0), (46.0, 44.0, 40.0))
    camera = look_at((0.0, -9.4, 4.4), (0.1, 0.5, 0.75), 44.0, 1)
    shapes = (*balls, floor, wall)
    return Scene(replace(camera, resolution=SIZE), shapes, (light,), (0.02, 0.03, 0.05))


@dataclass
class Watched(ExactRender):
    """An exact render that remembers what it went through.

    Attributes
    ----------
    first_passes : what the first pass found.  first : (3, height, width) its radiance.
    before : (height, width) the errors that it estimated.  frame : the picture in the end.
    """

    def __post_init__(self) -> None:
        """Nothing is remembered yet."""
        super().__post_init__()
        self.first_passes: list[FirstPass] = []
        self.first = self.before = np.zeros(0)
        self.frame: Frame | None = None

    def _enter_first_pass(
        self,
        frame: Frame,
        results: Generator[tuple[int, Any] | None, None, None],
        progress: CallProgress,
    ) -> Generator[float, None, None]:
        def kept() -> Generator[tuple[int, Any] | None, None, None]:
            for result in results:
                if result is not None:
                    self.first_passes.append(result[1][0])
                yield result

        yield from super()._enter_first_pass(frame, kept(), progress)

    def _set_goal(self, frame: Frame) -> Generator[float, None, None]:
        self.frame = frame
        self.first, self.before = self.table(frame.color).copy(), self.table(frame.error).copy()
        yield from super()._set_goal(frame)

    def table(self, values: Array | Mask) -> Array:
        """Of values (..., n) of the frame those of the picture: (..., height, width)."""
        assert self.frame is not None
        whole = values.reshape(*values.shape[:-1], self.frame.height, self.frame.width)
        return whole[..., *self.frame.region_slices]


def plan_of(scene: Scene, **changes: Any) -> Plan:
    """What the scene needs, with some of `SETTINGS` changed."""
    return make_plan(validate(scene), replace(SETTINGS, **changes))


def watch(scene: Scene, **changes: Any) -> tuple[Watched, Film]:
    """Render the scene; returns what was seen on the way, and the film."""
    plan = plan_of(scene, **changes)
    watched, film = Watched(plan, Occluders(plan)), Film(*plan.resolution)
    for _ in watched.run(film):
        pass
    return watched, film


def seen_at(plan: Plan, x: Array, y: Array, time: Array) -> tuple[Array, Array]:
    """Nearest object (n,) and its ray parameter (n,) at picture coordinates and shutter times."""
    count, objects = x.size, plan.object_count
    pairs = Pairs(np.tile(np.arange(count), objects), np.repeat(np.arange(objects), count))
    w = plan.lens.directions(x, y)[:, pairs.pixel]
    t = intersect_pairs(plan, w[..., None], pairs.item, time[pairs.pixel][:, None])[:, 0]
    depth, item = nearest_hits(count, pairs, t)
    return item, depth
