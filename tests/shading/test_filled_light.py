# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows and slits of light that are thinner than pixels, between the centres of two rows."""

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Material, Quad, QuadLight, Scene
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading import filled_light
from mesh_shapes import mesh_of
from random_scenes import look_at

PITCH, ROWS = 0.09, (0.0112, 0.0225)
"""Size of a pixel on the floor seen from 4 m, and places of shadows between two rows, metres."""
FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.8, 0.8)))


def column(bars, tolerance, height, size):
    """Mean radiance (rows,) of the columns of a picture, over that without shadows.

    bars : lowest and highest y of bars along the rows, a metre above the floor.
    height : of the camera, metres.  size : half a side of the light, metres.
    """
    x, z = 6.0 * np.array([-1.0, 1.0, 1.0, -1.0]), np.ones(4)
    parts = [np.array([x, (low, low, high, high), z]) for low, high in bars]
    faces = [np.array([(0, 1, 2), (0, 2, 3)]).T + 4 * k for k in range(len(bars))]
    mesh = mesh_of(np.concatenate(parts, axis=1), np.concatenate(faces, axis=1))
    lamp = QuadLight((0.0, 3.0, 3.0), (size, 0.0, 0.0), (0.0, -size, 0.0), (2.25 / size**2,) * 3)
    camera = look_at((0.0, -1e-3, height), (0.0, 0.0, 0.0), resolution=(32, 24))
    settings = Settings(tolerance=tolerance, threads=1)
    shadowed, whole = (
        render_image(Scene(camera, shapes, (lamp,), (0.1, 0.1, 0.1)), settings).color[0]
        for shapes in ((FLOOR, mesh), (FLOOR,))
    )
    return (shadowed / whole).mean(axis=1)


@pytest.mark.parametrize("offset", ROWS)
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_a_shadow_between_rows_of_centres_is_met(offset, tolerance):
    dark = 1.0 - column([(1.2 + offset, 1.23 + offset)], tolerance, 4.0, 0.05)
    # shadows are 1.5 times as wide as bars
    assert abs(dark.sum() - 0.045 / PITCH) < 10.0 * tolerance


@pytest.mark.parametrize("offset", ROWS)
def test_a_slit_of_light_between_rows_of_centres_is_met(offset):
    scale = 0.9 / 4.0
    low = 1.0 + scale * (0.2 + offset)
    lit = column([(-6.0, low), (low + scale * 0.03, 6.0)], 1e-2, 0.9, scale * 0.05)
    assert abs(lit.sum() - 0.045 / PITCH) < 0.05


def test_rays_of_a_pixel_start_at_places_of_their_own(monkeypatch):
    """Eight places, spread over the square that the pixel shows of the floor."""
    starts = []
    own = filled_light._starts
    monkeypatch.setattr(
        filled_light, "_starts", lambda *each: starts.append(own(*each)) or starts[-1]
    )
    column([(1.2 + ROWS[0], 1.23 + ROWS[0])], 1e-2, 4.0, 0.05)
    hits, pixel = starts[0]
    places = hits.point[:2, pixel == 0]
    assert places.shape[1] == filled_light.FIRST_RAYS
    assert 0.5 * PITCH < np.ptp(places, axis=1).min() <= np.ptp(places, axis=1).max() < 1.1 * PITCH
