# SPDX-License-Identifier: GPL-3.0-or-later
"""Where embree finds candidate occluders sooner than arrays do: writes docs/crossover.md.

Small spheres over a floor, 10 to 20,000 of them, under a small and a large quad light, rendered
with both accelerators in turn.
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import machine
import numpy as np
from paper_scenes import look_at

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Material, Quad, QuadLight, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import EMBREE_CROSSOVER

ROOT = Path(__file__).resolve().parent.parent
COUNTS = (10, 30, 100, 300, 1_000, 2_000, 3_000, 5_000, 10_000, 20_000)
LIGHTS = {"small": 0.1, "large": 1.0}
"""Half the light's side, metres."""
COVER = 0.35
"""Share of the floor that the spheres' discs would cover side by side, whatever their number."""
SIDE = 10.0
"""Metres, the floor's side."""
GIVE_UP = 5.0
"""Seconds: an accelerator that took longer is not tried with more spheres."""
SETTINGS = Settings(method="RAYS", use_edges=False, use_motion=False, light_rays=16)


@dataclass(frozen=True)
class Point:
    """Best seconds of both accelerators on one scene, inf where it was not tried any more.

    `differ` counts the pixels in which the pictures differ, None where there is only one.
    """

    count: int
    light: str
    arrays: float
    embree: float
    differ: int | None


def crowd(count: int, half: float, size: int) -> Scene:
    """`count` small spheres over a floor, the same on every machine."""
    rng = np.random.default_rng(count)
    radius = SIDE * math.sqrt(COVER / (math.pi * count))
    places = rng.uniform(
        (-0.5 * SIDE, -0.5 * SIDE, radius), (0.5 * SIDE, 0.5 * SIDE, 1.5), (count, 3)
    )
    sizes = radius * rng.uniform(0.5, 1.0, count)
    balls = [
        Sphere(tuple(map(float, place)), float(r), Material((0.7, 0.5, 0.3)))
        for place, r in zip(places, sizes, strict=True)
    ]
    low = -0.6 * SIDE
    floor = Quad((low, low, 0.0), (1.2 * SIDE, 0.0, 0.0), (0.0, 1.2 * SIDE, 0.0))
    light = QuadLight((-1.0, -1.0, 6.0), (half, 0.0, 0.0), (0.0, -half, 0.0), (20.0, 20.0, 20.0))
    camera = look_at((0.0, -11.0, 8.0), (0.0, -0.3, 0.3), 40.0, size)
    return Scene(camera, (*balls, floor), (light,))


def measure(count: int, light: str, size: int, rounds: int, names: tuple[str, ...]) -> Point:
    """Render one scene with the named accelerators in turn."""
    scene = crowd(count, LIGHTS[light], size)
    best = {"ARRAYS": math.inf, "EMBREE": math.inf}
    films = {}
    for turn in range(rounds):
        for name in names:
            if turn and best[name] > GIVE_UP:
                continue
            films[name] = render_image(scene, replace(SETTINGS, accelerator=name))
            best[name] = min(best[name], films[name].stats["seconds"]["total"])
    differ = None
    if len(films) == len(best):
        one, two = films.values()
        unlike = (one.color != two.color).any(axis=0) | (one.mask != two.mask).any(axis=0)
        differ = int(unlike.sum())
    return Point(count, light, best["ARRAYS"], best["EMBREE"], differ)


def measure_all(counts: list[int], size: int, rounds: int) -> list[Point]:
    """All scenes; what has become too slow for a light is left out from there on."""
    points = []
    for light in LIGHTS:
        names: tuple[str, ...] = ("ARRAYS", "EMBREE")
        for count in counts:
            point = measure(count, light, size, rounds, names)
            points.append(point)
            print(point, flush=True)
            names = tuple(n for n in names if getattr(point, n.lower()) <= GIVE_UP)
            if not names:
                break
    return points


def crossing(points: list[Point]) -> str:
    """Between which counts embree begins to win for good, in words."""
    last = max((i for i, p in enumerate(points) if p.arrays <= p.embree), default=-1)
    if last < 0:
        return f"embree wins from {points[0].count:,} spheres on, the fewest that were tried"
    if last + 1 == len(points):
        return f"arrays win up to {points[last].count:,} spheres, the most that were tried"
    return f"embree wins beyond {points[last].count:,} to {points[last + 1].count:,} spheres"


def compose(points: list[Point], about: str, size: int, rounds: int) -> str:
    """The page."""
    lines = [
        "<!-- Written by benchmarks/crossover.py. -->",
        "# Arrays or embree",
        "",
        "Who finds the candidate occluders sooner: the tracer's own shaft culling over arrays, or",
        f"embree. Random small spheres over a floor, {size} x {size}, order 2, penumbrae only; the",
        "spheres shrink as their number grows, so that they always cover the same share of the",
        f"floor. Lights: squares of side {2 * LIGHTS['small']:g} m (small) and "
        f"{2 * LIGHTS['large']:g} m (large), 6 m up.",
        "",
        f"Measured on: {about}.",
        f"Whole renders in turn, best of {rounds}. To repeat it: `python benchmarks/crossover.py`.",
        "",
        "| spheres | light | arrays, s | embree, s | arrays / embree | pixels that differ |",
        "|---|---|---|---|---|---|",
    ]
    for p in points:
        both = math.isfinite(p.arrays) and math.isfinite(p.embree)
        ratio = f"{p.arrays / p.embree:.2f}" if both else ""
        differ = "" if p.differ is None else f"{p.differ:,}"
        cells = (f"{p.count:,}", p.light, _seconds(p.arrays), _seconds(p.embree), ratio, differ)
        lines.append("| " + " | ".join(cells) + " |")
    lines += ["", f"A blank was not tried: the count before had taken more than {GIVE_UP:g} s.", ""]
    for light in LIGHTS:
        said = crossing([p for p in points if p.light == light])
        lines.append(f"- {light.capitalize()} light: {said}.")
    lines += [
        "",
        f"`adaptive_drt/tracing/compile.py` has `EMBREE_CROSSOVER = {EMBREE_CROSSOVER:_}`.",
        "",
    ]
    if any(p.differ for p in points):
        lines += [
            "The pictures are to be the same to the last bit, and some are not: embree leaves out",
            "occluders there. Until it finds them all, the constant is not to be lowered.",
            "",
        ]
    return "\n".join(lines)


def _seconds(seconds: float) -> str:
    return f"{seconds:.3f}" if math.isfinite(seconds) else ""


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description="Where embree beats arrays.")
    parser.add_argument("--size", type=int, default=300, help="pixels, width and height")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--most", type=int, default=COUNTS[-1], help="spheres at most")
    parser.add_argument("--docs", type=Path, default=ROOT / "docs", help="where to write")
    given = parser.parse_args()
    about = machine.describe()
    points = measure_all([n for n in COUNTS if n <= given.most], given.size, given.rounds)
    text = compose(points, about, given.size, given.rounds)
    given.docs.mkdir(parents=True, exist_ok=True)
    (given.docs / "crossover.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
