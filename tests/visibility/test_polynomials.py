# SPDX-License-Identifier: GPL-3.0-or-later
"""Things in boxes as polynomials: their signs and bounds against plain rays through the boxes."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import Sphere
from adaptive_drt.visibility.polynomials import make_polynomials, polynomial_range
from plain_hits import oracle_depth, rays
from visibility_boxes import PLAIN, every_pair, planned, random_boxes, random_shapes

DEGREES = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


def value_at(form, place):
    """Values (m,) of polynomials (T, k, m) at places (3, m) of a box, each from -1/2 to 1/2."""
    x, y, t = place
    return sum(
        form[power, k] * t**power * x ** DEGREES[k][0] * y ** DEGREES[k][1]
        for power in range(form.shape[0])
        for k in range(form.shape[1])
    )


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_signs_and_bounds_are_those_of_rays(moving, seed):
    rng = np.random.default_rng(seed)
    shapes = random_shapes(rng, moving)
    plan, boxes = planned(*shapes), random_boxes(rng, 60, moving)
    pairs = every_pair(plan, 60)
    forms, cover = make_polynomials(plan, boxes, pairs)
    met, missed = np.zeros((2, pairs.item.size), dtype=bool)
    for _ in range(25):
        place = rng.uniform(-0.5, 0.5, (3, pairs.item.size))
        x, y, t = boxes.middle[:, pairs.pixel] + place * boxes.size[:, pairs.pixel]
        w = plan.lens.directions(x, y)
        ray = rays(PLAIN, x, y)
        for number, shape in enumerate(shapes):
            own = np.flatnonzero(pairs.item == number)
            far = oracle_depth(shape, ray[:, own], t[own], np.zeros((3, 1)))
            hit = np.isfinite(far)
            met[own] |= hit
            missed[own] |= ~hit
            with np.errstate(invalid="ignore"):
                far = far / np.linalg.norm(w[:, own], axis=0)
            assert (far[hit] >= cover.near[own][hit] * (1 - 1e-9)).all(), f"seed {seed}"
            assert (far[hit] <= cover.far[own][hit] * (1 + 1e-9)).all(), f"seed {seed}"
            at = forms.place[own]
            if isinstance(shape, Sphere):
                d = value_at(forms.balls.discriminant[..., at], place[:, own])
                ahead = value_at(forms.balls.along[..., at], place[:, own]) > 0.0
                inside = value_at(forms.balls.gap[..., at], place[:, own]) < 0.0
                ours = inside | ((d >= 0.0) & ahead)
                clear = np.abs(d) > 1e-9 * np.abs(d).max()
            else:
                side = np.sign(value_at(forms.flats.height[..., at], place[:, own]))
                parts = [*forms.flats.edges, forms.flats.facing]
                values = np.array([side * value_at(f[..., at], place[:, own]) for f in parts])
                ours = (values >= 0.0).all(axis=0)
                clear = (np.abs(values) > 1e-9 * np.abs(values).max()).all(axis=0)
            np.testing.assert_array_equal(ours[clear], hit[clear], f"seed {seed}")
    assert not (met & ~cover.some).any() and not (missed & cover.full).any(), f"seed {seed}"
    assert cover.some.mean() < 1.0 or len(shapes) < 3


@pytest.mark.parametrize("seed", range(10))
def test_ranges_hold_everywhere_in_the_box(seed):
    rng = np.random.default_rng(seed)
    form = rng.normal(size=(3, 6, 20))
    low, high = polynomial_range(form)
    place = rng.uniform(-0.5, 0.5, (3, 2_000, 1))
    values = value_at(form[:, :, None, :], place)
    assert (values >= low - 1e-12).all() and (values <= high + 1e-12).all()
    # the range of a linear one is exact
    form[1:], form[:, 3:] = 0.0, 0.0
    low, high = polynomial_range(form)
    corners = [
        value_at(form, np.array([[x], [y], [0.0]])) for x in (-0.5, 0.5) for y in (-0.5, 0.5)
    ]
    np.testing.assert_allclose(low, np.min(corners, axis=0), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(high, np.max(corners, axis=0), rtol=1e-12, atol=1e-15)


def test_x_and_y_may_be_exchanged():
    rng = np.random.default_rng(3)
    shapes = random_shapes(rng, True)
    plan, boxes = planned(*shapes), random_boxes(rng, 20, True)
    pairs = every_pair(plan, 20)
    forms, _ = make_polynomials(plan, boxes, pairs)
    place = rng.uniform(-0.5, 0.5, (3, 1))
    before = value_at(forms.balls.discriminant, place), value_at(forms.flats.facing, place)
    forms.turn(np.ones(pairs.item.size, dtype=bool))
    place = place[[1, 0, 2]]
    after = value_at(forms.balls.discriminant, place), value_at(forms.flats.facing, place)
    for one, other in zip(before, after, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)
