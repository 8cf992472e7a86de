# SPDX-License-Identifier: GPL-3.0-or-later
"""Visible fractions of flat lights by lines across them, with exact events.

Along a line across a light, the number of faces before it changes only at outlines, whose places
are known exactly. Where that number is least the line is visible, if a single ray finds it so. What
is left to estimate is one integral across the lines, by the midpoint rule, whose error falls faster
than that of rays (Billen and Dutre 2016, "Line sampling for direct illumination"; Laine and others
2005). Every third line makes a midpoint rule of its own; their difference gives the error.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry.light_protocol import LinearSpan
from ..geometry.line_crossings import LightLines, LineCrossings
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.morton import morton_order
from ..numerics.vector import dot
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from ..tracing.shadow_rays import blocked_segments

__all__ = ["LINE_COUNTS", "line_fractions", "points_for_lines"]


LINE_COUNTS = (27, 81)
"""Numbers of lines across a light; the second is taken where the first is not enough. Most time
goes into finding outlines, so that fewer lines take hardly less."""
LINE_ERROR = 0.35
"""Error of the midpoint rule, as a fraction of the difference to that of every third line. Where
the visible part of a line has a kink or a root in its position, the error of N lines falls like
N^-1.5, which gives 0.24."""
SMOOTH_COSINE = 0.1
"""Cosine of all directions to a light with the normals of a surface from which shadow rays begin at
the surface itself: see `SmoothSurface.offsets`."""
POINTS_PER_BLOCK = 32
"""Number of neighbouring points for which outlines are found together."""
MIN_CLEARANCE = 0.05
"""Least height of points before a light's plane, as a fraction of the light's radius: nearer ones
see a light whose irradiance no polynomial along a line follows."""


NODES: Array = np.array(
    [0.069431844202974, 0.330009478207572, 0.669990521792428, 0.930568155797026]
)
"""Places along a line at which the light's irradiance is evaluated, the Gauss points; a cubic
polynomial goes through the values."""
PRIMITIVE: Array = np.linalg.inv(NODES[:, None] ** np.arange(4)).T / np.arange(1, 5)
"""Coefficients of u to u^4 in the integral of that polynomial from 0 to u: (node, power)."""


def points_for_lines(plan: Plan, light: Emitter, hits: Surface, pairs: Pairs) -> Mask:
    """Points (n,) from which lines across a light may tell what is visible of it.

    All of the light must be above the horizon, and all occluders must have known outlines.
    """
    span = light.line_span
    count = hits.item.size
    if span is None or light.displacement is not None or not light.extended:
        return np.zeros(count, dtype=np.bool_)
    fit = np.ones(count, dtype=np.bool_)
    fit[pairs.pixel[~plan.shapes.sampled[pairs.item]]] = False
    to = light.to_center(hits.point)
    fit &= -dot(span.normal, to) > MIN_CLEARANCE * light.radius
    smooth = hits.smooth
    outline = light.silhouette(to, hits.normal)
    assert isinstance(outline, np.ndarray)
    for corner in outline:
        far = np.sqrt(dot(corner, corner))
        fit &= dot(hits.normal, corner) > 0.0
        if smooth is not None:
            least = SMOOTH_COSINE * far
            bent = smooth.rise.any(axis=0)
            fine = (dot(hits.normal, corner) >= least) & (dot(smooth.facet, corner) >= least)
            fit &= fine | ~bent
    return fit


def line_fractions(
    plan: Plan, light: Emitter, hits: Surface, pairs: Pairs, lines: int
) -> tuple[Array, Array]:
    """Visible fractions (n,) of a light's irradiance, and their errors, by so many lines.

    The error is infinite where not all outlines are known.

    Parameters
    ----------
    hits : points as `points_for_lines` finds them.  pairs : their occluders, sorted by point.
    """
    span = light.line_span
    assert span is not None
    count = hits.item.size
    share, error = np.zeros(count), np.full(count, np.inf)
    order = morton_order(hits.point)
    for first in range(0, count, POINTS_PER_BLOCK):
        plan.raise_if_cancelled()
        rows = np.sort(order[first : first + POINTS_PER_BLOCK])
        own = pairs.for_pixels(rows, count)
        block = _Block(plan, light, span, hits.take(rows), own, lines)
        share[rows], error[rows] = block.fractions()
    return share, error


@dataclass(frozen=True)
class _Block:
    """n neighbouring points before a light of some parallelogram.

    Attributes
    ----------
    pairs : pairs of points and occluders, sorted by point.  lines : their number.
    """

    plan: Plan
    light: Emitter
    span: LinearSpan
    hits: Surface
    pairs: Pairs
    lines: int

    def fractions(self) -> tuple[Array, Array]:
        """Visible fractions (n,) and their errors."""
        count, lines = self.hits.item.size, self.lines
        found = self._crossings()
        if found is None:
            return np.zeros(count), np.full(count, np.inf)
        low, high = (np.tile(end, count) for end in self._chords)
        pieces = _Pieces.make(count * lines, found.within(low, high))
        seen = pieces.lowest & ~self._blocked(pieces)[pieces.line]
        primitive = self._primitives()
        total = np.zeros(pieces.line.size)
        for end, sign in ((pieces.end, 1.0), (pieces.start, -1.0)):
            power = np.ones_like(end)
            for k in range(4):
                power = power * end
                total += sign * primitive[k][pieces.line] * power
        part = np.bincount(pieces.line, weights=total * seen, minlength=count * lines)
        part, whole = (each.reshape(count, lines) for each in (part, primitive.sum(axis=0)))
        share = part.sum(axis=1) / whole.sum(axis=1)
        third = slice(1, None, 3)
        rough = part[:, third].sum(axis=1) / whole[:, third].sum(axis=1)
        error = LINE_ERROR * np.abs(rough - share)
        error[found.unknown] = np.inf
        return np.clip(share, 0.0, 1.0), error

    @cached_property
    def _chords(self) -> tuple[Array, Array]:
        """Both ends (lines,) of the lines on the light, as places along them."""
        return self.light.chords((np.arange(self.lines) + 0.5) / self.lines)

    def _crossings(self) -> LineCrossings | None:
        """Crossings of the lines by the outlines of all occluders of the block's points."""
        span, point = self.span, self.hits.point
        lines = LightLines(
            self.light.center - span.half_u - span.half_v,
            2.0 * span.half_u, 2.0 * span.half_v, self.lines, point,
        )  # fmt: skip
        parts = []
        for item in np.unique(self.pairs.item).tolist():
            shapes, index = self.plan.shapes.locate(item)
            part = shapes.outline_crossings(index, point, lines)
            if part is None:
                return None
            parts.append(part)
        names = LineCrossings.__dataclass_fields__
        return LineCrossings(*(np.concatenate([getattr(p, k) for p in parts]) for k in names))

    def _blocked(self, pieces: _Pieces) -> Mask:
        """Whether a ray to the longest lowest piece of each line is blocked: (n * lines,)."""
        count = self.hits.item.size
        u = pieces.longest_middles(count * self.lines).reshape(count, self.lines)
        low, high = self._chords
        u = low + u * (high - low)
        v = (np.arange(self.lines) + 0.5) / self.lines
        a, b = (x[None] for x in (2.0 * u - 1.0, np.broadcast_to(2.0 * v - 1.0, u.shape)))
        half_u, half_v = self.span.half_u[:, :, None], self.span.half_v[:, :, None]
        to = self.light.to_center(self.hits.point)[:, :, None] + a * half_u + b * half_v
        blocked = blocked_segments(self.plan, self.hits, to, self.pairs, 0.0)
        return blocked.ravel()

    def _primitives(self) -> Array:
        """Coefficients (4, n * lines) of the integrals of irradiance along the lines."""
        count, lines = self.hits.item.size, self.lines
        low, high = self._chords
        a = (low[:, None] + NODES * (high - low)[:, None]).ravel()
        b = np.repeat((np.arange(lines) + 0.5) / lines, NODES.size)
        shape = (count, a.size)
        spots = (np.broadcast_to(x, shape) for x in (a, b))
        point, normal = self.hits.point[:, :, None], self.hits.normal[:, :, None]
        to = self.light.to_center(point)
        _, weight = self.light.line_sample(to, point, normal, *spots)
        weight = weight * np.repeat(high - low, NODES.size)
        values = weight.reshape(count * lines, NODES.size)
        found: Array = np.ascontiguousarray((values @ PRIMITIVE).T)
        return found


@dataclass(frozen=True)
class _Pieces:
    """Pieces of lines between crossings, sorted by line and place.

    Attributes
    ----------
    line : (p,) the line of each.  start, end : (p,) places along it, from 0 to 1.
    lowest : (p,) whether the number of faces before the piece is the least of its line.
    """

    line: Ints
    start: Array
    end: Array
    lowest: Mask

    @classmethod
    def make(cls, count: int, found: LineCrossings) -> _Pieces:
        """The pieces of `count` lines."""
        every = np.arange(count)
        line = np.concatenate([every, found.line])
        start = np.concatenate([np.zeros(count), found.place])
        change = np.concatenate([np.zeros(count), found.change])
        order = np.argsort(line + start, kind="stable")
        # rounding of the sum may put a crossing at the very end of a line before the next line's
        order = order[np.argsort(line[order], kind="stable")]
        line, start, change = line[order], start[order], change[order]
        first = np.searchsorted(line, every)
        depth = np.cumsum(change)
        end = np.append(start[1:], 1.0)
        end[np.append(first[1:], line.size) - 1] = 1.0
        least = np.minimum.reduceat(depth, first)
        return cls(line, start, np.maximum(end, start), depth < least[line] + 0.5)

    def longest_middles(self, count: int) -> Array:
        """Middles (count,) of the longest lowest piece of each line."""
        size = np.where(self.lowest, self.end - self.start, -1.0)
        first = np.searchsorted(self.line, np.arange(count))
        longest = np.maximum.reduceat(size, first)
        chosen = (size == longest[self.line]).nonzero()[0]
        middle = np.zeros(count)
        middle[self.line[chosen]] = 0.5 * (self.start + self.end)[chosen]
        return middle
