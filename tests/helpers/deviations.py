# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the light at the middle of a patch is from its mean over it, by many points of it."""

from __future__ import annotations

import numpy as np

from adaptive_drt.shading.direct_light import shade
from adaptive_drt.tracing.occluder_culling import Occluders
from shaded import hits_at, patches_at

SIDE = 9


def foreseen_and_found(plan, x, y, item, half):
    """Deviations (n,) that are foreseen and those of the middle from the mean, over its size.

    half : half the extents of the patches in pixels and shutter time.
    """
    occluders = Occluders(plan)
    hits, patch = patches_at(plan, x, y, item, half)
    middle = shade(plan, occluders, hits, 0.0, patch)
    grid = (np.arange(SIDE) + 0.5) / SIDE * 2.0 - 1.0
    a, b, t = (part.ravel() for part in np.meshgrid(grid, grid, grid if half[2] else [0.0]))
    total = np.zeros_like(middle.color)
    for i, j, k in zip(a, b, t, strict=True):
        time = float(k * half[2])
        w, far, points = hits_at(plan, x + i * half[0], y + j * half[1], item, time)
        del w, far
        _, tiny = patches_at(plan, x, y, item, (1e-9, 1e-9, 0.0))
        total += shade(plan, occluders, points, np.full(x.size, time), tiny).color
    off = np.sqrt(((middle.color - total / a.size) ** 2).mean(axis=0))
    return middle.deviation, off
