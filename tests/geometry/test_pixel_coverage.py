# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage of pixels by shapes, against rays sampled in the pixels and over the shutter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.detection.detect import detect, trace_center_rays
from adaptive_drt.detection.shadow_discontinuities import patch_reach
from adaptive_drt.geometry.camera import PinholeCamera
from adaptive_drt.geometry.ellipse.shape import EllipseSet
from adaptive_drt.geometry.ellipsoid.shape import EllipsoidSet
from adaptive_drt.geometry.polygon.shape import ParallelogramSet
from adaptive_drt.geometry.polygon.triangle import TriangleSet
from adaptive_drt.geometry.shape import UNKNOWN_CURVATURE
from adaptive_drt.geometry.shape_table import ShapeTable
from adaptive_drt.geometry.sphere.shape import SphereSet
from adaptive_drt.geometry.surface_pairs import depth_order_may_change
from adaptive_drt.scene.description import Camera, Motion, Quad, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Tile, find_candidates, screen_bounds
from adaptive_drt.tracing.occluder_culling import Occluders
from shape_sets import quads_of, spheres_of
from stand_in_shapes import EnclosedSet

SHAPES, RAYS = 2_000, 60
ROUNDING = 1e-9


def small_camera(pixel):
    """A camera whose pixels are squares of that size, one metre away."""
    return PinholeCamera(
        np.zeros(3),
        np.array([-0.5, -0.4, -1.0]),
        np.array([pixel, 0.0, 0.0]),
        np.array([0.0, pixel, 0.0]),
        np.array([0.0, 0.0, -1.0]),
    )


def lengths(rng, count):
    """Lengths of three orders of magnitude, as a row."""
    return 10.0 ** rng.uniform(-2.0, 1.0, count)


def directions(rng, camera, count):
    """Directions of `count` pixels' centres (3, count), and of rays within them (3, count, RAYS).

    The first rays are those of the pixels' corners and centres.
    """
    x, y = rng.uniform(0.0, 1.0 / camera.right[0], (2, count))
    a, b = rng.uniform(-0.5, 0.5, (2, count, RAYS))
    a[:, :5], b[:, :5] = (0.5, 0.5, -0.5, -0.5, 0.0), (0.5, -0.5, 0.5, -0.5, 0.0)
    return camera.directions(x, y), camera.directions(x[:, None] + a, y[:, None] + b)


def sphere_set(rng, w, displacement):
    """Spheres near rays (3, n): many touch them, and some hold the camera."""
    count = w.shape[1]
    depth, radius = lengths(rng, count), lengths(rng, count)
    aside = rng.normal(size=(3, count))
    aside *= rng.choice([0.0, 0.5, 1.0, 1.5], count) * radius / np.linalg.norm(aside, axis=0)
    return SphereSet(depth * w + aside, radius, displacement)


def polygon_set(kind, rng, w, displacement):
    """Polygons near rays (3, n), of which many have an edge on the ray, and some are seen edge-on.

    kind : a subclass of `PolygonSet`.
    """
    count = w.shape[1]
    depth, size = lengths(rng, count), lengths(rng, count)
    u, v = size * rng.normal(size=(2, 3, count))
    share = rng.choice([0.0, 0.25, 0.3, 0.5, 1.2], (2, count))
    return kind(depth * w - share[0] * u - share[1] * v, u, v, displacement)


def ellipse_set(rng, w, displacement):
    """Ellipses near rays (3, n): many have their edge on the ray, and some are seen edge-on."""
    count = w.shape[1]
    depth, size = lengths(rng, count), lengths(rng, count)
    u, v = size * rng.normal(size=(2, 3, count))
    share, turn = rng.choice([0.0, 0.5, 1.0, 1.5], count), rng.uniform(0.0, 2.0 * np.pi, count)
    aside = share * (np.cos(turn) * u + np.sin(turn) * v)
    return EllipseSet(depth * w - aside, u, v, displacement)


def ellipsoid_set(rng, w, displacement):
    """Ellipsoids within the balls of `sphere_set`."""
    balls = sphere_set(rng, w, displacement)
    count = w.shape[1]
    axes = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0] * rng.uniform(0.1, 1.0, (count, 1, 3))
    axes = np.ascontiguousarray(np.moveaxis(axes, 0, -1)) * balls.radius
    return EllipsoidSet(balls.center, axes, displacement)


KINDS = {
    "spheres": sphere_set,
    "ellipsoids": ellipsoid_set,
    "parallelograms": lambda *rest: polygon_set(ParallelogramSet, *rest),
    "triangles": lambda *rest: polygon_set(TriangleSet, *rest),
    "ellipses": ellipse_set,
    "enclosed": lambda *rest: EnclosedSet(sphere_set(*rest)),
}


def assert_bounds_hold(cover, t):
    """The coverage (m,) agrees with hits at ray parameters t (m, k)."""
    hit = np.isfinite(t)
    assert not (hit.any(axis=1) & ~cover.may_hit).any()
    assert not (cover.covers & ~hit.all(axis=1)).any()
    assert (np.where(hit, t, np.inf).min(axis=1) >= (1.0 - ROUNDING) * cover.near).all()
    assert (np.where(hit, t, 0.0).max(axis=1) <= (1.0 + ROUNDING) * cover.far).all()


@pytest.mark.parametrize("order", (1, 2))
@pytest.mark.parametrize("pixel", (1e-3, 0.05, 0.5))
@pytest.mark.parametrize("kind", KINDS)
def test_coverage_bounds_the_hits_of_rays(kind, pixel, order):
    rng = np.random.default_rng(1)
    camera = small_camera(pixel)
    w, rays = directions(rng, camera, SHAPES)
    shapes = KINDS[kind](rng, w, None)
    index = np.arange(SHAPES)
    cover = shapes.coverage(index, w, camera, order)
    assert_bounds_hold(cover, shapes.intersect(index[:, None], rays, 0.0))
    assert not cover.may_hit.all()
    assert cover.covers.any() == (kind != "enclosed")


@pytest.mark.parametrize("whole_pixel", (False, True))
@pytest.mark.parametrize("order", (1, 2))
@pytest.mark.parametrize("pixel", (1e-3, 0.05))
@pytest.mark.parametrize("kind", KINDS)
def test_moving_coverage_bounds_the_hits_of_rays(kind, pixel, order, whole_pixel):
    rng = np.random.default_rng(2)
    camera = small_camera(pixel)
    w, rays = directions(rng, camera, SHAPES)
    if not whole_pixel:
        rays = w[:, :, None] + np.zeros(RAYS)
    displacement = lengths(rng, SHAPES) * rng.normal(size=(3, SHAPES))
    shapes = KINDS[kind](rng, w, displacement)
    time = rng.uniform(-0.5, 0.5, (SHAPES, RAYS))
    time[:, 5:15] = np.linspace(-0.5, 0.5, 10)
    index = np.arange(SHAPES)
    cover = shapes.moving_coverage(index, w, camera, order, whole_pixel)
    assert_bounds_hold(cover, shapes.intersect(index[:, None], rays, time))
    assert not cover.may_hit.all()
    assert cover.covers.any() == (kind != "enclosed")


@pytest.mark.parametrize("kind", KINDS)
def test_one_index_stands_for_all_pixels(kind):
    rng = np.random.default_rng(3)
    camera = small_camera(0.05)
    w, _ = directions(rng, camera, 50)
    shapes = KINDS[kind](rng, w, None)
    one = shapes.coverage(np.array([7]), w, camera, 2)
    each = shapes.coverage(np.full(50, 7), w, camera, 2)
    for part in ("may_hit", "covers", "near", "far"):
        assert (getattr(one, part) == getattr(each, part)).all()


@pytest.mark.parametrize("kind", KINDS)
def test_cosines_in_a_pixel_are_bounded(kind):
    rng = np.random.default_rng(4)
    camera = small_camera(1e-3)
    w, rays = directions(rng, camera, SHAPES)
    shapes = KINDS[kind](rng, w, None)
    index = np.arange(SHAPES)
    length = np.linalg.norm(w, axis=0)
    hit = np.isfinite(shapes.intersect(index, w, 0.0)).nonzero()[0]

    def cosine(own, ray):
        t = shapes.intersect(own, ray, 0.0)
        met = np.isfinite(t)
        point = np.where(met, t, 1.0) * ray
        normal = shapes.surface(own, ray, point, 0.0)[1]
        return np.where(met, np.abs((normal * ray).sum(axis=0)) / np.linalg.norm(ray, axis=0), 1.0)

    turn = camera.half_pixel / (length - camera.half_pixel)
    point = shapes.intersect(hit, w[:, hit], 0.0) * w[:, hit]
    least = shapes.least_cosine(hit, cosine(hit, w[:, hit]), turn[hit], point)
    for k in range(RAYS):
        assert (cosine(hit, rays[:, hit, k]) >= least - ROUNDING).all()


def test_polygons_in_their_own_plane_do_not_move_under_a_ray():
    zero, one = np.zeros(3), np.eye(3)
    u, v = (np.repeat(one[:, k : k + 1], 3, axis=1) for k in (0, 1))
    shift = np.stack([one[0] - 2.0 * one[1], one[2], zero], axis=1)
    for kind in (ParallelogramSet, TriangleSet, EllipseSet):
        shapes = kind(np.ones((3, 3)), u, v, shift)
        assert shapes.moves_under_fixed_ray.tolist() == [False, True, False]
    assert SphereSet(u, np.ones(3), shift).moves_under_fixed_ray.tolist() == [True, True, False]


def covering_pairs(rng, camera):
    """A table of surfaces, and two each that cover a pixel and are near each other there."""
    w, rays = directions(rng, camera, SHAPES)
    depth = 1.0 + rng.uniform(0.0, 1.0, SHAPES)

    def planes():
        u, v = 5.0 * rng.normal(size=(2, 3, SHAPES))
        place = (depth + 0.01 * rng.normal(size=SHAPES)) * w
        return TriangleSet(place - (u + v) / 3.0, u, v, None)

    def balls():
        radius = rng.uniform(0.5, 0.9, SHAPES)
        aside = 0.2 * radius * rng.normal(size=(3, SHAPES))
        back = depth + 0.01 * rng.normal(size=SHAPES) + radius / np.linalg.norm(w, axis=0)
        return SphereSet(back * w + aside, radius, None)

    sets = (balls(), balls(), planes(), planes())
    return ShapeTable(sets), w, rays


@pytest.mark.parametrize("order", (1, 2))
@pytest.mark.parametrize("one, other", ((0, 1), (0, 2), (2, 1), (2, 3)))
def test_a_change_of_depth_order_is_found(one, other, order):
    camera = small_camera(0.02)
    table, w, rays = covering_pairs(np.random.default_rng(5), camera)
    index = np.arange(SHAPES)
    covers = np.ones(SHAPES, dtype=bool)
    depths = []
    for number in (one, other):
        shapes = table.sets[number]
        covers &= shapes.coverage(index, w, camera, order).covers
        depths.append(shapes.intersect(index[:, None], rays, 0.0))
    first = depths[0] < depths[1]
    changes = first.any(axis=1) & ~first.all(axis=1)
    items = [SHAPES * number + index for number in (one, other)]
    may = depth_order_may_change(table, *items, w, camera, order)
    assert changes[covers].any() and not may[covers].all()
    assert not (changes & ~may & covers).any()


def test_the_depth_order_of_unknown_surfaces_may_change():
    camera = small_camera(0.02)
    table, w, _ = covering_pairs(np.random.default_rng(6), camera)
    table = ShapeTable((EnclosedSet(table.sets[0]), *table.sets[1:]))
    index = np.arange(SHAPES)
    for other in range(3):
        assert depth_order_may_change(
            table, index, SHAPES * (other + 1) + index, w, camera, 2
        ).all()


def scene_of_spheres(moving):
    """Spheres that overlap, some over and in a floor; some move."""
    rng = np.random.default_rng(7)
    spheres = [
        Sphere(
            tuple(rng.uniform((-2.0, -2.0, 0.0), (2.0, 2.0, 2.0))),
            rng.uniform(0.2, 0.8),
            motion=Motion(tuple(0.3 * rng.normal(size=3))) if moving and k % 3 == 0 else None,
        )
        for k in range(12)
    ]
    floor = Quad((-3.0, -3.0, 0.0), (6.0, 0.0, 0.0), (0.0, 6.0, 0.0))
    matrix = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.6, -0.8, -6.0), (0.0, 0.8, 0.6, 5.0), (0, 0, 0, 1.0))
    return Scene(Camera(matrix=matrix, resolution=(48, 36)), (*spheres, floor), ())


def detected(plan):
    """Mask and outlines of all pixels, the points that centre rays hit, and their reaches."""
    tile = Tile.make(plan, 0, 1)
    pairs = find_candidates(plan, screen_bounds(plan), tile)
    center = trace_center_rays(plan, tile.x, tile.y, pairs)
    flags = detect(plan, Occluders(plan), center, lambda name: None)
    reach = patch_reach(plan, center.hits, center.w[:, center.rows])
    return flags.mask, flags.silhouette, center.hits, reach


@pytest.mark.parametrize("moving", (False, True))
def test_a_shape_with_the_required_methods_is_detected_conservatively(moving):
    plan = make_plan(scene_of_spheres(moving), Settings(threads=1))
    plain = replace(plan, shapes=ShapeTable((EnclosedSet(spheres_of(plan)), quads_of(plan))))
    assert (plain.shapes.curvature[:-1] == UNKNOWN_CURVATURE).all()
    mask, outline, hits, reach = detected(plan)
    other_mask, other_outline, other_hits, other_reach = detected(plain)
    assert (hits.item == other_hits.item).all()
    assert not (mask & ~other_mask).any() and not (outline & ~other_outline).any()
    assert 0 < mask[2].sum() < other_mask[2].sum() < mask[2].size
    assert mask[1].any() == moving
    ball = hits.item < spheres_of(plan).count
    assert (other_reach[~ball] == reach[~ball]).all()
    # without a bound on the cosine a patch may reach to the camera
    assert np.allclose(other_reach[ball], np.linalg.norm(hits.point[:, ball], axis=0))
