# SPDX-License-Identifier: GPL-3.0-or-later
"""Less usual things of Blender that random scenes for `against_cycles.py` may hold: one each."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "blender"))

import bpy
import numpy as np
import things

__all__ = ["EXTRAS"]


def _cube(place: tuple[float, float, float] = (0.6, -0.5, 1.1), size: float = 0.9) -> Any:
    bpy.ops.mesh.primitive_cube_add(size=size, location=place)
    made = bpy.context.object
    made.data.materials.append(things.matt("Extra", 0.5, 0.6, 0.3))
    return made


def _ball(place: tuple[float, float, float] = (-0.8, 0.4, 1.2)) -> Any:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=20, ring_count=10, radius=0.7, location=place)
    made = bpy.context.object
    made.data.materials.append(things.matt("Extra", 0.6, 0.4, 0.5))
    return made


def _nodes(thing: Any, *kinds: str) -> list[Any]:
    """Geometry nodes between a modifier's input and output, one after another."""
    tree = bpy.data.node_groups.new("Extra", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    made = [tree.nodes.new(k) for k in ("NodeGroupInput", *kinds, "NodeGroupOutput")]
    for before, after in pairwise(made):
        tree.links.new(before.outputs[0], after.inputs[0])
    thing.modifiers.new("Nodes", "NODES").node_group = tree
    return made[1:-1]


def _group() -> Any:
    group = bpy.data.collections.new("Extra")
    bpy.context.scene.collection.children.link(group)
    for thing in (_cube(), _ball()):
        bpy.context.scene.collection.objects.unlink(thing)
        group.objects.link(thing)
    return bpy.context.view_layer.layer_collection.children[group.name]


def _nested_instances(rng: np.random.Generator) -> None:
    inner, outer = bpy.data.collections.new("Inner"), bpy.data.collections.new("Outer")
    thing = _ball((0.0, 0.0, 0.0))
    bpy.context.scene.collection.objects.unlink(thing)
    inner.objects.link(thing)
    inner.instance_offset = (0.2, 0.1, 0.0)
    for group, holder, places in ((inner, outer, 3), (outer, None, 2)):
        for k in range(places):
            empty = bpy.data.objects.new("Instance", None)
            empty.instance_type, empty.instance_collection = "COLLECTION", group
            empty.location, empty.scale = (0.9 * k - 0.8, 1.3 * k - 0.5, 0.8), (0.6, 0.5, 0.7)
            empty.rotation_euler = rng.uniform(-1, 1, 3)
            (holder or bpy.context.scene.collection).objects.link(empty)


def _particles(kind: str) -> Callable[[np.random.Generator], None]:
    def make(rng: np.random.Generator) -> None:
        small = _cube((0.0, 0.0, -3.0), 0.3)
        thing = _ball()
        system = thing.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system.settings
        system.type, system.count, system.frame_end = kind, 40, 1
        system.render_type, system.instance_object = "OBJECT", small
        system.particle_size, system.size_random = 0.5, 0.5
        system.use_rotations, system.rotation_factor_random = True, 0.6
        if kind == "HAIR":
            system.use_advanced_hair = True

    return make


def _shape_key(rng: np.random.Generator) -> None:
    thing = _ball()
    thing.shape_key_add(name="Basis")
    key = thing.shape_key_add(name="Key")
    for point in key.data:
        point.co.z *= 0.4
    key.value = float(rng.uniform(0.3, 1.0))


def _armature(rng: np.random.Generator) -> None:
    thing = _cube()
    bones = bpy.data.armatures.new("Bones")
    holder = things.link(bpy.data.objects.new("Bones", bones))
    bpy.context.view_layer.objects.active = holder
    bpy.ops.object.mode_set(mode="EDIT")
    bone = bones.edit_bones.new("Bone")
    bone.head, bone.tail = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    group = thing.vertex_groups.new(name="Bone")
    group.add([0, 1, 2, 3], 1.0, "REPLACE")
    thing.modifiers.new("Armature", "ARMATURE").object = holder
    holder.pose.bones["Bone"].rotation_mode = "XYZ"
    holder.pose.bones["Bone"].rotation_euler = rng.uniform(-0.5, 0.5, 3)


def _boolean(rng: np.random.Generator) -> None:
    thing, other = _cube(), _ball((0.9, -0.8, 1.5))
    cut = thing.modifiers.new("Boolean", "BOOLEAN")
    cut.object, cut.operation = other, "DIFFERENCE"
    other.display_type = "WIRE"
    other.hide_render = bool(rng.random() < 0.7)


def _custom_normals(rng: np.random.Generator) -> None:
    thing = _ball()
    thing.data.shade_smooth()
    corners = np.array([v.normal[:] for v in thing.data.vertices])
    corners += rng.normal(size=corners.shape) * 0.2
    thing.data.normals_split_custom_set_from_vertices(corners.tolist())


def _sharp_edges(rng: np.random.Generator) -> None:
    thing = _ball()
    thing.data.shade_smooth()
    for edge in thing.data.edges:
        edge.use_edge_sharp = bool(rng.random() < 0.3)
    for face in thing.data.polygons:
        face.use_smooth = bool(rng.random() < 0.8)


def _creased(rng: np.random.Generator) -> None:
    thing = _cube()
    attribute = thing.data.attributes.new("crease_edge", "FLOAT", "EDGE")
    attribute.data.foreach_set("value", rng.uniform(0, 1, len(thing.data.edges)).astype("f4"))
    thing.modifiers.new("Subdivision", "SUBSURF").render_levels = 3
    thing.data.shade_smooth()


def _constraint(rng: np.random.Generator) -> None:
    thing, target = _cube(), _ball()
    track = thing.constraints.new("TRACK_TO")
    track.target, track.track_axis, track.up_axis = target, "TRACK_X", "UP_Z"
    copy = target.constraints.new("COPY_SCALE")
    copy.target = thing
    thing.scale = rng.uniform(0.5, 1.2, 3)


def _delta(rng: np.random.Generator) -> None:
    thing = _cube()
    thing.delta_location, thing.delta_scale = rng.uniform(-0.4, 0.4, 3), rng.uniform(0.6, 1.4, 3)
    thing.delta_rotation_euler = rng.uniform(-1, 1, 3)
    thing.rotation_mode, thing.rotation_quaternion = "QUATERNION", rng.normal(size=4)


def _driven(rng: np.random.Generator) -> None:
    curve = _cube().driver_add("location", 2)
    curve.driver.type, curve.driver.expression = "SCRIPTED", "1.0 + 0.05 * frame"


def _layer_flag(name: str) -> Callable[[np.random.Generator], None]:
    def make(rng: np.random.Generator) -> None:
        setattr(_group(), name, True)

    return make


def _collection_hidden(rng: np.random.Generator) -> None:
    _group().collection.hide_render = True


def _override(rng: np.random.Generator) -> None:
    _cube()
    bpy.context.view_layer.material_override = things.matt("Override", 0.4, 0.4, 0.7)


def _exposure(rng: np.random.Generator) -> None:
    bpy.context.scene.cycles.film_exposure = float(rng.uniform(0.3, 2.0))


def _simplify(rng: np.random.Generator) -> None:
    _creased(rng)
    render = bpy.context.scene.render
    render.use_simplify, render.simplify_subdivision_render = True, 1


def _still_object(rng: np.random.Generator) -> None:
    thing = _cube()
    things.keyed(thing, "location", (0.0, -1.0, 1.0), (3.0, 1.0, 1.5))
    thing.cycles.use_motion_blur = False
    _blurred()


def _blurred() -> None:
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    scene.frame_set(6)


def _parent_moves(rng: np.random.Generator) -> None:
    empty = things.link(bpy.data.objects.new("Mover", None))
    for thing in (_cube(), _ball()):
        thing.parent = empty
    things.keyed(empty, "rotation_euler", (0.0, 0.0, -1.0), (0.2, 0.3, 2.0))
    _blurred()


def _moving_instances(rng: np.random.Generator) -> None:
    _nested_instances(rng)
    empty = next(x for x in bpy.context.scene.objects if x.name.startswith("Instance"))
    things.keyed(empty, "location", (0.0, -1.0, 0.5), (2.0, 1.0, 1.5))
    _blurred()


def _steps(rng: np.random.Generator) -> None:
    thing = _cube()
    thing.cycles.motion_steps = 3
    things.keyed(thing, "location", (0.0, -1.0, 1.0), (4.0, 2.0, 1.5))
    _blurred()


def _backfaces(rng: np.random.Generator) -> None:
    material = things.matt("Culled", 0.3, 0.5, 0.6)
    material.use_backface_culling = True
    thing = _cube()
    thing.data.materials[0] = material
    thing.data.flip_normals()


def _two_sided(rng: np.random.Generator) -> None:
    thing = _ball()
    for face in thing.data.polygons:
        if rng.random() < 0.5:
            face.flip()
    thing.data.shade_smooth()


def _loose(rng: np.random.Generator) -> None:
    """Loose edges and points, doubled points, and a face without area, about a triangle."""
    corners = [(0, 0, 1), (1, 0, 1.2), (0.4, 1, 1), (0.4, 1, 1), (2, 2, 2), (0.5, 0.0, 1.1)]
    mesh = bpy.data.meshes.new("Loose")
    mesh.from_pydata(corners, [(0, 4)], [(0, 1, 2), (0, 2, 3)])
    thing = things.link(bpy.data.objects.new("Loose", mesh))
    thing.data.materials.append(things.matt("Loose", 0.7, 0.3, 0.3))


def _concave(rng: np.random.Generator) -> None:
    turns = np.linspace(0.0, 2.0 * math.pi, 14, endpoint=False)
    size = np.where(np.arange(14) % 2, 0.5, 1.2)
    heights = 1.2 + rng.normal(size=14) * 0.1 * rng.integers(2)
    corners = np.stack([size * np.cos(turns), size * np.sin(turns), heights], axis=1)
    thing = things.mesh_object("Star", corners.tolist(), [tuple(range(14))])
    thing.data.materials.append(things.matt("Star", 0.7, 0.7, 0.3))


def _curve_to_mesh(rng: np.random.Generator) -> None:
    bpy.ops.curve.primitive_bezier_curve_add(location=(0.0, 0.0, 1.2))
    thing = bpy.context.object
    (sweep,) = _nodes(thing, "GeometryNodeCurveToMesh")
    tree = thing.modifiers[0].node_group
    ring = tree.nodes.new("GeometryNodeCurvePrimitiveCircle")
    ring.inputs["Radius"].default_value, ring.inputs["Resolution"].default_value = 0.15, 9
    tree.links.new(ring.outputs[0], sweep.inputs[1])


def _taper(rng: np.random.Generator) -> None:
    bpy.ops.curve.primitive_bezier_curve_add(location=(3.0, 3.0, -4.0), radius=0.5)
    taper = bpy.context.object
    bpy.ops.curve.primitive_nurbs_path_add(location=(0.0, 0.0, 1.2), radius=0.5)
    path = bpy.context.object
    path.data.bevel_depth, path.data.taper_object = 0.2, taper
    path.data.splines[0].points[1].tilt = 0.8


def _scattered(rng: np.random.Generator) -> None:
    small = _cube((0.0, 0.0, -4.0), 0.4)
    bpy.ops.mesh.primitive_plane_add(size=3.0, location=(0.0, 0.0, 1.0))
    field = bpy.context.object
    (spread,) = _nodes(field, "GeometryNodeDistributePointsOnFaces")
    spread.inputs["Density"].default_value = 8.0
    tree = field.modifiers[0].node_group
    end = next(n for n in tree.nodes if n.bl_idname == "NodeGroupOutput")
    place, info = (
        tree.nodes.new(k) for k in ("GeometryNodeInstanceOnPoints", "GeometryNodeObjectInfo")
    )
    info.inputs["Object"].default_value = small
    tree.links.new(spread.outputs[0], place.inputs["Points"])
    tree.links.new(spread.outputs["Rotation"], place.inputs["Rotation"])
    tree.links.new(info.outputs["Geometry"], place.inputs["Instance"])
    if rng.random() < 0.5:
        real = tree.nodes.new("GeometryNodeRealizeInstances")
        tree.links.new(place.outputs[0], real.inputs[0])
        place = real
    tree.links.new(place.outputs[0], end.inputs[0])


def _set_material(rng: np.random.Generator) -> None:
    thing = _ball()
    (setter,) = _nodes(thing, "GeometryNodeSetMaterial")
    setter.inputs["Material"].default_value = things.matt("Set", 0.1, 0.6, 0.7)


def _mixed_shader(rng: np.random.Generator) -> None:
    tree = _ball().data.materials[0].node_tree
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    mix, other = (tree.nodes.new(k) for k in ("ShaderNodeMixShader", "ShaderNodeBsdfDiffuse"))
    other.inputs["Color"].default_value = (0.1, 0.1, 0.9, 1.0)
    mix.inputs[0].default_value = float(rng.uniform(0.2, 0.8))
    first = next(n for n in tree.nodes if n.type == "BSDF_DIFFUSE" and n is not other)
    for shader, socket in ((first, 1), (other, 2)):
        tree.links.new(shader.outputs[0], mix.inputs[socket])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])


def _lit_and_shining(rng: np.random.Generator) -> None:
    """A Principled BSDF with a colour and a weak emission of its own."""
    thing = _cube()
    thing.data.materials[0] = things.material(
        "Both",
        Base_Color=(0.3, 0.5, 0.6, 1.0),
        Specular_IOR_Level=0.0,
        Emission_Color=(1.0, 0.5, 0.2, 1.0),
        Emission_Strength=float(rng.uniform(0.1, 3.0)),
    )


def _dark_lamp(rng: np.random.Generator) -> None:
    """Lamps of a hidden collection, of no power, and behind the floor."""
    things.light("POINT", energy=0.0).location = (0.0, 0.0, 2.0)
    things.light("AREA", energy=500.0).location = (0.0, 0.0, -2.0)
    lamp = things.light("SPOT", energy=500.0)
    lamp.location, lamp.hide_render = (0.0, 0.0, 3.0), True


def _lamp_nodes(rng: np.random.Generator) -> None:
    lamp = things.light("POINT", energy=100.0, shadow_soft_size=0.2)
    lamp.location = (1.0, 1.0, 3.5)
    lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    emission = next(n for n in tree.nodes if n.type == "EMISSION")
    emission.inputs["Strength"].default_value = float(rng.uniform(0.2, 2.0))
    body = tree.nodes.new("ShaderNodeBlackbody")
    body.inputs[0].default_value = float(rng.uniform(2000, 9000))
    tree.links.new(body.outputs[0], emission.inputs["Color"])


def _seen_lamp(rng: np.random.Generator) -> None:
    lamp = things.light("AREA", energy=60.0, shape="DISK", size=1.0)
    lamp.location, lamp.rotation_euler = (0.0, 0.0, 2.2), (0.5, 0.3, 0.0)
    lamp.visible_camera = True


def _lamp_of_a_parent(rng: np.random.Generator) -> None:
    empty = things.link(bpy.data.objects.new("Holder", None))
    empty.scale, empty.rotation_euler = rng.uniform(0.4, 2.0, 3), rng.uniform(-0.5, 0.5, 3)
    kind = str(rng.choice(["POINT", "AREA", "SPOT", "SUN"]))
    lamp = things.light(kind, energy=3.0 if kind == "SUN" else 150.0)
    lamp.location, lamp.parent = (0.5, 0.5, 2.5), empty


def _lamps_by_instancing(rng: np.random.Generator) -> None:
    group = bpy.data.collections.new("Lamps")
    data = bpy.data.lights.new("Lamp", "POINT")
    data.energy, data.shadow_soft_size = 60.0, 0.2
    group.objects.link(bpy.data.objects.new("Lamp", data))
    for k in range(3):
        empty = things.link(bpy.data.objects.new("Lamps", None))
        empty.instance_type, empty.instance_collection = "COLLECTION", group
        empty.location = (2.0 * k - 2.0, 0.5, 3.0)


def _lamp_flags(rng: np.random.Generator) -> None:
    lamp = things.light("AREA", energy=150.0, size=0.8)
    lamp.location = (-1.0, 0.5, 3.5)
    lamp.data.cycles.max_bounces = int(rng.integers(0, 3))
    lamp.data.cycles.use_multiple_importance_sampling = bool(rng.random() < 0.5)
    lamp.data.diffuse_factor = float(rng.uniform(0.3, 1.0))


def _marker(rng: np.random.Generator) -> None:
    """A camera that a marker of the time line chooses is Blender's business."""
    other = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))
    things.link(other)
    other.location, other.rotation_euler = (0.0, -7.0, 4.0), (1.1, 0.0, 0.0)
    bpy.context.scene.timeline_markers.new("Cut", frame=1).camera = other


def _clip(rng: np.random.Generator) -> None:
    for camera in bpy.data.cameras:
        camera.clip_start, camera.clip_end = 0.01, 50.0


def _far_away(rng: np.random.Generator) -> None:
    """Everything 800 m from the origin, where float32 has a tenth of a millimetre."""
    for thing in bpy.context.scene.objects:
        if thing.parent is None:
            thing.location += thing.location.__class__((500.0, -600.0, 80.0))


EXTRAS: dict[str, Callable[[np.random.Generator], None]] = {
    "nested instances": _nested_instances,
    "particles": _particles("EMITTER"),
    "hair of objects": _particles("HAIR"),
    "shape key": _shape_key,
    "armature": _armature,
    "boolean": _boolean,
    "custom normals": _custom_normals,
    "sharp edges": _sharp_edges,
    "creases": _creased,
    "constraint": _constraint,
    "delta transforms": _delta,
    "driver": _driven,
    "holdout collection": _layer_flag("holdout"),
    "indirect collection": _layer_flag("indirect_only"),
    "excluded collection": _layer_flag("exclude"),
    "hidden collection": _collection_hidden,
    "material override": _override,
    "exposure": _exposure,
    "simplify": _simplify,
    "object without blur": _still_object,
    "moving parent": _parent_moves,
    "moving instances": _moving_instances,
    "motion steps": _steps,
    "backface culling": _backfaces,
    "flipped faces": _two_sided,
    "loose": _loose,
    "concave face": _concave,
    "curve to mesh": _curve_to_mesh,
    "taper": _taper,
    "scattered": _scattered,
    "set material": _set_material,
    "mixed shader": _mixed_shader,
    "lit and shining": _lit_and_shining,
    "dark lamp": _dark_lamp,
    "lamp nodes": _lamp_nodes,
    "seen lamp": _seen_lamp,
    "lamp of a parent": _lamp_of_a_parent,
    "instanced lamps": _lamps_by_instancing,
    "lamp flags": _lamp_flags,
    "marker": _marker,
    "clip": _clip,
    "far away": _far_away,
}
