# SPDX-License-Identifier: GPL-3.0-or-later
"""The bound on memory holds, and grows with what a render is made of."""

from dataclasses import replace

import pytest

from adaptive_drt.image.memory_bound import memory_bound
from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from random_scenes import random_scene


@pytest.mark.parametrize("method", ["EXACT", "RAYS"])
def test_a_render_stays_below_its_bound(method):
    memory = render_image(random_scene(2), Settings(method=method, threads=1)).stats["memory"]
    assert memory["bound_megabytes"] > (memory["peak_megabytes"] or 0.0)


def test_the_bound_grows_with_pixels_and_workers():
    plan = make_plan(random_scene(2), Settings(threads=2))
    width, height = 3840, 2160
    large = replace(plan, resolution=(width, height), region=(0, 0, width, height))
    assert memory_bound(large, 1) > memory_bound(large, 0) > memory_bound(plan, 0)
