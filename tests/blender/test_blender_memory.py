# SPDX-License-Identifier: GPL-3.0-or-later
"""Nothing of a render is kept until the next one, but its pictures."""

from __future__ import annotations

import gc
import importlib
import resource
import sys
import weakref
from pathlib import Path

import bpy
import pytest
import things

CLICKS, FIRST = 300, 100
"""Renders in all, and those after which memory has to have settled."""

GROWTH = 8 * 2**20
"""Octets that the process may grow by in the renders after the first ones.

It grew by 0.3 MB in 200 renders of 200 x 150 pixels, and by 17 to 35 MB while films waited for
Python's collector of cycles: that counts objects, and does not know how large they are.
"""

PAGE = resource.getpagesize()


@pytest.fixture
def still(file):
    """A ball on a floor under an area light."""
    things.uv_sphere().location.z = 1.0
    things.plane("Floor", 6.0)
    things.light("AREA", energy=500.0, size=1.0).location.z = 5.0
    return bpy.context.scene


@pytest.fixture
def uncollected():
    """Python's collector of cycles is off."""
    gc.collect()
    gc.disable()
    yield
    gc.enable()


def _button(_scene):
    bpy.ops.adaptive_drt.render()


def _engine(scene):
    scene.render.engine = "ADAPTIVE_DRT"
    bpy.ops.render.render()


@pytest.mark.parametrize("name, render", [("render", _button), ("engine", _engine)])
def test_a_job_ends_with_its_render(addon, still, uncollected, monkeypatch, name, render):
    """No reference cycle holds it, and with it the film."""
    module = importlib.import_module(f"{addon.__name__}.operators.{name}")
    make, made = module.Job, []

    def recorded(*arguments, **options):
        job = make(*arguments, **options)
        made.append(weakref.ref(job))
        return job

    monkeypatch.setattr(module, "Job", recorded)
    render(still)
    assert len(made) == 1 and made[0]() is None


def _resident():
    """Octets of this process in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="/proc tells how large the process is")
def test_many_renders_do_not_grow(still):
    still.render.resolution_x, still.render.resolution_y = 200, 150
    for number in range(CLICKS):
        if number == FIRST:
            before = _resident()
        bpy.ops.adaptive_drt.render()
    assert _resident() - before < GROWTH
