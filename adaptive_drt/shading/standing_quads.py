# SPDX-License-Identifier: GPL-3.0-or-later
"""Quads that intersect a patch like a wall stands on a floor: which of their edges cast shadows.

The patch is cut in two by such a quad: the part behind it is dark where the part before it is lit,
or the other way round. But if the camera is before the quad, the quad also hides the part behind
it, and the only shadows in the visible part are cast by the edges that do not touch the patch.
"""

from __future__ import annotations

import numpy as np

from ..geometry.patch import Patch
from ..geometry.polygon.kernels import PlaneNormals, distance_to_edge
from ..geometry.shape import MIN_PLANE_COSINE
from ..numerics.arrays import Array, Mask
from ..numerics.axes import TIME
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..tracing.intersect import Pairs, Surface

__all__ = ["shadowing_edges"]


CONTACT_HEIGHT = 2.0**-10
"""Height of an edge over the patch's plane, as a fraction of the patch's radius, up to which the
edge counts as lying in the plane. Light that passes under the edge reaches no more of the patch
than that, divided by the sine of the light's elevation."""


def shadowing_edges(
    surface: Surface,
    patch: Patch,
    pairs: Pairs,
    corners: tuple[PlaneNormals, PlaneNormals],
    unit: Array,
    height: Array,
    drift: Array,
    through: Array,
) -> tuple[Mask, Mask]:
    """Find the quads of which only some edges cast shadows into the visible part of a patch.

    Parameters
    ----------
    pairs : (m) patches and the quads that touch them.
    corners : start points of the edges, relative to the points, and edge vectors: (3, m) metres
    each.
    unit : (3, m) unit normals of the quads, away from the points.  height : (m,) metres, distances
    of the points from the quads' planes.
    drift : (3, m) metres, motion of the quads over half the patches' time interval.
    through : (3, m) metres, extents of the patches normal to the quads' planes, by axis.

    Returns
    -------
    walls : (m,) whether only some edges count: the visible part of the patch is on one side of the
    quad, or the quad is all behind the surface and hides nothing.
    free : (4, m) the edges whose shadows count there.
    """
    point, normal = columns(surface.point, pairs.pixel), columns(surface.normal, pairs.pixel)
    reach, flat = patch.reach[pairs.pixel], patch.curvature[pairs.pixel] == 0.0
    lift = np.abs(dot(columns(patch.steps[TIME], pairs.pixel) - drift, normal))
    # least distance of the camera before the quad's plane, over the time interval
    before = height + dot(point, unit) - np.abs(dot(drift, unit))
    slant = before / np.maximum(np.sqrt(dot(point, point)), TINY)
    # largest distance from the point at which rays to the far side of the patch pass the plane
    wide = (
        reach
        + np.sqrt(dot(drift, drift))
        + through.sum(axis=0) / np.maximum(slant, MIN_PLANE_COSINE)
    )
    walls, behind, free = height > 0.0, flat.copy(), []
    for start, edge in zip(*corners, strict=True):
        over = dot(start, normal)
        under = flat & (np.maximum(over, over + dot(edge, normal)) + lift <= CONTACT_HEIGHT * reach)
        free.append(~under)
        walls &= under | (distance_to_edge(start, edge) > wide)
        behind &= under
    # a quad that is all behind the surface hides nothing
    return walls | behind, np.array(free)
