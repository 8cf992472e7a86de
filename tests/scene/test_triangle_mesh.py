# SPDX-License-Identifier: GPL-3.0-or-later
"""Records of meshes: parts by material, equality, and what cannot be rendered."""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.scene.description import Camera, Material, Motion, Scene, validate
from adaptive_drt.scene.triangle_mesh import TriangleMesh
from mesh_shapes import ball_mesh


def two_colors():
    mesh = ball_mesh(8, 4, smooth=True)
    slot = np.arange(mesh.faces.shape[1]) % 2 * 2
    return replace(mesh, face_slot=slot, materials=(Material(), Material(), Material((1, 0, 0))))


def test_a_mesh_has_one_part_for_each_material_in_use():
    mesh = two_colors()
    assert mesh.count == 2 and mesh.slot.tolist() == [0, 2]
    parts = list(mesh.records())
    assert [part.slot.tolist() for part in parts] == [[0], [2]]
    assert sum(part.faces.shape[1] for part in parts) == mesh.faces.shape[1]
    assert parts[1].normals.shape == (3, 3, parts[1].faces.shape[1])
    assert mesh.take(np.array([False, True])) == parts[1]
    assert mesh.numbers().shape == (8, 2)
    assert (mesh.numbers()[:, 0] != mesh.numbers()[:, 1]).any()


def test_meshes_are_equal_if_all_their_content_is():
    mesh = two_colors()
    assert mesh == two_colors() and hash(mesh) == hash(two_colors())
    assert mesh != replace(mesh, normals=None)
    assert mesh != replace(mesh, vertices=mesh.vertices + 1e-12)
    assert "48" in repr(mesh)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"vertices": np.nan}, "vertices"),
        ({"vertices": 1e31}, "vertices"),
        ({"normals": np.inf}, "normals"),
    ],
)
def test_meshes_that_are_not_finite_are_named(change, word):
    mesh = two_colors()
    ((name, value),) = change.items()
    broken = getattr(mesh, name).copy()
    broken.reshape(-1)[5] = value
    mesh = replace(mesh, name="Suzanne", **{name: broken})
    scene = validate(Scene(Camera(), (mesh,)))
    assert sum(shape.count for shape in scene.shapes) < 2
    assert {issue.name for issue in scene.issues} == {"Suzanne"}
    assert all(word in issue.reason and issue.missing for issue in scene.issues)


def test_a_vertex_that_no_face_uses_may_be_anywhere():
    mesh = two_colors()
    vertices = np.concatenate([mesh.vertices, np.full((3, 1), np.nan)], axis=1)
    assert replace(mesh, vertices=vertices).defect() is None


def test_bad_colours_motion_and_no_faces():
    mesh = two_colors()
    assert "motion" in replace(mesh, motion=Motion((np.inf, 0.0, 0.0))).defect()
    assert "colour" in replace(mesh, materials=(Material((np.nan, 0.0, 0.0)),) * 3).defect()
    none = TriangleMesh(mesh.vertices, mesh.faces[:, :0], mesh.face_slot[:0], mesh.materials)
    assert "no faces" in none.defect()
    assert none.count == 0
