# SPDX-License-Identifier: GPL-3.0-or-later
"""What shapes tell of the light that they hide, against segments sampled to the light."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.footprint import Footprint
from adaptive_drt.geometry.polygon.shape import ParallelogramSet
from adaptive_drt.geometry.polygon.triangle import TriangleSet
from adaptive_drt.geometry.receivers import Receivers
from adaptive_drt.geometry.sphere.shape import SphereSet
from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.registry import make_emitter
from adaptive_drt.numerics.vector import dot, norm
from adaptive_drt.scene.description import DiskLight, Motion, PointLight, QuadLight, SphereLight
from stand_in_shapes import EnclosedSet

PAIRS, SPOTS, PLACES = 1_500, 40, 25
"""Pairs of receivers and shapes, points of the light a receiver, and points of a patch."""
SEEDS = 3
LIGHTS = ("quad", "sphere", "disk", "point")
INDEX = np.arange(PAIRS)


def make_light(rng, kind, moving=False, largest=2.0):
    """A light of up to a largest size in metres, some metres above, that looks down."""
    place, power = tuple(rng.normal((0.0, 0.0, 4.0))), (1.0, 1.0, 1.0)
    size = float(largest * 10.0 ** rng.uniform(-2.3, 0.0))
    u, v = size * np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    if np.cross(u, v)[2] > 0.0:
        v = -v
    motion = Motion(tuple(rng.normal(scale=0.3, size=3))) if moving else None
    record = {
        "quad": QuadLight(place, tuple(u), tuple(rng.uniform(0.2, 1.0) * v), power, motion),
        "sphere": SphereLight(place, size, power, motion),
        "disk": DiskLight(place, size, power, motion),
        "point": PointLight(place, power, motion),
    }[kind]
    return make_emitter(record, LightMotion(np.zeros(3), np.zeros(3)))


def spread(rng, low, high, count=PAIRS):
    """Positive numbers, uniform in their logarithm."""
    return 10.0 ** rng.uniform(low, high, count)


def unit(rng, *shape):
    """Unit vectors (3, *shape)."""
    vector = rng.normal(size=(3, *shape))
    return vector / np.linalg.norm(vector, axis=0)


def make_spheres(rng, place, displacement):
    """Spheres that touch places (3, PAIRS), hold them, or are beside them."""
    radius = spread(rng, -2.0, 0.5)
    return SphereSet(
        place + rng.choice([0.0, 0.5, 1.1], PAIRS) * radius * unit(rng, PAIRS), radius, displacement
    )


def make_polygons(kind, rng, place, displacement):
    """Polygons around, and beside, places (3, PAIRS); some are thin."""
    u, v = spread(rng, -2.0, 1.0) * rng.normal(size=(2, 3, PAIRS))
    v = v * rng.choice([1.0, 0.01], PAIRS)
    share = rng.choice([0.0, 0.25, 0.3, 0.5, 1.2], (2, PAIRS))
    return kind(place - share[0] * u - share[1] * v, u, v, displacement)


KINDS = {
    "spheres": make_spheres,
    "parallelograms": lambda *rest: make_polygons(ParallelogramSet, *rest),
    "triangles": lambda *rest: make_polygons(TriangleSet, *rest),
}
ALL_KINDS = {**KINDS, "enclosed": lambda *rest: EnclosedSet(make_spheres(*rest))}


class Case:
    """Shapes of one kind near the ways from receivers to a light, some beside or behind it."""

    def __init__(
        self, seed, kind, light, moving=False, light_moves=False, reach=(-3.0, 0.0), largest=2.0
    ):
        rng = self.rng = np.random.default_rng([seed, LIGHTS.index(light)])
        self.light = make_light(rng, light, light_moves, largest)
        self.point = rng.uniform(-2.0, 2.0, (3, PAIRS)) * np.array([[1.0], [1.0], [0.3]])
        to = self.light.to_center(self.point) + self.light.radius * rng.normal(size=(3, PAIRS))
        place = self.point + rng.choice([0.01, 0.1, 0.3, 0.6, 0.9, 1.2], PAIRS) * to
        shift = spread(rng, -2.0, 0.3) * rng.normal(size=(3, PAIRS)) if moving else None
        self.shapes = ALL_KINDS[kind](rng, place, shift)
        self.reach = spread(rng, *reach)

    def receivers(self, point=None, footprint=None):
        point = self.point if point is None else point
        own = np.zeros(PAIRS, dtype=np.bool_)
        return Receivers(point, own, self.reach, footprint, INDEX)

    def blocked(self, point, time=0.0):
        """Whether shapes block segments to spots of the light, and which spots shine: (PAIRS, k).

        point : (3, PAIRS).  time : (PAIRS,) or a number.
        """
        rng, light = self.rng, self.light
        start = point[:, :, None]
        time = np.broadcast_to(time, PAIRS)
        to = light.to_center(point, time)[:, :, None]
        a, b = rng.uniform(size=(2, PAIRS, SPOTS))
        # the rim of a round light, and the corners of a quad
        a[:, :8], b[:, :8] = 1.0 - 1e-12, np.linspace(0.0, 1.0, 8)
        b[:, :4] = (0.0, 1.0, 0.0, 1.0) if light.span is not None else b[:, :4]
        a[:, 2:4] = 0.0 if light.span is not None else a[:, 2:4]
        up = to / np.linalg.norm(to, axis=0)
        way, weight = light.sample(to, start, up, a, b)
        # without an extent all ways lead to the centre; behind a quad light nothing shines
        found = self.shapes.blocks(INDEX[:, None], start, np.ascontiguousarray(way), time[:, None])
        return found, np.broadcast_to(weight > 0.0, found.shape)

    def places(self):
        """Points (3, PAIRS) within reach of the receivers' points, one set after the other."""
        for k in range(PLACES):
            share = 1.0 if k % 2 else self.rng.uniform(size=PAIRS)
            yield self.point + share * self.reach * unit(self.rng, PAIRS)

    def cuts_patch(self, time=0.0):
        """Whether balls that the light reaches into cut the patches: (PAIRS,).

        Of such a patch, the points inside are lit from within. They are visible only from inside,
        and the curve of intersection is an edge of the picture in any case.
        """
        center, radius = self.shapes.bounding_spheres
        if self.shapes.displacement is not None:
            center = center + time * self.shapes.displacement
        near = norm(self.light.to_center(center)) <= radius + self.light.radius
        return near & (np.abs(norm(center - self.point) - radius) <= self.reach)

    def footprints(self):
        """Footprints of pixels within reach, and points (3, PAIRS) in them, set after set."""
        rng = self.rng
        steps = 0.4 * self.reach * unit(rng, 2, PAIRS).swapaxes(0, 1)
        steps[1] *= spread(rng, -2.0, 0.0)
        off = 0.1 * self.reach * spread(rng, -3.0, 0.0)
        points = []
        for k in range(PLACES):
            x, y = rng.uniform(-1.0, 1.0, (2, PAIRS)) if k > 3 else (1 - k % 2 * 2, 1 - k // 2 * 2)
            points.append(self.point + x * steps[0] + y * steps[1] + off * unit(rng, PAIRS))
        return Footprint((steps[0], steps[1]), off), points


@pytest.mark.parametrize("moving", (False, True))
@pytest.mark.parametrize("order", (1, 2))
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("kind", ALL_KINDS)
def test_hidden_light_is_hidden_and_open_light_is_open(kind, light, order, moving):
    told = np.zeros(3, dtype=int)
    for seed in range(SEEDS):
        case = Case(seed, kind, light, moving, moving)
        time = case.rng.uniform(-0.5, 0.5, PAIRS) if moving else 0.0
        none, full = case.shapes.occlusion(INDEX, case.light, case.receivers(), time, order)
        blocked, shines = case.blocked(case.point, time)
        assert not (none & full).any()
        assert not (none[:, None] & blocked & shines).any()
        assert not (full[:, None] & ~blocked & shines).any()
        told += [none.sum(), full.sum(), (~none & ~full).sum()]
    if kind == "enclosed":
        assert not told[:2].any(), "without an answer of its own a shape may hide a part"
    else:
        assert (told[:2] > 100).all() and told[2] > (100 if light != "point" else -1)


@pytest.mark.parametrize("time", (0.0, 0.5))
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("kind", ALL_KINDS)
def test_patches_are_hidden_as_a_whole(kind, light, time):
    told = np.zeros(2, dtype=int)
    for seed in range(SEEDS):
        case = Case(seed, kind, light, True, reach=(-4.0, -1.0))
        receivers = case.receivers()
        full = case.shapes.occlusion(INDEX, case.light, receivers, time, 2)[1]
        hidden = full & case.shapes.hides_from_patch(INDEX, case.light, receivers, time)
        if kind == "spheres":
            hidden &= ~case.cuts_patch(time)
        for point in case.places():
            blocked, shines = case.blocked(point, time)
            assert not (hidden[:, None] & ~blocked & shines).any()
        told += [hidden.sum(), (full & ~hidden).sum()]
    assert (told > 30).all() if kind != "enclosed" else not told.any()


def missed_moving_shadows(kind, light, largest):
    """Numbers of pairs whose moving shadow is missed, of those with one, and of those without."""
    told = np.zeros(3, dtype=int)
    for seed in range(SEEDS):
        case = Case(seed, kind, light, True, reach=(-4.0, 0.0), largest=largest)
        may = case.shapes.may_shadow(INDEX, case.light, case.receivers())
        some = np.zeros(PAIRS, dtype=np.bool_)
        for k, point in enumerate((case.point, *case.places())):
            time = (k % 5 - 2) / 4 if k % 2 else case.rng.uniform(-0.5, 0.5, PAIRS)
            blocked, shines = case.blocked(point, time)
            some |= (blocked & shines).any(axis=1)
        told += [(some & ~may).sum(), some.sum(), (~may).sum()]
    return told


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("kind", ALL_KINDS)
def test_no_moving_shadow_is_missed(kind, light):
    largest = 0.5 if kind in ("spheres", "enclosed") and light == "sphere" else 2.0
    missed, found, none = missed_moving_shadows(kind, light, largest)
    assert missed == 0 and min(found, none) > 100


@pytest.mark.parametrize("kind", ("spheres", "enclosed"))
def test_no_moving_shadow_of_a_large_ball_of_light_is_missed(kind):
    """A way to the rim of a light as large as its distance advances less than one to its centre."""
    assert missed_moving_shadows(kind, "sphere", 2.0)[0] == 0


@pytest.mark.parametrize("fine", (False, True))
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("kind", ALL_KINDS)
def test_no_sharp_edge_is_missed(kind, light, fine):
    """With footprints and without: all of the light is hidden from one point, none from another."""
    told = np.zeros(2, dtype=int)
    for seed in range(SEEDS):
        case = Case(seed, kind, light, reach=(-3.0, -0.5))
        footprint, points = case.footprints()
        if not fine:
            footprint, points = None, list(case.places())
        hidden, free = np.zeros((2, PAIRS), dtype=np.bool_)
        judges = case.shapes.spheres if kind == "enclosed" else case.shapes
        for point in points:
            none, full = judges.occlusion(INDEX, case.light, case.receivers(point), 0.0, 2)
            # behind a quad light nothing is lit, and so there is no edge
            if case.light.span is not None:
                lit = dot(case.light.span.normal, case.light.to_center(point)) < 0.0
                none, full = none & lit, full & lit
            hidden |= full
            free |= none
        if kind == "spheres":
            hidden &= ~case.cuts_patch()
        for order in (2,) if fine else (1, 2):
            receivers = case.receivers(footprint=footprint)
            sharp = case.shapes.casts_sharp_edge(INDEX, case.light, receivers, order)
            assert not (hidden & free & ~sharp).any()
        told += [(hidden & free).sum(), (~sharp).sum()]
    assert told[0] > 20 and (told[1] > 100 if kind != "enclosed" else told[1] == 0)


@pytest.mark.parametrize("kind", ALL_KINDS)
def test_a_point_light_is_hidden_from_whole_footprints(kind):
    told = 0
    for seed in range(SEEDS):
        case = Case(seed, kind, "point", reach=(-3.0, -0.5))
        footprint, points = case.footprints()
        receivers = case.receivers(footprint=footprint)
        hidden = case.shapes.hides_from_footprint(INDEX, case.light, receivers)
        for point in points:
            assert not (hidden & ~case.blocked(point)[0].all(axis=1)).any()
        told += hidden.sum()
    assert (told > 30) == (kind == "spheres")


def points_of(case):
    """A point (3, PAIRS) of each shape; of spheres, one of their inside."""
    rng, shapes = case.rng, case.shapes
    if isinstance(shapes, SphereSet | EnclosedSet):
        center, radius = shapes.bounding_spheres
        return center + radius * rng.uniform(size=PAIRS) * unit(rng, PAIRS)
    vertices = shapes.vertices(shapes.corner, shapes.edge_u, shapes.edge_v)
    share = rng.dirichlet(np.ones(len(vertices)), PAIRS).T
    return sum(a * b for a, b in zip(share, vertices, strict=True))


@pytest.mark.parametrize("light", ("sphere", "disk"))
@pytest.mark.parametrize("kind", ALL_KINDS)
def test_shapes_near_a_light_are_known(kind, light):
    told = np.zeros(2, dtype=int)
    for seed in range(SEEDS):
        case = Case(seed, kind, light)
        near = case.shapes.may_reach_light(INDEX, case.light)
        found = np.zeros(PAIRS, dtype=np.bool_)
        for _ in range(PLACES):
            found |= norm(case.light.to_center(points_of(case))) <= case.light.radius
        assert not (found & ~near).any()
        told += [found.sum(), (~near).sum()]
    assert (told > 30).all()
