# SPDX-License-Identifier: GPL-3.0-or-later
"""Quads that stand in patches: what is seen of a patch is all before a wall, against rays."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.polygon.kernels import distance_to_quad, quad_edges
from adaptive_drt.geometry.polygon.standing import shadowing_edges
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Material, Quad, Scene, SphereLight
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.footprint import make_patch
from adaptive_drt.shading.variation import pair_receivers
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, intersect_pairs, surface
from oracle.converged import relative_rmse
from plain_hits import oracle_depth, rays
from random_scenes import look_at
from shape_sets import quads_of
from solid_boxes import turned

FLOOR = Quad((-50.0, -50.0, 0.0), (100.0, 0.0, 0.0), (0.0, 100.0, 0.0), Material())
LAMP = SphereLight((3.0, -2.0, 9.0), 0.5, (10.0, 10.0, 10.0))
SIZE, PLACES = 24, 40


def wall(rng, foot=0.0):
    """A quad that stands in the floor, or somewhat over it, upright or leaning."""
    along = np.append(rng.normal(size=2), 0.0)
    along *= 10.0 ** rng.uniform(-0.5, 1.0) / np.linalg.norm(along)
    up = rng.normal(scale=0.4, size=3) + np.array([0.0, 0.0, 1.0])
    up *= 10.0 ** rng.uniform(-1.0, 0.5) / abs(up[2])
    corner = np.append(rng.normal(scale=0.3, size=2), foot) - 0.5 * along
    return Quad(tuple(corner), tuple(along), tuple(up))


def standing(rng, foot=0.0, above=False):
    """A wall, its camera, and patches of the floor with what `free_edges` says of them.

    above : the camera looks down on it, and over its top.
    """
    quad = wall(rng, foot)
    place = 3.0 * rng.normal(size=3)
    place[2] = abs(place[2]) + 0.02
    if above:
        top = np.array(quad.corner) + 0.5 * np.array(quad.edge_u) + np.array(quad.edge_v)
        place = top * 10.0 ** rng.uniform(0.5, 1.5) + rng.normal(scale=0.05, size=3)
    camera = look_at(tuple(place), (0.0, 0.0, 0.1), resolution=(SIZE, SIZE))
    plan = make_plan(Scene(camera, (FLOOR, quad), (LAMP,)), Settings(threads=1))
    y, x = (part.ravel() + 0.5 for part in np.mgrid[:SIZE, :SIZE])
    w = plan.lens.directions(x, y)
    far = [intersect_pairs(plan, w, np.full(x.size, item)) for item in (0, 1)]
    rows = np.flatnonzero(np.isfinite(far[0]) & (far[0] < far[1]))
    w, t, floor = w[:, rows], far[0][rows], np.zeros(rows.size, dtype=np.int64)
    hits = surface(plan, w, t, floor)
    half = np.array([[0.5], [0.5], [0.0]]) + np.zeros((3, rows.size))
    patch = make_patch(plan, w, t, hits, half)
    corner = quads_of(plan).corner[:, 1:] - hits.point
    u, v = (edge[:, 1:] + 0.0 * corner for edge in (quads_of(plan).edge_u, quads_of(plan).edge_v))
    normal = np.cross(u, v, axis=0)
    normal *= np.sign((corner * normal).sum(axis=0)) / np.linalg.norm(normal, axis=0)
    height = (corner * normal).sum(axis=0)
    pairs = Pairs(np.arange(rows.size), floor + 1)
    through = np.abs((patch.steps * normal).sum(axis=1))
    edges, still = quad_edges(corner, u, v), 0.0 * corner
    receivers = pair_receivers(hits, patch, pairs, 0.0)
    found = shadowing_edges(receivers, edges, normal, height, still, through)
    touched = distance_to_quad(corner, u, v) <= patch.radius
    return quad, camera, (x[rows], y[rows]), touched, found


@pytest.mark.parametrize("above", [False, True])
@pytest.mark.parametrize("seed", range(60))
def test_all_that_is_seen_of_a_patch_is_before_its_wall(seed, above):
    rng = np.random.default_rng(seed)
    quad, camera, (x, y), touched, (walls, free) = standing(rng, above=above)
    chosen = np.flatnonzero(touched & walls & free.any(axis=0))
    if not chosen.size:
        return
    off = rng.uniform(-0.5, 0.5, (2, chosen.size, PLACES))
    ray = rays(camera, *((c[chosen, None] + o).ravel() for c, o in zip((x, y), off, strict=True)))
    still, eye = np.zeros(ray.shape[1]), np.array(camera.matrix)[:3, 3:]
    depth, before = (oracle_depth(each, ray, still, eye) for each in (FLOOR, quad))
    seen = np.isfinite(depth) & (depth < before)
    point = eye + ray * np.where(seen, depth, 1.0)
    across = np.cross(quad.edge_u, quad.edge_v)
    side = np.sign(across @ (point - np.array(quad.corner)[:, None]))
    own = np.sign(across @ (eye[:, 0] - np.array(quad.corner)))
    behind = (seen & (side != own)).reshape(chosen.size, PLACES).mean(axis=1)
    print(f"seed {seed}: {chosen.size} patches, at most {behind.max():.3f} seen behind the wall")
    # patches are sizes, not bounds: perspective may show a sliver
    assert behind.max() <= 0.05


def test_feet_of_walls_are_found_and_gaps_under_them_are_not(count=60):
    found = {0.0: 0, 0.02: 0}
    for foot in found:
        for seed in range(count):
            *_, touched, (walls, _) = standing(np.random.default_rng(seed), foot)
            found[foot] += int((touched & walls).sum())
    print(found)
    assert found[0.0] > 300
    assert found[0.02] < 0.5 * found[0.0]


def test_boxes_on_a_floor_take_few_points():
    """Their feet and their sides' common edges are no steps of light (they were: 2.4 points)."""
    shapes = turned((-0.6, -0.2, 0.0), (0.8, 0.5, 0.6), 0.4, name="Low")
    shapes += turned((0.5, 0.6, 0.0), (0.4, 0.4, 1.0), 1.1, name="High")
    camera = look_at((1.0, -6.0, 3.5), (0.0, 0.2, 0.2), resolution=(64, 48))
    scene = Scene(camera, (FLOOR, *shapes), (LAMP,))
    coarse, fine = (render_image(scene, Settings(tolerance=t, threads=1)) for t in (1e-2, 3e-4))
    off = relative_rmse(coarse.color, fine.color)
    points = float(coarse.samples.mean())
    print(f"{points:.2f} points a pixel, off by {off:.1e}")
    assert off < 0.5e-2
    assert points < 2.0
