# SPDX-License-Identifier: GPL-3.0-or-later
"""Sides of cylinders seen through boxes, with their ends, by plain rays."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.cylinder.line_polynomials import SideForms
from adaptive_drt.numerics.box_polynomials import Boxes
from adaptive_drt.numerics.line_lattice import Lattice, SideLattice
from adaptive_drt.scene.description import Cylinder, Motion, Quad, Sphere, vector_of
from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.visibility.fragments import find_fragments
from adaptive_drt.visibility.line_intervals import (
    depth_coefficients,
    evaluate_depth,
    hit_intervals,
)
from adaptive_drt.visibility.polynomials import make_polynomials
from plain_hits import oracle_depth, rays
from solid_cylinders import CAMERA, EYE, SIZE, planned, random_cylinder

SAMPLES = (np.arange(200) + 0.5) / 200 - 0.5


def random_boxes(rng, count, moving):
    size = 10 ** rng.uniform(-1.0, 0.3, (3, count))
    size[2] = np.minimum(size[2], 1.0) if moving else 0.0
    middle = rng.uniform(3.0, SIZE - 3.0, (3, count))
    middle[2] = rng.uniform(-0.5, 0.5, count) * (1.0 - size[2]) if moving else 0.0
    return Boxes(middle - size / 2, middle + size / 2)


def every_pair(plan, count):
    box, item = np.divmod(np.arange(count * plan.shapes.count), plan.shapes.count)
    return Pairs(box, item)


def rays_of(boxes, lattice, shape):
    """Plain rays (3, n) and times (n,) along all lines; n is the size of `shape` (..., samples)."""
    others = [k for k in range(3) if k != lattice.axis]
    place = np.empty((3, *shape))
    place[lattice.axis] = SAMPLES
    place[others[0]], place[others[1]] = lattice.u[..., None], lattice.v[..., None]
    place = boxes.middle[:, None, None, :, None] + place * boxes.size[:, None, None, :, None]
    x, y, t = place.reshape(3, -1)
    return rays(CAMERA, x, y), t


@pytest.mark.parametrize("tapers", [False, True])
@pytest.mark.parametrize("around", [False, True])
@pytest.mark.parametrize(
    "lattice", [Lattice(0, 2, 2), Lattice(1, 3, 1), Lattice(2, 2, 2), SideLattice(2, 2, 1)]
)
def test_lines_hit_the_solid_where_plain_rays_do(lattice, around, tapers):
    """The side's interval is that of the solid, and its depth is nowhere before the solid's."""
    met, count = 0, 30
    for seed in range(10):
        rng = np.random.default_rng(seed)
        cylinder = random_cylinder(rng, True, around, tapers)
        plan = planned(cylinder)
        boxes = random_boxes(rng, count, True)
        forms, cover = make_polynomials(plan, boxes, every_pair(plan, count))
        assert isinstance(forms.groups[-1], SideForms)
        low, high = hit_intervals(forms, cover.all_hit, lattice)
        depth = evaluate_depth(
            depth_coefficients(forms, lattice)[..., None], SAMPLES[None, None, None]
        )
        shape = (lattice.rows, lattice.columns, count, SAMPLES.size)
        ray, t = rays_of(boxes, lattice, shape)
        far = oracle_depth(cylinder, ray, t, EYE)
        far = (far * -ray[2]).reshape(shape)  # ray parameters are depths along the camera's axis
        each = (lattice.rows, lattice.columns, count, plan.shapes.count)
        low, high = (end.reshape(each)[..., None] for end in (low, high))
        inside = (low <= SAMPLES) & (high >= SAMPLES)
        edge = np.minimum(np.abs(SAMPLES - low), np.abs(SAMPLES - high))
        clear = ((edge > 1e-6) | (high == low)).all(axis=3)
        side = inside[..., -1, :]
        assert (side == np.isfinite(far))[clear].all(), seed
        every = np.where(inside, depth.reshape((*each, SAMPLES.size)), np.inf)
        seen = clear & np.isfinite(far)
        np.testing.assert_allclose(every.min(axis=3)[seen], far[seen], rtol=1e-6)
        met += np.count_nonzero(seen)
        own = np.arange(plan.shapes.count - 1, cover.near.size, plan.shapes.count)
        front = (every[..., -1, :] < every[..., :-1, :].min(axis=3, initial=np.inf)) & seen
        for bound, sign in ((cover.near[own], 1.0), (cover.far[own], -1.0)):
            beyond = sign * every[..., -1, :] >= sign * bound[:, None] * (1.0 - sign * 1e-9)
            assert beyond[front].all()
        assert not front[:, :, ~cover.may_hit[own]].any()
        assert front[:, :, cover.all_hit[own]].all()
    assert met > 1000


def test_ends_in_the_plane_of_the_camera_bound_the_side():
    """Also where rounding leaves nothing of the ends themselves."""
    for shift in (0.0, 1e-17, -1e-12, 1e-9):
        plan = planned(Cylinder((shift, 0.1, -5.0), (2.0 + shift, 0.1, -5.0), 1.0))
        low = np.array([[SIZE / 2 - 0.5], [SIZE / 2], [0.0]])
        boxes = Boxes(low, low + np.array([[1.0], [0.5], [0.0]]))
        forms, cover = make_polynomials(plan, boxes, every_pair(plan, 1))
        own = plan.shapes.count - 1
        first, last = (
            end[0, 0, own] for end in hit_intervals(forms, cover.all_hit, Lattice(0, 1, 1))
        )
        np.testing.assert_allclose((first, last), (0.0, 0.5), atol=1e-6)


def scene(rng, moving, tapers):
    shapes = [random_cylinder(rng, moving, tapers=tapers) for _ in range(3)]
    center = rng.normal(size=3) * 0.4 + (0.0, 0.0, -4.0)
    motion = Motion(vector_of(rng.normal(size=3) * 0.3)) if moving else None
    shapes.append(Sphere(vector_of(center), 0.7, motion=motion))
    shapes.append(Quad((-2.0, -1.5, -4.2), (4.0, 0.0, -0.5), (0.2, 3.0, 0.3)))
    return shapes


def plain_weights(shapes, low, high, points):
    """Weights (1 + shapes,) of a box, the background first, by an even set of points."""
    place = low[:, None] + points * (high - low)[:, None]
    ray = rays(CAMERA, place[0], place[1])
    depth = [np.full(ray.shape[1], 1e300), *(oracle_depth(s, ray, place[2], EYE) for s in shapes)]
    return np.bincount(np.argmin(depth, axis=0), minlength=len(depth)) / ray.shape[1]


@pytest.mark.slow
@pytest.mark.parametrize("tapers", [False, True])
@pytest.mark.parametrize("moving", [False, True])
def test_fragments_are_those_of_plain_rays(moving, tapers):
    """Among spheres and quads, through which the cylinders go."""
    count = 1 << 13
    steps = np.array([1.0 / count, 0.7548776662466927, 0.5698402909980532])
    points = (np.arange(count) * steps[:, None] + 0.5 / count) % 1.0
    accuracy, off, honest = 5e-3, [], []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        shapes = scene(rng, moving, tapers)
        plan = planned(*shapes)
        parts = [
            np.full(each.count, -1) if each.bodies is None else each.bodies
            for each in plan.shapes.sets
        ]
        body = np.concatenate(parts)
        # faces of one cylinder have its number, which counts the cylinders in the scene's order
        number = np.where(body >= 0, body, np.arange(body.size) + 3)
        boxes = random_boxes(rng, 80, moving)
        found = find_fragments(plan, boxes, every_pair(plan, 80), accuracy)
        mixed = (np.bincount(found.box) > 1).nonzero()[0][:12]
        for box in mixed:
            weight = plain_weights(shapes, boxes.low[:, box], boxes.high[:, box], points)
            rows = (found.box == box).nonzero()[0]
            place = np.where(found.item[rows] < 0, 0, 1 + number[found.item[rows]])
            ours = np.bincount(place, found.weight[rows], minlength=weight.size)
            off.append(np.abs(ours - weight).max() - found.motion_error[box])
            honest.append(off[-1] <= 3.0 * found.error[rows].max() + accuracy + 2e-3)
    off = np.maximum(off, 0.0)
    assert off.size >= 80 and np.mean(honest) >= 0.98
    assert np.sqrt((off**2).mean()) <= accuracy + 2e-3
