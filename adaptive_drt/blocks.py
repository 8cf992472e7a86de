# SPDX-License-Identifier: GPL-3.0-or-later
"""Blocks of pixels whose means are interpolated between points, where motion leaves them smooth.

What moves is seen, and lit, for some part of the shutter, and that part changes slowly across the
picture: the mean over the shutter at a point of the picture is a smooth function even where each
moment's picture has edges. So the integral over time is taken at the nodes of blocks, three by
three of them, the quadratics through those give the pixels' means, and their second differences
tell how far these may be off. Blocks that are not smooth enough are cut into four.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from .columns import columns
from .frame import Frame
from .goal import Goal
from .refine import Refined
from .variation import KINKS, ROOTS, STEPS

__all__ = ["Blocks"]

Array: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

SIDES = (8, 4, 2)
"""Pixels: sides of blocks, the larger first. Nodes are at the middles of pixels."""
OFF = 1.0 / 16.0
"""Of a second difference of nodes: how far a quadratic through them is off a kink at a random
place, RMS (a kink is off by 1/8 at most); a smooth function's by less."""
INHERITED = 1.0 / 6.0
"""Of what a block's quadratics are off at its quarters' nodes: what a quarter's may be off by. A
smooth function's fall to an eighth; a kink beside a bend may show no second difference at all."""
PLACES: Array = np.array([0.0, 0.5, 1.0])
"""Of a quarter's nodes in its block, whose own are at 0, 1 and 2."""
CHECKED: Array = np.array([0.5, 1.5])
"""Places, in the same unit, where blocks larger than the smallest are held against the truth before
they are taken: second differences see no shadow that lies between the nodes."""
ALLOWED = 0.6
"""Of the goal: what interpolating may add to what the nodes are off by."""


class Blocks:
    """The pixels of a frame in which something moves, and what has been found out about them.

    Attributes
    ----------
    wanted : (n,) pixels that are to be resolved.
    value : (4, n) radiance and coverage at the middles of pixels, means over the shutter.
    known : (n,) whether `value` is there.  error : (n,) how far it may be off.
    unseen : pixels of which it is yet to be said what they see.
    """

    def __init__(self, frame: Frame, goal: Goal) -> None:
        """Nothing is interpolated yet."""
        self.frame, self.goal = frame, goal
        moving = frame.mask[1]
        self.wanted = frame.chosen(goal) & moving
        self.known = (~moving & ~frame.outline) | frame.settled
        self.value = np.concatenate([frame.color, frame.alpha[None]])
        self.error = np.zeros(self.known.size)
        self._open: _Level | None = None
        self._above: tuple[_Level, Array] | None = None
        self.unseen = np.zeros(0, dtype=np.int64)
        if self.wanted.any():
            self._sight, self.unseen = frame.sights()
            across = frame.deviation[:, :2].sum(axis=1)
            self._root, self._kink, self._step = across[ROOTS], across[KINKS], across[STEPS]
            self._left = _standing(frame.deviation[STEPS])

    def see(self, rows: Ints, sight: Ints) -> None:
        """Enter what pixels see."""
        self._sight[rows] = sight

    def ask(self, side: int) -> Ints:
        """Pixels whose values blocks of this side need and that are not known: ascending."""
        if not self.wanted.any():
            return np.zeros(0, dtype=np.int64)
        level = self._open = self._candidates(side)
        if side == SIDES[-1]:
            asked, _, before, _ = self._before(level)
            more = before[asked]
        else:
            # at once with the nodes: of blocks that are cut they are the quarters' middles
            more = level.checks.ravel()
        rows: Ints = np.union1d(level.nodes, more)
        unknown: Ints = rows[~self.known[rows]]
        return unknown

    def enter(self, rows: Ints, refined: Refined) -> None:
        """Enter the values of nodes."""
        self.value[:3, rows], self.value[3, rows] = refined.color, refined.alpha
        self.error[rows] = refined.error
        self.known[rows] = True
        # what the first pass shaded is one of the points
        self.frame.count(rows, refined)

    def settle(self) -> None:
        """Interpolate the blocks that are smooth enough."""
        level, above, self._above = self._open, self._above, None
        if level is None or not level.origin.size:
            return
        values, allowed = columns(self.value, level.nodes), ALLOWED * self.goal.error
        off = np.maximum(
            OFF * self._bends(values), INHERITED * self._surprise(level, above, values)
        )
        off = np.maximum(off, self._checked(level, values))
        smooth = np.flatnonzero(off <= allowed)
        rough = np.flatnonzero(off > allowed)
        self._above = level.take(rough), values[:, :, rough]
        if not smooth.size:
            return
        part = level.take(smooth)
        means = _means(columns(values, smooth, -1), level.side, bool(self.frame.plan.edges))
        error = np.hypot(self.error[part.nodes].max(axis=0), off[smooth])
        y, x = np.divmod(np.arange(level.side**2), level.side)
        rows = part.origin + (y * self.frame.width + x)[:, None]
        mine = self.wanted[rows]
        chosen = rows[mine]
        self.frame.settle(
            chosen,
            np.maximum(means[:3, mine], 0.0),
            np.clip(means[3, mine], 0.0, 1.0),
            np.broadcast_to(error, rows.shape)[mine],
        )
        self.wanted[chosen] = False

    def _checked(self, level: _Level, values: Array) -> Array:
        """How far blocks are off where they have been asked besides their nodes: (b,)."""
        if level.side > SIDES[-1]:
            weights = _weights(CHECKED)
            guess = _through(values, weights, weights)
            found: Array = self._size(guess - self.value[:, level.checks]).max(axis=0)
            return found
        asked, own, before, after = self._before(level)
        bend = self._size(
            columns(self.value, before)
            - 2.0 * columns(self.value, own)
            + columns(self.value, after)
        )
        beyond: Array = OFF * np.where(asked, bend, 0.0).max(axis=0)
        return beyond

    def _before(self, level: _Level) -> tuple[Mask, Ints, Ints, Ints]:
        """Of the smallest blocks: pixels at their first sides, which reach out half a pixel before
        the first nodes; those before and after them, and whether a kink may lie between: (4, b).
        """
        own = level.origin + np.array([0, level.width, 0, 1])[:, None]
        step = np.array([1, 1, level.width, level.width])[:, None]
        before = own - step
        asked = (self._root + self._kink)[own] > ALLOWED * self.goal.error
        asked &= self._sight[before] == self._sight[own]
        return asked, own, before, own + step

    def _bends(self, values: Array) -> Array:
        """The largest second difference of nodes (4, 9, b), RMS over channels: (b,)."""
        grid = values.reshape(4, 3, 3, -1)
        lines = np.concatenate(
            [
                grid[:, 0] - 2.0 * grid[:, 1] + grid[:, 2],
                grid[:, :, 0] - 2.0 * grid[:, :, 1] + grid[:, :, 2],
            ],
            axis=1,
        )
        bends: Array = self._size(lines).max(axis=0)
        return bends

    def _surprise(self, level: _Level, above: tuple[_Level, Array] | None, values: Array) -> Array:
        """How far the blocks that these quarter were off at their nodes, at most: (b,)."""
        off = np.zeros(level.origin.size)
        if above is None:
            return off
        larger, known = above
        parent = np.full(self.known.size, -1)
        corner = level.side * np.array([0, 1, self.frame.width, self.frame.width + 1])
        parent[larger.origin + corner[:, None]] = np.arange(larger.origin.size)
        index = parent[level.origin]
        for quarter, shift in enumerate(corner.tolist()):
            rows = np.flatnonzero(index >= 0)
            rows = rows[larger.origin[index[rows]] + shift == level.origin[rows]]
            y, x = divmod(quarter, 2)
            guess = _through(known[:, :, index[rows]], _weights(PLACES + y), _weights(PLACES + x))
            off[rows] = self._size(guess - values[:, :, rows]).max(axis=0, initial=0.0)
        return off

    def _size(self, change: Array) -> Array:
        """Size (...) of changes (4, ...) of radiance and coverage, RMS over channels."""
        square: Array = (change[:3] ** 2).sum(axis=0) / 3.0
        if self.frame.plan.transparent:
            square = np.maximum(square, (self.goal.contrast * change[3]) ** 2)
        return np.sqrt(square)

    def _candidates(self, side: int) -> _Level:
        """Blocks of one side that hold wanted pixels, and are alike in what they see."""
        frame = self.frame
        first_x, first_y, columns, rows = frame.grid(side)
        if columns <= 0 or rows <= 0:
            nothing = np.zeros(0, dtype=np.int64)
            return _Level(side, nothing, np.zeros((9, 0), dtype=np.int64), frame.width)

        def windows(values: NDArray[np.generic], size: int) -> NDArray[np.generic]:
            table = values.reshape(frame.height, frame.width)[first_y:, first_x:]
            seen: NDArray[np.generic] = sliding_window_view(table, (size, size))
            return seen[::side, ::side][:rows, :columns]

        own = windows(self.wanted, side).any(axis=(2, 3))
        at_y, at_x = np.nonzero(own)
        sight = windows(self._sight, side + 1)[at_y, at_x]
        low, high = sight.min(axis=(1, 2)), sight.max(axis=(1, 2))
        spacing = side // 2
        if spacing > 1:
            rough = spacing**1.5 * self._root + spacing * self._kink + self._step
            rough = windows(rough, side + 1)
        else:
            # nodes in all pixels show kinks, and whatever is spread wider than a pixel
            rough = windows(self._left, side + 1)
        fine = rough[at_y, at_x].max(axis=(1, 2)) <= ALLOWED * self.goal.error
        keep = np.flatnonzero((low == high) & (low >= 0) & fine)
        origin = (first_y + side * at_y[keep]) * frame.width + first_x + side * at_x[keep]
        y, x = np.divmod(np.arange(9), 3)
        offset = spacing * (y * frame.width + x)
        return _Level(side, origin, origin + offset[:, None], frame.width)


@dataclass(frozen=True)
class _Level:
    """Blocks of one side: `origin` (b,) their first pixels, `nodes` (9, b), row by row.

    `width` is that of the frame.
    """

    side: int
    origin: Ints
    nodes: Ints
    width: int

    @property
    def checks(self) -> Ints:
        """(4, b) pixels in the middles of the nodes' squares."""
        quarter = self.side // 4
        y, x = np.divmod(np.arange(4), 2)
        rows: Ints = self.origin + quarter * ((2 * y + 1) * self.width + 2 * x + 1)[:, None]
        return rows

    def take(self, index: Ints) -> _Level:
        return _Level(self.side, self.origin[index], columns(self.nodes, index), self.width)


def _standing(deviation: Array) -> Array:
    """Across the picture, what deviations (3, n) by axis leave once the shutter is averaged: (n,).

    What moves farther in the shutter than a pixel is wide is spread over that distance: a share a
    of x and y beside one of b in time falls to a^2 / b at most.
    """
    across, along = deviation[0] + deviation[1], deviation[2]
    spread = np.maximum(across, along)
    left: Array = across * across / np.where(spread > 0.0, spread, 1.0)
    return left


def _means(values: Array, side: int, whole: bool) -> Array:
    """Means over pixels (k, side * side, b) of the quadratics through nodes (k, 9, b).

    Parameters
    ----------
    whole : whether pixels are squares; else they are their middles.
    """
    # x from 0 to 2 over the block; a square's mean is that of its middle and a twelfth
    x: Array = np.arange(side, dtype=np.float64) / (0.5 * side)
    weights = _weights(x, (2.0 / side) ** 2 / 12.0 if whole else 0.0)
    return _through(values, weights, weights)


def _weights(x: Array, more: float = 0.0) -> Array:
    """(3, p) of the nodes at 0, 1 and 2 in the quadratic at x, whose square is `more`."""
    square = x * x + more
    return np.stack([0.5 * square - 1.5 * x + 1.0, 2.0 * x - square, 0.5 * (square - x)])


def _through(values: Array, up: Array, across: Array) -> Array:
    """Sums (k, p * p, b) of nodes (k, 9, b) by weights (3, p) of rows and columns."""
    grid = values.reshape(values.shape[0], 3, 3, -1)
    w = up[:, None, :, None, None]
    by_row = w[0] * grid[:, None, 0] + w[1] * grid[:, None, 1] + w[2] * grid[:, None, 2]
    w = across[:, None, None, :, None]
    total = w[0] * by_row[:, :, :1] + w[1] * by_row[:, :, 1:2] + w[2] * by_row[:, :, 2:]
    sums: Array = total.reshape(values.shape[0], up.shape[1] * across.shape[1], -1)
    return sums
