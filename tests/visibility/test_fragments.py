# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions against brute force: many points a box, plain formulas, nothing shared with the core."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.line_forms import BoxCoverage
from adaptive_drt.scene.description import Camera, Motion, Quad, Sphere
from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.visibility import fragments as regions
from adaptive_drt.visibility.depth_order import find_depth_order
from adaptive_drt.visibility.fragments import Boxes, find_fragments
from plain_hits import oracle_hits
from visibility_boxes import (
    FLOOR,
    PLAIN,
    SIZE,
    all_pairs,
    dense,
    every_pair,
    planned,
    random_boxes,
    random_shapes,
)

POINTS_A_BOX = 1 << 14


def pixels(still, rows=SIZE, times=1):
    """Boxes of whole pixels: still ones have no extent in t."""
    y, x, t = (part.ravel() for part in np.mgrid[0:rows, 0:SIZE, 0:times].astype(float))
    low = np.stack([x, y, np.zeros_like(t) if still else t / times - 0.5])
    size = np.array([1.0, 1.0, 0.0 if still else 1.0 / times])
    return Boxes(low, low + size[:, None])


def radical_inverse(points, base):
    """Van der Corput's sequence: with the numbers themselves, Hammersley's points."""
    rest, value, digit = np.arange(points), np.zeros(points), 1.0 / base
    while rest.any():
        value += digit * (rest % base)
        rest, digit = rest // base, digit / base
    return value


def oracle_weights(camera, shapes, low, high, points=POINTS_A_BOX):
    """Weights (1 + shapes,) and centroids (3, 1 + shapes) by an evenly spread set of points."""
    first = (np.arange(points) + 0.5) / points
    spread = np.stack([first, radical_inverse(points, 2), radical_inverse(points, 3)])
    place = low[:, None] + spread * (high - low)[:, None]
    hit = oracle_hits(camera, shapes, *place) + 1
    weight = np.bincount(hit, minlength=len(shapes) + 1) / points
    sums = [np.bincount(hit, part, minlength=len(shapes) + 1) for part in place]
    with np.errstate(invalid="ignore", divide="ignore"):
        return weight, np.stack(sums) / (weight * points)


def compare(plan, shapes, boxes, accuracy, chosen):
    """Differences from brute force of the worst weight of each box, with what was estimated."""
    count = boxes.low.shape[1]
    found = find_fragments(plan, boxes, every_pair(plan, count), accuracy)
    check_form(found, boxes)
    off, claimed, apart = [], [], []
    for box in chosen:
        weight, place = oracle_weights(PLAIN, shapes, boxes.low[:, box], boxes.high[:, box])
        rows = np.flatnonzero(found.box == box)
        ours = np.zeros(weight.size)
        ours[found.item[rows] + 1] = found.weight[rows]
        off.append(np.abs(ours - weight).max())
        claimed.append(found.error[rows].max())
        for row in rows:
            item = found.item[row] + 1
            if weight[item] > 0.05:
                size = np.maximum(boxes.high[:, box] - boxes.low[:, box], 1e-9)
                away = np.abs(found.centroid[:, row] - place[:, item]) / size
                apart.append(away.max() * weight[item])
    return np.array(off), np.array(claimed), np.array(apart)


def check_form(found, boxes):
    count = boxes.low.shape[1]
    order = np.lexsort((found.item, found.box))
    assert np.array_equal(order, np.arange(found.box.size))
    assert np.array_equal(np.unique(found.box), np.arange(count))
    total = np.bincount(found.box, found.weight, minlength=count)
    np.testing.assert_allclose(total, 1.0, rtol=0, atol=1e-14)
    assert (found.weight > 0).all() and (found.error >= 0).all()
    slack = 1e-12 * (1 + np.abs(boxes.high[:, found.box]))
    assert (found.centroid >= boxes.low[:, found.box] - slack).all()
    assert (found.centroid <= boxes.high[:, found.box] + slack).all()


BRUTE = 1e-3  # what brute force itself is off by: 16,384 points, evenly spread


@pytest.mark.parametrize("moving", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_random_scenes_against_brute_force(moving):
    off, claimed, apart = [], [], []
    accuracy = 1e-2 if moving else 3e-3
    for seed in range(30):
        rng = np.random.default_rng(seed)
        shapes = random_shapes(rng, moving)
        plan = planned(*shapes)
        boxes = random_boxes(rng, 200, moving)
        found = find_fragments(plan, boxes, every_pair(plan, 200), accuracy)
        mixed = np.flatnonzero(np.bincount(found.box) > 1)
        chosen = [*mixed[:10], *rng.integers(0, 200, 2)]
        parts = compare(plan, shapes, boxes, accuracy, chosen)
        for total, part in zip((off, claimed, apart), parts, strict=True):
            total.append(part)
    off, claimed, apart = (np.concatenate(part) for part in (off, claimed, apart))
    honest = off <= 3.0 * claimed + accuracy + BRUTE
    assert honest.mean() >= 0.99
    # errors are estimated as RMS: kinks lie at random places
    assert np.sqrt((off**2).mean()) <= accuracy + BRUTE
    assert np.quantile(off, 0.99) <= 3.0 * accuracy + BRUTE
    assert np.quantile(apart, 0.99) <= 3.0 * accuracy + BRUTE


WALL = Quad((-9.0, -9.0, -6.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
SCENES = {
    "sphere sunk in the floor": (Sphere((0.2, -1.0, -5.0), 1.1), FLOOR),
    "sphere that rests on the floor": (Sphere((0.2, -0.5, -4.0), 0.5), FLOOR),
    "two spheres that cut each other": (
        Sphere((-0.4, 0.1, -5.0), 1.0),
        Sphere((0.5, -0.1, -5.2), 1.1),
    ),
    "three spheres and a wall": (
        Sphere((-0.4, 0.1, -5.5), 1.0),
        Sphere((0.5, -0.1, -5.7), 1.1),
        Sphere((0.1, 0.8, -5.6), 0.9),
        WALL,
    ),
    "two planes that cut each other": (
        WALL,
        Quad((-9.0, -9.0, -9.0), (18.0, 2.0, 5.0), (0.0, 18.0, 1.0)),
    ),
    "camera inside a sphere": (
        Sphere((0.3, 0.1, 0.4), 3.0),
        Sphere((0.2, 0.1, -2.6), 0.5),
        Quad((-1.0, -4.0, -1.0), (0.5, 0.0, -4.0), (0.0, 8.0, 0.0)),
    ),
    "a sphere that comes over the camera": (
        Sphere((0.2, 0.1, -0.6), 0.9, motion=Motion((0.4, -0.2, -2.2))),
        WALL,
    ),
    "a sphere that flies through the camera": (
        Sphere((0.1, 0.0, 0.2), 0.5, motion=Motion((1.0, 0.2, -3.0))),
        WALL,
    ),
    "a quad that comes over the camera": (
        Quad((-1.0, -1.0, -0.1), (2.0, 0.1, 0.4), (0.0, 2.0, -0.3), motion=Motion((0.3, 0.2, 1.5))),
        WALL,
    ),
    "a sphere that comes out of the floor": (
        Sphere((0.2, -1.2, -4.0), 0.8, motion=Motion((0.3, 1.0, 0.2))),
        FLOOR,
    ),
    "two that move through each other": (
        Sphere((-0.4, 0.1, -5.0), 0.9, motion=Motion((1.4, 0.0, 0.5))),
        Quad((-0.5, -1.0, -5.0), (1.0, 0.3, 0.4), (0.0, 2.0, 0.3), motion=Motion((-0.5, 0.4, 0.1))),
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_hard_scenes_against_brute_force(name):
    shapes = sorted(SCENES[name], key=lambda shape: isinstance(shape, Quad))
    moving = any(shape.motion for shape in shapes)
    plan, boxes = planned(*shapes), pixels(still=not moving)
    count = boxes.low.shape[1]
    found = find_fragments(plan, boxes, every_pair(plan, count), 3e-3)
    mixed = np.flatnonzero(np.bincount(found.box) > 1)
    rng = np.random.default_rng(3)
    chosen = [*rng.permutation(mixed)[:30], *rng.integers(0, count, 5)]
    off, claimed, apart = compare(plan, shapes, boxes, 3e-3, chosen)
    assert mixed.size > 10
    assert (off <= 3.0 * claimed + 3e-3 + BRUTE).mean() >= 0.97
    assert np.quantile(off, 0.9) <= 3e-3 + BRUTE
    assert apart.max() <= 2e-2


def test_a_tiny_sphere_has_the_area_of_its_ellipse():
    """A sphere within a pixel: the outline is an ellipse; on the axis, a circle of known radius."""
    camera = Camera(resolution=(25, 25))
    step = camera.sensor_width / camera.focal_length / 25
    for radius in (0.45, 0.2, 0.1, 0.03, 0.004):
        tangent = radius * step
        ball = Sphere((0.0, 0.0, -7.0), 7.0 * float(tangent / np.hypot(1, tangent)))
        plan = planned(ball, camera=camera)
        box = Boxes(np.array([[12.0], [12.0], [0.0]]), np.array([[13.0], [13.0], [0.0]]))
        found = find_fragments(plan, box, every_pair(plan, 1), 1e-3)
        weight = found.weight[found.item == 0].sum()
        error = found.error.max(initial=0.0)
        assert abs(weight - np.pi * radius**2) <= 3 * error + 1e-3, radius
        if radius > 0.04:
            np.testing.assert_allclose(found.centroid[:2, found.item == 0], 12.5, atol=1e-2)


def test_rays_over_time_are_exact():
    """Without extent in x and y one line is the whole truth: when a sphere covers a ray."""
    sphere = Sphere((0.0, 0.0, -10.0), 0.5, motion=Motion((4.0, 0.0, 0.0)))
    plan = planned(sphere, WALL)
    low = np.array([[SIZE / 2], [SIZE / 2], [-0.5]])
    high = np.array([[SIZE / 2], [SIZE / 2], [0.5]])
    found = find_fragments(plan, Boxes(low, high), every_pair(plan, 1), 1e-6)
    assert found.item.tolist() == [1]  # the wall is nearer
    plan = planned(sphere)
    found = find_fragments(plan, Boxes(low, high), every_pair(plan, 1), 1e-6)
    np.testing.assert_allclose(found.weight, [0.75, 0.25], atol=1e-14)  # 1 m of 4
    np.testing.assert_allclose(found.centroid[2], 0.0, atol=1e-14)
    assert found.error.max() == 0.0
    low[2] = 0.0
    found = find_fragments(plan, Boxes(low, high), every_pair(plan, 1), 1e-6)
    np.testing.assert_allclose(found.centroid[2], [0.3125, 0.0625], atol=1e-14)


def test_points_see_one_object():
    rng = np.random.default_rng(4)
    shapes = random_shapes(rng, True)
    plan = planned(*shapes)
    place = rng.uniform((0, 0, -0.5), (SIZE, SIZE, 0.5), (300, 3)).T
    found = find_fragments(plan, Boxes(place, place), every_pair(plan, 300), 1e-3)
    check_form(found, Boxes(place, place))
    np.testing.assert_array_equal(found.item, oracle_hits(PLAIN, shapes, *place))


def test_of_objects_at_the_same_place_the_first_wins():
    wall = Quad((-2.0, -1.5, -6.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0))
    plan = planned(WALL, wall, Quad(wall.corner, wall.edge_v, wall.edge_u))
    boxes = pixels(still=True)
    found = find_fragments(plan, boxes, every_pair(plan, boxes.low.shape[1]), 1e-3)
    assert np.array_equal(np.unique(found.item), [0])
    plan = planned(*[Sphere((0.1, 0.2, -4.0), 0.6)] * 2, WALL)  # a copy is no object of its own
    found = find_fragments(plan, boxes, every_pair(plan, boxes.low.shape[1]), 1e-3)
    assert np.array_equal(np.unique(found.item), [0, 1])


@pytest.mark.parametrize("moving", [False, True])
def test_a_box_does_not_depend_on_its_batch(moving):
    for seed in range(5):
        rng = np.random.default_rng(seed)
        plan = planned(*random_shapes(rng, moving), *random_shapes(rng, moving))
        boxes = random_boxes(rng, 400, moving)
        accuracy = 10 ** rng.uniform(-3, -1, 400)
        whole = find_fragments(plan, boxes, every_pair(plan, 400), accuracy)
        for part in (np.arange(400)[::-1], np.arange(7), rng.permutation(400)[:61], [3], [150]):
            some = Boxes(boxes.low[:, part], boxes.high[:, part])
            found = find_fragments(plan, some, every_pair(plan, len(part)), accuracy[part])
            for number, box in enumerate(part):
                ours, theirs = whole.box == box, found.box == number
                for name in ("item", "weight", "centroid", "error"):
                    a, b = getattr(whole, name)[..., ours], getattr(found, name)[..., theirs]
                    assert np.array_equal(a, b), (seed, box, name)


def test_more_accuracy_costs_more_lines_and_brings_less_error():
    plan, boxes = planned(*SCENES["two spheres that cut each other"]), pixels(still=True)
    pairs = every_pair(plan, boxes.low.shape[1])
    best = dense(find_fragments(plan, boxes, pairs, 1e-6, 512), boxes)
    off = []
    for accuracy in (1e-2, 1e-3, 1e-4):
        found = find_fragments(plan, boxes, pairs, accuracy, 256)
        assert found.error.max() <= accuracy
        off.append(np.abs(dense(found, boxes) - best).max())
        assert off[-1] <= 3 * accuracy
    assert off[0] > 10 * off[2]


def test_a_picture_without_objects_is_background():
    plan, boxes = planned(), pixels(still=True)
    found = find_fragments(plan, boxes, every_pair(plan, 0), 1e-3)
    assert (found.item == -1).all() and (found.weight == 1.0).all()
    check_form(found, boxes)


@pytest.mark.parametrize("moving", [False, True])
def test_settled_orders_are_those_of_depths(moving):
    """Regions stay within their errors where no order counts as settled."""
    none, within = np.zeros(150, dtype=np.bool_), []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        plan = planned(*random_shapes(rng, moving), FLOOR)
        boxes = random_boxes(rng, 150, moving)
        pairs = every_pair(plan, 150)
        found = find_fragments(plan, boxes, pairs, 1e-2)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(
                regions,
                "find_depth_order",
                lambda *a: (np.zeros(a[2].item.size, int), none, ~none, all_pairs(a[2], ~none)),
            )
            compared = find_fragments(plan, boxes, pairs, 1e-2)
        allowed = np.full(150, 2e-2)
        for one in (found, compared):
            np.maximum.at(allowed, one.box, 2e-2 + 6.0 * one.error)
        within.append(np.abs(dense(found, boxes) - dense(compared, boxes)).max(axis=1) <= allowed)
    assert np.mean(within) >= 0.99


def test_a_sphere_that_rolls_on_the_floor_is_in_front_of_it():
    ball = Sphere((0.2, -0.5, -4.0), 0.5, motion=Motion((0.4, 0.0, 0.3)))
    below = Sphere((0.2, -1.6, -4.0), 0.5, motion=Motion((0.4, 0.0, 0.3)))
    plan = planned(ball, below, FLOOR)
    boxes = Boxes(np.array([[9.0], [2.0], [-0.5]]), np.array([[10.0], [3.0], [0.5]]))
    pairs = Pairs(np.zeros(3, dtype=np.int64), np.array([2, 1, 0]))
    cover = BoxCoverage(*np.ones((2, 3), dtype=bool), np.zeros(3), *np.full((4, 3), np.inf))
    rank, settled, *_ = find_depth_order(plan, boxes, pairs, cover, np.array([3]))
    assert settled.tolist() == [True]
    assert rank.tolist() == [1, 2, 0]
