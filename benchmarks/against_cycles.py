# SPDX-License-Identifier: GPL-3.0-or-later
"""Our pictures beside Cycles' of scenes that scripts make in Blender: writes docs/cycles.md.

    python benchmarks/against_cycles.py [--page docs/cycles.md] [--only WORD…] [--samples 512]
    python benchmarks/against_cycles.py --random SEED… [--extras] [--keep FOLDER]

Direct light, 64 x 48 pixels, the same box filter. Cycles renders twice, with two seeds; its mean
has `--samples` twice, and what the two differ by is its noise, which is taken off in the mean
square. Each scene runs in a process of its own; one that fails or takes too long is a fault.
Cycles does not move lights within the shutter: where ours move, 32 of its pictures are averaged.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import machine
from against_extras import EXTRAS
from against_pictures import SURE
from against_scenes import LIGHTS, MESHES, SIZE, SKIES

ONE = Path(__file__).resolve().parent / "against_one.py"
OF_LIGHTS, OF_MESHES, OF_MEANS = 0.005, 0.007, 0.001
"""Largest root mean squares, and difference of means, relative, of scenes of the page."""
OF_RANDOM, OF_RANDOM_MEANS, OF_ALPHA = 0.013, 0.003, 0.01
"""The same of random scenes at a tolerance of 1 %, and of their alpha."""
SECONDS = 60.0
"""Processor seconds of ours above which a random scene counts as too slow."""
MOST_SECONDS = 300.0
"""Time after which a scene is given up."""
COARSE, FINE = 1e-2, 3e-3
"""Tolerances of ours. The page is judged at the finer one, random scenes at the other."""

HEAD = """\
<!-- Written by benchmarks/against_cycles.py: `python benchmarks/against_cycles.py --page ...`. -->
# Beside Cycles

    .venv/bin/python benchmarks/against_cycles.py --page docs/cycles.md

Measured on: {machine}; Blender {version}. {width} x {height} pixels, direct light, box filter,
{samples} samples of Cycles' a pixel. RMS: difference of the pictures without Cycles' own noise,
over the mean; noise: that of half of the samples. Seconds: processor seconds of ours through
Blender's F12, export included. Within: at 0.3 %, RMS at most 0.5 % (lights) or 0.7 % (meshes), and
means within 0.1 %, each but for three standard errors that Cycles' noise gives it.

| scene | RMS at 1 % | at 0.3 % | noise | means | seconds at 1 % | at 0.3 % | within |
|---|---|---|---|---|---|---|---|
"""


NOTES = "\n## "
"""Begins what is written by hand."""


def run(name: str, *options: str) -> dict[str, Any]:
    """What `against_one.py` finds; "error" where it fails."""
    command = [sys.executable, str(ONE), name, *options]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=MOST_SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return {"error": f"over {MOST_SECONDS:g} s"}
    said = [line for line in done.stdout.splitlines() if line.startswith("@@")]
    if not said:
        return {"error": (done.stderr or done.stdout)[-2000:]}
    found: dict[str, Any] = json.loads(said[-1][2:])
    if "Traceback" in done.stderr:
        found["error"] = done.stderr[-2000:]
    return found


def is_within(figures: dict[str, float], rms: float, means: float) -> bool:
    """Whether a difference is small enough."""
    return (
        figures["least_rms"] <= rms
        and abs(figures["means"]) <= means + SURE * figures["means_noise"]
    )


def row(name: str, found: dict[str, Any], rms: float) -> str:
    """A line of the table."""
    if "error" in found:
        return f"| {name} | | | | | | | NO: {found['error'].strip().splitlines()[-1][:80]} |"
    coarse, fine = found["figures"]
    return (
        f"| {name} | {100 * coarse['rms']:.2f} % | {100 * fine['rms']:.2f} % "
        f"| {100 * fine['noise']:.2f} % | {100 * fine['means']:+.3f} % "
        f"| {coarse['seconds']:.1f} | {fine['seconds']:.1f} "
        f"| {'yes' if is_within(fine, rms, OF_MEANS) else 'NO'} |"
    )


def page_rows(only: list[str], samples: int) -> list[str]:
    """All scenes whose names hold one of the words, one after another."""
    jobs = [(name, name, OF_LIGHTS, ()) for name in [*LIGHTS, *SKIES]]
    jobs += [(f"{name}, moving", name, OF_LIGHTS, ("--moving",)) for name in LIGHTS]
    jobs += [(name, name, OF_MESHES, ()) for name in MESHES]
    rows = []
    for title, name, rms, options in jobs:
        if only and not any(word in title for word in only):
            continue
        found = run(
            name, *options, "--samples", str(samples), "--tolerances", str(COARSE), str(FINE)
        )
        rows.append(row(title, found, rms))
        print(rows[-1], flush=True)
    return rows


def random_scenes(jobs: list[tuple[str, ...]], samples: int, keep: Path | None) -> int:
    """Render random scenes and print a line for each; returns how many are off.

    jobs : of each its seed, and more options.
    """
    off = 0
    for seed, *more in jobs:
        kept = ("--keep", str(keep / "-".join([seed, *more[1:]]))) if keep else ()
        options = ("--random", "--samples", str(samples), "--tolerances", str(COARSE))
        found = run(seed, *options, *kept, *more)
        if "error" in found:
            off += 1
            print(f"{seed}: ERROR {found['error']}\n  {found.get('said')}", flush=True)
            continue
        figures = found["figures"][0]
        good = is_within(figures, OF_RANDOM, OF_RANDOM_MEANS) and figures["alpha"] <= OF_ALPHA
        good = good and figures["seconds"] < SECONDS
        off += not good
        numbers = " ".join(f"{key} {value:.2g}" for key, value in figures.items())
        print(f"{seed}: {'ok' if good else 'OFF'} {numbers}\n  {found['said']}", flush=True)
        for name, reason in found["issues"]:
            print(f"    {name}: {reason}", flush=True)
    print(f"{off} of {len(jobs)} are off", flush=True)
    return off


def notes(page: Path) -> str:
    """The sections that are written by hand below the table of a page, to be kept."""
    old = page.read_text(encoding="utf-8") if page.exists() else ""
    _, heading, text = old.partition(NOTES)
    return heading + text


def main() -> None:
    """Render and print, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page", type=Path)
    parser.add_argument("--only", nargs="+", default=[], help="words in the names of scenes")
    parser.add_argument("--samples", type=int, default=512, help="of each of Cycles' two pictures")
    parser.add_argument("--random", type=int, nargs="+", metavar="SEED")
    parser.add_argument("--extras", action="store_true", help="a scene for each, of each seed")
    parser.add_argument("--keep", type=Path, help="save random scenes and pictures here")
    given = parser.parse_args()
    if given.random:
        jobs: list[tuple[str, ...]] = [(str(seed),) for seed in given.random]
        if given.extras:
            jobs = [(seed, "--extra", name) for (seed,) in jobs for name in EXTRAS]
        raise SystemExit(random_scenes(jobs, given.samples, given.keep) > 0)
    import bpy

    head = HEAD.format(
        machine=machine.describe(), version=bpy.app.version_string, width=SIZE[0], height=SIZE[1],
        samples=2 * given.samples,
    )  # fmt: skip
    print(head, flush=True)
    rows = page_rows(given.only, given.samples)
    if given.page:
        given.page.write_text(head + "\n".join(rows) + "\n" + notes(given.page), encoding="utf-8")


if __name__ == "__main__":
    main()
