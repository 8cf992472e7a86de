# SPDX-License-Identifier: GPL-3.0-or-later
"""Check of the means by `shadow_stencil` by the light at the corners of the pixels.

A shadow may lie between the centres of pixels, as that of an edge close to a floor does: its
penumbra then begins and ends within a pixel whose centre is fully lit, and no difference between
centres tells of it. The centre and the four corners of a square make a cubature rule of their own,
of degree 3. Where its mean differs from that by the stencil the pixel is left to points, and so are
pixels that outlines of meshes reach although centre and corners see all of the light, or nothing of
it. In scenes without meshes, pixels are not checked whose light is uniform over the centres around.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..cubature.error_budget import Goal
from ..cubature.sampled_centers import SampledCenters
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns, place
from ..numerics.vector import rms
from ..shading.filled_light import FIRST_RAYS
from .frame import Frame
from .schedule import CenterTasks
from .shadow_blocks import AGREEMENT, INTERPOLATION_ERROR_SHARE, UNIFORM

__all__ = ["CORNER_WEIGHT", "STENCIL_ERROR_SHARE", "ShadowCorners", "StencilEstimates"]


STENCIL_ERROR_SHARE = 0.45
"""Error of the light at the centres and corners of pixels, as a fraction of the goal, at which they
take no more rays. At a centre it becomes the error of one pixel, where that at a node of a block
becomes the error of many pixels alike. Chosen for cost, not fitted."""
CORNER_WEIGHT = 1.0 / 12.0
"""Weight of each corner of a square in the rule of degree 3 of its centre and its corners."""


@dataclass(frozen=True)
class StencilEstimates:
    """Means of m pixels by a stencil.

    Attributes
    ----------
    rows : (m,) indices of the pixels, ascending.
    center : (3, m) radiance at their centres.  mean : (3, m) their means.
    noise : (m,) error of the light at the centres.  off : (m,) error of the interpolation.
    """

    rows: Ints
    center: Array
    mean: Array
    noise: Array
    off: Array


class ShadowCorners:
    """The corners of pixels whose means are known by a stencil."""

    def __init__(self, frame: Frame, goal: Goal, found: StencilEstimates) -> None:
        """Find the corners; no values are requested yet."""
        assert frame.centers is not None
        self._frame, self._goal, self._found = frame, goal, found
        # nothing is taken for uniform where outlines of meshes reach
        checked = np.ones(found.rows.size, dtype=np.bool_)
        self._checked = (checked if frame.plan.any_mesh else ~self._uniform()).nonzero()[0]
        rows = found.rows[self._checked]
        # a corner is numbered as the pixel of which it is the lower left one
        corners = rows + np.array([[0], [1], [frame.width], [frame.width + 1]])
        items = np.broadcast_to(frame.centers.item[rows], corners.shape)
        count = frame.width * (frame.height + 2)
        keys, own = np.unique(items * count + corners, return_inverse=True)
        self._own: Ints = own.reshape(corners.shape)
        self._item, self._corner = np.divmod(keys, count)
        self._color, self._fraction = np.zeros((2, 3, keys.size))

    def _uniform(self) -> Mask:
        """Pixels (m,) all of whose light is visible, or none, as from the eight centres around."""
        centers, width = self._frame.centers, self._frame.width
        assert centers is not None
        rows = self._found.rows
        part = columns(centers.fraction, rows)
        same: Mask = ((part == 0.0) | (part == 1.0)).all(axis=0)
        for step in (-width - 1, -width, -width + 1, -1, 1, width - 1, width, width + 1):
            other = columns(centers.fraction, rows + step)
            same &= (centers.item[rows + step] == centers.item[rows]) & (other == part).all(axis=0)
        return same

    @property
    def size(self) -> int:
        """Number of corners."""
        count: int = self._corner.size
        return count

    def tasks(self, size: int) -> CenterTasks:
        """Tasks of at most `size` corners that sample their light."""
        limit = STENCIL_ERROR_SHARE * self._goal.error
        return self._frame.corner_tasks(self._corner, self._item, limit, size)

    def enter(self, rows: Ints, found: SampledCenters) -> None:
        """Enter the light at some of the corners."""
        place(self._color, rows, found.light.color)
        place(self._fraction, rows, found.light.fraction)

    def _varies(self) -> Mask:
        """Pixels (m,), all of them checked, whose light does not seem uniform.

        Outlines reach them: where all of a light, or nothing, is visible from the centre and from
        the corners, a shadow may still lie between these. The first few rays must agree, too.
        """
        centers, rows = self._frame.centers, self._found.rows
        assert centers is not None
        fraction = np.array(
            [columns(centers.fraction, rows), *(columns(self._fraction, own) for own in self._own)]
        )
        whole = (fraction <= UNIFORM).all(axis=(0, 1)) | (fraction >= 1.0 - UNIFORM).all(
            axis=(0, 1)
        )
        mean = (1.0 - 4.0 * CORNER_WEIGHT) * fraction[0] + CORNER_WEIGHT * fraction[1:].sum(axis=0)
        expected = mean.mean(axis=0)
        deviation = np.sqrt(expected * (1.0 - expected) / FIRST_RAYS)
        off = np.abs(centers.first_fraction[rows] - expected)
        varies: Mask = ~whole & (off <= AGREEMENT * deviation + UNIFORM)
        return varies

    def settle(self) -> None:
        """Enter the means of the pixels with which their corners agree."""
        found, checked = self._found, self._checked
        corners = np.zeros((3, checked.size))
        for own in self._own:
            corners += columns(self._color, own)
        mean = (1.0 - 4.0 * CORNER_WEIGHT) * columns(found.center, checked)
        mean += CORNER_WEIGHT * corners
        off = found.off.copy()
        off[checked] = np.maximum(off[checked], rms(mean - columns(found.mean, checked)))
        fine = off <= INTERPOLATION_ERROR_SHARE * self._goal.error
        if self._frame.plan.any_mesh:
            fine &= self._varies()
        sure = fine.nonzero()[0]
        rows, error = found.rows[sure], np.hypot(found.noise[sure], off[sure])
        self._frame.settle(rows, columns(found.mean, sure), np.ones(rows.size), error, error)
