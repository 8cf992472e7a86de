# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface of shapes seen through boxes in pixel x, y and shutter time t.

A ray's direction is linear in x and y, and an object's position is linear in t. What a ray hits is
therefore decided by polynomials in the normalized coordinates of a box, see
`numerics.box_polynomials`. A kind of shape answers with a subclass of `LineForms`, which holds
these polynomials for some candidates: pairs of a box and an object that may be seen in it. A line
through a box must meet a candidate in a single interval, as it does for convex shapes.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar, NamedTuple, Self

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.box_polynomials import Boxes, swap_axes
from ..numerics.gather import columns
from ..numerics.line_lattice import Lattice
from .camera import PinholeCamera

__all__ = [
    "TIME_NORMAL",
    "BoxCoverage",
    "BoxRays",
    "DepthPolynomials",
    "DepthSurface",
    "LineForms",
]


TIME_NORMAL = np.array([[0.0], [0.0], [1.0]])
"""Unit normal, in (x, y, t), of an event that happens for all rays at the same time: the camera
enters a solid or crosses the plane of a polygon."""


class DepthSurface(IntEnum):
    """Surfaces whose depth along lines `DepthPolynomials` describe.

    A shape whose surface is neither a plane nor of degree two has no depth of this form. Of two
    surfaces, `depth_pairs` expects the one with the lower number first.
    """

    SPHERE = 0
    QUADRIC = 1
    PLANE = 2


@dataclass(frozen=True)
class BoxRays:
    """The camera's rays through the boxes of m candidates.

    Attributes
    ----------
    directions : the direction w in the middle of the box, and its changes across the box along x
        and y: three arrays (3, m), so that w + x * (change along x) + y * (change along y).
    time, duration : (m,) middles and lengths of the boxes' time intervals, in shutter times.
    """

    directions: tuple[Array, Array, Array]
    time: Array
    duration: Array

    @classmethod
    def make(cls, camera: PinholeCamera, boxes: Boxes, box: Ints) -> BoxRays:
        """Rays through the boxes chosen by an index (m,)."""
        middle, size = columns(boxes.middle, box), columns(boxes.size, box)
        w = camera.directions(middle[0], middle[1])
        steps = size[0] * camera.right[:, None], size[1] * camera.up[:, None]
        return cls((w, *steps), middle[2], size[2])

    def positions(self, rest: Array, displacement: Array | None) -> tuple[Array, Array | None]:
        """Positions (3, m) in the middle of the boxes' times, and their changes over those times.

        The changes (3, m) are None if nothing moves within a box.

        Parameters
        ----------
        rest, displacement : (3, m) metres, at mid-shutter and over the shutter; None if no object
            moves.
        """
        if displacement is None:
            return rest, None
        change = self.duration * displacement
        return rest + self.time * displacement, change if change.any() else None


@dataclass(frozen=True)
class BoxCoverage:
    """How m candidates cover their boxes, by bounds, and the orientation of their outlines there.

    Attributes
    ----------
    may_hit, all_hit : (m,) whether some ray of the box may hit the object, and whether all rays do.
    near, far : (m,) lower and upper bounds on the ray parameters of those hits.
    outline_normal : (3, m) components in x, y and t of a unit normal of the outline, absolute
        values, over the part that may be seen; ones where no outline is seen.
    apparent_size : (2, m) half the apparent size of the object, in units of the box's size.
    outline_turn : (m,) approximate angle in radians, at most 1, by which the outline turns within
        half the box.
    """

    may_hit: Mask
    all_hit: Mask
    near: Array
    far: Array
    outline_normal: Array
    apparent_size: Array
    outline_turn: Array

    def take(self, rows: Ints) -> BoxCoverage:
        """Select candidates by index."""
        return BoxCoverage(
            self.may_hit[rows],
            self.all_hit[rows],
            self.near[rows],
            self.far[rows],
            columns(self.outline_normal, rows),
            columns(self.apparent_size, rows),
            self.outline_turn[rows],
        )

    @classmethod
    def join(cls, parts: list[tuple[Ints, BoxCoverage]], m: int) -> BoxCoverage:
        """The coverage by m candidates, from that by the candidates of each kind at their rows."""
        if len(parts) == 1:
            return parts[0][1]
        flags, values = np.empty((2, m), dtype=np.bool_), np.empty((8, m))
        for rows, part in parts:
            flags[0, rows], flags[1, rows] = part.may_hit, part.all_hit
            values[0, rows], values[1, rows] = part.near, part.far
            values[2:5, rows], values[5:7, rows] = part.outline_normal, part.apparent_size
            values[7, rows] = part.outline_turn
        may_hit, all_hit = flags
        return cls(may_hit, all_hit, values[0], values[1], values[2:5], values[5:7], values[7])


class DepthPolynomials(NamedTuple):
    """Polynomials that give the ray parameter t of hits: a root of q t^2 - 2 p t + g = 0.

    t = (p - sqrt(d)) / q from outside, where the power g of the camera is positive, and
    (p + sqrt(d)) / q from inside. A plane has t = p / q; its d and g are None. A surface that two
    parallel planes cut off has the second root as well where the first one is before both planes:
    the ray enters the solid through one of them. A double cone opens along rays with q < 0, which
    then have no second root but from inside; from within its other half, t is the first root.

    Attributes
    ----------
    numerator : p, of degree one along x, y and t.
    denominator : q, of degree two along x and y, constant in t.
    discriminant : d = p^2 - q g, of degree two.
    power : g, constant in x and y, of degree two in t.
    slab : f and two heights h, for planes that are hit at t = h / f: f of degree one along x and y
        and constant in t, h constant in x and y and of degree one in t; then, like these, the
        radius at the camera, negative within the other half of a double cone. None without planes.
    """

    numerator: Array
    denominator: Array
    discriminant: Array | None = None
    power: Array | None = None
    slab: tuple[Array, Array, Array, Array] | None = None


@dataclass(frozen=True)
class LineForms(ABC):
    """Candidates of one kind of shape as polynomials over their boxes.

    Attributes
    ----------
    rows : (m,) positions among all candidates.
    polynomials : arrays (T, k, m), see `numerics.box_polynomials`; a subclass gives them names.
    surface : the surface that the shapes lie on, which decides how the events are found at which
        two of them have equal depth.
    """

    rows: Ints
    polynomials: tuple[Array, ...]
    surface: ClassVar[DepthSurface]

    def take(self, index: Ints, rows: Ints) -> Self:
        """Select candidates by index and give them new rows."""
        parts = tuple(columns(part, index, -1) for part in self.polynomials)
        return type(self)(rows, parts)

    def swap_axes(self, index: Ints) -> None:
        """Exchange x and y for the candidates selected by an index, in place."""
        for part in self.polynomials:
            swap_axes(part, index)

    @abstractmethod
    def coverage(self, apparent_size: Array) -> BoxCoverage:
        """How the candidates cover their boxes.

        apparent_size : (2, m), see `BoxCoverage`.
        """

    @abstractmethod
    def intervals(self, lattice: Lattice) -> tuple[Array, Array]:
        """Ends of the intervals in which lines hit the candidates, (rows, columns, m) each.

        They need not be within the box; a line that misses a candidate has low >= high.
        """

    @abstractmethod
    def smooth_events(self) -> tuple[Mask, Mask]:
        """Candidates whose events along t are smooth functions of the ray, by two masks (m,).

        Returns
        -------
        always : candidates that at all times all rays hit, or none does.
        once : candidates, none of them in `always`, that each ray sees for one interval of time,
            whose ends within the box vary smoothly from ray to ray and are there for all rays.
        """

    @abstractmethod
    def depth_polynomials(self) -> DepthPolynomials:
        """Polynomials that give the depths of hits."""
