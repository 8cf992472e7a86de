# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays against embree's spheres agree with float64 but where rounding decides."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.embree_library import native_library
from adaptive_drt.geometry.embree_solids import SolidScene
from adaptive_drt.geometry.native_solids import Balls

native = pytest.mark.skipif(native_library() is None, reason="embree's library is not found")


def blocked_and_clear(start, to, center, radius, own):
    """Whether spheres cut segments (n, k), and least distances to their surfaces, by brute force.

    own : (n,) the sphere that each start lies on, or -1.
    """
    blocked = np.zeros(to.shape[1:], dtype=bool)
    clear = np.full(to.shape[1:], np.inf)
    square = (to**2).sum(axis=0)
    for number, r in enumerate(radius):
        v = (center[:, number, None] - start)[:, :, None]
        along = np.clip((v * to).sum(axis=0) / square, 0.0, 1.0)
        gap = np.sqrt(((v - along * to) ** 2).sum(axis=0))
        begins, ends = (v**2).sum(axis=0) < r * r, ((v - to) ** 2).sum(axis=0) < r * r
        other = (own != number)[:, None]
        blocked |= other & (gap < r) & ~(begins & ends)
        off = np.minimum(np.abs(gap - r), np.abs(np.sqrt(((v - to) ** 2).sum(axis=0)) - r))
        off = np.minimum(off, np.abs(np.sqrt((v**2).sum(axis=0)) - r))
        clear = np.where(other, np.minimum(clear, off), clear)
    return blocked, clear


def surface_points(rng, center, radius, count):
    """Points on spheres, their normals, and the spheres."""
    own = rng.integers(0, radius.size, count)
    normal = rng.normal(size=(3, count))
    normal /= np.sqrt((normal**2).sum(axis=0))
    return center[:, own] + radius[own] * normal, normal, own


def directions(rng, normal, rays):
    """Directions (3, n, rays) above horizons."""
    way = rng.normal(size=(*normal.shape, rays))
    way /= np.sqrt((way**2).sum(axis=0))
    return way + (1.0 + 1e-3) * normal[:, :, None]


SCENES = {
    "apart": (300, 4.0, (0.05, 0.2)),
    "overlapping": (200, 1.0, (0.1, 0.4)),
    "of many sizes": (200, 4.0, (0.005, 1.5)),
    "far from the origin": (100, 2.0, (0.1, 0.3)),
}


@native
@pytest.mark.parametrize("name", SCENES)
def test_shadow_rays_are_those_of_brute_force(name):
    count, size, (least, most) = SCENES[name]
    rng = np.random.default_rng(len(name))
    center = rng.uniform(-size, size, (3, count))
    if name == "far from the origin":
        center += 1_000.0
    radius = np.exp(rng.uniform(np.log(least), np.log(most), count))
    scene = SolidScene((Balls(center, radius),))
    start, normal, own = surface_points(rng, center, radius, 150)
    to = directions(rng, normal, 19) * rng.uniform(0.2, 3.0 * size, (150, 19))
    wanted, clear = blocked_and_clear(start, to, center, radius, own)
    known = clear > scene.rounding
    assert known.mean() > 0.95
    assert 0.05 < wanted.mean() < 0.99
    np.testing.assert_array_equal(scene.blocked(start, normal, to)[known], wanted[known])


@native
def test_rays_from_far_away_begin_at_the_ball_around_the_scene():
    rng = np.random.default_rng(2)
    center, radius = rng.uniform(-1.0, 1.0, (3, 100)), rng.uniform(0.02, 0.2, 100)
    scene = SolidScene((Balls(center, radius),))
    start = np.array([[0.0, 1e5, 3.0], [0.0, 0.0, 2e4], [-5e4, 0.0, 0.0]])
    normal = np.eye(3)
    to = 2.0 * (rng.uniform(-1.5, 1.5, (3, 3, 200)) - start[:, :, None])
    wanted, clear = blocked_and_clear(start, to, center, radius, np.full(3, -1))
    known = clear > 1e-10 * 1e5 + scene.rounding
    assert wanted.any() and not wanted.all() and known.mean() > 0.99
    np.testing.assert_array_equal(scene.blocked(start, normal, to)[known], wanted[known])
    # and rays that end before the scene are free
    assert not scene.blocked(start, normal, 0.4 * to).any()


@native
def test_endless_rays_and_no_rays():
    center, radius = np.array([[0.0, 4.0], [0.0, 0.0], [0.0, 0.0]]), np.array([1.0, 1.0])
    scene = SolidScene((Balls(center, radius),))
    start, normal = np.array([[1.0], [0.0], [0.0]]), np.array([[1.0], [0.0], [0.0]])
    to = 2.0**121 * np.array([[[1.0, 0.0]], [[0.0, 1.0]], [[0.0, 0.0]]])
    np.testing.assert_array_equal(scene.blocked(start, normal, to), [[True, False]])
    none = scene.blocked(np.zeros((3, 0)), np.zeros((3, 0)), np.zeros((3, 0, 4)))
    assert none.shape == (0, 4)


@native
@pytest.mark.parametrize("count", [1, 16, 37, 400])
def test_open_rays_are_those_that_nothing_blocks(count):
    rng = np.random.default_rng(count)
    center, radius = rng.uniform(-1.0, 1.0, (3, 150)), rng.uniform(0.05, 0.3, 150)
    corner = np.array([[-9.0, 9.0, 9.0, -9.0], [-9.0, -9.0, 9.0, 9.0], [1.4] * 4])
    scene = SolidScene((Balls(center, radius),), faces=corner[:, :, None])
    start, normal, _ = surface_points(rng, center, radius, count)
    start, normal = start[:, start[2] < 1.35], normal[:, start[2] < 1.35]
    assert scene.is_near(start).all()
    a, b = rng.uniform(0.0, 1.0, (2, start.shape[1]))
    free, way = scene.open_rays(start, normal, a, b, True)
    assert free.shape == way.shape[1:] == (4, start.shape[1])
    np.testing.assert_allclose((way**2).sum(axis=0), 1.0, atol=1e-6)
    np.testing.assert_allclose((way * normal[:, None]).sum(axis=0)[0] ** 2, 1.0 - a, atol=1e-5)
    to = np.moveaxis(way, 1, 2).astype(float)
    below = start[2][:, None] + to[2] * 100.0 < 1.4
    hit = (1.4 - start[2][:, None]) / np.where(to[2] > 0.0, to[2], 1.0)
    inside = (np.abs(start[:2, :, None] + hit * to[:2]) < 9.0).all(axis=0)
    wanted = scene.blocked(start, normal, 100.0 * to) | (inside & ~below)
    assert (free.T == ~wanted).mean() > 0.999
    assert scene.open_rays(start, normal, a, b, False)[1] is None


@native
def test_open_rays_have_the_density_of_the_cosine():
    scene = SolidScene((Balls(np.array([[50.0], [0.0], [0.0]]), np.ones(1)),))
    side = (np.arange(64) + 0.5) / 64.0
    a, b = (part.ravel() for part in np.meshgrid(side, side))
    normal = np.repeat(np.array([[0.36], [0.48], [-0.8]]), a.size, axis=1)
    start = np.array([[50.0], [0.0], [0.0]]) + normal
    free, way = scene.open_rays(start, normal, a, b, True)
    assert free.all()
    # the mean direction by the density cos / pi is 2/3 of the normal
    np.testing.assert_allclose(way.mean(axis=(1, 2)), 2.0 / 3.0 * normal[:, 0], atol=1e-4)


@native
@pytest.mark.parametrize("inside", [False, True])
def test_nearest_spheres_are_those_of_brute_force(inside):
    rng = np.random.default_rng(4)
    count, rays = 200, 3_000
    center = rng.uniform(-2.0, 2.0, (3, count)) + (0.0 if inside else 8.0)
    radius = rng.uniform(0.05, 0.4, count)
    if inside:
        center[:, 0], radius[0] = 0.1, 0.7
    way = rng.normal(size=(3, rays)) + (0.0 if inside else 2.5)
    v, ww = center[:, :, None], (way**2).sum(axis=0)
    along = (v * way[:, None]).sum(axis=0)
    square = along**2 - ww * ((center**2).sum(axis=0) - radius**2)[:, None]
    root = np.sqrt(np.maximum(square, 0.0))
    t = np.where(along - root > 0.0, along - root, along + root) / ww
    t[(square <= 0.0) | (t <= 0.0)] = np.inf
    best = t.argmin(axis=0)
    wanted = np.where(np.isfinite(t.min(axis=0)), best, -1)
    scene = SolidScene((Balls(center, radius),))
    aside = np.sqrt(((v - along / ww * way[:, None]) ** 2).sum(axis=0))
    known = np.abs(aside - radius[:, None]).min(axis=0) > scene.rounding
    first, second = np.sort(t, axis=0)[:2]
    with np.errstate(invalid="ignore"):
        known &= ~((second - first) * np.sqrt(ww) < scene.rounding)
    assert known.mean() > 0.95 and (wanted >= 0).mean() > 0.2
    np.testing.assert_array_equal(scene.nearest(way)[0][known], wanted[known])


@native
def test_grazing_rays_are_decided_by_rounding_alone():
    scene = SolidScene((Balls(np.zeros((3, 1)), np.ones(1)),))
    offset = np.array([-8.0, -2.0, 2.0, 8.0]) * scene.rounding
    start = np.array([[-3.0], [0.0], [0.0]]) + np.array([[0.0], [1.0], [0.0]]) * (1.0 + offset)
    to = np.broadcast_to(np.array([[6.0], [0.0], [0.0]])[:, :, None], (3, 4, 1))
    normal = np.broadcast_to(np.array([[1.0], [0.0], [0.0]]), (3, 4))
    np.testing.assert_array_equal(
        scene.blocked(start, normal, to)[:, 0], [True, True, False, False]
    )


@native
def test_spheres_move_during_the_shutter():
    shift = np.array([[2.0], [0.0], [0.0]])
    scene = SolidScene((Balls(np.zeros((3, 1)), np.array([0.25]), shift),))
    x = np.linspace(-1.0, 1.0, 9)
    start = np.array([x, 0.0 * x - 2.0, 0.0 * x])
    to = np.broadcast_to(np.array([[0.0], [4.0], [0.0]])[:, :, None], (3, 9, 9))
    normal = np.broadcast_to(np.array([[0.0], [1.0], [0.0]]), (3, 9))
    time = np.broadcast_to(np.linspace(-0.5, 0.5, 9), (9, 9))
    wanted = np.abs(x[:, None] - 2.0 * time) < 0.25
    known = np.abs(np.abs(x[:, None] - 2.0 * time) - 0.25) > 1e-3
    np.testing.assert_array_equal(scene.blocked(start, normal, to, time)[known], wanted[known])


@native
def test_many_scenes_share_one_device():
    """With a device for each scene embree crashes at some 1,500 of them."""
    start, normal = np.array([[-3.0], [0.0], [0.0]]), np.array([[1.0], [0.0], [0.0]])
    scenes = [SolidScene((Balls(np.zeros((3, 1)), np.ones(1)),)) for _ in range(1_600)]
    to = np.array([[[6.0]], [[0.0]], [[0.0]]])
    assert all(scene.blocked(start, normal, to).all() for scene in scenes)
