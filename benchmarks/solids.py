# SPDX-License-Identifier: GPL-3.0-or-later
"""Balls and sticks, and thermal ellipsoids, under a softbox, ours beside Mitsuba: CPU time to an
error.

    python benchmarks/solids.py [--cases sticks ...] [--sizes 80x60] [--page FILE]

Both render on one thread. Mitsuba's own shapes are used: spheres, cylinders (whose ends are within
balls) and ellipsoids. How its times are found says `many_spheres`.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import machine
import numpy as np
from many_spheres import LADDER, TOLERANCES, beside
from sticks import LIGHTS, random_sticks, scene_of

from adaptive_drt.scene.description import Ellipsoid, Material, Shape, vector_of

BALLS, ELLIPSOIDS = 500, 100
"""Numbers of balls, and of sticks, and of the ellipsoids."""

HEAD = """\
<!-- Written by benchmarks/solids.py: `python benchmarks/solids.py --page docs/solids.md`. -->
# Balls, sticks and ellipsoids

Measured on: {machine}. CPU seconds of one thread each; "error" is measured, root mean square over
the mean. Mitsuba {version}, with shapes of its own: seconds that it takes to the tolerance (a *
marks extrapolation beyond {most:,} samples a pixel). "faster" is Mitsuba's time over ours.

| scene | pixels | tolerance | ours, s | error | Mitsuba, s | faster |
|---|---|---|---|---|---|---|"""
TAIL = """
Where many sticks lie before the light, pixels are sampled by rays through embree's cones and
ellipsoids: at 1 % almost all pixels with outlines, and closed forms take a third of the time. In
closed form alone, as before, 500 balls and 500 sticks took 45 s for 24 x 18 pixels at 1 %: a point
sees up to dozens of sticks before the light, whose arcs are intersected in small groups of points.
"""


def plate() -> list[Shape]:
    """Ellipsoids in a box, none of which touches another one."""
    rng = np.random.default_rng(0)
    place: list[np.ndarray] = []
    while len(place) < ELLIPSOIDS:
        new = rng.uniform((-3.0, -3.0, 0.4), (3.0, 3.0, 2.6))
        if all(np.linalg.norm(new - each) > 0.65 for each in place):
            place.append(new)
    shapes: list[Shape] = []
    for center in place:
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.12, 0.32, 3)
        color = Material(vector_of(rng.uniform(0.2, 0.8, 3)))
        shapes.append(Ellipsoid(vector_of(center), *(vector_of(each) for each in axes.T), color))
    return shapes


CASES = {
    "sticks": (f"{BALLS} balls, {BALLS} sticks", lambda: random_sticks(BALLS)),
    "ellipsoids": (f"{ELLIPSOIDS} ellipsoids", plate),
}


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--sizes", nargs="+", default=["80x60"], help="as 80x60, 4:3")
    parser.add_argument("--tolerances", nargs="+", type=float, default=list(TOLERANCES))
    parser.add_argument("--page", type=Path, help="where to write as well")
    given = parser.parse_args()
    about, rows = machine.describe(), []
    for case in given.cases:
        name, shapes = CASES[case]
        for size in given.sizes:
            scene = scene_of(shapes(), LIGHTS["softbox"], int(size.split("x")[0]))
            scene = replace(scene, background=(0.0, 0.0, 0.0))
            found, version = beside(scene, given.tolerances)
            for tolerance, (_, cells) in zip(given.tolerances, found, strict=True):
                width, height = scene.camera.resolution
                words = [name, f"{width} x {height}", f"{tolerance:g}", *cells]
                rows.append(f"| {' | '.join(words)} |")
                print(rows[-1], flush=True)
            if given.page:
                text = HEAD.format(machine=about, version=version, most=LADDER[-1])
                given.page.write_text("\n".join([text, *rows]) + "\n" + TAIL, encoding="utf-8")


if __name__ == "__main__":
    main()
