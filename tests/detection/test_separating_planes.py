# SPDX-License-Identifier: GPL-3.0-or-later
"""Planes separate what an argument in extended precision says is apart, and nothing else."""

import numpy as np
import pytest

from adaptive_drt.detection.separating_planes import (
    are_tried,
    light_corners,
    out_of_pixels,
    planes_help,
    separated,
)
from adaptive_drt.scene.description import (
    Camera,
    Cylinder,
    Ellipse,
    Ellipsoid,
    Motion,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
    vector_of,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from oracle.exact_mask import cap_of
from oracle.exact_solids import Solid, meets_cap, meets_corners, meets_ray

RAYS = Settings(method="RAYS", threads=1)
COUNT = 40
CLEAR = 1e-9
"""Of a solid's size: margins beyond which the proof must not fail but for kinks."""
KINK = 1e-3
"""The same where a plane touches two rims at once: the angle is found to 1e-5."""


def solids(rng):
    """Some of each kind, all of which move."""
    found = []
    for _ in range(COUNT):
        c, u, v, w = rng.normal(size=(4, 3)) * 10.0 ** rng.uniform(-1.0, 0.0, (4, 1))
        c = vector_of(c + np.array([0.0, 0.0, -4.0]))
        motion = Motion(vector_of(0.2 * rng.normal(size=3)))
        found.append(Ellipsoid(c, *map(vector_of, (u, v, w)), motion=motion))
        found.append(Ellipse(c, vector_of(u), vector_of(v), motion=motion))
        taper = float(rng.choice([0.0, 0.5, 1.0]))
        radius = float(10.0 ** rng.uniform(-1.5, 0.0))
        end = vector_of(np.array(c) + u)
        found.append(Cylinder(c, end, radius, motion=motion, end_radius=taper * radius))
    return found


def item_of(plan, kind, number):
    """The item of the shape of a kind and of a number."""
    for shapes, rows, index in plan.shapes.groups(np.arange(plan.shapes.count)):
        if type(shapes).__name__ == kind:
            return rows[index.tolist().index(number)]
    raise AssertionError(kind)


def pairs_of(plan, records):
    """Records of ellipsoids and cylinders, and their items."""
    found = []
    for kind, name in ((Ellipsoid, "EllipsoidSet"), (Cylinder, "CylinderSet")):
        those = [record for record in records if type(record) is kind]
        found += [(record, item_of(plan, name, k)) for k, record in enumerate(those)]
    return [record for record, _ in found], np.array([item for _, item in found])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("moving", [False, True])
def test_lights_and_solids_are_separated_where_they_are_apart(seed, moving):
    rng = np.random.default_rng((seed, 21))
    point = rng.normal(size=(3, 1)) * 0.3
    place = vector_of(rng.normal(size=3) + np.array([0.0, 0.0, -9.0]))
    if seed % 2:
        light = SphereLight(place, 0.7, (1.0,) * 3)
    else:
        light = QuadLight(place, (0.9, 0.2, 0.1), (-0.2, 0.7, 0.1), (1.0,) * 3)
    plan = make_plan(Scene(Camera(), tuple(records := solids(rng)), (light,)), RAYS)
    records, item = pairs_of(plan, records)
    apex = np.repeat(point, item.size, axis=1)
    corners = light_corners(plan.lights[0], apex, np.zeros(item.size))
    found = separated(plan, item, apex, *corners, moving=moving)
    outside = 0
    for record, one in zip(records, found, strict=True):
        move = record.motion.displacement if moving else (0.0,) * 3
        solid = Solid(record, point.astype(np.longdouble), move)
        if seed % 2:
            margin = meets_cap(solid, cap_of(point, light.center, light.radius))
        else:
            c, u, v = (np.array(x)[:, None] for x in (place, light.half_u, light.half_v))
            margin = meets_corners(solid, [c + s * u + t * v - point for s, t in SIDES])
        kink = KINK if isinstance(record, Cylinder) or moving else CLEAR
        assert not (one and margin[0] > 0.0), (record, margin)
        assert one or margin[0] > -kink, (record, margin)
        outside += margin[0] < -kink
    assert 10 < outside < 79


SIDES = ((1, 1), (1, -1), (-1, -1), (-1, 1))


@pytest.mark.parametrize("whole", [False, True])
def test_pixels_and_solids_are_separated_where_they_are_apart(whole):
    rng = np.random.default_rng(22)
    light = SphereLight((0.0, 0.0, 9.0), 0.7, (1.0,) * 3)
    plan = make_plan(Scene(Camera(), tuple(records := solids(rng)), (light,)), RAYS)
    records, item = pairs_of(plan, records)
    w = rng.normal(size=(3, item.size)) * 0.2
    w[2] = -1.0
    found = out_of_pixels(plan, item, w, whole)
    assert 10 < found.sum() < 79
    right, up = 0.5 * plan.lens.right[:, None], 0.5 * plan.lens.up[:, None]
    for k, record in enumerate(records):
        way = w[:, k : k + 1].astype(np.longdouble)
        solid = Solid(record, 0 * way)
        ends = [way + s * right + t * up for s, t in SIDES]
        margin = meets_corners(solid, ends) if whole else meets_ray(solid, way)
        assert not (found[k] and margin[0] > 0.0), (record, margin)
        assert found[k] or margin[0] > -KINK, (record, margin)


def test_a_reach_widens_the_light_and_moves_the_apex():
    record = Ellipsoid((0.0, 1.0, -4.0), (2.0, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.2))
    light = SphereLight((0.0, 0.0, -8.0), 0.5, (1.0,) * 3)
    plan = make_plan(Scene(Camera(), (record,), (light,)), RAYS)
    item, apex = np.zeros(1, dtype=np.int64), np.zeros((3, 1))
    for reach, apart in ((0.0, True), (0.1, True), (0.5, False)):
        wide = np.full(1, reach)
        corners = light_corners(plan.lights[0], apex, wide)
        assert separated(plan, item, apex, *corners, wide)[0] == apart, reach


def test_nothing_is_separated_from_a_light_around_the_point_or_by_numbers_out_of_range():
    record = Ellipsoid((0.0, 1.0, -4.0), (2.0, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.2))
    light = SphereLight((0.0, 0.0, 0.1), 0.5, (1.0,) * 3)
    plan = make_plan(Scene(Camera(), (record,), (light,)), RAYS)
    item, apex = np.zeros(1, dtype=np.int64), np.zeros((3, 1))
    corners = light_corners(plan.lights[0], apex, np.zeros(1))
    assert not separated(plan, item, apex, *corners)[0]
    for far in (0.0, 1e300, np.inf, np.nan):
        corner = np.array([[0.0], [far], [-far]])
        assert not separated(plan, item, apex, [corner], np.full(1, np.inf))[0]


def test_planes_are_tried_for_uneven_shapes_and_masks_of_order_two():
    records = (Sphere((0.0, 0.0, -4.0), 1.0), Cylinder((0.0, 0.0, -4.0), (1.0, 0.0, -4.0), 0.1))
    light = SphereLight((0.0, 0.0, 9.0), 0.7, (1.0,) * 3)
    scene = Scene(Camera(), records, (light,))
    plan = make_plan(scene, RAYS)
    item = np.arange(plan.shapes.count)
    rows = planes_help(plan, item)
    assert rows.size == item.size - 1 and are_tried(plan)
    for settings in (Settings(threads=1), Settings(method="RAYS", order=1, threads=1)):
        assert not planes_help(make_plan(scene, settings), item).size
