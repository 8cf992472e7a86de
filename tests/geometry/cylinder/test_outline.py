# SPDX-License-Identifier: GPL-3.0-or-later
"""How solid cylinders hide lights, against plain segments to points of the lights."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.cylinder.outline import (
    SolidView,
    casts_sharp_edge,
    hides_from_patch,
    meets_light,
    side_occlusion,
)
from adaptive_drt.geometry.receivers import Receivers
from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.registry import make_emitter
from adaptive_drt.scene.description import QuadLight, SphereLight
from plain_hits import oracle_depth
from solid_cylinders import random_set, sizes_of

PAIRS, SPOTS, PLACES = 600, 60, 12
HERE = LightMotion(np.zeros(3), np.zeros(3))


def make_light(rng, kind):
    """A light some metres above, that looks down, and points (3, SPOTS) of it."""
    size, center = 10.0 ** rng.uniform(-1.5, 0.2), np.array([0.2, -0.3, 4.0])
    if kind == "sphere":
        spot = rng.normal(size=(3, SPOTS))
        spots = center[:, None] + size * spot / np.linalg.norm(spot, axis=0)
        return make_emitter(SphereLight(tuple(center), size, (1.0,) * 3), HERE), spots
    u, v = np.array([size, 0.0, 0.0]), np.array([0.0, -size, 0.1 * size])
    a, b = rng.uniform(-1.0, 1.0, (2, SPOTS))
    a[:4], b[:4] = (-1.0, -1.0, 1.0, 1.0), (-1.0, 1.0, -1.0, 1.0)
    spots = center[:, None] + a * u[:, None] + b * v[:, None]
    return make_emitter(QuadLight(tuple(center), tuple(u), tuple(v), (1.0,) * 3), HERE), spots


class Case:
    """Cylinders between points and a light."""

    def __init__(self, seed, kind, reach=0.0, tapers=False):
        rng = self.rng = np.random.default_rng(seed)
        self.light, self.spots = make_light(rng, kind)
        self.shapes, self.records = random_set(rng, 6, 0.5, tapers)
        self.index = np.arange(PAIRS) % 6
        near = 10.0 ** rng.uniform(-1.0, 0.5, PAIRS) * rng.normal(size=(3, PAIRS))
        toward = self.shapes.center[:, self.index] - np.array([[0.2], [-0.3], [4.0]])
        self.point = (
            self.shapes.center[:, self.index] + 0.5 * near + rng.choice([0.0, 0.3], PAIRS) * toward
        )
        self.reach = np.full(PAIRS, reach)
        self.view = SolidView(
            self.shapes.center[:, self.index] - self.point,
            *sizes_of(self.shapes, self.index),
        )
        self.to = self.light.to_center(self.point)
        self.gap = self.light.to_center(self.shapes.center[:, self.index])

    def receivers(self):
        own = np.zeros(PAIRS, dtype=np.bool_)
        return Receivers(self.point, own, self.reach, None, np.arange(PAIRS))

    def blocked(self, point):
        """Whether solids block segments to the light's points: (PAIRS, SPOTS) and, beside it,
        whether those hit an end first.
        """
        way = self.spots[:, None] - point[:, :, None]
        length = np.linalg.norm(way, axis=0)
        far, axial = np.empty(length.shape), np.empty(length.shape)
        for k, record in enumerate(self.records):
            own = self.index == k
            unit = (way[:, own] / length[own]).reshape(3, -1)
            eye = np.repeat(point[:, own], SPOTS, axis=1)
            t = oracle_depth(record, unit, np.zeros(unit.shape[1]), eye)
            far[own] = t.reshape(-1, SPOTS)
            at = eye + np.where(np.isfinite(t), t, 0.0) * unit
            along = self.shapes.axis[:, k] @ (at - self.shapes.center[:, k : k + 1])
            axial[own] = (np.abs(along) > self.shapes.half[k] - 1e-9).reshape(-1, SPOTS)
        return far < length, axial > 0.0


@pytest.mark.parametrize("tapers", [False, True])
@pytest.mark.parametrize("kind", ["quad", "sphere"])
def test_hidden_light_is_hidden_and_what_is_open_is_hidden_by_ends_alone(kind, tapers):
    told = np.zeros(3, dtype=int)
    for seed in range(6):
        case = Case(seed, kind, tapers=tapers)
        graze = np.full(PAIRS, 1e-12)
        none, full = side_occlusion(case.view, case.light, case.to, case.gap, graze)
        hidden, _ = case.blocked(case.point)
        assert not (none & full).any()
        assert hidden[full].all()
        # what the parallelogram does not hide is seen through an end, on the near or the far side
        view, outside = case.view.trapezoid()
        for row in (none & outside).nonzero()[0]:
            ways = case.spots[:, hidden[row]] - case.point[:, row : row + 1]
            planes = [plane[:, row] for plane in view.planes]
            within = np.all([plane @ ways > 1e-9 for plane in planes], axis=0)
            assert not (within & (view.normal[:, row] @ ways > view.height[row])).any()
        told += [none.sum(), full.sum(), (~none & ~full).sum()]
    assert (told > 50).all()


@pytest.mark.parametrize("tapers", [False, True])
@pytest.mark.parametrize("kind", ["quad", "sphere"])
def test_trapezoid_and_ends_are_the_outline(kind, tapers):
    """A segment to a light outside of the solid is blocked where one of the three blocks it."""
    for seed in range(4):
        case = Case(seed, kind, tapers=tapers)
        hidden, _ = case.blocked(case.point)
        view, outside = case.view.trapezoid()
        use = outside & ~meets_light(
            case.gap, case.view.axis, case.view.half, case.view.largest, case.light
        )
        ways = case.spots[:, None] - case.point[:, :, None]
        flat = np.all(
            [(plane[:, :, None] * ways).sum(axis=0) > 0.0 for plane in view.planes], axis=0
        )
        flat &= (view.normal[:, :, None] * ways).sum(axis=0) > view.height[:, None]
        axis, half = case.view.axis[:, :, None], case.view.half
        for side in (-1.0, 1.0):
            place = case.view.center + side * half * case.view.axis
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (place[:, :, None] * axis).sum(axis=0) / (ways * axis).sum(axis=0)
                off = t * ways - place[:, :, None]
                size = case.view.radius + side * half * case.view.slope
            inside = np.linalg.norm(off, axis=0) < size[:, None]
            flat |= inside & (t > 0.0) & (t < 1.0)
        assert np.mean((flat == hidden)[use]) > 0.9999
        assert hidden[use].mean() > 0.05


@pytest.mark.parametrize("tapers", [False, True])
@pytest.mark.parametrize("kind", ["quad", "sphere"])
def test_patches_are_hidden_as_a_whole_and_no_sharp_edge_is_missed(kind, tapers):
    told = np.zeros(3, dtype=int)
    for seed in range(8):
        reach = float(10.0 ** np.random.default_rng(seed).uniform(-3.0, -1.0))
        case = Case(seed, kind, reach, tapers=tapers)
        receivers = case.receivers()
        whole = hides_from_patch(case.view, case.light, receivers, case.to, case.gap)
        sharp = casts_sharp_edge(case.view, case.light, receivers, case.to, case.gap)
        all_, none = np.zeros((2, PAIRS), dtype=np.bool_)
        for _ in range(PLACES):
            step = case.rng.normal(size=(3, PAIRS))
            step *= reach / np.linalg.norm(step, axis=0)
            hidden, _ = case.blocked(case.point + step)
            assert hidden[whole].all()
            all_ |= hidden.all(axis=1)
            none |= ~hidden.any(axis=1)
        # points of a quad light's patch behind it see nothing, which counts for neither
        assert not (all_ & none & ~sharp).any()
        told += [whole.sum(), (all_ & none).sum(), (~sharp).sum()]
    assert (told > 10).all()
