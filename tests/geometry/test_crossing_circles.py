# SPDX-License-Identifier: GPL-3.0-or-later
"""Arcs of the circles that cross, against those of all pairs of circles."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.silhouettes import CircularSilhouette, Hemisphere
from adaptive_drt.lights import occluded_form_factor
from adaptive_drt.lights.occluded_form_factor import visible_factor

POINTS = 40
KINDS = ("scattered", "packed", "nested", "equal", "touching", "concurrent")


def unit(rng, *shape):
    vector = rng.normal(size=(3, *shape))
    return vector / np.sqrt((vector * vector).sum(axis=0))


def outlines(rng, kind, k):
    """Centres (k, 3, POINTS) and radii (k, POINTS) of spheres outside of which the origin lies."""
    axis = unit(rng, k, POINTS)
    sine = rng.uniform(0.02, 0.2 if kind == "scattered" else 0.6, (k, POINTS))
    if kind == "nested":
        axis[:, k // 2 :] = axis[:, : k - k // 2]
        sine[k // 2 :] = sine[: k - k // 2] * rng.uniform(0.3, 0.99, (k - k // 2, POINTS))
    if kind == "equal":
        axis[:, k // 2 :], sine[k // 2 :] = axis[:, : k - k // 2], sine[: k - k // 2]
    if kind == "touching":  # the axes of two are as far apart as their half angles together
        aside = np.cross(axis[:, 0], axis[:, 1], axis=0)
        aside /= np.sqrt((aside * aside).sum(axis=0))
        turn = np.arcsin(sine[0]) + np.arcsin(sine[1])
        axis[:, 1] = np.cos(turn) * axis[:, 0] + np.sin(turn) * aside
    if kind == "concurrent":  # all circles meet in the direction of the first axis
        sine[1:] = np.sqrt(1.0 - np.clip((axis[:, 1:] * axis[:, :1]).sum(axis=0), 0.05, 0.99) ** 2)
    far = rng.uniform(1.0, 9.0, (k, POINTS))
    return (axis * far).swapaxes(0, 1), sine * far


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
