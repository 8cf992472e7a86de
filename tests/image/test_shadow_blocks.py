# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows of meshes interpolated between pixel centres: right, sparing, and without a miss."""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.exact import ExactRender
from adaptive_drt.image import shadow_blocks
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Material, Quad, QuadLight, Scene
from adaptive_drt.scene.settings import Settings
from mesh_shapes import ball_mesh, mesh_of
from oracle.converged import relative_rmse
from oracle.mesh_rays import sampled_mesh_picture
from random_scenes import look_at

FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.8, 0.8)))
LAMP = QuadLight((1.5, -1.5, 5.0), (0.9, 0.0, 0.0), (0.0, -0.9, 0.0), (12.0, 11.0, 9.0))
CAMERA = look_at((0.5, -6.0, 3.5), (0.0, 0.0, 0.9), resolution=(96, 64))
SCENE = Scene(CAMERA, (FLOOR, ball_mesh(60, 40, smooth=True)), (LAMP,), (0.1, 0.2, 0.3))


def wires(height, width=0.02):
    """Five long thin bars over the floor."""
    parts, faces = [], []
    for k in range(5):
        x = 0.35 * (k - 2.0) + 0.03
        bar = np.array([[x, x + width, x + width, x], [-1.5, -1.5, 1.5, 1.5], [height] * 4])
        faces += [(4 * k, 4 * k + 1, 4 * k + 2), (4 * k, 4 * k + 2, 4 * k + 3)]
        parts.append(bar)
    return mesh_of(np.concatenate(parts, axis=1), np.array(faces).T)


def test_interpolated_pictures_are_those_of_sampled_pixels(monkeypatch):
    film = render_image(SCENE, Settings(tolerance=3e-3))
    with monkeypatch.context() as without:
        without.setattr(ExactRender, "_interpolate_shadows", lambda *_: iter(()))
        plain = render_image(SCENE, Settings(tolerance=3e-3))
    assert relative_rmse(film.color, plain.color) < 4.1e-3
    assert abs(film.color.mean() / plain.color.mean() - 1.0) < 1e-3
    shaded = [each.stats["rays"]["mesh shadow"] for each in (film, plain)]
    # 0.51 here, 0.55 to 0.59 at 2e-3; 0.40 before rays looked for thin shadows where outlines reach
    assert shaded[0] < 0.65 * shaded[1]


@pytest.mark.parametrize(
    "height", [*(pytest.param(height, marks=pytest.mark.slow) for height in (0.03, 0.3)), 1.2]
)
def test_shadows_of_wires_are_not_stepped_over(height):
    scene = replace(SCENE, shapes=(FLOOR, wires(height)))
    scene = replace(scene, camera=look_at((0.5, -5.0, 5.0), (0.0, 0.0, 0.0), resolution=(64, 48)))
    first, second = (sampled_mesh_picture(scene, 512, seed) for seed in range(2))
    truth, noise = 0.5 * (first + second), 0.5 * relative_rmse(first, second)
    film = render_image(scene, Settings(tolerance=1e-2))
    assert relative_rmse(film.color, truth) < np.hypot(1e-2, noise)
    assert abs(film.color.mean() / truth.mean() - 1.0) < 1.5e-3


def test_parts_of_a_picture_are_those_of_the_whole():
    whole = render_image(SCENE, Settings(tolerance=1e-2)).color
    border = (21, 10, 80, 51)
    part = replace(SCENE, camera=replace(CAMERA, border=border))
    found = render_image(part, Settings(tolerance=1e-2, batch=512, threads=1)).color
    np.testing.assert_array_equal(found, whole[:, 10:51, 21:80])


def test_sums_over_squares_are_of_all_their_pixels():
    values = np.random.default_rng(0).random((8, 8, 3))
    sums = shadow_blocks._sums_of_squares(values)
    np.testing.assert_allclose(sums, values.reshape(4, 2, 4, 2, 3).sum(axis=(1, 3)))


def test_blocks_that_single_rays_contradict_are_left(monkeypatch):
    """Rays that never agree leave all blocks in penumbrae to the stencil and to points."""
    settings = Settings(tolerance=1e-2)
    film = render_image(SCENE, settings)
    monkeypatch.setattr(shadow_blocks, "AGREEMENT", -1e9)
    other = render_image(SCENE, settings)
    assert other.stats["rays"]["mesh shadow"] > film.stats["rays"]["mesh shadow"]
    assert relative_rmse(film.color, other.color) < 1e-2
