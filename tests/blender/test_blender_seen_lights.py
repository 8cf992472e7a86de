# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that the camera sees: the picture is Cycles' to within Cycles' noise."""

from __future__ import annotations

import importlib
import math

import bpy
import numpy as np
import pytest
import things

NOISE = 1.6
"""Allowed difference from Cycles, in units of its noise at 1,024 samples, root mean squares. Under
motion pictures of two seeds have a part of their noise in common: the difference was 1.4 times what
theirs shows, and fell with the number of samples, as noise does ..."""
OWN_ERROR = 2e-3
"""... and beside that as a fraction of the mean: polygons for balls, and the own tolerance."""
BIAS, SIGMAS = 1e-3, 2.0
"""Allowed relative difference of the means, or in units of the noise of Cycles' mean."""


@pytest.fixture
def stage(file, addon):
    pytest.importorskip("embreex")
    importlib.import_module(f"{addon.__name__}.adaptive_drt.render")
    return things.balls_on_a_floor(
        (48, 32),
        3.0,
        76.0,
        (("A", (-1.5, 0.0, 0.8), 0.8), ("B", (1.4, 0.5, 1.0), 1.0)),
        128,
    )


def _seen(lamp, place, turn=(0.0, 0.0, 0.0)):
    lamp.location, lamp.rotation_euler, lamp.visible_camera = place, turn, True
    return lamp


def _area(shape="RECTANGLE", turn=(-1.2, 0.2, 0.3)):
    lamp = things.light("AREA", energy=100.0, shape=shape, size=1.6, size_y=0.8)
    return _seen(lamp, (-1.2, 1.2, 2.0), turn)


def _point(soft=True, place=(0.1, 1.2, 2.2)):
    lamp = things.light("POINT", energy=60.0, shadow_soft_size=0.4, use_soft_falloff=soft)
    return _seen(lamp, place)


def _spot(soft=True, blend=1.0):
    lamp = things.light(
        "SPOT", energy=200.0, shadow_soft_size=0.5, use_soft_falloff=soft, spot_size=1.0,
        spot_blend=blend,
    )  # fmt: skip
    return _seen(lamp, (0.7, 2.0, 2.6), (-1.6, 0.0, 0.25))


def _sun():
    lamp = things.light("SUN", energy=2.0, angle=0.2)
    return _seen(lamp, (0.0, 0.0, 0.0), (-1.5, 0.0, 0.1))


def _world():
    world = bpy.context.scene.world = bpy.data.worlds.new("Grey")
    world.use_nodes = True
    node = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    node.inputs["Color"].default_value = (0.1, 0.2, 0.3, 1.0)


def _moving(*_):
    """A ball and the camera move; Cycles does not move lamps within a frame."""
    things.keyed(bpy.data.objects["B"], "location", (1.4, 0.5, -2.0), (1.4, 0.5, 4.0))
    camera = bpy.context.scene.camera
    things.keyed(camera, "location", (-0.5, -9.0, 3.0), (0.5, -9.0, 3.0))
    bpy.context.scene.render.use_motion_blur = True
    bpy.context.scene.render.motion_blur_shutter = 1.0
    bpy.context.scene.frame_set(6)


def _all():
    _world()
    return [_area(), _point(), _spot(), _sun()]


SCENES = {
    "area": _area,
    "area from behind": lambda: _area(turn=(1.2, 0.2, 0.3)),
    "ellipse": lambda: _area("ELLIPSE"),
    "disk": lambda: _area("DISK"),
    "soft point": _point,
    "ball": lambda: _point(False),
    "spot": _spot,
    "spot that is a ball": lambda: _spot(False, 0.4),
    "sun": _sun,
    "lights before each other and a world": _all,
    "area, moving": lambda: _moving(_area()),
    "all, moving": lambda: _moving(*_all()),
}
QUICK = ("lights before each other and a world",)


def picture(name="Adaptive Render"):
    image = bpy.data.images[name]
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    return flat.reshape(image.size[1], image.size[0], 4)


@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=() if k in QUICK else pytest.mark.slow) for k in SCENES]
)
def test_agrees_with_cycles(stage, tmp_path, kind):
    from peer import render_cycles

    SCENES[kind]()
    stage.adaptive_drt.tolerance = 0.001
    bpy.ops.adaptive_drt.render()
    ours = picture()[..., :3]
    assert_agrees(ours, [render_cycles(tmp_path, 512, seed) for seed in (0, 1)])


def assert_agrees(ours, theirs):
    """With the mean of two pictures, to within the noise that their difference shows."""
    mean = (theirs[0] + theirs[1]) / 2.0
    noise = rms(theirs[0] - theirs[1]) / 2.0
    difference = rms(ours - mean)
    told = f"{difference:.5f} {noise:.5f} {mean.mean():.5f} {ours.mean() / mean.mean() - 1.0:.6f}"
    assert difference < NOISE * noise + OWN_ERROR * mean.mean(), told
    own = SIGMAS * noise / math.sqrt(mean.shape[0] * mean.shape[1])
    assert ours.mean() == pytest.approx(mean.mean(), rel=BIAS, abs=own), told


def rms(a):
    return math.sqrt((a * a).mean())


def _glow(name, strength=6.0, node="ShaderNodeEmission"):
    return things.material(name, node, Color=(1.0, 0.7, 0.4, 1.0), Strength=strength)


def _shining_ball(place=(0.2, -0.4, 2.4)):
    ball = things.uv_sphere("Glow", 0.4, segments=128, rings=64)
    ball.data.shade_smooth()
    ball.location = place
    ball.data.materials.append(_glow("Glow"))
    return ball


def _shining_plane():
    plane = things.plane("Panel", size=1.0)
    plane.location, plane.rotation_euler, plane.scale = (
        (0.3, 1.0, 2.2),
        (1.1, 0.4, 0.2),
        (1.5, 1, 1),
    )
    plane.data.materials.append(_glow("Panel"))
    return plane


def _shining_face(*corners):
    """One face of corners (x, y), tilted, over the balls."""
    face = things.mesh_object("Face", [(*c, 0.0) for c in corners], [tuple(range(len(corners)))])
    face.location, face.rotation_euler = (0.3, -0.4, 2.6), (0.5, 0.3, 0.2)
    face.data.materials.append(_glow("Face"))
    return face


def _shining_disk(sides=32):
    turns = 2.0 * math.pi * np.arange(sides) / sides
    return _shining_face(*zip(0.7 * np.cos(turns), 0.7 * np.sin(turns), strict=True))


def _shining_principled():
    ball = _shining_ball()
    ball.data.materials[0] = things.material(
        "Both", Base_Color=(0.2, 0.5, 0.8, 1.0), Specular_IOR_Level=0.0,
        Emission_Color=(1.0, 0.7, 0.4, 1.0), Emission_Strength=1.0, Roughness=1.0,
    )  # fmt: skip
    _overhead()


def _overhead():
    lamp = things.light("AREA", "Overhead", energy=200.0, size=1.0)
    lamp.location, lamp.visible_camera = (-1.0, -2.0, 5.0), False
    return lamp


def _blurred(thing, way=(1.2, 0.0, 0.4)):
    at = np.array(thing.location)
    things.keyed(thing, "location", at - way, at + way)
    _moving()


def _unseen():
    _overhead()
    bpy.data.objects["A"].visible_camera = False
    bpy.data.objects["B"].visible_shadow = False


def _linked(name, *members, state="INCLUDE"):
    inside = bpy.data.collections.new(name)
    for member in members:
        inside.objects.link(bpy.data.objects[member])
    for entry in inside.collection_objects:
        entry.light_linking.link_state = state
    return inside


def _links():
    lamp, ball = _overhead(), _shining_ball()
    lamp.light_linking.receiver_collection = _linked("Lit", "A", state="EXCLUDE")
    lamp.light_linking.blocker_collection = _linked("Blocking", "A")
    ball.light_linking.receiver_collection = _linked("Near", "A", "B")


def _spread(degrees, shape="RECTANGLE", seen=False):
    lamp = _area(shape, (0.2, -0.3, 0.1))
    lamp.data.spread, lamp.location = math.radians(degrees), (-0.5, -0.5, 4.0)
    if seen:
        lamp.location, lamp.rotation_euler = (-1.2, 1.2, 2.0), (-1.4, 0.2, 0.3)


SHINING = {
    "spread of 120 degrees": lambda: _spread(120.0),
    "spread of 40 degrees": lambda: _spread(40.0),
    "spread of 8 degrees": lambda: _spread(8.0),
    "ellipse of a spread of 60 degrees": lambda: _spread(60.0, "ELLIPSE"),
    "seen of a spread of 70 degrees": lambda: _spread(70.0, seen=True),
    "ball that shines": _shining_ball,
    "plane that shines": _shining_plane,
    "triangle that shines": lambda: _shining_face((-0.8, -0.5), (0.9, -0.6), (0.0, 0.8)),
    "arrow that shines": lambda: _shining_face(
        (-0.8, -0.4), (0.0, -0.1), (0.8, -0.4), (0.3, 0.1), (0.0, 0.8), (-0.3, 0.1)
    ),
    "disk that shines": _shining_disk,
    "disk that shines and moves": lambda: _blurred(_shining_disk()),
    "Principled that shines, and a lamp": _shining_principled,
    "ball that shines and moves": lambda: _blurred(_shining_ball()),
    "plane that shines and moves": lambda: _blurred(_shining_plane()),
    "Ray Visibility": _unseen,
    "light linking": _links,
}


@pytest.mark.parametrize(
    "kind",
    [pytest.param(k, marks=() if k == "light linking" else pytest.mark.slow) for k in SHINING],
)
def test_what_shines_agrees_with_cycles(stage, tmp_path, kind):
    from peer import render_cycles

    SHINING[kind]()
    stage.adaptive_drt.tolerance = 0.001
    bpy.ops.adaptive_drt.render()
    ours = picture()[..., :3]
    assert_agrees(ours, [render_cycles(tmp_path, 512, seed) for seed in (0, 1)])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(30))
def test_random_lights_agree_with_cycles(stage, tmp_path, seed):
    from peer import render_cycles
    from random_lights import add_random_lights

    add_random_lights(np.random.default_rng(seed))
    stage.adaptive_drt.tolerance = 0.003
    bpy.ops.adaptive_drt.render()
    ours = picture()[..., :3]
    theirs = [render_cycles(tmp_path, 1024, each) for each in (0, 1)]
    if theirs[0].any():
        assert_agrees(ours, theirs)
    else:
        assert not ours.any()
