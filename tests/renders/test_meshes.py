# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of meshes: against brute force, against true spheres, and what must not leak."""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Material,
    Motion,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.scene.triangle_mesh import TriangleMesh
from mesh_shapes import ball_mesh, bumpy_mesh, grid_mesh
from oracle.converged import relative_rmse
from oracle.mesh_rays import sampled_mesh_picture
from random_scenes import look_at

FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.8, 0.8)))
LAMP = QuadLight((1.5, -1.5, 5.0), (0.9, 0.0, 0.0), (0.0, -0.9, 0.0), (12.0, 11.0, 9.0))
BULB = SphereLight((-2.0, -1.5, 4.0), 0.5, (20.0, 15.0, 10.0))
CAMERA = look_at((0.5, -6.0, 3.5), (0.0, 0.0, 0.9), resolution=(24, 16))
SKY = (0.1, 0.2, 0.3)


def two_colors(mesh):
    slot = (mesh.vertices[2, mesh.faces].mean(axis=0) > 1.2).astype(np.int64)
    return replace(mesh, face_slot=slot, materials=(Material((0.2, 0.5, 0.8)), Material()))


CASES = {
    "flat": (FLOOR, ball_mesh(10, 6)),
    "smooth": (FLOOR, ball_mesh(18, 12, smooth=True)),
    "colours": (FLOOR, two_colors(ball_mesh(10, 6))),
    "open": (FLOOR, grid_mesh(5, lambda x, y: 1.0 + 0.3 * np.sin(2.0 * x) * y, size=2.5)),
    "moving": (FLOOR, ball_mesh(10, 6, motion=Motion((1.0, 0.3, 0.2)))),
}


@pytest.mark.parametrize("name", [pytest.param("flat", marks=pytest.mark.slow), *list(CASES)[1:]])
def test_pictures_keep_their_tolerance_against_brute_force(name):
    lights = (LAMP, BULB) if name in ("flat", "colours") else (LAMP,)
    scene = Scene(CAMERA, CASES[name], lights, SKY)
    truth = sum(sampled_mesh_picture(scene, 1_024, seed) for seed in range(2)) / 2.0
    film = render_image(scene, Settings(tolerance=1e-2))
    assert relative_rmse(film.color, truth) < 1e-2
    assert abs(film.color.mean() / truth.mean() - 1.0) < 2e-3
    assert film.stats["sampled_pixels"] > 50
    assert film.stats["error_estimate"] < 1.3e-2


def test_a_fine_smooth_mesh_of_a_ball_looks_like_the_ball():
    ball = Scene(CAMERA, (FLOOR, Sphere((0.0, 0.0, 1.2), 1.0, Material((0.7, 0.6, 0.5)))), (LAMP,))
    mesh = replace(ball, shapes=(FLOOR, ball_mesh(200, 100, smooth=True)))
    truth = render_image(ball, Settings(tolerance=1e-3))
    film = render_image(mesh, Settings(tolerance=3e-3))
    assert relative_rmse(film.color, truth.color) < 5e-3
    rays = render_image(mesh, Settings(method="RAYS", light_rays=256, pixel_rays=64))
    assert relative_rmse(rays.color, truth.color) < 2e-2
    everywhere = replace(Settings(method="RAYS"), distribution="EVERYWHERE")
    assert relative_rmse(render_image(mesh, everywhere).color, truth.color) < 5e-2


def test_no_light_leaks_through_a_closed_mesh():
    """From inside a ball of a mesh that encloses the camera no light outside is seen."""
    shell = ball_mesh(24, 16, radius=3.0, center=(0.0, 0.0, 0.0), smooth=True)
    camera = look_at((0.0, 0.0, 0.0), (1.0, 0.2, 0.1), resolution=(9, 6))
    light = replace(BULB, center=(0.0, 0.0, 9.0))
    for method in ("EXACT", "RAYS"):
        film = render_image(Scene(camera, (shell,), (light,)), Settings(method=method))
        assert (film.color == 0.0).all()
        # a black picture, in which light has been searched for, is done
        assert method == "RAYS" or film.samples.max() <= 128


def test_a_mesh_at_rest_on_the_floor_has_a_shadow_up_to_its_edge():
    box = grid_mesh(1, lambda x, y: 0.0 * x + 1.0, size=2.0)
    scene = Scene(
        look_at((0.0, 0.0, 0.5), (0.0, 1.0, 0.0), resolution=(16, 12)),
        (FLOOR, box),
        (replace(LAMP, center=(0.0, 0.0, 5.0), half_u=(0.1, 0.0, 0.0), half_v=(0.0, -0.1, 0.0)),),
    )
    film = render_image(scene, Settings())
    # below the cover the floor is dark
    assert film.color[:, :2].max() == 0.0 < film.color.max()


def test_lit_pixels_far_from_the_shadow_are_exact():
    """The mesh is no candidate where none of its clusters may hide the light."""
    scene = Scene(CAMERA, (FLOOR, bumpy_mesh(80, 60, smooth=True)), (LAMP,), SKY)
    plain = replace(scene, shapes=(FLOOR,))
    film, floor = (render_image(each, Settings(tolerance=1e-3)) for each in (scene, plain))
    same = np.abs(film.color - floor.color).max(axis=0) < 1e-3 * floor.color.mean()
    assert same.mean() > 0.4
    assert film.stats["sampled_pixels"] < 0.8 * same.size


@pytest.mark.parametrize("method", ["EXACT", "RAYS"])
def test_hostile_meshes_are_harmless(method):
    rng = np.random.default_rng(0)
    ball = ball_mesh(8, 6)
    doubled = np.concatenate([ball.faces, ball.faces[::-1]], axis=1)
    needles = rng.normal(size=(3, 30)) * np.array([[1e-9], [1.0], [1.0]])
    cases = [
        (ball.vertices, doubled),
        (ball.vertices * 1e-7, ball.faces),
        (ball.vertices * 1e12, ball.faces),
        (needles, np.arange(30).reshape(3, 10)),
        (np.zeros((3, 6)), np.arange(6).reshape(3, 2)),
        (rng.normal(size=(3, 30)) * 10.0 ** rng.uniform(-20, 20, 30), np.arange(30).reshape(3, 10)),
    ]
    for vertices, faces in cases:
        slot = np.zeros(faces.shape[1], dtype=np.int64)
        mesh = TriangleMesh(vertices, faces, slot, (Material(),))
        scene = Scene(CAMERA, (FLOOR, mesh), (LAMP,), SKY)
        film = render_image(scene, Settings(method=method, tolerance=0.05))
        assert np.isfinite(film.color).all()
        assert film.color.mean() > 0.0 or vertices is cases[-1][0]  # which may hide all


def test_meshes_without_a_light_show_what_they_emit():
    glow = replace(ball_mesh(10, 6), materials=(Material(emission=(0.5, 0.25, 0.125)),))
    film = render_image(Scene(CAMERA, (FLOOR, glow), (), SKY), Settings(tolerance=2e-2))
    seen = film.color[0] > 0.3
    assert 20 < seen.sum() < 0.5 * seen.size
    np.testing.assert_allclose(film.color[:, 8, 12], (0.5, 0.25, 0.125))


def test_parts_of_a_picture_are_those_of_the_whole():
    scene = Scene(CAMERA, CASES["smooth"], (LAMP,), SKY)
    whole = render_image(scene, Settings(tolerance=2e-2)).color
    border = (8, 4, 20, 13)
    part = replace(scene, camera=replace(CAMERA, border=border))
    found = render_image(part, Settings(tolerance=2e-2, batch=64, threads=1)).color
    np.testing.assert_array_equal(found, whole[:, 4:13, 8:20])


@pytest.mark.parametrize("side", (0.9, 0.05))
def test_a_floor_in_the_shadow_of_a_mesh_covers_a_transparent_film(side):
    lamp = QuadLight((1.5, -1.5, 5.0), (side, 0.0, 0.0), (0.0, -side, 0.0), (9.0, 9.0, 9.0))
    down = look_at((0.5, -3.0, 6.0), (0.0, 0.0, 0.5), resolution=(48, 32))
    scene = Scene(down, (FLOOR, ball_mesh(18, 12)), (lamp,), transparent=True)
    assert np.allclose(render_image(scene, Settings()).alpha, 1.0, rtol=0.0, atol=1e-12)
