# SPDX-License-Identifier: GPL-3.0-or-later
"""Larger smooth blocks of pixels under uniform skies that many objects hide in part.

The light at a point costs there as much as that at thousands of points elsewhere, and far from the
objects it varies so slowly that the nodes of a block of 8 x 8 pixels tell no more than those of a
block of 32 x 32. A polynomial over a larger block gives the means of the pixels of the smaller ones
that it is made of.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..detection.detect import StageCallback, detect_smooth_blocks, trace_center_rays
from ..numerics.arrays import Array, Ints
from ..shading.direct_light import interpolates_occlusion
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Tile, find_candidates
from ..tracing.occluder_culling import Occluders
from .block_interpolation import SmoothBlocks, fit_blocks, make_smooth_blocks
from .chebyshev_blocks import PixelBlocks, coarse_bounds, coarse_plan

__all__ = ["COARSE_SIDES", "has_coarse_blocks", "interpolate_coarse_blocks"]


COARSE_SIDES = (32, 16)
"""Sides of the larger blocks in pixels, the largest first: multiples of those of smaller blocks."""


def has_coarse_blocks(plan: Plan) -> bool:
    """Whether larger blocks than those of `chebyshev_blocks.SIDES` may be smooth, and pay."""
    return plan.edges and any(interpolates_occlusion(plan, light) for light in plan.lights)


def interpolate_coarse_blocks(
    plan: Plan, occluders: Occluders, bounds: Ints, blocks: PixelBlocks, clock: StageCallback
) -> tuple[list[SmoothBlocks], PixelBlocks, int]:
    """Interpolate those blocks that lie within larger smooth ones.

    Which these are depends on the picture only, and not on the other blocks of the call.

    Parameters
    ----------
    plan : its region bounds the pixels.
    bounds : (4, objects) `screen_bounds` of the plan.
    blocks : blocks of a side that divides `COARSE_SIDES`.
    clock : called at the end of each stage.

    Returns the interpolated blocks, the others, and the number of points shaded.
    """
    smooth, points = [], 0
    part = tuple(interpolates_occlusion(plan, light) for light in plan.lights)
    for side in COARSE_SIDES:
        if not blocks.x.size:
            break
        rough = coarse_plan(plan, side)
        coarse, parent = _enclosing_blocks(rough, bounds, blocks, side)
        center = trace_center_rays(rough, *coarse.centers, coarse.pairs)
        found = detect_smooth_blocks(rough, occluders, center, clock, part)
        # those that show nothing need no points
        clear = (found.smooth & (found.item >= 0)).nonzero()[0]
        fitted = fit_blocks(plan, occluders, coarse, clear, found)
        points += fitted.points
        index = fitted.by_object()
        rank = np.full(coarse.x.size, -1)
        rank[clear[index]] = np.arange(index.size)
        rank = rank[parent]
        rows = (rank >= 0).nonzero()[0]
        rows = rows[np.argsort(rank[rows], kind="stable")]
        own = index[rank[rows]]
        flags = fitted.moving[own], found.penumbra[clear[own]]
        mean = _parts(fitted.means(plan, index, side), blocks, rows, rank[rows])
        smooth.append(
            make_smooth_blocks(plan, blocks, rows, fitted.item[own], mean, fitted.error[own], flags)
        )
        blocks = blocks.subdivide((rank < 0).nonzero()[0], blocks.side, plan.region, bounds)
        clock("smooth blocks")
    return smooth, blocks, points


def _enclosing_blocks(
    rough: Plan, bounds: Ints, blocks: PixelBlocks, side: int
) -> tuple[PixelBlocks, Ints]:
    """Larger blocks that hold some blocks, and which one holds each of them.

    rough : `coarse_plan` of the larger side.  bounds : `screen_bounds` in pixels.
    """
    ratio = side // blocks.side
    left, _, right, _ = rough.region
    x, y = blocks.x // ratio, blocks.y // ratio
    bottom, top = int(y.min()), int(y.max()) + 1
    width = right - left
    number, parent = np.unique((y - bottom) * width + x - left, return_inverse=True)
    rows = replace(rough, region=(left, bottom, right, top))
    near = coarse_bounds(bounds, side)
    near[1::2] = np.clip(near[1::2], bottom, top)
    pairs = find_candidates(rows, near, Tile.make(rows, 0, 1))
    place = np.full((top - bottom) * width, -1)
    place[number] = np.arange(number.size)
    block = place[pairs.pixel]
    kept = block >= 0
    pairs = Pairs(block[kept], pairs.item[kept])
    return PixelBlocks(side, number % width + left, number // width + bottom, pairs), parent


def _parts(mean: Array, blocks: PixelBlocks, rows: Ints, parent: Ints) -> Array:
    """Pixel means (3, s, s, m) of the blocks `rows` (m,) of side s.

    mean : (3, side, side, n) of larger blocks.  parent : (m,) which of them holds each block.
    """
    side = blocks.side
    ratio = mean.shape[1] // side
    split = mean.reshape(3, ratio, side, ratio, side, -1)
    row, column = blocks.y[rows] % ratio, blocks.x[rows] % ratio
    return np.moveaxis(split[:, row, :, column, :, parent], 0, -1)
