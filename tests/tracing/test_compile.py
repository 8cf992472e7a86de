# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiled scenes: what is numbered, what moves against the camera, and what is left out."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.scene.description import Motion, PointLight, Quad, Scene, Sphere, SphereLight
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from random_scenes import look_at, random_scene
from shape_sets import quads_of, spheres_of

EYE = look_at((0.0, -5.0, 2.0), (0.0, 0.0, 0.0), resolution=(20, 10))
BALL = Sphere((0.0, 0.0, 1.0), 0.5)
FLOOR = Quad((-3.0, -3.0, 0.0), (6.0, 0.0, 0.0), (0.0, 6.0, 0.0))
LAMP = SphereLight((1.0, 1.0, 5.0), 0.3, (5.0, 5.0, 5.0))
SCENE = Scene(EYE, (FLOOR, BALL), (LAMP,))


def reasons(plan):
    return {each["what"]: each["why"] for each in plan.skipped}


@pytest.mark.parametrize("seed", range(20))
def test_spheres_come_first_and_all_is_relative_to_the_camera(seed):
    scene = random_scene(seed)
    plan = make_plan(scene, Settings())
    eye = np.array(scene.camera.matrix)[:3, 3]
    drift = np.array(scene.camera.motion.displacement) if scene.camera.motion else np.zeros(3)
    spheres = [shape for shape in scene.shapes if isinstance(shape, Sphere)]
    quads = [shape for shape in scene.shapes if isinstance(shape, Quad)]
    assert spheres_of(plan).count == len(spheres) and plan.object_count == len(spheres) + len(quads)
    for k, shape in enumerate(spheres):
        np.testing.assert_allclose(spheres_of(plan).center[:, k], np.array(shape.center) - eye)
        assert spheres_of(plan).radius[k] == shape.radius
    for k, shape in enumerate(quads):
        np.testing.assert_allclose(quads_of(plan).corner[:, k], np.array(shape.corner) - eye)
        np.testing.assert_array_equal(quads_of(plan).edge_u[:, k], shape.edge_u)
    for k, shape in enumerate([*spheres, *quads]):
        way = (np.array(shape.motion.displacement) if shape.motion else np.zeros(3)) - drift
        assert plan.is_moving[k] == way.any()
        np.testing.assert_array_equal(plan.albedo[:, k], shape.material.color)
        part, own = (
            (spheres_of(plan), k) if k < len(spheres) else (quads_of(plan), k - len(spheres))
        )
        moved = np.zeros(3) if part.displacement is None else part.displacement[:, own]
        np.testing.assert_allclose(moved, way)


def test_motion_may_be_switched_off_and_moves_with_the_camera_are_none():
    way = Motion((1.0, 0.0, 0.0))
    moving = replace(SCENE, shapes=(FLOOR, replace(BALL, motion=way)))
    assert make_plan(moving, Settings()).motion
    off = make_plan(moving, Settings(use_motion=False))
    assert not off.motion and reasons(off)["motion blur"] == "switched off"
    still = make_plan(SCENE, Settings())
    assert not still.motion and "nothing moves" in reasons(still)["motion blur"]
    together = Scene(
        replace(EYE, motion=way),
        tuple(replace(shape, motion=way) for shape in SCENE.shapes),
        (replace(LAMP, motion=way),),
    )
    assert not make_plan(together, Settings()).motion
    assert make_plan(replace(SCENE, camera=replace(EYE, motion=way)), Settings()).motion


def test_what_gives_no_light_and_what_is_there_twice_is_skipped():
    dark = replace(LAMP, radiance=(0.0, 0.0, 0.0), name="dark")
    plan = make_plan(
        Scene(EYE, (FLOOR, BALL, replace(BALL, name="copy")), (LAMP, dark)), Settings()
    )
    assert len(plan.lights) == 1 and plan.object_count == 2
    assert "no power" in reasons(plan)["dark"] and "same place" in reasons(plan)["copy"]


@pytest.mark.parametrize(
    "scene, settings, has, why",
    [
        (SCENE, Settings(), True, ""),
        (SCENE, Settings(use_penumbra=False), False, "switched off"),
        (replace(SCENE, shapes=()), Settings(), False, "no object"),
        (replace(SCENE, lights=(PointLight((0.0, 0.0, 4.0), (1.0, 1.0, 1.0)),)), Settings(), False,
         "no light with a size"),
        (replace(SCENE, lights=(replace(LAMP, casts_shadow=False),)), Settings(), False,
         "no light with a size"),
    ],
)  # fmt: skip
def test_penumbrae(scene, settings, has, why):
    plan = make_plan(scene, settings)
    assert plan.penumbra == has and why in reasons(plan).get("penumbrae", "")
    for light in plan.lights:
        assert plan.as_shadow_caster(light).extended == (has and light.extended)


def test_plans_pass_between_processes_without_their_event():
    plan = make_plan(random_scene(7), Settings())
    plan.stop.set()
    copy = pickle.loads(pickle.dumps(plan))
    assert not copy.stop.is_set() and copy.region == plan.region
    np.testing.assert_array_equal(spheres_of(copy).center, spheres_of(plan).center)


def test_summaries_are_numbers_and_switches():
    plan = make_plan(SCENE, Settings(threads=3, accelerator="ARRAYS"))
    assert plan.summary() == {
        "spheres": 1, "quads": 1, "triangles": 0, "ellipses": 0, "ellipsoids": 0,
        "cylinders": 0, "meshes": 0, "lights": 1,
        "penumbra": True, "motion": False, "edges": True, "accelerator": ["ARRAYS"],
        "threads": 3, "solid_rays": "none", "flat_faces_by_rays": 0,
    }  # fmt: skip
