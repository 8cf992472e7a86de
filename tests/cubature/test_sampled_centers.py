# SPDX-License-Identifier: GPL-3.0-or-later
"""Light at the centres of pixels does not depend on how they are batched."""

import numpy as np

from adaptive_drt.cubature import sampled_centers as module
from adaptive_drt.cubature.sampled_centers import CenterTask, sample_centers
from adaptive_drt.scene.description import Material, Quad, QuadLight, Scene
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.occluder_culling import Occluders
from mesh_shapes import ball_mesh
from random_scenes import look_at

FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.7, 0.6)))
LAMP = QuadLight((1.0, -1.0, 5.0), (0.9, 0.0, 0.0), (0.0, -0.6, 0.0), (12.0, 11.0, 9.0))
CAMERA = look_at((0.5, -6.0, 3.5), (0.0, 0.0, 0.5), resolution=(24, 16))


def test_batches_do_not_matter(monkeypatch):
    plan = make_plan(Scene(CAMERA, (FLOOR, ball_mesh(20, 14)), (LAMP,)), Settings())
    x, y = (each.ravel() for each in np.meshgrid(np.arange(24), np.arange(10)))
    floor = np.zeros(x.size, dtype=np.int64)
    limit = np.full(x.size, 2e-3)
    task = CenterTask(x + 0.5, y + 0.5, y * 24 + x, floor, limit)
    occluders = Occluders(plan)
    whole = sample_centers(plan, occluders, task)
    assert (whole.samples == 1).all() and 0.0 < whole.light.spread.max() <= 2e-3
    monkeypatch.setattr(module, "CENTERS_PER_CHUNK", 37)
    parts = sample_centers(plan, occluders, task)
    for name in ("color", "unhidden", "spread", "unseen", "visibility"):
        np.testing.assert_array_equal(getattr(parts.light, name), getattr(whole.light, name))
