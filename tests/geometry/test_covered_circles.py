# SPDX-License-Identifier: GPL-3.0-or-later
"""Circles that other caps cover all around, against many points on each circle."""

import numpy as np
import pytest

from adaptive_drt.geometry import open_hemisphere
from adaptive_drt.geometry.covered_circles import circles_to_keep, mean_overlaps
from adaptive_drt.numerics.vector import perpendicular_pair


def heap(rng, points, count, width, angle):
    """Caps of points, the largest first: axes (3, n, k), sines and cosines (n, k)."""
    axis = rng.normal(size=(3, points, count)) * width
    axis[2] += 1.0
    axis /= np.sqrt((axis * axis).sum(axis=0))
    sine = np.sin(angle * rng.uniform(0.5, 1.5, (points, count)))
    order = np.argsort(-sine, axis=1)
    sine = np.take_along_axis(sine, order, 1)
    return np.take_along_axis(axis, order[None], 2), sine, np.sqrt(1.0 - sine * sine)


def any_open(axis, sine, cosine, steps=720):
    """Whether circles (n, k) have one of many points that lies in no other cap."""
    u, w = perpendicular_pair(axis)
    turn = 2.0 * np.pi * (np.arange(steps) + 0.5) / steps
    found = np.zeros(sine.shape, dtype=bool)
    for k in range(sine.shape[1]):
        ring = u[:, :, k, None] * np.cos(turn) + w[:, :, k, None] * np.sin(turn)
        ring = cosine[:, k, None] * axis[:, :, k, None] + sine[:, k, None] * ring
        inside = np.einsum("ink,ins->nks", axis, ring) > cosine[..., None]
        inside[:, k] = False
        found[:, k] = (~inside.any(axis=1)).any(axis=1)
    return found


@pytest.mark.parametrize(("width", "angle"), [(0.2, 0.06), (0.5, 0.3), (3.0, 0.1), (0.02, 0.004)])
def test_circles_with_an_open_point_are_kept(width, angle):
    seed = int(np.random.default_rng().integers(1 << 31))
    print("seed", seed)
    caps = heap(np.random.default_rng(seed), 3, 150, width, angle)
    kept, open_ = circles_to_keep(*caps), any_open(*caps)
    assert not (open_ & ~kept).any()
    if mean_overlaps(caps[0], caps[2]).min() > 8.0:
        assert kept.sum() < 1.5 * open_.sum() + 10, "others are found to be covered"


def test_equal_caps_do_not_cover_each_other():
    axis = np.tile(np.array([0.6, 0.0, 0.8])[:, None, None], (1, 2, 5))
    sine = np.full((2, 5), 0.3)
    sine[1, 2:] -= 1e-12
    assert circles_to_keep(axis, sine, np.sqrt(1.0 - sine * sine)).all()


def test_unused_caps_and_those_within_others():
    axis = np.array([[0.0, 0.05, 1.0], [0.0, 0.0, 0.0], [1.0, 1.0, 0.0]])[:, None]
    axis /= np.sqrt((axis * axis).sum(axis=0))
    sine, cosine = np.array([[0.5, 0.2, 1.0]]), np.array([[0.0, 0.0, 2.0]])
    cosine[:, :2] = np.sqrt(1.0 - sine[:, :2] ** 2)
    assert circles_to_keep(axis, sine, cosine).tolist() == [[True, False, False]]


def test_overlaps():
    rng = np.random.default_rng(7)
    crowded, sparse = heap(rng, 4, 200, 0.2, 0.1), heap(rng, 4, 200, 3.0, 0.03)
    assert mean_overlaps(crowded[0], crowded[2]).min() > open_hemisphere.LEAST_OVERLAPS
    assert mean_overlaps(sparse[0], sparse[2]).max() < 1.0


@pytest.mark.parametrize("kept_many", [False, True])
def test_light_is_the_same_without_them(kept_many, monkeypatch):
    seed = int(np.random.default_rng().integers(1 << 31))
    print("seed", seed)
    rng = np.random.default_rng(seed)
    n, k = 11, 300 if kept_many else 200
    axis, sine, cosine = heap(rng, n, k, 0.6 if kept_many else 0.3, 0.09)
    if kept_many:
        monkeypatch.setattr(open_hemisphere, "LEAST_OVERLAPS", -2.0)
    normal = rng.normal(size=(3, n))
    normal[2] = 3.0
    normal /= np.sqrt((normal * normal).sum(axis=0))
    point = np.repeat(np.arange(n), k)
    caps = axis.reshape(3, -1), sine.ravel(), cosine.ravel()
    calls = []
    keep = open_hemisphere.circles_to_keep
    monkeypatch.setattr(
        open_hemisphere, "circles_to_keep", lambda *own: calls.append(keep(*own)) or calls[-1]
    )
    found = open_hemisphere.open_hemisphere_factor(normal, *caps, point)
    number = max(int(own.sum(axis=1).max()) for own in calls)
    assert (number > open_hemisphere.MANY_CAPS) == kept_many
    monkeypatch.setattr(open_hemisphere, "MANY_CIRCLES", 1 << 20)
    want = open_hemisphere.open_hemisphere_factor(normal, *caps, point)
    np.testing.assert_allclose(found, want, rtol=0.0, atol=1e-12)
    assert want.min() > 0.0
