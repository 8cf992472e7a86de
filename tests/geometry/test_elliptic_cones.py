# SPDX-License-Identifier: GPL-3.0-or-later
"""Elliptic cones: frames and boundary integrals with 50 digits, intervals against points."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from adaptive_drt.geometry.elliptic_cones import (
    EllipticCones,
    arcs_inside_elliptic_cones,
    cone_antiderivative,
    cone_boundary_values,
    cones_of_circles,
    cones_of_ellipses,
    ellipsoid_outline,
    elliptic_cones_outside_half_spaces,
    whole_cone_factor,
)
from adaptive_drt.geometry.spherical_curves import (
    HalfSpaces,
    make_circles,
    make_great_circle_arcs,
)
from elliptic_outlines import MARGIN, form, random_cones, unit

DIGITS = 50


def precise_cone(center, u, v):
    c, u, v = (mpmath.matrix([mpmath.mpf(float(x)) for x in each]) for each in (center, u, v))
    values, vectors = mpmath.eigsy(u * u.T + v * v.T - c * c.T)
    z = vectors[:, 0]
    if (z.T * c)[0] < 0:
        z = -z
    return z, mpmath.sqrt(-values[2] / values[0]), mpmath.sqrt(-values[1] / values[0])


def test_frames_of_ellipses_agree_with_50_digits():
    rng = np.random.default_rng(5)
    count = 60
    center = rng.normal(size=(3, count)) * 10.0 ** rng.uniform(-1, 3, count)
    u, v = (rng.normal(size=(3, count)) * 10.0 ** rng.uniform(-3, 1, count) for _ in range(2))
    cones = cones_of_ellipses(center, u, v)
    assert (cones.a >= cones.b).all() and not cones.empty.any()
    np.testing.assert_allclose(np.cross(cones.x, cones.y, axis=0), cones.z, atol=1e-14)
    with mpmath.workdps(DIGITS):
        for i in range(count):
            z, a, b = precise_cone(center[:, i], u[:, i], v[:, i])
            axis = mpmath.matrix([float(x) for x in cones.z[:, i]])
            assert mpmath.norm(axis - z) < 4e-15
            assert abs(cones.a[i] / a - 1) < 4e-15 * (1 + a)
            # a flat ellipse near its own plane: rounding of the vectors turns that plane
            assert abs(cones.b[i] / b - 1) < 4e-15 * (1 + a) * (1 + a / b)


def precise_integral(n, c, frame, a, b, low, high):
    """Integral of n.((w - c) x dw) along a cone's boundary, by Gauss-Legendre quadrature."""
    n, c, x, y, z = (mpmath.matrix([mpmath.mpf(float(q)) for q in each]) for each in (n, c, *frame))
    a, b, low, high = (mpmath.mpf(float(q)) for q in (a, b, low, high))

    def cross(p, q):
        rows = [(1, 2), (2, 0), (0, 1)]
        return mpmath.matrix([p[i] * q[j] - p[j] * q[i] for i, j in rows])

    def place(phi):
        r = a * mpmath.cos(phi) * x + b * mpmath.sin(phi) * y + z
        return r / mpmath.norm(r)

    def integrand(phi):
        r = a * mpmath.cos(phi) * x + b * mpmath.sin(phi) * y + z
        d = b * mpmath.cos(phi) * y - a * mpmath.sin(phi) * x
        return (n.T * cross(r, d))[0] / (r.T * r)[0]

    turn = mpmath.quad(integrand, mpmath.linspace(low, high, 5))
    return turn - (n.T * cross(c, place(high) - place(low)))[0]


@pytest.mark.parametrize("seed", range(4))
def test_boundary_integrals_agree_with_quadrature(seed):
    rng = np.random.default_rng(seed)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    frame[:, 2] *= np.sign(np.linalg.det(frame))
    a = 10.0 ** rng.uniform(-3.0, 1.5)
    b = a if seed == 0 else a * 10.0 ** rng.uniform(-3.0, 0.0)
    axes = (frame[:, i].reshape(3, 1, 1) for i in range(3))
    cones = EllipticCones(*axes, np.array([[a]]), np.array([[b]]))
    n, center = unit(rng, 1), unit(rng, 1)
    low = rng.uniform(-np.pi, np.pi)
    high = low + rng.uniform(0.0, 2.0 * np.pi)
    potential = cone_antiderivative(n, center, cones)
    value = np.diff([cone_boundary_values(potential, np.array([[x]]))[0, 0] for x in (low, high)])
    with mpmath.workdps(20):
        exact = precise_integral(n[:, 0], center[:, 0], frame.T, a, b, low, high)
        assert abs(value[0] - exact) < 4e-15
    ends = [cone_boundary_values(potential, np.array([[x]]))[0, 0] for x in (-np.pi, np.pi)]
    np.testing.assert_allclose(
        0.5 * (ends[1] - ends[0]), whole_cone_factor(n, cones)[0, 0], atol=4e-15
    )


def test_the_outline_of_an_ellipsoid_bounds_the_rays_that_meet_it():
    rng = np.random.default_rng(2)
    count = 20_000
    axes = rng.normal(size=(3, 3, count)) * 10.0 ** rng.uniform(-2.0, 0.0, (1, 3, count))
    v = rng.normal(size=(3, count)) * 3.0
    inverse = np.linalg.inv(np.moveaxis(axes, -1, 0))
    y = np.einsum("nij,jn->in", inverse, v)
    outside = (y * y).sum(axis=0) > 1.0 + 1e-9
    cones = cones_of_ellipses(*ellipsoid_outline(v, axes))
    # random rays near the ellipsoid, so that half of them meet it
    w = v + 1.5 * np.einsum("ijn,jn->in", axes, unit(rng, count))
    g = np.einsum("nij,jn->in", inverse, w)
    along, ww, yy = (g * y).sum(axis=0), (g * g).sum(axis=0), (y * y).sum(axis=0)
    meets = (along**2 > ww * (yy - 1.0)) & (along > 0.0)
    value, scale, height = form(cones, w)
    clear = outside & (np.abs(value) > 1e-9 * scale)
    assert clear.mean() > 0.8 and 0.2 < meets[clear].mean() < 0.9
    np.testing.assert_array_equal(((value < 0.0) & (height > 0.0))[clear], meets[clear])


def test_circular_cones_are_elliptic_ones():
    rng = np.random.default_rng(4)
    axis, half = unit(rng, 1, 50), rng.uniform(0.01, 1.5, (1, 50))
    circles = make_circles(axis, np.sin(half), np.cos(half), unit(rng, 50))
    cones = cones_of_circles(circles)
    phi = rng.uniform(-np.pi, np.pi, (1, 50))
    place = cones.directions(phi)
    place /= np.linalg.norm(place, axis=0)
    np.testing.assert_allclose((place * axis).sum(axis=0), np.cos(half), atol=1e-14)
    np.testing.assert_allclose(
        np.arctan2((place * circles.w).sum(axis=0), (place * circles.u).sum(axis=0)),
        phi,
        atol=1e-13,
    )


@pytest.mark.parametrize("seed", range(4))
def test_great_circle_arcs_run_inside_cones_where_their_points_do(seed):
    rng = np.random.default_rng(seed)
    count = 2_000
    cones = random_cones(rng, count, -2.0, 1.0)
    start, end = unit(rng, count), unit(rng, count)
    normal = np.cross(start, end, axis=0)
    normal /= np.linalg.norm(normal, axis=0)
    planes = HalfSpaces(normal[:, None], np.full((1, count), 1e-15))
    arcs = make_great_circle_arcs(start[:, None], end[:, None], planes)
    stacked = EllipticCones(
        *(each[..., None, :] for each in (cones.x, cones.y, cones.z, cones.a, cones.b))
    )
    low, high = (each[0, 0] for each in arcs_inside_elliptic_cones(arcs, stacked))
    met = 0
    for _ in range(20):
        phi = rng.uniform(-1.0, 1.0, count) * arcs.half_angle[0]
        w = np.cos(phi) * arcs.middle[:, 0] + np.sin(phi) * arcs.along[:, 0]
        value, scale, height = form(cones, w)
        clear = np.abs(value) > MARGIN / cones.b * scale
        inside = (value < 0.0) & (height > 0.0)
        met += int(inside.sum())
        np.testing.assert_array_equal(((low < phi) & (phi < high))[clear], inside[clear])
    assert met > count


@pytest.mark.parametrize("seed", range(4))
def test_cones_run_outside_half_spaces_where_their_points_do(seed):
    rng = np.random.default_rng(seed)
    count = 2_000
    cones = random_cones(rng, count, -2.0, 1.0)
    normal = unit(rng, count)
    planes = HalfSpaces(normal[:, None], np.full((1, count), 1e-15))
    stacked = EllipticCones(
        *(each[..., None, :] for each in (cones.x, cones.y, cones.z, cones.a, cones.b))
    )
    center, half = (each[0, 0] for each in elliptic_cones_outside_half_spaces(stacked, planes))
    for _ in range(20):
        phi = rng.uniform(-np.pi, np.pi, count)
        w = cones.directions(phi)
        height = (w * normal).sum(axis=0)
        clear = np.abs(height) > 1e-11 * np.linalg.norm(w, axis=0)
        away = np.abs(np.remainder(phi - center + np.pi, 2.0 * np.pi) - np.pi)
        np.testing.assert_array_equal((away < half)[clear], (height < 0.0)[clear])
