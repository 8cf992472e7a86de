# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes objects for the tests, without operators and the selections they change."""

from __future__ import annotations

import math

import bmesh
import bpy
import numpy as np


def link(thing, collection=None):
    (collection or bpy.context.scene.collection).objects.link(thing)
    return thing


def mesh_object(name, vertices, faces, collection=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.update()
    return link(bpy.data.objects.new(name, mesh), collection)


def made(name, make, collection=None):
    """An object of a mesh that `make` builds in a bmesh."""
    mesh = bpy.data.meshes.new(name)
    work = bmesh.new()
    make(work)
    work.to_mesh(mesh)
    work.free()
    return link(bpy.data.objects.new(name, mesh), collection)


def uv_sphere(name="Sphere", radius=1.0, segments=32, rings=16, collection=None):
    ball = made(
        name,
        lambda b: bmesh.ops.create_uvsphere(
            b, u_segments=segments, v_segments=rings, radius=radius
        ),
        collection,
    )
    ball.data.shade_smooth()  # flat shading of so few faces is told
    return ball


def ico_sphere(name="Ico", radius=1.0, subdivisions=2):
    ball = made(
        name,
        lambda b: bmesh.ops.create_icosphere(b, subdivisions=subdivisions, radius=radius),
    )
    ball.data.shade_smooth()
    return ball


def plane(name="Plane", size=2.0, segments=1):
    return made(
        name,
        lambda b: bmesh.ops.create_grid(
            b, x_segments=segments, y_segments=segments, size=size / 2.0
        ),
    )


def light(kind, name=None, **settings):
    data = bpy.data.lights.new(name or kind.title(), kind)
    for key, value in settings.items():
        setattr(data, key, value)
    return link(bpy.data.objects.new(data.name, data))


def material(name="Material", node="ShaderNodeBsdfPrincipled", **inputs):
    """A material with one shader node; inputs by name, blanks written as underscores."""
    made_material = bpy.data.materials.new(name)
    made_material.use_nodes = True
    tree = made_material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    shader = tree.nodes.new(node)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    for key, value in inputs.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    return made_material


def scatter(points, source=None, collection=None):
    """Let nodes put instances of an object, or of a collection's objects, on points."""
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end, place, info = (
        tree.nodes.new(kind)
        for kind in (
            "NodeGroupInput",
            "NodeGroupOutput",
            "GeometryNodeInstanceOnPoints",
            "GeometryNodeObjectInfo" if source else "GeometryNodeCollectionInfo",
        )
    )
    if source:
        info.inputs["Object"].default_value = source
        info.inputs["As Instance"].default_value = True
    else:
        info.inputs["Collection"].default_value = collection
        info.inputs["Separate Children"].default_value = True
    tree.links.new(start.outputs[0], place.inputs["Points"])
    made = info.outputs["Geometry" if source else "Instances"]
    tree.links.new(made, place.inputs["Instance"])
    tree.links.new(place.outputs[0], end.inputs[0])
    points.modifiers.new("Scatter", "NODES").node_group = tree


def keyed(thing, path, *values):
    """Key a property at frames 1, 11, 21 … with straight lines between."""
    for index, value in enumerate(values):
        setattr(thing, path, value)
        thing.keyframe_insert(path, frame=1 + 10 * index)
    for curve in curves(thing):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
        curve.extrapolation = "LINEAR"


def curves(thing):
    from bpy_extras import anim_utils

    data = thing.animation_data
    if hasattr(anim_utils, "action_get_channelbag_for_slot"):
        bag = anim_utils.action_get_channelbag_for_slot(data.action, data.action_slot)
        return bag.fcurves
    return data.action.fcurves


def reasons(scene):
    """The issues of an exported scene, by name."""
    found = {}
    for issue in scene.issues:
        found.setdefault(issue.name, []).append(issue.reason)
    return found


def matt(name, *color):
    """A Lambert material."""
    return material(name, "ShaderNodeBsdfDiffuse", Color=(*color, 1.0), Roughness=0.0)


def balls_on_a_floor(size, height, tilt, balls, segments):
    """The scene with a floor and balls seen from in front; segments: so many that Cycles' polygons
    are as good as spheres. balls: name, place and radius of each; tilt in degrees."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    camera = scene.camera
    camera.location, camera.rotation_euler = (0.0, -9.0, height), (math.radians(tilt), 0.0, 0.0)
    camera.data.lens = 40.0
    plane(size=20.0).data.materials.append(matt("Floor", 0.6, 0.6, 0.55))
    for name, place, radius in balls:
        ball = uv_sphere(name, radius, segments=segments, rings=segments // 2)
        ball.data.shade_smooth()
        ball.location = place
        ball.data.materials.append(matt(name, *np.roll((0.8, 0.3, 0.2), ord(name))))
    return scene
