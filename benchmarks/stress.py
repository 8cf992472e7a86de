# SPDX-License-Identifier: GPL-3.0-or-later
"""The long version of the tests of stability: writes docs/stability.md.

A million random configurations through the kernels, a thousand hostile scenes rendered in every
way, scenes moved, scaled, turned and mirrored, and masks on adversarial scenes.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path

import machine
import stress_scenes
from stress_scenes import Found

PAGE = Path(__file__).resolve().parent.parent / "docs" / "stability.md"
FAULTS_SHOWN = 20

HEAD = """\
# Stability

What was tried to break the numbers, the worst that was found with the seeds that show it, and
what is promised. `make stress` writes this page; `make test` runs a smaller set of all of it.

Run on {machine}, from seed {seed}, in {minutes:.0f} minutes.
"""

PROMISES = """\
## What is promised
- Any scene at all renders to finite numbers, or a message says why its camera forms no picture.
  What cannot be rendered (a number that is none, a shape without a size) is left out and named.
- No pixel is brighter than all area lights together and the background.
- The picture does not hang on where, how large or how turned the scene is: to 1e-9 of its mean, and
  to 1e-6 after a move by a million times its size (which rounds every coordinate by 1e-10 of it).
- Coordinates up to 1e30 m, sizes down to 1e-60 m, and scenes scaled by any power of two between
  2^-130 and 2^40 come out the same to the last bit.
- The mask leaves out no pixel that depends on a domain, down to 1e-12 of a radius from tangency.
- What lies within 2^-40 (1e-12) of the distance from the camera of a surface, of a light's plane
  or of the horizon counts as lying on it.

## What is not promised
- Of two surfaces of different colours in one and the same place, which one is seen: the first in
  the list where both lie at the very same depth, else rounding decides.
- Under method RAYS, round lights have no coordinates of their own: turning the scene takes other
  sample points of them, so penumbrae differ by their sampling error.
- Sizes beyond those above, and numbers of light beyond float32's range: images clip them.
"""


def run_all(work: Callable[[int], Found], seeds: range, workers: int) -> list[Found]:
    """What each seed shows, in order."""
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        return list(pool.map(work, seeds, chunksize=4))


def table(found: list[Found]) -> str:
    """The largest of each figure, and the seed that shows it."""
    lines = ["| | worst | seed |", "|---|---|---|"]
    for name in dict.fromkeys(name for each in found for name in each.figures):
        worst = max((each for each in found if name in each.figures), key=lambda f: f.figures[name])
        lines.append(f"| {name} | {worst.figures[name]:.2g} | {worst.seed} |")
    return "\n".join(lines)


def faults(found: list[Found]) -> str:
    """The faults as a list, or that there was none."""
    lines = [f"- seed {each.seed}: {fault}" for each in found for fault in each.faults]
    rest = len(lines) - FAULTS_SHOWN
    if rest > 0:
        lines = [*lines[:FAULTS_SHOWN], f"- and {rest} more"]
    return "\n".join(lines) or "No fault."


def hostile_part(seeds: range, workers: int) -> tuple[str, int]:
    found = run_all(stress_scenes.hostile, seeds, workers)
    renders = int(sum(each.figures.get("renders", 0) for each in found))
    refused = sum(bool(each.figures.get("refused")) for each in found)
    text = (
        "## Hostile scenes\n"
        "Random scenes in which one to four things went wrong: sizes of zero, denormals, 1e29 m, "
        "copies in one place, a sphere around a light, a light around the camera, motion through "
        "either, 0 to 1e30 W, lenses and pixels of any shape. Each is rendered "
        f"{', '.join(stress_scenes.WAYS)}.\n\n"
        f"{len(seeds)} scenes, {renders} renders, {refused} cameras refused with a message. "
        f"NaN, infinity, exceptions, warnings, light from nowhere: {faults(found)}\n"
    )
    return text, sum(len(each.faults) for each in found)


def invariance_part(seeds: range, workers: int) -> tuple[str, int]:
    found = run_all(stress_scenes.invariance, seeds, workers)
    text = (
        "## Changes of the whole scene\n"
        f"{len(seeds)} random scenes; the pictures' relative RMSE.\n\n{table(found)}\n\n"
        f"{faults(found)}\n"
    )
    return text, sum(len(each.faults) for each in found)


def mask_part(seeds: range, workers: int) -> tuple[str, int]:
    found = run_all(stress_scenes.adversarial, seeds, workers)
    names = dict.fromkeys(name.split(":")[0] for each in found for name in each.figures)
    rows = []
    for name in sorted(names):
        depend, flagged = (
            sum(each.figures.get(f"{name}:{what}", 0.0) for each in found)
            for what in ("depend", "flagged")
        )
        rows.append(f"| {name} | {depend:.0f} | {flagged:.0f} |")
    lines = "\n".join(rows)
    text = (
        "## The mask on adversarial scenes\n"
        "Outlines, shadows and paths that miss or meet a pixel's ray, a light or each other by "
        "1e-3 down to 1e-12 of a radius, tiny occluders, contact; against an oracle in extended "
        f"precision that shares no code with the tracer.\n\n{len(seeds)} scenes.\n\n"
        f"| touching | pixels that depend | flagged at order 2 |\n|---|---|---|\n{lines}\n\n"
        "Not counted are pixels within 1e-9 of the radius of touching, or 1e-11 of its distance "
        f"where that is more.\n\nPixels left out: {faults(found)}\n"
    )
    return text, sum(len(each.faults) for each in found)


def kernel_part(seed: int, count: int) -> str:
    """The kernels against extended precision, by their own file."""
    if find_spec("stress_kernels") is None:
        return "## Kernels\nNot run.\n"
    text: str = import_module("stress_kernels").run(seed, count)
    return text


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1_000)
    parser.add_argument("--scenes", type=int, default=1_000, help="hostile scenes")
    parser.add_argument("--changed", type=int, default=200, help="scenes moved, scaled and turned")
    parser.add_argument("--masks", type=int, default=2_000, help="adversarial scenes for the mask")
    parser.add_argument("--kernels", type=int, default=1_000_000, help="configurations of kernels")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--page", type=Path, default=PAGE, help="where to write")
    chosen = parser.parse_args()
    began, seed = time.perf_counter(), chosen.seed
    parts, wrong = [kernel_part(seed, chosen.kernels)], 0
    for part, count in (
        (hostile_part, chosen.scenes),
        (invariance_part, chosen.changed),
        (mask_part, chosen.masks),
    ):
        if count:
            text, bad = part(range(seed, seed + count), chosen.workers)
            print(text)
            parts.append(text)
            wrong += bad
    minutes = (time.perf_counter() - began) / 60.0
    head = HEAD.format(machine=machine.describe(), seed=seed, minutes=minutes)
    chosen.page.write_text("\n".join([head, PROMISES, *parts]), encoding="utf-8")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
