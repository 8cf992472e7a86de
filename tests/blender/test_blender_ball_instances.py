# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances of a ball are one batch of spheres: the same as a sphere for each of them."""

from __future__ import annotations

import importlib
import time

import bpy
import numpy as np
import pytest
import things
from node_chains import chain


def _grid(name="Field", segments=3):
    field = things.plane(name, segments=segments)
    field.location, field.rotation_euler = (0.5, -0.3, 0.2), (0.3, 0.2, 0.5)
    return field


def _by_nodes(ball, **kinds):
    field = _grid(**kinds)
    things.scatter(field, ball)
    return field


def _by(kind):
    def make(ball):
        field = _grid()
        ball.parent, field.instance_type = field, kind
        field.use_instance_faces_scale = True
        field.show_instancer_for_render = False
        return field

    return make


def _by_particles(ball, count=20):
    field = _grid()
    field.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = field.particle_systems[0].settings
    settings.count, settings.frame_start, settings.frame_end = count, -10, 0
    settings.render_type, settings.instance_object = "OBJECT", ball
    settings.particle_size, settings.size_random, settings.lifetime = 0.5, 0.7, 100.0
    settings.factor_random = 2.0
    field.show_instancer_for_render = False
    return field


def _by_collection(ball):
    inside = bpy.data.collections.new("Inside")
    inside.objects.link(ball)
    twin = things.link(bpy.data.objects.new("Twin", ball.data), inside)
    twin.location.x, twin.material_slots[0].link = 3.0, "OBJECT"
    twin.material_slots[0].material = things.matt("Green", 0.1, 0.8, 0.1)
    for k in range(3):
        empty = things.link(bpy.data.objects.new("Empty", None))
        empty.location.y, empty.scale = 3.0 * k, (1.0 + k,) * 3
        empty.instance_type, empty.instance_collection = "COLLECTION", inside
    return empty


WAYS = {
    "nodes": _by_nodes,
    "vertices": _by("VERTS"),
    "faces": _by("FACES"),
    "particles": _by_particles,
    "collection": _by_collection,
}


def _ball(name="Ball"):
    ball = things.uv_sphere(name, radius=0.1)
    ball.data.materials.append(things.matt("Red", 0.8, 0.1, 0.1))
    ball.location = (0.2, 0.1, 0.4)
    return ball


@pytest.fixture
def both(export, addon, core, monkeypatch):
    """Export the scene twice: in batches, and instance by instance; returns both scenes."""
    made = importlib.import_module(f"{addon.__name__}.operators.export.ball_instances")
    engine = importlib.import_module(f"{addon.__name__}.operators.engine_export")
    batches = importlib.import_module(f"{addon.__name__}.adaptive_drt.scene.sphere_batch")

    def run():
        # the fixture `export` has the shapes one by one
        scene = engine.export_for_render(bpy.context.scene, bpy.context.view_layer)[0]
        assert any(isinstance(shape, batches.Spheres) for shape in scene.shapes)
        batched = export()
        with monkeypatch.context() as patch:
            patch.setattr(made.BallInstances, "take", lambda *_: False)
            return batched, export()

    return run


def assert_same(one, other):
    assert set(one.issues) == set(other.issues)
    place = lambda shape: (shape.name, *np.round(shape.center, 4))  # noqa: E731
    ours, theirs = (sorted(scene.shapes, key=place) for scene in (one, other))
    assert len(ours) == len(theirs) > 1
    for a, b in zip(ours, theirs, strict=True):
        assert (a.name, a.material, a.visibility) == (b.name, b.material, b.visibility)
        assert a.center == pytest.approx(b.center, abs=1e-12)
        assert a.radius == pytest.approx(b.radius, rel=1e-12)
        assert (a.motion is None) == (b.motion is None)
        if a.motion is not None:
            assert a.motion.displacement == pytest.approx(b.motion.displacement, abs=1e-12)


@pytest.mark.parametrize("way", WAYS)
def test_batches_are_what_single_instances_are(both, way):
    ball = _ball()
    WAYS[way](ball)
    one, other = both() if way != "collection" else both_of_few(both)
    assert_same(one, other)


def both_of_few(both):
    """Each empty repeats each object once only, so there is one batch at least of a field."""
    things.scatter(_grid("Other"), _ball("Small"))
    return both()


@pytest.mark.parametrize("frames", [(1, 11), (5, 7)])
@pytest.mark.parametrize("way", ["nodes", "vertices", "particles"])
def test_motion_is_that_of_each_instance(both, way, frames):
    field = WAYS[way](_ball())
    things.keyed(field, "location", (0.0, 0.0, 0.0), (5.0, 1.0, 0.0))
    things.keyed(field, "rotation_euler", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0 * frames[0]
    scene.frame_set(frames[1])
    one, other = both()
    assert_same(one, other)
    ways = [shape.motion for shape in one.shapes if shape.name == "Field/Ball"]
    assert len(ways) > 5 and len(set(ways)) > 1


def test_what_grows_is_rendered_with_its_faces(export):
    field = _by_nodes(_ball())
    things.keyed(field, "scale", (1.0, 1.0, 1.0), (2.0, 2.0, 2.0))
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    scene.frame_set(6)
    made = export()
    (copies,) = (shape for shape in made.shapes if shape.name.startswith("Field/Ball"))
    assert copies.matrices.shape == (3, 3, 4, 16)
    assert not [issue for issue in made.issues if issue.name.startswith("Field/Ball")]


def test_instances_that_appear_are_told(both):
    field = _grid()
    array = field.modifiers.new("Array", "ARRAY")
    array.relative_offset_displace = (1.5, 0.0, 0.0)
    for frame, count in ((1, 2), (11, 8)):
        array.count = count
        array.keyframe_insert("count", frame=frame)
    things.scatter(field, _ball())
    things.keyed(field, "location", (0.0, 0.0, 0.0), (5.0, 1.0, 0.0))
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 4.0
    scene.frame_set(6)
    one, other = both()
    assert_same(one, other)
    assert any("not there all the shutter" in issue.reason for issue in one.issues)
    assert len({shape.motion is None for shape in one.shapes}) == 2


def test_stretched_and_hidden_ones_are_no_balls(export, core):
    """Nodes scale every other instance unevenly."""
    ball = _ball()
    field = _by_nodes(ball)
    tree = field.modifiers[0].node_group
    place = next(n for n in tree.nodes if n.bl_idname == "GeometryNodeInstanceOnPoints")
    index, combine = (
        tree.nodes.new(f"{kind}") for kind in ("GeometryNodeInputIndex", "ShaderNodeCombineXYZ")
    )
    power = tree.nodes.new("ShaderNodeMath")
    power.operation, power.inputs[1].default_value = "MODULO", 2.0
    more = tree.nodes.new("ShaderNodeMath")
    more.inputs[1].default_value = 1.0
    tree.links.new(index.outputs[0], power.inputs[0])
    tree.links.new(power.outputs[0], more.inputs[0])
    tree.links.new(more.outputs[0], combine.inputs[0])
    combine.inputs[1].default_value = combine.inputs[2].default_value = 1.0
    tree.links.new(combine.outputs[0], place.inputs["Scale"])
    shapes = [shape for shape in export().shapes if shape.name == "Field/Ball"]
    round_ones = [shape for shape in shapes if isinstance(shape, core.Sphere)]
    assert len(shapes) == 16 and len(round_ones) == 8


def test_instances_that_shine_are_lights(export):
    ball = _ball()
    ball.data.materials[0] = things.material("Glow", "ShaderNodeEmission", Strength=1.0)
    _by_nodes(ball)
    assert len(export().lights) == 16 + 1


def test_switches_of_instancer_and_layer(both):
    ball = _ball()
    field = _by_nodes(ball)
    field.visible_camera = False
    one, other = both()
    assert_same(one, other)
    assert sum(not shape.visibility.camera for shape in one.shapes) == 16


def test_instances_of_what_nodes_make(both):
    """The instances' object is the instancer itself, and their meshes have no object."""
    field = _grid()
    tree = chain(field, "GeometryNodeInstanceOnPoints")
    place = next(n for n in tree.nodes if n.bl_idname == "GeometryNodeInstanceOnPoints")
    sphere = tree.nodes.new("GeometryNodeMeshUVSphere")
    sphere.inputs["Radius"].default_value = 0.1
    tree.links.new(sphere.outputs[0], place.inputs["Instance"])
    assert_same(*both())


def test_motion_does_not_multiply_the_time(export, addon):
    """Ten thousand that turn took nine times as long as still ones; now they take four."""
    engine = importlib.import_module(f"{addon.__name__}.operators.engine_export")
    field, scene = _by_nodes(_ball(), segments=100), bpy.context.scene
    things.keyed(field, "location", (0.0, 0.0, 0.0), (5.0, 1.0, 0.0))
    things.keyed(field, "rotation_euler", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    scene.frame_set(6)
    taken = []
    for scene.render.use_motion_blur in (False, True):
        engine.export_for_render(scene, bpy.context.view_layer)
        times = []
        for _ in range(3):
            before = time.process_time()
            engine.export_for_render(scene, bpy.context.view_layer)
            times.append(time.process_time() - before)
        taken.append(min(times))
    assert taken[1] < 6.5 * taken[0]


@pytest.mark.slow
def test_a_hundred_thousand_are_exported_quickly(export, addon):
    engine = importlib.import_module(f"{addon.__name__}.operators.engine_export")
    _by_nodes(_ball(), segments=316)
    before = time.process_time()
    scene = engine.export_for_render(bpy.context.scene, bpy.context.view_layer)[0]
    taken = time.process_time() - before
    assert max(getattr(shape, "count", 1) for shape in scene.shapes) == 317**2
    assert taken < 2.0
