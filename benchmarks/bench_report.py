# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of the benchmark: verdicts, ratios, and all that was measured."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

from bench_fit import Result
from bench_plots import name_of

__all__ = ["compose"]

GOALS = (1e-2, 1e-3, 1e-4)
CYCLES = ("Cycles", "Cycles, adaptive")
MITSUBA = ("Mitsuba",)
WANTED = {
    (MITSUBA, 1e-2): 1.0,
    (MITSUBA, 1e-3): 10.0,
    (MITSUBA, 1e-4): 100.0,
    (CYCLES, 1e-2): 20.0,
    (CYCLES, 1e-3): 100.0,
}
"""How many times faster than a peer ours is to be at an error."""


def compose(results: Sequence[Result], about: str, minutes: float, seconds: float) -> str:
    """The whole page."""
    sizes = list(dict.fromkeys((r.width, r.height) for r in results))
    lines = [
        "<!-- Written by benchmarks/bench.py: `make bench`. -->",
        "# Run time against error",
        "",
        f"Measured on: {about}. Two threads for each renderer, one at a time;",
        f"{', '.join(_versions(results))}. The run took {minutes:.0f} minutes.",
        "",
        *HOW.format(seconds=seconds).splitlines(),
        "",
        "## What was wanted, and what is",
        "",
        *_verdicts(results),
        "",
    ]
    for size in sizes:
        some = [r for r in results if (r.width, r.height) == size]
        lines += [f"## {size[0]} x {size[1]}", "", f"![plots](pictures/{name_of(*size)})", ""]
        lines += [*_ratios(some), "", *_ratios(some, reached=True), "", *_measured(some), ""]
    return "\n".join([*lines, *_proof(results), ""])


HOW = """\
Every renderer gets the same scene, made from one description (`benchmarks/bench_scenes.py`):
direct light, box filter, the same camera and lights. Cycles gets spheres as point clouds, which
it traces as true spheres, and moving lights as faces that shine, as it does not move lamps.
Mitsuba has no moving shapes and renders the still scenes; its lights are shapes, so they are
placed where none hides another. Its direct integrator takes one light sample a path and its
orthogonal sampler, the best of its five here. Cycles samples by tabulated Sobol
points and without its light tree, which was faster here than its defaults; its better one of
plain and adaptive sampling counts.

Whole renders are timed, from the scene in memory to pixels in memory, after a warm-up (Mitsuba's
scene is loaded and its code compiled before, Cycles builds its own in each render, our worker
process has loaded; the first render of a session shares none). Renders are repeated up to five
times when short; the least counts. Peers climb a ladder of samples until a render would take more
than {seconds:g} s; what is beyond is extrapolated from the slope of the last four rungs (of one
rung: as of independent samples) and marked *. Cycles is stopped at 1.5 times that.

Errors are relative RMSE, over random pixels, against a converged truth (`tests/oracle`, which
shares no code with the tracer): adaptive quadrature over pixel and shutter of light summed over
arcs, to about 1e-5 of the picture's mean. How far the peers' finest pictures are from it is at
the end of this page.

What is wanted is held against our tolerance, which our pictures' errors stay below. The last
column of the first table holds them against the errors themselves, as the peers' are.

To repeat it: `make bench`, or a part of it, such as
`python benchmarks/bench.py --scenes "quad light" --sizes 300 --tolerances 1e-2 1e-3`."""


def _versions(results: Iterable[Result]) -> list[str]:
    found = {c.version: None for r in results for n, c in r.curves.items() if n != "ours"}
    return list(found)


def _verdicts(results: Sequence[Result]) -> list[str]:
    small = [r for r in results if (r.width, r.height) == (300, 300)]
    large = [r for r in results if (r.width, r.height) != (300, 300)]
    still, moving = [r for r in small if not r.moves], [r for r in small if r.moves]
    lines = [
        "| | wanted | least over the scenes (geometric mean) | met | to the error ours reached |",
        "|---|---|---|---|---|",
    ]

    def row(number: str, text: str, cells: Sequence[str]) -> None:
        lines.append(f"| {number} | {text} | {' | '.join(cells)} |")

    for goal, number in ((1e-2, "1"), (1e-3, "2"), (1e-4, "3")):
        for peers, name in ((MITSUBA, "Mitsuba"), (CYCLES, "Cycles")):
            times = WANTED.get((peers, goal))
            if times is not None:
                text = f"still, {goal:.0e}: {times:g} times faster than {name}"
                row(number, text, _least(still, peers, goal, times))
    for goal in (1e-2, 1e-3):
        times = WANTED[CYCLES, goal]
        text = f"moving, {goal:.0e}: {times:g} times faster than Cycles"
        row("4", text, _least(moving, CYCLES, goal, times))
    for (peers, goal), times in WANTED.items():
        text = f"1920 x 1080, {goal:.0e}: {0.5 * times:g} times faster than {peers[0]}"
        row("5", text, _least(large, peers, goal, 0.5 * times))
    for goal in GOALS:
        row("6", f"error within {goal:.0e}", _errors(results, goal))
    lines += [
        "",
        "The 50 random scenes of line 6, and lines 7 and 8 (closed forms against mpmath and",
        "published view factors; the same bits for any number of threads) are tests: `make test`.",
    ]
    return lines


def _least(
    results: Sequence[Result], peers: tuple[str, ...], goal: float, wanted: float
) -> tuple[str, str, str]:
    known = _known(results, peers, goal)
    if not known:
        return "not measured", "", ""
    count = sum(k[0] >= wanted for k in known)
    met = "yes" if count == len(known) else f"no: {count} of {len(known)} scenes"
    return _spelled(known), met, _spelled(_known(results, peers, goal, reached=True))


def _known(
    results: Sequence[Result], peers: tuple[str, ...], goal: float, reached: bool = False
) -> list[tuple[float, str, bool]]:
    """Ratios that are known, with their scenes and whether they are extrapolated."""
    found = [(r.ratio(peers, goal, reached), r.scene) for r in results]
    return [(ratio[0], scene, ratio[1]) for ratio, scene in found if ratio is not None]


def _spelled(known: Sequence[tuple[float, str, bool]]) -> str:
    """The least ratio, its scene, and the geometric mean of all."""
    least, scene, guessed = min(known)
    mean = math.exp(sum(math.log(k[0]) for k in known) / len(known))
    return f"{least:.3g}{'*' if guessed else ''}, {scene} ({mean:.3g})"


def _errors(results: Sequence[Result], goal: float) -> tuple[str, str, str]:
    known = [(rung.error, r) for r in results if (rung := r.ours(goal)) is not None]
    if not known:
        return "not measured", "", ""
    worst, result = max(known, key=lambda k: k[0])
    count = sum(k[0] <= goal for k in known)
    text = f"at most {worst:.2e}, {result.scene} at {result.width} x {result.height}"
    return text, "yes" if count == len(known) else f"no: {count} of {len(known)} pictures", ""


def _ratios(results: Sequence[Result], reached: bool = False) -> list[str]:
    """Seconds at each error, and how many times faster ours is; see `Result.ratio`."""
    about = REACHED if reached else WITHIN
    lines = [*about, "", "| scene | error | ours | Cycles | Cycles, adaptive | Mitsuba |"]
    lines.append("|---|---|---|---|---|---|")
    for result in results:
        for goal in GOALS:
            ours = result.ours(goal)
            if ours is None:
                continue
            error = ours.error if reached else goal
            spelled = f"{error:.1e}" if reached else f"{error:.0e}"
            cells = [result.scene, spelled, f"{ours.least:.3g}"]
            for peer in (*CYCLES, *MITSUBA):
                curve = result.curves.get(peer)
                if curve is None:
                    cells.append("")
                    continue
                at = curve.time_at(error)
                cells.append(f"{at} ({at.seconds / ours.least:.3g})")
            lines.append("| " + " | ".join(cells) + " |")
    return lines


WITHIN = (
    "Seconds to an error: ours at that tolerance, the peers' interpolated (* extrapolated),",
    "and in brackets how many times longer they take.",
)
REACHED = (
    "The same to the error that our picture has, which is less than the tolerance: the peers are",
    "chosen by the errors of their pictures, so these are like beside like.",
)


SETTING: dict[str, tuple[str, Callable[[float], str]]] = {
    "ours": ("tolerance", lambda x: f"{x:g}"),
    "Cycles": ("samples", lambda x: f"{x:,.0f}"),
    "Cycles, adaptive": ("threshold", lambda x: f"{x:.3g}"),
    "Mitsuba": ("samples", lambda x: f"{x:,.0f}"),
}


def _measured(results: Sequence[Result]) -> list[str]:
    """Everything that was measured, folded away."""
    lines = ["<details><summary>All that was measured</summary>", ""]
    lines += [
        "| scene | renderer | setting | least s | median s | relative RMSE | slope |",
        "|---|---|---|---|---|---|---|",
    ]
    for result in results:
        for name, curve in result.curves.items():
            word, spelled = SETTING[name]
            for rung in curve.rungs:
                last = rung is curve.rungs[-1]
                cells = (
                    result.scene,
                    name,
                    f"{word} {spelled(rung.setting)}",
                    f"{rung.least:.4f}",
                    f"{rung.median:.4f}",
                    f"{rung.error:.2e} ± {rung.doubt:.0e}",
                    f"{-curve.slope:.2f}" if last else "",
                )
                lines.append("| " + " | ".join(cells) + " |")
    return [*lines, "", "</details>"]


def _proof(results: Sequence[Result]) -> list[str]:
    """How far the peers' finest pictures are from the truth, on average over the pixels."""
    lines = [
        "## The truth against the peers",
        "",
        "The mean of each peer's finest picture, over the pixels that errors are measured on,",
        "less the truth's: relative to it, ± the standard error that the noise leaves.",
        "",
        "| scene | size | Cycles | Cycles, adaptive | Mitsuba |",
        "|---|---|---|---|---|",
    ]
    for result in results:
        cells = [result.scene, f"{result.width} x {result.height}"]
        for peer in (*CYCLES, *MITSUBA):
            off = result.proof.get(peer)
            cells.append("" if off is None else f"{off[0]:+.1e} ± {off[1]:.0e}")
        lines.append("| " + " | ".join(cells) + " |")
    return lines
