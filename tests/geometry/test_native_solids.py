# SPDX-License-Identifier: GPL-3.0-or-later
"""Embree's solids block and are met by the rays that meet the shapes themselves."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.cylinder.shape import CylinderSet
from adaptive_drt.geometry.ellipsoid.shape import EllipsoidSet
from adaptive_drt.geometry.embree_library import native_library
from adaptive_drt.geometry.embree_solids import SolidScene
from adaptive_drt.geometry.native_solids import Balls, Cones, Ellipsoids
from adaptive_drt.geometry.sphere.shape import SphereSet
from adaptive_drt.scene.description import Cylinder, Ellipsoid, Sphere

pytestmark = pytest.mark.skipif(native_library() is None, reason="embree's library is not found")

ORIGIN = np.zeros((3, 1))


@pytest.fixture
def rng():
    seed = int(np.random.SeedSequence().entropy) % 2**32
    print("seed", seed)
    return np.random.default_rng(seed)


def random_set(kind, rng, count, moving):
    place = rng.uniform(-2.0, 2.0, (count, 3))
    shift = rng.normal(0.0, 0.3, (3, count)) if moving else None
    if kind == "spheres":
        radius = rng.uniform(0.1, 0.4, count)
        records = [Sphere(tuple(p), float(r)) for p, r in zip(place, radius, strict=True)]
        return SphereSet.from_records(records, ORIGIN, shift)
    if kind == "ellipsoids":
        axes = rng.normal(0.0, 0.25, (count, 3, 3)) + 0.3 * np.eye(3)
        records = [
            Ellipsoid(tuple(p), *map(tuple, own)) for p, own in zip(place, axes, strict=True)
        ]
        return EllipsoidSet.from_records(records, ORIGIN, shift)
    way, radius = rng.normal(0.0, 0.6, (count, 3)), rng.uniform(0.05, 0.3, count)
    last = radius * rng.choice([0.0, 0.5, 1.0], count)
    records = [
        Cylinder(tuple(p), tuple(p + d), float(r), end_radius=float(e))
        for p, d, r, e in zip(place, way, radius, last, strict=True)
    ]
    return CylinderSet.from_records(records, ORIGIN, shift)


def rays(rng, count):
    start, end = rng.uniform(-3.0, 3.0, (2, 3, count))
    return start, end - start


def blocked_by(shapes, start, to, time):
    """Which segments each shape blocks: (shapes, rays)."""
    index = np.arange(shapes.count)[:, None]
    found = [shapes.blocks(each, start, to, time) for each in index]
    return np.array(found)


@pytest.mark.parametrize("moving", [False, True], ids=["still", "moving"])
@pytest.mark.parametrize("kind", ["spheres", "ellipsoids", "cones"])
def test_segments_are_blocked_as_by_the_shapes(kind, moving, rng):
    shapes = random_set(kind, rng, 12, moving)
    start, to = rays(rng, 4_000)
    time = rng.uniform(-0.5, 0.5, 4_000) if moving else np.zeros(4_000)
    wanted = blocked_by(shapes, start, to, time).any(axis=0)
    scene = SolidScene((shapes.native_solids(slice(None)),))
    # starts are on no surface: the normal's offset only moves them
    found = scene.blocked(start, np.zeros((3, 4_000)), to[:, :, None], time[:, None])[:, 0]
    assert 0.02 < wanted.mean() < 0.9
    assert (found != wanted).sum() <= 4  # rays at limbs, within what embree rounds


def test_what_is_met_first_is_so_and_kinds_are_numbered_one_after_the_other(rng):
    sets = [random_set(kind, rng, 7, False) for kind in ("spheres", "ellipsoids", "cones")]
    scene = SolidScene([each.native_solids(slice(None)) for each in sets])
    way, start = rng.normal(size=(3, 3_000)), np.zeros((3, 3_000))
    item, reach = scene.nearest(way)
    hits = (item >= 0).nonzero()[0]
    far = np.concatenate([blocked_by(each, start, 99.0 * way, 0.0) for each in sets])
    assert (far.any(axis=0) != (item >= 0)).sum() <= 4
    way, start, reach, item = way[:, hits], start[:, hits], reach[hits], item[hits]
    before, behind = (
        np.concatenate([blocked_by(each, start, part * reach * way, 0.0) for each in sets])
        for part in (1.0 - 1e-4, 1.0 + 1e-4)
    )
    assert before.any(axis=0).sum() <= 4
    assert (~behind[item, np.arange(hits.size)]).sum() <= 4
    assert set(np.unique(item // 7)) == {0, 1, 2}


def test_shapes_are_given_as_solids_of_their_kind(rng):
    kinds = {"spheres": Balls, "ellipsoids": Ellipsoids, "cones": Cones}
    for name, kind in kinds.items():
        found = random_set(name, rng, 5, False).native_solids(np.array([3, 1]))
        assert type(found) is kind and found.count == 2 and found.displacement is None


@pytest.mark.parametrize("kind", ["spheres", "ellipsoids", "cones"])
@pytest.mark.parametrize("moving", [False, True], ids=["still", "moving"])
def test_boxes_hold_the_shapes_at_all_times(kind, moving, rng):
    shapes = random_set(kind, rng, 9, moving)
    low, high = shapes.native_solids(slice(None)).box()
    for axis in range(3):
        direction = np.zeros((3, 9))
        direction[axis] = 1.0
        for time in (-0.5, 0.0, 0.5):
            least, most = shapes.extent(np.arange(9), direction, np.full(9, time))
            finite = np.abs(least) < 1e9
            assert (least[finite] >= low[axis] - 1e-12).all()
            assert (most[finite] <= high[axis] + 1e-12).all()


def test_thickness_is_the_least_half_extent():
    long = Ellipsoid((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    found = EllipsoidSet.from_records([long], ORIGIN, None).native_solids(slice(0, 1)).thickness
    np.testing.assert_allclose(found, [1.0])
    rods = [
        Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 0.2), 1.0),
        Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 4.0), 0.5),
    ]
    found = CylinderSet.from_records(rods, ORIGIN, None).native_solids(np.arange(2)).thickness
    np.testing.assert_allclose(found, [0.1, 0.5])


def test_stretched_and_sheared_ellipsoids_are_as_accurate_as_balls(rng):
    """Of 100 times as long as thick, in a scene that is 500 times as large."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    place = rng.uniform(-0.4, 0.4, (20, 3))
    place[0], place[1] = -1.0, 1.0
    records = []
    for p in place:
        principal = turn * np.array([0.4, 0.1, 0.004])
        sheared = principal @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
        records.append(Ellipsoid(tuple(p), *map(tuple, sheared.T)))
    shapes = EllipsoidSet.from_records(records, ORIGIN, None)
    scene = SolidScene((shapes.native_solids(slice(None)),))
    start, to = rays(rng, 20_000)
    wanted = blocked_by(shapes, start, to, 0.0).any(axis=0)
    found = scene.blocked(start, np.zeros_like(start), to[:, :, None], 0.0)[:, 0]
    assert wanted.sum() > 500
    assert (found != wanted).sum() <= 20
