# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the shader nodes of a world in a Blender of its own. `baked` starts it as a script.

The last argument names a JSON file, the order. It holds the nodes as `node_graph` describes them,
and the folder of the results: `sphere.npy`, the radiance in all directions, `error.npy`, the error
of the irradiance by that, and `sun_N.npy`, the radiance of the disks of suns. Cycles renders each
pixel by one ray.
"""

from __future__ import annotations

import json
import math
import os
import sys
from typing import Any

import bpy
import mathutils
import numpy as np

SETTLED = 3e-4
"""Relative error of the irradiance up to which an image of the sphere is fine enough."""
SHARP = 3e-3
"""Error of the radiance between the pixels of such an image, RMS and relative to the mean, up to
which it is fine enough to be seen."""

PASSES = {
    "VALUE": ("ShaderNodeMath", "operation", "ADD"),
    "RGBA": ("ShaderNodeGamma", None, None),
    "VECTOR": ("ShaderNodeVectorMath", "operation", "ADD"),
}
"""Nodes that pass on what they get as a number, a colour or a vector: with zeros added, and a gamma
of 1."""


def main(order: dict[str, Any]) -> None:
    """Render what is ordered."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    c = scene.cycles
    c.device, c.samples, c.use_denoising, c.use_adaptive_sampling = "CPU", 1, False, False
    c.sample_clamp_direct, c.sample_clamp_indirect = 0.0, 0.0
    # the ray through the middle of each pixel
    c.pixel_filter_type, c.filter_width = "BOX", 0.01
    output = scene.render.image_settings
    if hasattr(output, "media_type"):
        output.media_type = "IMAGE"
    output.file_format, output.color_depth = "OPEN_EXR", "32"
    nodes = build_world(order)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    suns = [nodes[sun["node"]] for sun in order["suns"]]
    for sky in suns:
        sky.sun_disc = False
    radiance, error = sphere(order, camera)
    np.save(order["folder"] + "/sphere.npy", radiance)
    np.save(order["folder"] + "/error.npy", np.array(error))
    for index, (sky, sun) in enumerate(zip(suns, order["suns"], strict=True)):
        np.save(f"{order['folder']}/sun_{index}.npy", disk(order, camera, sky, sun))


def sphere(order: dict[str, Any], camera: Any) -> tuple[Any, float]:
    """Return the radiance in all directions, and an error of the irradiance by that.

    The radiance is (2 rows, 4 rows, 3) from the top down, for an image of so many rows.
    """
    camera.data.type = "PANO"
    owner = camera.data if hasattr(camera.data, "panorama_type") else camera.data.cycles
    owner.panorama_type = "EQUIRECTANGULAR"
    camera.rotation_euler = (math.pi / 2.0, 0.0, -math.pi / 2.0)
    rows = order["least"]
    while True:
        fine = shot(order, 4 * rows, 2 * rows)
        error, irradiance = quadrature_error(fine)
        # images are shown as fine as they are
        is_sharp = 0 < order["shown"] <= rows or blur(fine) <= SHARP * irradiance / np.pi
        if 2 * rows > order["most"] or (is_sharp and error <= SETTLED * irradiance):
            return fine, error
        rows *= 2


def blur(fine: Any) -> float:
    """Return by how much means of 2 x 2 pixels, and what lies between these, miss an image: RMS."""
    rows, columns, _ = fine.shape
    mean = fine.reshape(rows // 2, 2, columns // 2, 2, 3).mean(axis=(1, 3))
    upper, lower = np.concatenate([mean[:1], mean[:-1]]), np.concatenate([mean[1:], mean[-1:]])
    square = np.zeros(3)
    for row, near in enumerate((upper, lower)):
        line = 0.75 * mean + 0.25 * near
        for column, turn in enumerate((1, -1)):
            off = 0.75 * line + 0.25 * np.roll(line, turn, axis=1) - fine[row::2, column::2]
            square += (off * off).mean(axis=(0, 1))
    return float(np.sqrt(square.max() / 4.0))


def quadrature_error(fine: Any) -> tuple[float, float]:
    """Return an error of the irradiance by an image, and the mean irradiance.

    The error is half of the most by which the sums of every second row and column differ, for
    surfaces that face along the axes; of the channels it is the largest.
    """
    if not np.ptp(fine, axis=(0, 1)).any():
        return 0.0, float(np.pi * np.abs(fine[0, 0]).max())
    rows, columns, _ = fine.shape
    theta = (np.arange(rows) + 0.5) * np.pi / rows
    psi = np.pi - (np.arange(columns) + 0.5) * (2.0 * np.pi / columns)
    around = np.sin(theta)[:, None]
    ways = (around * np.cos(psi), around * np.sin(psi), np.cos(theta)[:, None] + 0.0 * psi)
    area = around * (np.pi / rows * 2.0 * np.pi / columns)
    sums = []
    for part in ((slice(i, None, 2), slice(j, None, 2)) for i in (0, 1) for j in (0, 1)):
        weighted = 4.0 * fine[part] * area[part[0], :, None]
        for way in ways:
            for sign in (1.0, -1.0):
                share = np.maximum(sign * way[part], 0.0)
                sums.append((weighted * share[..., None]).sum(axis=(0, 1)))
    found = np.array(sums).reshape(4, 6, 3)
    worst = 0.5 * float(np.ptp(found, axis=0).max())
    return worst, float(found.mean(axis=(0, 1)).max())


def disk(order: dict[str, Any], camera: Any, sky: Any, sun: dict[str, Any]) -> Any:
    """Return what the sun of a sky adds to the radiance, in a square around its disk."""
    camera.data.type, camera.data.angle = "PERSP", sun["size"]
    way = mathutils.Vector(sun["toward"])
    camera.rotation_euler = way.to_track_quat("-Z", "Y").to_euler()
    side = order["pixels"]
    without = shot(order, side, side)
    sky.sun_disc = True
    found = shot(order, side, side) - without
    sky.sun_disc = False
    return found


def shot(order: dict[str, Any], width: int, height: int) -> Any:
    """Return a picture (height, width, 3), from the top down."""
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.filepath = order["folder"] + "/shot.exr"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    flat = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(flat)
    bpy.data.images.remove(image)
    return flat.reshape(height, width, 4)[::-1, :, :3]


def build_world(order: dict[str, Any]) -> list[Any]:
    """Make the world of the order, and return its nodes."""
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    if not world.node_tree:
        world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    images = [load_image(each) for each in order["images"]]
    nodes = []
    for entry in order["nodes"]:
        node = tree.nodes.new(entry["type"])
        assign(node, entry["settings"], images)
        for name, value in entry["outputs"].items():
            named(node.outputs, name).default_value = value
        nodes.append(node)
    for node, entry in zip(nodes, order["nodes"], strict=True):
        for name, fed in entry["inputs"].items():
            feed(tree, nodes, named(node.inputs, name), fed)
    output, emission = (tree.nodes.new(f"ShaderNode{x}") for x in ("OutputWorld", "Emission"))
    source = output_of(tree, nodes, order["surface"])
    if source.type != "SHADER":  # Cycles lets colours shine
        tree.links.new(source, emission.inputs["Color"])
        source = emission.outputs[0]
    tree.links.new(source, output.inputs["Surface"])
    return nodes


def named(sockets: Any, identifier: str) -> Any:
    """Return the socket of an identifier."""
    return next(socket for socket in sockets if socket.identifier == identifier)


def feed(tree: Any, nodes: list[Any], socket: Any, fed: dict[str, Any]) -> None:
    """Set what a socket gets: its own value, a constant, or another node's output."""
    if "value" in fed:
        socket.default_value = fed["value"]
    elif "constant" in fed:
        value = fed["constant"]
        single = len(value) == 1
        node = tree.nodes.new("ShaderNodeValue" if single else "ShaderNodeCombineXYZ")
        if single:
            node.outputs[0].default_value = value[0]
        for place, part in zip(node.inputs, value, strict=False):
            place.default_value = part
        tree.links.new(node.outputs[0], socket)
    else:
        tree.links.new(output_of(tree, nodes, fed), socket)


def output_of(tree: Any, nodes: list[Any], fed: dict[str, Any]) -> Any:
    """Return a node's output, after the conversions on the way from it."""
    index, identifier = fed["from"]
    socket = named(nodes[index].outputs, identifier)
    for kind in fed["passed"]:
        type_, setting, value = PASSES[kind]
        node = tree.nodes.new(type_)
        if setting is not None:
            setattr(node, setting, value)
        if kind != "RGBA":
            node.inputs[1].default_value = 0.0 if kind == "VALUE" else (0.0, 0.0, 0.0)
        tree.links.new(socket, node.inputs[0])
        socket = node.outputs[0]
    return socket


def assign(owner: Any, settings: dict[str, Any], images: list[Any]) -> None:
    """Set the properties of a node, or of a struct of one."""
    for name, value in settings.items():
        if not isinstance(value, dict):
            setattr(owner, name, value)
        elif "image" in value:
            setattr(owner, name, images[value["image"]])
        elif "matrix" in value:
            empty = bpy.data.objects.new("Empty", None)
            bpy.context.scene.collection.objects.link(empty)
            empty.matrix_world = mathutils.Matrix(value["matrix"])
            setattr(owner, name, empty)
        elif "elements" in value:
            set_ramp(getattr(owner, name), value)
        elif "curves" in value:
            set_curves(getattr(owner, name), value)
        else:
            assign(getattr(owner, name), value, images)


def set_ramp(ramp: Any, value: dict[str, Any]) -> None:
    """Set a colour ramp."""
    assign(ramp, value["settings"], [])
    while len(ramp.elements) > 1:
        ramp.elements.remove(ramp.elements[-1])
    for index, (position, color) in enumerate(value["elements"]):
        element = ramp.elements[0] if index == 0 else ramp.elements.new(position)
        element.position, element.color = position, color


def set_curves(mapping: Any, value: dict[str, Any]) -> None:
    """Set the curves of a node."""
    assign(mapping, value["settings"], [])
    for curve, points in zip(mapping.curves, value["curves"], strict=True):
        while len(curve.points) > 2:
            curve.points.remove(curve.points[-1])
        while len(curve.points) < len(points):
            curve.points.new(0.5, 0.5)
        for point, (place, handle) in zip(curve.points, points, strict=True):
            point.location, point.handle_type = place, handle
    mapping.update()


def load_image(entry: dict[str, Any]) -> Any:
    """Return an image of the order."""
    if entry["file"] is not None:
        image = bpy.data.images.load(entry["file"])
    else:
        pixels = np.load(entry["pixels"])
        image = bpy.data.images.new(
            "Image", *entry["size"], alpha=True, float_buffer=entry["settings"].pop("is_float")
        )
    entry["settings"].pop("is_float", None)
    space = entry["settings"].pop("colorspace")
    if image.colorspace_settings.name != space:
        image.colorspace_settings.name = space
    assign(image, entry["settings"], [])
    if entry["file"] is None:
        image.pixels.foreach_set(pixels)
        image.update()
    return image


if __name__ == "__main__":
    with open(sys.argv[-1], encoding="utf-8") as file:
        main(json.load(file))
    sys.stdout.flush()
    # Blender as a module may hang at its exit, and all is written
    os._exit(0)
