# SPDX-License-Identifier: GPL-3.0-or-later
"""Records of instances: their parts, what is wrong with them, and where they are at mid-shutter."""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.scene.description import Material, Scene, single_shapes, validate
from adaptive_drt.scene.mesh_instances import MeshInstances, is_regular
from mesh_shapes import ball_mesh, scattered, turned_steps
from random_scenes import look_at

BALL = ball_mesh(6, 4)
PLACES = scattered(np.random.default_rng(0), 5)


def copies(mesh=BALL, matrices=PLACES):
    return MeshInstances(mesh, matrices, mesh.materials)


def test_a_part_for_each_material():
    slot = (BALL.vertices[2, BALL.faces].mean(axis=0) > 1.2).astype(np.int64)
    record = copies(replace(BALL, face_slot=slot, materials=(Material(), Material())))
    assert record.count == 2 and record.instances == 5
    parts = single_shapes((record,))
    assert [part.mesh.faces.shape[1] for part in parts] == np.bincount(slot).tolist()
    assert parts[0] != parts[1] and parts[0] == record.record(0)
    assert (record.numbers()[:, 0] != record.numbers()[:, 1]).any()


@pytest.mark.parametrize(
    "matrices, said",
    [
        (np.where(np.arange(5) == 2, np.nan, PLACES), "not finite"),
        (np.where(np.arange(5) == 2, 1e31, PLACES), "not finite"),
        (PLACES * np.array([1.0, 0.0, 1.0, 1.0])[:, None], "flatten"),
        (PLACES[..., :0], "no matrices"),
        (PLACES * 1e30, "beyond"),
    ],
)
def test_defects(matrices, said):
    record = copies(matrices=matrices)
    assert said in record.defect()
    scene = validate(Scene(look_at((0.0, -6.0, 3.0), (0.0, 0.0, 0.0)), (record,), ()))
    assert scene.shapes == () and all(issue.missing for issue in scene.issues)


def test_what_is_wrong_with_the_mesh_is_told():
    assert copies().defect() is None
    assert "faces" in copies(replace(BALL, faces=BALL.faces[:, :0])).defect()
    broken = replace(BALL, vertices=np.where(np.arange(3)[:, None] == 1, np.nan, BALL.vertices))
    assert "finite" in copies(broken).defect()


def test_the_middle_of_the_shutter():
    moving = copies(matrices=turned_steps((0.0, 1.0, 2.0), (1.0, 2.0, 3.0), np.eye(3)))
    np.testing.assert_array_equal(moving.at_rest().matrices[0], moving.matrices[1])
    two = copies(matrices=moving.matrices[::2])
    np.testing.assert_array_equal(two.at_rest().matrices[0], two.matrices.mean(axis=0))
    assert copies().at_rest().matrices is PLACES


def test_flat_matrices_are_not_regular():
    flat = (
        PLACES[0] * np.where(np.arange(5) == 3, 0.0, 1.0) ** np.array([0.0, 0.0, 1.0, 0.0])[:, None]
    )
    np.testing.assert_array_equal(is_regular(flat), np.arange(5) != 3)
    assert is_regular(1e-40 * PLACES[0]).all() and is_regular(1e40 * PLACES[0]).all()
