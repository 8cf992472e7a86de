# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes that shine: materials, the lights that they are, and those that light nothing."""

from __future__ import annotations

import math

import bmesh
import bpy
import numpy as np
import pytest
import things

COLOR = (0.5, 0.25, 1.0, 1.0)
GLOW = pytest.approx((1.0, 0.5, 2.0))


def _emission(strength=2.0):
    return things.material("Glow", "ShaderNodeEmission", Color=COLOR, Strength=strength)


def test_an_emission_shader_reflects_nothing(export, core):
    things.uv_sphere("Ball", radius=0.5).data.materials.append(_emission())
    scene = export()
    (ball,), (light,) = scene.shapes, scene.lights
    assert scene.issues == () and ball.material.color == (0.0, 0.0, 0.0)
    assert ball.material.emission == GLOW and light.radiance == GLOW
    assert isinstance(light, core.SphereLight) and light.radius == pytest.approx(0.5)
    assert ball.visibility.unlit_by == ball.visibility.passed_by == {light.name} == {"Ball"}


def test_a_principled_shader_reflects_and_shines(export):
    matt = things.material(
        Base_Color=COLOR, Specular_IOR_Level=0.0, Emission_Color=COLOR, Emission_Strength=2.0
    )
    things.uv_sphere("Ball").data.materials.append(matt)
    scene = export()
    assert scene.issues == () and len(scene.lights) == 1
    assert scene.shapes[0].material.emission == GLOW
    assert scene.shapes[0].material.color == pytest.approx(COLOR[:3])


def test_a_flat_face_shines_on_both_sides(export, core):
    plane = things.plane("Plane", size=2.0)
    plane.data.materials.append(_emission())
    plane.scale.x = 3.0
    scene = export()
    front, back = scene.lights
    assert isinstance(front, core.QuadLight) and scene.issues == ()
    assert front.half_u == back.half_v and front.half_v == back.half_u
    assert math.hypot(*front.half_u) + math.hypot(*front.half_v) == pytest.approx(4.0)
    assert scene.shapes[0].visibility.unlit_by == {front.name} == {back.name}


def _outward(light):
    front = np.cross(light.half_u, light.half_v)
    return float(front @ np.array(light.center)) > 0.0


@pytest.mark.parametrize("inside", [None, "ball", "camera"])
def test_a_box_is_six_lights(export, inside):
    """Their inner sides count where something is inside."""
    box = things.made("Box", lambda work: bmesh.ops.create_cube(work, size=1.0))
    box.data.materials.append(_emission())
    box.rotation_euler = (0.3, 0.4, 0.5)
    things.plane("Floor", 9.0).location.z = -0.9
    if inside == "ball":
        things.uv_sphere("Ball", 0.2)
    if inside == "camera":
        bpy.context.scene.camera.location = (0.1, 0.0, 0.0)
    scene = export()
    outward = [_outward(light) for light in scene.lights]
    assert sum(outward) == 6 and len({light.name for light in scene.lights}) == 6
    assert len(outward) == (12 if inside else 6)


def test_inner_sides_of_what_casts_no_shadow_or_is_open_count(export):
    box = things.made("Box", lambda work: bmesh.ops.create_cube(work, size=1.0))
    box.data.materials.append(_emission())
    box.visible_shadow = False
    assert len(export().lights) == 12
    box.visible_shadow = True
    tube = things.made(
        "Tube",
        lambda work: bmesh.ops.create_cone(work, segments=4, radius1=1.0, radius2=1.0, depth=1.0),
    )
    tube.data.materials.append(box.data.materials[0])
    tube.location.x = 5.0
    assert len(export().lights) == 6 + 2 * 4


def _face(*corners):
    points = [(*corner, 0.0) for corner in corners]
    face = things.mesh_object("Face", points, [tuple(range(len(points)))])
    face.data.materials.append(_emission())
    return face


def test_a_triangle_shines(export, core):
    _face((0.0, 0.0), (2.0, 0.0), (0.0, 1.0))
    scene = export()
    front, back = scene.lights
    assert isinstance(front, core.PolygonLight) and scene.issues == ()
    assert front.vertices == back.vertices[::-1] and front.radiance == GLOW
    assert scene.shapes[0].visibility.passed_by == {front.name} == {back.name}


def test_a_filled_circle_is_one_light_of_two_sides(export):
    bpy.ops.mesh.primitive_circle_add(vertices=32, fill_type="NGON")
    bpy.context.object.data.materials.append(_emission())
    scene = export()
    assert [len(light.vertices) for light in scene.lights] == [32, 32] and scene.issues == ()
    assert {name for shape in scene.shapes for name in shape.visibility.unlit_by} == {"Circle"}


def test_an_arrow_is_several_lights(export):
    _face((-1, 0), (0, 0.3), (1, 0), (0.3, 0.4), (0, 1), (-0.3, 0.4))
    scene = export()
    assert 4 <= len(scene.lights) <= 8 and len({light.name for light in scene.lights}) > 1
    for shape in scene.shapes:
        assert len(shape.visibility.unlit_by) == 1


def test_other_shapes_that_shine_light_nothing(export):
    bpy.ops.mesh.primitive_torus_add(major_segments=10, minor_segments=5)
    bpy.context.object.name = "Torus"
    bpy.context.object.data.materials.append(_emission())
    scene = export()
    assert scene.lights == ()
    (reason,) = things.reasons(scene)["Torus"]
    assert "lights nothing" in reason


def test_too_many_faces_stay_a_mesh(export, core):
    """Triangles in closed form would take time for nothing."""
    bpy.ops.mesh.primitive_torus_add(major_segments=8, minor_segments=4)
    bpy.context.object.data.materials.append(_emission())
    scene = export()
    assert scene.lights == () and not any(type(each) is core.Triangle for each in scene.shapes)


def test_without_diffuse_rays_it_lights_nothing(export):
    ball = things.uv_sphere("Ball")
    ball.data.materials.append(_emission())
    ball.visible_diffuse = False
    scene = export()
    assert scene.lights == () and scene.shapes[0].material.emission == GLOW


def test_black_emission_is_no_light(export):
    things.uv_sphere("Ball").data.materials.append(_emission(0.0))
    assert export().lights == ()


def test_the_exposure_of_the_film_brightens_what_shines(export):
    things.uv_sphere("Ball").data.materials.append(_emission())
    if hasattr(bpy.context.scene, "cycles"):
        bpy.context.scene.cycles.film_exposure = 2.0
        scene = export()
        twice = pytest.approx((2.0, 1.0, 4.0))
        assert scene.shapes[0].material.emission == twice and scene.lights[0].radiance == twice


def test_a_linked_strength_is_told(export):
    glow = _emission()
    node = next(n for n in glow.node_tree.nodes if n.type == "EMISSION")
    falloff = glow.node_tree.nodes.new("ShaderNodeLightFalloff")
    glow.node_tree.links.new(falloff.outputs[0], node.inputs["Strength"])
    things.uv_sphere("Ball").data.materials.append(glow)
    scene = export()
    (issue,) = scene.issues
    assert issue.kind == "MATERIAL" and "its own value is used" in issue.reason
    assert scene.shapes[0].material.emission == GLOW


def test_a_coarse_ball_that_shines_is_a_sphere(export, core):
    """With its faces it would light nothing."""
    ball = things.ico_sphere(radius=0.5)
    ball.data.shade_flat()
    ball.data.materials.append(_emission())
    scene = export()
    assert [type(each) for each in scene.lights] == [core.SphereLight]
    assert [type(each) for each in scene.shapes] == [core.Sphere]
    assert any("facets" in reason for reason in things.reasons(scene)[ball.name])
