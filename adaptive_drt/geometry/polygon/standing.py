# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons that intersect a patch like a wall stands on a floor: which edges cast shadows.

Such a polygon cuts the patch in two: the part behind it is dark where the part before it is lit, or
the other way round. But if the camera is before the polygon, that also hides the part behind it,
and the only shadows in the visible part are cast by the edges that do not touch the patch.
"""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Mask
from ...numerics.axes import TIME
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.vector import dot
from ..shaded_patches import ShadedPatches
from ..shape import MIN_PLANE_COSINE
from .kernels import PlaneNormals, distance_to_edge

__all__ = ["shadowing_edges"]


CONTACT_HEIGHT = 2.0**-10
"""Height of an edge over the patch's plane, as a fraction of the patch's radius, up to which the
edge counts as lying in the plane. Light that passes under the edge reaches no more of the patch
than that, divided by the sine of the light's elevation."""


def shadowing_edges(
    receivers: ShadedPatches,
    edges: tuple[PlaneNormals, PlaneNormals],
    unit: Array,
    height: Array,
    drift: Array,
    through: Array,
) -> tuple[Mask, Mask]:
    """Find the polygons of which only some edges cast shadows into the visible part of a patch.

    Parameters
    ----------
    receivers : patches that polygons touch.
    edges : start points of the edges, relative to the points, and vectors of the k edges: (3, m)
        metres each.
    unit : (3, m) unit normals of the polygons, away from the points.
    height : (m,) metres, distances of the points from the polygons' planes.
    drift : (3, m) metres, motion of the polygons over half the patches' time interval.
    through : (3, m) metres, extents of the patches normal to the polygons' planes, by
        axis.

    Returns
    -------
    walls : (m,) whether only some edges count: the visible part of the patch is on one side of the
        polygon, or that is all behind the surface and hides nothing.
    free : (k, m) the edges whose shadows count there.
    """
    point, normal = receivers.places, columns(receivers.normal, receivers.row)
    reach, flat = receivers.reach, receivers.patch.curvature[receivers.row] == 0.0
    lift = np.abs(dot(receivers.step(TIME) - drift, normal))
    # least distance of the camera before the polygon's plane, over the time interval
    before = height + dot(point, unit) - np.abs(dot(drift, unit))
    slant = before / np.maximum(np.sqrt(dot(point, point)), TINY)
    # largest distance from the point at which rays to the far side of the patch pass the plane
    wide = (
        reach
        + np.sqrt(dot(drift, drift))
        + through.sum(axis=0) / np.maximum(slant, MIN_PLANE_COSINE)
    )
    walls, behind, free = height > 0.0, flat.copy(), []
    for start, edge in zip(*edges, strict=True):
        over = dot(start, normal)
        under = flat & (np.maximum(over, over + dot(edge, normal)) + lift <= CONTACT_HEIGHT * reach)
        free.append(~under)
        walls &= under | (distance_to_edge(start, edge) > wide)
        behind &= under
    # a polygon that is all behind the surface hides nothing
    return walls | behind, np.array(free)
