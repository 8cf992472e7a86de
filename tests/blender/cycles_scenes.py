# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of balls on a floor that Cycles can render as well, by name: a light or a world each."""

from __future__ import annotations

import math

import bmesh
import bpy
import numpy as np
import things

BALLS = (("A", (-2.0, 0.0, 0.8), 0.8), ("B", (0.0, 1.0, 1.0), 1.0), ("C", (1.9, -0.8, 0.6), 0.6))
"""Name, place and radius."""


def balls(resolution=(60, 40)):
    """Three balls on a floor, into an empty file with a camera; nothing lights them."""
    return things.balls_on_a_floor(resolution, 5.0, 62.0, BALLS, 256)


def area():
    lamp = things.light("AREA", energy=300.0, shape="RECTANGLE", size=1.6, size_y=1.0)
    lamp.location, lamp.rotation_euler = (-1.5, -1.0, 5.0), (0.2, -0.3, 0.1)


def soft_point(soft=True):
    lamp = things.light("POINT", energy=200.0, shadow_soft_size=0.4, use_soft_falloff=soft)
    lamp.location = (2.5, -2.0, 4.0)


def round_area(shape, **settings):
    lamp = things.light("AREA", energy=300.0, shape=shape, size=1.6, size_y=0.7, **settings)
    lamp.location, lamp.rotation_euler = (-1.5, -1.0, 4.0), (0.2, -0.3, 0.1)


def spot(radius, soft=True, blend=0.3, **settings):
    lamp = things.light(
        "SPOT", energy=600.0, shadow_soft_size=radius, use_soft_falloff=soft,
        spot_size=math.radians(55.0), spot_blend=blend, **settings
    )  # fmt: skip
    lamp.location, lamp.rotation_euler = (1.5, -2.5, 4.5), (0.45, 0.25, 0.3)


def sun(degrees):
    things.light("SUN", energy=3.0, angle=math.radians(degrees)).rotation_euler = (0.6, 0.5, 0.3)


def moving():
    area()
    things.keyed(bpy.data.objects["B"], "location", (-5.0, 1.0, 1.0), (5.0, 1.0, 1.0))
    bpy.context.scene.render.use_motion_blur = True
    bpy.context.scene.render.motion_blur_shutter = 1.0
    bpy.context.scene.frame_set(6)


def turning(make, place, path, *values):
    """Something that turns or grows over the balls, by key frames of one of its properties."""
    area()
    make()
    thing = bpy.context.object
    thing.location = place
    thing.data.materials.append(things.matt("Turning", 0.7, 0.5, 0.3))
    things.keyed(thing, path, *values)
    bpy.context.scene.render.use_motion_blur = True
    bpy.context.scene.render.motion_blur_shutter = 1.0
    bpy.context.scene.frame_set(6)


def head():
    # a larger one adds more of Cycles' noise than `AGREEMENT` allows
    bpy.ops.mesh.primitive_monkey_add(size=1.0)
    bpy.ops.object.shade_smooth()


def fan():
    """Four blades before the camera, which turn about its axis, as an empty in its place does."""

    def blades():
        angles = [math.pi / 2.0 * k + side for k in range(4) for side in (0.0, 0.6)]
        rim = [(1.2 * math.cos(a), 1.2 * math.sin(a), 0.1 * (i % 2)) for i, a in enumerate(angles)]
        faces = [(0, 1 + 2 * k, 2 + 2 * k) for k in range(4)]
        fan = things.mesh_object("Fan", [(0.0, 0.0, 0.0), *rim], faces)
        bpy.context.view_layer.objects.active = fan
        fan.parent = bpy.context.scene.camera

    turning(blades, (0.0, 0.0, -5.0), "rotation_euler", (0.0, 0.0, 0.0), (0.0, 0.0, 12.0))


def cube():
    """A turned cube of two materials beside the balls."""
    area()
    box = things.made("Box", lambda work: bmesh.ops.create_cube(work, size=1.2))
    box.location, box.rotation_euler = (-0.4, -2.0, 0.9), (0.3, 0.2, 0.6)
    for name, color in (("Side", (0.2, 0.5, 0.7)), ("Top", (0.8, 0.7, 0.1))):
        box.data.materials.append(things.matt(name, *color))
    for face in box.data.polygons:
        face.material_index = int(face.normal.z > 0.5)


def stretched():
    """The balls, scaled unevenly and turned: ellipsoids."""
    area()
    scales = ((1.0, 0.5, 0.8), (0.6, 1.2, 1.0), (1.3, 0.4, 0.7))
    for name, scale in zip("ABC", scales, strict=True):
        ball = bpy.data.objects[name]
        ball.scale, ball.rotation_euler = scale, (0.4, 0.3, 0.8)


def torus():
    """A torus of few flat faces, none of which is a parallelogram, over the balls."""
    area()
    bpy.ops.mesh.primitive_torus_add(
        major_segments=10, minor_segments=5, major_radius=1.2, minor_radius=0.5
    )
    torus = bpy.context.object
    torus.location, torus.rotation_euler = (0.2, -1.6, 1.6), (0.6, 0.3, 0.2)
    torus.data.materials.append(things.matt("Torus", 0.3, 0.6, 0.8))


def monkey():
    """A coarse smooth mesh whose terminator is seen, in place of the balls."""
    for name in "ABC":
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.ops.mesh.primitive_monkey_add(size=3.0, location=(0.0, 0.0, 1.6), rotation=(-0.8, 0.1, 0.4))
    monkey = bpy.context.object
    monkey.data.shade_smooth()
    monkey.data.materials.append(things.matt("Monkey", 0.7, 0.6, 0.5))


def monkey_before(light):
    monkey()
    light()


def monkey_in_world():
    world()
    for name in ("Box", "Wall"):
        bpy.data.objects.remove(bpy.data.objects[name])
    monkey()


def wall():
    things.plane("Wall", size=6.0).data.materials.append(things.matt("Wall", 0.7, 0.7, 0.7))
    wall = bpy.data.objects["Wall"]
    wall.location, wall.rotation_euler = (0.0, 3.0, 3.0), (math.pi / 2.0, 0.0, 0.2)


def world(moves=False):
    """Balls, a cube and a wall under a grey world alone."""
    moving() if moves else cube()
    bpy.data.objects.remove(next(x for x in bpy.data.objects if x.type == "LIGHT"))
    wall()
    world = bpy.context.scene.world = bpy.data.worlds.new("Grey")
    world.use_nodes = True
    node = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    node.inputs["Color"].default_value = (0.4, 0.5, 0.6, 1.0)


def seen_apart():
    """A world that the camera sees in another colour than that of its light."""
    world()
    tree = bpy.context.scene.world.node_tree
    node = next(n for n in tree.nodes if n.type == "BACKGROUND")
    output = next(n for n in tree.nodes if n.type == "OUTPUT_WORLD")
    mix, path, other = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("MixShader", "LightPath", "Background")
    )
    other.inputs["Color"].default_value, other.inputs["Strength"].default_value = (1, 0, 0, 1), 0.3
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(node.outputs[0], mix.inputs[1])
    tree.links.new(other.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])


def image(rows=64, columns=128):
    """A clear sky with a glow, over brown ground, as an image of the sphere."""
    y, x = np.meshgrid(
        (np.arange(rows) + 0.5) / rows, (np.arange(columns) + 0.5) / columns, indexing="ij"
    )
    glow = 8.0 * np.exp(-(((y - 0.72) ** 2) / 0.004 + ((x - 0.3) ** 2) / 0.002))
    sky = np.where(y > 0.5, 0.4 + 0.3 * y, 0.1 + 0.05 * np.sin(20.0 * x))
    pixels = np.ones((rows, columns, 4), dtype=np.float32)
    pixels[..., :3] = sky[..., None] * (0.5, 0.8, 1.2) + glow[..., None] * (1.0, 0.8, 0.5)
    image = bpy.data.images.new("Sphere", columns, rows, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image


def environment(moves=False, projection="EQUIRECTANGULAR", kind=None, **mapping):
    """The world's balls under an environment, through a Mapping node of a type if given."""
    world(moves)
    tree = bpy.context.scene.world.node_tree
    node = next(n for n in tree.nodes if n.type == "BACKGROUND")
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image, texture.projection = image(), projection
    tree.links.new(texture.outputs[0], node.inputs["Color"])
    node.inputs["Strength"].default_value = 0.8
    if kind is not None:
        place, where = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
        place.vector_type = kind
        tree.links.new(where.outputs["Generated"], place.inputs["Vector"])
        tree.links.new(place.outputs[0], texture.inputs["Vector"])
        for name, value in mapping.items():
            place.inputs[name].default_value = value


def sky(kind, **settings):
    """The world's balls under a sky."""
    world()
    tree = bpy.context.scene.world.node_tree
    node = next(n for n in tree.nodes if n.type == "BACKGROUND")
    texture = tree.nodes.new("ShaderNodeTexSky")
    kinds = [item.identifier for item in texture.bl_rna.properties["sky_type"].enum_items]
    texture.sky_type = next(name for name in kind if name in kinds)
    for name, value in settings.items():
        setattr(texture, name, value)
    tree.links.new(texture.outputs[0], node.inputs["Color"])
    node.inputs["Strength"].default_value = 0.3


SCATTERED = ("NISHITA", "SINGLE_SCATTERING")
TURN = (0.4, -0.3, 2.1)


SCENES = {
    "environment": environment,
    "moving under an environment": lambda: environment(True),
    "environment that is turned": lambda: environment(kind="POINT", Rotation=TURN),
    "environment that is turned back": lambda: environment(kind="TEXTURE", Rotation=TURN),
    "environment that is mirrored": lambda: environment(kind="POINT", Scale=(-1.0, 1.0, 1.0)),
    "environment that is stretched": lambda: environment(
        kind="TEXTURE", Rotation=TURN, Scale=(1.0, 0.5, 2.0), Location=(0.2, 0.1, -0.3)
    ),
    "sky by Preetham": lambda: sky(("PREETHAM",), sun_direction=(0.5, 0.3, 0.6), turbidity=3.0),
    "sky by Hosek": lambda: sky(("HOSEK_WILKIE",), sun_direction=(0.5, 0.3, 0.6), turbidity=3.0),
    "sky by Nishita": lambda: sky(SCATTERED, sun_disc=False, sun_elevation=0.6),
    "sky with a sun": lambda: sky(SCATTERED, sun_elevation=0.6, sun_rotation=0.7),
    "environment on a mirror ball": lambda: environment(projection="MIRROR_BALL"),
    "world that is seen in another colour": seen_apart,
    "world": world,
    "moving under a world": lambda: world(True),
    "area": area,
    "stretched balls": stretched,
    "cube": cube,
    "torus": torus,
    "monkey before an area": lambda: monkey_before(area),
    "monkey before a spot": lambda: monkey_before(lambda: spot(0.3)),
    "monkey in a world": monkey_in_world,
    "soft point": soft_point,
    "sphere point": lambda: soft_point(False),
    "point": lambda: setattr(things.light("POINT", energy=200.0), "location", (2.5, -2.0, 4.0)),
    "moving": moving,
    "turning head": lambda: turning(
        head, (0.3, -1.6, 1.5), "rotation_euler", (0.0, 0.0, 0.0), (2.0, 5.0, 12.0)
    ),
    "growing cube": lambda: turning(
        lambda: bpy.ops.mesh.primitive_cube_add(size=1.0),
        (0.0, -1.8, 1.2),
        "scale",
        (0.2, 0.5, 1.0),
        (3.2, 2.5, 1.0),
    ),
    "turning fan": fan,
    "disk": lambda: round_area("DISK"),
    "ellipse": lambda: round_area("ELLIPSE"),
    "spot": lambda: spot(0.4),
    "spot that is a ball": lambda: spot(0.4, False),
    "spot that is a point": lambda: spot(0.0),
    "spot of a hard cone": lambda: spot(0.2, blend=0.0),
    "spot of a soft cone": lambda: spot(0.3, blend=1.0),
    "sun of 0.526 degrees": lambda: sun(0.526),
    "sun of 20 degrees": lambda: sun(20.0),
    "sun that is a point": lambda: sun(0.0),
}
