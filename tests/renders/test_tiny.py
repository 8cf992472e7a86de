# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects so small that rounding is as large as they are: the mask must not lose them.

A discriminant over a wide domain is off by roundoffs of its greatest terms, not of those near its
zero. Places are known by construction: each sphere is where a pixel, or a ray to a light, is.
"""

import numpy as np
import pytest

from adaptive_drt.detection.occlusion import classify_occluders
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Motion, Quad, QuadLight, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, Surface
from oracle.numbers import LONG, cross, dot
from random_scenes import look_at
from shape_sets import spheres_of

SIZE = 20
CAMERA = look_at((0.0, 0.0, 0.0), (0.3, 1.0, -0.2), resolution=(SIZE, SIZE))
LIGHT = QuadLight((0.2, 0.4, 9.0), (0.0, 3.0, 0.2), (2.0, 0.3, 0.0), (1.0, 1.0, 1.0))
FEW = {"method": "RAYS", "light_rays": 1, "time_rays": 1, "pixel_rays": 1}


def frame():
    """The camera's axes: right, up, back."""
    return np.array(CAMERA.matrix)[:3, :3]


def through(x, y):
    """Direction through a place in the picture, of depth 1."""
    right, up, back = frame().T
    pixel = 36.0 / (50.0 * SIZE)
    return (x - SIZE / 2) * pixel * right + (y - SIZE / 2) * pixel * up - back


def spots(seed):
    """A place in each pixel: (pixels, 2)."""
    inside = np.random.default_rng(seed).uniform(0.02, 0.98, (SIZE * SIZE, 2))
    y, x = np.divmod(np.arange(SIZE * SIZE), SIZE)
    return inside + np.stack([x, y], axis=1)


@pytest.mark.parametrize("share", [1e-4, 1e-7, 1e-8, 1e-9, 1e-10])
def test_spheres_much_smaller_than_a_pixel_are_edges(share):
    """One in each pixel, anywhere in it, of a radius that is so small a share of its distance."""
    rng = np.random.default_rng(1)
    shapes = []
    for x, y in spots(1):
        place = through(x, y) * rng.uniform(1.0, 30.0)
        shapes.append(Sphere(tuple(place.tolist()), share * float(np.linalg.norm(place))))
    mask = render_image(Scene(CAMERA, tuple(shapes), (LIGHT,)), Settings(**FEW)).mask
    missed = np.count_nonzero(~mask[2])
    assert not missed, f"{missed} of {mask[2].size} pixels"


@pytest.mark.parametrize("edges", [False, True])
@pytest.mark.parametrize("share", [1e-4, 1e-7, 1e-8, 1e-9])
def test_spheres_that_pass_a_pixels_centre_move(share, edges):
    """One past each pixel's centre at some time, of such a share of its distance."""
    rng = np.random.default_rng(2)
    shapes = []
    for k in range(SIZE * SIZE):
        y, x = divmod(k, SIZE)
        place = through(x + 0.5, y + 0.5) * rng.uniform(1.0, 30.0)
        far = float(np.linalg.norm(place))
        move = rng.normal(size=3) * 0.3 * far
        center = place - rng.uniform(-0.49, 0.49) * move
        motion = Motion(tuple(move.tolist()))
        shapes.append(Sphere(tuple(center.tolist()), share * far, motion=motion))
    scene = Scene(CAMERA, tuple(shapes), (LIGHT,))
    mask = render_image(scene, Settings(**FEW, use_edges=edges)).mask
    missed = np.count_nonzero(~mask[1])
    assert not missed, f"{missed} of {mask[1].size} pixels"


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("radius", [1e-3, 1e-6, 1e-8, 1e-10])
def test_tiny_occluders_before_a_wide_light_are_not_lost(radius, order):
    """Points whose rays to the light's outline a sphere cuts, by much or by little, none by error.

    And the other way about: none is called covering.
    """
    rng = np.random.default_rng(3)
    n = 4_000
    center = np.array([0.1, 0.2, 1.0])
    floor = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
    scene = Scene(CAMERA, (Sphere(tuple(center), radius), floor), (LIGHT,))
    plan = make_plan(scene, Settings(method="RAYS", order=order))
    light = plan.lights[0]
    u, v = light.span.half_u, light.span.half_v
    aim = light.center + rng.choice([-1.0, 1.0], n) * u + rng.uniform(-1.0, 1.0, n) * v
    place = spheres_of(plan).center[:, :1]
    side = cross(aim - place, v + 0.0 * aim)
    side *= rng.choice([-1.0, 1.0], n) / np.sqrt(dot(side, side))
    depth = radius * (1.0 - 10.0 ** rng.uniform(-3.0, 0.0, n))  # how near the centre rays pass
    passed = place + depth * side
    point = aim + rng.uniform(1.1, 1.6, n) * (passed - aim)
    up = np.repeat([[0.0], [0.0], [1.0]], n, axis=1)
    surface = Surface(point, up, np.full(n, 1), np.zeros(n, dtype=bool))
    pairs = Pairs(np.arange(n), np.zeros(n, dtype=np.int64))
    none, full = classify_occluders(plan, surface, light, pairs, 0.0)
    w, c = LONG.lift(aim) - LONG.lift(point), LONG.lift(place) - LONG.lift(point)
    off = cross(w, c)
    cut = LONG.lift(radius) ** 2 * dot(w, w) > dot(off, off)
    assert cut.mean() > (0.5 if radius > 1e-9 else 0.1)
    assert not (none & cut).any(), f"{np.count_nonzero(none & cut)} of {n} points"
    assert not full.any()
