# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicted work in the stages of an exact render, used only to make a progress bar linear."""

from __future__ import annotations

from ..tracing.compile import Plan

__all__ = ["LEVEL_SHARES", "progress_shares"]

STILL_WORK_RATIO, MOVING_WORK_RATIO = 1.2, 4.0
"""Work after the first pass as a multiple of the first pass, in a still and in a moving scene, for
`REFERENCE_PIXELS` pixels at a tolerance of 0.001: on the benchmark's scenes, most of them within a
factor of 2. It varies as the square root of 1 / tolerance, and of 1 / pixels, since outlines grow
as the sides of the picture do."""
REFERENCE_PIXELS = 480 * 320
BLOCKS_SHARE, CONCURRENT_BLOCKS_SHARE = 0.5, 0.85
"""Fraction of that remaining work which interpolation over blocks takes in a moving scene (0.4 to
0.6); and where a worker meanwhile refines what blocks cannot resolve (0.7 to 0.95)."""
OUTLINES_SHARE = 0.4
"""Fraction of the remaining work which shading the regions of outlines takes in a still scene."""
LEVEL_SHARES = (0.2, 0.25, 0.55)
"""Fractions of the work on blocks by level, the coarsest first."""


def progress_shares(plan: Plan, beside: bool = False) -> tuple[float, float]:
    """Cumulative fractions of the work after the first pass, and after outlines or blocks.

    beside : whether workers refine some pixels while blocks are interpolated.
    """
    rest, first = STILL_WORK_RATIO, OUTLINES_SHARE
    if plan.motion:
        rest, first = MOVING_WORK_RATIO, CONCURRENT_BLOCKS_SHARE if beside else BLOCKS_SHARE
    left, bottom, right, top = plan.region
    size = (right - left) * (top - bottom)
    rest *= (0.001 / plan.settings.tolerance * REFERENCE_PIXELS / size) ** 0.5
    surveyed = 1.0 / (1.0 + rest)
    return surveyed, surveyed + first * (1.0 - surveyed)
