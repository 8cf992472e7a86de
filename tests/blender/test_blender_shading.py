# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres whose faces other renderers show, and spheres with normals of another form."""

from __future__ import annotations

import bpy
import pytest
import things
from mathutils import Vector

OUTLINE = "its faceted outline is left out: it is rendered as a sphere (Effects > Spheres)"
FACETS = "its facets are left out: it is rendered as a smooth sphere (Effects > Spheres)"
CUSTOM = "its custom normals are left out: it is rendered as a sphere"


@pytest.fixture
def spheres(export):
    """Render all meshes in the form of a sphere as spheres."""
    bpy.context.scene.adaptive_drt.spheres = "SPHERES"


@pytest.mark.parametrize(
    "size, flat, smooth",
    [((3, 3), 1, 1), ((16, 8), 1, 1), ((32, 16), 1, 0), ((48, 24), 0, 0), ((256, 128), 0, 0)],
)
def test_facets_of_a_uv_sphere(export, spheres, size, flat, smooth):
    """The add menu's 32 x 16 is flat-shaded: a picture of it is 4 % off Cycles'."""
    ball = things.uv_sphere(segments=size[0], rings=size[1])
    ball.scale = (3.0, 3.0, 3.0)
    assert [i.reason for i in export().issues] == [OUTLINE] * smooth
    ball.data.shade_flat()
    scene = export()
    assert [i.reason for i in scene.issues] == [FACETS] * flat
    assert len(scene.shapes) == 1 and not any(i.missing for i in scene.issues)


@pytest.mark.parametrize("level, flat, smooth", [(1, 1, 1), (2, 1, 1), (3, 1, 1), (4, 0, 0)])
def test_facets_of_an_icosphere(export, spheres, level, flat, smooth):
    ball = things.ico_sphere(subdivisions=level)
    ball.data.flip_normals()  # which side faces look to does not matter
    assert [i.reason for i in export().issues] == [OUTLINE] * smooth
    ball.data.shade_flat()
    assert [i.reason for i in export().issues] == [FACETS] * flat


@pytest.mark.parametrize(
    "make, smooth, rule, is_sphere",
    [
        (lambda: things.ico_sphere(subdivisions=2), False, "AUTO", False),
        (lambda: things.ico_sphere(subdivisions=3), False, "AUTO", False),
        (lambda: things.ico_sphere(subdivisions=4), False, "AUTO", True),
        (lambda: things.ico_sphere(subdivisions=2), True, "AUTO", True),
        (lambda: things.uv_sphere(), False, "AUTO", True),
        (lambda: things.uv_sphere(segments=16, rings=8), False, "AUTO", False),
        (lambda: things.uv_sphere(segments=16, rings=8), False, "SPHERES", True),
        (lambda: things.uv_sphere(segments=64, rings=32), True, "FACES", False),
    ],
)
def test_which_meshes_are_spheres(export, make, smooth, rule, is_sphere):
    """Few flat-shaded faces are meant to be seen, unless the scene says otherwise."""
    mesh = make().data
    mesh.shade_smooth() if smooth else mesh.shade_flat()
    bpy.context.scene.adaptive_drt.spheres = rule
    scene = export()
    (shape,) = scene.shapes
    assert hasattr(shape, "radius") == is_sphere
    assert is_sphere or not scene.issues


def test_a_sphere_with_a_flat_face_is_told(export):
    ball = things.uv_sphere()
    ball.data.polygons[7].use_smooth = False
    assert [i.reason for i in export().issues] == [FACETS]


@pytest.mark.parametrize("kind", ["its own", "reversed", "upward"])
def test_custom_normals_of_a_sphere(export, kind):
    ball = things.uv_sphere(segments=64, rings=32)
    normals = [
        {
            "its own": vertex.normal,
            "reversed": -vertex.normal,
            "upward": (vertex.normal + Vector((0.0, 0.0, 0.8))).normalized(),
        }[kind]
        for vertex in ball.data.vertices
    ]
    ball.data.normals_split_custom_set_from_vertices(normals)
    expected = [] if kind == "its own" else [CUSTOM]
    (shape,) = (scene := export()).shapes
    assert hasattr(shape, "radius") == (kind == "its own") and not scene.issues
    bpy.context.scene.adaptive_drt.spheres = "SPHERES"
    (shape,) = (scene := export()).shapes
    assert hasattr(shape, "radius") and [i.reason for i in scene.issues] == expected


def test_normals_from_another_mesh(export, spheres):
    """From 4.5 on Blender's face normals are custom ones as well."""
    ball, source = things.uv_sphere(segments=64, rings=32), things.plane("Source", size=0.1)
    source.hide_render = True
    transfer = ball.modifiers.new("Normals", "DATA_TRANSFER")
    transfer.object = source
    transfer.use_loop_data, transfer.data_types_loops = True, {"CUSTOM_NORMAL"}
    transfer.loop_mapping = "NEAREST_POLYNOR"
    bpy.context.view_layer.update()
    assert [i.reason for i in export().issues if i.name == "Sphere"] == [CUSTOM]
