# SPDX-License-Identifier: GPL-3.0-or-later
"""Lays the mask over the picture in the compositor.

The nodes are added beside the user's own, which stay as they are. Blender 5.0 renamed most of
them, and keeps the tree in a node group of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from .engine import ENGINE
from .images import MASK, RESULT, find_image
from .show_nodes import show_selected_nodes
from .state import issues_key, state

FRAME = "Adaptive Mask"
"""Label of the frame that holds our nodes, by which they are found again."""

STRENGTH = 0.6
"""How much of a flagged pixel is the mask's colour."""


@dataclass(frozen=True)
class _Source:
    """Output sockets of the picture and of the mask."""

    picture: Any
    mask: Any


def compositor_tree(scene: Any) -> Any:
    """Return the scene's compositing tree, made and led to the output if there was none."""
    if not hasattr(scene, "compositing_node_group"):
        if not scene.use_nodes:
            scene.use_nodes = True
        return scene.node_tree
    if scene.compositing_node_group is None:
        tree = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        tree.interface.new_socket(name="Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        layers, out = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("NodeGroupOutput")
        out.location.x = 900.0
        tree.links.new(layers.outputs["Image"], out.inputs[0])
        scene.compositing_node_group = tree
    return scene.compositing_node_group


def add_overlay(scene: Any, to_output: bool = False) -> Any:
    """Add the nodes that lay the mask over the picture and return the frame around them.

    Nodes of an earlier call are replaced.

    Parameters
    ----------
    to_output : whether the overlay also becomes the picture that is composed and written.

    Raises
    ------
    LookupError
        There is nothing to show: another engine renders, and the button has not yet.
    """
    tree = compositor_tree(scene)
    remove_overlay(tree)
    for node in tree.nodes:  # what is new is selected, as in Blender, and nothing else
        node.select = False
    frame = tree.nodes.new("NodeFrame")
    frame.label = frame.name = FRAME
    try:
        source = _source(tree, scene, to_output)
    except LookupError:
        tree.nodes.remove(frame)
        raise
    overlay = _overlay(tree, source)
    viewer = _placed(tree, "CompositorNodeViewer", 4)
    tree.links.new(overlay, viewer.inputs[0])
    tree.nodes.active = viewer
    if to_output:
        tree.links.new(overlay, _output(tree).inputs[0])
    for node in tree.nodes:
        if node.get(FRAME):
            node.parent = frame
    return frame


def remove_overlay(tree: Any) -> None:
    """Take our nodes away."""
    for node in list(tree.nodes):
        if node.get(FRAME) or (node.type == "FRAME" and node.label == FRAME):
            tree.nodes.remove(node)


def _source(tree: Any, scene: Any, to_output: bool) -> _Source:
    if scene.render.engine == ENGINE and (to_output or not _button_was_last(scene)):
        layers = _placed(tree, "CompositorNodeRLayers", 0)
        layers.scene = scene
        return _Source(layers.outputs["Image"], layers.outputs[FRAME])
    found = []
    for row, name in enumerate((RESULT, MASK)):
        image = find_image(name)
        if image is None:
            raise LookupError("Nothing is rendered yet: press Adaptive Render first")
        node = _placed(tree, "CompositorNodeImage", 0, row)
        node.image = image
        found.append(node.outputs["Image"])
    return _Source(*found)


def _button_was_last(scene: Any) -> bool:
    """Whether the newest picture is in our images, and not in Blender's Render Result."""
    return state.newest.get(issues_key(scene)) == RESULT


def _overlay(tree: Any, source: _Source) -> Any:
    """Return the socket of the grey picture under the mask's colours."""
    grey = _placed(tree, "CompositorNodeRGBToBW", 1)
    tree.links.new(source.picture, grey.inputs[0])
    split = _placed(tree, "CompositorNodeSeparateColor", 1, 1)
    split.mode = "HSV"
    tree.links.new(source.mask, split.inputs[0])
    scaled = _placed(tree, "CompositorNodeMath", 2, 1, "ShaderNodeMath")
    scaled.operation = "MULTIPLY"
    scaled.inputs[1].default_value = STRENGTH
    # the value of a colour is its largest channel: 1 where any effect is flagged
    tree.links.new(split.outputs[2], scaled.inputs[0])
    mix = _placed(tree, "CompositorNodeMixRGB", 3, 0, "ShaderNodeMix")
    if mix.bl_idname == "ShaderNodeMix":
        mix.data_type = "RGBA"
    # a mix has inputs for every type of data; those of its own type alone are enabled
    factor, below, above = (socket for socket in mix.inputs if socket.enabled)
    tree.links.new(scaled.outputs[0], factor)
    tree.links.new(grey.outputs[0], below)
    tree.links.new(source.mask, above)
    return next(socket for socket in mix.outputs if socket.enabled)


def _placed(tree: Any, kind: str, column: int, row: int = 0, newer: str = "") -> Any:
    """Return a new node of ours; `newer` is what Blender 5 calls its kind."""
    node = tree.nodes.new(newer if newer and bpy.app.version >= (5, 0) else kind)
    node[FRAME] = True
    # the first column's nodes are the wide ones
    node.location = (220.0 * column + (120.0 if column else 0.0), -600.0 - 260.0 * row)
    return node


def _output(tree: Any) -> Any:
    wanted = "NodeGroupOutput" if bpy.app.version >= (5, 0) else "CompositorNodeComposite"
    found = next((n for n in tree.nodes if n.bl_idname == wanted), None)
    return found or tree.nodes.new(wanted)


class ADRT_OT_show_mask(bpy.types.Operator):
    """Lay the adaptive mask over the picture with compositing nodes, on a Viewer"""

    bl_idname = "adaptive_drt.show_mask"
    bl_label = "Show Mask in Compositor"
    bl_options = {"REGISTER", "UNDO"}

    to_output: bpy.props.BoolProperty(
        name="To Output",
        description="Make the overlay the picture that is composed and written, too",
        default=False,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.scene is not None

    def execute(self, context: Any) -> set[str]:
        try:
            add_overlay(context.scene, self.to_output)
        except LookupError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not bpy.app.background:
            # a window must not change inside an operator that a panel calls
            bpy.app.timers.register(show_selected_nodes, first_interval=0.0)
        return {"FINISHED"}
