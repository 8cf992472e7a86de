# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of worlds and lights that a second Blender evaluates: what it is told, and what it says."""

from __future__ import annotations

import importlib
import json

import bpy
import numpy as np
import pytest
import things
from conftest import PACKAGE
from peer import render_cycles


@pytest.fixture
def tree(file):
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    return world.node_tree


@pytest.fixture
def graph(addon):
    """Describe what shines of a tree; returns the nodes' types, and the text."""
    module = importlib.import_module(f"{PACKAGE}.operators.export.node_graph")
    links = importlib.import_module(f"{PACKAGE}.operators.export.links")

    def described(tree):
        text = module.graph_of(links.surface_of(tree)).text
        return [node["type"][10:] for node in json.loads(text)["nodes"]], text

    return described


@pytest.fixture
def second(addon, monkeypatch):
    """In place of a second Blender: the orders that it gets; it answers with `second.sphere`."""
    module = importlib.import_module(f"{PACKAGE}.operators.export.baked")
    monkeypatch.setattr(module, "_kept", type(module._kept)())

    class Second:
        orders = ()
        sphere = np.random.default_rng(1).random((8, 16, 3)).astype(np.float32)

    def run(order, folder):
        Second.orders += (order,)
        np.save(folder / "sphere.npy", Second.sphere)
        np.save(folder / "error.npy", np.array(0.01))

    monkeypatch.setattr(module, "_run", run)
    return Second


def back(tree):
    return next(n for n in tree.nodes if n.type == "BACKGROUND")


def between(tree, kind="ShaderNodeGamma", source="ShaderNodeTexChecker"):
    """A node between a texture and the background."""
    node, texture = tree.nodes.new(kind), tree.nodes.new(source)
    tree.links.new(texture.outputs[0], node.inputs[0])
    tree.links.new(node.outputs[0], back(tree).inputs["Color"])
    return node


def test_a_description_holds_what_is_used_and_no_more(tree, graph):
    node = between(tree)
    kinds, text = graph(tree)
    assert kinds == ["Background", "Gamma", "TexChecker"]
    tree.nodes.new("ShaderNodeTexNoise")
    node.location, node.name = (100.0, 0.0), "Other"
    assert graph(tree)[1] == text
    node.inputs["Gamma"].default_value = 2.0
    assert graph(tree)[1] != text


def test_a_description_goes_through_groups_and_past_muted_nodes(tree, graph):
    node = between(tree)
    inner = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    for way in ("INPUT", "OUTPUT"):
        inner.interface.new_socket("Color", in_out=way, socket_type="NodeSocketColor")
    start, end, invert = (
        inner.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "ShaderNodeInvert")
    )
    inner.links.new(start.outputs[0], invert.inputs["Color"])
    inner.links.new(invert.outputs[0], end.inputs[0])
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    tree.links.new(node.outputs[0], group.inputs[0])
    tree.links.new(group.outputs[0], back(tree).inputs["Color"])
    assert graph(tree)[0] == ["Background", "Invert", "Gamma", "TexChecker"]
    node.mute = True
    assert graph(tree)[0] == ["Background", "Invert", "TexChecker"]


def test_ramps_curves_and_images_are_described(tree, graph):
    ramp = between(tree, "ShaderNodeValToRGB", "ShaderNodeTexEnvironment")
    image = tree.nodes["Environment Texture"].image = bpy.data.images.new("Sphere", 4, 2)
    texts = [graph(tree)[1]]
    ramp.color_ramp.elements[0].color = (0.1, 0.2, 0.3, 1.0)
    texts.append(graph(tree)[1])
    image.pixels[0] = 0.5
    texts.append(graph(tree)[1])
    curves = tree.nodes.new("ShaderNodeRGBCurve")
    tree.links.new(ramp.outputs[0], curves.inputs["Color"])
    tree.links.new(curves.outputs[0], back(tree).inputs["Color"])
    texts.append(graph(tree)[1])
    curves.mapping.curves[0].points[0].location = (0.1, 0.3)
    texts.append(graph(tree)[1])
    assert len(set(texts)) == 5


def test_a_tabulated_world_is_light_and_backdrop_and_is_kept(tree, second, export):
    between(tree)
    scene = export()
    fine = second.sphere.astype(np.float64)
    light = scene.lights[0]
    assert scene.issues[0].reason.startswith("its Background node is finer than the table of 4")
    assert light.pixels.shape == scene.backdrop.pixels.shape == (4, 8, 3)
    # rows nearer to a pole are smaller
    rows = fine.reshape(4, 2, 8, 2, 3).mean(axis=3)
    assert (light.pixels <= rows.max(axis=1) + 1e-6).all()
    assert (light.pixels >= rows.min(axis=1) - 1e-6).all()
    assert light.error >= 0.01
    export()
    assert len(second.orders) == 1


def test_a_world_that_is_the_same_all_over_is_a_sky(tree, second, export):
    second.sphere = np.full((8, 16, 3), (0.25, 0.5, 1.0), dtype=np.float32)
    between(tree)
    scene = export()
    assert scene.background == scene.lights[0].radiance == (0.25, 0.5, 1.0)
    assert scene.backdrop is None and scene.issues == ()


def test_a_strength_of_constants_leaves_the_image_as_it_is(tree, second, export):
    second.sphere = np.full((4, 8, 3), 3.0, dtype=np.float32)
    math, texture = (tree.nodes.new(f"ShaderNode{x}") for x in ("Math", "TexEnvironment"))
    texture.image = bpy.data.images.new("Sphere", 8, 4, float_buffer=True)
    tree.links.new(texture.outputs[0], back(tree).inputs["Color"])
    tree.links.new(math.outputs[0], back(tree).inputs["Strength"])
    scene = export()
    assert scene.lights[0].radiance == (3.0, 3.0, 3.0) and scene.issues == ()
    assert scene.lights[0].pixels.shape == (4, 8, 3)
    assert [len(order["nodes"]) for order in second.orders] == [1]


def test_what_a_ray_sees_is_tabulated_by_itself(tree, second, export):
    between(tree)
    path = tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(path.outputs["Is Camera Ray"], back(tree).inputs["Strength"])
    export()
    fed = [order["nodes"][0]["inputs"]["Strength"] for order in second.orders]
    assert fed == [{"constant": [1.0]}, {"constant": [0.0]}]


def test_a_light_of_a_black_body(file, second, export):
    second.sphere = np.full((4, 8, 3), (3.0, 2.0, 1.0), dtype=np.float32)
    lamp = things.light("POINT", energy=4.0 * np.pi, shadow_soft_size=0.0)
    lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    node = next(n for n in tree.nodes if n.type == "EMISSION")
    tree.links.new(tree.nodes.new("ShaderNodeBlackbody").outputs[0], node.inputs["Color"])
    scene = export()
    assert scene.lights[0].intensity == pytest.approx((3.0, 2.0, 1.0)) and scene.issues == ()
    (order,) = second.orders
    assert order["least"] == order["most"] == 2


def checker(tree):
    between(tree).inputs["Gamma"].default_value = 2.0


def ramp(tree):
    node = between(tree, "ShaderNodeValToRGB", "ShaderNodeTexGradient")
    node.color_ramp.elements.new(0.4).color = (0.9, 0.2, 0.1, 1.0)
    place = tree.nodes.new("ShaderNodeTexCoord")
    place.object = things.link(bpy.data.objects.new("Empty", None))
    place.object.location, place.object.rotation_euler = (0.2, 0.3, 0.1), (0.3, 0.2, 2.5)
    gradient = tree.nodes["Gradient Texture"]
    tree.links.new(place.outputs["Object"], gradient.inputs["Vector"])


def image(tree):
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.texture_mapping.rotation = (0.3, 0.4, 0.5)
    made = texture.image = bpy.data.images.new("Sphere", 64, 32, float_buffer=True)
    angle = np.linspace(0.0, 2.0 * np.pi, 64)
    pixels = np.ones((32, 64, 4), dtype=np.float32)
    pixels[..., 0], pixels[..., 1] = 0.5 + 0.4 * np.cos(angle), 0.5 + 0.4 * np.sin(angle)
    made.pixels.foreach_set(pixels.ravel())
    curves = tree.nodes.new("ShaderNodeRGBCurve")
    curves.mapping.curves[0].points.new(0.3, 0.6)
    tree.links.new(texture.outputs[0], curves.inputs["Color"])
    tree.links.new(curves.outputs[0], back(tree).inputs["Color"])


def black_body(tree):
    node = tree.nodes.new("ShaderNodeBlackbody")
    node.inputs[0].default_value = 3200.0
    tree.links.new(node.outputs[0], back(tree).inputs["Color"])


@pytest.mark.slow
@pytest.mark.parametrize("build", [checker, ramp, image, black_body])
def test_a_world_is_seen_as_cycles_shows_it(tree, export, tmp_path, build):
    build(tree)
    scene = bpy.context.scene
    scene.camera.data.angle, scene.camera.rotation_euler = 1.6, (1.2, 0.2, 0.7)
    found = export()
    driver = importlib.import_module(f"{PACKAGE}.adaptive_drt.render")
    film = driver.render_image(found)
    truth = render_cycles(tmp_path, samples=256)
    # a table of 0.18 degrees a row blurs what is sharp
    bound = 0.05 if build is checker else 0.005
    shown = np.moveaxis(np.asarray(film.color).reshape(3, *truth.shape[:2]), 0, -1)
    assert np.sqrt(((shown - truth) ** 2).mean()) < bound * truth.mean()
