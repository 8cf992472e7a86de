# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes in which the times of visibility events are smooth functions of the ray.

In such a box no outline crosses the start or the end of the box's time interval, nor another
outline. The time at which an object appears or disappears then varies smoothly from ray to ray: its
mean follows from a few lines along t, and there is no kink between them.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Ints, Mask
from .polynomials import CandidatePolynomials

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
    for group in forms.groups:
        if group.rows.size:
            stays, changes = group.smooth_events()
            always[group.rows] |= stays
            once[group.rows] = changes
    changing = np.bincount(box[once & ~always], minlength=count)
    rough = np.bincount(box[~(once | always)], minlength=count)
    smooth: Mask = (rough == 0) & (changing <= 1)
    return smooth
