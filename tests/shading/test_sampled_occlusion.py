# SPDX-License-Identifier: GPL-3.0-or-later
"""Distributed rays to partly hidden lights: what they are off by is what they say, or less."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from adaptive_drt.scene.description import (
    Camera,
    DiskLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading import sampled_occlusion
from adaptive_drt.shading.sampled_occlusion import FIRST_RAYS, LAST_RAYS, sampled_factors
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, Surface

POINTS = 24
TRUE_RAYS = 1 << 15
"""Rays of the truth, from another seed: its error is a tenth or so of that of `FIRST_RAYS`."""
WHITE = (1.0, 1.0, 1.0)
LIGHTS = {
    "sphere": SphereLight((0.0, 0.0, 2.0), 0.8, WHITE),
    "a sphere around": SphereLight((0.0, 0.0, 1.0), 6.0, WHITE),
    "disk": DiskLight((0.0, 0.0, 2.0), 0.8, WHITE),
    "quad": QuadLight((0.0, 0.0, 2.0), (0.9, 0.0, 0.2), (0.0, -0.7, 0.1), WHITE),
}


def case(name, seed):
    """A plan with one light, into which shapes reach, and points below with all shapes' pairs."""
    rng = np.random.default_rng(seed)
    shapes = []
    for _ in range(3):
        place, (u, v) = rng.normal(size=3) * 0.5 + (0.0, 0.0, 1.8), rng.normal(size=(2, 3)) * 0.5
        shapes.append(Sphere(tuple(place + rng.normal(size=3) * 0.3), float(rng.uniform(0.1, 0.5))))
        shapes.append(Quad(tuple(place), tuple(u), tuple(v)))
    scene = Scene(Camera(resolution=(4, 4)), tuple(shapes), (LIGHTS[name],))
    plan = make_plan(scene, Settings(method="EXACT"))
    point = rng.uniform((-3.0, -3.0, -1.0), (3.0, 3.0, 0.3), (POINTS, 3)).T
    normal = rng.normal(size=(3, POINTS)) + np.array((0.0, 0.0, 2.0))[:, None]
    normal /= np.linalg.norm(normal, axis=0)
    surface = Surface(point, normal, np.full(POINTS, -1), np.zeros(POINTS, dtype=bool))
    number = plan.object_count
    pairs = Pairs(np.repeat(np.arange(POINTS), number), np.tile(np.arange(number), POINTS))
    return plan, surface, pairs


def factors(of, allowed, seed=0):
    """Factors and errors by `sampled_factors`, with another seed if wanted."""
    plan, surface, pairs = of
    plan.settings.__dict__["seed"] = seed
    return sampled_factors(plan, surface, plan.lights[0], pairs, 0.0, np.full(POINTS, allowed))


@pytest.mark.parametrize("name", LIGHTS)
def test_the_error_is_no_more_than_estimated(name, monkeypatch):
    """RMS of the ratio of both, over points and scenes; and what is off by much is rare."""
    ratios, partly = [], 0
    for seed in range(4):
        of = case(name, seed)
        got, error = factors(of, np.inf)
        with monkeypatch.context() as more:
            more.setattr(sampled_occlusion, "LAST_RAYS", TRUE_RAYS)
            want, _ = factors(of, 0.0, seed=99)
        whole = sampled_factors(*of[:2], of[0].lights[0], Pairs(*np.zeros((2, 0), int)), 0.0, error)
        some = (want > 0.0) & (want < 0.999 * whole[0])
        partly += some.sum()
        ratios.append(((got - want) / np.maximum(error, 1e-300))[some])
    ratio = np.concatenate(ratios)
    assert partly > 2 * POINTS, "hardly any light was hidden in part"
    assert np.sqrt((ratio**2).mean()) <= 1.0
    assert (np.abs(ratio) > 2.5).mean() <= 0.02


@pytest.mark.parametrize("name", LIGHTS)
def test_rays_are_doubled_until_the_error_is_allowed(name, monkeypatch):
    of, taken = case(name, 5), []
    sums = sampled_occlusion._batch_sums

    def counted(plan, surface, *rest):
        taken.append((surface.item.size, rest[-1]))
        return sums(plan, surface, *rest)

    monkeypatch.setattr(sampled_occlusion, "_batch_sums", counted)
    _, first = factors(of, np.inf)
    assert taken == [(POINTS, (0, FIRST_RAYS))]
    allowed = float(np.median(first))
    taken.clear()
    _, error = factors(of, allowed)
    spans = [span for _, span in taken]
    assert spans[0] == (0, FIRST_RAYS) and all(b[0] == a[1] for a, b in pairwise(spans))
    numbers = [number for number, _ in taken]
    assert numbers[1] == (first > allowed).sum() and sorted(numbers, reverse=True) == numbers
    assert (error <= allowed).all() or spans[-1][1] == LAST_RAYS
    assert (error[first <= allowed] == first[first <= allowed]).all()
    taken.clear()
    factors(of, 0.0)
    # a point that the light does not reach has no error
    assert (first > 0.0).sum() >= POINTS - 1
    assert taken[-1] == ((first > 0.0).sum(), (LAST_RAYS // 2, LAST_RAYS))


def test_doubled_rays_are_those_of_one_sequence(monkeypatch):
    """In two steps or at once: the same rays, and the same estimate up to rounding."""
    of = case("sphere", 6)
    with monkeypatch.context() as more:
        more.setattr(sampled_occlusion, "LAST_RAYS", 2 * FIRST_RAYS)
        doubled, error = factors(of, 0.0)
    with monkeypatch.context() as more:
        more.setattr(sampled_occlusion, "FIRST_RAYS", 2 * FIRST_RAYS)
        at_once, same = factors(of, np.inf)
    assert np.allclose(doubled, at_once, rtol=1e-12, atol=1e-15)
    assert np.allclose(error, same, rtol=1e-9, atol=1e-15)


def test_what_hides_less_than_a_ray_is_not_stated_as_exact():
    of = case("sphere", 7)
    _, error = factors(of, np.inf)
    whole, _ = sampled_factors(*of[:2], of[0].lights[0], Pairs(*np.zeros((2, 0), int)), 0.0, error)
    assert (error >= 0.49 * whole / FIRST_RAYS).all()
