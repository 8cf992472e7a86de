# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes that a compositing tree uses and this engine does not make are listed."""

from __future__ import annotations

import bpy
import pytest


def _tree(scene):
    if bpy.app.version < (5, 0, 0):
        scene.use_nodes = True
        scene.node_tree.nodes.clear()
        return scene.node_tree
    scene.compositing_node_group = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
    return scene.compositing_node_group


@pytest.fixture
def scene(file):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"  # it offers the sockets
    scene.render.compositor_device = "CPU"
    bpy.context.view_layer.use_pass_mist = bpy.context.view_layer.use_pass_z = True
    return scene


def _used(tree, *sockets):
    """A Render Layers node of which these sockets are used."""
    node = tree.nodes.new("CompositorNodeRLayers")
    for socket in sockets:
        viewer = tree.nodes.new("CompositorNodeViewer")
        tree.links.new(node.outputs[socket], viewer.inputs[0])
    return node


def _told(rendered):
    (found,) = rendered()
    issues = [issue for issue in found.issues if "compositor" in issue.reason]
    assert all(i.kind == "VIEW_LAYER" and i.target and not i.missing for i in issues)
    return [issue.reason for issue in issues]


def test_a_pass_that_is_not_made_is_named(scene, rendered):
    _used(_tree(scene), "Image", "Alpha", "Depth", "Mist")
    (reason,) = _told(rendered)
    assert "its Mist pass" in reason


def test_what_nothing_uses_is_not_named(scene, rendered):
    tree = _tree(scene)
    _used(tree, "Image")
    for link in _used(tree, "Mist").outputs["Mist"].links:
        link.is_muted = True
    _used(tree, "Mist").mute = True
    assert _told(rendered) == []


def test_no_compositing_no_pass_is_missed(scene, rendered):
    _used(_tree(scene), "Mist")
    assert len(_told(rendered)) == 1
    scene.render.use_compositing = False
    assert _told(rendered) == []


def test_cryptomattes_are_named(scene, rendered):
    tree = _tree(scene)
    bpy.context.view_layer.use_pass_cryptomatte_object = True
    node = tree.nodes.new("CompositorNodeCryptomatteV2")
    assert _told(rendered) == []
    tree.links.new(node.outputs["Matte"], tree.nodes.new("CompositorNodeViewer").inputs[0])
    (reason,) = _told(rendered)
    assert "Cryptomatte" in reason


def test_nodes_in_groups_are_found(scene, rendered):
    outer, group = _tree(scene), bpy.data.node_groups.new("Inside", "CompositorNodeTree")
    deeper = bpy.data.node_groups.new("Deeper", "CompositorNodeTree")
    for tree, inside in ((outer, group), (group, deeper)):
        tree.nodes.new("CompositorNodeGroup").node_tree = inside
    if bpy.app.version < (5, 0, 0):  # groups hold no such nodes there
        with pytest.raises(RuntimeError, match="Cannot add node"):
            _used(deeper, "Mist")
        return
    _used(outer, "Image")  # without such a node in the tree itself Blender 5.0 renders nothing
    _used(deeper, "Mist")
    assert len(_told(rendered)) == 1


def test_layers_of_other_scenes_are_named_where_this_engine_renders_them(scene, rendered):
    other = bpy.data.scenes.new("Other")
    other.view_layers[0].use_pass_mist = True
    tree = _tree(scene)
    _used(tree, "Image")
    node = _used(tree, "Mist")
    node.scene = other
    other.render.engine = "ADAPTIVE_DRT"
    camera = bpy.data.objects.new("Other Camera", scene.camera.data)
    other.collection.objects.link(camera)
    other.camera = camera
    other.render.resolution_x = other.render.resolution_y = 8
    told = [i.reason for found in rendered() for i in found.issues if "compositor" in i.reason]
    assert len(told) == 1 and "Mist" in told[0]
