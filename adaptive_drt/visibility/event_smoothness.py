# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes in which no outline meets the beginning or the end of the box's time, nor another outline.

There the moment at which an object comes or goes changes smoothly from ray to ray: a few lines
along t tell its mean, and no kink can hide between them.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from .line_intervals import ENDS
from .polynomials import Balls, Flats, Forms, form_range

__all__ = ["find_smooth"]


def find_smooth(forms: Forms, full: Mask, box: Ints, count: int) -> Mask:
    """Whether the times at which m candidates are seen change smoothly across boxes: (count,).

    Never a false yes for boxes whose candidates are in order of depth.

    full : (m,) candidates that cover their boxes.  box : (m,) whose they are.
    """
    always, once = full.copy(), np.zeros_like(full)
    for row, (stays, turns) in (
        (forms.balls.row, _balls(forms.balls)),
        (forms.flats.row, _flats(forms.flats)),
    ):
        always[row] |= stays
        once[row] = turns
    changing = np.bincount(box[once & ~always], minlength=count)
    rough = np.bincount(box[~(once | always)], minlength=count)
    smooth: Mask = (rough == 0) & (changing <= 1)
    return smooth


def _at(form: Array, time: float) -> Array:
    """A form (T, k, m) at a time: (1, k, m)."""
    value = form[-1:]
    for power in range(form.shape[0] - 2, -1, -1):
        value = form[power : power + 1] + time * value
    return value


def _ends(form: Array) -> tuple[tuple[Mask, Mask], tuple[Mask, Mask]]:
    """Whether a form is above 0 all over, and below it all over, at each end: (m,) each."""
    ranges = [form_range(_at(form, end)) for end in ENDS]
    above = ranges[0][0] > 0.0, ranges[1][0] > 0.0
    return above, (ranges[0][1] < 0.0, ranges[1][1] < 0.0)


def _balls(balls: Balls) -> tuple[Mask, Mask]:
    """Which spheres are seen all the time or never, and which come or go at simple roots."""
    above, below = _ends(balls.discriminant)
    ahead = _ends(balls.along)[0]
    plain = ahead[0] & ahead[1] & (form_range(balls.gap)[0] > 0.0)
    # D is concave in t: between two ends above 0 it is, and from below to above it passes once
    within = form_range(_at(balls.discriminant, 0.0))[0] > 0.0
    turns = (above[0] & below[1]) | (below[0] & above[1]) | (below[0] & below[1] & within)
    return plain & above[0] & above[1], plain & turns


def _flats(flats: Flats) -> tuple[Mask, Mask]:
    """The same of quads: edge functions are linear in t, and all but one must keep their sign."""
    low, high = form_range(flats.facing)
    sure = (low > 0.0) | (high < 0.0)
    side = np.where(low > 0.0, 1.0, -1.0)
    kept, changed = np.zeros((2, side.size), dtype=np.int64)
    never = np.zeros(side.size, dtype=np.bool_)
    for bound in (*flats.edges, flats.height):
        above, below = _ends(side * bound)
        kept += above[0] & above[1]
        changed += (above[0] & below[1]) | (below[0] & above[1])
        never |= below[0] & below[1]
    bounds = len(flats.edges) + 1
    stays = (kept == bounds) | never
    turns = (kept == bounds - 1) & (changed == 1)
    return sure & stays, sure & turns & ~stays
