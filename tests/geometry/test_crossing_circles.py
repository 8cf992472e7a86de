# SPDX-License-Identifier: GPL-3.0-or-later
"""Arcs of the circles that cross, against those of all pairs of circles."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.crossing_circles import open_circles_integral
from adaptive_drt.geometry.silhouettes import CircularSilhouette, Hemisphere
from adaptive_drt.geometry.spherical_curves import make_antiderivative, make_circles
from adaptive_drt.lights import occluded_form_factor
from adaptive_drt.lights.occluded_form_factor import visible_factor
from circle_outlines import KINDS, POINTS, outlines, unit


@pytest.mark.parametrize("faces", [0, 2])
@pytest.mark.parametrize("round_light", [False, True])
@pytest.mark.parametrize("k", [1, 2, 3, 13, 40])
@pytest.mark.parametrize("kind", KINDS)
def test_it_is_the_integral_over_all_pairs(monkeypatch, kind, k, round_light, faces):
    if kind == "touching" and k < 2:
        return
    rng = np.random.default_rng([k, faces])
    normal, balls = unit(rng, POINTS), outlines(rng, kind, k)
    corner, a, b = rng.normal(size=(3, faces, 3, POINTS))
    polygons = np.stack([corner, corner + a, corner + a + b, corner + b], axis=1)
    half = np.full(POINTS, 1.0)
    light = CircularSilhouette(unit(rng, POINTS), np.cos(half), np.sin(half))
    found = []
    for least in (1, 1_000):
        monkeypatch.setattr(occluded_form_factor, "CROSSING_CIRCLES", least)
        silhouette = light if round_light else Hemisphere()
        found.append(visible_factor(silhouette, normal, balls, polygons))
    assert found[0] == pytest.approx(found[1], abs=1e-12)


def test_points_do_not_depend_on_each_other(monkeypatch):
    rng = np.random.default_rng(5)
    normal, (v, r) = unit(rng, POINTS), outlines(rng, "packed", 20)
    none = np.zeros((0, 4, 3, POINTS))
    whole = visible_factor(Hemisphere(), normal, (v, r), none)
    monkeypatch.setattr(occluded_form_factor, "BLOCK_PAIRS", 1)
    assert np.array_equal(visible_factor(Hemisphere(), normal, (v, r), none), whole)


@pytest.mark.parametrize("k", [1, 2, 7])
def test_it_is_the_sum_along_the_open_arcs(k):
    """n.(w x dw) summed over short steps along each circle, where no other one encloses them."""
    rng = np.random.default_rng(k)
    axis, normal = unit(rng, k, 1), unit(rng, 1)
    sine = rng.uniform(0.3, 0.8, (k, 1))
    cosine = np.sqrt(1.0 - sine * sine)
    circles = make_circles(axis, sine, cosine, normal)
    none = np.zeros((0, k, 1))
    got = open_circles_integral(
        circles, none, none, None, make_antiderivative(normal, normal, circles)
    )
    count, want = 200_000, 0.0
    angle = 2.0 * np.pi * (np.arange(count) + 0.5) / count
    for i in range(k):
        a, u, w = (each[:, i] for each in (circles.axis, circles.u, circles.w))
        way = cosine[i] * a + sine[i] * (np.cos(angle) * u + np.sin(angle) * w)
        step = sine[i] * (np.cos(angle) * w - np.sin(angle) * u) * 2.0 * np.pi / count
        open_ = np.ones(count, dtype=bool)
        for j in range(k):
            if j != i:
                open_ &= axis[:, j, 0] @ way < cosine[j]
        want += (normal[:, 0] @ np.cross(way, step, axis=0))[open_].sum()
    assert got[0] == pytest.approx(want, abs=2e-4)
