# SPDX-License-Identifier: GPL-3.0-or-later
"""Reference pictures by plain sampling of pixel, shutter and lights, with their own error."""

import numpy as np

from .lights import emitted, is_dark, power_of
from .samples import camera_rays
from .trace import BLOCKED, nearest, states
from .truth import pixels_of

__all__ = ["reference"]

GROUPS = 8
"""Independent groups of samples; their spread gives the picture's standard error."""

STEPS = np.array(
    [0.8191725133961645, 0.6710436067037893, 0.5497004779019703, 0.45030205773, 0.36887529]
)
"""Additive recurrence over five dimensions (Roberts 2018: powers of the root of x^6 = x + 1)."""


def reference(scene, samples=512, use_motion=True, use_edges=True, seed=0):
    """Mean picture (3, height, width) and its standard error of the mean, same shape.

    `samples` points of pixel, time and light for each pixel; still where a switch is off.
    """
    pixels = pixels_of(scene.camera)
    left, bottom, right, top = scene.camera.region
    means = []
    rng = np.random.default_rng(seed)
    for _ in range(GROUPS):
        start = rng.random((len(pixels), 5))
        total = np.zeros((len(pixels), 3))
        each = samples // GROUPS
        for index in range(each):
            cube = (start + (index + 1) * STEPS) % 1.0
            total += _radiance(scene, pixels, cube, use_motion, use_edges)
        means.append(total / each)
    means = np.array(means)
    error = means.std(axis=0, ddof=1) / np.sqrt(GROUPS)
    shape = (3, top - bottom, right - left)
    return means.mean(axis=0).T.reshape(shape), error.T.reshape(shape)


def _radiance(scene, pixels, cube, use_motion, use_edges):
    """One sample (n, 3) for each pixel: cube (n, 5) holds x, y, time and a light's two."""
    spots = pixels + (cube[:, :2] if use_edges else 0.5)
    o, d, t = camera_rays(scene, spots, cube[:, 2] - 0.5 if use_motion else 0.0)
    hits = nearest(scene, o, d, t)
    shown = np.flatnonzero(hits.ids >= 0)
    p, normals, own = hits.points[shown], hits.normals[shown], hits.ids[shown]
    inside, when = hits.inside[shown], t[shown]
    light_sum = np.zeros((len(shown), 3))
    for light in scene.lights:
        if is_dark(light):
            continue
        point, share = emitted(light, p, normals, when, cube[shown, 3:])
        if light.casts_shadow:
            args = (p, point, when, own, normals, inside)
            share = share * (states(scene, *args, share=0.0) != BLOCKED)
        light_sum += share[:, None] * np.array(power_of(light))
    colors = np.array([s.material.color for s in scene.shapes]).reshape(-1, 3)
    result = np.broadcast_to(np.array(scene.background, dtype=float), (len(pixels), 3)).copy()
    result[shown] = light_sum * colors[own] / np.pi
    return result
