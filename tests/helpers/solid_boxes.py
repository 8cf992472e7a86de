# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes as six faces."""

import numpy as np

from adaptive_drt.scene.description import Quad

__all__ = ["box", "faces", "turned"]


def faces(corner, u, v, w):
    """A corner and two edges of each of the six faces of a box: (3, ...) as it is given."""
    edges = (u, v, w), (v, w, u), (w, u, v)
    return [(start, p, q) for p, q, other in edges for start in (corner, corner + other)]


def box(corner, u, v, w, **fields):
    """Six quads: the parallelepiped of three edges (3,) at a corner (3,)."""
    sides = faces(*(np.array(each, dtype=float) for each in (corner, u, v, w)))
    return [Quad(*(tuple(part) for part in side), **fields) for side in sides]


def turned(corner, size, turn, **fields):
    """An upright box, turned about z: six quads."""
    c, s = np.cos(turn), np.sin(turn)
    u, v = size[0] * np.array([c, s, 0.0]), size[1] * np.array([-s, c, 0.0])
    return box(corner, u, v, (0.0, 0.0, size[2]), **fields)
