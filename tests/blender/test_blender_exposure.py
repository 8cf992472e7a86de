# SPDX-License-Identifier: GPL-3.0-or-later
"""Exposure of the film multiplies all light, as in Cycles."""

from __future__ import annotations

import addon_utils
import bpy
import numpy as np
import pytest
import things

NOISE = 0.01
"""Relative, of Cycles' 256 samples over a picture of 8 x 8."""


@pytest.fixture
def stage(file):
    floor = things.plane("Floor", size=40.0)
    floor.data.materials.append(things.material("Matt", "ShaderNodeBsdfDiffuse", Roughness=0.0))
    for name, settings in (("Soft", {"shadow_soft_size": 0.5}), ("Sharp", {})):
        lamp = things.light("POINT", name, energy=500.0, **settings)
        lamp.location, lamp.visible_camera = (1.0, 1.0, 5.0), False
    lamp = things.light("AREA", "Area", energy=500.0, size=2.0)
    lamp.location.z, lamp.visible_camera = 5.0, False
    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    return bpy.context.scene


def _strength(light):
    return light.intensity if hasattr(light, "intensity") else light.radiance


def test_all_light_is_multiplied(stage, export):
    before = export()
    stage.cycles.film_exposure = 2.5
    after = export()
    assert after.background == pytest.approx([2.5 * c for c in before.background])
    assert len(after.lights) == 4 and any(before.background)
    for one, other in zip(before.lights, after.lights, strict=True):
        assert _strength(other) == pytest.approx([2.5 * c for c in _strength(one)])


def test_an_exposure_that_is_keyed(stage, rendered):
    """A render's own copy has it: the scene that a person sees stays as it was."""
    for frame, exposure in ((1, 1.0), (3, 2.0)):
        stage.cycles.film_exposure = exposure
        stage.cycles.keyframe_insert("film_exposure", frame=frame)
    first, _, last = (scene.background[0] for scene in rendered(1, 3))
    assert last == pytest.approx(2.0 * first)


def test_without_cycles_there_is_no_exposure(stage, export):
    """Cycles is an add-on: its settings go with it, and come back."""
    stage.cycles.film_exposure = 2.0
    exposed = export().background
    addon_utils.disable("cycles")
    try:
        assert not hasattr(stage, "cycles")
        found = export()
    finally:
        addon_utils.enable("cycles")
    assert exposed == pytest.approx([2.0 * c for c in found.background]) and any(exposed)
    assert export().background == exposed


def test_cycles_agrees(stage, tmp_path):
    from peer import render_cycles

    stage.world = None
    stage.cycles.film_exposure = 1.7
    bpy.ops.adaptive_drt.render()
    image = bpy.data.images["Adaptive Render"]
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    ours = flat.reshape(-1, 4)[:, :3].mean()
    assert ours == pytest.approx(render_cycles(tmp_path, samples=256).mean(), rel=NOISE)
