# SPDX-License-Identifier: GPL-3.0-or-later
"""Means by a stencil of neighbouring centres: where blocks are not used at all."""

from dataclasses import replace

from adaptive_drt import exact
from adaptive_drt.image import shadow_stencil
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Material, Quad, QuadLight, Scene
from adaptive_drt.scene.settings import Settings
from mesh_shapes import ball_mesh
from oracle.converged import relative_rmse
from random_scenes import look_at

FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.8, 0.8)))
LAMP = QuadLight((1.5, -1.5, 5.0), (0.9, 0.0, 0.0), (0.0, -0.9, 0.0), (12.0, 11.0, 9.0))
CAMERA = look_at((0.5, -6.0, 3.5), (0.0, 0.0, 0.9), resolution=(40, 30))
SCENE = Scene(CAMERA, (FLOOR, ball_mesh(40, 30, smooth=True)), (LAMP,), (0.1, 0.2, 0.3))


def test_pictures_are_those_of_sampled_pixels(monkeypatch):
    settings = Settings(tolerance=4e-3)
    with monkeypatch.context() as without:
        without.setattr(exact.ExactRender, "_interpolate_shadows", lambda *_: iter(()))
        plain = render_image(SCENE, settings)
    monkeypatch.setattr(exact, "SHADOW_SIDES", ())
    film = render_image(SCENE, settings)
    assert relative_rmse(film.color, plain.color) < 5.5e-3
    shaded, points = (each.stats["rays"]["shaded"] for each in (film, plain))
    assert shaded < 0.9 * points


def test_what_varies_too_much_is_left_to_points(monkeypatch):
    monkeypatch.setattr(shadow_stencil, "INTERPOLATION_ERROR_SHARE", -1.0)
    scene = replace(SCENE, background=(0.0, 0.0, 0.0))
    film = render_image(scene, Settings(tolerance=1e-2))
    assert film.samples.max() >= 16
    assert film.stats["error_estimate"] < 1.3e-2
