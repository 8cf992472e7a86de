# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the time goes: seconds by stage, the cost of derivatives, b, and a profile.

    python benchmarks/stages.py [--scenes "quad light" ...] [--size 300 300] [--threads 1]

Stages are summed over threads. b is the time of a pixel traced with derivatives and detection over
that of a plainly traced one (paper, section 2.2), the median of several ratios with its
interquartile range; detection is the same code in both methods. `--page` writes what is printed
to a file; `make profile` writes docs/profile.md.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import machine
from bench_scenes import SCENES, bench_scene

from adaptive_drt.cost_model import measure_pixel_costs
from adaptive_drt.parallel import pool as crew
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import validate
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.occluder_culling import Occluders

TOLERANCES = (1e-2, 1e-3, 1e-4)
RUNS = 3
"""Renders, of which the quickest counts."""
FEW = (30, 30)
"""Pixels of the picture that shows what does not hang on their number."""
SHOWN = 14
"""Functions of a profile."""

HEAD = """\
<!-- Written by benchmarks/stages.py: `make profile`. -->
# Where the time goes

Measured on: {machine}. Seconds, {width} x {height} pixels, {threads} thread(s), the quickest of
{runs} renders; stages are summed over threads.
"""

FLAT = """\
## The profile

Functions by their own time, NumPy's C functions counted to who calls them, {width} x {height}
pixels at {tolerance:g}. (A profiler slows calls, so the shares of small functions are too large.)
"""


def quickest(scene, settings):
    """The film of the quickest of some renders."""
    films = [render_image(scene, settings) for _ in range(RUNS)]
    return min(films, key=lambda film: film.stats["seconds"]["total"])


def stages(name, size, threads):
    """A table of one scene's stages."""
    scene = bench_scene(name, *size)
    films = [quickest(scene, Settings(tolerance=t, threads=threads)) for t in TOLERANCES]
    small = quickest(bench_scene(name, *FEW), Settings(tolerance=TOLERANCES[0], threads=threads))
    plan = make_plan(validate(scene), Settings(method="RAYS"))
    costs = measure_pixel_costs(plan, Occluders(plan))
    lines = [
        f"## {name}\n",
        f"b = {costs.b:.2f} (spread {costs.spread:.2f}); "
        f"{small.stats['seconds']['total']:.3f} s at {FEW[0]} x {FEW[1]} pixels, "
        f"tolerance {TOLERANCES[0]:g}.\n",
        "| stage | " + " | ".join(f"{t:g}" for t in TOLERANCES) + " |",
        "|---|" + "---|" * len(TOLERANCES),
    ]
    named = {stage: None for film in films for stage in film.stats["seconds"]}
    for stage in named:
        cells = (f"{film.stats['seconds'].get(stage, 0.0):.3f}" for film in films)
        lines.append(f"| {stage} | " + " | ".join(cells) + " |")
    cells = (f"{film.samples.mean():.2f}" for film in films)
    lines.append("| points a pixel | " + " | ".join(cells) + " |\n")
    return lines


def profile(name, size, tolerance):
    """A table of the functions that take most, and their shares."""
    kept, watch = crew.Call.here, cProfile.Profile()
    scene, settings = bench_scene(name, *size), Settings(tolerance=tolerance, threads=1)
    render_image(scene, settings)
    crew.Call.here = lambda call: watch.runcall(kept, call)
    try:
        render_image(scene, settings)
    finally:
        crew.Call.here = kept
    stats = pstats.Stats(watch)
    own, calls, total = {}, {}, 0.0
    for (file, _, function), (_, count, seconds, _, callers) in stats.stats.items():
        total += seconds
        ours = "adaptive_drt" in file
        for who, (_, _, part, _) in callers.items() if not ours else ():
            if "adaptive_drt" in who[0]:
                key = f"{Path(who[0]).stem}.{who[2]}"
                own[key] = own.get(key, 0.0) + part
        if ours:
            key = f"{Path(file).stem}.{function}"
            own[key], calls[key] = own.get(key, 0.0) + seconds, calls.get(key, 0) + count
    every = sum(count for count, *_ in stats.stats.values())
    lines = [f"{name}: {every:,} calls.\n", "| function | calls | share |", "|---|---|---|"]
    most = sorted(own, key=own.get, reverse=True)[:SHOWN]
    lines += [f"| {key} | {calls.get(key, 0):,} | {own[key] / total:.1%} |" for key in most]
    return [*lines, ""]


def main() -> None:
    """Print a table for each scene, and profiles."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--size", nargs=2, type=int, default=(300, 300))
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--profiled", nargs="*", choices=SCENES, default=["quad light"])
    parser.add_argument("--page", type=Path, help="where to write as well")
    given = parser.parse_args()
    width, height = given.size
    text = [
        HEAD.format(
            machine=machine.describe(),
            width=width,
            height=height,
            threads=given.threads,
            runs=RUNS,
        )
    ]
    print(text[0])
    for name in given.scenes:
        text += stages(name, given.size, given.threads)
        print("\n".join(text[-12:]), flush=True)
    text.append(FLAT.format(width=width, height=height, tolerance=TOLERANCES[0]))
    for name in given.profiled:
        text += profile(name, given.size, TOLERANCES[0])
    print("\n".join(text[-SHOWN - 5 :]))
    if given.page:
        given.page.write_text("\n".join(text).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
