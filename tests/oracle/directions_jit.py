# SPDX-License-Identifier: GPL-3.0-or-later
"""Directions that oracles sample, compiled."""

import math

from .vectors_jit import add, cross, dot, jit, times

__all__ = ["balanced", "turned"]


@jit
def balanced(cosine, ahead, dd, area):
    """Cosine over the sum of the densities, over solid angle, of both ways to find a direction."""
    by_area = dd * math.sqrt(dd) / (ahead * area)
    return cosine / (by_area + cosine / math.pi)


@jit
def turned(axis, height, turn):
    """Unit vector of a given cosine to an axis, turned about it."""
    helper = (1.0, 0.0, 0.0) if abs(axis[0]) < 0.5 else (0.0, 1.0, 0.0)
    first = cross(axis, helper)
    first = times(1.0 / math.sqrt(dot(first, first)), first)
    second = cross(axis, first)
    side = math.sqrt(max(1.0 - height * height, 0.0))
    across = add(times(side * math.cos(turn), first), times(side * math.sin(turn), second))
    return add(times(height, axis), across)
