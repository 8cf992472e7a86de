# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat faces are traced where their closed forms cost more, and look the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.detection.face_costs import rays_cost_less_than_faces
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Motion, SphereLight
from adaptive_drt.scene.face_meshes import flat_faces
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from flat_scenes import AREA, SKY, cubes, flat_scene, picket_fence

SIZE = (48, 36)


def rays_chosen(scene, tolerance):
    plan = make_plan(scene, Settings(tolerance=tolerance), reduced=True)
    return rays_cost_less_than_faces(plan, flat_faces(scene.shapes))


@pytest.mark.parametrize(
    ("faces", "light", "tolerance", "chosen"),
    [
        (cubes(1, 3), SKY, 0.01, False),
        (cubes(1, 10), SKY, 0.01, True),
        (cubes(1, 10), SKY, 0.001, False),
        (cubes(1, 30), SKY, 0.001, True),
        (cubes(1, 30), AREA, 0.01, False),
        (cubes(1, 1), SKY, 0.01, False),
        (picket_fence(60, 0.2), AREA, 0.01, True),
        (picket_fence(60, 0.2), AREA, 0.001, True),
    ],
)
def test_what_costs_less_is_chosen(faces, light, tolerance, chosen):
    assert rays_chosen(flat_scene(faces, light, SIZE), tolerance) == chosen


def test_a_picture_of_the_sky_alone_has_no_rays():
    scene = flat_scene(cubes(1, 10), SKY, SIZE)
    away = np.array(scene.camera.matrix)
    away[:3, :3] *= np.array([1.0, -1.0, -1.0])
    turned = replace(scene.camera, matrix=tuple(map(tuple, away.tolist())))
    assert not rays_chosen(replace(scene, camera=turned, shapes=scene.shapes[1:]), 0.01)


def test_a_small_light_does_not_surround():
    lamp = SphereLight((1.0, -2.0, 4.0), 0.2, (50.0, 50.0, 50.0))
    assert not rays_chosen(flat_scene(cubes(1, 10), lamp, SIZE), 0.01)


@pytest.mark.parametrize(
    ("faces", "light", "truth_tolerance"),
    [
        (cubes(2, 8), SKY, 0.002),
        (picket_fence(16, 0.3), AREA, 0.003),
        (replace(picket_fence(6, 0.3), motion=Motion((0.05, 0.02, 0.0))), AREA, 0.003),
    ],
    ids=["cubes", "fence", "moving fence"],
)
def test_traced_faces_keep_the_tolerance(faces, light, truth_tolerance, monkeypatch):
    scene = flat_scene(faces, light, (32, 24))
    closed = render_image(scene, Settings(tolerance=truth_tolerance))
    assert closed.stats["plan"]["flat_faces_by_rays"] == 0
    monkeypatch.setattr("adaptive_drt.render.rays_cost_less_than_faces", lambda *_: True)
    traced = render_image(scene, Settings(tolerance=0.01))
    assert traced.stats["plan"]["flat_faces_by_rays"] == faces.count
    difference = np.sqrt(((traced.color - closed.color) ** 2).mean()) / closed.color.mean()
    assert difference < 0.01
    assert traced.stats["error_estimate"] <= 0.01
    # detection flags what the closed forms flag: outlines in the same pixels
    missed = closed.mask[2] & ~traced.mask[2]
    assert not missed.any()


@pytest.mark.parametrize("change", [{"method": "RAYS"}, {"accelerator": "ARRAYS"}])
def test_without_rays_through_meshes_faces_stay(change, monkeypatch):
    monkeypatch.setattr("adaptive_drt.render.rays_cost_less_than_faces", lambda *_: True)
    scene = flat_scene(cubes(1, 2), AREA, (4, 3))
    film = render_image(scene, Settings(light_rays=1, time_rays=1, threads=1, **change))
    assert film.stats["plan"]["flat_faces_by_rays"] == 0
