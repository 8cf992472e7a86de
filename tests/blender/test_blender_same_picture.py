# SPDX-License-Identifier: GPL-3.0-or-later
"""The button's picture is the engine's: the same pixels, shown and saved in the same way."""

from __future__ import annotations

import importlib
import json

import bpy
import numpy as np
import pytest
import things

ENGINE = "ADAPTIVE_DRT"


@pytest.fixture
def stage(file):
    """A floor, a ball on it and a lamp, seen from above; 24 x 16 pixels."""
    scene = bpy.context.scene
    things.plane(size=8.0)
    things.uv_sphere("Ball").location.z = 1.0
    things.light("AREA", energy=300.0, size=2.0).location = (1.0, 0.0, 5.0)
    scene.render.resolution_x, scene.render.resolution_y = 24, 16
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    return scene


def flat(image):
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels


def load(path):
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    pixels = flat(image)
    bpy.data.images.remove(image)
    return pixels


def by_engine(scene, path):
    """The Render Result that the engine makes, through a file."""
    before = scene.render.engine
    scene.render.engine, scene.render.filepath = ENGINE, str(path)
    bpy.ops.render.render(write_still=True)
    scene.render.engine = before
    return load(path)


def by_button():
    bpy.ops.adaptive_drt.render()
    return flat(bpy.data.images["Adaptive Render"])


def add_array(ball, **switches):
    array = ball.modifiers.new("Array", "ARRAY")
    array.count = 3
    for name, value in switches.items():
        setattr(array, name, value)


def as_they_are(scene):
    pass


def clear_background(scene):
    scene.render.film_transparent = True


def modifier_of_renders(scene):
    add_array(bpy.data.objects["Ball"], show_viewport=False)


def modifier_of_the_viewport(scene):
    add_array(bpy.data.objects["Ball"], show_render=False)


def hidden_in_the_viewport(scene):
    bpy.data.objects["Ball"].hide_viewport = True


def simplified(scene):
    """Subdivision is off in renders alone, so the cage that is no sphere becomes none either."""
    cube = things.made("Cube", lambda b: things.bmesh.ops.create_cube(b, size=2.0))
    cube.modifiers.new("Subdivision", "SUBSURF").render_levels = 3
    scene.render.use_simplify = True
    scene.render.simplify_subdivision_render = 0


def particles(scene):
    """A tenth of them in the viewport."""
    emitter = bpy.data.objects["Plane"]
    settings = emitter.modifiers.new("P", "PARTICLE_SYSTEM").particle_system.settings
    settings.type, settings.count, settings.use_advanced_hair = "HAIR", 20, True
    settings.render_type, settings.instance_object = "OBJECT", bpy.data.objects["Ball"]
    settings.particle_size, settings.display_percentage = 0.1, 10


def keyed_and_edited(scene):
    ball = bpy.data.objects["Ball"]
    things.keyed(ball, "location", (-2.0, 0.0, 1.0), (2.0, 0.0, 1.0))
    scene.frame_set(4)
    ball.location.x = 3.0


def in_motion(scene):
    keyed_and_edited(scene)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 2.0


def markers(scene):
    other = scene.camera.copy()
    things.link(other).location.x = 1.0
    scene.timeline_markers.new("Cut", frame=1).camera = other


CASES = (
    as_they_are,
    clear_background,
    modifier_of_renders,
    modifier_of_the_viewport,
    hidden_in_the_viewport,
    simplified,
    particles,
    keyed_and_edited,
    in_motion,
    markers,
)


@pytest.mark.parametrize("case", CASES, ids=lambda c: c.__name__)
def test_the_button_s_pixels_are_the_engine_s(stage, tmp_path, case):
    case(stage)
    mine = by_button()
    assert mine.any()
    np.testing.assert_array_equal(mine, by_engine(stage, tmp_path / "engine.exr"))


def test_it_is_saved_as_the_render_result_is(stage, tmp_path):
    """Through the view transform, look, exposure and gamma; the pixels stay scene-linear."""
    view = stage.view_settings
    view.view_transform, view.exposure, view.gamma = "AgX", -1.0, 1.3
    stage.render.dither_intensity = 0.0  # noise that Blender adds to its own alone
    linear = by_button()
    settings = stage.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "PNG", "8", "RGBA"
    image = bpy.data.images["Adaptive Render"]
    image.save_render(str(tmp_path / "button.png"), scene=stage)
    expected = by_engine(stage, tmp_path / "engine.png")
    np.testing.assert_array_equal(load(tmp_path / "button.png"), expected)
    assert image.use_view_as_render and image.source == "FILE"
    np.testing.assert_array_equal(flat(image), linear)
    for name in ("Adaptive Mask", "Adaptive Samples"):
        assert not bpy.data.images[name].use_view_as_render


def test_an_image_of_an_earlier_version_is_shown_so_as_well(stage):
    """Files hold images that were generated."""
    old = bpy.data.images.new("Adaptive Render", 5, 7, alpha=True, float_buffer=True)
    by_button()
    assert bpy.data.images["Adaptive Render"] == old and len(bpy.data.images) == 3
    assert old.source == "FILE" and old.use_view_as_render and tuple(old.size) == (24, 16)


def test_the_user_s_render_result_stays(stage, tmp_path):
    expected = by_engine(stage, tmp_path / "before.exr")
    bpy.data.objects["Ball"].location.x = 2.0
    assert (by_button() != expected).any()
    result = bpy.data.images["Render Result"]
    result.save_render(str(tmp_path / "after.exr"), scene=stage)
    np.testing.assert_array_equal(load(tmp_path / "after.exr"), expected)
    by_button()
    names = [slot.name for slot in result.render_slots]
    assert result.render_slots.active_index == 0 and names.count("Adaptive Render") == 1


def test_all_slots_that_are_in_use_stay(stage, tmp_path):
    by_engine(stage, tmp_path / "before.exr")
    result = bpy.data.images["Render Result"]
    for number in range(8):
        result.render_slots.active_index = number
        stage.world = bpy.data.worlds.new("Grey")
        stage.world.color = (number / 8.0,) * 3
        by_engine(stage, tmp_path / f"{number}.exr")
    by_button()
    for number in range(8):
        result.render_slots.active_index = number
        result.save_render(str(tmp_path / "after.exr"), scene=stage)
        kept = load(tmp_path / "after.exr")
        np.testing.assert_array_equal(kept, load(tmp_path / f"{number}.exr"))


def test_nothing_else_is_rendered_or_written(stage, tmp_path):
    """No compositing, no sequencer, no other view layer, and settings stay as they were."""
    stage.view_layers.new("Other")
    stage.render.use_sequencer = stage.render.use_compositing = True
    stage.render.use_freestyle = True
    stage.render.filepath = str(tmp_path / "nothing.exr")
    engine = importlib.import_module("drt_under_test.operators.engine_export")
    layers = []
    answer = engine.Request.answer

    def watch(self, host, depsgraph):
        layers.append(depsgraph.view_layer.name)
        answer(self, host, depsgraph)

    before = [stage.render.engine, *(layer.use for layer in stage.view_layers)]
    engine.Request.answer = watch
    try:
        by_button()
    finally:
        engine.Request.answer = answer
    assert layers == [bpy.context.view_layer.name]
    assert before == [stage.render.engine, *(layer.use for layer in stage.view_layers)]
    assert stage.render.use_sequencer and stage.render.use_compositing
    assert stage.render.use_freestyle and not list(tmp_path.iterdir())


def make_simulation(ball):
    """A zone of simulation that moves the ball by 0.1 a frame."""
    tree = bpy.data.node_groups.new("Simulation", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end, first, last, move = (
        tree.nodes.new(kind)
        for kind in (
            "NodeGroupInput",
            "NodeGroupOutput",
            "GeometryNodeSimulationInput",
            "GeometryNodeSimulationOutput",
            "GeometryNodeTransform",
        )
    )
    first.pair_with_output(last)
    last.state_items.clear()
    last.state_items.new("GEOMETRY", "Geometry")
    move.inputs["Translation"].default_value = (0.1, 0.0, 0.0)
    for source, sink in (
        (start.outputs[0], first.inputs["Geometry"]),
        (first.outputs["Geometry"], move.inputs[0]),
        (move.outputs[0], last.inputs["Geometry"]),
        (last.outputs["Geometry"], end.inputs[0]),
    ):
        tree.links.new(source, sink)
    ball.modifiers.new("Simulation", "NODES").node_group = tree


@pytest.mark.parametrize("what", ["render", "check"])
def test_a_simulation_goes_on_at_its_own_speed(stage, what):
    ball = bpy.data.objects["Ball"]
    make_simulation(ball)
    stage.render.use_motion_blur = True
    places = []
    for frame in range(1, 6):
        stage.frame_set(frame)
        getattr(bpy.ops.adaptive_drt, what)()
        graph = bpy.context.evaluated_depsgraph_get()
        vertices = ball.evaluated_get(graph).data.vertices
        places.append(sum(v.co.x for v in vertices) / len(vertices))
    np.testing.assert_allclose(places, [0.1 * frame for frame in range(1, 6)], atol=1e-4)


def test_what_blender_draws_over_f12_s_picture_alone_is_told(stage):
    """Freestyle's lines and Grease Pencil go over the Render Result, not over our image."""
    stage.render.use_freestyle = True
    bpy.ops.adaptive_drt.check()
    state = importlib.import_module("drt_under_test.operators.state").state
    ((issue,),) = state.issues.values()
    assert "Freestyle" in issue.reason and "F12" in issue.reason and issue.kind == "VIEW_LAYER"
    bpy.context.view_layer.use_freestyle = False
    bpy.ops.adaptive_drt.check()
    assert list(state.issues.values()) == [()]


def test_a_pass_that_the_compositor_asks_for_is_told_by_the_button_too(stage, addon):
    """The button runs no compositor, but what the scene's own lacks is told as F12 tells it."""
    compositor = importlib.import_module("drt_under_test.operators.compositor")
    stage.world = bpy.data.worlds.new("World")
    bpy.context.view_layer.use_pass_mist = True
    stage.render.engine = "CYCLES"
    tree = compositor.compositor_tree(stage)
    layers = next(n for n in tree.nodes if n.type == "R_LAYERS")
    viewer = tree.nodes.new("CompositorNodeViewer")
    tree.links.new(layers.outputs["Mist"], viewer.inputs[0])
    by_button()
    figures = json.loads(bpy.data.images["Adaptive Mask"]["adaptive_drt"])
    assert any("Mist" in issue["reason"] for issue in figures["issues"])
    assert layers.outputs["Mist"].is_linked and stage.render.engine == "CYCLES"
