# SPDX-License-Identifier: GPL-3.0-or-later
"""Records of lights: what is wrong with them, and brighter ones."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from adaptive_drt.scene.light_records import (
    DiskLight,
    EllipseLight,
    PointLight,
    QuadLight,
    SkyLight,
    SphereLight,
    SpotLight,
    SunLight,
)

WHITE = (1.0, 0.5, 0.25)
GOOD = (
    QuadLight((0.0, 0.0, 4.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), WHITE),
    SphereLight((0.0, 0.0, 4.0), 0.5, WHITE),
    DiskLight((0.0, 0.0, 4.0), 0.5, WHITE),
    PointLight((0.0, 0.0, 4.0), WHITE),
    SunLight((0.0, 0.0, -4.0), WHITE),
    SkyLight(WHITE),
    SpotLight((0.0, 0.0, 4.0), (0.0, 0.0, -1.0), WHITE, 0.7, 0.3, 0.2),
    EllipseLight((0.0, 0.0, 4.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), WHITE),
)
EACH = pytest.mark.parametrize("light", GOOD, ids=lambda light: type(light).__name__)


@EACH
@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf, 1e31])
def test_numbers_are_finite(light, number):
    assert light.defect() is None
    for field in fields(light):
        value = getattr(light, field.name)
        if isinstance(value, tuple):
            for k in range(3):
                broken = tuple(number if i == k else x for i, x in enumerate(value))
                assert field.name in (replace(light, **{field.name: broken}).defect() or "")
        elif type(value) is float:
            assert field.name in (replace(light, **{field.name: number}).defect() or "")


def test_suns_have_a_direction_and_an_angle_up_to_pi():
    sun = GOOD[4]
    assert "direction" in (replace(sun, direction=(0.0, 0.0, 0.0)).defect() or "")
    for angle in (-0.1, 3.2):
        assert "angle" in (replace(sun, angle=angle).defect() or "")
    assert replace(sun, angle=math.pi).defect() is None


def test_spots_have_a_cone():
    spot = GOOD[6]
    assert "direction" in (replace(spot, direction=(0.0, 0.0, 0.0)).defect() or "")
    for angle in (0.0, -0.1, 3.2):
        assert "angle" in (replace(spot, angle=angle).defect() or "")
    for blend in (-0.1, 1.1):
        assert "blend" in (replace(spot, blend=blend).defect() or "")
    assert replace(spot, angle=math.pi, blend=0.0, radius=0.0).defect() is None


@EACH
def test_brighter_lights_differ_in_nothing_else(light):
    bright = light.brightened(2.0)
    changed = [f.name for f in fields(light) if getattr(light, f.name) != getattr(bright, f.name)]
    assert len(changed) == 1 and getattr(bright, changed[0]) == (2.0, 1.0, 0.5)
