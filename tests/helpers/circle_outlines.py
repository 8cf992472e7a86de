# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines of spheres as seen from points, in configurations that are common or degenerate."""

from __future__ import annotations

import numpy as np

POINTS = 40
KINDS = ("scattered", "packed", "nested", "equal", "touching", "concurrent")


def unit(rng, *shape):
    vector = rng.normal(size=(3, *shape))
    return vector / np.sqrt((vector * vector).sum(axis=0))


def outlines(rng, kind, k):
    """Centres (k, 3, POINTS) and radii (k, POINTS) of spheres outside of which the origin lies."""
    axis = unit(rng, k, POINTS)
    sine = rng.uniform(0.02, 0.2 if kind == "scattered" else 0.6, (k, POINTS))
    if kind == "nested":
        axis[:, k // 2 :] = axis[:, : k - k // 2]
        sine[k // 2 :] = sine[: k - k // 2] * rng.uniform(0.3, 0.99, (k - k // 2, POINTS))
    if kind == "equal":
        axis[:, k // 2 :], sine[k // 2 :] = axis[:, : k - k // 2], sine[: k - k // 2]
    if kind == "touching":  # the axes of two are as far apart as their half angles together
        aside = np.cross(axis[:, 0], axis[:, 1], axis=0)
        aside /= np.sqrt((aside * aside).sum(axis=0))
        turn = np.arcsin(sine[0]) + np.arcsin(sine[1])
        axis[:, 1] = np.cos(turn) * axis[:, 0] + np.sin(turn) * aside
    if kind == "concurrent":  # all circles meet in the direction of the first axis
        sine[1:] = np.sqrt(1.0 - np.clip((axis[:, 1:] * axis[:, :1]).sum(axis=0), 0.05, 0.99) ** 2)
    far = rng.uniform(1.0, 9.0, (k, POINTS))
    return (axis * far).swapaxes(0, 1), sine * far
