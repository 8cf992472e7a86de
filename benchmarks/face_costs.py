# SPDX-License-Identifier: GPL-3.0-or-later
"""From which number of flat faces rays cost less than closed forms: writes docs/face-costs.md.

Cubes, fences, blinds, stairs and loose parallelograms over a floor are rendered both ways. Beside
the seconds stand the two numbers that `detection.face_costs` decides by.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "helpers")]

import machine  # noqa: E402
import numpy as np  # noqa: E402

from adaptive_drt.detection import face_costs  # noqa: E402
from adaptive_drt.render import render  # noqa: E402
from adaptive_drt.scene.description import Material, Quads, Scene, SunLight  # noqa: E402
from adaptive_drt.scene.settings import Settings  # noqa: E402
from adaptive_drt.tracing.compile import make_plan  # noqa: E402
from flat_scenes import AREA, SKY, cubes, flat_scene, picket_fence  # noqa: E402

SIZE = (48, 36)
TOLERANCES = (0.01, 0.001)
SUN = SunLight((-0.4, 0.3, -0.86), (3.0, 3.0, 3.0))
LIGHTS = {"area": AREA, "sun": SUN, "sky": SKY}


@dataclass(frozen=True)
class Row:
    """One scene: what it is decided by, and seconds by tolerance, None where it was stopped."""

    name: str
    light: str
    faces: int
    above: float
    work: float
    closed: dict[float, float | None]
    traced: dict[float, float | None]


def main() -> None:
    """Render the scenes and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--limit", type=float, default=20.0, help="seconds after which to stop")
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "face-costs.md")
    options = parser.parse_args()
    machine_text, rows = machine.describe(), []
    for name, faces in _shapes():
        for light, lamp in LIGHTS.items():
            rows.append(
                _row(name, light, flat_scene(faces, lamp, SIZE), faces.count, options.limit)
            )
            print(rows[-1], flush=True)
    options.page.write_text(_page(rows, machine_text, options.limit), encoding="utf-8")


def _shapes() -> list[tuple[str, Quads]]:
    boxes = [(f"{count} cubes", cubes(1, count)) for count in (3, 5, 10, 20, 40, 300)]
    bars = [
        (f"fence of {count} bars", picket_fence(count, part))
        for count, part in ((10, 0.3), (30, 0.3), (60, 0.2))
    ]
    slats = [(f"{count} slats", _slats(count)) for count in (10, 30, 60)]
    steps = [(f"{count} stairs", _stairs(count)) for count in (10, 30)]
    loose = [(f"{count} loose faces", _loose(count)) for count in (30, 100, 300)]
    return boxes + bars + slats + steps + loose


def _slats(count: int) -> Quads:
    z, zero = 0.1 + 2.0 * np.arange(count) / count, np.zeros(count)
    return _quads((zero - 1.5, zero, z), (zero + 3.0, zero, zero), (zero, zero + 0.03, zero + 0.03))


def _stairs(count: int) -> Quads:
    k, zero, height = np.arange(count), np.zeros(count), 2.0 / count
    across, up = (zero + 2.0, zero, zero), (zero, zero, zero + height)
    rises = _quads((zero - 1.0, height * k - 1.0, height * k), across, up)
    steps = _quads(
        (zero - 1.0, height * k - 1.0, height * (k + 1)), across, (zero, zero + height, zero)
    )
    both = [
        np.concatenate([getattr(part, name) for part in (rises, steps)], axis=1)
        for name in Quads.arrays
    ]
    return _quads(*both)


def _loose(count: int) -> Quads:
    rng = np.random.default_rng(count)
    corner = rng.uniform([-2.0, -2.0, 0.1], [2.0, 2.0, 2.0], (count, 3)).T
    return _quads(corner, *rng.normal(0.0, 1.0 / math.sqrt(count), (2, 3, count)))


def _quads(corner: object, u: object, v: object) -> Quads:
    arrays = [np.array(each, dtype=np.float64) for each in (corner, u, v)]
    none = np.zeros(arrays[0].shape[1], dtype=np.int64)
    return Quads(*arrays, none, (Material((0.6, 0.6, 0.6)),))


def _row(name: str, light: str, scene: Scene, faces: int, limit: float) -> Row:
    plan = make_plan(scene, Settings(), reduced=True)
    around = [face_costs.surrounds(plan, each) for each in plan.lights]
    found = face_costs.detected(plan)
    assert found is not None  # the floor is in the middle of the picture
    above = face_costs.faces_above_horizons(*found, around) if any(around) else 0.0
    work = face_costs.work_in_cut_pixels(*found, around)
    closed, traced = ({t: _seconds(scene, t, rays, limit) for t in TOLERANCES} for rays in (0, 1))
    return Row(name, light, faces, above, work, closed, traced)


def _seconds(scene: Scene, tolerance: float, rays: int, limit: float) -> float | None:
    """Processor seconds of a render with all faces as meshes, or none; None where it is stopped."""
    began = time.process_time()
    with mock.patch("adaptive_drt.render.rays_cost_less_than_faces", lambda *_: bool(rays)):
        steps = render(scene, Settings(tolerance=tolerance, threads=1))
        for _ in steps:
            if time.process_time() - began > limit:
                steps.close()
                return None
    return time.process_time() - began


def _page(rows: list[Row], measured_on: str, limit: float) -> str:
    lines = [
        "<!-- Written by benchmarks/face_costs.py. -->",
        "# Flat faces: closed forms or rays",
        "",
        "Seconds of processor time of scenes of flat faces with light in closed form, and with the",
        "faces as a mesh that rays are traced against. *Above*: mean number of faces above the",
        "horizons of points, under a sky. *Work*: mean of the squares of the number of faces seen",
        "in a pixel with outlines, times that of those that may shade it, under other lights.",
        "Rays are used from 12 and from 2,000 at 1 %, and from 38 and from 40,000 at 0.1 %",
        "(`adaptive_drt/detection/face_costs.py`).",
        "",
        f"Measured on: {measured_on}",
        f"{SIZE[0]} x {SIZE[1]} pixels, one thread; - is more than {limit:g} s.",
        "To repeat it: `python benchmarks/face_costs.py`.",
        "",
        "|  | light | faces | above | work | closed, 1 % | rays | closed, 0.1 % | rays |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        times = [
            "-" if each[t] is None else f"{each[t]:.2g}"
            for t in TOLERANCES
            for each in (row.closed, row.traced)
        ]
        above = f"{row.above:.0f}" if row.light == "sky" else ""
        work = "" if row.light == "sky" else f"{row.work:.0f}"
        lines.append(
            f"| {row.name} | {row.light} | {row.faces} | {above} | {work} | {' | '.join(times)} |"
        )
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    main()
