# SPDX-License-Identifier: GPL-3.0-or-later
"""The fitted coefficients of the error model: what each is, and the files that hold their values.

`fit_error_model` measures; this module lists the coefficients, rounds the measured values, and
writes the module of the core that holds them and the page that tells how well they fit.
"""

from __future__ import annotations

import hashlib
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
MODULE = ROOT / "adaptive_drt" / "numerics" / "error_coefficients.py"
PAGE = ROOT / "docs" / "error-model.md"
WIDTH = 100
DIGITS = 2
"""Significant digits of a fitted value: rounding differences between machines vanish in them."""


@dataclass(frozen=True)
class Coefficient:
    """A fitted coefficient of the error model.

    Attributes
    ----------
    name : of the constant.  where : module of the core that uses it.
    what : a sentence for its docstring.
    criterion : what the fitted value makes equal, in words, without a full stop.
    before : value fitted by hand, which was in use before there was a script.
    safety : stated factor on the fitted value.
    kept : why the value before is in use instead of the fitted one; empty if it is not.
    """

    name: str
    where: str
    what: str
    criterion: str
    before: Any
    safety: float = 1.0
    kept: str = ""


@dataclass(frozen=True)
class Fit:
    """A fitted value and how good it is.

    Attributes
    ----------
    value : before the safety factor.
    samples : number of samples of the fit.
    ratio, worst : RMS of true errors over that of the estimates by the value in use, over all
        samples and in the worst bin; for `BUDGETED_SHARE` and the like see their criterion.
    held_ratio, held_worst : the same for samples from other seeds.
    """

    value: Any
    samples: int
    ratio: float
    worst: float
    held_ratio: float
    held_worst: float


COEFFICIENTS = (
    Coefficient(
        "MULTI_NODE_ERROR",
        "cubature/evaluate",
        "Error of the multi-node rule as a fraction of the error of the centroid rule: (3, 4), by "
        "number of axes along which the domain extends (rows) and by kind of error (columns: "
        "bends, roots, kinks, steps).",
        "the RMS error of the rule equals the estimate, for transitions of each kind along a plane "
        "of random direction and place in a box (bends: within the penumbra of a straight edge "
        "before a round light, and light that falls off from a point)",
        [[0.005, 0.05, 0.09, 0.35], [0.02, 0.09, 0.15, 0.5], [0.02, 0.13, 0.2, 0.5]],
    ),
    Coefficient(
        "UNDETECTED_SHARE",
        "cubature/posteriori",
        "Fraction of the predicted error of roots, kinks and steps that is kept where the nodes of "
        "the multi-node rule do not detect them: they may lie between the nodes.",
        "the RMS error of the rule equals the estimate where the centroid differs from the mean of "
        "the nodes by less than half of `CONFIRMING_DIFFERENCE`",
        0.7,
    ),
    Coefficient(
        "UNPREDICTED_RATIO",
        "cubature/posteriori",
        "Difference between the multi-node mean and the radiance at the centroid, as a multiple of "
        "the predicted error, above which it shows variation that was not predicted.",
        "95 % of the differences caused by predicted roots, kinks and steps at random places are "
        "below it",
        2.0,
    ),
    Coefficient(
        "UNPREDICTED_SHARE",
        "cubature/posteriori",
        "Fraction of a difference that was not predicted which is added to the error of the "
        "multi-node rule.",
        "the RMS error of the rule equals this fraction of the RMS difference, for steps at random "
        "places",
        0.5,
    ),
    Coefficient(
        "FOURTH_MOMENT_CORRECTION",
        "cubature/limb_correction",
        "Coefficient of s^4 (1/3 - s^2), by which the mean of a root over a box with a corner at 0 "
        "is less than that of a uniform density; s^2 is the relative variance of its argument.",
        "least squares over boxes of two and three axes",
        0.2,
        kept="boxes beside the limb, which are more than those at it, are off by a fifth more with "
        "the fitted one",
    ),
    Coefficient(
        "SECTION_ERROR_FRACTION",
        "shading/partial_occlusion",
        "Error of the light that is left by spheres which the light's plane cuts, as a fraction of "
        "the difference between polygons of half as many corners and of all that stand for them. A "
        "polygon of N corners is off by some N^-2 where another outline crosses it, which gives "
        "1/3 on average.",
        "the RMS error equals the estimate, for random spheres in the planes of a parallelogram "
        "and of a disk; bins by whether the light's outline crosses the circle in which sphere and "
        "plane meet",
        0.5,
    ),
    Coefficient(
        "FALLOFF_ROOT_RATIO",
        "shading/unoccluded_variation",
        "Ratio of half a patch's extent and the distance to the light, from which the nodes of the "
        "cubature leave as much of the deviation by falloff as of a power of 3/2.",
        "the multi-node rule leaves the fraction that `MULTI_NODE_ERROR` has for bends of a square",
        0.3,
    ),
    Coefficient(
        "FALLOFF_KINK_RATIO",
        "shading/unoccluded_variation",
        "Ratio of half a patch's extent and the distance to the light, from which the nodes of the "
        "cubature leave as much of the deviation by falloff as of a kink.",
        "the multi-node rule leaves the fraction that `MULTI_NODE_ERROR` has for roots of a square",
        1.0,
    ),
    Coefficient(
        "FALLBACK_ERROR_FRACTION",
        "numerics/midpoint",
        "Error estimate of a pixel mean by the midpoint rule, as a fraction of the second "
        "difference, where neighbouring differences are missing.",
        "the RMS error equals the estimate, for kinks at random places within the pixel",
        1.0 / 16.0,
    ),
    Coefficient(
        "FOURTH_DIFFERENCE_WEIGHT",
        "numerics/midpoint",
        "Weight of the fourth difference in the error estimate of a pixel mean by the midpoint "
        "rule with a second-difference correction.",
        "the RMS error equals the estimate, for kinks at random places within the pixel",
        1.0 / 32.0,
    ),
    Coefficient(
        "REMAINING_ERROR",
        "image/midpoint_correction",
        "Error that remains after the correction of a pixel centre by second differences, as a "
        "fraction of the largest correction of the pixel and its neighbours.",
        "the RMS error equals the estimate in the worst bin, for smooth peaks of 1 to 8 pixels",
        0.3,
    ),
    Coefficient(
        "COEFFICIENT_DECAY",
        "image/chebyshev_blocks",
        "Factor by which the Chebyshev coefficients of a block of pixels may decay slower than the "
        "ratio of the last two of them tells.",
        "the RMS error of the bicubic equals the estimate in the worst bin, for light that falls "
        "off from a point",
        2.0,
        kept="light may also vary like sqrt(36 + s^2) at s pixels, or have a kink, and then the "
        "fitted one gives a fifth of the error",
    ),
    Coefficient(
        "TIME_ERROR_FACTOR",
        "image/block_interpolation",
        "Relative error of the three-point Gauss rule in time, as a multiple of the third power of "
        "the relative second difference of its samples.",
        "the RMS error equals the estimate in the worst bin, for lights that pass a point or come "
        "nearer",
        0.1,
    ),
    Coefficient(
        "RESIDUAL_FACTOR",
        "image/biquadratic_blocks",
        "Error estimate of pixel means interpolated over a block, as a multiple of the residual "
        "after the cubic correction.",
        "the RMS error of the means equals the estimate, over blocks of random moving scenes where "
        "this estimate is the larger of the two",
        1.2,
    ),
    Coefficient(
        "DIFFERENCE_FACTOR",
        "image/biquadratic_blocks",
        "Smallest error estimate of interpolated pixel means, as a fraction of the difference "
        "before the cubic correction: four check points do not resolve a kink.",
        "the RMS error of the means equals the estimate, over blocks of random moving scenes where "
        "this estimate is the larger of the two",
        0.2,
    ),
    Coefficient(
        "ACHIEVED_ERROR",
        "cubature/error_budget",
        "RMS error with which a pixel under motion ends, as a fraction of its own goal (the "
        "picture's goal, grown with the number of its cells), if a single cell is predicted for "
        "it.",
        "least squares over bins of the predicted number of cells, of the estimates with which "
        "pixels of random scenes end",
        0.575,
    ),
    Coefficient(
        "ACHIEVED_RISE",
        "cubature/error_budget",
        "Increase of that fraction with each doubling of the predicted number of cells.",
        "least squares, together with `ACHIEVED_ERROR`",
        0.02,
    ),
    Coefficient(
        "MIN_ACHIEVED_ERROR",
        "cubature/error_budget",
        "Smallest fraction of its goal with which a pixel under motion is predicted to end.",
        "the smallest such fraction of any bin of the predicted number of cells",
        0.0,
    ),
    Coefficient(
        "MAX_ACHIEVED_ERROR",
        "cubature/error_budget",
        "Largest fraction of its goal with which a pixel under motion is predicted to end.",
        "the largest such fraction of any bin of the predicted number of cells",
        0.77,
    ),
    Coefficient(
        "STILL_ACHIEVED_ERROR",
        "cubature/error_budget",
        "Error with which a pixel without motion ends, as a fraction of the goal times (e / "
        "goal)^`GOAL_POWER`, where e is its predicted error under the multi-node rule.",
        "the RMS of the estimates with which pixels of random still scenes end equals the "
        "prediction",
        0.53,
    ),
    Coefficient(
        "MOTION_ERROR_SHARE",
        "cubature/error_budget",
        "Constant c of the law c / n by which the error of a pixel under motion falls with n "
        "cells, as a fraction of its estimated error before refinement.",
        "least squares, together with `ACHIEVED_ERROR`",
        0.6,
    ),
    Coefficient(
        "CUT_PIXEL_ERROR",
        "cubature/error_budget",
        "Error assumed for a pixel of which nothing is known except that outlines cut it, as a "
        "fraction of the contrast.",
        "it is the RMS of the estimates after the first evaluation of such pixels",
        0.05,
    ),
    Coefficient(
        "CROWDED_PIXEL_ERROR",
        "cubature/error_budget",
        "Error assumed for such a pixel where many objects may be visible, as a fraction of the "
        "contrast.",
        "as `CUT_PIXEL_ERROR`",
        0.25,
    ),
    Coefficient(
        "BUDGETED_SHARE",
        "cubature/error_budget",
        "Fraction of the tolerance for which the goal is set. The rest is for errors that the "
        "estimates miss, and for pixels that end with more than the model predicts.",
        "the estimates of 95 % of random pictures are at most the tolerance; the safety factor is "
        "for scenes harder than those of the fit, and keeps the cost of pictures about as it was",
        0.72,
        safety=0.85,
    ),
)
BY_NAME = {one.name: one for one in COEFFICIENTS}


def rounded(value: Any) -> Any:
    """Round a number, or a nested list of numbers, to `DIGITS` significant digits."""
    if isinstance(value, list):
        return [rounded(x) for x in value]
    return float(f"{value:.{DIGITS}g}")


def in_use(one: Coefficient, fit: Fit | None) -> Any:
    """Value in use: the fitted one, times the stated safety factor, or the one before."""
    if fit is None or one.kept:
        return one.before
    return rounded((one.safety * np.array(rounded(fit.value))).tolist())


def digest(text: str) -> str:
    """Digest of the text of the module, without the line that states it."""
    lines = [line for line in text.splitlines() if not line.startswith("DIGEST = ")]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:16]


def evidence(one: Coefficient, fit: Fit | None) -> str:
    """How the value in use was found, and how good it is, in sentences."""
    if fit is None:
        return "Fitted by hand."
    held = f"{fit.held_ratio:.2f} (worst bin {fit.held_worst:.2f}) on other seeds"
    told = (
        f"Criterion: {one.criterion}. Samples: {fit.samples:,}. Measured over predicted: "
        f"{fit.ratio:.2f} (worst bin {fit.worst:.2f}), {held}."
    )
    if one.safety != 1.0:
        told += f" Includes a safety factor of {one.safety:g}."
    if one.kept:
        told += f" Fitted value {rounded(fit.value)}, not in use: {one.kept}."
    return told


HEAD = '''\
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted coefficients of the error model.

`make fit` writes this file; edits by hand are found by a test. What the coefficients are for, how
they are fitted and how well they do on other scenes than those of the fit: docs/error-model.md.
"""

import numpy as np

'''


def module_text(fits: dict[str, Fit]) -> str:
    """Text of the module; coefficients that are not in `fits` have the values before."""
    names = sorted(["DIGEST", *BY_NAME])
    text = HEAD + "__all__ = [\n" + "".join(f'    "{name}",\n' for name in names) + "]\n\n"
    body = ""
    for one in COEFFICIENTS:
        fit = fits.get(one.name)
        body += source_lines(one.name, in_use(one, fit))
        told = f'"""{one.what} {evidence(one, fit)}"""'
        body += textwrap.fill(told, WIDTH, break_long_words=False) + "\n"
    start, end = text + "\nDIGEST = ", '\n"""Digest of the other lines of this file."""\n' + body
    return start + f'"{digest(start + end)}"' + end


def source_lines(name: str, value: Any) -> str:
    """Assignment of a value, as the formatter breaks it."""
    if not isinstance(value, list):
        return f"{name} = {value!r}\n"
    whole = f"{name} = np.array({value!r})\n"
    if len(whole) <= WIDTH + 1:
        return whole
    return f"{name} = np.array(\n    {value!r}\n)\n"


PAGE_HEAD = """\
# The error model

"EXACT" refines pixels until their estimated errors are small enough, so a picture is as good as the
estimates are. Constants of the estimates are of three sorts. Those that follow from theory are
derived in the code or in their docstrings. Choices, such as limits on work, say that they are
choices. The others are fitted: they are listed here. `make fit` fits them to random integrands and
to renders of random scenes, and writes this page and `adaptive_drt/numerics/error_coefficients.py`.
It takes some five minutes on one core (`--processes 2` halves that), and does not depend on the
values that the file holds before.
"""

TABLE_NOTE = """
"Fit" and "held out" are true errors over estimated ones by the value in use, RMS over all samples,
and in the worst bin in brackets, on the seeds of the fit and on others. Where a coefficient is no
factor on an estimate, they are what its criterion speaks of, over what it asks for: a quantile, a
threshold, or, for the law of the error budget, the estimates with which pixels end over predicted
ones. Values are rounded to two digits.
"""


def shown(value: Any) -> str:
    """Value as text in the table."""
    if isinstance(value, list):
        return "<br>".join(" ".join(f"{x:.3g}" for x in row) for row in value)
    return f"{value:.3g}"


def page_text(fits: dict[str, Fit], pictures: Any) -> str:
    """Text of the page.

    pictures : (n, 4) of the held-out renders: tolerance, whether anything moves, and the estimated
    and the true error over the tolerance.
    """
    lines = [PAGE_HEAD, "| coefficient | in use | fitted | before | samples | fit | held out |"]
    lines.append("| --- | --- | --- | --- | --- | --- | --- |")
    for one in COEFFICIENTS:
        fit = fits[one.name]
        lines.append(
            f"| `{one.name}` | {shown(in_use(one, fit))} | {shown(rounded(fit.value))} "
            f"| {shown(one.before)} | {fit.samples:,} | {fit.ratio:.2f} ({fit.worst:.2f}) "
            f"| {fit.held_ratio:.2f} ({fit.held_worst:.2f}) |"
        )
    lines += [TABLE_NOTE, "## What each is", ""]
    for one in COEFFICIENTS:
        text = f"- `{one.name}` (`{one.where}`): {one.what} Criterion: {one.criterion}."
        if one.safety != 1.0:
            text += f" The value in use has a safety factor of {one.safety:g}."
        if one.kept:
            text += f" The value before is in use: {one.kept}."
        lines.append(textwrap.fill(text, WIDTH, subsequent_indent="  ", break_long_words=False))
    lines += ["", *picture_lines(np.asarray(pictures))]
    return "\n".join(lines) + "\n"


def picture_lines(pictures: Any) -> list[str]:
    """Section on whole pictures that the fit has not seen."""
    lines = [
        "## Pictures that the fit has not seen", "",
        "Errors over the tolerance, of random scenes and, estimated only, of scenes with thirty",
        "moving spheres. True errors are against the same renderer at 0.005 %; at 0.01 % they are",
        "not measured.", "",
        "| tolerance | pictures | estimated: median, 95 %, largest | true: median, 95 %, largest |",
        "| --- | --- | --- | --- |",
    ]  # fmt: skip
    for tolerance in sorted(set(pictures[:, 0]), reverse=True):
        some = pictures[pictures[:, 0] == tolerance]
        cells = []
        for column in (2, 3):
            values = some[:, column][np.isfinite(some[:, column])]
            if tolerance < 1e-3 and column == 3:
                cells.append("")
                continue
            each = (np.median(values), np.quantile(values, 0.95), values.max())
            cells.append(", ".join(f"{x:.2f}" for x in each))
        lines.append(f"| {100.0 * tolerance:g} % | {len(some)} | {cells[0]} | {cells[1]} |")
    return lines
