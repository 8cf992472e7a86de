# SPDX-License-Identifier: GPL-3.0-or-later
"""Stress: a million random configurations through each family of kernels, by seed.

Every answer is held against long doubles, the worst ones against mpmath at 50 digits; NaN,
infinities, warnings and exceptions are counted. The families are those of `tests/test_kernels.py`,
and those of `tests/lights/test_kernels.py`, which are held against brute force.
"""

from __future__ import annotations

import argparse
import heapq
import math
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "helpers"))

import numpy as np
import stress_results
from stress_results import Tally

import kernel_arcs
import kernel_cones
import kernel_ellipses
import kernel_families
import kernel_hidden
import kernel_lights
import kernel_ranges
import kernel_skies
import kernel_spots
from kernel_families import Family
from oracle.numbers import EXACT, LONG

__all__ = ["FAMILIES", "run"]

MODULES = (
    kernel_ranges,
    kernel_families,
    kernel_lights,
    kernel_spots,
    kernel_arcs,
    kernel_cones,
    kernel_hidden,
    kernel_skies,
    kernel_ellipses,
)
FAMILIES: dict[str, Family] = {
    name: thing
    for module in MODULES
    for name, thing in vars(module).items()
    if isinstance(thing, Family)
}
MODULE_OF = {
    name: module.__name__
    for module in reversed(MODULES)
    for name, thing in vars(module).items()
    if isinstance(thing, Family)
}
CHUNK = 50_000
"""Configurations at a time, to bound memory; each chunk has a seed of its own."""
WORST = 24
"""So many of a family's worst, by long doubles, are judged by 50 digits."""
SETTLED = 0.25
"""Part of its bound up to which an error by quick sums is taken as it is."""
JUDGED_EACH = 5
"""After so many chunks the worst so far are judged, so that a run which ends tells of them."""
SUMS = ("cases", "seconds")
LOOSEST = 100.0
"""A bound this many times the largest error seen promises nothing."""


def run(
    seed: int = 1,
    count: int = 1_000_000,
    workers: int = 1,
    seconds: float = math.inf,
    names: Sequence[str] = (),
) -> tuple[str, int]:
    """Put configurations through families, all of them unless `names` says which: a Markdown
    section that tells what all families are known to do, and how many promises were broken.

    A family goes on from what is kept of it, if that is of the same sources, seed and count; one
    that has done as many cases or more does nothing. After so many `seconds` by the clock no family
    begins another chunk; with 0 nothing is run.
    """
    unknown = set(names) - set(FAMILIES)
    if unknown:
        raise ValueError(f"no such family: {', '.join(sorted(unknown))}")
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        work = partial(_by_name, seed, count, time.time() + seconds)
        list(pool.map(work, list(names or FAMILIES) if seconds > 0.0 else []))
    tallies = {name: tally for name in FAMILIES if (tally := stress_results.load(name))}
    return report(tallies), wrong(tallies)


def _by_name(seed: int, count: int, end: float, name: str) -> None:
    """Run a family on from where it was, and keep what came out."""
    family, sources = FAMILIES[name], stress_results.digest(MODULE_OF[name])
    count = max(1, round(family.share * count))
    tally = stress_results.load(name)
    same = tally is not None and (tally.sources, tally.seed) == (sources, seed)
    if tally is None or not same or (tally.count != count and tally.cases < count):
        tally = Tally(seed, count, sources=sources, revision=stress_results.revision())
    stress(family, tally, end, lambda: stress_results.save(name, tally))
    print(f"{name}: {tally.cases:,} cases, {tally.seconds:.0f} s, {tally.ratio:.2f}", flush=True)


def beyond(tallies: dict[str, Tally]) -> list[str]:
    """Families with an error beyond its bound."""
    return [name for name, t in tallies.items() if t.ratio > 1.0]


def empty(tallies: dict[str, Tally]) -> list[str]:
    """Families whose bound promises less than it could."""
    return [
        name for name, t in tallies.items() if FAMILIES[name].digits and t.ratio < 1.0 / LOOSEST
    ]


def wrong(tallies: dict[str, Tally]) -> int:
    """How many promises were broken."""
    broken = sum(len(t.broken) for t in tallies.values())
    return broken + len(beyond(tallies)) + len(empty(tallies))


def stress(
    family: Family, tally: Tally, end: float = math.inf, keep: Callable[[], None] = lambda: None
) -> None:
    """Run a family on over chunks of seeds (seed, 0), (seed, 1), ... until a time by the clock;
    `keep` is called after each chunk, when its worst cases have been judged."""
    for chunk in range(tally.chunks, -(-tally.count // CHUNK)):
        if time.time() > end:
            break
        began = time.process_time()
        size = _size(tally, chunk)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                _one_chunk(family, chunk, size, tally)
        except (Warning, ArithmeticError, ValueError, IndexError) as error:
            tally.broken.append(f"seed ({tally.seed}, {chunk}): {type(error).__name__}: {error}")
        tally.chunks += 1
        if tally.chunks % JUDGED_EACH == 0 or tally.chunks * CHUNK >= tally.count:
            _judge(family, tally)
        tally.seconds += time.process_time() - began
        keep()


def _size(tally: Tally, chunk: int) -> int:
    """Cases of a chunk."""
    return min(CHUNK, tally.count - chunk * CHUNK)


def _cases(family: Family, seed: int, chunk: int, size: int) -> dict[str, Any]:
    inputs: dict[str, Any] = family.sample(np.random.default_rng((seed, chunk)), size)
    return inputs


def _one_chunk(family: Family, chunk: int, size: int, tally: Tally) -> None:
    seed = tally.seed
    inputs = _cases(family, seed, chunk, size)
    got = family.core(**inputs)
    tally.cases += size
    if not np.isfinite(got).all():
        bad = np.flatnonzero(~np.isfinite(got).reshape(-1, size).all(axis=0))
        tally.broken.append(f"seed ({seed}, {chunk}), case {bad[0]}: not finite")
        return
    bound = family.bound(**inputs)
    ratios = _ratios(family, LONG, inputs, got, bound).reshape(-1, size).max(axis=0)
    if not np.isfinite(ratios).all():
        bad = np.flatnonzero(~np.isfinite(ratios))
        tally.broken.append(f"seed ({seed}, {chunk}), case {bad[0]}: the oracle gives no number")
        return
    tally.promised += int(np.isfinite(bound).reshape(-1, size).all(axis=0).sum())
    top = np.argpartition(ratios, -WORST)[-WORST:] if size > WORST else np.arange(size)
    tally.worst = heapq.nlargest(
        WORST, [*tally.worst, *((float(ratios[i]), chunk, int(i)) for i in top)]
    )


def _ratios(family: Family, m: Any, inputs: Any, got: Any, bound: Any) -> Any:
    """Errors over bounds; 0 where none is promised.

    Where a family has quick sums, long doubles are kept for the cases that those do not find well
    within their bound.
    """
    known = np.isfinite(bound)
    scale = np.where(known & (bound > 0.0), bound, 1.0)
    if family.quick is None or m is EXACT:
        return np.where(known, family.error(m, inputs, got), 0.0) / scale
    error = np.abs(np.asarray(got - family.quick(**inputs)).astype(np.float64))
    ratios = np.where(known, error, 0.0) / scale
    # written so that no number goes to the better sums too
    rows = np.flatnonzero(~(ratios <= SETTLED).reshape(-1, ratios.shape[-1]).all(axis=0))
    if rows.size:
        some = {key: value[..., rows] for key, value in inputs.items()}
        error = np.where(known[..., rows], family.error(m, some, got[..., rows]), 0.0)
        ratios[..., rows] = error / scale[..., rows]
    return ratios


def _judge(family: Family, tally: Tally) -> None:
    """The worst cases again, by 50 digits."""
    tally.ratio, tally.error, tally.where = 0.0, 0.0, ""
    for _, chunk, case in tally.worst:
        every = _cached(family, tally.seed, chunk, _size(tally, chunk))
        inputs = {key: value[..., case : case + 1] for key, value in every.items()}
        got, bound = family.core(**inputs), family.bound(**inputs)
        ratios = _ratios(family, EXACT, inputs, got, bound)
        if ratios.max() > tally.ratio:
            at = np.unravel_index(int(ratios.argmax()), ratios.shape)
            tally.ratio = float(ratios.max())
            tally.error = float(family.error(EXACT, inputs, got)[at])
            tally.where = f"({tally.seed}, {chunk}), {case}"


_last: dict[str, Any] = {}


def _cached(family: Family, seed: int, chunk: int, size: int) -> dict[str, Any]:
    key = (family.name, seed, chunk, size)
    if _last.get("key") != key:
        _last.update(key=key, inputs=_cases(family, seed, chunk, size))
    inputs: dict[str, Any] = _last["inputs"]
    return inputs


def report(tallies: dict[str, Tally]) -> str:
    """What came out, in Markdown."""
    broken = [f"- {name}, {what}" for name, t in tallies.items() for what in t.broken]
    total, seconds = (sum(t.__dict__[what] for t in tallies.values()) for what in SUMS)
    missing = [name for name in FAMILIES if name not in tallies]
    lines = [
        f"{total:,} random configurations of {len(tallies)} families, {seconds:.0f} s of a "
        "processor. Sizes 1e-6 to 1e6, distances to 1e6, aspect ratios to 1e6, most of them near "
        "contact, tangency, the horizon or a silhouette. Families may have run at different times: "
        "each row tells how many cases it really ran, and with which revision; a star marks a row "
        "whose sources have changed since.",
        "",
        f"- NaN, infinities, warnings, exceptions: **{len(broken) or 'none'}**",
        f"- errors beyond the stated bound: **{', '.join(beyond(tallies)) or 'none'}**",
        f"- bounds more than {LOOSEST:.0f} times the largest error seen: "
        f"**{', '.join(empty(tallies)) or 'none'}**",
        f"- families that were not run: **{', '.join(missing) or 'none'}**",
        "",
        "`u` is 2^-53. Promised: the share of configurations for which the bound says anything "
        "(the rest are decided by rounding: on a surface, in a plane). Worst: the largest error "
        f"over its bound, found by long doubles, confirmed with 50 digits ({WORST} a family).",
        "",
        "Suns, spots, limited spread, skies, environments and ellipses are held against brute "
        "force in float64 (`tests/oracle/latitudes.py`, `visible.py`); their bounds are those that "
        "are asked for.",
        "",
        "| kernel | error is at most | cases | promised | worst of bound | that error | seed, case "
        "| CPU s | revision |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [_row(name, t) for name, t in tallies.items()]
    return "\n".join([*lines, "", *broken]).rstrip() + "\n"


def _row(name: str, t: Tally) -> str:
    family = FAMILIES[name]
    promise = family.promise.replace("|", "\\|")
    share = t.promised / max(t.cases, 1)
    star = "" if t.sources == stress_results.digest(MODULE_OF[name]) else " *"
    return (
        f"| {family.name} | {promise} | {t.cases:,} | {100.0 * share:.1f} % | {t.ratio:.2f} | "
        f"{t.error:.1e} | {t.where} | {t.seconds:.0f} | {t.revision}{star} |"
    )


def main() -> None:
    """Print the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("families", nargs="*", help=f"of {', '.join(FAMILIES)}")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--seconds", type=float, default=math.inf, help="begin no chunk after it")
    given = parser.parse_args()
    print(run(given.seed, given.count, given.workers, given.seconds, given.families)[0])


if __name__ == "__main__":
    main()
