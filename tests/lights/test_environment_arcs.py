# SPDX-License-Identifier: GPL-3.0-or-later
"""Boundary integrals of environments: closed forms, poles, and the stated error."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.boundary_arcs import BoundaryArcs, arcs_of_curve
from adaptive_drt.geometry.silhouettes import hemisphere_silhouette
from adaptive_drt.geometry.spherical_curves import make_circles
from adaptive_drt.lights.environment_arcs import integrate_over_arcs
from adaptive_drt.lights.environment_map import make_environment_map
from adaptive_drt.scene.description import EnvironmentLight
from sphere_images import noise, random_turn, unit

RNG = np.random.default_rng(3)


def make_map(pixels, turn=None):
    return make_environment_map(EnvironmentLight(pixels, rotation=turn or random_turn(RNG)))


def horizon(normal):
    edges = hemisphere_silhouette(normal).edges
    half = edges.half_angle.ravel()
    return arcs_of_curve(edges, np.arange(half.size), -half, half, 1.0)


def integral(environment, normal, arcs, allowed=1e-10):
    return integrate_over_arcs(environment, normal, arcs, np.full(normal.shape[1], allowed))


def test_a_uniform_hemisphere_gives_pi():
    environment = make_map(np.full((6, 9, 3), 1.0))
    # poles of the map above, on and below the horizon, and near it
    z = environment.turn[2]
    normal = unit(RNG, 60)
    normal[:, :2] = np.array([z, -z]).T
    for k, tilt in enumerate((0.0, 1e-16, 1e-12, 1e-9, 1e-6, 1e-3, -1e-16, -1e-12, -1e-9, -1e-6)):
        aside = np.cross(z, normal[:, 20 + k])
        normal[:, 2 + k] = aside / np.linalg.norm(aside) + tilt * z
    normal /= np.sqrt((normal * normal).sum(axis=0))
    value, error = integral(environment, normal, horizon(normal))
    assert value == pytest.approx(np.full((3, 60), np.pi), abs=1e-10)
    assert error.max() < 1e-9


@pytest.mark.parametrize("half", [1e-3, 0.2, 0.9])
def test_uniform_circles(half):
    """pi sin^2 (n.a) for circles above the horizon, also around a pole and beside it."""
    environment = make_map(np.full((6, 9, 3), 1.0))
    axis, z = unit(RNG, 40), environment.turn[2]
    for k, (side, off) in enumerate((s, o) for s in (1, -1) for o in (0.0, 1e-12, 0.5, 1.0, 1.5)):
        aside = np.cross(z, axis[:, 39])
        axis[:, k] = side * np.cos(off * half) * z + np.sin(off * half) * aside / np.linalg.norm(
            aside
        )
    normal = axis + 0.1 * unit(RNG, 40)
    normal /= np.sqrt((normal * normal).sum(axis=0))
    sine, cosine = np.full((1, 40), np.sin(half)), np.full((1, 40), np.cos(half))
    circles = make_circles(axis[:, None], sine, cosine, normal)
    every = np.arange(40)
    arcs = arcs_of_curve(circles, every, np.full(40, -np.pi), np.full(40, np.pi), 1.0)
    value, _ = integral(environment, normal, arcs)
    want = np.pi * np.sin(half) ** 2 * (normal * axis).sum(axis=0)
    assert value == pytest.approx(np.broadcast_to(want, (3, 40)), abs=1e-9)


def test_the_stated_error_holds():
    """Against a much finer quadrature, over noise, which no rule follows."""
    rng = np.random.default_rng(4)
    environment = make_map(noise(rng, 16, 32))
    normal = unit(rng, 300)
    arcs = horizon(normal)
    want, _ = integral(environment, normal, arcs, 1e-8)
    for allowed in (1e-2, 1e-3, 1e-4, 1e-5):
        value, error = integral(environment, normal, arcs, allowed)
        off = np.abs(value - want).max(axis=0)
        assert error.max() <= allowed
        assert (off <= np.maximum(error, 1e-8)).mean() >= 0.99
        assert off.max() <= 1.5 * allowed and np.sqrt((off * off).mean()) < 0.2 * allowed


def test_edges_of_texels_beside_ends_do_not_go_unseen():
    """Parts of latitudes, of which the outermost nodes do not reach the last texel."""
    rng = np.random.default_rng(5)
    environment = make_map(noise(rng, 8, 16))
    edge = rng.integers(2, 12, 400) * (2.0 * np.pi / 16.0)
    length, theta = rng.uniform(0.1, 0.35, 400), rng.uniform(0.5, 1.5, 400)
    x, y, z = environment.turn[:, :, None]
    s, normal = np.sin(theta), np.repeat(z, 400, axis=1)

    def arcs(low, high):
        point, sign = np.arange(400), np.ones(400)
        return BoundaryArcs(np.cos(theta) * z, s * x, s * y, low, high, s, point, sign)

    low, high = edge - length, edge + rng.uniform(0.0, 0.02, 400) * length
    ends = [integral(environment, normal, arcs(*part))[0] for part in ((low, edge), (edge, high))]
    value, error = integral(environment, normal, arcs(low, high), 1e-5)
    off = np.abs(value - sum(ends)).max(axis=0)
    assert (off <= error + 1e-9).all()


def test_answers_do_not_depend_on_the_batch():
    environment = make_map(noise(RNG))
    normal = unit(RNG, 30)
    value, error = integral(environment, normal, horizon(normal), 1e-4)
    for k in (0, 17, 29):
        one = normal[:, k : k + 1]
        alone = integral(environment, one, horizon(one), 1e-4)
        assert np.array_equal(alone[0][:, 0], value[:, k]) and alone[1][0] == error[k]


def test_no_arcs_and_no_light():
    environment, normal = make_map(np.zeros((2, 4, 3))), unit(RNG, 3)
    assert not integral(environment, normal, horizon(normal))[0].any()
    none = horizon(normal).take(np.zeros(0, dtype=np.int64))
    assert not integral(make_map(noise(RNG)), normal, none)[0].any()
