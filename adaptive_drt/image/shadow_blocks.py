# SPDX-License-Identifier: GPL-3.0-or-later
"""Interpolation of the visible fraction of light over blocks of sampled pixels.

Shadows that distributed rays sample vary slowly over pixels inside a penumbra, and not at all
beside it. Where all pixels of a block see the same lights, and all of them or none, the block is
uniform: outlines prove it, or enough rays from pixels that these reach (`shading.filled_light`).
Elsewhere 3 x 3 nodes at pixel centres are sampled to a small error, and four more pixels measure
the error of the interpolating polynomial, as in `biquadratic_blocks`. What nodes may step over,
such as the shadow of a wire, the few rays from each pixel in between meet: their mean must agree
with that of the polynomial.
"""

from __future__ import annotations

import numpy as np

from ..cubature.error_budget import Goal
from ..cubature.sampled_centers import SampledCenters
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.error_coefficients import DIFFERENCE_FACTOR, RESIDUAL_FACTOR
from ..numerics.gather import columns
from ..numerics.vector import rms
from ..shading.center_light import MIXED
from ..shading.filled_light import FIRST_RAYS
from ..shading.sampled_occlusion import UNSEEN_SHARE
from .biquadratic_blocks import (
    CHECK_POINTS,
    cubic_means,
    cubic_terms,
    node_means,
    node_weights,
    tensor_sums,
)
from .frame import Frame
from .pixel_neighbours import agrees_around

__all__ = [
    "AGREEMENT",
    "INTERPOLATION_ERROR_SHARE",
    "NODE_ERROR_SHARE",
    "SIDES",
    "UNIFORM",
    "ShadowBlocks",
]


SIDES = (16, 8, 4)
"""Sides of blocks in pixels, the larger first. Nodes lie at pixel centres."""
INTERPOLATION_ERROR_SHARE = 0.5
"""Largest interpolation error allowed, as a fraction of the goal. Chosen for cost, not fitted."""
NODE_ERROR_SHARE = 0.3
"""Error of the light at nodes, as a fraction of the goal, at which they take no more rays. Chosen
for cost, not fitted."""
UNIFORM = 1e-3
"""Fraction of a light from whole numbers up to which all of it, or nothing, seems visible."""
SMALLEST_SQUARE = 4
"""Side in pixels of the smallest squares over which the polynomial is compared with single rays."""
AGREEMENT = 3.5
"""Largest difference between means of the polynomial and of single rays over a block, in standard
deviations of the latter, beyond the error allowed."""


class ShadowBlocks:
    """Blocks of one side whose pixels one object fills, and whose light is to be interpolated."""

    def __init__(self, frame: Frame, goal: Goal, node_goal: Goal, side: int) -> None:
        """Find the candidate blocks; no node values are requested yet.

        goal : error goal of interpolation, and of what all rays of uniform blocks may have missed.
        node_goal : error goal of what is sampled.
        """
        self._frame, self._goal, self._node_goal, self._side = frame, goal, node_goal, side
        assert frame.centers is not None
        self._centers = frame.centers
        self._wanted = frame.unsettled_centers(goal)
        self._origin = np.zeros(0, dtype=np.int64)
        if self._wanted.any():
            self._origin = self._candidates()
            self._settle_uniform()
        if not frame.interpolates_shadows:
            self._origin = self._origin[:0]

    def missing_pixels(self) -> Ints:
        """Pixels whose light these blocks need and that is not yet known: ascending indices."""
        every = np.zeros(self._wanted.size, dtype=np.bool_)
        for some in (self._nodes, self._checks):
            every[some] = True
        unknown: Ints = (every & (self._centers.error > self.node_limit)).nonzero()[0]
        return unknown

    @property
    def node_limit(self) -> float:
        """Error of the light at nodes that is small enough, as a radiance."""
        return NODE_ERROR_SHARE * self._node_goal.error

    @property
    def _allowed(self) -> float:
        return INTERPOLATION_ERROR_SHARE * self._goal.error

    @property
    def _pixels(self) -> Ints:
        """Indices of all pixels of the blocks, row by row: (side * side, b)."""
        return self._offsets(self._side, 1)

    @property
    def _nodes(self) -> Ints:
        """Pixel indices of the nodes, row by row: (9, b)."""
        return self._offsets(3, self._side // 2)

    @property
    def _checks(self) -> Ints:
        """Pixel indices of the check points, centred between nodes, row by row: (4, b)."""
        step = self._side // 4
        return self._offsets(2, 2 * step) + step * (self._frame.width + 1)

    def _offsets(self, size: int, step: int) -> Ints:
        """Indices (size * size, b) of a square of pixels of each block, `step` apart."""
        y, x = np.divmod(np.arange(size * size), size)
        rows: Ints = self._origin + step * (y * self._frame.width + x)[:, None]
        return rows

    def _candidates(self) -> Ints:
        """Index of the first pixel (b,) of each block that one object fills."""
        frame, side = self._frame, self._side
        first_x, first_y, across, up = frame.grid(side)
        if across <= 0 or up <= 0:
            return np.zeros(0, dtype=np.int64)

        y, x = np.nonzero(frame.block_windows(self._wanted, side, side).any(axis=(2, 3)))
        shown = frame.block_windows(self._centers.item, side, side + 1)[y, x]
        low, high = shown.min(axis=(1, 2)), shown.max(axis=(1, 2))
        keep = ((low == high) & (low >= 0)).nonzero()[0]
        origin: Ints = (first_y + side * y[keep]) * frame.width + first_x + side * x[keep]
        return origin

    def _settle_uniform(self) -> None:
        """Settle the blocks from all pixels of which the same lights are visible, as a whole."""
        size = self._side + 1
        seen = self._frame.first_points.visibility[self._offsets(size, 1)]
        same = (seen == seen[0]).all(axis=0) & (seen[0] != MIXED)
        rows = self._pixels
        bright = rms(columns(self._centers.unhidden, rows)).max(axis=0, initial=0.0)
        count = self._centers.reached[self._offsets(size, 1)].sum(axis=0)
        unseen = UNSEEN_SHARE / (FIRST_RAYS * np.maximum(count, 1)) * bright
        chosen = (same & (unseen <= self._allowed)).nonzero()[0]
        rows = columns(rows, chosen)
        color = self._centers.mean_color(rows)
        # beside a pixel that sees a light in part, too few rays look for the same shadow
        visibility, reached = self._frame.first_points.visibility, self._centers.reached
        alone = agrees_around(visibility, self._frame.width) | ~reached
        self._settle(rows, color, np.broadcast_to(unseen[chosen], rows.shape), alone[rows])
        rest = np.ones(self._origin.size, dtype=np.bool_)
        rest[chosen] = False
        self._origin = self._origin[rest]

    def enter(self, rows: Ints, found: SampledCenters) -> None:
        """Enter the light at nodes."""
        self._centers.enter(rows, found.light)

    def settle(self) -> None:
        """Interpolate the blocks whose estimated error is small enough."""
        if not self._origin.size:
            return
        centers, side = self._centers, self._side
        nodes = columns(centers.fraction, self._nodes)
        weights = node_weights(CHECK_POINTS)
        miss = columns(centers.fraction, self._checks) - tensor_sums(nodes, weights, weights)
        up, across, rest = cubic_terms(miss)
        off = np.maximum(
            RESIDUAL_FACTOR * rms(rest).max(axis=0), DIFFERENCE_FACTOR * rms(miss).max(axis=0)
        )
        means = node_means(nodes, side, True) + cubic_means(up, across, side, True)
        means = np.clip(means, 0.0, 1.0)
        rows = self._pixels
        bright = rms(columns(centers.unhidden, rows)).max(axis=0)
        size = np.where(bright > 0.0, bright, 1.0)
        fine = off * bright <= self._allowed
        fine &= self._rays_agree(means, self._allowed / size)
        error = np.hypot(off * bright, centers.error[self._nodes].max(axis=0))
        chosen = fine.nonzero()[0]
        rows = columns(rows, chosen)
        means = columns(means, chosen, -1)
        color = self._product_means(rows, means)
        known = self._known(rows, means)
        self._settle(rows, color, np.broadcast_to(error[chosen], rows.shape), known)

    def _rays_agree(self, means: Array, allowed: Array) -> Mask:
        """Whether few rays from each centre agree with fractions (3, side * side, b), on average
        over each block and over squares of 4 x 4 pixels and larger ones in it: (b,).

        allowed : (b,) difference of fractions that does not matter.
        """
        shape = (self._side, self._side, means.shape[-1])
        expected = means.mean(axis=0).reshape(shape)
        excess = self._centers.first_fraction[self._pixels].reshape(shape) - expected
        variance = expected * (1.0 - expected) / FIRST_RAYS
        fine = np.ones(means.shape[-1], dtype=np.bool_)
        size = 1
        while size < self._side:
            size *= 2
            excess, variance = _sums_of_squares(excess), _sums_of_squares(variance)
            if size >= SMALLEST_SQUARE:
                limit = size * size * allowed + AGREEMENT * np.sqrt(variance)
                fine &= (np.abs(excess) <= limit).all(axis=(0, 1))
        return fine

    def _product_means(self, rows: Ints, fraction: Array) -> Array:
        """Means (3, side * side, b) of the unhidden light times the visible fraction, less `taken`.

        To second order the first is the product of the means, and a twelfth of that of the slopes.
        """
        grid = (3, self._side, self._side, rows.shape[1])
        light, part = columns(self._centers.mean, rows).reshape(grid), fraction.reshape(grid)
        mean = light * part
        for axis in (1, 2):
            mean += np.gradient(light, axis=axis) * np.gradient(part, axis=axis) / 12.0
        mean = np.maximum(mean, 0.0).reshape(fraction.shape)
        return self._centers.without_taken(mean, rows)

    def _known(self, rows: Ints, means: Array) -> Mask:
        """Pixels (side * side, b) whose fractions (3, side * side, b) are known by interpolation.

        Those are not in which all of a light, or nothing, seems visible although outlines may reach
        them: too few rays have looked for the shadow of a wire. Nor are those whose own first rays
        differ from the polynomial.
        """
        if not self._frame.plan.any_mesh:
            return np.ones(means.shape[1:], dtype=np.bool_)
        expected = means.mean(axis=0)
        deviation = np.sqrt(expected * (1.0 - expected) / FIRST_RAYS)
        off = np.abs(self._centers.first_fraction[rows] - expected)
        known: Mask = ((means > UNIFORM) & (means < 1.0 - UNIFORM)).any(axis=0)
        known &= off <= AGREEMENT * deviation + UNIFORM
        return known

    def _settle(self, rows: Ints, color: Array, error: Array, known: Mask | None = None) -> None:
        """Enter the means of those pixels (k, b) that are wanted, and known if that is given."""
        mine = self._wanted[rows] if known is None else self._wanted[rows] & known
        index, off = rows[mine], error[mine]
        off = np.hypot(off, self._centers.variation[index])
        self._frame.settle(index, color[:, mine], np.ones(index.size), off, off)
        self._wanted[index] = False


def _sums_of_squares(values: Array) -> Array:
    """Sums (k / 2, k / 2, b) over squares of 2 x 2 of values (k, k, b)."""
    sums: Array = values[::2, ::2] + values[1::2, ::2] + values[::2, 1::2] + values[1::2, 1::2]
    return sums
