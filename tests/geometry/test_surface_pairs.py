# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that cut each other in a pixel: found wherever many rays see another one in front."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.surface_pairs import depth_order_may_change
from adaptive_drt.scene.description import Quad, Scene, Sphere, vector_of
from detected import depths, grid, in_order, traced
from random_scenes import look_at

EYE = look_at((0.0, -6.0, 2.0), (0.0, 0.0, 0.0), resolution=(40, 30))


def crossing(rng, kinds):
    """Two things about the origin that cut each other as seen from the camera."""
    shapes = []
    for kind in kinds:
        place = rng.normal(size=3) * 0.3
        if kind == "sphere":
            shapes.append(Sphere(vector_of(place), float(rng.uniform(1.0, 1.6))))
        else:
            u, v = rng.normal(size=(2, 3))
            shapes.append(
                Quad(vector_of(place - 3 * u - 3 * v), vector_of(6 * u), vector_of(6 * v))
            )
    return Scene(EYE, tuple(shapes))


@pytest.mark.parametrize(
    "kinds", [("sphere",) * 2, ("sphere", "quad"), ("quad",) * 2], ids="-".join
)
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("seed", range(12))
def test_no_change_of_depth_order_is_left_out(kinds, order, seed):
    scene = crossing(np.random.default_rng(seed), kinds)
    plan, tile, center = traced(scene, order=order)
    assert [type(s).__name__.lower() for s in in_order(scene)] == sorted(kinds, reverse=True)
    sign = []
    both = np.ones(tile.x.size, dtype=bool)
    for a, b, _ in grid(5):
        far, _, _ = depths(scene, tile.x + a, tile.y + b, np.zeros(tile.x.size))
        both &= np.isfinite(far).all(axis=0)
        with np.errstate(invalid="ignore"):
            sign.append(far[0] < far[1])
    rows = np.flatnonzero(both)
    if not rows.size:
        return
    zero, one = np.zeros(rows.size, dtype=np.int64), np.ones(rows.size, dtype=np.int64)
    for first, second in ((zero, one), (one, zero)):
        found = depth_order_may_change(
            plan.shapes, first, second, center.w[:, rows], plan.lens, order
        )
        changes = np.ptp(np.array(sign)[:, rows].astype(int), axis=0) > 0
        assert not (changes & ~found).any(), f"seed {seed}"
        assert (found & ~changes).mean() < 0.7, f"seed {seed}"
