# SPDX-License-Identifier: GPL-3.0-or-later
"""Image buffers of method 'EXACT': what is known of each pixel of a region during the render.

After the first pass, smooth pixels get their means by second differences (I + h^2/24 (Ixx + Iyy)).
The buffers tell which pixels are left to refine, and take in the results.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cubature.adaptive import InitialCells, RefinedPixels, RefinementTask
from ..cubature.error_budget import GOAL_GROWTH, MIN_GOAL, Goal, MotionErrors, make_goal
from ..cubature.evaluate import multi_node_error
from ..cubature.regions import Cells
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns, place
from ..numerics.vector import rms
from ..scene.film import NO_DEPTH, Film
from ..shading.variation import STEP_KIND, steps_after_shutter, zero_variation
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from ..visibility.fragments import MAX_REFINED_CANDIDATES
from ..visibility.line_intervals import TIME
from .first_pass import FirstPassPixels, SmoothBlocks
from .midpoint_correction import PixelCenters
from .visibility_key import NO_KEY

__all__ = ["Frame", "interleaved_parts", "widened_plan"]


BORDER = 3
"""Border in pixels around a region. Blocks use nodes on its first pixel, and the error of a pixel
depends on second differences of its neighbours, which use pixels two further away."""
REGION_ALIGNMENT = 8
"""Regions are extended to multiples of this many pixels, within the picture, so that blocks are
complete whatever part of the picture is rendered."""
STORAGE_ALIGNMENT = 8
"""Buffers begin and end at multiples of this many pixels, so that blocks of the first pass are
contiguous sub-arrays."""
NEGLIGIBLE_ERROR = 0.01
"""Predicted error below which a pixel needs no correction of its curvature, as a fraction of the
tolerance times the RMS over channels of its own radiance. Chosen for cost, not fitted."""
MULTI_NODE_GOAL = 0.03
"""Goal, as a fraction of the contrast, below which the multi-node rule is used for visible regions
from the first. Chosen for cost, not fitted."""


def widened_plan(plan: Plan, region: tuple[int, int, int, int]) -> Plan:
    """Plan for a region extended to whole blocks and a border around them."""
    left, bottom, right, top = region
    width, height = plan.picture
    left, bottom = left - left % REGION_ALIGNMENT, bottom - bottom % REGION_ALIGNMENT
    right = max(right, min(right + -right % REGION_ALIGNMENT, width))
    top = max(top, min(top + -top % REGION_ALIGNMENT, height))
    return replace(plan, region=(left - BORDER, bottom - BORDER, right + BORDER, top + BORDER))


def interleaved_parts(rows: Ints, size: int) -> list[Ints]:
    """Divide pixels into interleaved parts of at most `size`: every k-th pixel, so that all parts
    take about the same time.
    """
    step = -(-rows.size // size)
    return [rows[first::step] for first in range(step)]


class Frame:
    """Image buffers of a region and its border, as filled by the first pass and by refinement.

    Pixels are numbered row by row, from the lower left; arrays as in `FirstPassPixels`.
    """

    def __init__(self, plan: Plan, region: tuple[int, int, int, int]) -> None:
        """Make empty buffers for a region, given its `widened_plan`."""
        left, bottom, right, top = plan.region
        self.plan = plan
        self.left, self.bottom = (
            left - left % STORAGE_ALIGNMENT,
            bottom - bottom % STORAGE_ALIGNMENT,
        )
        self.width = right + -right % STORAGE_ALIGNMENT - self.left
        self.height = top + -top % STORAGE_ALIGNMENT - self.bottom
        # columns and rows of the region itself
        self.own = (
            slice(region[1] - self.bottom, region[3] - self.bottom),
            slice(region[0] - self.left, region[2] - self.left),
        )
        n = self.width * self.height
        self.color, self.alpha = np.zeros((3, n)), np.zeros(n)
        self.deviation = zero_variation(n)
        self.mask = np.zeros((3, n), dtype=np.bool_)
        self.outline = np.zeros(n, dtype=np.bool_)
        self.item = np.full(n, -1)
        # visibility keys: see `find_visibility_keys`
        self.sight = np.full(n, NO_KEY)
        self.depth, self.normal = np.full(n, NO_DEPTH), np.zeros((3, n))
        self.samples, self.error = np.ones(n, dtype=np.int32), np.zeros(n)
        # pixels that need no refinement, and those that are being refined already
        self.settled, self._held = np.zeros((2, n), dtype=np.bool_)
        # for pixels with outlines: whether their regions are shaded, whether those may use the
        # multi-node rule, and their errors of shape
        self.begun, self._star = np.zeros((2, n), dtype=np.bool_)
        self._across, self._edge = np.zeros((2, n))
        # pixels traced by a ray of their own; the predicted errors of the first pass are 0
        # elsewhere
        self.traced = np.zeros(n, dtype=np.bool_)
        self._corrected, self._change = np.zeros(0, dtype=np.int64), np.zeros((3, 0))
        # a picture made of smooth blocks only has no pixel with candidate objects
        nothing = np.zeros(0, dtype=np.int64)
        self._rivals: list[Pairs] = [Pairs(nothing, nothing)]

    def add(self, x: Ints, y: Ints, sheet: FirstPassPixels) -> None:
        """Enter the first pass of pixels that have been traced."""
        index = self.numbers(x, y)
        for name in (
            "color", "alpha", "deviation", "error", "mask", "outline", "item", "sight", "normal",
        ):  # fmt: skip
            place(getattr(self, name), index, getattr(sheet, name))
        self.depth[index] = _film_depth(sheet.depth)
        self._across[index] = sheet.across
        self.traced[index] = True
        self._rivals.append(Pairs(index[sheet.rivals.pixel], sheet.rivals.item))

    def lay(self, lawn: SmoothBlocks) -> None:
        """Enter smooth blocks, whose pixel means are known."""
        across = np.arange(lawn.side)
        first = self.numbers(lawn.side * lawn.x, lawn.side * lawn.y)
        index = first + (self.width * across[:, None] + across)[..., None]
        place(self.color, index, lawn.color)
        place(self.error, index, lawn.error)
        place(self.item, index, lawn.item)
        place(self.sight, index, lawn.item + 1)
        place(self.depth, index, _film_depth(lawn.depth))
        place(self.normal, index, lawn.normal)
        place(self.alpha, index, np.where((lawn.item < 0) & self.plan.transparent, 0.0, 1.0))
        self.settled[index] = True
        if lawn.moving.any():
            place(self.mask[1], index, lawn.moving)

    def numbers(self, x: Ints, y: Ints) -> Ints:
        """Indices of pixels given by their coordinates."""
        return (y - self.bottom) * self.width + (x - self.left)

    def correct(self) -> None:
        """Compute the means of smooth pixels from their centres: where no outline passes and
        nothing moves.
        """
        if self.plan.edges:
            traced = self.traced.nonzero()[0]
            flat = (
                NEGLIGIBLE_ERROR * self.plan.settings.tolerance * rms(columns(self.color, traced))
            )
            # the outermost pixels lack neighbours on one side
            inside = np.zeros((self.height, self.width), dtype=np.bool_)
            inside[1:-1, 1:-1] = True
            some = (self._across[traced] > flat) | self.mask[0, traced]
            some &= inside.ravel()[traced] & ~self.outline[traced] & ~self.mask[1, traced]
            index = traced[some]
            sharp = self.mask[0] | self.mask[2]
            middles = PixelCenters(self.width, self.color, self.item, sharp, self.deviation)
            self._corrected = index
            self._change = middles.correct(index, self.plan.threads)
            self.error[index] = columns(self.deviation, index, -1).sum(axis=(0, 1))

    def goal(self, rows: Mask, found: tuple[Ints, Array] | None = None) -> Goal:
        """Find the error goal from some rows of pixels.

        rows : (height,) mask.  found : indices and colours (3, m) of pixels to be used instead of
        those stored, if any.
        """
        index, color = self.some(rows), self.color
        if found is not None:
            color = color.copy()
            color[:, found[0]] = found[1]
        color = self._in_rows(color, rows)
        settled = self.settled[index]
        done, index = self.error[index[settled]], index[~settled]
        motion = None
        if self.plan.motion:
            deviation = columns(self.deviation, index, -1)
            hard, steps = deviation[:, :TIME].sum(axis=(0, 1)), deviation[STEP_KIND, TIME]
            crowded = self._crowd[index] > MAX_REFINED_CANDIDATES
            # shadows of lights without extent stay steps, however short the shutter interval
            left = (
                steps_after_shutter(deviation[STEP_KIND])
                if self.plan.soft
                else np.full(index.size, np.inf)
            )
            motion = MotionErrors(crowded, self.mask[1, index], hard, left, steps)
        rest = float((done * done).sum()), done.size
        tolerance = self.plan.settings.tolerance
        starred = self._starred(index, MIN_GOAL * tolerance * float(np.abs(color).mean()))
        cut = (self._unknown & (self.sight < 0))[index]
        goal = make_goal(tolerance, color, self.error[index], starred, cut, rest, motion)
        if self.plan.transparent:
            return goal
        # outlines may show a bright background in a dark picture; the accuracy of regions follows
        # from the contrast
        return replace(goal, contrast=max(goal.contrast, float(rms(self.plan.background))))

    def _starred(self, index: Ints, least: float) -> Array:
        """Predicted errors of some pixels under the multi-node rule, where the errors exceed
        `least`.
        """
        starred = self.error[index]
        # errors of regions that may use the multi-node rule are already those
        rows = ((starred > least) & ~self._star[index]).nonzero()[0]
        more = index[rows]
        left = multi_node_error(columns(self.deviation, more, -1), np.full(more.size, 2))
        starred[rows] = left + self._edge[more]
        return starred

    def outlines(self, rows: Mask | None = None) -> Ints:
        """Pixels of the region, in the rows given by a mask, of which nothing is known but
        outlines.
        """
        unknown = self._unknown & ~self.settled & self.inner()
        if rows is not None:
            unknown &= np.repeat(rows, self.width)
        index: Ints = unknown.nonzero()[0]
        return index

    def lit(self, rows: Mask) -> bool:
        """Whether any pixel of the region itself, in the rows given by a mask, is known lit."""
        return bool(self._in_rows(self.color, rows).any())

    def some(self, rows: Mask) -> Ints:
        """Indices of the pixels of the region itself in the rows given by a mask."""
        y, x = (np.arange(own.start, own.stop) for own in self.own)
        index: Ints = self.width * y[rows[y], None] + x
        return index.ravel()

    def estimate(self) -> float:
        """Estimated RMS error of the region, relative to its mean."""
        # plane by plane: temporary arrays of the picture's size take longer than the sums
        mean = float(np.mean([np.abs(plane).mean() for plane in self._part(self.color)]))
        square = float((self._part(self.error) ** 2).mean())
        return square**0.5 / mean if mean > 0.0 else 0.0

    def inner(self) -> Mask:
        """Mask (n,) of the pixels of the region itself, without the border."""
        inside = np.zeros((self.height, self.width), dtype=np.bool_)
        inside[self.own] = True
        return inside.ravel()

    def chosen(self, goal: Goal) -> Mask:
        """Mask (n,) of pixels to be refined, without those settled or being refined already."""
        chosen: Mask = (self._unknown | (self.error > goal.error)) & self.inner()
        chosen &= ~(self.settled | self._held)
        return chosen

    @property
    def _unknown(self) -> Mask:
        """Mask (n,) of the pixels of which nothing is known except that outlines cut them."""
        unknown: Mask = self.outline & ~self.begun
        return unknown

    def grid(self, side: int) -> tuple[int, int, int, int]:
        """Grid of blocks of one side: column and row of the first pixel, and numbers of columns and
        rows of blocks.
        """
        left, bottom, right, top = self.plan.region
        x, y = left + BORDER - self.left, bottom + BORDER - self.bottom
        return x, y, (right - left - 2 * BORDER) // side, (top - bottom - 2 * BORDER) // side

    def settle(self, rows: Ints, color: Array, alpha: Array, error: Array) -> None:
        """Enter final means of pixels that need no refinement."""
        place(self.color, rows, color)
        self.alpha[rows], self.error[rows] = alpha, error
        self.settled[rows] = True

    def tasks(self, goal: Goal, size: int) -> list[tuple[Ints, RefinementTask]]:
        """Refinement tasks with their pixel indices; also corrects the smooth pixels that are not
        refined.
        """
        chosen = self.chosen(goal)
        rest = self._corrected
        kept = (~(chosen[rest] | self.settled[rest] | self._held[rest])).nonzero()[0]
        rows = rest[kept]
        # mean radiance is never below 0, whatever the differences give
        self.color[:, rows] = np.maximum(
            columns(self.color, rows) + columns(self._change, kept), 0.0
        )
        return self.in_parts(chosen.nonzero()[0], goal, size, True)

    def point_tasks(self, rows: Ints, goal: Goal, size: int) -> list[tuple[Ints, RefinementTask]]:
        """Tasks to integrate over the shutter at pixel centres only."""
        return self.in_parts(rows, goal, size, False)

    def hold(self, rows: Ints) -> None:
        """Mark pixels as being refined, so that they are not chosen again."""
        self._held[rows] = True

    def in_parts(
        self, rows: Ints, goal: Goal, size: int, whole: bool
    ) -> list[tuple[Ints, RefinementTask]]:
        """Tasks for pixels, integrated over their whole squares or at their centres."""
        parts = interleaved_parts(rows, size)
        return [(part, self._task(part, goal, whole and self.plan.edges)) for part in parts]

    def crowd(self, rows: Ints) -> float:
        """Sum over pixels of the squared number of candidate objects: a cost of finding regions."""
        return float((self._crowd[rows].astype(np.float64) ** 2).sum())

    @property
    def _crowd(self) -> Ints:
        """Number of candidate objects of each pixel: (n,)."""
        pixel = np.concatenate([pairs.pixel for pairs in self._rivals])
        return np.bincount(pixel, minlength=self.item.size)

    def _rivals_of(self, rows: Ints) -> Pairs:
        """Candidate objects of some pixels, which are renumbered from 0; sorted by pixel."""
        number = np.full(self.item.size, -1)
        number[rows] = np.arange(rows.size)
        own = [number[pairs.pixel] for pairs in self._rivals]
        kept = [(each >= 0).nonzero()[0] for each in own]
        pixel = np.concatenate([each[index] for each, index in zip(own, kept, strict=True)])
        item = np.concatenate(
            [pairs.item[index] for pairs, index in zip(self._rivals, kept, strict=True)]
        )
        order = np.argsort(pixel, kind="stable")
        return Pairs(pixel[order], item[order])

    def _middles(self, rows: Ints) -> Array:
        """Centres (3, m) of pixels and shutter."""
        y, x = np.divmod(rows, self.width)
        return np.array([self.left + x + 0.5, self.bottom + y + 0.5, np.zeros(rows.size)])

    def _task(self, part: Ints, goal: Goal, whole: bool) -> RefinementTask:
        middle, half = self._middles(part), np.zeros((3, part.size))
        deviation = columns(self.deviation, part, -1)
        if whole:
            half[:2] = 0.5
        else:
            deviation[:, :2] = 0.0
        half[2] = np.where(self.mask[1, part], 0.5, 0.0)
        blank = self._unknown[part]
        star = self._star[part] | (blank & (goal.error < MULTI_NODE_GOAL * goal.contrast))
        cells = Cells(
            np.arange(part.size), middle - half, middle + half, np.ones(part.size),
            columns(self.color, part), self.alpha[part], deviation, self._edge[part], star,
        )  # fmt: skip
        return RefinementTask(
            cells, blank, self.item[part], self.outline[part], self._rivals_of(part), goal,
            GOAL_GROWTH if whole else 0.0,
        )  # fmt: skip

    def begin(self, rows: Ints, begun: InitialCells) -> None:
        """Enter the initial cells of pixels with outlines; they may still be refined."""
        cells = begun.cells
        place(self.color, rows, cells.color)
        place(self.deviation, rows, cells.deviation)
        self.alpha[rows], self._edge[rows] = cells.alpha, cells.edge
        self._star[rows], self.begun[rows] = cells.star, True
        self.error[rows] = begun.error
        self.count(rows, begun)

    def enter(self, rows: Ints, refined: RefinedPixels) -> None:
        """Enter refined pixels."""
        place(self.color, rows, refined.color)
        self.alpha[rows], self.error[rows] = refined.alpha, refined.error
        self.count(rows, refined)

    def count(self, rows: Ints, shaded: InitialCells | RefinedPixels) -> None:
        """Add the number of points shaded beyond the first pass' own."""
        self.samples[rows] += shaded.samples - 1

    def develop(self, film: Film) -> None:
        """Let a film's arrays be views of the region's buffers, without a copy, so that it shows
        later results too.
        """
        for name in ("color", "alpha", "mask", "samples", "depth", "normal"):
            setattr(film, name, self._part(getattr(self, name)))

    def _in_rows(self, color: Array, rows: Mask) -> Array:
        """Colours (3, rows, width) of the region in the rows of a mask, from colours (3, n)."""
        part, own = self._part(color), rows[self.own[0]]
        return part if own.all() else part[:, own]

    def _part(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (..., height, width) of the region, from values (..., n) of the buffers."""
        table = values.reshape(*values.shape[:-1], self.height, self.width)
        return table[..., *self.own]


def _film_depth(depth: Array) -> Array:
    """Depths as stored in films, with `NO_DEPTH` where nothing is hit."""
    shown: Array = np.where(np.isfinite(depth), depth, NO_DEPTH)
    return shown
