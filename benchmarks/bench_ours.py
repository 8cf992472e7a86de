# SPDX-License-Identifier: GPL-3.0-or-later
"""Our own renders of the benchmark's scenes, timed as the peers' are.

python benchmarks/bench_ours.py SCENE WIDTH HEIGHT FOLDER SECONDS [--tolerances 1e-2,1e-3]
"""

from __future__ import annotations

import sys
import time
from dataclasses import fields
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from bench_ladder import climb, parse
from bench_scenes import bench_scene

from adaptive_drt.parallel.pool import worker_pool
from adaptive_drt.render import render_image
from adaptive_drt.scene.film import Film
from adaptive_drt.scene.settings import Settings

__all__ = ["settings_for"]

THREADS = 2
PATIENCE = 10.0
"""Seconds that workers may take to load before the first render, which in Blender they would not
be there for."""
TOLERANCES = (1e-2, 1e-3, 1e-4)


def settings_for(method: str, tolerance: float, threads: int = THREADS, **more: Any) -> Settings:
    """Settings of one of our methods; for RAYS as many rays as may bring about that error."""
    if method == "RAYS":
        rays = 16 * max(round(1e-2 / tolerance), 1)
        more |= {name: rays for name in ("light_rays", "time_rays", "pixel_rays")}
    elif "tolerance" in {f.name for f in fields(Settings)}:
        more["tolerance"] = tolerance
    return Settings(method=method, threads=threads, **more)


def main() -> None:
    """Climb the ladder of tolerances."""
    given = parse(__doc__ or "", "--tolerances", "--method")
    scene = bench_scene(given.scene, given.width, given.height)
    said = given.tolerances
    rungs = tuple(float(x) for x in said.split(",")) if said else TOLERANCES

    def render(tolerance: float, seed: int) -> Film:
        film = render_image(scene, settings_for(given.method or "EXACT", tolerance, seed=seed))
        film.pixels("Combined")  # what goes into Blender's image is part of a render
        return film

    def read(film: Film) -> np.ndarray:
        return film.color

    worker_pool.start_workers(THREADS - 1)
    end = time.monotonic() + PATIENCE
    while not worker_pool.ready_count and time.monotonic() < end:
        time.sleep(0.01)
    climb(render, rungs, given, "Adaptive DRT", read, growth=0.0)


if __name__ == "__main__":
    main()
