# SPDX-License-Identifier: GPL-3.0-or-later
"""How much the light changes over a pixel, by exact light at a grid of its places, compiled."""

import math

import numpy as np

from .cells_jit import CIRCLE
from .light_jit import factor
from .rays_jit import candidates, first_hit, pack
from .vectors_jit import dot, jit, less, vector

__all__ = ["light_spread"]


@jit
def _at(scene, light, p, n, i, inside, work):
    """Of a light at a place: what is seen of it, all of it, and 1 / distance^3."""
    balls, quads = scene[0], scene[1]
    circles, cuts, space = work
    bare = light.copy()
    bare[17] = 0.0
    way = less(vector(light, 0), p)
    some = factor(balls, quads, light, p, n, 0.0, i, inside, circles, cuts, space)
    whole = factor(balls, quads, bare, p, n, 0.0, i, inside, circles, cuts, space)
    return some, whole, 1.0 / max(dot(way, way) ** 1.5, 1e-300)


@jit
def _spread(scene, pixels, side, most, result):
    """Fill `result` (n,): see `light_spread`."""
    among = np.empty(most, dtype=np.int64)
    space = (np.empty((6, 3)), np.empty((6, 3)), np.empty((6, 3)))
    work = np.empty((most, CIRCLE)), np.empty(2 * most + 2), space
    lights = scene[2]
    # of each light: least and greatest share seen, least and greatest 1 / distance^3
    found = np.empty((lights.shape[0], 4))
    for row in range(pixels.shape[0]):
        count = candidates(scene, pixels[row, 0], pixels[row, 1], among)
        found[:] = np.array([math.inf, 0.0, math.inf, 0.0])
        for k in range(side * side):
            x = pixels[row, 0] + (k % side) / (side - 1)
            y = pixels[row, 1] + (k // side) / (side - 1)
            i, p, n, inside = first_hit(scene, among, count, x, y, 0.0)
            for j in range(lights.shape[0] if i >= 0 else 0):
                some, whole, near = _at(scene, lights[j], p, n, i, inside, work)
                if whole > 0.0:
                    found[j, 0] = min(found[j, 0], some / whole)
                    found[j, 1] = max(found[j, 1], some / whole)
                found[j, 2], found[j, 3] = min(found[j, 2], near), max(found[j, 3], near)
        for j in range(lights.shape[0]):
            if found[j, 1] > 0.0:
                result[row] = max(result[row], found[j, 1] - found[j, 0])
            if found[j, 3] > 0.0:
                result[row] = max(result[row], 1.0 - found[j, 2] / found[j, 3])


def light_spread(scene, pixels, side=9):
    """By how much the light changes over pixels (n, 2) at the middle of the shutter: (n,), 0 to 1.

    Over all lights the most of two: by how much the part of it that is seen changes, as a share
    of all of it; and by how much one over its distance cubed does, as a share of the greatest: so
    fast a plane's light falls off. By side x side places of each pixel, its corners among them.
    """
    packed = pack(scene)
    most = 8 + packed[0].shape[0] + 6 * packed[1].shape[0]
    result = np.zeros(len(pixels))
    _spread(packed, np.ascontiguousarray(pixels, dtype=float), side, most, result)
    return result
