# SPDX-License-Identifier: GPL-3.0-or-later
"""What each kind of light answers, against points of the light that are drawn at random."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.registry import LIGHTS, make_emitter
from adaptive_drt.numerics.low_discrepancy import low_discrepancy_points
from adaptive_drt.scene.description import (
    DiskLight,
    EllipseLight,
    EnvironmentLight,
    Motion,
    PointLight,
    PolygonLight,
    QuadLight,
    SkyLight,
    SphereLight,
    SpotLight,
    SunLight,
)

CENTER, POWER = (0.4, -0.3, 2.5), (1.0, 2.0, 3.0)
RECORDS = {
    QuadLight: QuadLight(CENTER, (0.5, 0.1, 0.2), (0.0, -0.7, 0.3), POWER),
    EllipseLight: EllipseLight(CENTER, (0.5, 0.1, 0.2), (0.0, -0.7, 0.3), POWER),
    PolygonLight: PolygonLight(((0.9, -0.2, 2.7), (0.4, -1.0, 2.8), (-0.1, 0.3, 2.0)), POWER),
    SphereLight: SphereLight(CENTER, 0.6, POWER),
    DiskLight: DiskLight(CENTER, 0.6, POWER),
    PointLight: PointLight(CENTER, POWER),
}
FLAT = (QuadLight, EllipseLight, PolygonLight)
EXTENDED = [kind for kind in RECORDS if kind is not PointLight]
AT_REST = LightMotion(np.zeros(3), np.zeros(3))
COUNT = 400
"""Points of a light that are drawn for each point that sees it."""
POINTS = 60
CORE = Path(__file__).parents[2] / "adaptive_drt"


def emitter_of(kind, **changes):
    return make_emitter(replace(RECORDS[kind], **changes), AT_REST)


def places(record, rng, point):
    """Points of a light as points (3, n) see them: (3, n, COUNT), from its description alone."""
    n = point.shape[1]
    center = np.array(getattr(record, "center", CENTER))[:, None, None]
    if isinstance(record, PointLight):
        return np.broadcast_to(center, (3, n, COUNT))
    if isinstance(record, QuadLight):
        a, b = rng.uniform(-1.0, 1.0, (2, n, COUNT))
        a[:, :4], b[:, :4] = [1.0, 1.0, -1.0, -1.0], [1.0, -1.0, 1.0, -1.0]
        u, v = (np.array(half)[:, None, None] for half in (record.half_u, record.half_v))
        return center + a * u + b * v
    if isinstance(record, PolygonLight):
        share = rng.dirichlet(np.full(3, 0.5), (n, COUNT))
        share[:, :3] = np.eye(3)
        return np.einsum("nkc,cx->xnk", share, np.array(record.vertices))
    if isinstance(record, EllipseLight):
        turn, size = rng.uniform(0.0, 2.0 * np.pi, (n, COUNT)), np.sqrt(rng.random((n, COUNT)))
        size[:, : COUNT // 2] = 1.0
        u, v = (np.array(half)[:, None, None] for half in (record.half_u, record.half_v))
        return center + size * np.cos(turn) * u + size * np.sin(turn) * v
    offset = rng.normal(size=(3, n, COUNT))
    if isinstance(record, DiskLight):
        axis = center - point[:, :, None]
        axis = axis / np.sqrt((axis * axis).sum(axis=0))
        offset -= axis * (axis * offset).sum(axis=0)
    offset /= np.sqrt((offset * offset).sum(axis=0))
    return center + record.radius * offset


def placed_at(record, center):
    if isinstance(record, PolygonLight):
        move = center - np.array(CENTER)
        return replace(record, vertices=tuple(tuple(v + move) for v in record.vertices))
    return replace(record, center=tuple(center))


def seen(seed):
    """Random points (3, n) on all sides of the light, most outside it, and unit normals."""
    rng = np.random.default_rng(seed)
    point = np.array(CENTER)[:, None] + rng.normal(scale=1.5, size=(3, POINTS))
    normal = rng.normal(size=(3, POINTS))
    return rng, point, normal / np.sqrt((normal * normal).sum(axis=0))


@pytest.mark.parametrize("kind", RECORDS)
def test_extent_is_the_largest_product(kind):
    rng, point, vector = seen(1)
    spots = places(RECORDS[kind], rng, point)
    products = ((spots - np.array(CENTER)[:, None, None]) * vector[:, :, None]).sum(axis=0)
    extent = emitter_of(kind).extent(vector)
    most = np.abs(products).max(axis=1)
    assert np.all(most <= extent + 1e-12)
    # points on spheres are drawn at random; a disk's extent holds for all points that it faces
    shares = {EllipseLight: 0.99, SphereLight: 0.95}
    shares |= dict.fromkeys((QuadLight, PolygonLight), 1.0 - 1e-12)
    share = shares.get(kind, 0.0)
    assert np.all(most >= share * extent)


@pytest.mark.parametrize("kind", RECORDS)
def test_view_cone_encloses_the_light(kind):
    rng, point, _ = seen(2)
    emitter = emitter_of(kind)
    cone = emitter.view_cone(emitter.to_center(point))
    to = places(RECORDS[kind], rng, point) - point[:, :, None]
    length = np.sqrt((to * to).sum(axis=0))
    cosine = (cone.axis[:, :, None] * to).sum(axis=0) / length
    assert np.all(cosine >= cone.cosine[:, None] - 1e-12)
    outside = cone.cosine >= 0.0
    assert outside.sum() > POINTS // 2
    assert np.all(length >= cone.near[:, None] - 1e-12)
    visible = np.ones_like(length, dtype=bool)
    if kind is SphereLight:  # the far side is not visible
        away = (places(RECORDS[kind], rng, point) - np.array(CENTER)[:, None, None]) / 0.6
        to = np.array(CENTER)[:, None, None] + 0.6 * away - point[:, :, None]
        length = np.sqrt((to * to).sum(axis=0))
        visible = ((away * to).sum(axis=0) <= 0.0) & outside[:, None]
    assert np.all((length <= cone.far[:, None] + 1e-12)[visible])
    half = emitter.half_angle(cone.distance)
    assert half[outside] == pytest.approx(np.arctan2(cone.sine, cone.cosine)[outside], abs=1e-7)


@pytest.mark.parametrize("kind", EXTENDED)
def test_irradiance_factor_is_the_mean_of_the_samples(kind):
    _, point, normal = seen(3)
    emitter = emitter_of(kind)
    a, b = low_discrepancy_points(0, np.arange(POINTS), 0, 8192, 2)
    to = emitter.to_center(point)
    spots, weight = emitter.sample(to[:, :, None], point[:, :, None], normal[:, :, None], a, b)
    factor = emitter.irradiance_factor(to, point, normal)
    assert weight.mean(axis=1) == pytest.approx(factor, rel=0.01, abs=0.01)
    assert (factor > 0.0).sum() > POINTS // 4
    # the samples lie on the light
    end = spots + point[:, :, None] - np.array(CENTER)[:, None, None]
    off = np.sqrt((end * end).sum(axis=0)) - emitter.radius
    assert np.all(off <= 1e-12)
    if kind is SphereLight:
        assert np.abs(off).max() < 1e-12


def test_irradiance_factor_of_a_point_is_the_inverse_square():
    _, point, normal = seen(3)
    emitter = emitter_of(PointLight)
    to = emitter.to_center(point)
    square = (to * to).sum(axis=0)
    want = np.maximum((normal * to).sum(axis=0), 0.0) / square**1.5
    assert emitter.irradiance_factor(to, point, normal) == pytest.approx(want, rel=1e-12)


@pytest.mark.parametrize("kind", RECORDS)
def test_horizon_is_that_of_all_points_of_the_light(kind):
    rng, point, normal = seen(4)
    emitter = emitter_of(kind)
    to = emitter.to_center(point)
    dark, cut = emitter.horizon(to, point, normal)
    rise = (places(RECORDS[kind], rng, point) - point[:, :, None]) * normal[:, :, None]
    rise = rise.sum(axis=0)
    lit = emitter.irradiance_factor(to, point, normal) > 0.0
    assert np.all(lit[~dark]) and not lit[dark].any()
    assert np.all((rise.min(axis=1) > -1e-12)[~dark & ~cut])
    if kind is not SphereLight:  # which points of a ball are visible depends on the point
        below = (rise < 0.0).any(axis=1) & (rise > 0.0).any(axis=1)
        assert np.all(cut[below & ~dark])
    zero = np.zeros(POINTS)
    whole = emitter.is_above_horizon(to, point, normal, zero, zero)
    assert not (whole & (dark | cut)).any()
    assert whole.any() and dark.any()
    assert cut.any() == (kind is not PointLight)


@pytest.mark.parametrize("kind", RECORDS)
def test_horizon_holds_for_all_points_within_reach(kind):
    rng, point, normal = seen(5)
    emitter = emitter_of(kind)
    reach, flat = np.full(POINTS, 0.3), np.zeros(POINTS)
    to = emitter.to_center(point)
    dark = emitter.horizon(to, point, normal, reach, flat)[0]
    whole = emitter.is_above_horizon(to, point, normal, reach, flat)
    for _ in range(40):
        step = rng.normal(size=(3, POINTS))
        step -= normal * (normal * step).sum(axis=0)
        step *= reach * rng.uniform(size=POINTS) / np.sqrt((step * step).sum(axis=0))
        beside = point + step
        to = emitter.to_center(beside)
        factor = emitter.irradiance_factor(to, beside, normal)
        assert not factor[dark].any()
        assert np.all(factor[whole] > 0.0)
        assert not emitter.horizon(to, beside, normal)[1][whole].any()
    assert dark.any() and whole.any()


@pytest.mark.parametrize("kind", RECORDS)
def test_balls_behind_a_light_hide_nothing_of_it(kind):
    rng, place, _ = seen(6)
    emitter = emitter_of(kind)
    radius = rng.uniform(0.05, 0.5, POINTS)
    behind = np.broadcast_to(emitter.is_behind(emitter.to_center(place), radius), POINTS)
    assert behind.any() == (kind in FLAT)
    spot = rng.normal(size=(3, POINTS))
    spot = place + radius * spot / np.sqrt((spot * spot).sum(axis=0))
    to = emitter.to_center(spot)
    front = emitter.front_sine(to, np.sqrt((to * to).sum(axis=0)))
    assert (front is None) == (kind not in FLAT)
    if front is not None:
        assert np.all(front[behind] <= 1e-12)


@pytest.mark.parametrize("kind", RECORDS)
def test_bounds_enclose_the_light_and_its_path(kind):
    rng, point, _ = seen(7)
    shift = np.array((0.3, -0.8, 0.5))
    emitter = emitter_of(kind, motion=Motion(tuple(shift)))
    swept = emitter.swept_bounds()
    cone = swept.view_cone(swept.to_center(point))
    assert swept.displacement is None
    for time in (-0.5, 0.1, 0.5):
        moved = placed_at(RECORDS[kind], np.array(CENTER) + time * shift)
        to = places(moved, rng, point) - point[:, :, None]
        assert emitter.to_center(point, time) == pytest.approx(
            (np.array(CENTER) + time * shift)[:, None] - point
        )
        length = np.sqrt((to * to).sum(axis=0))
        cosine = (cone.axis[:, :, None] * to).sum(axis=0) / length
        assert np.all(cosine >= cone.cosine[:, None] - 1e-12)
        assert np.all(length <= cone.far[:, None] + 1e-12)


@pytest.mark.parametrize("kind", RECORDS)
def test_as_point_keeps_place_motion_and_shadow(kind):
    emitter = emitter_of(kind, motion=Motion((0.0, 0.0, 1.0)), casts_shadow=False)
    point = emitter.as_point()
    assert not point.extended and point.radius == 0.0 and point.name == emitter.name
    assert not point.casts_shadow
    at = np.zeros((3, 2))
    assert np.array_equal(point.to_center(at, 0.25), emitter.to_center(at, 0.25))
    offset = np.array([[0.1, 0.2], [0.0, 0.0], [0.0, -0.1]])
    moved = emitter.point_at(offset)
    assert moved.to_center(at) == pytest.approx(emitter.to_center(at) + offset)


def test_clear_distance_and_falloff():
    rng, point, _ = seen(8)
    for kind, record in RECORDS.items():
        _, clear = emitter_of(kind).falloff_offset(point)
        gap = places(record, rng, point) - point[:, :, None]
        assert np.all(clear <= np.sqrt((gap * gap).sum(axis=0)).min(axis=1) + 0.02), kind


def test_every_kind_is_tested_here():
    """Suns and skies have test files of their own, since they have no place, and spots, whose cones
    have more to be asked."""
    assert {record for record, _ in LIGHTS} == {
        *RECORDS,
        SunLight,
        SkyLight,
        SpotLight,
        EnvironmentLight,
    }


def test_an_unknown_record_is_refused():
    with pytest.raises(TypeError, match="object"):
        make_emitter(object(), AT_REST)


@pytest.mark.parametrize(
    "path",
    [path for path in sorted(CORE.rglob("*.py")) if path.parent.name not in ("lights", "scene")],
    ids=lambda path: path.relative_to(CORE).as_posix(),
)
def test_no_other_file_knows_kinds_of_lights(path):
    text = path.read_text(encoding="utf-8")
    for module in (
        "quad",
        "ellipse",
        "flat",
        "sphere",
        "disk",
        "point",
        "sun",
        "sky",
        "distant",
        "environment",
        "spot",
    ):
        assert f"{module}_light" not in text
    for record in (*RECORDS, SunLight, SkyLight, SpotLight, EnvironmentLight):
        assert record.__name__ not in text
