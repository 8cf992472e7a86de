# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of `against_cycles.py`: a light or a sky each, and meshes, still and moving."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "blender"))

import bpy
import cycles_scenes as known
import numpy as np
import things

__all__ = ["LIGHTS", "MESHES", "SIZE", "SKIES", "moving_light", "start"]

SIZE = (64, 48)
"""Pixels of a picture."""
STEP = (1.2, 0.6, 0.3)
"""How far a moving light moves within the shutter, metres."""


def start() -> None:
    """An empty file with a camera, which the scenes are made in."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.camera = things.link(bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
    scene.frame_set(6)
    known.balls(SIZE)


def _blur() -> None:
    """Motion blur of the things that were keyed at frames 1 and 11: a tenth of it each frame."""
    scene = bpy.context.scene
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = 1.0


def _move(thing: Any) -> None:
    """Key a thing so that it covers STEP within the shutter, its place being the middle."""
    middle = np.array(thing.location)
    things.keyed(thing, "location", *(middle + side * np.array(STEP) for side in (-5.0, 5.0)))
    _blur()
    bpy.context.scene.frame_set(6)


def _glow(strength: float) -> Any:
    return things.material(
        "Glow", "ShaderNodeEmission", Color=(1.0, 0.8, 0.6, 1.0), Strength=strength
    )


def _shining(thing: Any, place: tuple[float, ...], strength: float) -> None:
    thing.location, thing.rotation_euler = place, (0.3, -0.2, 0.4)
    thing.data.materials.append(_glow(strength))


def _polygon(corners: int, size: float) -> Any:
    turns = 2.0 * math.pi * np.arange(corners) / corners
    places = [(size * math.cos(t), 0.8 * size * math.sin(t), 0.0) for t in turns]
    return things.mesh_object("Face", places, [tuple(range(corners))])


def _uneven_spot() -> None:
    known.spot(0.2)
    lamp = next(x for x in bpy.data.objects if x.type == "LIGHT")
    lamp.scale = (1.6, 0.7, 1.0)


def _spread() -> None:
    known.area()
    next(iter(bpy.data.lights)).spread = math.radians(60.0)


def _square() -> None:
    lamp = things.light("AREA", energy=300.0, shape="SQUARE", size=1.2)
    lamp.location, lamp.rotation_euler = (-1.5, -1.0, 4.5), (0.2, -0.3, 0.1)


LIGHTS: dict[str, Callable[[], Any]] = {
    "point of no radius": known.SCENES["point"],
    "soft point": known.soft_point,
    "point that is a ball": known.SCENES["sphere point"],
    "spot": known.SCENES["spot"],
    "spot of an uneven cone": _uneven_spot,
    "sun of 4 degrees": lambda: known.sun(4.0),
    "area, rectangle": known.area,
    "area, square": _square,
    "area, disk": known.SCENES["disk"],
    "area, ellipse": known.SCENES["ellipse"],
    "area of a spread of 60 degrees": _spread,
    "ball that shines": lambda: _shining(
        things.uv_sphere("Glow", 0.5, segments=192, rings=96), (-1.2, -1.5, 4.0), 12.0
    ),
    "triangle that shines": lambda: _shining(_polygon(3, 1.0), (-1.0, -1.0, 4.0), 15.0),
    "disk that shines": lambda: _shining(_polygon(64, 0.8), (-1.0, -1.0, 4.0), 15.0),
}
"""Lights over three balls; each is rendered moving, too."""


def _all() -> None:
    """Every kind of light at once, moving balls, and a sky."""
    known.sky(known.SCATTERED, sun_elevation=0.6, sun_rotation=0.7)
    tree = bpy.context.scene.world.node_tree
    next(n for n in tree.nodes if n.type == "BACKGROUND").inputs["Strength"].default_value = 0.02
    for name in ("soft point", "spot", "area, disk", "area, rectangle", "triangle that shines"):
        LIGHTS[name]()
    known.sun(2.0)
    ball = bpy.data.objects["B"]
    things.keyed(ball, "location", (-5.0, 1.0, 1.0), (5.0, 1.0, 1.0))
    _blur()
    bpy.context.scene.frame_set(6)


SKIES: dict[str, Callable[[], Any]] = {
    "world of one colour": known.world,
    "world of one colour, moving": lambda: known.world(True),
    **{f"Sky Texture: {k}": known.SCENES[f"sky {k}"] for k in ("by Preetham", "by Hosek")},
    "Sky Texture: by Nishita": known.SCENES["sky by Nishita"],
    "Sky Texture: with its sun": known.SCENES["sky with a sun"],
    "Environment Texture": known.environment,
    "Environment Texture, turned": known.SCENES["environment that is turned"],
    "Environment Texture, mirror ball": known.SCENES["environment on a mirror ball"],
    "Environment Texture, moving": known.SCENES["moving under an environment"],
    "all at once": _all,
}


def _clear() -> None:
    for name in "ABC":
        bpy.data.objects.remove(bpy.data.objects[name])


def _standing(make: Callable[[], Any], place: tuple[float, ...], turn: tuple[float, ...]) -> Any:
    """What an operator makes, in place of the balls, matt."""
    make()
    thing = bpy.context.object
    thing.location, thing.rotation_euler = place, turn
    thing.data.materials.append(things.matt("Clay", 0.7, 0.6, 0.5))
    return thing


def _suzanne() -> Any:
    _clear()
    known.area()
    head = _standing(
        lambda: bpy.ops.mesh.primitive_monkey_add(size=3.0), (0.0, 0.0, 1.6), (-0.8, 0.1, 0.4)
    )
    head.modifiers.new("Subdivision", "SUBSURF").render_levels = 4
    head.data.shade_smooth()
    return head


def _knot() -> Any:
    """A trefoil of a tube on a torus, 200 x 24 faces."""
    _clear()
    known.sun(3.0)
    t = 2.0 * math.pi * np.arange(200)[:, None] / 200
    reach = 1.2 + 0.5 * np.cos(3 * t)
    path = np.concatenate([reach * np.cos(2 * t), reach * np.sin(2 * t), 0.5 * np.sin(3 * t)], 1)
    along = np.roll(path, -1, 0) - np.roll(path, 1, 0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    side = np.cross(along, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    up, a = np.cross(side, along), 2.0 * math.pi * np.arange(24) / 24
    ring = np.cos(a)[:, None] * side[:, None] + np.sin(a)[:, None] * up[:, None]
    corners = (path[:, None] + 0.22 * ring).reshape(-1, 3)
    at = lambda i, j: (i % 200) * 24 + j % 24  # noqa: E731
    faces = [
        (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j))
        for i in range(200)
        for j in range(24)
    ]
    knot = things.mesh_object("Knot", corners.tolist(), faces)
    knot.location, knot.rotation_euler = (0.0, 0.0, 1.2), (0.4, 0.1, 0.0)
    knot.data.shade_smooth()
    knot.data.materials.append(things.matt("Clay", 0.7, 0.6, 0.5))
    return knot


def _fence() -> None:
    """Bars of 1 cm, 5 cm apart, that no pixel resolves."""
    _clear()
    known.area()
    corners, faces = [], []
    for k in range(60):
        x, n = -1.5 + 0.05 * k, len(corners)
        corners += [
            (x + a, b, c) for c in (0.0, 1.8) for a, b in ((0, 0), (0.01, 0), (0.005, 0.01))
        ]
        faces += [(n + i, n + (i + 1) % 3, n + 3 + (i + 1) % 3, n + 3 + i) for i in range(3)]
    fence = things.mesh_object("Fence", corners, faces)
    fence.rotation_euler = (0.1, 0.15, 0.3)
    fence.data.materials.append(things.matt("Iron", 0.3, 0.3, 0.35))


def _noisy_box() -> None:
    """An open box of coloured walls with a lump of 80,000 faces and a light under its ceiling."""
    for thing in list(bpy.data.objects):
        if thing.type == "MESH":
            bpy.data.objects.remove(thing)
    bpy.context.scene.camera.location = (0.0, -7.0, 1.5)
    bpy.context.scene.camera.rotation_euler = (math.pi / 2.0, 0.0, 0.0)
    walls = [(-1.5, -1.5, 0), (1.5, -1.5, 0), (1.5, 1.5, 0), (-1.5, 1.5, 0)]
    walls += [(x, y, 3.0) for x, y, _ in walls]
    sides = [(0, 1, 2, 3), (4, 5, 6, 7), (3, 2, 6, 7), (0, 3, 7, 4), (1, 2, 6, 5)]
    box = things.mesh_object("Box", walls, sides)
    for name, *color in (
        ("White", 0.7, 0.7, 0.7),
        ("Red", 0.6, 0.1, 0.1),
        ("Green", 0.1, 0.5, 0.1),
    ):
        box.data.materials.append(things.matt(name, *color))
    box.data.polygons[3].material_index, box.data.polygons[4].material_index = 1, 2
    lump = _standing(
        lambda: bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=7, radius=0.9),
        (0.1, 0.1, 1.1),
        (0.2, 0.3, 0.4),
    )
    places = np.array([v.co[:] for v in lump.data.vertices])
    bumps = np.sin(9 * places).prod(1) + 0.4 * np.sin(31 * places).prod(1)
    lump.data.vertices.foreach_set("co", (places * (1.0 + 0.25 * bumps[:, None])).ravel())
    lump.data.shade_smooth()
    lamp = things.light("AREA", energy=40.0, shape="SQUARE", size=0.8)
    lamp.location = (0.0, 0.0, 2.95)


def _bowl() -> Any:
    """The lower half of a ball, whose faces are turned over."""
    _clear()
    known.area()
    bowl = _standing(
        lambda: bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1.4),
        (0.0, 0.0, 1.6),
        (0.3, 0.2, 0.0),
    )
    import bmesh

    work = bmesh.new()
    work.from_mesh(bowl.data)
    bmesh.ops.delete(work, geom=[v for v in work.verts if v.co.z > 0.01], context="VERTS")
    bmesh.ops.reverse_faces(work, faces=work.faces)
    work.to_mesh(bowl.data)
    work.free()
    bowl.data.shade_smooth()
    return bowl


def _moves(make: Callable[[], Any], path: str, *values: tuple[float, ...]) -> None:
    thing = make()
    things.keyed(thing, path, *values)
    _blur()
    bpy.context.scene.frame_set(6)


MESHES: dict[str, Callable[[], Any]] = {
    "Suzanne, 126,000 faces, softbox": _suzanne,
    "torus knot under a sun": _knot,
    "thin fence": _fence,
    "box with a noisy mesh": _noisy_box,
    "open bowl, inverted normals": _bowl,
    "bowl that moves": lambda: _moves(_bowl, "location", (-4.0, 0.0, 1.6), (4.0, 0.0, 2.6)),
    "torus knot that turns": lambda: _moves(
        _knot, "rotation_euler", (0.0, 0.0, -3.0), (1.0, 0.0, 3.0)
    ),
    "Suzanne that grows": lambda: _moves(_suzanne, "scale", (0.3, 0.4, 0.5), (1.5, 1.6, 1.2)),
    "cube that grows": known.SCENES["growing cube"],
    "fan before the camera": known.SCENES["turning fan"],
    "coarse smooth head": known.SCENES["monkey before an area"],
    "coarse smooth head in a world": known.SCENES["monkey in a world"],
}


def moving_light(name: str) -> None:
    """A scene of LIGHTS whose light moves; the sun, which has no place, lights a ball that does."""
    before = set(bpy.data.objects)
    LIGHTS[name]()
    made = next(iter(set(bpy.data.objects) - before))
    if made.type == "LIGHT" and made.data.type == "SUN":
        made = bpy.data.objects["B"]
    _move(made)
