# SPDX-License-Identifier: GPL-3.0-or-later
"""Conservative rasters hold all pixels that a polygon meets, and few others."""

import numpy as np
import pytest

from adaptive_drt.geometry.camera import make_pinhole_camera
from adaptive_drt.geometry.mesh import raster
from adaptive_drt.geometry.mesh.raster import PixelWindow, ProjectedPolygons, meeting_pixels
from random_scenes import look_at

CAMERA = make_pinhole_camera(look_at((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), resolution=(40, 30)))
WINDOW = PixelWindow(0, 0, 40, 30)


def points_inside(corners, count, rng):
    """Points (3, n, count) of polygons."""
    share = rng.dirichlet(np.ones(len(corners)), size=(corners[0].shape[1], count))
    return sum(corner[:, :, None] * share[..., k] for k, corner in enumerate(corners))


@pytest.mark.parametrize("corners", [2, 3, 4])
@pytest.mark.parametrize("spread", [0.3, 3.0, 20.0])
def test_no_pixel_is_missed(corners, spread):
    rng = np.random.default_rng(corners)
    middle = rng.normal(size=(3, 60)) * 2.0 - np.array([[0.0], [0.0], [5.0]])
    u, v = spread * rng.normal(size=(2, 3, 60))
    each = [middle, middle + u, middle + u + v, middle + v][:corners]
    polygon, pixel, near, far = meeting_pixels(each, CAMERA, WINDOW)
    found = set(zip(polygon.tolist(), pixel.tolist(), strict=True))
    points = points_inside(each, 400, rng)
    depth = -points[2]
    seen = depth > 1e-3
    assert (depth >= near[:, None] - 1e-9)[seen].all()
    assert (depth <= far[:, None] + 1e-9)[seen].all()
    w = points / np.where(seen, depth, 1.0) - CAMERA.base[:, None, None]
    x, y = (
        np.floor((w * step[:, None, None]).sum(0) / (step * step).sum()).astype(int)
        for step in (CAMERA.right, CAMERA.up)
    )
    inside = seen & (x >= 0) & (x < 40) & (y >= 0) & (y < 30)
    met = set(zip(*(a.tolist() for a in (inside.nonzero()[0], (y * 40 + x)[inside])), strict=True))
    assert met <= found
    if spread == 0.3:
        assert len(found) < 3 * len(met) + 60


def test_a_window_holds_its_pixels():
    window = PixelWindow.around(np.array([3, 7, 5]), np.array([-2, 4, 0]))
    assert window == PixelWindow(3, -2, 5, 7)


@pytest.mark.parametrize("most", [1, 40, 1_000])
def test_parts_of_a_window_hold_all_its_pairs(monkeypatch, most):
    rng = np.random.default_rng(3)
    middle = rng.normal(size=(3, 60)) * 2.0 - np.array([[0.0], [0.0], [5.0]])
    u, v = 0.5 * rng.normal(size=(2, 3, 60))
    polygons = ProjectedPolygons.make([middle, middle + u, middle + v], CAMERA)
    window = PixelWindow(-3, 2, 41, 23)
    whole = sorted(zip(*(each.tolist() for each in polygons.meeting_pixels(window)), strict=True))
    monkeypatch.setattr(raster, "MOST_PAIRS", most)
    found, pixels = [], []
    for part in polygons.parts(window):
        polygon, pixel = polygons.meeting_pixels(part)
        assert pixel.size <= most or part.width * part.height == 1
        found += zip(polygon.tolist(), window.within(part)[pixel].tolist(), strict=True)
        pixels += window.within(part).tolist()
    assert sorted(found) == whole
    assert sorted(pixels) == list(range(window.width * window.height))
