# SPDX-License-Identifier: GPL-3.0-or-later
"""Costs of a pixel by light in closed form and by rays: which is to be used for a tolerance."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Mask

__all__ = ["rays_cost_less"]


CLOSED_SECONDS = (2e-4, 8e-6)
RAY_SECONDS = 6e-7
RAYS_AT_ONE_PERCENT = (200.0, 600.0)
RAYS_POWER = 1.4
POINTS_AT_ONE_PERCENT = (1.0, 25.0)
POINTS_POWER = 0.4


def rays_cost_less(number: Array, silhouette: Mask, tolerance: float) -> Mask:
    """Whether sampling pixels by rays costs less than light in closed form: (n,).

    Parameters
    ----------
    number : (n,) number of occluders of a point of each pixel.
    silhouette : (n,) whether silhouettes pass through the pixel.
    tolerance : of the picture.
    """
    finer = 0.01 / tolerance
    points = np.where(silhouette, POINTS_AT_ONE_PERCENT[1] * finer**POINTS_POWER, 1.0)
    closed = points * (CLOSED_SECONDS[0] + CLOSED_SECONDS[1] * number)
    rays = np.where(silhouette, RAYS_AT_ONE_PERCENT[1], RAYS_AT_ONE_PERCENT[0])
    less: Mask = rays * finer**RAYS_POWER * RAY_SECONDS < closed
    return less
