# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes that people build of planes."""

from __future__ import annotations

import importlib
import math

import bpy
import numpy as np
import things


def test_six_planes_around_a_cube_are_one_box_to_the_tracer(export, core):
    """Turned by hand and by a parent: float32 rounds their corners, each in its own way."""
    parent = things.link(bpy.data.objects.new("Pivot", None))
    parent.rotation_euler, parent.location, parent.scale = (0.3, -0.4, 1.1), (2, -1, 3), (0.7,) * 3
    half = math.pi / 2.0
    for place, turn in (
        ((0, 0, 1), (0, 0, 0)),
        ((0, 0, -1), (math.pi, 0, 0)),
        ((1, 0, 0), (0, half, 0)),
        ((-1, 0, 0), (0, -half, 0)),
        ((0, 1, 0), (-half, 0, 0)),
        ((0, -1, 0), (half, 0, 0)),
    ):
        side = things.plane()
        side.location, side.rotation_euler, side.parent = place, turn, parent
    things.light("POINT", energy=100.0).location = (0.0, 0.0, 9.0)
    things.plane("Floor", size=20.0)
    scene = export()
    root = core.__package__.rpartition(".")[0]
    plan, settings = (
        importlib.import_module(f"{root}.{name}") for name in ("tracing.compile", "scene.settings")
    )
    solid = plan.make_plan(scene, settings.Settings(threads=1)).shapes.solid
    assert sorted(np.unique(solid, return_counts=True)[1]) == [1, 6]
