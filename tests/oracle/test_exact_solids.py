# SPDX-License-Identifier: GPL-3.0-or-later
"""Planes that part a solid from a light agree with rays through it."""

import numpy as np
import pytest

from adaptive_drt.scene.description import Ellipsoid, SphereLight
from adversarial_lights import light_corners
from adversarial_solids import KINDS, adversarial_solid
from oracle.exact_mask import directions as pixel_directions
from oracle.exact_mask import floor_points
from plain_hits import oracle_depth

RAYS = 4_000
CLEAR = 0.05
"""Of a solid's size: margins from which so many rays tell."""


def depth(solid, ray, start):
    """How far off rays (3, n) first meet a solid."""
    if not isinstance(solid, Ellipsoid):
        return oracle_depth(solid, ray, np.zeros(ray.shape[1]), start)
    inverse = np.linalg.inv(np.array([solid.half_u, solid.half_v, solid.half_w]).T)
    o, d = inverse @ (start - np.array(solid.center)[:, None]), inverse @ ray
    a, b, c = (d * d).sum(axis=0), (o * d).sum(axis=0), (o * o).sum(axis=0) - 1.0
    square = b * b - a * c
    far = (-b - np.sqrt(np.maximum(square, 0.0))) / a
    return np.where((square > 0.0) & (far > 0.0), far, np.inf)


def light_points(rng, light, point):
    """Points over a light as it is seen from a point (3, 1)."""
    if not isinstance(light, SphereLight):
        one, two = rng.random((2, RAYS))
        a, b, _, d = (np.array(c)[:, None] for c in light_corners(light))
        return a + one * (b - a) + two * (d - a)
    to = np.array(light.center)[:, None] - point
    far = np.linalg.norm(to)
    frame = np.linalg.svd(to.T)[2]
    wide = np.tan(np.arcsin(light.radius / far)) * np.sqrt(rng.random(RAYS)) * far
    turn = rng.uniform(0.0, 2.0 * np.pi, RAYS)
    return point + to + wide * (np.cos(turn) * frame[1:2].T + np.sin(turn) * frame[2:].T)


@pytest.mark.parametrize("kind", range(len(KINDS)))
def test_margins_tell_which_points_see_a_light_in_part(kind):
    rng = np.random.default_rng((kind, 8))
    told = 0
    for family in (0, 2):
        for turn in range(2):
            seed = 7 * (kind + len(KINDS) * turn) + family
            case, _, _ = adversarial_solid(seed)
            camera, solid, light = case.scene.camera, case.scene.shapes[1], case.scene.lights[0]
            width, height = camera.resolution
            columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
            way = pixel_directions(camera, columns.ravel(), rows.ravel())
            points = np.asarray(floor_points(camera, way)[0], dtype=float)
            margins = case.margin.ravel()
            # -1 is also said of points that a light does not face
            clear = np.flatnonzero((np.abs(margins) > CLEAR) & (margins != -1.0))
            for pixel in rng.permutation(clear)[:8]:
                start = points[:, pixel : pixel + 1]
                way = light_points(rng, light, start) - start
                far = np.linalg.norm(way, axis=0)
                hit = depth(solid, way / far, start) < far
                partly = hit.any() and not hit.all()
                assert partly == (margins[pixel] > 0.0), (seed, pixel, margins[pixel], hit.mean())
                told += 1
    assert told > 10
