# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance and intensity of lights, against their power found again by integration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import integrate

from adaptive_drt.scene.units import area_radiance, light_power, point_intensity, sphere_radiance

POWER = (10.0, 0.5, -3.0)


def exitance(radiance):
    """Power that a unit area of a Lambertian surface emits: radiance times cosine, integrated."""
    whole = integrate.quad(lambda a: math.cos(a) * 2.0 * math.pi * math.sin(a), 0.0, math.pi / 2)
    return np.array(radiance) * whole[0]


@pytest.mark.parametrize("area", [1e-4, 1.0, 37.0])
def test_area_lights_emit_their_power_on_one_side(area):
    np.testing.assert_allclose(exitance(area_radiance(POWER, area)) * area, POWER, rtol=1e-12)


@pytest.mark.parametrize("radius", [1e-3, 1.0, 5.0])
def test_spherical_lights_emit_their_power_and_have_the_intensity_of_a_point(radius):
    radiance = sphere_radiance(POWER, radius)
    np.testing.assert_allclose(exitance(radiance) * 4.0 * math.pi * radius**2, POWER, rtol=1e-12)
    intensity = np.array(radiance) * math.pi * radius**2
    np.testing.assert_allclose(intensity, point_intensity(POWER), rtol=1e-12)


def test_points_emit_their_power_over_all_directions():
    np.testing.assert_allclose(np.array(point_intensity(POWER)) * 4.0 * math.pi, POWER, rtol=1e-12)


def test_strengths_do_not_depend_on_size():
    want = np.array(POWER) / math.pi
    for found in (
        area_radiance(POWER, 4.0, False),
        sphere_radiance(POWER, 0.1, False),
        point_intensity(POWER, False),
    ):
        np.testing.assert_allclose(found, want, rtol=1e-12)


def test_power_is_energy_times_colours_and_stops():
    assert light_power(3.0, (1.0, 0.5, 0.0)) == (3.0, 1.5, 0.0)
    assert light_power(3.0, (1.0, 0.5, 0.25), 2.0) == (12.0, 6.0, 3.0)
    assert light_power(-2.0, (1.0, 1.0, 1.0), -1.0, (0.5, 1.0, 2.0)) == (-0.5, -1.0, -2.0)
