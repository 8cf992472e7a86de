# SPDX-License-Identifier: GPL-3.0-or-later
"""Convex polygons of any number of edges seen through boxes, as polynomials.

With q a vertex relative to the camera and w the direction, a ray hits a polygon where all its edge
functions and w.normal have the sign of q.normal. Edge functions w.(start x edge) have degree one in
(x, y) and degree one in t. A line through a box meets a polygon in a single interval: the
directions that hit it form a convex cone, and a point in linear motion is within the prism swept
along the ray for a single interval of time.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.axes import TIME
from ...numerics.box_polynomials import (
    absolute_slopes,
    linear_coefficients,
    polynomial_range,
    signs_at_time_ends,
    unit_vectors,
)
from ...numerics.line_lattice import Lattice, restrict_to_lines
from ...numerics.vector import cross, dot
from ..line_forms import (
    TIME_NORMAL,
    BoxCoverage,
    BoxRays,
    DepthPolynomials,
    DepthSurface,
    LineForms,
)
from .kernels import PlaneNormals

__all__ = [
    "PolygonForms",
    "edge_functions",
    "parallelogram_edge_functions",
    "polygon_forms",
]


class PolygonForms(LineForms):
    """Polygon candidates; the polynomials are the k edge functions, `normal_dot` and `height`."""

    surface: ClassVar[DepthSurface] = DepthSurface.PLANE

    @property
    def edges(self) -> tuple[Array, ...]:
        """The k edge functions."""
        return self.polynomials[:-2]

    @property
    def normal_dot(self) -> Array:
        """w.normal."""
        return self.polynomials[-2]

    @property
    def height(self) -> Array:
        """q.normal."""
        return self.polynomials[-1]

    def coverage(self, apparent_size: Array) -> BoxCoverage:
        """See `LineForms.coverage`."""
        m = self.rows.size
        height_low, height_high = polynomial_range(self.height)
        sure = (height_low > 0.0) | (height_high < 0.0)
        side = np.where(height_low > 0.0, 1.0, -1.0)
        may_hit, all_hit = np.ones(m, dtype=np.bool_), sure.copy()
        normal, crossing = np.ones((3, m)), np.zeros(m, dtype=np.int64)
        for edge in self.edges:
            low, high = polynomial_range(side * edge)
            may_hit &= ~sure | (high >= 0.0)
            all_hit &= low >= 0.0
            crosses = (low < 0.0) & (high >= 0.0)
            crossing += crosses
            own = np.minimum(normal, unit_vectors(absolute_slopes(edge)))
            normal = np.where(crosses, own, normal)
        may_hit &= (height_low != 0.0) | (height_high != 0.0)
        dot_low, dot_high = polynomial_range(side * self.normal_dot)
        first = np.where(sure, np.minimum(np.abs(height_low), np.abs(height_high)), 0.0)
        last = np.maximum(np.abs(height_low), np.abs(height_high))
        near = np.where(dot_high > 0.0, first, 0.0) / np.where(dot_high > 0.0, dot_high, 1.0)
        ahead = sure & (dot_low > 0.0)
        with np.errstate(over="ignore"):  # overflow where the polygon is seen edge-on: no bound
            far = np.where(ahead, last, np.inf) / np.where(ahead, dot_low, 1.0)
        normal = np.where(sure, normal, TIME_NORMAL)
        # a single straight edge does not turn; at a corner the outline does
        turn = np.where(sure & (crossing < 2), 0.0, 1.0)
        return BoxCoverage(may_hit, all_hit, near, far, normal, apparent_size, turn)

    def intervals(self, lattice: Lattice) -> tuple[Array, Array]:
        """See `LineForms.intervals`.

        All edge functions have the sign of the side of the polygon that the camera is on. Along t
        that side follows from the ray: for a hit in front of the camera, q.normal has the sign of
        w.normal.
        """
        shape = (lattice.rows, lattice.columns, self.rows.size)
        first, last = np.full(shape, -np.inf), np.full(shape, np.inf)
        height = restrict_to_lines(self.height, lattice)
        if lattice.axis == TIME:
            toward = restrict_to_lines(self.normal_dot, lattice)
        else:
            toward = height
        side = np.where(toward[0] < 0.0, -1.0, 1.0)
        bounds = [restrict_to_lines(edge, lattice) for edge in self.edges]
        if lattice.axis == TIME:
            bounds.append(height)
        for bound in bounds:
            start = side * bound[0]
            if len(bound) == 1:
                np.copyto(first, np.inf, where=start < 0.0)
                continue
            slope = side * bound[1] + 0.0  # turn -0 into +0, so that `end` has a definite sign
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # no slope: no end
                end = -start / slope
            rising = slope >= 0.0
            first = np.fmax(first, np.where(rising, end, -np.inf))
            last = np.fmin(last, np.where(rising, np.inf, end))
        if lattice.axis != TIME:
            first = np.where(height[0] == 0.0, np.inf, first)
        return first, last

    def smooth_events(self) -> tuple[Mask, Mask]:
        """See `LineForms.smooth_events`.

        Edge functions are linear in t; for a smooth event all but one of them must keep their sign.
        """
        low, high = polynomial_range(self.normal_dot)
        sure = (low > 0.0) | (high < 0.0)
        side = np.where(low > 0.0, 1.0, -1.0)
        kept, changed = np.zeros((2, side.size), dtype=np.int64)
        never = np.zeros(side.size, dtype=np.bool_)
        for bound in (*self.edges, self.height):
            above, below = signs_at_time_ends(side * bound)
            kept += above[0] & above[1]
            changed += (above[0] & below[1]) | (below[0] & above[1])
            never |= below[0] & below[1]
        bounds = len(self.edges) + 1
        stays = (kept == bounds) | never
        turns = (kept == bounds - 1) & (changed == 1)
        return sure & stays, sure & turns & ~stays

    def depth_polynomials(self) -> DepthPolynomials:
        """See `LineForms.depth_polynomials`: the depth of a plane is q.normal / w.normal."""
        return DepthPolynomials(self.height, self.normal_dot)


def polygon_forms(
    rows: Ints,
    edges: tuple[Array, ...],
    normal_dot: Array,
    corner: tuple[Array, Array | None],
    normal: Array,
) -> PolygonForms:
    """Polynomials of polygons in boxes.

    Parameters
    ----------
    rows : (m,) positions among all candidates.
    edges : the k edge functions, (T, 3, m) each.  normal_dot : (1, 3, m) w.normal.
    corner : a vertex (3, m), metres, in the middle of the box, and its change over the box's time.
    normal : (3, m), of any length.
    """
    height = [dot(part, normal)[None] for part in corner if part is not None]
    return PolygonForms(rows, (*edges, normal_dot, np.array(height)))


def edge_functions(
    rays: BoxRays, vertices: PlaneNormals, change: Array | None
) -> tuple[Array, ...]:
    """The k edge functions w.(vertex x edge), positive inwards where the height is positive.

    Parameters
    ----------
    vertices : k arrays (3, m), metres, in the middle of the box, counterclockwise about the normal.
    change : (3, m) of all of them over the box's time; None if none moves.
    """
    found = []
    for start, end in zip(vertices, (*vertices[1:], vertices[0]), strict=True):
        edge = end - start
        planes = [cross(part, edge) for part in (start, change) if part is not None]
        found.append(np.array([linear_coefficients(rays.directions, plane) for plane in planes]))
    return tuple(found)


def parallelogram_edge_functions(
    rays: BoxRays, corner: tuple[Array, Array | None], a: Array, b: Array, normal_dot: Array
) -> tuple[Array, ...]:
    """The edge functions of parallelograms with edges a and b from the corner q.

    The first two are w.(b x q) and w.(q x a), as in `kernels.edge_planes`; each of the others is
    w.(a x b) less one of these.
    """
    moved = [part for part in corner if part is not None]
    first = np.array([linear_coefficients(rays.directions, cross(b, part)) for part in moved])
    second = np.array([linear_coefficients(rays.directions, cross(part, a)) for part in moved])
    third, fourth = -first, -second
    third[:1] += normal_dot
    fourth[:1] += normal_dot
    return first, second, third, fourth
