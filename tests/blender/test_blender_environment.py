# SPDX-License-Identifier: GPL-3.0-or-later
"""Environment and Sky Texture nodes of worlds: what becomes of them, and what is left out."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
import things

from sphere_images import radiance_of, unit


@pytest.fixture
def world(file, addon):
    made = bpy.context.scene.world = bpy.data.worlds.new("World")
    made.use_nodes = True
    return made


@pytest.fixture
def export(addon):
    import importlib

    module = importlib.import_module(f"{addon.__name__}.operators.export.scene")
    return lambda: module.export_scene(bpy.context.evaluated_depsgraph_get())


def image(rows=4, columns=8, float_buffer=True):
    made = bpy.data.images.new("Sphere", columns, rows, float_buffer=float_buffer)
    pixels = np.random.default_rng(1).random((rows, columns, 4)).astype(np.float32)
    pixels[..., 3] = 1.0
    made.pixels.foreach_set(pixels.ravel())
    return made, pixels[::-1, :, :3]


def feed(world, kind, strength=1.0, **settings):
    tree = world.node_tree
    node = tree.nodes.new(kind)
    for name, value in settings.items():
        setattr(node, name, value)
    back = next(n for n in tree.nodes if n.type == "BACKGROUND")
    back.inputs["Strength"].default_value = strength
    tree.links.new(node.outputs[0], back.inputs["Color"])
    return node


def test_an_image_is_light_and_backdrop(world, export):
    made, pixels = image()
    feed(world, "ShaderNodeTexEnvironment", 2.0, image=made)
    scene = export()
    (light,) = (x for x in scene.lights if type(x).__name__ == "EnvironmentLight")
    assert np.array_equal(light.pixels, pixels) and light.radiance == (2.0, 2.0, 2.0)
    assert scene.backdrop.pixels.shape == pixels.shape and scene.background == (0.0, 0.0, 0.0)
    assert not any("Environment" in reason for r in things.reasons(scene).values() for reason in r)


def test_bytes_are_made_linear(world, export):
    made, _ = image(float_buffer=False)
    feed(world, "ShaderNodeTexEnvironment", image=made)
    kept = np.empty(len(made.pixels), dtype=np.float32)
    made.pixels.foreach_get(kept)
    encoded = kept.reshape(4, 8, 4)[::-1, :, :3]
    want = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    assert export().backdrop.pixels == pytest.approx(want, rel=1e-5)


def test_a_turn_is_the_one_of_the_node(world, export):
    made, _ = image(16, 32)
    texture = feed(world, "ShaderNodeTexEnvironment", image=made)
    tree = world.node_tree
    place, where = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    place.inputs["Rotation"].default_value = (0.0, 0.0, math.pi / 2.0)
    tree.links.new(where.outputs["Generated"], place.inputs["Vector"])
    tree.links.new(place.outputs[0], texture.inputs["Vector"])
    turned = export().backdrop
    place.inputs["Rotation"].default_value = (0.0, 0.0, 0.0)
    plain = export().backdrop
    way = unit(np.random.default_rng(2), 100)
    x, y, z = way
    assert radiance_of(turned, way) == pytest.approx(
        radiance_of(plain, np.array([-y, x, z])), abs=1e-5
    )


@pytest.mark.parametrize(
    "change, said",
    [
        (lambda node: setattr(node, "image", None), "has no image"),
        (lambda node: setattr(node.image, "source", "SEQUENCE"), "shows a sequence"),
        (
            lambda node: node.id_data.links.new(
                node.id_data.nodes.new("ShaderNodeCameraData").outputs[0], node.inputs["Vector"]
            ),
            "a Vector that is not understood",
        ),
    ],
)
def test_what_is_left_out_is_told(world, export, change, said):
    node = feed(world, "ShaderNodeTexEnvironment", image=image()[0])
    change(node)
    told = [reason for reasons in things.reasons(export()).values() for reason in reasons]
    assert any(said in reason for reason in told), told


def test_a_sky_by_preetham(world, export):
    feed(world, "ShaderNodeTexSky", sky_type="PREETHAM", turbidity=3.0)
    scene = export()
    assert scene.backdrop.pixels.shape == (256, 512, 3) and scene.backdrop.pixels.min() >= 0.0


def test_a_second_blender_that_does_not_start_is_told(world, export, monkeypatch):
    import subprocess

    def fails(*_, **__):
        raise OSError

    monkeypatch.setattr(subprocess, "run", fails)
    feed(world, "ShaderNodeTexSky", sky_type="HOSEK_WILKIE", turbidity=4.5)
    told = [reason for reasons in things.reasons(export()).values() for reason in reasons]
    assert any("second Blender" in reason for reason in told)
