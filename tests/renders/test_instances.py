# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of instances: as those of copies of the mesh, at rest and in motion."""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.geometry.mesh import shape as mesh_shape
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Material, Motion, Quad, QuadLight, Scene
from adaptive_drt.scene.mesh_instances import MeshInstances
from adaptive_drt.scene.settings import Settings
from mesh_shapes import ball_mesh, bumpy_mesh, placed, scattered, turned_steps
from oracle.converged import relative_rmse
from random_scenes import look_at

FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.8, 0.8)))
LAMP = QuadLight((1.5, -1.5, 5.0), (0.9, 0.0, 0.0), (0.0, -0.9, 0.0), (12.0, 11.0, 9.0))
CAMERA = look_at((0.5, -6.0, 3.5), (0.0, 0.0, 0.9), resolution=(18, 12))
SKY = (0.1, 0.2, 0.3)
BUMPY = bumpy_mesh(12, 8, center=(0.0, 0.0, 0.0), smooth=True)


def picture(*shapes, **settings):
    scene = Scene(CAMERA, (FLOOR, *shapes), (LAMP,), SKY)
    return render_image(scene, Settings(**{"tolerance": 1e-2, **settings}))


def copies(mesh, matrices):
    return [placed(mesh, matrices[0, ..., k]) for k in range(matrices.shape[3])]


@pytest.mark.parametrize(
    ("method", "most"),
    [
        pytest.param("EXACT", 0),
        pytest.param("EXACT", 1 << 16, marks=pytest.mark.slow),
        pytest.param("RAYS", 0, marks=pytest.mark.slow),
    ],
)
def test_pictures_are_those_of_copies(most, method, monkeypatch):
    monkeypatch.setattr(mesh_shape, "MOST_COPIED_FACES", most)
    matrices = scattered(np.random.default_rng(0), 8, size=0.3)
    ours = picture(MeshInstances(BUMPY, matrices, BUMPY.materials), method=method)
    other = picture(*copies(BUMPY, matrices), method=method)
    assert relative_rmse(ours.color, other.color) < (1.2e-2 if method == "EXACT" else 3e-2)
    assert abs(ours.color.mean() / other.color.mean() - 1.0) < 3e-3
    if not most:
        figures = ours.stats["plan"]
        assert figures["mesh_instances"] == 8 and figures["mesh_faces"] == BUMPY.faces.shape[1]


@pytest.mark.slow
def test_instances_of_several_materials_have_holes_for_none(monkeypatch):
    monkeypatch.setattr(mesh_shape, "MOST_COPIED_FACES", 0)
    slot = (BUMPY.vertices[2, BUMPY.faces].mean(axis=0) > 0.2).astype(np.int64)
    colors = (Material((0.2, 0.5, 0.8)), Material((0.9, 0.3, 0.1)))
    mesh = replace(BUMPY, face_slot=slot, materials=colors)
    matrices = scattered(np.random.default_rng(1), 5, size=0.5)
    ours, other = picture(MeshInstances(mesh, matrices, colors)), picture(*copies(mesh, matrices))
    assert relative_rmse(ours.color, other.color) < 1.2e-2


@pytest.mark.slow
def test_what_moves_straight_is_what_a_moving_mesh_is():
    mesh = ball_mesh(10, 6, center=(0.0, 0.0, 0.0))
    ends = [(-0.5, 0.0, 1.0), (0.0, 0.15, 1.1), (0.5, 0.3, 1.2)]
    ours = picture(MeshInstances(mesh, turned_steps((0.3,) * 3, (0.8,) * 3, ends), mesh.materials))
    still = placed(mesh, turned_steps((0.3,), (0.8,), [ends[1]])[0, ..., 0])
    other = picture(replace(still, motion=Motion((1.0, 0.3, 0.2))))
    assert relative_rmse(ours.color, other.color) < 1.4e-2
    assert ours.mask[1].any()
    without = picture(
        MeshInstances(mesh, turned_steps((0.3,) * 3, (0.8,) * 3, ends), mesh.materials),
        use_motion=False,
    )
    assert relative_rmse(without.color, picture(still).color) < 1.2e-2


@pytest.mark.slow
def test_what_turns_and_grows_is_the_mean_of_its_moments():
    matrices = turned_steps((0.0, 0.9, 1.8), (0.4, 0.7, 1.0), [(0.8, 0.0, 1.1)] * 3)
    mesh = bumpy_mesh(12, 8, bumps=0.4, center=(0.3, 0.0, 0.0))
    ours = picture(MeshInstances(mesh, matrices, mesh.materials))
    moments = (np.arange(48) + 0.5) / 48
    mean = 0.0
    for part in moments:
        one = turned_steps((1.8 * part,), (0.4 + 0.6 * part,), [(0.8, 0.0, 1.1)])
        mean = mean + picture(placed(mesh, one[0, ..., 0])).color / moments.size
    assert relative_rmse(ours.color, mean) < 1.4e-2
    assert ours.mask[1].mean() > 0.05
    rays = picture(MeshInstances(mesh, matrices, mesh.materials), method="RAYS", time_rays=256)
    assert relative_rmse(rays.color, mean) < 3e-2


@pytest.mark.slow
def test_pilot_pixels_spend_the_tolerance_on_a_field_of_instances(monkeypatch):
    """Nets are better than the spread of their points tells: pixels need not state all of it."""
    monkeypatch.setattr(mesh_shape, "MOST_COPIED_FACES", 0)
    matrices = scattered(np.random.default_rng(5), 400, size=0.15)
    camera = look_at((0.5, -3.0, 3.0), (0.0, 0.0, 0.8), resolution=(40, 40))
    scene = Scene(camera, (FLOOR, MeshInstances(BUMPY, matrices, BUMPY.materials)), (LAMP,), SKY)
    ours, fine = (render_image(scene, Settings(tolerance=each)) for each in (1e-2, 2e-3))
    assert 0.65 * 1e-2 < ours.stats["error_estimate"] < 1e-2
    assert 0.4 * 1e-2 < relative_rmse(ours.color, fine.color) < 0.95e-2
