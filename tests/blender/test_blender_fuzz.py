# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender scenes of any numbers at all: each renders to finite images, or a message says why."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import bpy
import numpy as np
import pytest
import things
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st


def mostly(usual, odd):
    """One time in ten the odd."""
    return st.integers(0, 9).flatmap(lambda k: odd if k == 5 else usual)


TAME = st.sampled_from((0.0, 0.5, 1.0, -1.0, 2.0, -3.0)) | st.floats(-4.0, 4.0)
WILD = st.floats(width=32, allow_nan=False, allow_infinity=False)
BROKEN = st.sampled_from((float("nan"), float("inf"), float("-inf"), 1e-45, 3.4e38))
NUMBER = st.one_of(*[TAME] * 8, WILD, BROKEN)
"""What Blender keeps in its float32 properties: mostly ordinary, some broken."""
PLACE = st.tuples(TAME, TAME, TAME)
VECTOR = mostly(PLACE, st.tuples(NUMBER, NUMBER, NUMBER))
SCALE = mostly(st.sampled_from(((1.0, 1.0, 1.0), (2.0, 2.0, 2.0))), VECTOR)
SIZE = mostly(st.floats(0.1, 3.0), NUMBER)


COARSE = 0.1
"""Tolerance: lights of 15 m that stand in moving walls take minutes to a thousandth, and it is no
number's fault."""


@dataclass
class Thing:
    """An object to be made: what, where, how, and whether it moves, to where."""

    kind: str
    location: tuple
    rotation: tuple
    scale: tuple
    size: float
    energy: float
    key: tuple | None
    parented: bool
    color: tuple


KINDS = "uv uv ico plane plane grid mesh empty AREA AREA POINT POINT SUN SPOT".split()
THING = st.builds(
    Thing,
    st.sampled_from(KINDS),
    VECTOR,
    VECTOR,
    SCALE,
    SIZE,
    mostly(st.floats(0.0, 1000.0), NUMBER),
    st.none() | VECTOR,
    mostly(st.just(False), st.just(True)),
    st.tuples(TAME, TAME, TAME),
)


@dataclass
class File:
    """A Blender file to be made, its camera and its shutter."""

    things: list
    camera: Thing | None
    lens: float
    shift: tuple
    aspect: tuple
    size: tuple
    shutter: float | None
    frame: int
    transparent: bool


FILE = st.builds(
    File,
    st.lists(THING, min_size=2, max_size=7),
    mostly(st.none(), THING),
    mostly(st.floats(10.0, 200.0), NUMBER),
    mostly(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2)), st.tuples(NUMBER, NUMBER)),
    mostly(st.just((1.0, 1.0)), st.tuples(NUMBER, NUMBER)),
    st.tuples(st.integers(4, 12), st.integers(4, 12)),
    mostly(st.sampled_from((None, 0.0, 0.5, 2.0)), NUMBER),
    st.integers(1, 12),
    st.booleans(),
)


def _object(thing):
    size = thing.size
    if thing.kind == "uv":
        return things.uv_sphere(radius=size)
    if thing.kind == "ico":
        return things.ico_sphere(radius=size)
    if thing.kind in ("plane", "grid"):
        return things.plane(size=size, segments=1 if thing.kind == "plane" else 3)
    if thing.kind == "mesh":
        corners = [thing.location, thing.rotation, thing.scale, thing.color]
        return things.mesh_object("Mesh", corners, [(0, 1, 2, 3)])
    if thing.kind == "empty":
        return things.link(bpy.data.objects.new("Empty", None))
    lamp = things.light(thing.kind, energy=thing.energy)
    lamp.data.color = thing.color
    if thing.kind == "AREA":
        lamp.data.size = size
    else:
        lamp.data.shadow_soft_size = size
    return lamp


def _place(thing, made):
    made.location, made.rotation_euler, made.scale = thing.location, thing.rotation, thing.scale
    if thing.key is not None:
        things.keyed(made, "location", thing.location, thing.key)


def _build(file):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.frame_set(file.frame)
    camera = things.link(bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
    camera.location = (0.0, 0.0, 10.0)
    if file.camera is not None:
        _place(file.camera, camera)
    camera.data.lens = file.lens
    camera.data.shift_x, camera.data.shift_y = file.shift
    scene.camera = camera
    parent = camera
    for thing in file.things:
        made = _object(thing)
        _place(thing, made)
        if thing.parented:
            made.parent = parent
        parent = made
    render = scene.render
    render.resolution_x, render.resolution_y = file.size
    render.pixel_aspect_x, render.pixel_aspect_y = file.aspect
    render.film_transparent = file.transparent
    if file.shutter is not None:
        render.use_motion_blur = True
        render.motion_blur_shutter = file.shutter
    ours = scene.adaptive_drt
    ours.light_rays = ours.time_rays = ours.pixel_rays = 3
    ours.threads = 1
    ours.tolerance = COARSE


def attempt(file):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _build(file)
        place = bpy.context.scene.frame_current, bpy.context.scene.frame_subframe
        try:
            assert bpy.ops.adaptive_drt.render() == {"FINISHED"}
        except RuntimeError as error:
            # what the operator reports as an error
            assert "camera" in str(error) or "shutter" in str(error), error
            assert "Traceback" not in str(error), error
            return
        for name in ("Adaptive Render", "Adaptive Mask"):
            image = bpy.data.images[name]
            flat = np.empty(len(image.pixels), dtype=np.float32)
            image.pixels.foreach_get(flat)
            assert np.isfinite(flat).all(), name
        now = bpy.context.scene.frame_current, bpy.context.scene.frame_subframe
        assert now == place, "the user's frame"


QUIET = {"deadline": None, "database": None, "suppress_health_check": list(HealthCheck)}


@settings(max_examples=40, derandomize=True, **QUIET)
@given(file=FILE)
def test_any_file(addon, file):
    attempt(file)


@pytest.mark.slow
@settings(max_examples=400, print_blob=True, **QUIET)
@given(file=FILE)
def test_any_file_at_length(addon, file):
    attempt(file)
