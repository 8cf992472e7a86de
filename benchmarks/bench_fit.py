# SPDX-License-Identifier: GPL-3.0-or-later
"""What a renderer's ladder says about the time it takes to an error that was not measured."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

__all__ = ["Curve", "Result", "Rung", "TimeAt"]

FITTED = 4
"""Finest rungs that the slope is fitted to."""

RANDOM = 2.0
"""The exponent of independent samples, for a renderer that climbed one rung only."""


@dataclass(frozen=True)
class Rung:
    """One setting: samples, threshold or tolerance; seconds; relative RMSE, its standard error."""

    setting: float
    least: float
    median: float
    error: float
    doubt: float


@dataclass(frozen=True)
class TimeAt:
    """Seconds to an error, and how they are known: 'measured', 'extrapolated' or 'first rung'."""

    seconds: float
    how: str

    def __str__(self) -> str:
        return f"{self.seconds:.3g}{'*' if self.how == 'extrapolated' else ''}"


@dataclass(frozen=True)
class Curve:
    """A renderer on a scene at a size: rungs from coarse to fine."""

    renderer: str
    version: str
    rungs: tuple[Rung, ...]

    @property
    def slope(self) -> float:
        """The exponent p of seconds ~ error ** -p, by least squares over the finest rungs."""
        last = self.rungs[-FITTED:]
        x, y = np.log([r.error for r in last]), np.log([r.least for r in last])
        return float(-np.polyfit(x, y, 1)[0]) if len(last) > 1 else RANDOM

    def time_at(self, error: float) -> TimeAt:
        """Seconds to reach an error: between rungs by a straight line of logarithms."""
        rungs = self.rungs
        if rungs[0].error <= error:
            return TimeAt(rungs[0].least, "first rung")
        for a, b in pairwise(rungs):
            if b.error <= error < a.error:
                share = math.log(a.error / error) / math.log(a.error / b.error)
                return TimeAt(a.least * (b.least / a.least) ** share, "measured")
        last = min(rungs, key=lambda r: r.error)
        return TimeAt(last.least * (last.error / error) ** self.slope, "extrapolated")


@dataclass
class Result:
    """All curves of one scene at one size.

    Attributes
    ----------
    pixels : how many pixels the errors are measured on.
    proof : by peer, how far the mean of its finest picture is from the truth's, relative, and the
        standard error of that: what speaks for the truth.
    """

    scene: str
    width: int
    height: int
    moves: bool
    pixels: int
    curves: dict[str, Curve] = field(default_factory=dict)
    proof: dict[str, tuple[float, float]] = field(default_factory=dict)

    def ratio(
        self, peers: tuple[str, ...], tolerance: float, reached: bool = False
    ) -> tuple[float, bool] | None:
        """How many times longer the fastest of some peers takes, and whether extrapolated.

        reached : to the error that our picture of that tolerance has, not to the tolerance.
        """
        ours = self.ours(tolerance)
        if ours is None:
            return None
        error = ours.error if reached else tolerance
        there = [self.curves[p].time_at(error) for p in peers if p in self.curves]
        if not there:
            return None
        best = min(there, key=lambda t: t.seconds)
        return best.seconds / ours.least, best.how == "extrapolated"

    def ours(self, tolerance: float) -> Rung | None:
        """Our rung of a tolerance."""
        rungs = self.curves["ours"].rungs if "ours" in self.curves else ()
        return next((r for r in rungs if math.isclose(r.setting, tolerance)), None)
