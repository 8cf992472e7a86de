# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres hidden by spheres: dropped only for sure, and the light is the same without them."""

from __future__ import annotations

import tracemalloc

import mpmath
import numpy as np
import pytest

from adaptive_drt.lights.occluded_form_factor import visible_factor
from adaptive_drt.scene.description import Camera, Material, Scene, Sphere, SphereLight
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading import nested_occluders as nested_module
from adaptive_drt.shading.nested_occluders import find_nested
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, Surface
from shape_sets import spheres_of

IDENTITY = tuple(tuple(float(i == j) for j in range(4)) for i in range(4))
LIGHT = SphereLight((0.0, 0.0, 50.0), 1.0, (1.0, 1.0, 1.0))


def hidden(spheres, points=((0.0, 0.0, 0.0),)):
    """Which of some spheres others hide from points: (points, spheres)."""
    camera = Camera(matrix=IDENTITY, resolution=(4, 4))
    plan = make_plan(Scene(camera, tuple(spheres), (LIGHT,)), Settings())
    assert spheres_of(plan).count == len(spheres)
    n, k = len(points), len(spheres)
    point = np.array(points).T
    surface = Surface(point, np.zeros((3, n)), np.full(n, -1), np.zeros(n, dtype=bool))
    pairs = Pairs(np.repeat(np.arange(n), k), np.tile(np.arange(k), n))
    return find_nested(plan, surface, pairs, 0.0).reshape(n, k)


def ball(*center, radius):
    return Sphere(center, radius, Material((0.5, 0.5, 0.5)))


def test_what_is_behind_a_larger_or_nearer_one():
    far = [ball(0.1, 0.0, 20.0, radius=1.0), ball(0.0, 0.0, 30.0, radius=1.0)]
    near = ball(0.0, 0.0, 2.0, radius=0.5)
    beside = ball(3.0, 0.0, 2.0, radius=0.5)
    assert hidden([*far, near, beside]).tolist() == [[True, True, False, False]]


def test_of_equal_outlines_all_stay():
    same = [ball(0.0, 0.0, z, radius=0.125 * z) for z in (1.0, 2.0, 4.0, 8.0)]
    assert not hidden(same).any()


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e-6, 1e-9])
def test_tangent_outlines_at_all_sizes(scale):
    """Cones that touch another from within by a part of their size, and stick out by it."""
    large = ball(0.0, 0.0, 1.0, radius=0.2 * scale)
    angle = np.arcsin(0.2 * scale)
    for part, inside in ((1e-5, True), (-1e-5, False)):
        small = 0.25 * angle
        off = angle - small - part * angle
        away = [
            ball(2.0 * np.sin(off), 0.0, 2.0 * np.cos(off), radius=2.0 * np.sin(small)),
            ball(0.5, 0.0, 1.0, radius=0.01), ball(0.0, 0.5, 1.0, radius=0.01), large,
        ]  # fmt: skip
        assert hidden(away)[0].tolist() == [inside, False, False, False], (scale, part)


def test_dropped_only_for_sure():
    """Against 50 digits, near tangency on purpose."""
    seed = 20261126
    print("seed", seed)
    rng = np.random.default_rng(seed)
    dropped = 0
    with mpmath.workdps(50):
        for _ in range(60):
            scale = 10.0 ** rng.uniform(-6.0, 0.0)
            spheres = []
            for _ in range(8):
                distance = rng.uniform(1.0, 3.0)
                side = rng.normal(size=2) * 0.1 * scale * distance
                radius = min(rng.uniform(0.01, 0.4) * scale, 0.9) * distance
                spheres.append(ball(*side.tolist(), float(distance), radius=float(radius)))
            got = hidden(spheres)[0]
            dropped += got.sum()
            for i in np.flatnonzero(got):
                assert any(_inside(spheres[i], spheres[j]) for j in range(8) if j != i)
    assert dropped > 60


def _inside(one, other):
    axes, angles = [], []
    for sphere in (one, other):
        c = [mpmath.mpf(x) for x in sphere.center]
        length = mpmath.sqrt(sum(x * x for x in c))
        axes.append([x / length for x in c])
        angles.append(mpmath.asin(mpmath.mpf(sphere.radius) / length))
    chord = mpmath.sqrt(sum((a - b) ** 2 for a, b in zip(*axes, strict=True)))
    return 2 * mpmath.asin(chord / 2) + angles[0] <= angles[1]


def test_the_light_past_them_is_the_same():
    seed = 20261127
    print("seed", seed)
    rng = np.random.default_rng(seed)
    n, k = 200, 12
    v = np.stack([rng.normal(size=(k, n)) * 0.2, rng.normal(size=(k, n)) * 0.2,
                  rng.uniform(0.6, 1.8, (k, n))], axis=1)  # fmt: skip
    r = rng.uniform(0.02, 0.35, (k, n))
    normal = np.tile([[0.0], [0.0], [1.0]], n)
    corners = [(-0.4, -0.4, 2.5), (0.4, -0.4, 2.5), (0.4, 0.4, 2.5), (-0.4, 0.4, 2.5)]
    light = np.tile(np.array(corners)[:, :, None], n)
    none = np.zeros((0, 4, 3, n))
    whole = visible_factor(light, normal, (v, r), none)
    count = 0
    for i in range(n):
        spheres = [ball(*v[j, :, i].tolist(), radius=float(r[j, i])) for j in range(k)]
        keep = ~hidden(spheres)[0]
        count += int((~keep).sum())
        part = visible_factor(
            light[..., i : i + 1], normal[:, :1],
            (v[keep][..., i : i + 1], r[keep][:, i : i + 1]), none[..., :1],
        )  # fmt: skip
        assert abs(part[0] - whole[i]) <= 1e-14
    assert count > n


@pytest.mark.parametrize("seed", range(8))
def test_the_largest_first_or_all_at_once(monkeypatch, seed):
    """Crowds are compared with the spheres that look largest before all with each other."""
    rng = np.random.default_rng(seed)
    heap = [
        ball(*(p * rng.uniform(2.0, 9.0) / np.linalg.norm(p)), radius=rng.uniform(0.05, 1.5))
        for p in rng.normal(size=(60, 3)) * 0.4 + np.array([0.0, 0.0, 1.0])
    ]
    points = rng.normal(size=(20, 3)) * 0.05
    quick = hidden(heap, points)
    monkeypatch.setattr(nested_module, "TWO_PASS_CIRCLES", 1_000)
    assert np.array_equal(quick, hidden(heap, points))
    print(f"{quick.mean():.2f} hidden")
    assert 0.05 < quick.mean() < 0.99


def test_thousands_before_one_light_are_compared_in_little_memory(monkeypatch):
    """All pairs of 1,500 outlines at once took 500 MB; the answer is that of all at once."""
    seed = 20261201
    print("seed", seed)
    rng = np.random.default_rng(seed)
    heap = [
        ball(*(p * rng.uniform(2.0, 9.0) / np.linalg.norm(p)), radius=rng.uniform(0.01, 0.2))
        for p in rng.normal(size=(1_500, 3)) * 0.4 + np.array([0.0, 0.0, 1.0])
    ]
    tracemalloc.start()
    found = hidden(heap)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    print(f"{peak / 1e6:.0f} MB, {found.mean():.2f} hidden")
    assert 0.05 < found.mean() < 0.95
    assert peak < 40e6
    monkeypatch.setattr(nested_module, "BATCH_PAIRS", 1 << 22)
    monkeypatch.setattr(nested_module, "TWO_PASS_CIRCLES", 1 << 22)
    assert np.array_equal(found, hidden(heap))
