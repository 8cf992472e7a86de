# SPDX-License-Identifier: GPL-3.0-or-later
"""The long version of the tests of stability: writes docs/stability.md.

A million random configurations through each kernel, a thousand hostile scenes rendered in every
way, scenes moved, scaled, turned and mirrored, and masks on adversarial scenes. Parts can be run
apart: each writes its own section of the page and leaves the others as they are. What kernels did
is kept by family (`stress_results.py`): a run that ended early goes on where it was.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import machine
import stress_kernels
import stress_scenes
from stress_scenes import Found

PAGE = Path(__file__).resolve().parent.parent / "docs" / "stability.md"
FAULTS_SHOWN = 20

HEAD = """\
# Stability

What was tried to break the numbers, and the worst that was found with the seeds that show it.
`make stress` writes this page; `make test` runs a smaller set of all of it. What a section
promises is what its own run checks, configuration by configuration; it lists what was broken.
"""

TAIL = """\
## What is not promised

- Of two surfaces of different colours in one and the same place, which one is seen: the first in
  the list where both lie at the very same depth, else rounding decides.
- Under method RAYS, a mirror turns a quad light's second coordinate about, a reversed shutter the
  time, and another order of the lights changes which points each gets: other sample points, so
  penumbrae and blurs differ by their sampling error. Of a mirrored scene in which a surface's
  normal, a round light and the camera lie in one plane, the same is true of round lights.
- How long a scene takes. Cells that no split would settle are not split, and a pixel takes at most
  4,096 of them, but a light that reaches into an occluder takes a thousand rays a point, and of
  near-coincident surfaces that cut each other every seam is followed.
- Shadow edges nearer to a light than 2^-48 of its distance: rounding puts them where they are.
- Light in a picture of which neither a pixel's centre nor a closer look at what may be lit (to 7 %
  of the errors foreseen) shows any: it is given as black.
- Coordinates beyond 1e30 m and light beyond 1e30: what has such is left out, and named.
- Numbers of light beyond float32's range: images clip them.
"""


@dataclass(frozen=True)
class Part:
    """A section of the page: `run` takes a first seed, a count and processes, and returns what
    came out in Markdown and how many promises were broken. `dated` : whether the section says by
    itself when and from which seed it was run."""

    title: str
    about: str
    promise: str
    count: int
    run: Callable[[int, int, int], tuple[str, int]]
    dated: bool = False


def run_all(work: Callable[[int], Found], seeds: range, workers: int) -> list[Found]:
    """What each seed shows, in order."""
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        return list(pool.map(work, seeds, chunksize=4))


def table(found: list[Found]) -> str:
    """The median and the largest of each figure, and the seed that shows it."""
    lines = ["| | median | worst | seed | limit |", "|---|---|---|---|---|"]
    for name, limit in stress_scenes.LIMITS.items():
        those = sorted((each.figures[name], each.seed) for each in found if name in each.figures)
        if those:
            middle, (worst, seed) = those[len(those) // 2][0], those[-1]
            lines.append(f"| {name} | {middle:.1g} | {worst:.2g} | {seed} | {limit:g} |")
    return "\n".join(lines)


def faults(found: list[Found]) -> str:
    """The faults as a list, or that there was none."""
    lines = [f"- seed {each.seed}: {fault}" for each in found for fault in each.faults]
    rest = len(lines) - FAULTS_SHOWN
    if rest > 0:
        lines = [*lines[:FAULTS_SHOWN], f"- and {rest} more"]
    return "\n".join(["Broken promises:", "", *lines]) if lines else "Broken promises: none."


def count_faults(found: list[Found]) -> int:
    return sum(len(each.faults) for each in found)


def work(found: list[Found]) -> str:
    """The points that a pixel takes, and the seed where they are most."""
    lines = ["| points a pixel | median | most | seed |", "|---|---|---|---|"]
    for name in stress_scenes.WAYS:
        key = f"points, {name}"
        those = sorted((each.figures[key], each.seed) for each in found if key in each.figures)
        if those:
            middle, (most, seed) = those[len(those) // 2][0], those[-1]
            lines.append(f"| {name} | {middle:.0f} | {most:.0f} | {seed} |")
    return "\n".join(lines)


def hostile(seed: int, count: int, workers: int) -> tuple[str, int]:
    found = run_all(stress_scenes.hostile, range(seed, seed + count), workers)
    renders = int(sum(each.figures.get("renders", 0) for each in found))
    refused = sum(bool(each.figures.get("refused")) for each in found)
    text = (
        f"{count} scenes, each rendered {', '.join(stress_scenes.WAYS)} (the last, one scene in "
        f"{stress_scenes.CLOSEST_EACH}): {renders} renders; "
        f"{refused} cameras refused with a message.\n\n{work(found)}\n\n{faults(found)}\n"
    )
    return text, count_faults(found)


def meshes(seed: int, count: int, workers: int) -> tuple[str, int]:
    found = run_all(stress_scenes.hostile_meshes, range(seed, seed + count), workers)
    renders = int(sum(each.figures.get("renders", 0) for each in found))
    text = (
        f"{count} scenes, each rendered {', '.join(stress_scenes.MESH_WAYS)}: {renders} renders.\n"
        f"\n{work(found)}\n\n{faults(found)}\n"
    )
    return text, count_faults(found)


def changes(seed: int, count: int, workers: int) -> tuple[str, int]:
    found = run_all(stress_scenes.invariance, range(seed, seed + count), workers)
    text = (
        f"{count} random scenes; relative RMSE between the pictures before and after, methods "
        f"EXACT and RAYS.\n\n{table(found)}\n\n{faults(found)}\n"
    )
    return text, count_faults(found)


def masks(
    seed: int, count: int, workers: int, work: Callable[[int], Found] = stress_scenes.adversarial
) -> tuple[str, int]:
    found = run_all(work, range(seed, seed + count), workers)
    names = sorted({name.split(":")[0] for each in found for name in each.figures})
    rows, wide = [], []
    for name in names:
        depend, flagged = (
            sum(each.figures.get(f"{name}:{what}", 0.0) for each in found)
            for what in ("depend", "flagged")
        )
        rows.append(f"| {name} | {depend:.0f} | {flagged:.0f} |")
        if flagged > stress_scenes.MOST_FLAGGED * depend:
            wide.append(Found(seed, [f"{name}: {flagged:.0f} flagged, {depend:.0f} depend"]))
    text = "\n".join(
        [
            f"{count} scenes.",
            "",
            "| touching | pixels that depend | flagged at order 2 |",
            "|---|---|---|",
            *rows,
            "",
            faults([*found, *wide]),
            "",
        ]
    )
    return text, count_faults(found) + len(wide)


PARTS = {
    "kernels": Part(
        "Kernels",
        "Roots, distances, angles, arcs and light, each against long doubles and, where they are "
        "farthest off, 50 digits.",
        "No NaN, infinity, warning or exception; errors stay within the bounds below; no bound "
        "is more than 100 times the largest error seen.",
        1_000_000,
        stress_kernels.run,
        dated=True,
    ),
    "hostile": Part(
        "Hostile scenes",
        "Random scenes in which one to four things went wrong: sizes of zero, denormals, 1e29 m, "
        "copies in one place, a sphere around a light, a light around the camera, motion through "
        "either, 0 to 1e30 W, lenses and pixels of any shape.",
        "Any scene renders to finite numbers without a warning, or a message says why its camera "
        "forms no picture. No pixel is below zero, or brighter than all lights together and the "
        "background.",
        1_000,
        hostile,
    ),
    "meshes": Part(
        "Hostile meshes",
        "Random scenes of meshes and instances in which some things went wrong: coordinates and "
        "matrices that are no numbers, denormal or up to 1e31, needles, faces without an area, "
        "none at all, doubled and turned over, up to a million in six places; normals of no "
        "length; instances in one place, nearly flat, of very different sizes, or grown from "
        "nothing.",
        "Any scene renders to finite numbers without a warning, and no pixel is below zero, or "
        "brighter than all lights together and the background.",
        1_000,
        meshes,
    ),
    "changes": Part(
        "Changes of the whole scene",
        "The camera, the objects, the lights and all motion are moved, scaled (point lights' "
        "power with them), turned or mirrored, or told in another order.",
        "The picture does not change by more than the limits below; scaled by a power of two, "
        "not by a bit.",
        200,
        changes,
    ),
    "masks": Part(
        "The mask on adversarial scenes",
        "Outlines, shadows and paths that miss or meet a pixel's ray, a light or each other by "
        "1e-3 down to 1e-12 of a radius, tiny occluders, contact; against an oracle in extended "
        "precision that shares no code with the tracer. Not counted are pixels within 1e-9 of the "
        "radius of touching, or 1e-11 of its distance where that is more.",
        "No pixel that depends on a domain is left out, by either order; order 2 flags at most "
        f"{stress_scenes.MOST_FLAGGED:g} times the pixels that depend.",
        2_000,
        masks,
    ),
    "solids": Part(
        "The mask on adversarial scenes of solids",
        "The same with ellipsoids, cylinders, cones, truncated cones and ellipses of axes that "
        "differ by up to 10 times, before round and quad lights, at rest and moving, or on the "
        "floor; against planes in extended precision that part a solid from a ray, a light or a "
        "pixel. Not counted are pixels in which the solid is seen, but where that is what is "
        "asked, and those wholly on it or in its shadow all the time.",
        "No pixel that depends on a domain is left out, by either order; order 2 flags at most "
        f"{stress_scenes.MOST_FLAGGED:g} times the pixels that depend.",
        2_000,
        partial(masks, work=stress_scenes.adversarial_solids),
    ),
}


def sections(page: Path) -> dict[str, str]:
    """The sections that a page has, by title."""
    if not page.exists():
        return {}
    parts = re.split(r"^## (.*)\n", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return dict(zip(parts[1::2], (text.strip() + "\n" for text in parts[2::2]), strict=True))


def written(part: Part, seed: int, count: int, workers: int) -> tuple[str, int]:
    """A section's text, and how many promises its run broke."""
    where, began = machine.describe(), time.perf_counter()
    text, wrong = part.run(seed, count, workers)
    minutes = (time.perf_counter() - began) / 60.0
    run = f"Run on {where}, from seed {seed}, in {minutes:.0f} minutes."
    head = [part.about, f"Promised: {part.promise}", *([] if part.dated else [run])]
    return "\n\n".join([*head, text]), wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", default=list(PARTS), help=f"of {', '.join(PARTS)}")
    parser.add_argument("--seed", type=int, default=1_000)
    parser.add_argument(
        "--count", type=int, help="configurations or scenes, in place of each's own"
    )
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument(
        "--kept", action="store_true", help="kernels: run none, write what is kept of earlier runs"
    )
    parser.add_argument("--page", type=Path, default=PAGE, help="where to write")
    chosen = parser.parse_args()
    unknown = set(chosen.parts) - set(PARTS)
    if unknown:
        parser.error(f"no such part: {', '.join(sorted(unknown))}")
    broken = 0
    for name in chosen.parts:
        part = PARTS[name]
        if chosen.kept and part.run is stress_kernels.run:
            part = replace(part, run=partial(stress_kernels.run, seconds=0.0))
        text, wrong = written(part, chosen.seed, chosen.count or part.count, chosen.workers)
        print(text)
        broken += wrong
        # read anew: another part may have been written meanwhile
        known = sections(chosen.page) | {part.title: text.strip() + "\n"}
        body = [f"## {p.title}\n\n{known.get(p.title, 'Not run.')}" for p in PARTS.values()]
        chosen.page.write_text("\n".join([HEAD, *body, TAIL]), encoding="utf-8")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
