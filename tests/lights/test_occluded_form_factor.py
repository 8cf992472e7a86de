# SPDX-License-Identifier: GPL-3.0-or-later
"""Partly hidden light in closed form, against quadrature over lines, and against itself."""

import mpmath
import numpy as np
import pytest

from adaptive_drt.geometry.silhouettes import CircularSilhouette
from adaptive_drt.lights.form_factor import cap_factor, polygon_factor
from adaptive_drt.lights.occluded_form_factor import visible_factor
from oracle.visible import quad_light, round_light, visible
from solid_boxes import faces

COUNTS = [(1, 0), (3, 0), (0, 1), (1, 1), (2, 2)]
"""Numbers of spheres and quads before the light."""
DEPTHS = (1.0, 0.5, 0.37, 0.811)


def unit(v):
    return v / np.linalg.norm(v, axis=-2, keepdims=True)


def quad(c, a, b):
    """Corners (4, 3, n) of a parallelogram."""
    return np.stack([c + a + b, c - a + b, c - a - b, c + a - b])


def aim(rng, n, height, spread):
    return rng.normal(size=(3, n)) * spread + np.array([[0.0], [0.0], [height]])


class Views:
    """n points with a quad light and a round one, 4 spheres and 3 quads before each."""

    def __init__(self, seed, n):
        self.seed = seed
        rng = np.random.default_rng(seed)
        self.normal = unit(aim(rng, n, 1.0, 0.8))
        self.c = aim(rng, n, 2.5, 0.4)
        a, b = rng.normal(size=(2, 3, n))
        b += a * (np.abs(np.sum(a * b, axis=0)) > 0.8 * np.sqrt((a * a).sum(0) * (b * b).sum(0)))
        a, b = unit(a), np.cross(unit(np.cross(a.T, b.T).T).T, unit(a).T).T + 0.5 * unit(a)
        # not seen from its edge: turn the plane towards the point
        axis = unit(self.c)
        flat = np.abs(np.sum(np.cross(a.T, b.T).T * axis, axis=0)) < 0.3
        side = unit(np.cross(axis.T, [1.0, 0.3, 0.1]).T)
        a = np.where(flat, side, a)
        b = np.where(flat, np.cross(axis.T, side.T).T, b)
        self.a, self.b = a * rng.uniform(0.2, 1.0, n), b * rng.uniform(0.2, 1.0, n)
        self.quad = quad(self.c, self.a, self.b)
        self.axis, self.half_angle = axis, rng.uniform(0.05, 1.3, n)
        self.round = CircularSilhouette(axis, np.cos(self.half_angle), np.sin(self.half_angle))
        self.v = np.stack([aim(rng, n, 1.2, 0.3) for _ in range(4)])
        away = np.linalg.norm(self.v, axis=1)
        self.r = np.minimum(rng.uniform(0.05, 0.7, (4, n)), 0.9999 * away)
        self.quads = np.stack(
            [quad(aim(rng, n, 1.2, 0.3), *rng.normal(size=(2, 3, n)) * 0.35) for _ in range(3)]
        )

    def factor(self, k=0, m=0, light=None):
        light = self.quad if light is None else light
        return visible_factor(light, self.normal, (self.v[:k], self.r[:k]), self.quads[:m])

    def hidden_by(self, quads, light=None):
        light = self.quad if light is None else light
        return visible_factor(light, self.normal, (self.v[:0], self.r[:0]), quads)

    def truth(self, i, k, m, is_round):
        light = (
            round_light(self.axis[:, i], self.half_angle[i])
            if is_round
            else quad_light(self.quad[..., i])
        )
        spheres = [(self.v[j, :, i], self.r[j, i]) for j in range(k)]
        return visible(light, self.normal[:, i], spheres, list(self.quads[:m, :, :, i]))


def check_truth(seed, n, counts, is_round):
    views = Views(seed, n)
    light = views.round if is_round else views.quad
    got, open_light = views.factor(*counts, light), views.factor(light=light)
    want = np.array([views.truth(i, *counts, is_round) for i in range(n)])
    error = np.abs(got - want) / np.maximum(open_light, 1e-5)
    partial = np.count_nonzero((got > 0) & (got < (1 - 1e-9) * open_light))
    print(f"seed {seed}: worst {error.max():.1e} at {error.argmax()}, {partial} of {n} partial")
    assert partial > 0.3 * n  # many occluders hide most lights wholly
    assert error.max() < 1e-9, f"seed {seed}, point {error.argmax()}"


@pytest.mark.parametrize("is_round", [False, True])
@pytest.mark.parametrize("counts", COUNTS)
def test_agrees_with_quadrature(counts, is_round):
    """A thousand configurations in all, light partly below the horizon among them."""
    check_truth(1, 100, counts, is_round)


@pytest.mark.slow
@pytest.mark.parametrize("is_round", [False, True])
@pytest.mark.parametrize("counts", [*COUNTS, (4, 3)])
@pytest.mark.parametrize("seed", [2, 3, 4])
def test_agrees_with_quadrature_at_length(seed, counts, is_round):
    check_truth(seed, 150, counts, is_round)


def test_open_light_is_the_plain_closed_form():
    views = Views(5, 3000)
    want = polygon_factor(list(views.quad), views.normal)
    np.testing.assert_allclose(views.factor(), want, rtol=1e-11, atol=1e-13)
    cosine = np.sum(views.normal * views.axis, axis=0)
    want = cap_factor(cosine, views.round.sine, views.round.cosine)
    np.testing.assert_allclose(views.factor(light=views.round), want, rtol=1e-11, atol=1e-13)


def column(*rows):
    return np.array(rows, dtype=float)[..., None]


UP = column(0, 0, 1)
NO_SPHERES = (np.zeros((0, 3, 1)), np.zeros((0, 1)))
NO_QUADS = np.zeros((0, 4, 3, 1))


@pytest.mark.parametrize("a", [0.3, 1.0, 7.0])
@pytest.mark.parametrize("b", [0.5, 2.0])
def test_howell_b3_with_and_without_a_sphere(a, b):
    """A rectangle over its corner (Howell B-3), less a sphere seen wholly inside it (B-43)."""
    x, y = mpmath.mpf(a), mpmath.mpf(b)
    rx, ry = mpmath.sqrt(1 + x * x), mpmath.sqrt(1 + y * y)
    want = float((x / rx * mpmath.atan(y / rx) + y / ry * mpmath.atan(x / ry)) / 2)
    light = column((0, 0, 1), (a, 0, 1), (a, b, 1), (0, b, 1))
    assert visible_factor(light, UP, NO_SPHERES, NO_QUADS)[0] == pytest.approx(want, rel=1e-12)
    place = np.array([a / 2, b / 2, 1.0]) / 2
    r = 0.05
    want -= np.pi * r * r * place[2] / np.linalg.norm(place) ** 3
    ball = (place[None, :, None], np.array([[r]]))
    assert visible_factor(light, UP, ball, NO_QUADS)[0] == pytest.approx(want, rel=1e-12)


@pytest.mark.parametrize("h", [1.001, 1.5, 4.0, 1e3])
def test_howell_b43_and_a_ring(h):
    """A sphere above the horizon, and what a smaller one before it leaves."""
    sine = 1 / h
    light = CircularSilhouette(UP, np.sqrt([(1 - sine) * (1 + sine)]), np.array([sine]))
    want = np.pi * sine**2
    assert visible_factor(light, UP, NO_SPHERES, NO_QUADS)[0] == pytest.approx(want, rel=1e-12)
    ball = (0.5 * UP[None], np.array([[0.25 * sine]]))
    got = visible_factor(light, UP, ball, NO_QUADS)[0]
    assert got == pytest.approx(0.75 * want, rel=1e-12)


def scaled_error(views, difference):
    """Largest difference over the open light, of points that see some."""
    return np.max(np.abs(difference) / np.maximum(views.factor(), 1e-3))


def test_adding_an_occluder_never_adds_light():
    views = Views(6, 5000)
    for light in (views.quad, views.round):
        last = views.factor(light=light)
        for counts in ((1, 0), (2, 0), (3, 0), (3, 1), (3, 2), (4, 2), (4, 3)):
            now = views.factor(*counts, light)
            assert np.all(now <= last + 1e-13) and np.all(now >= 0.0), counts
            last = now


def test_order_of_occluders_and_corners_does_not_matter():
    views = Views(7, 3000)
    for light in (views.quad, views.round):
        want = views.factor(4, 3, light)
        spheres = views.v[::-1].copy(), views.r[::-1].copy()
        for quads in (views.quads[::-1], views.quads[:, ::-1], np.roll(views.quads, 1, axis=1)):
            got = visible_factor(light, views.normal, spheres, quads)
            assert np.abs(got - want).max() < 1e-12
    got = views.factor(4, 3, views.quad[::-1])
    assert scaled_error(views, got - views.factor(4, 3)) < 1e-11


def test_rotation_and_mirror_do_not_matter():
    views = Views(8, 2000)
    turn, _ = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))

    def turned(x):
        return np.moveaxis(np.tensordot(turn, x, axes=(1, -2)), 0, -2)

    light = CircularSilhouette(turned(views.axis), views.round.cosine, views.round.sine)
    for own, other in ((views.quad, turned(views.quad)), (views.round, light)):
        got = visible_factor(
            other, turned(views.normal), (turned(views.v), views.r), turned(views.quads)
        )
        assert scaled_error(views, got - views.factor(4, 3, own)) < 1e-11


def test_halves_of_a_light_add_up():
    views = Views(9, 3000)
    near, far = (quad(views.c + s * views.a / 2, views.a / 2, views.b) for s in (1, -1))
    for counts in ((0, 0), (1, 0), (3, 0), (0, 2), (4, 3)):
        parts = views.factor(*counts, near) + views.factor(*counts, far)
        assert scaled_error(views, parts - views.factor(*counts)) < 1e-11


def test_spheres_that_do_not_overlap_hide_the_sum():
    views = Views(10, 5000)
    a, b = views.v[0], views.v[1]
    angle = np.arccos(np.clip(np.sum(unit(a) * unit(b), axis=0), -1, 1))
    cones = [
        np.arcsin(r / np.linalg.norm(v, axis=0))
        for v, r in zip(views.v[:2], views.r[:2], strict=True)
    ]
    apart = angle > cones[0] + cones[1]
    assert apart.sum() > 100
    one, both = views.factor(1), views.factor(2)
    two = visible_factor(views.quad, views.normal, (views.v[1:2], views.r[1:2]), views.quads[:0])
    difference = (views.factor() - one) + (views.factor() - two) - (views.factor() - both)
    assert np.abs(difference[apart]).max() < 1e-13


def test_a_point_does_not_depend_on_its_batch():
    views = Views(11, 9000)
    for light in (views.quad, views.round):
        for k, m in ((1, 0), (3, 0), (0, 2), (4, 3)):
            whole = views.factor(k, m, light)
            for rows in (slice(0, 1), slice(8999, 9000), slice(5, 8), slice(17, 4500, 3)):
                part = (
                    CircularSilhouette(light.axis[:, rows], light.cosine[rows], light.sine[rows])
                    if light is views.round
                    else light[..., rows]
                )
                spheres = views.v[:k, :, rows], views.r[:k, rows]
                got = visible_factor(
                    part, views.normal[:, rows], spheres, views.quads[:m, ..., rows]
                )
                assert np.array_equal(got, whole[rows])


def test_a_repeated_corner_changes_no_bit():
    views = Views(12, 1000)
    padded = np.concatenate([views.quads, views.quads[:, -1:]], axis=1)
    spheres = views.v[:2], views.r[:2]
    for light in (views.quad, views.round):
        got = visible_factor(light, views.normal, spheres, padded)
        want = visible_factor(light, views.normal, spheres, views.quads)
        assert np.array_equal(got, want)


@pytest.mark.parametrize("depth", DEPTHS)
def test_outlines_that_coincide(depth):
    """Edges on the light's edges, shared edges, equal occluders: nothing doubled, nothing lost."""
    views = Views(13, 3000)
    c, a, b = views.c, views.a, views.b
    left, right = (quad(c + s * a / 2, a / 2, b) for s in (1, -1))
    beside = quad(c + 2 * a, a, b)
    quarters = [quad(c + s * a / 2 + t * b / 2, a / 2, b / 2) for s in (1, -1) for t in (1, -1)]
    full, nothing = views.factor(), 0.0
    cases = [
        ([depth * views.quad], nothing),
        ([depth * left], views.factor(light=right)),
        ([depth * left, 0.7 * depth * right], nothing),
        ([depth * left, 0.7 * right, 0.4 * views.quad], nothing),
        ([depth * beside], full),
        ([depth * quarters[1], 0.3 * quarters[1]], full - views.factor(light=quarters[1])),
        ([depth * q for q in quarters], nothing),
        (
            [(depth - 0.1 * i) * q for i, q in enumerate(quarters[:3])],
            views.factor(light=quarters[3]),
        ),
        (
            [depth * quarters[0], 0.9 * depth * quarters[3]],
            views.factor(light=quarters[1]) + views.factor(light=quarters[2]),
        ),
    ]
    for i, (quads, want) in enumerate(cases):
        for order in (1, -1):
            got = views.hidden_by(np.stack(quads[::order]))
            assert scaled_error(views, got - want) < 1e-9, f"case {i}, order {order}"


@pytest.mark.parametrize("tilt", [0.0, 1e-16, 1e-15, 4e-15, 1e-14, 1e-13, 1e-12])
def test_outlines_that_nearly_coincide(tilt):
    """Edges turned against each other by a few roundings."""
    views = Views(14, 3000)
    rng = np.random.default_rng(14)
    noise = tilt * rng.normal(size=(4, 3, 3000))
    near, far = (quad(views.c + s * views.a / 2, views.a / 2, views.b) for s in (1, -1))
    beside = quad(views.c + 2 * views.a, views.a, views.b)
    got = views.hidden_by(0.5 * (beside + noise)[None])
    limit = 1e-9 + 300 * tilt
    assert scaled_error(views, got - views.factor()) < limit
    got = views.hidden_by(np.stack([0.5 * (near + noise), 0.4 * far]))
    assert scaled_error(views, got) < limit


def test_equal_spheres_count_once():
    views = Views(15, 3000)
    rng = np.random.default_rng(15)
    one = views.factor(1)
    depth = np.array(DEPTHS)
    spheres = depth[:, None, None] * views.v[:1], depth[:, None] * views.r[:1]
    got = visible_factor(views.quad, views.normal, spheres, views.quads[:0])
    assert scaled_error(views, got - one) < 1e-11
    for shift in (1e-16, 1e-15, 4e-15, 1e-14, 1e-13, 1e-12):
        v = views.v[:1] + shift * rng.normal(size=(3, *views.v.shape[1:]))
        r = np.broadcast_to(views.r[:1], (3, 3000))
        got = visible_factor(views.quad, views.normal, (v, r), views.quads[:0])
        assert scaled_error(views, got - one) < 1e-11 + 300 * shift


def test_boxes_on_the_floor():
    """Six faces that share edges, seen from points in the planes of some: faces edge-on."""
    grid = np.linspace(-2.0, 2.0, 9)
    at = np.array([(x, y, 0.0) for x in grid for y in grid]).T
    n = at.shape[1]
    x, y, z = (np.repeat(np.eye(3)[i][:, None], n, axis=1) for i in range(3))
    box = faces(np.array([[-0.5], [-0.5], [0.0]]) - at, x, y, z)
    sides = np.stack([np.stack([o, o + p, o + p + q, o + q]) for o, p, q in box])
    light = quad(np.array([[0.0], [0.0], [3.0]]) - at, x, y)
    none = np.zeros((0, 3, n)), np.zeros((0, n))
    for order in (slice(None), slice(None, None, -1)):
        got = visible_factor(light, z, none, sides[order])
        want = [visible(quad_light(light[..., i]), z[:, i], quads=sides[..., i]) for i in range(n)]
        inside = np.max(np.abs(at), axis=0) < 0.5  # under the box: its floor is in the plane
        assert np.abs(got - want)[~inside].max() < 1e-12


@pytest.mark.parametrize("depth", [10.0**-e for e in range(3, 17)])
def test_spheres_that_graze(depth):
    """A sphere that overlaps an edge, or another sphere, by a sliver hides no more than that."""
    light = column((-1, -1, 2), (1, -1, 2), (1, 1, 2), (-1, 1, 2))
    full = visible_factor(light, UP, NO_SPHERES, NO_QUADS)[0]
    alpha = 0.2
    edge = np.arctan(0.5)  # the edge x = 1 in the plane y = 0

    def ball(angle):
        return np.array([np.sin(angle), 0.0, np.cos(angle)])

    def hidden(*angles):
        v = np.stack([ball(angle) for angle in angles])[..., None]
        r = np.full((len(angles), 1), np.sin(alpha))
        return full - visible_factor(light, UP, (v, r), NO_QUADS)[0]

    whole = np.pi * np.sin(alpha) ** 2
    sliver = 10.0 * depth**1.5 + 4e-15
    for sign in (1, -1):
        outside = hidden(edge + alpha - sign * depth)  # pokes in, or stays out
        inside = hidden(edge - alpha + sign * depth) - whole * np.cos(edge - alpha + sign * depth)
        pair = (
            hidden(0.0, 2 * alpha - sign * depth) - hidden(0.0) - hidden(2 * alpha - sign * depth)
        )
        for value in (outside, inside, pair):
            assert abs(value) < sliver if sign > 0 else abs(value) < 4e-15


@pytest.mark.parametrize("size", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("small", [True, False])
def test_tiny_lights_do_not_cancel(size, small):
    """Squares down to solid angles of 1e-12, before them spheres as small, or large ones' edges."""
    n, rng = 60, np.random.default_rng(17)
    c = aim(rng, n, 2.5, 0.4)
    across = unit(np.cross(rng.normal(size=(3, n)).T, c.T).T)
    light = quad(c, size * across, 0.7 * size * np.cross(unit(c).T, across.T).T)
    normal = unit(aim(rng, n, 1.0, 0.3))
    t = rng.uniform(0.2, 0.8, n)
    aside = unit(np.cross(rng.normal(size=(3, n)).T, c.T).T)
    width = size * rng.uniform(0.3, 1.5, n) if small else rng.uniform(0.05, 0.4, n)
    v = t * (c + aside * width * (rng.uniform(0.5, 1.1, n) if small else 1.0))
    r = t * width * (1.0 if small else 1.0 - 0.5 * size * rng.random(n))
    none = np.zeros((0, 4, 3, n))
    got = visible_factor(light, normal, (v[None], r[None]), none)
    full = visible_factor(light, normal, (v[None][:0], r[None][:0]), none)
    want = [visible(quad_light(light[..., i]), normal[:, i], [(v[:, i], r[i])]) for i in range(n)]
    error = np.max(np.abs(got - want) / full)
    print(f"seed 17, size {size}: worst {error:.1e}")
    assert error < max(1e-9 * (1e-6 / size), 1e-13)


def test_points_that_touch_an_occluder():
    """Cones of 90 degrees, and just below: finite, and no light from behind them."""
    views = Views(18, 2000)
    away = np.linalg.norm(views.v[:1], axis=1)
    for share in (1.0, 1.0 - 1e-16, 1.0 - 1e-9, 1.0 - 1e-4):
        for light in (views.quad, views.round):
            got = visible_factor(light, views.normal, (views.v[:1], share * away), views.quads[:0])
            assert np.isfinite(got).all()
            assert np.all(got <= views.factor(light=light) + 1e-12)
