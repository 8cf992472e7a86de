# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves on the unit sphere: intervals against points of them, integrals against closed forms.

`tests/test_kernels.py` holds their error bounds over hostile inputs.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from adaptive_drt.geometry.spherical_curves import (
    Circles,
    GreatCircleArcs,
    HalfSpaces,
    arcs_inside_cones,
    arcs_inside_outline,
    boundary_integral,
    circles_inside_cones,
    circles_outside_half_spaces,
    complement_intervals,
    complement_on_circle,
    make_antiderivative,
    make_circles,
    make_great_circle_arcs,
)

POINTS = 2_001
MARGIN = 1e-9
"""Radians and cosines: how near to a boundary a point may not be to count as evidence."""


def unit(rng, *shape):
    vectors = rng.normal(size=(3, *shape))
    return vectors / np.linalg.norm(vectors, axis=0)


def cone(axis, half, center):
    """One cone (k = n = 1) of an axis (3,) and a half angle."""
    return make_circles(
        axis[:, None, None], np.sin([[half]]), np.cos([[half]]), center[:, None]
    )  # fmt: skip


def on_circle(circle, phi):
    axis, u, w = (part[:, 0, 0] for part in (circle.axis, circle.u, circle.w))
    s, c = circle.sine[0, 0], circle.cosine[0, 0]
    return c * axis + s * (np.cos(phi)[:, None] * u + np.sin(phi)[:, None] * w)


def arc_between(start, end):
    normal = np.cross(start, end)
    normal /= np.linalg.norm(normal)
    planes = HalfSpaces(normal[:, None, None], np.full((1, 1), 1e-15))
    return make_great_circle_arcs(start[:, None, None], end[:, None, None], planes)


def on_arc(arc, phi):
    return np.cos(phi)[:, None] * arc.middle[:, 0, 0] + np.sin(phi)[:, None] * arc.along[:, 0, 0]


@pytest.mark.parametrize("seed", range(20))
def test_gaps_between_intervals_are_what_no_interval_covers(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(0, 20))
    start = rng.uniform(-0.2, 1.0, (count, 1))
    end = start + rng.choice([0.0, 0.05, 0.3], (count, 1)) * rng.random((count, 1))
    begin, finish = complement_intervals(np.zeros(1), np.ones(1), (start, end))
    assert begin.shape == (count + 1, 1) and (begin <= finish).all()
    x = rng.random(2_000)
    covered = ((start <= x) & (x <= end)).any(axis=0) if count else np.zeros(x.size, dtype=bool)
    np.testing.assert_array_equal(((begin < x) & (x < finish)).any(axis=0), ~covered)


@pytest.mark.parametrize("seed", range(20))
def test_gaps_on_circles_wrap_around(seed):
    rng = np.random.default_rng(seed)
    center, half = rng.uniform(-np.pi, 2 * np.pi, (4, 1, 1)), rng.uniform(0.0, 1.0, (4, 1, 1))
    low, high = complement_on_circle(center, half)
    x = rng.uniform(-np.pi, np.pi, 2_000)
    away = np.abs((x - center[:, 0] + np.pi) % (2 * np.pi) - np.pi)
    inside = ((low[:, 0] < x) & (x < high[:, 0])).any(axis=0)
    np.testing.assert_array_equal(inside, (away > half[:, 0]).all(axis=0))


@pytest.mark.parametrize("seed", range(20))
def test_arcs_inside_cones(seed):
    rng = np.random.default_rng(seed)
    start, end = unit(rng, 2).T
    arc, circle = arc_between(start, end), cone(unit(rng), rng.uniform(0.1, 1.5), start)
    low, high = (part[0, 0, 0] for part in arcs_inside_cones(arc, circle))
    half = arc.half_angle[0, 0]
    phi = np.linspace(-half, half, POINTS)
    np.testing.assert_allclose(on_arc(arc, phi)[[0, -1]], [start, end], atol=1e-14)
    cosine = on_arc(arc, phi) @ circle.axis[:, 0, 0] - circle.cosine[0, 0]
    clear = np.abs(cosine) > MARGIN
    np.testing.assert_array_equal((cosine > 0.0)[clear], ((low < phi) & (phi < high))[clear])


@pytest.mark.parametrize("seed", range(20))
def test_circles_outside_half_spaces(seed):
    rng = np.random.default_rng(seed)
    circle, normal = cone(unit(rng), rng.uniform(0.05, 1.5), unit(rng)), unit(rng)
    planes = HalfSpaces(normal[:, None, None], np.zeros((1, 1)))
    center, half = (part[0, 0, 0] for part in circles_outside_half_spaces(circle, planes))
    phi = np.linspace(-np.pi, np.pi, POINTS)
    height = on_circle(circle, phi) @ normal
    outside = np.abs((phi - center + np.pi) % (2 * np.pi) - np.pi) < half
    clear = np.abs(height) > MARGIN
    np.testing.assert_array_equal(outside[clear], (height < 0.0)[clear])


@pytest.mark.parametrize("seed", range(30))
def test_circles_inside_other_cones(seed):
    rng = np.random.default_rng(seed)
    first = unit(rng)
    second = first + rng.normal(size=3) * 10.0 ** rng.uniform(-4, 0)
    second /= np.linalg.norm(second)
    size = 10.0 ** rng.uniform(-3, 0.1)
    one = cone(first, size, first)
    other = cone(second, size * rng.uniform(0.5, 1.4), first)
    found = circles_inside_cones(one, other, np.ones((1, 1)))
    center, inside, outside = (part[0, 0] for part in found)
    assert inside + outside == pytest.approx(np.pi, abs=1e-6)
    phi = np.linspace(-np.pi, np.pi, POINTS)
    # versines: cosines of small cones have no digits left
    gap = on_circle(one, phi) - other.axis[:, 0, 0]
    depth = other.versine[0, 0] - 0.5 * (gap * gap).sum(axis=1)
    within = np.abs((phi - center + np.pi) % (2 * np.pi) - np.pi) < inside
    clear = np.abs(depth) > 1e-6 * other.versine[0, 0]
    np.testing.assert_array_equal(within[clear], (depth > 0.0)[clear])


@pytest.mark.parametrize("seed", range(20))
def test_arcs_inside_triangles(seed):
    rng = np.random.default_rng(seed)
    corners = unit(rng, 3).T
    if np.linalg.det(corners) < 0.0:
        corners = corners[::-1]
    edges = [arc_between(p, q) for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True)]

    def joined(name):
        return np.concatenate([getattr(edge, name) for edge in edges], axis=-2)

    planes = HalfSpaces(
        np.concatenate([edge.planes.normal for edge in edges], axis=1), np.full((3, 1), 1e-15)
    )
    parts = (joined(name) for name in ("middle", "along", "half_angle", "u", "w"))
    outline = GreatCircleArcs(planes, *parts, None)
    arc = arc_between(*unit(rng, 2).T)
    low, high = arcs_inside_outline(arc, outline, np.zeros((1, 1), dtype=bool), np.ones(1))
    phi = np.linspace(-arc.half_angle[0, 0], arc.half_angle[0, 0], POINTS)
    height = on_arc(arc, phi) @ planes.normal[:, :, 0]
    clear = (np.abs(height) > MARGIN).all(axis=1)
    within = (low[0, 0] < phi) & (phi < high[0, 0])
    np.testing.assert_array_equal(within[clear], (height > 0.0).all(axis=1)[clear])


def beside(axis, angle, rng):
    """A unit vector at an angle from another one, in a random direction."""
    across = np.cross(axis, unit(rng))
    return np.cos(angle) * axis + np.sin(angle) * across / np.linalg.norm(across)


def side_by_side(*cones):
    """Cones of one region each, as one batch (k = 1, n of them)."""
    names = ("axis", "u", "w", "sine", "cosine", "versine")
    return Circles(*(np.concatenate([getattr(c, name) for c in cones], axis=-1) for name in names))


@pytest.mark.parametrize("size", [1e-9, 1e-3, 0.5, 1.4])
def test_of_circles_that_coincide_one_counts_as_inside(size):
    axis = unit(np.random.default_rng(3))
    circle = cone(axis, size, axis)
    for wins, width in ((1.0, np.pi), (-1.0, 0.0)):
        _, inside, outside = circles_inside_cones(circle, circle, np.full((1, 1), wins))
        assert (inside, outside) == (width, np.pi - width)


@pytest.mark.parametrize("wins", [-1.0, 1.0])
@pytest.mark.parametrize("size", [1e-6, 1e-3, 0.5, 1.4])
def test_circles_about_one_axis_do_not_coincide(size, wins):
    axis = unit(np.random.default_rng(4))
    small, large = cone(axis, size, axis), cone(axis, size * (1.0 + 1e-12), axis)
    assert circles_inside_cones(small, large, np.full((1, 1), wins))[1] == np.pi
    assert circles_inside_cones(large, small, np.full((1, 1), wins))[1] == 0.0


@pytest.mark.parametrize("wins", [-1.0, 1.0])
def test_equal_circles_about_nearly_one_axis_cross_a_quarter_turn_away(wins):
    rng = np.random.default_rng(5)
    axis = unit(rng)
    one, other = cone(axis, 0.5, axis), cone(beside(axis, 1e-9, rng), 0.5, axis)
    _, inside, _ = circles_inside_cones(one, other, np.full((1, 1), wins))
    assert inside == pytest.approx(np.pi / 2, abs=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_crossings_of_tiny_cones_with_wide_ones(seed):
    """Against 50 digits, in one batch with a pair of which no cone is tiny."""
    rng = np.random.default_rng(seed)
    tiny, wide = 10.0 ** rng.uniform(-7.0, -1.5), rng.uniform(0.2, 1.5)
    axis = unit(rng)
    far = beside(axis, wide + tiny * rng.uniform(-0.9, 0.9), rng)
    small, large = cone(far, tiny, far), cone(axis, wide, far)
    near = cone(beside(axis, 0.3, rng), 0.8, axis)
    first, second = side_by_side(small, large, near), side_by_side(large, small, large)
    inside = circles_inside_cones(first, second, np.ones((1, 1)))[1][0]
    with mpmath.workdps(50):
        exact = [mpmath.matrix(vector.tolist()) for vector in (axis, far)]
        exact = [vector / mpmath.norm(vector) for vector in exact]
        apart = mpmath.acos((exact[0].T * exact[1])[0])
        for k, (own, its) in enumerate([(tiny, wide), (wide, tiny)]):
            cosine = mpmath.cos(its) - mpmath.cos(own) * mpmath.cos(apart)
            want = mpmath.acos(cosine / (mpmath.sin(own) * mpmath.sin(apart)))
            # the axes are known to rounding: an angle against the tiny cone's size
            assert inside[k] == pytest.approx(float(want), rel=1e-14 / tiny + 1e-13)
    alone = circles_inside_cones(near, large, np.ones((1, 1)))[1]
    assert inside[2] == alone[0, 0]


@pytest.mark.parametrize("seed", range(5))
def test_arcs_in_the_plane_of_an_edge(seed):
    """Those against the edge are inside; those along it are if they are told to be."""
    rng = np.random.default_rng(seed)
    start = unit(rng)
    end, third = beside(start, 0.7, rng), beside(start, 0.5, rng)
    if np.linalg.det([start, end, third]) < 0.0:
        start, end = end, start
    edge = arc_between(start, end)
    along, against = arc_between(start, end), arc_between(end, start)
    for arc, alike, inside in ((against, False, True), (along, True, True), (along, False, False)):
        low, high = arcs_inside_outline(arc, edge, np.full((1, 1), alike), np.ones(1))
        whole = low[0, 0] <= -arc.half_angle[0, 0] and high[0, 0] >= arc.half_angle[0, 0]
        empty = max(low[0, 0], -arc.half_angle[0, 0]) >= min(high[0, 0], arc.half_angle[0, 0])
        assert (whole, empty) == (inside, not inside)


@pytest.mark.parametrize("turn", [1e-9, 1e-3])
def test_arcs_that_cross_an_edge_at_a_small_angle_are_cut(turn):
    """Their planes differ by more than the rounding of either."""
    start, end = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    edge = arc_between(start, end)
    lifted = [
        np.array([np.cos(a), np.sin(a), h]) / np.hypot(1.0, h)
        for a, h in ((0.2, -turn), (1.3, turn))
    ]
    arc = arc_between(*lifted)
    low, high = arcs_inside_outline(arc, edge, np.ones((1, 1), dtype=bool), np.ones(1))
    assert low[0, 0] == pytest.approx(0.0, abs=1e-6) and high[0, 0] >= arc.half_angle[0, 0]


@pytest.mark.parametrize("half", [1e-6, 1e-3, 0.3, 1.2])
@pytest.mark.parametrize("lean", [0.0, 0.2])
def test_caps_have_their_closed_form(half, lean):
    normal, axis = np.array([0.0, 0.0, 1.0]), np.array([np.sin(lean), 0.0, np.cos(lean)])
    circle = cone(axis, half, axis)
    potential = make_antiderivative(normal[:, None], axis[:, None], circle)
    whole = (np.full((1, 1, 1), -np.pi), np.full((1, 1, 1), np.pi))
    # half of the boundary's integral: the cosine over the cap, pi sin^2 times that of its axis
    found = 0.5 * boundary_integral(potential, whole)[0]
    assert found == pytest.approx(np.pi * np.sin(half) ** 2 * np.cos(lean), rel=1e-13)


@pytest.mark.parametrize("seed", range(5))
def test_integrals_along_arcs_are_those_of_quadrature(seed):
    rng = np.random.default_rng(seed)
    start, end, normal, center = unit(rng, 4).T
    arc = arc_between(start, end)
    potential = make_antiderivative(normal[:, None], center[:, None], arc)
    low, high = np.sort(rng.uniform(-arc.half_angle[0, 0], arc.half_angle[0, 0], 2))
    found = boundary_integral(potential, (np.full((1, 1, 1), low), np.full((1, 1, 1), high)))[0]
    plane = arc.planes.normal[:, 0, 0]
    # n.(w x dw) is n.plane dphi on a great circle; about a centre c it is n.((w - c) x dw)
    along = arc.along[:, 0, 0]
    middle = arc.middle[:, 0, 0]

    def integrand(phi):
        w = np.cos(float(phi)) * middle + np.sin(float(phi)) * along
        step = np.cross(plane, w)
        return float(normal @ np.cross(w - center, step))

    want = float(mpmath.quad(integrand, [low, high]))
    assert found == pytest.approx(want, rel=1e-12, abs=1e-13)
