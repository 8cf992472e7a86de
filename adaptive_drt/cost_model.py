# SPDX-License-Identifier: GPL-3.0-or-later
"""Cost model of adaptive distribution from section 2.2 of the paper.

a : distributed pixels / all pixels.
b : time of a pixel traced with derivatives and detection / time of a plainly traced pixel.
c : rays of a distributed pixel.
"""

from __future__ import annotations

__all__ = ["adaptive_is_faster", "predicted_ratio"]


def predicted_ratio(a: float, b: float, c: float) -> float:
    """Predicted time of adaptive distribution over that of distributing everywhere: equation 10."""
    return (a * c + b - a) / c


def adaptive_is_faster(a: float, b: float, c: float) -> bool:
    """Whether adaptive distribution is predicted to be faster: equation 11."""
    return b < c - a * (c - 1.0)
