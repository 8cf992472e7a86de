# SPDX-License-Identifier: GPL-3.0-or-later
"""Random Blender scenes of what Blender itself can make, for `against_cycles.py --random`."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "blender"))

import bpy
import numpy as np
import things
from against_extras import EXTRAS

__all__ = ["build"]


def build(seed: int, extra: str | None = None) -> str:
    """Make the scene of a seed, or a plain one with something extra; returns what is in it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    maker = _Maker(np.random.default_rng(seed))
    return maker.scene() if extra is None else maker.scene_with(extra)


class _Maker:
    """Makes one scene, and remembers what it used."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.words: list[str] = []
        self.paints: list[Any] = []

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def say(self, word: str) -> None:
        self.words.append(word)

    def scene(self) -> str:
        scene = bpy.context.scene
        scene.frame_set(6)
        scene.adaptive_drt.spheres = "FACES"  # Cycles shows the faces
        self.paints = [things.matt(f"Paint {k}", *self.rng.uniform(0.05, 0.9, 3)) for k in range(4)]
        self.paints.append(
            things.material(
                "Principled",
                Base_Color=(*self.rng.uniform(0.1, 0.9, 3), 1.0),
                Specular_IOR_Level=0.0,
            )
        )
        floor = things.plane("Floor", 14.0)
        floor.data.materials.append(self.paints[0])
        made = [self.thing() for _ in range(int(self.rng.integers(2, 6)))]
        if self.chance(0.3):
            made.append(self.instances(made))
        if self.chance(0.3):
            self.parent(made)
        if self.chance(0.35):
            self.flags(made)
        lamps = [self.lamp() for _ in range(int(self.rng.integers(1, 4)))]
        if self.chance(0.2):
            self.links(lamps, made)
        if self.chance(0.4):
            self.world()
        self.camera()
        if self.chance(0.3):
            self.motion(made)
        return ", ".join(self.words)

    def scene_with(self, extra: str) -> str:
        """A floor, a thing, a lamp and something of `EXTRAS`."""
        scene = bpy.context.scene
        scene.frame_set(6)
        scene.adaptive_drt.spheres = "FACES"
        self.paints = [things.matt(f"Paint {k}", *self.rng.uniform(0.1, 0.9, 3)) for k in range(5)]
        things.plane("Floor", 14.0).data.materials.append(self.paints[0])
        self.thing()
        lamp = things.light(
            "AREA", energy=400.0, shape="DISK", size=float(self.rng.uniform(0.3, 2))
        )
        lamp.location, lamp.rotation_euler = (1.0, -1.0, 5.0), (0.15, 0.15, 0.0)
        sun = things.light("SUN", energy=0.5, angle=0.05)
        sun.rotation_euler = (0.5, float(self.rng.uniform(-0.8, 0.8)), 0.2)
        self.camera()
        bpy.context.scene.render.use_border = False
        self.say(extra)
        EXTRAS[extra](self.rng)
        return ", ".join(self.words)

    # things

    def thing(self) -> Any:
        kinds = (self.primitive, self.primitive, self.primitive, self.text, self.curve, self.meta)
        made = kinds[int(self.rng.integers(len(kinds)))]()
        made.location = (*self.rng.uniform(-2.2, 2.2, 2), self.rng.uniform(0.5, 1.8))
        made.rotation_euler = self.rng.uniform(-math.pi, math.pi, 3)
        if self.chance(0.4):
            made.scale = self.rng.uniform(0.5, 1.5, 3) * self.rng.choice([-1, 1, 1, 1], 3)
        return made

    def primitive(self) -> Any:
        mesh = bpy.ops.mesh
        turn = self.rng.integers
        kinds = {
            "cube": lambda: mesh.primitive_cube_add(size=1.2),
            "plane": lambda: mesh.primitive_plane_add(size=1.5),
            "circle": lambda: mesh.primitive_circle_add(
                vertices=int(turn(3, 40)), radius=0.8, fill_type=self.pick("NGON", "TRIFAN")
            ),
            "uv sphere": lambda: mesh.primitive_uv_sphere_add(
                segments=int(turn(5, 40)), ring_count=int(turn(4, 20)), radius=0.8
            ),
            "ico sphere": lambda: mesh.primitive_ico_sphere_add(
                subdivisions=int(turn(1, 5)), radius=0.8
            ),
            "cylinder": lambda: mesh.primitive_cylinder_add(
                vertices=int(turn(3, 40)), radius=0.6, depth=1.3,
                end_fill_type=self.pick("NGON", "TRIFAN", "NOTHING"),
            ),
            "cone": lambda: mesh.primitive_cone_add(
                vertices=int(turn(3, 40)), radius1=0.8, radius2=float(self.rng.choice([0.0, 0.3])),
                depth=1.4, end_fill_type=self.pick("NGON", "TRIFAN", "NOTHING"),
            ),
            "torus": lambda: mesh.primitive_torus_add(
                major_segments=int(turn(5, 48)), minor_segments=int(turn(3, 14)),
                major_radius=0.7, minor_radius=0.28,
            ),
            "grid": lambda: mesh.primitive_grid_add(
                x_subdivisions=int(turn(2, 12)), y_subdivisions=int(turn(2, 12)), size=1.5
            ),
            "monkey": lambda: mesh.primitive_monkey_add(size=1.5),
        }  # fmt: skip
        name = self.pick(*kinds)
        kinds[name]()
        self.say(name)
        made = bpy.context.object
        self.paint(made)
        for _ in range(int(self.rng.integers(0, 3))):
            self.modify(made)
        self.shade(made)
        return made

    def pick(self, *names: str) -> str:
        return names[int(self.rng.integers(len(names)))]

    def paint(self, made: Any) -> None:
        """One to three materials, face by face, on the mesh or on the object."""
        count = 1 if self.chance(0.6) else int(self.rng.integers(2, 4))
        for _ in range(count):
            made.data.materials.append(self.paints[int(self.rng.integers(len(self.paints)))])
        if count > 1 and hasattr(made.data, "polygons"):
            self.say("materials")
            for face in made.data.polygons:
                face.material_index = int(self.rng.integers(count))
        if self.chance(0.1):
            self.say("material of the object")
            made.material_slots[0].link = "OBJECT"
            made.material_slots[0].material = self.paints[3]

    def modify(self, made: Any) -> None:
        name = self.pick(
            "BEVEL", "SUBSURF", "ARRAY", "SOLIDIFY", "MIRROR", "DECIMATE", "WIREFRAME",
            "DISPLACE", "SIMPLE_DEFORM", "TRIANGULATE", "WELD", "REMESH", "SCREW", "EDGE_SPLIT",
            "CAST", "WEIGHTED_NORMAL", "BUILD",
        )  # fmt: skip
        if name == "BUILD" or (name == "SUBSURF" and len(made.data.polygons) > 600):
            return
        self.say(name.lower())
        modifier = made.modifiers.new(name, name)
        settings: dict[str, dict[str, Any]] = {
            "BEVEL": {"width": 0.08, "segments": int(self.rng.integers(1, 4))},
            "SUBSURF": {"levels": 1, "render_levels": 2},
            "ARRAY": {"count": 3},
            "SOLIDIFY": {"thickness": float(self.rng.uniform(-0.2, 0.2))},
            "DECIMATE": {"ratio": 0.5},
            "DISPLACE": {"strength": 0.2},
            "SIMPLE_DEFORM": {"deform_method": "TWIST", "angle": 0.9},
            "REMESH": {"mode": "VOXEL", "voxel_size": 0.12},
            "SCREW": {"angle": 1.0, "steps": 4, "render_steps": 4},
            "CAST": {"factor": 0.4},
            # else the halves of what is symmetric lie in each other, where Cycles shows noise
            "MIRROR": {"use_bisect_axis": (True, False, False)},
        }
        for key, value in settings.get(name, {}).items():
            setattr(modifier, key, value)

    def shade(self, made: Any) -> None:
        way = self.pick("flat", "smooth", "auto")
        self.say(way)
        bpy.context.view_layer.objects.active = made
        if way == "smooth":
            bpy.ops.object.shade_smooth()
        elif way == "auto":
            bpy.ops.object.shade_auto_smooth(angle=0.6)

    def text(self) -> Any:
        self.say("text")
        bpy.ops.object.text_add()
        made = bpy.context.object
        made.data.body, made.data.size = self.pick("DRT", "Ray", "&8"), 1.4
        made.data.extrude = float(self.rng.choice([0.0, 0.1]))
        made.data.bevel_depth = float(self.rng.choice([0.0, 0.02]))
        self.paint(made)
        return made

    def curve(self) -> Any:
        name = self.pick("bezier_circle", "bezier_curve", "nurbs_circle", "nurbs_path")
        self.say(name)
        getattr(bpy.ops.curve, f"primitive_{name}_add")(radius=0.8)
        made = bpy.context.object
        made.data.bevel_depth = float(self.rng.uniform(0.05, 0.2))
        made.data.extrude = float(self.rng.choice([0.0, 0.1]))
        made.data.use_fill_caps = self.chance(0.5)
        self.paint(made)
        return made

    def meta(self) -> Any:
        name = self.pick("BALL", "CUBE", "ELLIPSOID", "surface")
        self.say(f"meta {name}")
        if name == "surface":
            bpy.ops.surface.primitive_nurbs_surface_torus_add(radius=0.6)
        else:
            bpy.ops.object.metaball_add(type=name, radius=1.0)
            bpy.context.object.data.render_resolution = 0.15
        made = bpy.context.object
        self.paint(made)
        return made

    def instances(self, made: list[Any]) -> Any:
        """A collection's instance, a scattering by nodes, or instances on vertices or faces."""
        way = self.pick("collection", "nodes", "VERTS", "FACES")
        self.say(f"instances by {way}")
        source = made[int(self.rng.integers(len(made)))]
        place = (*self.rng.uniform(-2, 2, 2), self.rng.uniform(1.0, 2.0))
        if way == "collection":
            group = bpy.data.collections.new("Group")
            group.objects.link(source)
            other = things.link(bpy.data.objects.new("Instance", None))
            other.instance_type, other.instance_collection = "COLLECTION", group
            other.rotation_euler, other.scale = self.rng.uniform(-1, 1, 3), (0.6, 0.8, 0.7)
        else:
            bpy.ops.mesh.primitive_plane_add(size=1.5)
            other = bpy.context.object
            other.data.materials.append(self.paints[1])
            if way == "nodes":
                things.scatter(other, source=source)
                other.scale = (0.5, 0.5, 0.5)
            else:
                small = self.primitive()
                small.parent, small.scale = other, (0.2, 0.2, 0.2)
                other.instance_type = way
                other.show_instancer_for_render = self.chance(0.5)
        other.location = place
        return other

    def parent(self, made: list[Any]) -> None:
        """Parents that scale unevenly, turn and so shear."""
        self.say("sheared by a parent")
        empty = things.link(bpy.data.objects.new("Empty", None))
        empty.scale, empty.rotation_euler = (
            self.rng.uniform(0.6, 1.4, 3),
            self.rng.uniform(-1, 1, 3),
        )
        for thing in made:
            if thing.parent is None and self.chance(0.5):
                thing.parent = empty

    def flags(self, made: list[Any]) -> None:
        for thing in made:
            if self.chance(0.5):
                name = self.pick(
                    "hide_render", "is_holdout", "visible_camera", "visible_shadow", "hide_viewport"
                )
                self.say(name)
                setattr(thing, name, name.startswith(("hide", "is")))
                if name == "visible_shadow":
                    # else Cycles mixes what light rays and rays to lights meet
                    thing.visible_diffuse = False
        if self.chance(0.3):
            self.say("transparent film")
            bpy.context.scene.render.film_transparent = True

    # light

    def lamp(self) -> Any:
        kind = self.pick("POINT", "SPOT", "SUN", "AREA", "AREA", "GLOW")
        self.say(kind)
        place = (*self.rng.uniform(-3, 3, 2), self.rng.uniform(2.8, 5.0))
        if kind == "GLOW":
            return self.glow(place)
        settings: dict[str, Any] = {"energy": float(self.rng.uniform(50.0, 400.0))}
        if kind == "SUN":
            settings = {
                "energy": float(self.rng.uniform(0.5, 4.0)),
                "angle": float(self.rng.choice([0.0, 0.01, 0.1, 0.5])),
            }
        elif kind == "AREA":
            settings |= {
                "shape": self.pick("SQUARE", "RECTANGLE", "DISK", "ELLIPSE"),
                "size": float(self.rng.uniform(0.2, 2.5)),
                "size_y": float(self.rng.uniform(0.2, 2.5)),
            }
            if self.chance(0.3):
                settings["spread"] = float(self.rng.uniform(0.5, 3.0))
        else:
            settings |= {
                "shadow_soft_size": float(self.rng.choice([0.0, 0.1, 0.5])),
                "use_soft_falloff": self.chance(0.5),
            }
            if kind == "SPOT":
                settings |= {
                    "spot_size": float(self.rng.uniform(0.4, 2.6)),
                    "spot_blend": float(self.rng.uniform(0.0, 1.0)),
                }
        settings["color"] = self.rng.uniform(0.3, 1.0, 3)
        if self.chance(0.1):
            self.say("without shadow")
            settings["use_shadow"] = False
        if self.chance(0.15) and kind != "SUN":
            self.say("not normalised")
            settings["exposure"] = 1.0
        if self.chance(0.15) and bpy.app.version >= (4, 5, 0):
            settings["use_temperature"], settings["temperature"] = True, 4000.0
        lamp = things.light(kind, **settings)
        lamp.location, lamp.rotation_euler = place, self.rng.normal(size=3) * 0.5
        if self.chance(0.2):
            self.say("scaled")
            lamp.scale = self.rng.uniform(0.4, 1.6, 3)
        return lamp

    def glow(self, place: tuple[float, ...]) -> Any:
        material = things.material(
            "Glow", "ShaderNodeEmission", Color=(1.0, 0.8, 0.5, 1.0),
            Strength=float(self.rng.uniform(2.0, 10.0)),
        )  # fmt: skip
        if self.chance(0.5):
            bpy.ops.mesh.primitive_plane_add(size=1.2)
        else:
            bpy.ops.mesh.primitive_cube_add(size=0.6)
        made = bpy.context.object
        made.data.materials.append(material)
        made.location, made.rotation_euler = place, self.rng.normal(size=3) * 0.4
        return made

    def links(self, lamps: list[Any], made: list[Any]) -> None:
        self.say("light linking")
        group = bpy.data.collections.new("Linked")
        for thing in made:
            if self.chance(0.5):
                group.objects.link(thing)
        side = self.pick("receiver_collection", "blocker_collection")
        setattr(lamps[0].light_linking, side, group)
        if self.chance(0.5) and group.collection_objects:
            for each in group.collection_objects:
                each.light_linking.link_state = "EXCLUDE"

    def world(self) -> None:
        world = bpy.context.scene.world = bpy.data.worlds.new("World")
        world.use_nodes = True
        tree = world.node_tree
        node = next(n for n in tree.nodes if n.type == "BACKGROUND")
        node.inputs["Color"].default_value = (*self.rng.uniform(0.0, 0.6, 3), 1.0)
        if self.chance(0.4):
            self.say("sky")
            sky = tree.nodes.new("ShaderNodeTexSky")
            sky.sun_elevation = float(self.rng.uniform(0.1, 1.5))
            sky.sun_disc = False  # ours is bright alike all over
            tree.links.new(sky.outputs[0], node.inputs["Color"])
            node.inputs["Strength"].default_value = 0.2
        else:
            self.say("world")
        if self.chance(0.2):
            bpy.context.scene.world.cycles_visibility.camera = False

    # camera

    def camera(self) -> None:
        scene = bpy.context.scene
        thing = things.link(bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
        scene.camera, data, render = thing, thing.data, scene.render
        turn, up = self.rng.uniform(-math.pi, math.pi), self.rng.uniform(0.9, 1.3)
        reach = 9.0
        thing.location = (
            reach * math.sin(up) * math.sin(turn),
            -reach * math.sin(up) * math.cos(turn),
            reach * math.cos(up) + 0.8,
        )
        thing.rotation_euler = (up, float(self.rng.normal() * 0.1), turn)
        data.lens = float(self.rng.uniform(30.0, 60.0))
        render.resolution_x, render.resolution_y = (64, 48) if self.chance(0.7) else (40, 60)
        if self.chance(0.3):
            self.say("shift")
            data.shift_x, data.shift_y = self.rng.uniform(-0.2, 0.2, 2)
        if self.chance(0.3):
            data.sensor_fit = self.pick("HORIZONTAL", "VERTICAL")
            data.sensor_width, data.sensor_height = self.rng.uniform(20.0, 40.0, 2)
        if self.chance(0.2):
            self.say("percentage")
            render.resolution_percentage = int(self.rng.choice([53, 75, 130]))
        if self.chance(0.2):
            self.say("aspect")
            render.pixel_aspect_x, render.pixel_aspect_y = self.rng.uniform(1.0, 2.0, 2)
        if self.chance(0.2):
            self.say("border")
            render.use_border, render.use_crop_to_border = True, self.chance(0.5)
            render.border_min_x, render.border_min_y = self.rng.uniform(0.0, 0.4, 2)
            render.border_max_x, render.border_max_y = self.rng.uniform(0.6, 1.0, 2)

    def motion(self, made: list[Any]) -> None:
        """Things and the camera that move, and things that turn and grow, by straight keys."""
        scene = bpy.context.scene
        scene.render.use_motion_blur = True
        scene.render.motion_blur_shutter = float(self.rng.choice([0.5, 1.0]))
        scene.render.motion_blur_position = self.pick("CENTER", "START", "END")
        for thing in [*made, scene.camera]:
            if thing.type == "META" or not self.chance(0.5):
                continue  # a ball that moves alone deforms the whole
            path = (
                "location"
                if thing is scene.camera
                else self.pick("location", "rotation_euler", "scale")
            )
            self.say(f"{thing.name.split('.')[0]} moves by {path}")
            middle = np.array(getattr(thing, path))
            step = self.rng.uniform(-2.0, 2.0, 3)
            if thing is scene.camera:
                step = 0.5 * step
            things.keyed(thing, path, middle - step, middle + step)
        scene.frame_set(6)
