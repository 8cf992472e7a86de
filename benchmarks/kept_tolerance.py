# SPDX-License-Identifier: GPL-3.0-or-later
"""Is the tolerance kept? Errors of random scenes that the error model has not been fitted to.

`--scenes shapes`: the truth is the same renderer at a tenth of the smallest tolerance; the tests
compare it with other renderers. `--scenes lights`: scenes of all kinds of lights and skies; the
truth is `tests/oracle/every_light.py`, which shares no code with the renderer, and whose noise is
taken off in the mean square. Where a few tiny things give most of a picture's light, its samples do
not suffice; the truth is then the renderer at a twentieth of the tolerance. One line for each
scene, and the number of scenes within each tolerance.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "helpers")]

from error_model_renders import true_picture  # noqa: E402

from adaptive_drt.render import render_image  # noqa: E402
from adaptive_drt.scene.description import EnvironmentLight, Scene, SkyLight  # noqa: E402
from adaptive_drt.scene.settings import Settings  # noqa: E402
from random_scenes import random_scene  # noqa: E402

NOISE = 0.7
"""Standard deviation of a pixel of the truth's halves, as a fraction of the smallest tolerance."""
MOST_NOISE, DOUBT, SMALLER = 0.3, 0.05, 0.05
"""Standard error of an error, in tolerances, above which the truth is the renderer itself, also
where the error is beyond the tolerance; and the fraction of the tolerance at which it renders."""
SURE = 2.0
"""Standard errors by which an error must be beyond the tolerance, so that it counts as beyond."""
SLOW = 4.0
"""Factor on the median time of a class of scenes, from which a scene is named as slow."""


def main() -> None:
    """Render the scenes and print their errors, relative to the tolerance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", type=int, nargs="?", default=0, help="the fit uses 400 to 515")
    parser.add_argument("count", type=int, nargs="?", default=100)
    parser.add_argument("--tolerances", type=float, nargs="+", default=[1e-2, 1e-3])
    parser.add_argument("--scenes", choices=("shapes", "lights"), default="shapes")
    parser.add_argument("--seeds", type=int, nargs="+", help="these, in place of a range")
    parser.add_argument("--side", type=int, default=16, help="pixels, of scenes of lights")
    options = parser.parse_args()
    seeds = options.seeds or list(range(options.first, options.first + options.count))
    if options.scenes == "lights":
        compare_lights(seeds, options.tolerances, options.side)
        return
    ratios = []
    for seed in seeds:
        scene = random_scene(seed)
        truth = true_picture(scene, 0.1 * min(options.tolerances))
        mean, row = np.abs(truth).mean(), []
        for tolerance in options.tolerances:
            color = render_image(scene, Settings(tolerance=tolerance, threads=1)).color
            row.append(np.sqrt(((color - truth) ** 2).mean()) / mean / tolerance)
        ratios.append(row)
        print(seed, *(f"{each:.2f}" for each in row), flush=True)
    within = np.array(ratios)
    for tolerance, column in zip(options.tolerances, within.T, strict=True):
        kept = int((column <= 1.0).sum())
        print(f"{tolerance:g}: {kept} of {column.size} within, worst {column.max():.2f}")


def compare_lights(seeds: list[int], tolerances: list[float], side: int) -> None:
    """Render scenes of all kinds of lights, and print their errors beside an oracle's."""
    from light_scenes import light_scene
    from oracle.every_light import sampled_every_light

    print("seed: error over tolerance (its standard error; the stated one; seconds of CPU)")
    print("* where the truth is the renderer at a smaller tolerance")
    found: dict[float, list[tuple[int, float, float, float, str]]] = {t: [] for t in tolerances}
    for seed in seeds:
        scene = light_scene(seed, side)
        truth = sampled_every_light(scene, NOISE * min(tolerances), 1000 + seed, threads=1)
        shown = []
        for tolerance in tolerances:
            began = time.process_time()
            film = render_image(scene, Settings(tolerance=tolerance, threads=1))
            seconds = time.process_time() - began
            error, spread = (each / tolerance for each in truth.relative_error(film.color))
            mark = ""
            if spread > (DOUBT if error > 1.0 else MOST_NOISE):
                best = true_picture(scene, SMALLER * tolerance)
                error = np.sqrt(((film.color - best) ** 2).mean()) / np.abs(best).mean() / tolerance
                spread, mark = SMALLER, "*"
            stated = film.stats["error_estimate"] / tolerance
            found[tolerance].append((seed, error, spread, seconds, class_of(scene)))
            shown.append(f"{error:.2f}{mark} ({spread:.2f}; {stated:.2f}; {seconds:.1f} s)")
        print(f"{seed}: {'  '.join(shown)}  {class_of(scene)}", flush=True)
    for tolerance, rows in found.items():
        summarize(tolerance, rows)


def class_of(scene: Scene) -> str:
    """A scene's class: what the time that it takes depends on."""
    kinds = {type(light) for light in scene.lights}
    sky = "environment" if EnvironmentLight in kinds else "sky" if SkyLight in kinds else "lights"
    things: tuple[Any, ...] = (*scene.shapes, *scene.lights, scene.camera)
    return f"{sky}, {'moving' if any(x.motion is not None for x in things) else 'still'}"


def summarize(tolerance: float, rows: list[tuple[int, float, float, float, str]]) -> None:
    """Print how many scenes are within a tolerance, the worst one, and which ones are slow."""
    within = sum(error <= 1.0 for _, error, *_ in rows)
    sure = sum(error - SURE * spread <= 1.0 for _, error, spread, *_ in rows)
    seed, worst, spread, *_ = max(rows, key=lambda row: row[1])
    print(
        f"{tolerance:g}: {within} of {len(rows)} within ({sure} but for the truth's noise), "
        f"worst {worst:.2f} +- {spread:.2f} of seed {seed}"
    )
    for name in sorted({row[4] for row in rows}):
        times = {row[0]: row[3] for row in rows if row[4] == name}
        middle = float(np.median(list(times.values())))
        slow = [f"{k} ({t:.0f} s)" for k, t in times.items() if t > SLOW * middle]
        print(f"  {name}: {len(times)} scenes, median {middle:.1f} s, slow: {', '.join(slow)}")


if __name__ == "__main__":
    main()
