# SPDX-License-Identifier: GPL-3.0-or-later
"""Costs of a pixel by light in closed form and by rays, and which of them is less.

The figures are seconds of one thread of the machine that `benchmarks/ray_costs.py` ran on; only
their ratios matter, which are alike elsewhere. They need not be exact: where both costs are alike
it does not matter which is chosen. The stated error holds in either case.
"""

from __future__ import annotations

import numpy as np

from ..geometry.shape_table import ShapeTable
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask

__all__ = [
    "REFERENCE_TOLERANCE",
    "UNKNOWN_FORM_COST",
    "occluder_costs",
    "rays_cost_less",
    "regions_cost_more",
]


POINT_SECONDS, OCCLUDER_SECONDS = 5.8e-5, 2.7e-6
"""Seconds of light in closed form at a point, with its candidates, and of each occluder there."""
UNKNOWN_FORM_COST = 500.0
"""Cost of an occluder whose outline has no closed form before a light, relative to a sphere's: the
thousand rays of a point are tested with each. Ellipsoids and sticks before an environment's image
take 1.3 to 1.5 ms each at a point."""
SAMPLE_SECONDS = 1.9e-6
"""Seconds of one point of a sampled pixel with its rays to one light."""
FILLED_SAMPLES, CUT_SAMPLES, SAMPLES_POWER = 150.0, 316.0, 1.65
"""Points of a sampled pixel at a tolerance of 1 %: of one that an object fills, and of one with
outlines; and the power of the inverse of the tolerance that they grow with. Packed balls take 64
and 168, sparse ones 375 and 593: the figures lie between them."""
FILLED_POINTS, CUT_POINTS, POINTS_POWER = 1.8, 39.0, 0.26
"""The same for points in closed form: 1.7 and 29 of packed balls, 1.9 and 53 of sparse ones."""
BLOCK_POINTS = 0.4
"""Points in closed form for each pixel of a block of 8 x 8 that may be interpolated, at any
tolerance: a quarter, and what blocks cost that prove not to be smooth."""
LEAST_OCCLUDERS = 12
"""Number of occluders of a point below which rays are not used: closed forms of few circles in
large batches cost less than `POINT_SECONDS`. 400 sparse spheres under a square light take 1.37 s
with 0, 0.90 with 6 and 0.85 with 12; 1,000 in a gas 7.3, 6.3 and 5.4 s (1 %)."""
REGION_SECONDS = 1.1e-5
"""Seconds of finding the visible regions of a pixel, for each pair of objects that may be seen in
it, relative to `CUT_SAMPLES`. Once takes 7e-5 (30 objects: 70 ms) and is repeated in each cell; but
pixels of so many objects have contrasts that take up to 20 times as many samples."""
REFERENCE_TOLERANCE = 0.01
"""Tolerance of these numbers, and of those of other modules that say so."""


def occluder_costs(table: ShapeTable, light: Emitter) -> Array:
    """Costs (objects,) of closed forms of what objects hide of a light, relative to a sphere's."""
    costs = [each.occluder_cost for each in table.sets]
    if light.profile is not None or light.environment is not None:
        costs = [
            max(cost, UNKNOWN_FORM_COST) if each.has_elliptic_outlines else cost
            for each, cost in zip(table.sets, costs, strict=True)
        ]
    return np.repeat(costs, np.diff(table.firsts))


def rays_cost_less(number: Array, cut: Mask | None, tolerance: float) -> Mask:
    """Whether sampling pixels by rays costs less than light in closed form: (n,).

    Parameters
    ----------
    number : (n,) number of occluders of a point of each pixel, summed over the lights, each
        counted by its cost (`occluder_costs`).
    cut : (n,) whether outlines may pass through the pixel; None for pixels of blocks that may be
        interpolated.
    tolerance : of the picture.
    """
    finer = REFERENCE_TOLERANCE / tolerance
    points, samples = np.full(number.size, BLOCK_POINTS), np.full(number.size, FILLED_SAMPLES)
    if cut is not None:
        points = np.where(cut, CUT_POINTS, FILLED_POINTS) * finer**POINTS_POWER
        samples = np.where(cut, CUT_SAMPLES, FILLED_SAMPLES)
    closed = points * (POINT_SECONDS + OCCLUDER_SECONDS * number)
    less: Mask = samples * finer**SAMPLES_POWER * SAMPLE_SECONDS < closed
    return less & (number >= LEAST_OCCLUDERS)


def regions_cost_more(count: Ints, tolerance: float) -> Mask:
    """Whether sampling pixels by rays costs less than finding the regions of what is seen: (n,).

    Parameters
    ----------
    count : (n,) number of objects that may be seen in each pixel with outlines, 0 in others.
    tolerance : of the picture.
    """
    finer = REFERENCE_TOLERANCE / tolerance
    regions = REGION_SECONDS * np.square(count, dtype=np.float64) * finer**POINTS_POWER
    more: Mask = CUT_SAMPLES * SAMPLE_SECONDS * finer**SAMPLES_POWER < regions
    return more
