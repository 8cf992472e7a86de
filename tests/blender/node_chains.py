# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry nodes in a row, as modifiers."""

from __future__ import annotations

import bpy


def chain(thing, *kinds, keep=False, **inputs):
    """Let nodes of these kinds, one after the other, change an object's geometry.

    keep : join what comes out with the geometry that went in.
    inputs : values of the nodes' inputs by name; those that a node lacks are passed over.
    """
    tree = bpy.data.node_groups.new("Chain", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    entry = tree.nodes.new("NodeGroupInput").outputs[0]
    last = entry
    for kind in kinds:
        node = tree.nodes.new(kind)
        first = next((s for s in node.inputs if s.type == "GEOMETRY"), None)
        if first is not None:
            tree.links.new(last, first)
        last = next(s for s in node.outputs if s.type == "GEOMETRY")
        for key, value in inputs.items():
            socket = node.inputs.get(key.replace("_", " "))
            if socket is not None:
                socket.default_value = value
    if keep:
        join = tree.nodes.new("GeometryNodeJoinGeometry")
        tree.links.new(last, join.inputs[0])
        tree.links.new(entry, join.inputs[0])
        last = join.outputs[0]
    tree.links.new(last, tree.nodes.new("NodeGroupOutput").inputs[0])
    thing.modifiers.new("Chain", "NODES").node_group = tree
    return tree


def on_points(points, kind):
    """Let nodes put what a node of this kind makes on the points of an object."""
    tree = bpy.data.node_groups.new("On Points", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    entry = tree.nodes.new("NodeGroupInput")
    place = tree.nodes.new("GeometryNodeInstanceOnPoints")
    source = tree.nodes.new(kind)
    tree.links.new(entry.outputs[0], place.inputs["Points"])
    tree.links.new(source.outputs[0], place.inputs["Instance"])
    tree.links.new(place.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    points.modifiers.new("On Points", "NODES").node_group = tree
