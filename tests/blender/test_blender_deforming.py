# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that change while the shutter is open are told; those that only move are not."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
import things
from node_chains import chain

DEFORMS = "it deforms during the shutter; it is rendered as at the middle of the shutter"


@pytest.fixture
def shutter(file):
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    return scene


def _keyed(owner, path, first, last):
    setattr(owner, path, first)
    owner.keyframe_insert(path, frame=1)
    setattr(owner, path, last)
    owner.keyframe_insert(path, frame=11)


def _shape_key(thing):
    thing.shape_key_add(name="Basis")
    key = thing.shape_key_add(name="Wider")
    for point in key.data:
        point.co.x *= 2.0
    _keyed(key, "value", 0.0, 1.0)


def _driven_modifier(thing):
    cast = thing.modifiers.new("Displace", "DISPLACE")
    driver = thing.driver_add(f'modifiers["{cast.name}"].strength').driver
    driver.expression = "frame / 10"


def _lattice(thing):
    cage = things.link(bpy.data.objects.new("Cage", bpy.data.lattices.new("Cage")))
    cage.scale = (4.0, 4.0, 4.0)
    for point in cage.data.points:
        point.co_deform.x *= 1.5
    thing.modifiers.new("Lattice", "LATTICE").object = cage
    parent = cage.parent = things.link(bpy.data.objects.new("Parent", None))
    things.keyed(parent, "rotation_euler", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def _armature(thing):
    bones = bpy.data.armatures.new("Bones")
    rig = things.link(bpy.data.objects.new("Rig", bones))
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bones.edit_bones.new("Bone").tail = (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    group = thing.vertex_groups.new(name="Bone")
    group.add([0], 1.0, "ADD")
    thing.modifiers.new("Armature", "ARMATURE").object = rig
    _keyed(rig.pose.bones["Bone"], "location", (0.0, 0.0, 0.0), (5.0, 0.0, 0.0))


def _nodes(thing):
    tree = chain(thing, "GeometryNodeTransform")
    move = next(n for n in tree.nodes if n.bl_idname == "GeometryNodeTransform")
    socket = move.inputs["Translation"]
    socket.default_value = (0.0, 0.0, 0.0)
    socket.keyframe_insert("default_value", frame=1)
    socket.default_value = (5.0, 0.0, 0.0)
    socket.keyframe_insert("default_value", frame=11)


CHANGES = {
    "shape key": _shape_key,
    "driven modifier": _driven_modifier,
    "lattice that a parent turns": _lattice,
    "armature": _armature,
    "nodes": _nodes,
}


@pytest.mark.parametrize("kind", CHANGES)
@pytest.mark.parametrize("blurred", [False, True])
def test_a_mesh_that_deforms_is_told(rendered, shutter, kind, blurred):
    plane = things.plane()
    CHANGES[kind](plane)
    shutter.render.use_motion_blur = blurred
    shutter.frame_set(6)
    (scene,) = rendered()
    told = [i.reason for i in scene.issues]
    if scene.shapes:
        assert told == [DEFORMS] * blurred and not any(i.missing for i in scene.issues)
    else:  # a plane that is bent is no plane any more, which says all
        assert kind == "armature" and [i.missing for i in scene.issues] == [True]


def test_faces_that_come_during_the_shutter_are_told(rendered, shutter):
    """The number of vertices changes as well."""
    field = things.plane()
    array = field.modifiers.new("Array", "ARRAY")
    array.count = 1
    array.keyframe_insert("count", frame=5)
    array.count = 3
    array.keyframe_insert("count", frame=6)
    shutter.frame_set(6)
    (scene,) = rendered()
    assert [i.reason for i in scene.issues] == [DEFORMS] and scene.shapes


def test_a_ball_that_grows_by_its_mesh_is_told(rendered, shutter):
    ball = things.uv_sphere()
    _shape_key(ball)
    for point in ball.data.shape_keys.key_blocks["Wider"].data:
        point.co.y *= 2.0
        point.co.z *= 2.0
    shutter.frame_set(6)
    (scene,) = rendered()
    assert [i.reason for i in scene.issues] == [DEFORMS]
    assert scene.shapes[0].radius == pytest.approx(1.5, rel=1e-2)


def test_instances_of_what_deforms_are_told(rendered, shutter):
    field, source = things.plane("Field", size=8.0), things.plane("Source")
    _shape_key(source)
    things.scatter(field, source)
    source.hide_render = True
    shutter.frame_set(6)
    (scene,) = rendered()
    assert [(i.name, i.reason, i.target) for i in scene.issues] == [
        ("Field/Source", DEFORMS, "Field")
    ]


def test_what_only_moves_does_not_deform(rendered, shutter):
    """A modifier computes it anew at each time, with other roundings."""
    parent = things.link(bpy.data.objects.new("Parent", None))
    things.keyed(parent, "location", (0.0, 0.0, 0.0), (70.0, 3.0, 0.0))
    cage = things.link(bpy.data.objects.new("Cage", bpy.data.lattices.new("Cage")))
    plane, ball = things.plane(), things.uv_sphere()
    for thing in (cage, plane, ball):
        thing.parent = parent
    for thing in (plane, ball):
        thing.rotation_euler = (0.1, 0.2, 0.3)
        thing.modifiers.new("Lattice", "LATTICE").object = cage
    shutter.frame_set(6)
    (scene,) = rendered()
    assert len(scene.shapes) == 2 and scene.issues == ()


@pytest.mark.parametrize("switch", ["use_motion_blur", "use_deform_motion"])
@pytest.mark.parametrize("whose", ["object", "instancer"])
def test_switches_of_cycles_are_heeded(rendered, shutter, switch, whose):
    """An object's own, and that of what repeats it."""
    inside = bpy.data.collections.new("Inside")
    plane = things.plane()
    bpy.context.scene.collection.objects.unlink(plane)
    inside.objects.link(plane)
    empty = things.link(bpy.data.objects.new("Empty", None))
    empty.instance_type, empty.instance_collection = "COLLECTION", inside
    things.keyed(empty, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    _shape_key(plane)
    shutter.frame_set(6)
    owner = plane if whose == "object" else empty
    setattr(owner.cycles, switch, False)
    (scene,) = rendered()
    assert scene.issues == ()
    assert (scene.shapes[0].motion is None) == (switch == "use_motion_blur")


def _with_velocity(thing, speed):
    attribute = thing.data.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    ways = np.zeros((len(thing.data.vertices), 3), dtype=np.float32)
    ways[:, 0] = speed
    attribute.data.foreach_set("vector", ways.ravel())


@pytest.mark.parametrize("speed", [0.0, 30.0])
def test_the_velocity_that_simulations_leave_is_told(rendered, shutter, speed):
    _with_velocity(things.plane(), speed)
    shutter.frame_set(6)
    (scene,) = rendered()
    said = 'its "velocity" attribute moves it during the shutter; it is rendered without that'
    assert [i.reason for i in scene.issues] == ([said] if speed else [])


def test_cycles_moves_by_velocity_and_not_what_is_hidden_at_the_middle(shutter, tmp_path):
    """Why the first is told, and why a thing that only the shutter's ends show is not."""
    from peer import render_cycles

    lamp, plane = things.light("POINT", energy=500.0), things.plane()
    lamp.location.z = 5.0
    shutter.frame_set(6)
    still = render_cycles(tmp_path, samples=16)
    _with_velocity(plane, 60.0)
    assert (
        math.sqrt(((render_cycles(tmp_path, samples=16) - still) ** 2).mean()) > 0.1 * still.mean()
    )
    for frame, hidden in ((5, False), (6, True), (7, False)):
        plane.hide_render = hidden
        plane.keyframe_insert("hide_render", frame=frame)
    shutter.frame_set(6)
    assert not render_cycles(tmp_path, samples=16).any()
