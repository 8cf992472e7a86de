# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices of a mesh that lie in the same place."""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Ints
from ...numerics.gather import columns

__all__ = ["welded_vertices"]


def welded_vertices(vertices: Array) -> Ints:
    """Numbers (v,) of the places of vertices (3, v): equal where these are the same, in order of
    x, then y, then z.
    """
    order = np.lexsort(vertices[::-1])
    there = columns(vertices, order)
    new = (there[:, 1:] != there[:, :-1]).any(axis=0)
    place = np.empty(order.size, dtype=np.int64)
    place[order] = np.cumsum(np.append(0, new))[: order.size]
    return place
