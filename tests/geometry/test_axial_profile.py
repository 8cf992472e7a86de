# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance by the angle from an axis: its integrals, against sums over small pieces of lights."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from adaptive_drt.geometry.axial_profile import AxialProfile, ProfileAtPoints
from adaptive_drt.geometry.silhouettes import CircularSilhouette
from adaptive_drt.lights.occluded_form_factor import visible_factor

NOTHING = np.zeros((0, 3, 1)), np.zeros((0, 1))
NO_FACES = np.zeros((0, 4, 3, 1))


def unit(rng):
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def beam(axis, angle, blend):
    outer = np.cos(angle)
    return AxialProfile(axis[:, None], outer, outer + (1.0 - outer) * blend)


def tilted(rng, axis, angle):
    """A direction at an angle from a unit vector."""
    aside = np.cross(axis, unit(rng))
    return np.cos(angle) * axis + np.sin(angle) * aside / np.linalg.norm(aside)


def by_sums(axis, half, normal, profile, hidden=None, count=800):
    """The integral over a cone about `axis`, by polar coordinates, and of that outside another."""
    first = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    node, weight = np.polynomial.legendre.leggauss(count)
    turn = 0.5 * half * (node + 1.0)[:, None]
    phi = 2.0 * np.pi * (np.arange(count) + 0.5)[None] / count
    way = np.cos(turn) * axis[:, None, None] + np.sin(turn) * (
        np.cos(phi) * first[:, None, None] + np.sin(phi) * second[:, None, None]
    )
    f = profile.value(np.tensordot(profile.axis[:, 0], way, 1))
    f = f * np.maximum(np.tensordot(normal, way, 1), 0.0) * np.sin(turn)
    if hidden is not None:
        other, opening = hidden
        f = f * (np.tensordot(other, way, 1) < np.cos(opening))
    return (f * weight[:, None]).sum() * 0.5 * half * 2.0 * np.pi / count


def test_values_are_blender_s_smoothstep():
    profile = beam(np.array([0.0, 0.0, 1.0]), 0.5, 0.25)
    outer, width = np.cos(0.5), 0.25 * (1.0 - np.cos(0.5))
    cosine = outer + width * np.array([-3.0, 0.0, 0.25, 0.5, 1.0, 1.7])
    assert profile.value(cosine) == pytest.approx([0.0, 0.0, 0.15625, 0.5, 1.0, 1.0], abs=1e-12)


@pytest.mark.parametrize("cosine", [-0.4, 0.8, 0.9, 0.93, 0.97, 1.0])
def test_antiderivatives_against_50_digits(cosine):
    profile = AxialProfile(np.array([[0.0], [0.0], [1.0]]), 0.88, 0.95)
    with mpmath.workdps(50):
        low, high = mpmath.mpf(profile.outer), mpmath.mpf(profile.inner)

        def f(c):
            x = min(max((c - low) / (high - low), 0), 1)
            return x * x * (3 - 2 * x)

        ends = [low, min(max(mpmath.mpf(cosine), low), high), max(mpmath.mpf(cosine), low)]
        want = mpmath.quad(f, ends), mpmath.quad(lambda c: c * f(c), ends)
    found = profile.integrals(np.array([cosine]))
    for one, other in zip(found, want, strict=True):
        assert float(abs(one[0] - other)) <= 4.0 * 2.0**-53


def test_bounds_of_the_value_over_a_cone_hold():
    rng = np.random.default_rng(3)
    for _ in range(200):
        profile, half = beam(unit(rng), rng.uniform(0.2, 1.4), rng.uniform(0.0, 1.0) + 1e-3), 0.3
        axis = tilted(rng, profile.axis[:, 0], rng.uniform(0.0, 2.0))
        low, high = profile.range(np.array([profile.axis[:, 0] @ axis]), np.array([half]))
        for _ in range(20):
            value = profile.value(profile.axis[:, 0] @ tilted(rng, axis, rng.uniform(0.0, half)))
            assert low[0] - 1e-12 <= value <= high[0] + 1e-12


CASES = [(half, where) for half in (1e-4, 1e-2, 0.1, 0.5, 1.2) for where in ("edge", "axis")]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("half, where", CASES)
def test_round_lights_against_sums(half, where, seed):
    rng = np.random.default_rng([seed, int(1e4 * half), where == "axis"])
    angle, blend = rng.uniform(0.2, 1.2), rng.choice([0.05, 0.15, 1.0])
    profile = beam(unit(rng), angle, blend)
    away = rng.uniform(0.0, 3.0 * half)
    if where == "edge":
        away = abs(rng.uniform(0.9 * angle - half, angle + half))
    axis = tilted(rng, profile.axis[:, 0], away)
    normal = axis + 0.8 * unit(rng)
    normal /= np.linalg.norm(normal)
    light = CircularSilhouette(axis[:, None], np.array([np.cos(half)]), np.array([np.sin(half)]))
    most = np.pi * np.sin(half) ** 2
    got = visible_factor(light, normal[:, None], NOTHING, NO_FACES, profile)[0]
    # the sums are cut at kinks, and at the horizon, of which lights of 0.5 rad and more have some
    rough = 1e-6 if half < 0.2 else 1e-5
    assert got == pytest.approx(by_sums(axis, half, normal, profile), abs=rough * most)
    # behind a ball that covers a part of it
    aside = tilted(rng, axis, 0.8 * half)
    ball = 2.0 * aside[None, :, None], np.array([[2.0 * np.sin(0.7 * half)]])
    got = visible_factor(light, normal[:, None], ball, NO_FACES, profile)[0]
    want = by_sums(axis, half, normal, profile, (aside, 0.7 * half))
    assert got == pytest.approx(want, abs=2e-3 * most)


@pytest.mark.parametrize("seed", range(20))
def test_what_is_hidden_and_what_is_seen_add_up(seed):
    """A card that hides a part of the light, and four that hide all but that part."""
    rng = np.random.default_rng(seed)
    half = 10.0 ** rng.uniform(-4.0, -0.5)
    profile = beam(unit(rng), 0.6, 0.3)
    axis = tilted(rng, profile.axis[:, 0], rng.uniform(0.4, 0.6))
    normal = tilted(rng, axis, 0.6)
    light = CircularSilhouette(axis[:, None], np.array([np.cos(half)]), np.array([np.sin(half)]))
    u = tilted(rng, axis, 0.5 * np.pi)
    v = np.cross(axis, u)
    x, y = np.sort(rng.uniform(-half, half, (2, 2)), axis=1)
    far = 40.0 * half
    spans = [((x[0], x[1]), (y[0], y[1]))], [
        ((-far, x[0]), (-far, far)), ((x[1], far), (-far, far)),
        ((x[0], x[1]), (-far, y[0])), ((x[0], x[1]), (y[1], far)),
    ]  # fmt: skip
    seen = []
    for cards in spans:
        faces = np.array([
            [axis + a * u + b * v for a, b in zip((*p, *p[::-1]), np.repeat(q, 2), strict=True)]
            for p, q in cards
        ])[..., None]  # fmt: skip
        seen.append(visible_factor(light, normal[:, None], NOTHING, faces, profile)[0])
    whole = visible_factor(light, normal[:, None], NOTHING, NO_FACES, profile)[0]
    assert sum(seen) == pytest.approx(whole, abs=1e-8 * np.pi * np.sin(half) ** 2)


def test_points_do_not_depend_on_each_other():
    rng = np.random.default_rng(8)
    count = 50
    profile = beam(unit(rng), 0.5, 0.5)
    axis = np.array(
        [tilted(rng, profile.axis[:, 0], rng.uniform(0.2, 0.6)) for _ in range(count)]
    ).T
    normal, half = axis.copy(), np.full(count, 0.05)
    seen = ProfileAtPoints.make(profile, axis, half, normal)
    level, varies = profile.at(axis, half)
    assert np.array_equal(seen.level, level) and varies.sum() > 10
    light = CircularSilhouette(axis, np.cos(half), np.sin(half))
    none = np.zeros((0, 3, count)), np.zeros((0, count)), np.zeros((0, 4, 3, count))
    whole = visible_factor(light, normal, none[:2], none[2], profile)
    for k in range(0, count, 7):
        one = CircularSilhouette(axis[:, k : k + 1], np.cos(half[:1]), np.sin(half[:1]))
        alone = visible_factor(one, normal[:, k : k + 1], NOTHING, NO_FACES, profile)
        assert alone[0] == whole[k]
