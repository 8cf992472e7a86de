# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres whose faces other renderers show, and spheres with normals of another form."""

from __future__ import annotations

import bpy
import pytest
import things
from mathutils import Vector

FACETS = "its facets are left out: it is rendered as a smooth sphere"
CUSTOM = "its custom normals are left out: it is rendered as a sphere"


@pytest.mark.parametrize(
    "size, flat, smooth",
    [((3, 3), 1, 1), ((16, 8), 1, 1), ((32, 16), 1, 0), ((48, 24), 0, 0), ((256, 128), 0, 0)],
)
def test_facets_of_a_uv_sphere(export, size, flat, smooth):
    """The add menu's 32 x 16 is flat-shaded: a picture of it is 4 % off Cycles'."""
    ball = things.uv_sphere(segments=size[0], rings=size[1])
    ball.scale = (3.0, 3.0, 3.0)
    assert [i.reason for i in export().issues] == [FACETS] * smooth
    ball.data.shade_flat()
    scene = export()
    assert [i.reason for i in scene.issues] == [FACETS] * flat
    assert len(scene.shapes) == 1 and not any(i.missing for i in scene.issues)


@pytest.mark.parametrize("level, flat, smooth", [(1, 1, 1), (2, 1, 1), (3, 1, 1), (4, 0, 0)])
def test_facets_of_an_icosphere(export, level, flat, smooth):
    ball = things.ico_sphere(subdivisions=level)
    ball.data.flip_normals()  # which side faces look to does not matter
    assert [i.reason for i in export().issues] == [FACETS] * smooth
    ball.data.shade_flat()
    assert [i.reason for i in export().issues] == [FACETS] * flat


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
    scene = export()
    expected = [] if kind == "its own" else [CUSTOM]
    assert [i.reason for i in scene.issues] == expected and len(scene.shapes) == 1


def test_normals_from_another_mesh(export):
    """From 4.5 on Blender's face normals are custom ones as well."""
    ball, source = things.uv_sphere(segments=64, rings=32), things.plane("Source", size=0.1)
    source.hide_render = True
    transfer = ball.modifiers.new("Normals", "DATA_TRANSFER")
    transfer.object = source
    transfer.use_loop_data, transfer.data_types_loops = True, {"CUSTOM_NORMAL"}
    transfer.loop_mapping = "NEAREST_POLYNOR"
    bpy.context.view_layer.update()
    assert [i.reason for i in export().issues if i.name == "Sphere"] == [CUSTOM]
