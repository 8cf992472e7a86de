# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit the coefficients of the error model, and write them with how well they fit.

The coefficients that concern integrals over boxes are fitted to random integrands, the others to
renders of random scenes. Each is then measured on seeds that the fit has not seen. `make fit` runs
this; it writes adaptive_drt/numerics/error_coefficients.py and docs/error-model.md. The result does
not depend on the values that these files hold before.
"""

from __future__ import annotations

import argparse
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "helpers")]

import error_model_rules as rules  # noqa: E402
from error_model_renders import (  # noqa: E402
    POWER,
    Blocks,
    Pixels,
    block_scene,
    blocks_of,
    crowd_scene,
    joined,
    joined_blocks,
    pixels_of,
    true_picture,
    watch,
)
from error_model_rules import Samples, rms  # noqa: E402
from error_model_sections import section_errors  # noqa: E402
from error_model_table import (  # noqa: E402
    BY_NAME,
    COEFFICIENTS,
    MODULE,
    PAGE,
    Fit,
    in_use,
    module_text,
    page_text,
)

from adaptive_drt.cubature.error_budget import GOAL_GROWTH  # noqa: E402
from adaptive_drt.numerics.arrays import Array  # noqa: E402
from adaptive_drt.scene.settings import Settings  # noqa: E402
from adaptive_drt.shading.unoccluded_variation import FALLOFF_COEFFICIENT  # noqa: E402
from random_scenes import random_scene  # noqa: E402

FIT, HELD = 1, 2
"""Seeds of the integrands of the fit, and of those that it does not see."""
SCENES = {FIT: range(400, 424), HELD: range(500, 516)}
"""Seeds of random scenes."""
CROWDS = {FIT: range(3), HELD: range(100, 103)}
"""Seeds of scenes with many moving spheres."""
BLOCK_SCENES = {FIT: range(400, 416), HELD: range(500, 510)}
"""Seeds of random scenes rendered larger, for blocks of pixels; still ones are skipped."""
TOLERANCES = (1e-2, 1e-3, 1e-4)
"""Tolerances of renders; the last only for every third scene, as it takes long."""
TRUE_TOLERANCE = 5e-5
"""Tolerance of the pictures that count as true: a twentieth of the least that is compared with
them."""
BLOCK_TOLERANCE = 2e-4
"""The same for the larger pictures of blocks; blocks with smaller estimates do not count."""
LEAST = 50
"""Number of pixels below which a bin of the law is not looked at."""
SHARES = (0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)
"""Values of `MOTION_ERROR_SHARE` that are tried."""
QUANTILE = 0.95

Values = dict[str, Any]


def set_coefficients(values: Values) -> None:
    """Set coefficients in all modules of the core that use them."""
    for name, module in list(sys.modules.items()):
        if name.startswith("adaptive_drt"):
            for key, value in values.items():
                if hasattr(module, key):
                    setattr(module, key, np.array(value) if isinstance(value, list) else value)


@dataclass
class Result:
    """Fits so far, and the values in use that follow from them."""

    fits: dict[str, Fit]
    values: Values

    def add(self, name: str, value: Any, fit: Samples, held: Samples) -> None:
        """Enter a coefficient that multiplies an estimate."""
        plain = Fit(value, fit.true.size, 1.0, 1.0, 1.0, 1.0)
        used = in_use(BY_NAME[name], plain)
        self.enter(name, replace(plain, **quality(fit.ratios(used), held.ratios(used))))

    def enter(self, name: str, fit: Fit) -> None:
        """Enter a fit."""
        self.fits[name] = fit
        self.values[name] = in_use(BY_NAME[name], fit)


def quality(fit: tuple[float, float], held: tuple[float, float]) -> dict[str, float]:
    """Fields of a `Fit` from its ratio and worst bin on both sets of seeds."""
    return {"ratio": fit[0], "worst": fit[1], "held_ratio": held[0], "held_worst": held[1]}


# integrals


def fit_rules(found: Result) -> None:
    """Fit the coefficients that concern integrals over boxes, rows of pixels and shutters."""
    fit_multi_node_error(found)
    pools = {seed: edge_pool(seed) for seed in (FIT, HELD)}
    parts = {seed: rules.undetected(pool) for seed, pool in pools.items()}
    found.add("UNDETECTED_SHARE", parts[FIT].fit(), parts[FIT], parts[HELD])
    fit_unpredicted(found, pools)
    for name, draw, worst in (
        ("FOURTH_MOMENT_CORRECTION", rules.limbs, False),
        ("REMAINING_ERROR", rules.peaks_on_pixels, True),
        ("TIME_ERROR_FACTOR", rules.shutters, True),
        ("FALLBACK_ERROR_FRACTION", rules.second_difference_errors, False),
        ("FOURTH_DIFFERENCE_WEIGHT", rules.fourth_difference_errors, False),
        ("SECTION_ERROR_FRACTION", section_errors, False),
    ):
        one, other = (draw(generator(seed, name)) for seed in (FIT, HELD))
        found.add(name, max(one.bins()) if worst else one.fit(), one, other)
    fit_falloff_ratios(found)
    fit_decay(found)


def generator(seed: int, name: str) -> np.random.Generator:
    """Random numbers for a coefficient."""
    return np.random.default_rng([seed, *name.encode()])


def edge_pool(seed: int) -> list[rules.Edges]:
    """Planes through boxes of one to three axes: roots, kinks, steps of each."""
    rng = generator(seed, "edges")
    return [rules.edges(axes, power, rng) for axes in (1, 2, 3) for power in rules.POWERS.values()]


def fit_multi_node_error(found: Result) -> None:
    """Fit what the multi-node rule leaves, by axes and kind."""
    sets = {}
    for seed in (FIT, HELD):
        rng, pool = generator(seed, "bends"), iter(edge_pool(seed))
        rows = []
        for axes in (1, 2, 3):
            some = [next(pool) for _ in rules.POWERS]
            row = [Samples(one.rule, one.center, one.bin) for one in some]
            rows.append([rules.bends(axes, rng), *row])
        sets[seed] = rows
    value = [[one.fit() for one in row] for row in sets[FIT]]
    count = sum(one.true.size for row in sets[FIT] for one in row)
    plain = Fit(value, count, 1.0, 1.0, 1.0, 1.0)
    used = in_use(BY_NAME["MULTI_NODE_ERROR"], plain)
    got = [
        np.array([one.ratios(x) for row, line in zip(rows, used, strict=True)
                  for one, x in zip(row, line, strict=True)])
        for rows in (sets[FIT], sets[HELD])
    ]  # fmt: skip
    each = [(rms(table[:, 0]), float(table[:, 1].max())) for table in got]
    found.enter("MULTI_NODE_ERROR", replace(plain, **quality(each[0], each[1])))


def fit_unpredicted(found: Result, pools: dict[int, list[rules.Edges]]) -> None:
    """Fit from where on differences are not predicted, and what those count."""
    far = {
        seed: [np.abs(one.found) / rms(one.center) for one in pool] for seed, pool in pools.items()
    }
    value = float(np.quantile(np.concatenate(far[FIT]), QUANTILE))
    plain = Fit(value, sum(part.size for part in far[FIT]), 1.0, 1.0, 1.0, 1.0)
    used = in_use(BY_NAME["UNPREDICTED_RATIO"], plain)
    got = [
        (float(np.quantile(np.concatenate(parts), QUANTILE)) / used,
         max(float(np.quantile(part, QUANTILE)) for part in parts) / used)
        for parts in (far[FIT], far[HELD])
    ]  # fmt: skip
    found.enter("UNPREDICTED_RATIO", replace(plain, **quality(got[0], got[1])))
    steps = {
        seed: rules.together([Samples(one.rule, one.found, 0 * one.bin) for one in pool[2::3]])
        for seed, pool in pools.items()
    }
    found.add("UNPREDICTED_SHARE", steps[FIT].fit(), steps[FIT], steps[HELD])


def fit_falloff_ratios(found: Result) -> None:
    """Fit from which extent on the rule leaves of falloff what it leaves of roots, and of kinks."""
    bends, roots = found.values["MULTI_NODE_ERROR"][1][:2]
    for name, share in (("FALLOFF_ROOT_RATIO", bends), ("FALLOFF_KINK_RATIO", roots)):
        sets = {
            seed: rules.falloff_patches(generator(seed, "ratios"), (0.05, 2.0))
            for seed in (FIT, HELD)
        }
        steep = name == "FALLOFF_KINK_RATIO"
        limits = {
            seed: rules.crossing(
                one, FALLOFF_COEFFICIENT * rules.falloff_estimate(one, steep), share
            )
            for seed, one in sets.items()
        }
        plain = Fit(limits[FIT], rules.COUNT, 1.0, 1.0, 1.0, 1.0)
        used = in_use(BY_NAME[name], plain)
        one, other = limits[FIT] / used, limits[HELD] / used
        found.enter(name, replace(plain, **quality((one, one), (other, other))))


def fit_decay(found: Result) -> None:
    """Fit how much slower than the last two Chebyshev coefficients the series may decay."""
    sets = {seed: rules.chebyshev_blocks_of_light(generator(seed, "decay")) for seed in (FIT, HELD)}

    def samples(seed: int, decay: float) -> Samples:
        off, last, before, extent = sets[seed]
        estimate, scale = rules.decayed(last, before, decay), extent**4
        return Samples(off / scale, estimate / scale, rules.log_bins(extent, [0.1, 0.2, 0.3]))

    low, high = 0.01, 8.0
    while high / low > 1.001:
        middle = float(np.sqrt(low * high))
        if samples(FIT, middle).ratios(1.0)[1] > 1.0:
            low = middle
        else:
            high = middle
    plain = Fit(high, rules.COUNT, 1.0, 1.0, 1.0, 1.0)
    used = in_use(BY_NAME["COEFFICIENT_DECAY"], plain)
    one, other = (samples(seed, used).ratios(1.0) for seed in (FIT, HELD))
    found.enter("COEFFICIENT_DECAY", replace(plain, **quality(one, other)))


# renders


@dataclass(frozen=True)
class Seen:
    """What a scene's renders tell: pixels, first estimates of cut pixels over the contrast and
    whether these are crowded, and for each render its tolerance, whether anything moves, and the
    estimated and true error over the tolerance (NaN if no true picture was made)."""

    pixels: list[Pixels]
    begun: Array
    crowded: Array
    pictures: list[tuple[float, bool, float, float]]


def look(job: tuple[int, bool, tuple[float, ...], Values, bool]) -> Seen:
    """Watch renders of a scene: its seed, whether it is a crowd, tolerances, coefficients, and
    whether to make a true picture."""
    seed, crowd, tolerances, values, compared = job
    set_coefficients(values)
    scene = crowd_scene(seed) if crowd else random_scene(seed)
    truth = true_picture(scene, TRUE_TOLERANCE) if compared else None
    pixels, begun, pictures = [], (np.zeros(0), np.zeros(0, dtype=np.bool_)), []
    for tolerance in tolerances:
        seen = watch(scene, Settings(tolerance=tolerance, threads=1), tolerance == 1e-3)
        if seen is None:
            continue
        if seen.begun[0].size:
            begun = seen.begun
        true = seen.color if truth is None else truth
        pixels.append(pixels_of(seen, true, seed))
        off = float(np.sqrt(((seen.color - true) ** 2).mean()) / np.abs(true).mean()) / tolerance
        moves = seen.asked["motion"] is not None
        off = off if compared else np.nan
        pictures.append((tolerance, moves, seen.estimate / tolerance, off))
    return Seen(pixels, *begun, pictures)


def look_at_blocks(job: tuple[int, Values]) -> Blocks | None:
    """Blocks of a larger render of a random scene."""
    seed, values = job
    set_coefficients(values)
    scene = block_scene(seed)
    if scene is None:
        return None
    seen = [watch(scene, Settings(tolerance=x, threads=1)) for x in TOLERANCES[:2]]
    some = [each for each in seen if each is not None and any(b[1].size for b in each.blocks)]
    if not some:
        return None
    truth = true_picture(scene, BLOCK_TOLERANCE)
    centers = true_picture(scene, BLOCK_TOLERANCE, edges=False)
    return joined_blocks([blocks_of(each, truth, centers) for each in some])


def fit_blocks(found: Result, pool: ProcessPoolExecutor, quick: int) -> None:
    """Fit the error estimates of interpolated blocks."""
    sets = {}
    for seed in (FIT, HELD):
        jobs = [(scene, found.values) for scene in BLOCK_SCENES[seed][::quick]]
        some = [each for each in pool.map(look_at_blocks, jobs) if each is not None]
        sets[seed] = joined_blocks(some)
    for name, field, other in (
        ("RESIDUAL_FACTOR", "residual", "difference"),
        ("DIFFERENCE_FACTOR", "difference", "residual"),
    ):
        parts = []
        for seed in (FIT, HELD):
            b = sets[seed]
            mine = BY_NAME[name].before * getattr(b, field)
            rest = {"difference": 0.2, "residual": 1.2}[other] * getattr(b, other)
            some = (mine >= rest) & (mine > BLOCK_TOLERANCE)
            # relative, so that the blocks of a few pictures do not decide
            size = getattr(b, field)[some]
            bins = rules.log_bins(size, [1e-3, 1e-2])
            parts.append(Samples(b.true[some] / size, np.ones_like(size), bins))
        found.add(name, parts[0].fit(), parts[0], parts[1])


def fit_first_estimates(found: Result, seen: list[Seen], held: list[Seen]) -> None:
    """Fit what is assumed of pixels of which only outlines are known."""
    for name, crowded in (("CUT_PIXEL_ERROR", False), ("CROWDED_PIXEL_ERROR", True)):
        one, other = (
            np.concatenate([each.begun[each.crowded == crowded] for each in some])
            for some in (seen, held)
        )
        sets = [Samples(x, np.ones_like(x), np.zeros(x.size, np.int64)) for x in (one, other)]
        found.add(name, sets[0].fit(), sets[0], sets[1])


def law_bins(pixels: Pixels, values: Values) -> tuple[Array, Array, Array, Array]:
    """Pixels under motion: predicted cells to the power `GOAL_GROWTH` (n,), what they end with
    over their own goal (n,), bins by the logarithm of the cells, and that logarithm (n,).
    """
    slow = pixels.slow
    first = np.where(
        pixels.kind[slow] == 1, values["CUT_PIXEL_ERROR"],
        np.where(pixels.kind[slow] == 2, values["CROWDED_PIXEL_ERROR"], 1.0),
    ) * values["MOTION_ERROR_SHARE"]  # fmt: skip
    limit = np.maximum(pixels.grown[slow] * first**POWER, 1.0)
    cells = np.log2(limit) / GOAL_GROWTH
    return limit, pixels.end[slow] / limit, np.floor(cells).astype(np.int64), cells


def law_curve(pixels: Pixels, values: Values) -> tuple[Array, Array, Array]:
    """Mean logarithm of the cells, RMS end over the own goal, and weight, of each bin."""
    _, end, bin_, cells = law_bins(pixels, values)
    rows = [(bin_ == k) for k in np.unique(bin_) if (bin_ == k).sum() >= LEAST]
    table = np.array([(cells[m].mean(), rms(end[m]), m.sum()) for m in rows])
    return table[:, 0], table[:, 1], table[:, 2]


def fit_law(found: Result, pixels: Pixels) -> None:
    """Fit with which fraction of their goals pixels end."""
    best: tuple[float, Values] | None = None
    for share in SHARES:
        values = {**found.values, "MOTION_ERROR_SHARE": share}
        x, y, weight = law_curve(pixels, values)
        scale = np.sqrt(weight)
        (level, rise), *_ = np.linalg.lstsq(
            np.stack([scale, scale * x], axis=1), scale * y, rcond=None
        )
        off = (weight * (level + rise * x - y) ** 2).sum() / (weight * y * y).sum()
        values |= {
            "ACHIEVED_ERROR": float(level), "ACHIEVED_RISE": float(rise),
            "MIN_ACHIEVED_ERROR": float(y.min()), "MAX_ACHIEVED_ERROR": float(y.max()),
        }  # fmt: skip
        if best is None or off < 0.98 * best[0]:
            best = float(off), values
    assert best is not None
    names = (
        "ACHIEVED_ERROR", "ACHIEVED_RISE", "MIN_ACHIEVED_ERROR", "MAX_ACHIEVED_ERROR",
        "MOTION_ERROR_SHARE",
    )  # fmt: skip
    count = int(pixels.slow.sum())
    for name in names:
        found.enter(name, Fit(best[1][name], count, 1.0, 1.0, 1.0, 1.0))
    still = ~pixels.slow
    value = rms(pixels.end[still]) / rms(pixels.grown[still])
    found.enter("STILL_ACHIEVED_ERROR", Fit(value, int(still.sum()), 1.0, 1.0, 1.0, 1.0))


def law_quality(found: Result, pixels: Pixels, held: Pixels) -> None:
    """Measure the law, with the values in use, on renders that used them."""
    got = []
    for some in (pixels, held):
        _, end, bin_, cells = law_bins(some, found.values)
        v = found.values
        reached = np.clip(
            v["ACHIEVED_ERROR"] + v["ACHIEVED_RISE"] * cells,
            v["MIN_ACHIEVED_ERROR"], v["MAX_ACHIEVED_ERROR"],
        )  # fmt: skip
        moving = Samples(end, reached, bin_)
        still = ~some.slow
        first = found.values["STILL_ACHIEVED_ERROR"] * some.grown[still]
        size = np.floor(np.log2(np.maximum(some.grown[still], 1e-9)) / POWER / 3.0).astype(np.int64)
        got.append((moving.ratios(1.0), Samples(some.end[still], first, size).ratios(1.0)))
    for name in LAW:
        which = 1 if name == "STILL_ACHIEVED_ERROR" else 0
        more = quality(got[0][which], got[1][which])
        found.enter(name, replace(found.fits[name], **more))


LAW = (
    "ACHIEVED_ERROR", "ACHIEVED_RISE", "MIN_ACHIEVED_ERROR", "MAX_ACHIEVED_ERROR",
    "MOTION_ERROR_SHARE", "STILL_ACHIEVED_ERROR",
)  # fmt: skip


def pictures_of(seen: list[Seen]) -> Array:
    """Table (n, 4) of the pictures of scenes."""
    return np.array([picture for each in seen for picture in each.pictures])


def fit_share(found: Result, seen: list[Seen]) -> None:
    """Fit the fraction of the tolerance for which the goal is set."""
    estimates = pictures_of(seen)[:, 2] / found.values["BUDGETED_SHARE"]
    value = 1.0 / float(np.quantile(estimates, QUANTILE))
    found.enter("BUDGETED_SHARE", Fit(value, estimates.size, 1.0, 1.0, 1.0, 1.0))


def share_quality(found: Result, seen: list[Seen], held: list[Seen], share: float) -> None:
    """Measure it, from renders of the fit with `share`, and held-out ones with the value in use."""
    used = found.values["BUDGETED_SHARE"]
    each = pictures_of(seen)[:, 2] * used / share, pictures_of(held)[:, 2]
    got = [(float(np.quantile(x, QUANTILE)), float(x.max())) for x in each]
    more = quality(got[0], got[1])
    found.enter("BUDGETED_SHARE", replace(found.fits["BUDGETED_SHARE"], **more))


def fit_renders(found: Result, pool: ProcessPoolExecutor, quick: int) -> Array:
    """Fit the coefficients that concern whole renders; returns the held-out pictures."""
    fit_blocks(found, pool, quick)

    def all_of(seed: int, compared: bool) -> list[Seen]:
        jobs = [
            (n, False, TOLERANCES[: 2 + (n % 3 == 0)], found.values, compared)
            for n in SCENES[seed][::quick]
        ]
        jobs += [(n, True, TOLERANCES[:2], found.values, False) for n in CROWDS[seed]]
        return list(pool.map(look, jobs))

    first = all_of(FIT, False)
    told("first renders")
    pixels = joined([part for each in first for part in each.pixels])
    fit_first_estimates(found, first, first)
    fit_law(found, pixels)
    share = found.values["BUDGETED_SHARE"]
    second = all_of(FIT, True)
    told("second renders")
    fit_share(found, second)
    held = all_of(HELD, True)
    told("held-out renders")
    fit_first_estimates(found, first, held)
    parts = [joined([p for each in some for p in each.pixels]) for some in (second, held)]
    law_quality(found, parts[0], parts[1])
    share_quality(found, second, held, share)
    return pictures_of(held)


START = time.perf_counter()


def told(what: str) -> None:
    """Print progress."""
    print(f"{time.perf_counter() - START:6.0f} s  {what}", flush=True)


def main() -> None:
    """Fit all coefficients and write both files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a quarter of the scenes; print only")
    parser.add_argument("--processes", type=int, default=1)
    chosen = parser.parse_args()
    found = Result({}, {one.name: one.before for one in COEFFICIENTS})
    set_coefficients(found.values)
    fit_rules(found)
    told("integrals")
    with ProcessPoolExecutor(chosen.processes, get_context("spawn")) as pool:
        pictures = fit_renders(found, pool, 4 if chosen.quick else 1)
    for one in COEFFICIENTS:
        print(one.name, one.before, found.values[one.name], found.fits[one.name])
    if not chosen.quick:
        MODULE.write_text(module_text(found.fits), encoding="utf-8")
        PAGE.write_text(page_text(found.fits, pictures), encoding="utf-8")
    told("done")


if __name__ == "__main__":
    main()
