# SPDX-License-Identifier: GPL-3.0-or-later
"""The compiled truth against what is known without it: lines across lights, ellipses, samples.

What compiles the whole tracer is slow: a changed oracle is found by the tests of pictures too, as
it has no kept answers (`oracle.kept`).
"""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("numba")

from adaptive_drt.scene.description import (
    Camera,
    DiskLight,
    Material,
    Motion,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
    Triangle,
)
from oracle.arcs_jit import CIRCLE
from oracle.converged import converged
from oracle.light_jit import factor
from oracle.picture import reference
from oracle.rays_jit import pack
from oracle.visible import quad_light, round_light, visible
from random_scenes import look_at, random_scene

ABOVE = look_at((0.0, 0.0, 10.0), (0.0, 0.0, 0.0), resolution=(24, 24))
AGREEMENT = 1e-9
"""Of factors, sr: ten times what the lines' own quadrature was measured to be off by."""
OUTLINE = 1e-5
"""Share of an outline's area that quadrature to a goal of 1e-5 may be off by."""


def light_at_origin(scene, normal):
    """The factor of a scene's one light at the origin, which is on no shape."""
    balls, quads, lights, _, _ = pack(scene)
    most = 16 + len(balls) + 6 * len(quads)
    circles, cuts = np.empty((most, CIRCLE)), np.empty(2 * most + 2)
    space = tuple(np.empty((6, 3)) for _ in range(3))
    zero, up = (0.0, 0.0, 0.0), tuple(map(float, normal))
    kind = (balls, quads, lights[0], zero, up, 0.0, -1, False)
    return factor(*kind, circles, cuts, space)


def random_view(rng, kind):
    """A scene with its camera at the origin: a light and occluders, flat ones of a kind."""
    center = np.array((0.0, 0.0, 4.0)) + rng.uniform(-0.7, 0.7, 3)
    if rng.random() < 0.5:
        u, v = rng.normal(size=(2, 3)) * 0.5
        u[2] = v[2] = 0.0
        if np.cross(u, v)[2] > 0.0:
            u, v = v, u
        light = QuadLight(tuple(center), tuple(u), tuple(v), (1.0,) * 3)
        corners = [center + a * u + b * v for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        outline = quad_light(np.array(corners))
    else:
        radius = rng.uniform(0.2, 1.2)
        round_kind = SphereLight if rng.random() < 0.5 else DiskLight
        light = round_kind(tuple(center), radius, (1.0,) * 3)
        slope = radius / np.linalg.norm(center)
        half = np.arcsin(slope) if round_kind is SphereLight else np.arctan(slope)
        outline = round_light(center / np.linalg.norm(center), half)
    spheres = [
        (np.array((*rng.uniform(-0.5, 0.5, 2), rng.uniform(1.0, 1.6))), rng.uniform(0.05, 0.4))
        for _ in range(rng.integers(0, 4))
    ]
    quads = []
    for _ in range(rng.integers(0, 3)):
        u, v = rng.normal(size=(2, 3)) * 0.3
        q = np.array((*rng.uniform(-0.4, 0.4, 2), 1.3)) - (u + v) / 2.0
        quads.append((q, u, v))
    shapes = [Sphere(tuple(c), r) for c, r in spheres]
    if kind is Triangle:
        faces = [np.array((q, q + u, q + v)) for q, u, v in quads]
        shapes += [Triangle(tuple(map(tuple, face))) for face in faces]
    else:
        faces = [np.array((q, q + u, q + u + v, q + v)) for q, u, v in quads]
        shapes += [Quad(*map(tuple, quad)) for quad in quads]
    return Scene(look_at((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)), tuple(shapes), (light,)), (
        outline,
        spheres,
        faces,
    )


@pytest.mark.parametrize("kind", [Quad, Triangle])
@pytest.mark.parametrize("seed", range(5))
def test_factor_agrees_with_lines_across_the_light(seed, kind):
    rng = np.random.default_rng(seed)
    partial = 0
    for case in range(40):
        scene, (outline, spheres, faces) = random_view(rng, kind)
        normal = rng.normal(size=3) + np.array((0.0, 0.0, 1.0))
        normal /= np.linalg.norm(normal)
        want = visible(outline, normal, spheres, faces)
        got = light_at_origin(scene, normal)
        assert abs(got - want) <= AGREEMENT, f"seed {seed}, case {case}: {got} is not {want}"
        partial += 0.0 < want < visible(outline, normal) - AGREEMENT
    assert partial > 5, "hardly any light was hidden in part"


def outline_area(center, radius, pixel):
    """Pixels that a sphere covers: the ellipse in which a cone meets the picture's plane."""
    depth, distance = -center[2], np.linalg.norm(center)
    sine2 = (radius / distance) ** 2
    cosine2 = (depth / distance) ** 2
    return np.pi * sine2 * np.sqrt(1.0 - sine2) / (cosine2 - sine2) ** 1.5 / pixel**2


@pytest.mark.slow
@pytest.mark.parametrize("motion", [(0.0, 0.0, 0.0), (1.5, -0.7, 0.0), (0.3, 0.2, 2.0)])
def test_a_sphere_covers_an_ellipse_at_each_time(motion):
    center, radius, pixel = np.array((0.3, -0.4, -10.0)), 1.1, 36.0 / 50.0 / 24.0
    ball = Sphere((0.3, -0.4, 0.0), radius, motion=Motion(motion))
    scene = Scene(ABOVE, (ball,), (), (1.0, 1.0, 1.0))
    truth = converged(scene, goal=1e-5)
    nodes, weights = np.polynomial.legendre.leggauss(12)
    areas = [outline_area(center + t / 2.0 * np.array(motion), radius, pixel) for t in nodes]
    want = np.dot(weights, areas) / 2.0
    got = (1.0 - truth.color[:, 0]).sum()
    assert got == pytest.approx(want, rel=OUTLINE)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3, 6, 10, 11])
def test_truth_is_what_samples_tend_to(seed):
    """Pixels drawn by many samples: the difference is what the samples' own spread explains."""
    scene = random_scene(seed)
    width, height = scene.camera.resolution
    box = (width // 3, height // 3, width // 3 + 8, height // 3 + 8)
    scene = replace(scene, camera=replace(scene.camera, border=box))
    want, error = reference(scene, 1024)
    got = converged(scene, goal=1e-3).picture(scene.camera)
    noise = np.sqrt((error**2).mean())
    off = np.sqrt(((got - want) ** 2).mean())
    assert off <= 2.0 * noise + 1e-3 * want.mean(), f"seed {seed}: {off} with noise {noise}"


@pytest.mark.slow
def test_a_finer_goal_changes_less_than_the_coarser_one_allows():
    scene = random_scene(2)
    pixels = np.random.default_rng(0).integers((0, 0), scene.camera.resolution, (60, 2))
    coarse, fine = (converged(scene, pixels, goal, scale=1.0).color for goal in (1e-3, 1e-5))
    assert np.sqrt(((coarse - fine) ** 2).mean()) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("height", [0.0004, 0.004, 0.2497, 0.2544, 0.5031, 0.9971])
def test_a_straight_edge_beside_the_outermost_nodes_is_seen(height):
    """All nodes of a band lay on one side of it: a pixel was off by 0.5 % of the step."""
    camera = Camera(resolution=(24, 24))
    step = camera.sensor_width / camera.focal_length / 24
    black = Material((0.0, 0.0, 0.0))
    plate = Quad((-9.0, -9.0, -5.0), (18.0, 0.0, 0.0), (0.0, 9.0 + 5.0 * step * height, 0.0), black)
    lamp = QuadLight((0.0, 0.0, 5.0), (0.1, 0.0, 0.0), (0.0, -0.1, 0.0), (1.0, 1.0, 1.0))
    scene = Scene(camera, (plate,), (lamp,), background=(1.0, 1.0, 1.0))
    got = converged(scene, np.array([[7, 12]]), goal=1e-6, scale=1.0).color
    assert np.allclose(got, 1.0 - height, atol=2e-6)
