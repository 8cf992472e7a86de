# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes as six quads."""

import numpy as np

from adaptive_drt.scene import Quad

__all__ = ["box", "turned"]


def box(corner, u, v, w, **fields):
    """Six quads: the parallelepiped of three edges (3,) at a corner (3,)."""
    o, u, v, w = (np.array(each, dtype=float) for each in (corner, u, v, w))
    sides = (o, u, v), (o + w, u, v), (o, u, w), (o + v, u, w), (o, v, w), (o + u, v, w)
    return [Quad(*(tuple(part) for part in side), **fields) for side in sides]


def turned(corner, size, turn, **fields):
    """An upright box, turned about z: six quads."""
    c, s = np.cos(turn), np.sin(turn)
    u, v = size[0] * np.array([c, s, 0.0]), size[1] * np.array([-s, c, 0.0])
    return box(corner, u, v, (0.0, 0.0, size[2]), **fields)
