# SPDX-License-Identifier: GPL-3.0-or-later
"""A floor under a quad light, where something moves, and the values at pixel centres there."""

from __future__ import annotations

import numpy as np

from adaptive_drt.cubature.error_budget import Goal
from adaptive_drt.image.frame import Frame, widened_plan
from adaptive_drt.image.node_values import NodeValues
from adaptive_drt.scene.description import Quad, QuadLight, Scene
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from random_scenes import look_at

FLOOR = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))


LAMP = QuadLight((-1.0, -1.0, 4.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (9.0, 8.0, 7.0))


def moving_scene(shapes, size=(96, 64)):
    eye = look_at((0.0, -7.0, 3.0), (0.0, 0.0, 0.5), resolution=size)
    return Scene(eye, (*shapes, FLOOR), (LAMP,))


def points_of(function):
    """Points of a frame in which all moves, sees the same and is known: `function` of x and y."""
    plan = make_plan(moving_scene([]), Settings())
    frame = Frame(widened_plan(plan, plan.region), plan.region)
    found = NodeValues(frame, Goal(1.0, 1.0))
    y, x = np.divmod(np.arange(frame.item.size), frame.width)
    found.value[:] = function(x, y)
    found.known[:] = True
    found.wanted = frame.inner()
    frame.visibility_key = np.ones(frame.item.size, dtype=np.int64)
    found.remaining_steps = np.zeros(frame.item.size)
    found.predicted_deviation = lambda spacing: found.remaining_steps
    return found


def settled(level):
    assert level.missing_pixels().size == 0
    level.settle()
    frame = level.points.frame
    return frame.settled.reshape(frame.height, frame.width)
