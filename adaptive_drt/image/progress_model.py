# SPDX-License-Identifier: GPL-3.0-or-later
"""How far an exact render is, so that a bar moves as the time does. Nothing else goes by this."""

from __future__ import annotations

from ..tracing.compile import Plan

__all__ = ["ASKED_SHARES", "course"]

STILL_REST, MOVING_REST = 1.2, 4.0
"""Times as long as the survey the rest takes in a picture of `MEASURED` pixels at a tolerance of
0.001: on the benchmark's scenes, most of them within a factor of 2. By square roots it is more
where the tolerance is smaller, and less where pixels are more, since outlines grow as sides do."""
MEASURED = 480 * 320
BLOCKS_SHARE, BESIDE_SHARE = 0.5, 0.85
"""Of that rest, what blocks take in a moving scene (0.4 to 0.6); and where a worker refines beside
them what they cannot settle (0.7 to 0.95)."""
OUTLINES_SHARE = 0.4
"""In a still one, what outlines' regions take."""
ASKED_SHARES = (0.2, 0.25, 0.55)
"""Of what blocks take, the coarsest first."""


def course(plan: Plan, beside: bool = False) -> tuple[float, float]:
    """What part of the work the survey is, and what part with outlines or blocks besides.

    beside : whether workers refine some pixels beside blocks.
    """
    rest, first = STILL_REST, OUTLINES_SHARE
    if plan.motion:
        rest, first = MOVING_REST, BESIDE_SHARE if beside else BLOCKS_SHARE
    left, bottom, right, top = plan.region
    size = (right - left) * (top - bottom)
    rest *= (0.001 / plan.settings.tolerance * MEASURED / size) ** 0.5
    surveyed = 1.0 / (1.0 + rest)
    return surveyed, surveyed + first * (1.0 - surveyed)
