# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a core scene with Cycles: the same lights, materials, camera and pixels, direct light.

Spheres become point clouds, which Cycles traces as true spheres. Cycles does not move lights
within the shutter, so scenes given here keep theirs still.
"""

import math
import tempfile
from pathlib import Path

import numpy as np

from adaptive_drt.scene.description import DiskLight, PointLight, Quad, QuadLight

__all__ = ["render_cycles"]

FRAME = 1
"""The frame rendered; things are keyed at the frames before and after it."""


def render_cycles(scene, samples=1024, seed=0):
    """Picture (3, height, width) of a scene by Cycles, scene-linear, row 0 at the bottom."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    target = bpy.context.scene
    for shape in scene.shapes:
        _move(_add_shape(bpy, shape), shape)
    for light in scene.lights:
        if light.motion is not None:
            raise ValueError("Cycles does not move lights within the shutter")
        _add_light(bpy, light)
    _move(_add_camera(bpy, scene.camera), scene.camera)
    _set_up(target, scene, samples, seed)
    with tempfile.TemporaryDirectory() as folder:
        target.render.filepath = str(Path(folder) / "picture.exr")
        bpy.ops.render.render(write_still=True)
        return _read(target.render.filepath)


def _link(bpy, name, data):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def _move(thing, record):
    """Key the object so that it covers its displacement in one frame, centred on FRAME."""
    if record.motion is None:
        return
    middle = np.array(thing.location)
    for frame, side in ((FRAME - 1, -1.0), (FRAME + 1, 1.0)):
        thing.location = middle + side * np.array(record.motion.displacement)
        thing.keyframe_insert("location", frame=frame)
    for curve in thing.animation_data.action.fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"


def _add_shape(bpy, shape):
    mesh = bpy.data.meshes.new(shape.name)
    if isinstance(shape, Quad):
        u, v = np.array(shape.edge_u), np.array(shape.edge_v)
        mesh.from_pydata([(0.0, 0.0, 0.0), u, u + v, v], [], [(0, 1, 2, 3)])
        thing = _link(bpy, shape.name, mesh)
        thing.location = shape.corner
    else:
        mesh.from_pydata([(0.0, 0.0, 0.0)], [], [])
        thing = _link(bpy, shape.name, mesh)
        bpy.context.view_layer.objects.active = thing
        thing.select_set(True)
        bpy.ops.object.convert(target="POINTCLOUD")
        thing = bpy.context.view_layer.objects.active
        thing.select_set(False)
        cloud = thing.data
        radius = cloud.attributes.get("radius") or cloud.attributes.new("radius", "FLOAT", "POINT")
        radius.data.foreach_set("value", np.array([shape.radius], dtype=np.float32))
        thing.location = shape.center
    thing.data.materials.clear()
    thing.data.materials.append(_diffuse(bpy, shape.material.color))
    return thing


def _diffuse(bpy, color):
    material = bpy.data.materials.new("Diffuse")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    out, surface = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeBsdfDiffuse")
    surface.inputs["Color"].default_value = (*color, 1.0)
    material.node_tree.links.new(surface.outputs[0], out.inputs["Surface"])
    return material


def _add_light(bpy, light):
    """Watts from radiance: the formulas of Cycles, P = pi A L and P = 4 pi^2 r^2 L."""
    data = bpy.data.lights.new(light.name, "AREA" if isinstance(light, QuadLight) else "POINT")
    thing = _link(bpy, light.name, data)
    data.use_shadow = light.casts_shadow
    if isinstance(light, QuadLight):
        u, v = np.array(light.half_u), np.array(light.half_v)
        if abs(u @ v) > 1e-9 * np.linalg.norm(u) * np.linalg.norm(v):
            raise ValueError("Cycles' area lights are rectangles")
        data.shape = "RECTANGLE"
        data.size, data.size_y = 2.0 * np.linalg.norm(u), 2.0 * np.linalg.norm(v)
        x, y = u / np.linalg.norm(u), -v / np.linalg.norm(v)
        _place(thing, np.stack([x, y, np.cross(x, y)], axis=1), light.center)
        watts = np.array(light.radiance) * math.pi * 4.0 * np.linalg.norm(np.cross(u, v))
    else:
        thing.location = light.center
        data.shadow_soft_size = getattr(light, "radius", 0.0)
        data.use_soft_falloff = isinstance(light, DiskLight)
        if isinstance(light, PointLight):
            watts = 4.0 * math.pi * np.array(light.intensity)
        else:
            watts = 4.0 * math.pi**2 * light.radius**2 * np.array(light.radiance)
    data.energy = watts.max()
    data.color = watts / watts.max()


def _place(thing, axes, location):
    import mathutils

    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, location
    thing.matrix_world = mathutils.Matrix(matrix.tolist())


def _add_camera(bpy, camera):
    data = bpy.data.cameras.new("Camera")
    thing = _link(bpy, "Camera", data)
    matrix = np.array(camera.matrix)
    _place(thing, matrix[:3, :3], matrix[:3, 3])
    data.lens = camera.focal_length
    data.sensor_width, data.sensor_height = camera.sensor_width, camera.sensor_height
    data.sensor_fit = camera.sensor_fit
    data.shift_x, data.shift_y = camera.shift_x, camera.shift_y
    data.clip_start, data.clip_end = 1e-3, 1e4
    bpy.context.scene.camera = thing
    return thing


def _set_up(target, scene, samples, seed):
    """Direct light through a box filter, nothing adaptive, clamped or denoised."""
    render, cycles, camera = target.render, target.cycles, scene.camera
    target.frame_set(FRAME)
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = camera.resolution
    render.resolution_percentage = 100
    render.pixel_aspect_x, render.pixel_aspect_y = camera.pixel_aspect
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "ZIP"
    render.use_motion_blur = any(x.motion for x in (camera, *scene.shapes))
    render.motion_blur_shutter, render.motion_blur_position = 1.0, "CENTER"
    cycles.device, cycles.samples, cycles.seed = "CPU", samples, seed
    cycles.max_bounces = 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.light_sampling_threshold = 0.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0


def _read(path):
    import OpenEXR

    with OpenEXR.File(path) as file:
        channels = file.channels()
        pixels = channels["RGBA"].pixels if "RGBA" in channels else channels["RGB"].pixels
        return np.moveaxis(np.array(pixels[::-1, :, :3], dtype=float), -1, 0)
