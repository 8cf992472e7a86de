# SPDX-License-Identifier: GPL-3.0-or-later
"""Arcs of circles and of great circles, as points on the sphere."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.boundary_arcs import BoundaryArcs, arcs_of_curve
from adaptive_drt.geometry.silhouettes import hemisphere_silhouette
from adaptive_drt.geometry.spherical_curves import make_circles
from sphere_images import unit


def curves(rng, k, n):
    axis, half = unit(rng, k, n), rng.uniform(0.1, 1.4, size=(k, n))
    circles = make_circles(axis, np.sin(half), np.cos(half), unit(rng, n))
    return circles, hemisphere_silhouette(unit(rng, n)).edges, np.cos(half)


def points(arcs, phi):
    return arcs.origin + np.cos(phi) * arcs.first + np.sin(phi) * arcs.second


def test_arcs_lie_on_their_curves():
    rng = np.random.default_rng(1)
    circles, edges, cosine = curves(rng, 3, 5)
    ring = np.array([0, 7, 7, 14])
    for curve, sign in ((circles, -1.0), (edges, 1.0)):
        low, high = rng.uniform(-1.0, 0.0, 4), rng.uniform(0.0, 1.0, 4)
        arcs = arcs_of_curve(curve, ring, low, high, sign)
        assert np.array_equal(arcs.point, ring % 5) and np.all(arcs.sign == sign)
        way = points(arcs, arcs.low)
        assert (way * way).sum(axis=0) == pytest.approx(np.ones(4), abs=1e-14)
        index = ring // 5, ring % 5
        if curve is circles:
            height = (way * circles.axis[:, index[0], index[1]]).sum(axis=0)
            assert height == pytest.approx(cosine[index], abs=1e-14)
        else:
            height = (way * edges.planes.normal[:, index[0], index[1]]).sum(axis=0)
            assert height == pytest.approx(np.zeros(4), abs=1e-14)


def test_parts_join_and_separate():
    rng = np.random.default_rng(2)
    circles, edges, _ = curves(rng, 3, 4)
    every = np.arange(12)
    low, high = -np.ones(12), np.ones(12)
    parts = [
        arcs_of_curve(circles, every, low, high, -1.0),
        arcs_of_curve(edges, every, low, high, 1.0),
    ]
    joined = BoundaryArcs.join(parts)
    back = joined.take(np.arange(12, 24))
    for name in BoundaryArcs.__dataclass_fields__:
        assert np.array_equal(getattr(back, name), getattr(parts[1], name))
    assert BoundaryArcs.join(parts[:1]) is parts[0]
