# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of a whole scene as detection sees them, and as many rays through each of them do."""

from __future__ import annotations

import numpy as np

from adaptive_drt.detection.detect import detect, trace_center_rays
from adaptive_drt.scene.description import Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Tile, find_candidates, screen_bounds
from adaptive_drt.tracing.occluder_culling import Occluders
from oracle.camera import rays
from plain_hits import oracle_depth


def traced(scene, **settings):
    """Plan, tile and centre rays of all pixels of a scene."""
    plan = make_plan(scene, Settings(**settings))
    tile = Tile.make(plan, 0, 1)
    pairs = find_candidates(plan, screen_bounds(plan), tile)
    return plan, tile, trace_center_rays(plan, tile.x, tile.y, pairs)


def detected(scene, **settings):
    """Plan, tile, centre rays and flags of all pixels of a scene."""
    plan, tile, center = traced(scene, **settings)
    return plan, tile, center, detect(plan, Occluders(plan), center, lambda _: None)


def in_order(scene):
    """The scene's shapes as a plan numbers them: spheres first."""
    return sorted(scene.shapes, key=lambda shape: not isinstance(shape, Sphere))


def depths(scene, x, y, t):
    """Distances (s, n) of all shapes along rays through x, y at t, and those rays: (3, n) each."""
    origin, ray = rays(scene.camera, x, y, t)
    far = [oracle_depth(shape, ray.T, t, origin.T) for shape in in_order(scene)]
    return np.array(far), origin.T, ray.T


def seen(scene, x, y, t):
    """Shape (n,) that is seen through x, y at t, -1 for none, and the points (3, n) where."""
    far, origin, ray = depths(scene, x, y, t)
    item = np.where(np.isfinite(far).any(axis=0), far.argmin(axis=0), -1)
    with np.errstate(invalid="ignore"):
        return item, origin + far.min(axis=0) * ray


def grid(side, times=1):
    """Places (side^2 times, 3) in a pixel and the shutter, off the pixel's own sides."""
    across = (np.arange(side) + 0.5) / side - 0.5
    when = np.zeros(1) if times == 1 else np.linspace(-0.5, 0.5, times)
    return np.stack(np.meshgrid(across, across, when), axis=-1).reshape(-1, 3)
