# SPDX-License-Identifier: GPL-3.0-or-later
"""Occluders that reach through a light's plane: only what is before it hides."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.polygon.clipping import clip_polygons
from adaptive_drt.geometry.sphere.plane_section import clipped_sphere_polygons
from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.occluded_form_factor import visible_factor
from adaptive_drt.lights.registry import make_emitter
from adaptive_drt.scene.description import QuadLight
from adaptive_drt.shading.partial_occlusion import SECTION_CORNERS

SIDE = 400
"""Points on a side of the light, for brute force."""
CLOSE = 4e-4
"""Of the unhidden light: brute force cuts the ball's outline at so many points, SIDE^-1.5."""
LIGHT = make_emitter(
    QuadLight((0.0, 0.0, 3.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (1.0,) * 3),
    LightMotion(np.zeros(3), np.zeros(3)),
)


def brute(point, blocks):
    """The factor of the light at a point with its normal up, past what `blocks` says of rays."""
    g = (np.arange(SIDE) + 0.5) / SIDE * 2.0 - 1.0
    u, v = (a.ravel() for a in np.meshgrid(g, g))
    w = LIGHT.center - point[:, None] + LIGHT.span.half_u * u + LIGHT.span.half_v * v
    square = (w * w).sum(axis=0)
    return (np.where(blocks(w), 0.0, w[2] * w[2] / square**2)).sum() * 4.0 / SIDE**2


def factor(point, balls, quads):
    to = LIGHT.center - point[:, None]
    none = np.zeros((0, 3, 1)), np.zeros((0, 1))
    up = np.array([[0.0], [0.0], [1.0]])
    outline = LIGHT.silhouette(to, up)
    plane = LIGHT.plane(to)
    if balls is not None:
        center, radius = balls
        v = (center - point)[None, :, None]
        cut = clipped_sphere_polygons(plane, v, np.array([[radius]]), SECTION_CORNERS)
        return visible_factor(outline, up, none, cut)[0]
    return visible_factor(outline, up, none, clip_polygons(plane, quads[None, :, :, None]))[0]


@pytest.mark.parametrize("seed", range(25))
def test_a_ball_cut_by_the_light_s_plane(seed):
    rng = np.random.default_rng(seed)
    point = rng.uniform((-2.0, -2.0, 0.0), (2.0, 2.0, 1.0))
    center = rng.uniform((-1.5, -1.5, 2.6), (1.5, 1.5, 3.4))
    radius = rng.uniform(0.41, 1.2)
    v = center - point

    def blocks(w):
        along, square = (w * v[:, None]).sum(axis=0), (w * w).sum(axis=0)
        d = along**2 - square * (v @ v - radius**2)
        t = (along - np.sqrt(np.maximum(d, 0.0))) / square
        return (d > 0.0) & (t > 0.0) & (t < 1.0)

    whole = brute(point, lambda w: np.zeros(w.shape[1], dtype=bool))
    assert abs(factor(point, (center, radius), None) - brute(point, blocks)) < CLOSE * whole


@pytest.mark.parametrize("seed", range(25))
def test_a_quad_cut_by_the_light_s_plane(seed):
    rng = np.random.default_rng(seed)
    point = rng.uniform((-2.0, -2.0, 0.0), (2.0, 2.0, 1.0))
    corner = rng.uniform((-1.5, -1.5, 1.5), (0.5, 0.5, 2.5))
    a, b = rng.uniform(0.2, 1.5, 3), rng.uniform((-1.0, 0.2, 0.2), (1.0, 1.5, 1.5))
    q = corner - point
    normal = np.cross(a, b)

    def blocks(w):
        t = (normal @ q) / (normal @ w)
        at = t * w - q[:, None]
        u, v = np.linalg.lstsq(np.stack([a, b], axis=1), at, rcond=None)[0]
        return (t > 0.0) & (t < 1.0) & (u > 0.0) & (u < 1.0) & (v > 0.0) & (v < 1.0)

    quads = np.stack([q, q + a, q + a + b, q + b])
    whole = brute(point, lambda w: np.zeros(w.shape[1], dtype=bool))
    assert abs(factor(point, None, quads) - brute(point, blocks)) < CLOSE * whole * 2.0
