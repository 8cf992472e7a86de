# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres: hits and occluded segments against 50 digits, cones against many directions.

`tests/test_kernels.py` holds their error bounds over hostile inputs.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from adaptive_drt.geometry.sphere.kernels import (
    cone_overlap,
    discriminant,
    intersect_sphere,
    sphere_blocks_segment,
)
from adaptive_drt.numerics.jet import Jet

COUNT = 300


def exact_roots(w, v, radius):
    """Ray parameters of both crossings of a sphere, at 50 digits; empty for a miss."""
    with mpmath.workdps(50):
        w, v, r = ([mpmath.mpf(float(x)) for x in part] for part in (w, v, [radius]))
        a = sum(x * x for x in w)
        b = sum(x * y for x, y in zip(w, v, strict=True))
        square = b * b - a * (sum(x * x for x in v) - r[0] ** 2)
        if square < 0:
            return []
        return [(b - mpmath.sqrt(square)) / a, (b + mpmath.sqrt(square)) / a]


def random_rays(seed):
    """Rays and spheres: a third from inside, a third towards the sphere, the rest anywhere."""
    rng = np.random.default_rng(seed)
    v = rng.normal(size=(3, COUNT)) * 10.0 ** rng.uniform(-3, 3, COUNT)
    radius = np.linalg.norm(v, axis=0) * 10.0 ** rng.uniform(-3, 0.3, COUNT)
    near = rng.normal(size=(3, COUNT)) * radius / 1.5
    w = np.where(rng.random(COUNT) < 0.7, v + near, rng.normal(size=(3, COUNT)))
    return w * 10.0 ** rng.uniform(-2, 2, COUNT), v, radius


@pytest.mark.parametrize("seed", range(3))
def test_first_hits_ahead(seed):
    w, v, radius = random_rays(seed)
    found = intersect_sphere(w, v, radius)
    for k in range(COUNT):
        ahead = [root for root in exact_roots(w[:, k], v[:, k], radius[k]) if root > 0]
        if ahead:
            assert abs(found[k] / float(min(ahead)) - 1.0) < 1e-9, (seed, k)
        else:
            assert found[k] == np.inf, (seed, k)


@pytest.mark.parametrize("seed", range(3))
def test_segments_are_blocked_where_they_cross_the_surface(seed):
    w, v, radius = random_rays(seed)
    found = sphere_blocks_segment(w, v, radius)
    seen = set()
    for k in range(COUNT):
        roots = exact_roots(w[:, k], v[:, k], radius[k])
        if any(min(abs(root), abs(root - 1)) < 1e-9 for root in roots):
            continue
        assert found[k] == any(0 < root < 1 for root in roots), (seed, k)
        seen.add(bool(found[k]))
    assert seen == {True, False}


def test_discriminants_of_jets_are_quadratics_of_the_direction():
    rng = np.random.default_rng(4)
    base, step, v = rng.normal(size=(3, 3, 20))
    radius = rng.random(20)
    zero = np.zeros((3, 20))
    jet = discriminant(Jet(base, (step,), (zero,)), v, radius)
    for s in (-0.5, 0.1, 0.7):
        want = discriminant(base + s * step, v, radius)
        have = jet.value + s * (jet.gradient[0] + 0.5 * s * jet.hessian[0])
        np.testing.assert_allclose(have, want, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("seed", range(30))
def test_cones_that_spheres_touch_and_cover(seed):
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    half = rng.uniform(0.01, 1.5)
    v = axis * rng.uniform(0.5, 3.0) + rng.normal(size=3) * rng.uniform(0.0, 2.0)
    radius = np.linalg.norm(v) * rng.uniform(0.05, 0.999)
    columns = (axis[:, None], np.cos(half), np.sin(half), v[:, None], np.array([radius]))
    touch, cover, tangent = cone_overlap(*columns)
    assert tangent[0] == pytest.approx(np.sqrt(v @ v - radius**2))
    # the exact answer: angles between the axes and of both cones
    apart = np.arccos(np.clip(v @ axis / np.linalg.norm(v), -1, 1))
    own = np.arcsin(radius / np.linalg.norm(v))
    if abs(apart - (half + own)) > 1e-9:
        assert touch[0] == (apart < half + own), seed
    if abs(apart + half - own) > 1e-9:
        assert cover[0] == (apart + half < own), seed
