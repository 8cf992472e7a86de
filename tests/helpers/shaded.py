# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a floor under a light, the patches around them, and the light at places of a patch."""

from __future__ import annotations

import numpy as np

from adaptive_drt.scene.description import Quad, Scene
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.footprint import make_patch
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import intersect_pairs, surface
from random_scenes import look_at

FLOOR = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
EYE = look_at((0.4, -7.0, 5.0), (0.0, 0.0, 0.0), resolution=(200, 150))


def plan_of(*shapes, light, eye=EYE):
    """A plan of shapes before a floor, which is its last object."""
    return make_plan(Scene(eye, (*shapes, FLOOR), (light,)), Settings(threads=1))


def hits_at(plan, x, y, item, time=0.0):
    """Directions, ray parameters and surface points of one object through x, y; all must hit."""
    w = plan.lens.directions(x, y)
    items = np.broadcast_to(np.asarray(item), x.shape)
    t = intersect_pairs(plan, w[:, :, None], items, np.full((x.size, 1), time))[:, 0]
    assert np.isfinite(t).all()
    return w, t, surface(plan, w, t, items, np.full(x.size, time))


def patches_at(plan, x, y, item, half):
    """Surface points and patches of boxes of half extents (3,) about x, y and mid-shutter."""
    w, t, hits = hits_at(plan, x, y, item)
    halves = np.repeat(np.array(half, dtype=float)[:, None], x.size, axis=1)
    return hits, make_patch(plan, w, t, hits, halves)
