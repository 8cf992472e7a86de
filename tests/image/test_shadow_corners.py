# SPDX-License-Identifier: GPL-3.0-or-later
"""Means by a stencil that the corners of a pixel contradict, and those that they confirm."""

import numpy as np

from adaptive_drt.image import shadow_corners
from adaptive_drt.image.shadow_corners import CORNER_WEIGHT
from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import Plan
from random_meshes import random_mesh_scene

SEED, SIZE, PIXEL = 55, (16, 12), (slice(None), 3, 9)
"""A scene in which the shadow of an edge passes between the fully lit centre of a pixel and the
next row of centres."""
TRUTH = np.array([0.2353, 0.2016, 0.1680])
"""Radiance of that pixel by `oracle.mesh_rays`, by 32,768 points: 0.86 of the unhidden light."""


def pixel_by_renderer():
    """Radiance (3,) of the pixel."""
    scene = random_mesh_scene(SEED, SIZE, rounded=True)
    return render_image(scene, Settings(tolerance=1e-2, threads=1)).color[PIXEL]


def test_a_shadow_between_centres_is_found():
    np.testing.assert_allclose(pixel_by_renderer(), TRUTH, rtol=1e-2)


def test_without_corners_and_outlines_it_is_missed(monkeypatch):
    """The scene does show what the corners and rays spread over pixels are for."""
    monkeypatch.setattr(shadow_corners, "CORNER_WEIGHT", 0.0)
    monkeypatch.setattr(shadow_corners, "INTERPOLATION_ERROR_SHARE", np.inf)
    monkeypatch.setattr(Plan, "any_mesh", False)
    assert pixel_by_renderer().mean() > 1.1 * TRUTH.mean()


def test_the_rule_is_exact_for_cubic_polynomials():
    rng = np.random.default_rng(0)
    powers = [(j, k) for j in range(4) for k in range(4 - j)]
    factors = rng.normal(size=len(powers))
    value = lambda x, y: sum(  # noqa: E731
        c * x**j * y**k for c, (j, k) in zip(factors, powers, strict=True)
    )
    corners = sum(value(x, y) for x in (-0.5, 0.5) for y in (-0.5, 0.5))
    found = (1.0 - 4.0 * CORNER_WEIGHT) * value(0.0, 0.0) + CORNER_WEIGHT * corners
    line = [(1.0 - (-1.0) ** (k + 1)) / (k + 1) * 0.5 ** (k + 1) for k in range(4)]
    mean = sum(c * line[j] * line[k] for c, (j, k) in zip(factors, powers, strict=True))
    assert abs(found - mean) < 1e-15
