# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels that the edges of meshes cut, by lines with exact events.

Along a horizontal line within a pixel, what is seen changes only where an edge of the picture
crosses the line. Between crossings radiance is smooth, and two points about the middle give its
mean; what is left is one integral across the lines, by the midpoint rule (Gribel, Barringer and
Akenine-Moeller 2011, "High-quality spatio-temporal rendering using semi-analytical visibility").
Every third line makes a midpoint rule of its own; their difference, and that between neighbouring
lines, give the error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import rms
from ..numerics.vector import total as sum_rows
from ..parallel.call_progress import progress_range
from ..shading.center_light import MIXED
from ..shading.direct_light import emission
from ..shading.sample_light import LIGHT_RAYS, LightSampler
from ..shading.sampled_occlusion import UNSEEN_SHARE
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, intersect_pairs, nearest_hits, surface
from ..tracing.occluder_culling import Occluders
from .sampled_pixels import SampledPixels, SamplingTask

__all__ = ["sample_cut_pixels"]


LINE_COUNTS = (9, 27, 81)
"""Numbers of lines across a pixel, of which each is taken if the one before is not enough."""
LINE_ERROR = 0.35
"""Error of the midpoint rule, as a fraction of the difference to that of every third line; the
error of N lines falls like N^-1.5 at kinks, which gives 0.24."""
UNSEEN_CORNER = 0.05
"""Error of N lines, as a fraction of the contrast times N^-1.5, by corners of pixels that an edge
cuts off and no line meets. Derived: such a corner has a height of up to 1 / (2 N), so that every
N-th edge or so cuts one off, whose area has a root mean square of some 0.05 / N."""
MAX_PIECES = 12
"""Largest mean number of pieces of the lines of a pixel; sampling points takes less with more."""
PIXELS_PER_CHUNK = 512
"""Number of pixels in one batch of work; it bounds memory."""
GOLDEN_RATIO = (5.0**0.5 - 1.0) / 2.0
"""Generator of the distances of the two points of a piece from its middle: those of consecutive
lines differ, so that variation along the lines, as on meshes finer than pixels, is not met always
at the same places, and is seen in what differs between lines."""
FEWEST_FOR_GROUPS = 27
"""Number of lines from which the error may also be that of groups of three neighbouring lines. The
points of a group complement each other, so that groups differ less than lines where light varies
along these; at kinks lines differ less."""
SECOND_DIFFERENCE_VARIANCE = 6.0
"""Variance of the second difference of values whose own is 1."""


def sample_cut_pixels(plan: Plan, occluders: Occluders, task: SamplingTask) -> SampledPixels:
    """Sample pixels by lines to their limits, where that is possible.

    The error (`SampledPixels.spread`) of pixels that lines do not suit is infinite.
    """
    count = task.x.size
    done = SampledPixels.zeros(count)
    done.spread[:] = np.inf
    rows = (~task.moves).nonzero()[0] if plan.edges else np.zeros(0, dtype=np.int64)
    for number, lines in enumerate(LINE_COUNTS):
        left = []
        with progress_range(number / len(LINE_COUNTS), (number + 1) / len(LINE_COUNTS)):
            for first in range(0, rows.size, PIXELS_PER_CHUNK):
                plan.raise_if_cancelled()
                some = rows[first : first + PIXELS_PER_CHUNK]
                pixels = _CutPixels.make(plan, task, some, lines)
                found = pixels.sample(plan, occluders)
                done.enter(pixels.rows, found)
                left.append(pixels.rows[found.spread > task.limit[pixels.rows]])
        rows = np.concatenate([rows[:0], *left])
    return done


@dataclass(frozen=True)
class _CutPixels:
    """n pixels and the pieces of their lines between crossings.

    Attributes
    ----------
    rows : (n,) the pixels in the task.  index : (n,) their numbers in the whole picture.
    contrast : (n,) difference of radiance across outlines: see `SamplingTask`.
    pairs : pairs of pixels and the objects that may be seen in them, sorted by pixel.
    lines : number of lines in each pixel.
    line : (p,) pixel * lines + line of each piece, ascending.
    weight : (p,) share of the pixel.  w : (3, p, 2) directions through two points of each piece.
    """

    rows: Ints
    index: Ints
    contrast: Array
    pairs: Pairs
    lines: int
    line: Ints
    weight: Array
    w: Array

    @classmethod
    def make(cls, plan: Plan, task: SamplingTask, rows: Ints, lines: int) -> _CutPixels:
        """The pieces of those of the pixels `rows` of a task that lines suit."""
        pairs = task.pairs.for_pixels(rows, task.x.size)
        x, y = task.x[rows], task.y[rows]
        fit = np.ones(rows.size, dtype=np.bool_)
        crossed, places = [np.zeros(0, dtype=np.int64)], [np.zeros(0)]
        for item in np.unique(pairs.item).tolist():
            own = pairs.pixel[pairs.item == item]
            shapes, index = plan.shapes.locate(item)
            left, bottom = (np.floor(each[own]).astype(np.int64) for each in (x, y))
            found = shapes.edges_on_lines(index, plan.lens, left, bottom, lines)
            if found is None:
                w = plan.lens.directions(x[own], y[own])
                every = np.full(own.size, index)
                cover = shapes.coverage(every, w, plan.lens, plan.settings.order)
                fit[own[cover.may_hit & ~cover.covers]] = False
            else:
                at, line = np.divmod(found[0], lines)
                crossed.append(own[at] * lines + line)
                places.append(found[1])
        return cls._with_pieces(
            plan, task, rows, pairs, fit, (lines, np.concatenate(crossed), np.concatenate(places))
        )

    @classmethod
    def _with_pieces(
        cls,
        plan: Plan,
        task: SamplingTask,
        rows: Ints,
        pairs: Pairs,
        fit: Mask,
        crossings: tuple[int, Ints, Array],
    ) -> _CutPixels:
        """The pieces between crossings: number of lines, line and place of each crossing."""
        lines, crossed, places = crossings
        size = np.bincount(crossed // lines, minlength=rows.size)
        chosen = (fit & (size <= (MAX_PIECES - 1) * lines)).nonzero()[0]
        number = np.full(rows.size, -1)
        number[chosen] = np.arange(chosen.size)
        kept = (number[crossed // lines] >= 0).nonzero()[0]
        crossed = number[crossed[kept] // lines] * lines + crossed[kept] % lines
        every = np.arange(chosen.size * lines)
        line = np.concatenate([every, crossed])
        start = np.concatenate([np.zeros(every.size), places[kept]])
        order = np.lexsort((start, line))
        line, start = line[order], start[order]
        end = np.append(start[1:], 1.0)
        end[np.append(line[1:] != line[:-1], True).nonzero()[0]] = 1.0
        long = (end > start).nonzero()[0]
        line, start, end = line[long], start[long], end[long]
        pixel = rows[chosen[line // lines]]
        away = 0.5 * (end - start) * ((line % lines + 0.5) * GOLDEN_RATIO % 1.0)
        middle = task.x[pixel] - 0.5 + 0.5 * (start + end)
        across = np.array([middle - away, middle + away])
        up = task.y[pixel] - 0.5 + (line % lines + 0.5) / lines
        w = plan.lens.directions(across.T, np.repeat(up[:, None], 2, axis=1))
        return cls(
            rows[chosen], task.index[rows[chosen]], task.contrast[rows[chosen]],
            pairs.for_pixels(chosen, rows.size), lines,
            line, (end - start) / lines, w,
        )  # fmt: skip

    def sample(self, plan: Plan, occluders: Occluders) -> SampledPixels:
        """Trace and shade the points."""
        n = self.rows.size
        pixel = np.repeat(self.line // self.lines, 2)
        weight = np.repeat(0.5 * self.weight, 2)
        w = self.w.reshape(3, -1)
        pairs = self.pairs.for_pixels(pixel, n)
        t = intersect_pairs(plan, columns(w, pairs.pixel), pairs.item)
        depth, item = nearest_hits(pixel.size, pairs, t)
        hit = (item >= 0).nonzero()[0]
        hits = surface(plan, columns(w, hit), depth[hit], item[hit])
        color = np.zeros((3, pixel.size))
        if not plan.transparent:
            behind = item < 0
            color[:] = plan.background[:, None] * behind
            if plan.backdrop is not None:
                color[:, behind] = plan.backdrop.radiance(w[:, behind])
        glow = emission(plan, hits)
        if glow is not None:
            color[:, hit] = glow
        row, share = pixel[hit], weight[hit]
        first = np.arange(pixel.size) - np.searchsorted(pixel, np.arange(n))[pixel]
        numbers = self.index[row], first[hit]
        unseen = np.zeros(n)
        for number in range(len(plan.lights)):
            sampler = LightSampler(plan, occluders, number, None)
            found = sampler.sample(hits, row, np.zeros(row.size), numbers)
            part, bright = _ratio_estimates(found.colors, row, share, n)
            color[:, hit] += part
            rays = LIGHT_RAYS * np.bincount(row[found.sampled], minlength=n)
            unseen += (np.where(rays > 0, UNSEEN_SHARE / np.maximum(rays, 1), 0.0) * bright) ** 2
        values = self._line_values(color * weight)
        mean: Array = sum_rows(np.moveaxis(values, 2, 0)) / self.lines
        corner = self.contrast * UNSEEN_CORNER * self.lines**-1.5
        error = np.hypot(self._error(values, mean), np.sqrt(unseen) + corner)
        alpha = np.ones(n)
        opacity = plan.opacity(item)
        if (opacity < 1.0).any():
            # as a colour of three equal channels
            covered = self._line_values(np.tile(opacity * weight, (3, 1)))
            shown = sum_rows(np.moveaxis(covered, 2, 0)) / self.lines
            alpha = np.clip(shown[0], 0.0, 1.0)
            error = np.maximum(error, self.contrast * self._error(covered, shown))
        points = np.bincount(pixel, minlength=n)
        mixed = np.full(n, MIXED)
        return SampledPixels(
            np.maximum(mean, plan.least_radiance), alpha, points,
            error, np.zeros(n), mixed, mixed, np.zeros(n, dtype=np.bool_),
        )  # fmt: skip

    def _line_values(self, color: Array) -> Array:
        """Means (k, n, lines) over lines, from the points' shares (k, 2 p) of the pixels."""
        line = np.repeat(self.line, 2)
        count = self.rows.size * self.lines
        sums = [np.bincount(line, weights=each, minlength=count) for each in color]
        values: Array = self.lines * np.array(sums, dtype=np.float64)
        return values.reshape(len(color), self.rows.size, self.lines)

    def _error(self, values: Array, mean: Array) -> Array:
        """Errors (n,) of means (k, n), from the values (k, n, lines) of lines."""
        third = values[:, :, 1::3].mean(axis=2)
        noise = _spread(values)
        if self.lines >= FEWEST_FOR_GROUPS:
            groups = values.reshape(*values.shape[:2], -1, 3).mean(axis=3)
            noise = np.minimum(noise, _spread(groups))
        error: Array = np.maximum(LINE_ERROR * rms(third - mean), noise)
        return error


def _spread(values: Array) -> Array:
    """Errors (n,) of means of m values (k, n, m), by what differs from a line through them."""
    bend = values[:, :, 2:] - 2.0 * values[:, :, 1:-1] + values[:, :, :-2]
    square = (bend * bend).mean(axis=2) / (SECOND_DIFFERENCE_VARIANCE * values.shape[2])
    return rms(np.sqrt(square))


def _ratio_estimates(
    colors: tuple[Array, Array, Array], row: Ints, share: Array, count: int
) -> tuple[Array, Array]:
    """Radiance (3, m) of points by one light, by a ratio estimator over each of n pixels.

    colors : see `SampledLight`.  row : (m,) pixels.  share : (m,) shares of them.

    Returns with it the size (n,) of the pixels' unhidden light.
    """
    closed, total, visible = colors
    whole, every, seen = (
        np.array([np.bincount(row, weights=each * share, minlength=count) for each in part])
        for part in colors
    )
    # a light of negative power has negative sums
    met = every != 0.0
    safe = np.where(met, every, 1.0)
    ratio = np.where(met, seen, 1.0) / safe
    part = np.where(met, whole / safe, 0.0)
    ratio, part = columns(ratio, row), columns(part, row)
    found: Array = ratio * closed + part * (visible - ratio * total)
    return found, rms(whole)
