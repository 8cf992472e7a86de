# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the time goes: seconds by stage, and the cost of derivatives, b (`make profile`).

    python benchmarks/stages.py [--scenes "quad light" ...] [--size 300 300] [--threads 1]

Stages are summed over threads. b is what one ray with its derivatives takes over one without
(paper, section 2.2), measured by method RAYS on the same scene.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bench_scenes import SCENES, bench_scene

from adaptive_drt.render import render_image
from adaptive_drt.settings import Settings

TOLERANCES = (1e-2, 1e-3, 1e-4)
RUNS = 3
"""Renders, of which the quickest counts."""


def quickest(scene, settings):
    """The film of the quickest of some renders."""
    films = [render_image(scene, settings) for _ in range(RUNS)]
    return min(films, key=lambda film: film.stats["seconds"]["total"])


def main() -> None:
    """Print a table for each scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--size", nargs=2, type=int, default=(300, 300))
    parser.add_argument("--threads", type=int, default=1)
    given = parser.parse_args()
    for name in given.scenes:
        scene = bench_scene(name, *given.size)
        films = [quickest(scene, Settings(tolerance=t, threads=given.threads)) for t in TOLERANCES]
        few = Settings(method="RAYS", light_rays=1, time_rays=1, pixel_rays=1)
        b = render_image(scene, few).stats["b"]
        print(
            f"\n{name}, {given.size[0]} x {given.size[1]}, {given.threads} thread(s); b = {b:.2f}"
        )
        print(f"{'tolerance':32}" + "".join(f"{t:>10g}" for t in TOLERANCES))
        stages = {stage: None for film in films for stage in film.stats["seconds"]}
        for stage in stages:
            print(
                f"{stage:32}"
                + "".join(f"{film.stats['seconds'].get(stage, 0.0):10.3f}" for film in films)
            )
        shaded = "".join(f"{film.samples.mean():10.2f}" for film in films)
        print(f"{'points a pixel':32}{shaded}")


if __name__ == "__main__":
    main()
