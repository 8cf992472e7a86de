# SPDX-License-Identifier: GPL-3.0-or-later
"""Parallel lines across a flat light, and where edges seen from points cross them.

A point of the light is origin + u along + v across, with u and v in 0..1. The lines have constant
v, and u runs along them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import cross, dot

__all__ = ["LightLines", "LineCrossings"]


NEAREST = 2.0**-30
"""Height of what may be seen before a light over a point, as a fraction of the height of the light:
less than that by which points lie above their own faces. Parts of edges below it are cut off."""
FARTHEST = 1.0 - 2.0**-20
"""Height from which edges count as reaching the light's plane, where their crossings are not
known."""


@dataclass(frozen=True)
class LineCrossings:
    """Crossings of lines by the outlines of occluders.

    Attributes
    ----------
    line : (m,) number of the line among all lines of all points: point * lines + line.
    place : (m,) u of the crossing, within 0..1.
    change : (m,) by how many the number of faces before the light changes there.
    unknown : (k,) points of which not all crossings are known.
    """

    line: Ints
    place: Array
    change: Array
    unknown: Ints

    def within(self, low: Array, high: Array) -> LineCrossings:
        """Return the crossings of parts of all lines, whose ends (lines,) are places along them."""
        length = (high - low)[self.line]
        place = (self.place - low[self.line]) / np.where(length > 0.0, length, 1.0)
        kept = ((place > 0.0) & (place < 1.0) & (length > 0.0)).nonzero()[0]
        return LineCrossings(self.line[kept], place[kept], self.change[kept], self.unknown)


@dataclass(frozen=True)
class LightLines:
    """Lines across a parallelogram.

    Attributes
    ----------
    origin, along, across : (3, 1) metres.  count : number of lines.
    point : (3, n) the points from which edges are seen, none of them in the light's plane.
    """

    origin: Array
    along: Array
    across: Array
    count: int
    point: Array

    @property
    def ball(self) -> tuple[Array, float]:
        """Centre (3, 1) and radius of a ball that encloses the parallelogram, metres."""
        sides = self.along + self.across, self.along - self.across
        size = max(float(np.sqrt(dot(side, side))[0]) for side in sides)
        return self.origin + 0.5 * (self.along + self.across), 0.5 * size

    @property
    def positions(self) -> Array:
        """The v of the lines: (count,)."""
        v: Array = (np.arange(self.count) + 0.5) / self.count
        return v

    def crossings(self, at: Ints, ends: tuple[Array, Array], change: Array) -> LineCrossings:
        """Where edges cross the lines as seen from points.

        Parameters
        ----------
        at : (m,) the points that edges are seen from.
        ends : (3, m) each, metres, from those points to the ends of the edges.
        change : (m,) change of the number of faces to the right of an edge that is passed from its
            first end to its last and seen from the side where faces that pass it so appear
            clockwise.
        """
        normal = cross(self.along, self.across)
        height = dot(normal, self.origin - self.point)
        side = np.sign(height)
        tops = [side[at] * dot(normal, end) / np.abs(height)[at] for end in ends]
        some, reaches = self._before_light(tops)
        unknown = np.unique(at[reaches])
        at, change = at[some], change[some]
        tops = [top[some] for top in tops]
        ends = (columns(ends[0], some), columns(ends[1], some))
        flat = self._projected(at, *_lifted(ends, tops))
        (ua, va), (ub, vb) = flat
        up = vb > va
        below, above = np.minimum(va, vb), np.maximum(va, vb)
        first = np.clip(np.ceil(below * self.count - 0.5), 0, self.count).astype(np.int64)
        end = np.clip(np.ceil(above * self.count - 0.5), 0, self.count).astype(np.int64)
        crossed = end - first
        row = np.repeat(np.arange(at.size), crossed)
        line = first[row] + np.arange(row.size) - np.repeat(np.cumsum(crossed) - crossed, crossed)
        part = (self.positions[line] - va[row]) / (vb - va)[row]
        place = ua[row] + part * (ub - ua)[row]
        inside = ((place > 0.0) & (place < 1.0)).nonzero()[0]
        row, line = row[inside], line[inside]
        turned = np.where(up, -1.0, 1.0) * change * side[at]
        return LineCrossings(at[row] * self.count + line, place[inside], turned[row], unknown)

    @staticmethod
    def _before_light(tops: list[Array]) -> tuple[Ints, Mask]:
        """Edges of which a part lies between a point and the light's plane, and which of all (m,)
        may also reach that plane.

        tops : (m,) heights of both ends, as fractions of the light's.
        """
        low, high = np.minimum(*tops), np.maximum(*tops)
        seen = (high > NEAREST) & (low < FARTHEST)
        reaches = seen & (high >= FARTHEST)
        return (seen & ~reaches).nonzero()[0], reaches

    def _projected(self, at: Ints, *ends: Array) -> list[tuple[Array, Array]]:
        """Coordinates u and v (m,) of directions (3, m) from points on the light's plane."""
        normal = cross(self.along, self.across)
        duals = cross(self.across, normal), cross(normal, self.along)
        size = dot(normal, normal)
        height = dot(normal, self.origin - self.point)[at]
        found = []
        for end in ends:
            scale = height / dot(normal, end)
            place = columns(self.point, at) - self.origin + scale * end
            u, v = (dot(dual, place) / size for dual in duals)
            found.append((u, v))
        return found


def _lifted(ends: tuple[Array, Array], tops: list[Array]) -> list[Array]:
    """Both ends (3, m) of edges, moved along them to the height `NEAREST` where they are lower."""
    found = []
    for own, other in ((0, 1), (1, 0)):
        low = tops[own] < NEAREST
        rise = tops[other] - tops[own]
        part = np.where(low, (NEAREST - tops[own]) / np.where(low, rise, 1.0), 0.0)
        found.append(ends[own] + part * (ends[other] - ends[own]))
    return found
