# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes on the edge of a decision, and the pixels that truly depend on a domain.

Each is a floor, a light and one object placed so that at one chosen pixel it touches something
from inside or outside: off by 1e-3 down to 1e-12 of its radius, either way. One object, so that
the truth is a comparison of angles: `oracle.exact_mask`.
"""

import numpy as np

from adversarial_lights import ball_light, contact, quad_before_ball, quad_light, tiny_ball
from adversarial_pixels import outline, passing, passing_shadow, shadow_line, speck

__all__ = ["FAMILIES", "adversarial"]

FAMILIES = (
    ball_light,
    quad_light,
    tiny_ball,
    contact,
    quad_before_ball,
    outline,
    speck,
    shadow_line,
    passing,
    passing_shadow,
)


def adversarial(seed):
    """The scene of a seed: its family in turn."""
    rng = np.random.default_rng((seed, 6))
    return FAMILIES[seed % len(FAMILIES)](rng)
