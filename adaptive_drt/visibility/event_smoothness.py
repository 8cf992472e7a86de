# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes in which the times of visibility events are smooth functions of the ray.

In such a box no outline crosses the start or the end of the box's time interval, nor another
outline. The time at which an object appears or disappears then varies smoothly from ray to ray: its
mean follows from a few lines along t, and there is no kink between them.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from .line_intervals import LINE_ENDS
from .polynomials import CandidatePolynomials, QuadPolynomials, SpherePolynomials, polynomial_range

__all__ = ["find_smooth_boxes"]


def find_smooth_boxes(forms: CandidatePolynomials, full: Mask, box: Ints, count: int) -> Mask:
    """Whether the times at which m candidates are seen vary smoothly across each box: (count,).

    The answer is conservative, with no false positives, for boxes whose candidates are in order of
    depth.

    Parameters
    ----------
    full : (m,) candidates that cover their boxes.  box : (m,) the box of each candidate.
    """
    always, once = full.copy(), np.zeros_like(full)
    for row, (stays, turns) in (
        (forms.balls.row, _classify_spheres(forms.balls)),
        (forms.flats.row, _classify_quads(forms.flats)),
    ):
        always[row] |= stays
        once[row] = turns
    changing = np.bincount(box[once & ~always], minlength=count)
    rough = np.bincount(box[~(once | always)], minlength=count)
    smooth: Mask = (rough == 0) & (changing <= 1)
    return smooth


def _restrict_to_time(form: Array, time: float) -> Array:
    """Restrict polynomials (T, k, m) to a time: (1, k, m)."""
    value = form[-1:]
    for power in range(form.shape[0] - 2, -1, -1):
        value = form[power : power + 1] + time * value
    return value


def _signs_at_ends(form: Array) -> tuple[tuple[Mask, Mask], tuple[Mask, Mask]]:
    """Whether polynomials are positive everywhere, and negative everywhere, at each end of the
    time.

    Returns (positive at the start, at the end), (negative at the start, at the end), (m,) each.
    """
    ranges = [polynomial_range(_restrict_to_time(form, end)) for end in LINE_ENDS]
    above = ranges[0][0] > 0.0, ranges[1][0] > 0.0
    return above, (ranges[0][1] < 0.0, ranges[1][1] < 0.0)


def _classify_spheres(balls: SpherePolynomials) -> tuple[Mask, Mask]:
    """Classify spheres: those that are hit always, and those that appear or disappear smoothly.

    Returns two masks (m,): spheres that all rays hit at all times, and spheres whose discriminant
    has simple roots in time for all rays, either a single one, or two where it is negative at both
    ends.
    """
    above, below = _signs_at_ends(balls.discriminant)
    ahead = _signs_at_ends(balls.along)[0]
    plain = ahead[0] & ahead[1] & (polynomial_range(balls.gap)[0] > 0.0)
    # the discriminant is concave in t: positive at both ends it is so between, and it changes sign
    # once from negative to positive
    within = polynomial_range(_restrict_to_time(balls.discriminant, 0.0))[0] > 0.0
    turns = (above[0] & below[1]) | (below[0] & above[1]) | (below[0] & below[1] & within)
    return plain & above[0] & above[1], plain & turns


def _classify_quads(flats: QuadPolynomials) -> tuple[Mask, Mask]:
    """Classify quads like `_classify_spheres` does spheres.

    Edge functions are linear in t; for a smooth event all but one of them must keep their sign.
    """
    low, high = polynomial_range(flats.facing)
    sure = (low > 0.0) | (high < 0.0)
    side = np.where(low > 0.0, 1.0, -1.0)
    kept, changed = np.zeros((2, side.size), dtype=np.int64)
    never = np.zeros(side.size, dtype=np.bool_)
    for bound in (*flats.edges, flats.height):
        above, below = _signs_at_ends(side * bound)
        kept += above[0] & above[1]
        changed += (above[0] & below[1]) | (below[0] & above[1])
        never |= below[0] & below[1]
    bounds = len(flats.edges) + 1
    stays = (kept == bounds) | never
    turns = (kept == bounds - 1) & (changed == 1)
    return sure & stays, sure & turns & ~stays
