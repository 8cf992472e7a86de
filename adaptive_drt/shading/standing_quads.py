# SPDX-License-Identifier: GPL-3.0-or-later
"""Quads that stand in a patch like walls on a floor: which of their edges cast shadows there.

Of such a patch the part behind the quad is dark where the part before it is lit, or the other way
round. But where the camera is before the quad, it hides all that is behind it, and what is seen is
shadowed by nothing but the edges that do not touch the patch.
"""

from __future__ import annotations

import numpy as np

from ..geometry.parallelogram import Planes, distance_to_edge
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..tracing.intersect import Pairs, Surface
from ..visibility.line_intervals import TIME
from .footprint import FLAT, Patch

__all__ = ["free_edges"]


GAP = 2.0**-10
"""Of a patch's reach, how high over its plane an edge may be and count as in it: under the edge
light comes in over no more of the patch, times the sine of its height."""


def free_edges(
    surface: Surface,
    patch: Patch,
    pairs: Pairs,
    corners: tuple[Planes, Planes],
    unit: Array,
    height: Array,
    drift: Array,
    through: Array,
) -> tuple[Mask, Mask]:
    """Of quads that stand in patches: where only some edges count, and which those are.

    Parameters
    ----------
    pairs : (m) patches and the quads that touch them.
    corners : where their edges start from the points, and where they go: (3, m) metres each.
    unit : (3, m) the quads' normals, away from the points.  height : (m,) metres from the points.
    drift : (3, m) metres that the quads move over half the patches' stretch of time.
    through : (3, m) metres that the patches reach through the quads' planes, by axis.

    Returns
    -------
    walls : (m,) what is seen of the patch is all before the quad, or all before its own plane.
    free : (4, m) the edges whose shadows count there.
    """
    point, normal = columns(surface.point, pairs.pixel), columns(surface.normal, pairs.pixel)
    reach, flat = patch.reach[pairs.pixel], patch.bend[pairs.pixel] == 0.0
    lift = np.abs(dot(columns(patch.steps[TIME], pairs.pixel) - drift, normal))
    # how far before the quad's plane the camera is, at all times
    before = height + dot(point, unit) - np.abs(dot(drift, unit))
    slant = before / np.maximum(np.sqrt(dot(point, point)), TINY)
    # rays to the far side of the patch pass the plane no farther than that from its point
    wide = reach + np.sqrt(dot(drift, drift)) + through.sum(axis=0) / np.maximum(slant, FLAT)
    walls, behind, free = height > 0.0, flat.copy(), []
    for start, edge in zip(*corners, strict=True):
        over = dot(start, normal)
        under = flat & (np.maximum(over, over + dot(edge, normal)) + lift <= GAP * reach)
        free.append(~under)
        walls &= under | (distance_to_edge(start, edge) > wide)
        behind &= under
    # all of it behind the surface: it hides nothing
    return walls | behind, np.array(free)
