# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres of one object as arrays: the same as a record for each of them."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import shape_sets
from adaptive_drt.scene.description import (
    Camera,
    Material,
    Motion,
    Scene,
    Sphere,
    single_shapes,
    validate,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.scene.sphere_batch import Spheres
from adaptive_drt.tracing.compile import make_plan

RED, BLUE = Material((0.8, 0.1, 0.1)), Material((0.1, 0.1, 0.8))


def spheres_of(count, seed=0, **fields):
    generator = np.random.default_rng(seed)
    center, radius = generator.normal(size=(3, count)), generator.uniform(0.1, 1.0, count)
    return Spheres(center, radius, np.arange(count) % 2, (RED, BLUE), **fields)


def plans_of(*shapes, **settings):
    """The checked scenes and plans of records of many, and of the same with records of one."""
    scene = Scene(Camera(motion=Motion((0.1, 0.0, 0.3))), shapes)
    singles = replace(scene, shapes=single_shapes(shapes))
    checked = [validate(each) for each in (scene, singles)]
    return checked, [make_plan(each, Settings(**settings)) for each in checked]


def assert_same(many, single):
    ours, theirs = (shape_sets.spheres_of(plan) for plan in (many, single))
    for name in ("center", "radius", "displacement"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))
    for name in ("albedo", "is_moving", "emission", "seen"):
        np.testing.assert_array_equal(getattr(many, name), getattr(single, name))
    assert many.skipped == single.skipped


@pytest.mark.parametrize("use_motion", [True, False])
def test_many_compile_as_singles_do(use_motion):
    generator = np.random.default_rng(3)
    ball = Sphere((0.0, 0.0, -5.0), 1.0)
    colored = spheres_of(5, 1, albedo=generator.uniform(size=(3, 5)))
    ways = np.where(np.arange(6) % 3, generator.normal(size=(3, 6)), 0.0)
    apart = spheres_of(6, 2, displacement=ways, name="Apart")
    moving = spheres_of(4, 4, motion=Motion((0.0, 1.0, 0.0)), name="Moving")
    _, (many, single) = plans_of(spheres_of(7), ball, colored, apart, moving, use_motion=use_motion)
    assert_same(many, single)
    assert shape_sets.spheres_of(many).count == 7 + 1 + 5 + 6 + 4


def test_duplicates_are_left_out_one_by_one():
    spheres = spheres_of(6)
    still = replace(spheres.take(np.array([4, 1])), displacement=np.zeros((3, 2)))
    moving = replace(spheres.take(np.array([2])), displacement=np.ones((3, 1)))
    alone = next(spheres.take(np.array([3])).records())
    _, (many, single) = plans_of(spheres, still, alone, moving)
    assert_same(many, single)
    assert shape_sets.spheres_of(many).count == 6 + 1


def test_what_cannot_be_rendered_is_said_of_each():
    spheres = spheres_of(7, name="Cloud", albedo=np.ones((3, 7)), displacement=np.zeros((3, 7)))
    spheres.center[1, 4] = np.nan
    spheres.radius[:3] = 0.0, -1.0, 1e-70
    spheres.albedo[0, 5], spheres.displacement[2, 6] = np.inf, np.nan
    dark = replace(spheres_of(2), materials=(RED, Material((np.nan, 0.0, 0.0))))
    (ours, theirs), (many, single) = plans_of(spheres, dark)
    assert ours.issues == theirs.issues and len(ours.issues) == 6 + 1
    assert_same(many, single)


def test_records_of_many_are_values():
    ones = np.ones((3, 4))
    spheres, same = (spheres_of(4, albedo=ones, displacement=ones) for _ in range(2))
    assert spheres == same and hash(spheres) == hash(same) and repr(spheres) == repr(same)
    assert pickle.loads(pickle.dumps(spheres)) == spheres
    assert spheres.take(np.array([1])).albedo.shape == (3, 1)
    for other in (
        replace(spheres, center=np.nextafter(spheres.center, 9.0)), replace(spheres, name="Other"),
        replace(spheres, radius=2.0 * spheres.radius), replace(spheres, albedo=None),
        replace(spheres, displacement=None), spheres.take(np.arange(3)), spheres_of(4, 1),
    ):  # fmt: skip
        assert other != spheres and repr(other) != repr(spheres)
    assert validate(Scene(Camera(), (spheres,))).shapes[0] is spheres
    with pytest.raises(NotImplementedError):
        spheres.edges()
