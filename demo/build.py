# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the demo's .blend: spheres on a plane under a quad light, one of them moving.

Run with Python and the bpy module, or in Blender:

    python demo/build.py [OUT.blend]
    blender -b --factory-startup -P demo/build.py -- [OUT.blend]
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import bpy

OUT = Path(__file__).resolve().parent / "out" / "demo.blend"

FRAME = 11
"""The moving sphere passes the middle of the picture here."""

SPHERES = (
    ("Red", (-2.6, 0.4, 0.9), 0.9, (0.75, 0.12, 0.10)),
    ("Green", (2.7, 0.6, 1.0), 1.0, (0.12, 0.55, 0.18)),
    ("Blue", (-0.9, 2.6, 1.2), 1.2, (0.10, 0.22, 0.75)),
    ("White", (1.5, -1.7, 0.45), 0.45, (0.85, 0.85, 0.82)),
    ("Small", (-1.5, -1.5, 0.25), 0.25, (0.80, 0.55, 0.10)),
)
MOVER = ("Moving", (0.0, 0.0, 0.75), 0.75, (0.85, 0.70, 0.15))


def build_demo() -> None:
    """Fill an empty file with the demo."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    _plane("Floor", 16.0, (0.62, 0.60, 0.58))
    for name, center, radius, color in SPHERES:
        _sphere(name, center, radius, color, icosphere=name == "White")
    _move_right(_sphere(*MOVER), across=4.0)
    _area_light("Quad Light", (-2.5, -1.5, 6.0), (2.0, 1.4), 300.0)
    _point_light("Soft Point", (4.5, -3.0, 3.5), 0.35, 260.0, (1.0, 0.78, 0.55))
    _camera(scene)
    _world(scene, (0.02, 0.03, 0.05))
    scene.render.resolution_x, scene.render.resolution_y = 600, 400
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = 0.5
    scene.frame_set(FRAME)


def _link(thing: Any) -> Any:
    bpy.context.scene.collection.objects.link(thing)
    return thing


def _material(name: str, color: tuple[float, float, float]) -> Any:
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    material.diffuse_color = (*color, 1.0)
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.location.x = -300.0
    shader.inputs["Color"].default_value = (*color, 1.0)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def _mesh_object(name: str, work: Any, color: tuple[float, float, float]) -> Any:
    mesh = bpy.data.meshes.new(name)
    work.to_mesh(mesh)
    work.free()
    mesh.materials.append(_material(name, color))
    return _link(bpy.data.objects.new(name, mesh))


def _plane(name: str, size: float, color: tuple[float, float, float]) -> Any:
    import bmesh  # the bpy module has to be there first

    work = bmesh.new()
    bmesh.ops.create_grid(work, x_segments=1, y_segments=1, size=size / 2.0)
    return _mesh_object(name, work, color)


def _sphere(
    name: str,
    center: tuple[float, float, float],
    radius: float,
    color: tuple[float, float, float],
    icosphere: bool = False,
) -> Any:
    import bmesh

    work = bmesh.new()
    if icosphere:
        bmesh.ops.create_icosphere(work, subdivisions=4, radius=radius)
    else:
        bmesh.ops.create_uvsphere(work, u_segments=48, v_segments=24, radius=radius)
    thing = _mesh_object(name, work, color)
    thing.data.shade_smooth()
    thing.location = center
    return thing


def _move_right(thing: Any, across: float) -> None:
    """Key a move along x at constant speed, `across` metres in 10 frames around `FRAME`."""
    # new keys are straight lines for a moment, which needs no look into F-curves
    edit = bpy.context.preferences.edit
    kept = edit.keyframe_new_interpolation_type
    edit.keyframe_new_interpolation_type = "LINEAR"
    middle = thing.location.x
    for frame, offset in ((FRAME - 5, -across / 2.0), (FRAME + 5, across / 2.0)):
        thing.location.x = middle + offset
        thing.keyframe_insert("location", frame=frame)
    edit.keyframe_new_interpolation_type = kept


def _area_light(
    name: str, location: tuple[float, float, float], size: tuple[float, float], watts: float
) -> None:
    light = bpy.data.lights.new(name, "AREA")
    light.shape, light.energy = "RECTANGLE", watts
    light.size, light.size_y = size
    thing = _link(bpy.data.objects.new(name, light))
    thing.location = location
    thing.rotation_euler = (math.radians(14.0), math.radians(-22.0), 0.0)


def _point_light(
    name: str,
    location: tuple[float, float, float],
    radius: float,
    watts: float,
    color: tuple[float, float, float],
) -> None:
    light = bpy.data.lights.new(name, "POINT")
    light.energy, light.shadow_soft_size, light.color = watts, radius, color
    _link(bpy.data.objects.new(name, light)).location = location


def _camera(scene: Any) -> None:
    camera = bpy.data.cameras.new("Camera")
    camera.lens = 40.0
    thing = _link(bpy.data.objects.new("Camera", camera))
    thing.location = (0.0, -9.5, 5.2)
    thing.rotation_euler = (math.radians(63.0), 0.0, 0.0)
    scene.camera = thing


def _world(scene: Any, color: tuple[float, float, float]) -> None:
    """A world that the camera sees and that lights nothing: all shadows are those of the lamps."""
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    tree = world.node_tree
    seen = next(n for n in tree.nodes if n.type == "BACKGROUND")
    seen.inputs["Color"].default_value = (*color, 1.0)
    dark, path, mix = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("Background", "LightPath", "MixShader")
    )
    dark.inputs["Strength"].default_value = 0.0
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(dark.outputs[0], mix.inputs[1])
    tree.links.new(seen.outputs[0], mix.inputs[2])
    output = next(n for n in tree.nodes if n.type == "OUTPUT_WORLD")
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    scene.world = world


def main(arguments: list[str]) -> None:
    if len(arguments) > 1:
        raise SystemExit("usage: build.py [OUT.blend]")
    path = Path(*arguments).resolve() if arguments else OUT
    path.parent.mkdir(parents=True, exist_ok=True)
    build_demo()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)


if __name__ == "__main__":
    own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    main(own)
