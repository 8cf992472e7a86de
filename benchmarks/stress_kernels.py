# SPDX-License-Identifier: GPL-3.0-or-later
"""Stress: a million random configurations through each family of kernels, by seed.

Every answer is held against long doubles, the worst ones against mpmath at 50 digits; NaN,
infinities, warnings and exceptions are counted. The families are those of `tests/test_kernels.py`,
and those of `tests/lights/test_kernels.py`, which are held against brute force.
"""

from __future__ import annotations

import argparse
import heapq
import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "helpers"))

import numpy as np

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
CHUNK = 50_000
"""Configurations at a time, to bound memory; each chunk has a seed of its own."""
WORST = 24
"""So many of a family's worst, by long doubles, are judged by 50 digits."""
LOOSEST = 100.0
"""A bound this many times the largest error seen promises nothing."""


@dataclass
class Tally:
    """What became of a family's configurations."""

    cases: int = 0
    promised: int = 0
    broken: list[str] = field(default_factory=list)
    worst: list[tuple[float, int, int]] = field(default_factory=list)
    ratio: float = 0.0
    error: float = 0.0
    where: str = ""


def run(seed: int = 1, count: int = 1_000_000, workers: int = 1) -> tuple[str, int]:
    """Put configurations through every family: a Markdown section that tells what came out, and
    how many promises were broken."""
    began = time.perf_counter()
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        tallies = dict(
            zip(FAMILIES, pool.map(partial(_by_name, seed, count), FAMILIES), strict=True)
        )
    return report(tallies, seed, count, time.perf_counter() - began), wrong(tallies)


def _by_name(seed: int, count: int, name: str) -> Tally:
    return stress(FAMILIES[name], seed, count)


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


def stress(family: Family, seed: int, count: int) -> Tally:
    """Run one family over chunks of seeds (seed, 0), (seed, 1), ..."""
    tally, count = Tally(), max(1, round(family.share * count))
    for chunk in range(-(-count // CHUNK)):
        size = min(CHUNK, count - chunk * CHUNK)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                _one_chunk(family, seed, chunk, size, tally)
        except (Warning, ArithmeticError, ValueError, IndexError) as error:
            tally.broken.append(f"seed ({seed}, {chunk}): {type(error).__name__}: {error}")
    _judge(family, seed, min(CHUNK, count), count, tally)
    return tally


def _cases(family: Family, seed: int, chunk: int, size: int) -> dict[str, Any]:
    inputs: dict[str, Any] = family.sample(np.random.default_rng((seed, chunk)), size)
    return inputs


def _one_chunk(family: Family, seed: int, chunk: int, size: int, tally: Tally) -> None:
    inputs = _cases(family, seed, chunk, size)
    got = family.core(**inputs)
    tally.cases += size
    if not np.isfinite(got).all():
        bad = np.flatnonzero(~np.isfinite(got).reshape(-1, size).all(axis=0))
        tally.broken.append(f"seed ({seed}, {chunk}), case {bad[0]}: not finite")
        return
    bound = family.bound(**inputs)
    ratios = _ratios(family, LONG, inputs, got, bound).reshape(-1, size).max(axis=0)
    tally.promised += int(np.isfinite(bound).reshape(-1, size).all(axis=0).sum())
    top = np.argpartition(ratios, -WORST)[-WORST:] if size > WORST else np.arange(size)
    tally.worst = heapq.nlargest(
        WORST, [*tally.worst, *((float(ratios[i]), chunk, int(i)) for i in top)]
    )


def _ratios(family: Family, m: Any, inputs: Any, got: Any, bound: Any) -> Any:
    """Errors over bounds; 0 where none is promised."""
    error = family.error(m, inputs, got)
    known = np.isfinite(bound)
    return np.where(known, error, 0.0) / np.where(known & (bound > 0.0), bound, 1.0)


def _judge(family: Family, seed: int, chunk_size: int, count: int, tally: Tally) -> None:
    """The worst cases again, by 50 digits."""
    for _, chunk, case in tally.worst:
        size = min(chunk_size, count - chunk * CHUNK)
        inputs = {k: v[..., case : case + 1] for k, v in _cached(family, seed, chunk, size).items()}
        got, bound = family.core(**inputs), family.bound(**inputs)
        ratios = _ratios(family, EXACT, inputs, got, bound)
        if ratios.max() > tally.ratio:
            at = np.unravel_index(int(ratios.argmax()), ratios.shape)
            tally.ratio = float(ratios.max())
            tally.error = float(family.error(EXACT, inputs, got)[at])
            tally.where = f"({seed}, {chunk}), {case}"


_last: dict[str, Any] = {}


def _cached(family: Family, seed: int, chunk: int, size: int) -> dict[str, Any]:
    key = (family.name, seed, chunk, size)
    if _last.get("key") != key:
        _last.update(key=key, inputs=_cases(family, seed, chunk, size))
    inputs: dict[str, Any] = _last["inputs"]
    return inputs


def report(tallies: dict[str, Tally], seed: int, count: int, seconds: float) -> str:
    """What came out, in Markdown."""
    broken = [f"- {name}, {what}" for name, t in tallies.items() for what in t.broken]
    total = sum(t.cases for t in tallies.values())
    lines = [
        f"{total:,} random configurations, {count:,} for each of {len(tallies)} families (a "
        f"hundredth of that for partly hidden ellipses, whose brute force is slow), seed "
        f"{seed} ({seconds:.0f} s). Sizes 1e-6 to 1e6, distances to 1e6, aspect ratios to 1e6, "
        "most of them near contact, tangency, the horizon or a silhouette.",
        "",
        f"- NaN, infinities, warnings, exceptions: **{len(broken) or 'none'}**",
        f"- errors beyond the stated bound: **{', '.join(beyond(tallies)) or 'none'}**",
        f"- bounds more than {LOOSEST:.0f} times the largest error seen: "
        f"**{', '.join(empty(tallies)) or 'none'}**",
        "",
        "`u` is 2^-53. Promised: the share of configurations for which the bound says anything "
        "(the rest are decided by rounding: on a surface, in a plane). Worst: the largest error "
        f"over its bound, found by long doubles, confirmed with 50 digits ({WORST} a family).",
        "",
        "Suns, spots, limited spread, skies, environments and ellipses are held against brute "
        "force in float64 (`tests/oracle/latitudes.py`, `visible.py`); their bounds are those that "
        "are asked for.",
        "",
        "| kernel | error is at most | promised | worst of bound | that error | seed, case |",
        "|---|---|---|---|---|---|",
    ]
    for name, t in tallies.items():
        family = FAMILIES[name]
        promise = family.promise.replace("|", "\\|")
        share = t.promised / max(t.cases, 1)
        lines.append(
            f"| {family.name} | {promise} | {100.0 * share:.1f} % | {t.ratio:.2f} | {t.error:.1e} "
            f"| {t.where} |"
        )
    return "\n".join([*lines, "", *broken]).rstrip() + "\n"


def main() -> None:
    """Print the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--workers", type=int, default=1, help="processes")
    arguments = parser.parse_args()
    print(run(arguments.seed, arguments.count, arguments.workers)[0])


if __name__ == "__main__":
    main()
