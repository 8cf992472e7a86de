# SPDX-License-Identifier: GPL-3.0-or-later
"""What a view layer asks: its overrides are heeded, what is not is told."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import things

RED, BLUE = (0.9, 0.1, 0.05, 1.0), (0.1, 0.2, 0.8, 1.0)


def _world(name, color):
    world = bpy.data.worlds.new(name)
    world.use_nodes = True
    world.node_tree.nodes.clear()
    output = world.node_tree.nodes.new("ShaderNodeOutputWorld")
    background = world.node_tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = color
    world.node_tree.links.new(background.outputs[0], output.inputs["Surface"])
    return world


def test_material_override(export):
    things.uv_sphere("Bare")
    dressed = things.plane("Dressed")
    dressed.data.materials.append(things.material("Blue", Base_Color=BLUE))
    layer = bpy.context.view_layer
    layer.material_override = things.material("Red", "ShaderNodeBsdfDiffuse", Color=RED)
    colors = [shape.material.color for shape in export().shapes]
    assert colors == [pytest.approx(RED[:3])] * 2
    layer.material_override = None
    colors = {shape.name: shape.material.color for shape in export().shapes}
    assert colors["Dressed"] == pytest.approx(BLUE[:3])
    assert colors["Bare"] == pytest.approx((0.8, 0.8, 0.8))


def test_world_override(export):
    bpy.context.scene.world = _world("Red", RED)
    assert export().background == pytest.approx(RED[:3])
    bpy.context.view_layer.world_override = _world("Blue", BLUE)
    assert export().background == pytest.approx(BLUE[:3])


@pytest.mark.parametrize("switch, said", [("holdout", "Holdout"), ("indirect_only", "Indirect")])
def test_switches_of_collections_are_told(export, switch, said):
    collection = bpy.data.collections.new("Things")
    bpy.context.scene.collection.children.link(collection)
    layer = bpy.context.view_layer.layer_collection.children["Things"]
    setattr(layer, switch, True)
    bpy.context.view_layer.update()
    assert export().issues == ()  # there is nothing in it
    things.uv_sphere("Ball", collection=collection)
    scene = export()
    (reason,) = things.reasons(scene)['Collection "Things"']
    assert said in reason and "exclude it" in reason and len(scene.shapes) == 1
    layer.exclude = True
    bpy.context.view_layer.update()
    assert export().issues == ()


def test_cycles_overrides_alike(export, tmp_path):
    """The same surface in both, with an override of the world and of the material."""
    from peer import render_cycles

    things.plane("Floor", size=40.0).data.materials.append(things.material("Blue"))
    lamp = things.light("AREA", energy=3000.0, size=4.0)
    lamp.location.z = 8.0
    layer = bpy.context.view_layer
    layer.material_override = things.material("Red", "ShaderNodeBsdfDiffuse", Color=RED)
    scene = export()
    picture = render_cycles(tmp_path, samples=64)
    ratio = picture.mean(axis=(0, 1))
    color = scene.shapes[0].material.color
    np.testing.assert_allclose(ratio / ratio[0], np.array(color) / color[0], rtol=1e-3)
