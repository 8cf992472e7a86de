# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed forms of open light, against published view factors and adaptive quadrature.

Catalogue: Howell, A Catalog of Radiation Heat Transfer Configuration Factors, sections B-3, B-4,
B-43 to B-45: differential element to a rectangle at its corner, parallel and perpendicular, and
to a sphere above the horizon and cut by it. A factor here is pi times a configuration factor.
"""

import mpmath
import numpy as np
import pytest
from scipy import integrate

from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.registry import make_emitter
from adaptive_drt.scene.description import DiskLight, PointLight, QuadLight, SphereLight

WHITE = (1.0, 1.0, 1.0)
UP = (0.0, 0.0, 1.0)


def factor(light, point=(0.0, 0.0, 0.0), normal=UP):
    """The core's factor of one light at one point."""
    emitter = make_emitter(light, LightMotion(np.zeros(3), np.zeros(3)))
    at, up = (np.array(x, dtype=float)[:, None] for x in (point, normal))
    return float(emitter.irradiance_factor(emitter.to_center(at), at, up)[0])


def rectangle(corner, u, v):
    """Quad light from its corner and whole edges; it emits towards cross(u, v)."""
    corner, u, v = (np.array(x, dtype=float) for x in (corner, u, v))
    center = corner + (u + v) / 2.0
    return QuadLight(tuple(center), tuple(u / 2.0), tuple(v / 2.0), WHITE)


@pytest.mark.parametrize("a", [1e-3, 0.3, 1.0, 7.0, 1e4])
@pytest.mark.parametrize("b", [1e-3, 0.5, 2.0, 1e4])
def test_parallel_rectangle_at_its_corner(a, b):
    """Howell B-3: the element's normal passes through a corner of a parallel rectangle."""
    x, y = mpmath.mpf(a), mpmath.mpf(b)
    rx, ry = mpmath.sqrt(1 + x * x), mpmath.sqrt(1 + y * y)
    want = (x / rx * mpmath.atan(y / rx) + y / ry * mpmath.atan(x / ry)) / 2
    light = rectangle((0, 0, 1), (0, b, 0), (a, 0, 0))
    assert factor(light) == pytest.approx(float(want), rel=1e-12)


@pytest.mark.parametrize("a", [0.01, 0.3, 1.0, 7.0, 1e3])
@pytest.mark.parametrize("b", [0.01, 0.5, 2.0, 1e3])
def test_perpendicular_rectangle_at_its_corner(a, b):
    """Howell B-4: a rectangle in a plane at right angles, its edge in the element's plane."""
    x, y = mpmath.mpf(a), mpmath.mpf(b)  # heights and widths over the distance
    root = mpmath.sqrt(1 + x * x)
    want = (mpmath.atan(y) - mpmath.atan(y / root) / root) / 2
    light = rectangle((1, 0, 0), (0, 0, a), (0, b, 0))
    assert factor(light) == pytest.approx(float(want), rel=1e-12)
    assert factor(rectangle((1, 0, 0), (0, b, 0), (0, 0, a))) == 0.0  # it shines the other way


WHOLE = [
    (h, tilt)
    for h in (1.001, 1.5, 4.0, 1e5)
    for tilt in (0.0, 0.4, 1.2, 1.5)
    if np.cos(tilt) >= 1.0 / h  # the rest is cut by the horizon
]


@pytest.mark.parametrize(("h", "tilt"), WHOLE)
def test_sphere_above_the_horizon(h, tilt):
    """Howell B-43: cos(tilt) / h^2 while the whole sphere is above the horizon."""
    light = SphereLight((h * np.sin(tilt), 0.0, h * np.cos(tilt)), 1.0, WHITE)
    assert factor(light) == pytest.approx(np.pi * np.cos(tilt) / h**2, rel=1e-12)


@pytest.mark.parametrize("h", [1.01, 1.5, 4.0, 50.0])
@pytest.mark.parametrize("share", [-0.999, -0.7, -0.2, 0.0, 0.3, 0.8, 0.999])
def test_sphere_cut_by_the_horizon(h, share):
    """Howell B-45 (tilted element, sphere partly below), by integration of its definition."""
    half = np.arcsin(1.0 / h)
    tilt = np.pi / 2.0 - share * half
    light = SphereLight((h * np.sin(tilt), 0.0, h * np.cos(tilt)), 1.0, WHITE)
    assert factor(light) == pytest.approx(cone(tilt, half), rel=1e-7, abs=1e-12)


@pytest.mark.parametrize("h", [1.01, 1.5, 4.0, 50.0, 1e4, 1e6])
@pytest.mark.parametrize("share", [-0.9, -0.5, 0.0, 0.3, 0.8, 0.999])
def test_sphere_cut_by_the_horizon_by_its_published_factor(h, share):
    """Howell B-44 and B-45: tilted element, sphere partly below, against 50 digits."""
    half = np.arcsin(1.0 / h)
    tilt = np.pi / 2.0 - share * half
    place = (h * np.sin(tilt), 0.0, h * np.cos(tilt))
    with mpmath.workdps(50):
        x, z = mpmath.mpf(float(place[0])), mpmath.mpf(float(place[2]))
        square = x * x + z * z - 1  # h^2 - 1, h as the rounded place has it
        cosine, sine = z / mpmath.sqrt(square + 1), x / mpmath.sqrt(square + 1)
        root = mpmath.sqrt(square)
        y = -root * cosine / sine
        arc = mpmath.sqrt(1 - y * y)
        want = (cosine * mpmath.acos(y) - root * sine * arc) / (square + 1)
        want += mpmath.atan(sine * arc / root)
    got = factor(SphereLight(place, 1.0, WHITE))
    # of the whole sphere's factor: of a sliver above the horizon only so much is known
    assert got == pytest.approx(float(want), rel=1e-12, abs=1e-12 * np.pi / h**2 / h)


@pytest.mark.parametrize("size", [1e-3, 0.1, 1.0, 30.0])
@pytest.mark.parametrize("tilt", [0.0, 0.7, 1.4, 1.5708, 1.8, 3.0])
def test_disk_that_faces_the_point(size, tilt):
    light = DiskLight((2.0 * np.sin(tilt), 0.0, 2.0 * np.cos(tilt)), 2.0 * size, WHITE)
    assert factor(light) == pytest.approx(cone(tilt, np.arctan(size)), rel=1e-7, abs=1e-11)


def cone(tilt, half):
    """Integral of max(0, n.w) over a circular cone: exact in azimuth, adaptive in the angle."""

    def ring(angle):
        a, b = np.cos(tilt) * np.cos(angle), np.sin(tilt) * np.sin(angle)
        # mean of max(0, a + b cos phi) over a turn
        if a >= abs(b):
            return 2.0 * np.pi * a * np.sin(angle)
        if a <= -abs(b):
            return 0.0
        phi = np.arccos(-a / b)
        return 2.0 * (a * phi + b * np.sin(phi)) * np.sin(angle)

    kinks = sorted({abs(np.pi / 2.0 - tilt), np.pi - abs(np.pi / 2.0 - tilt)})
    kinks = [k for k in kinks if 0.0 < k < half]
    options = {"epsabs": 1e-14, "epsrel": 1e-11, "limit": 400}
    return integrate.quad(ring, 0.0, half, points=kinks or None, **options)[0]


@pytest.mark.parametrize("seed", range(30))
def test_quad_partly_below_the_horizon(seed):
    """Any parallelogram over any horizon, against integration along lines of the light."""
    rng = np.random.default_rng(seed)
    u, v, center = rng.normal(size=(3, 3)) * [[0.5], [0.5], [1.0]]
    if np.cross(u, v) @ center > 0.0:
        v = -v
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    light = QuadLight(tuple(center), tuple(u), tuple(v), WHITE)
    front = np.cross(u, v)

    def strip(y):
        start, step = center + y * v, u
        # the part of the strip above the horizon
        h0, h1 = (start - step) @ normal, (start + step) @ normal
        if h0 <= 0.0 and h1 <= 0.0:
            return 0.0
        cut = -1.0 + 2.0 * h0 / (h0 - h1) if h0 * h1 < 0.0 else None
        low, high = (-1.0, 1.0) if cut is None else ((-1.0, cut) if h0 > 0.0 else (cut, 1.0))

        def point(x):
            to = start + x * step
            return (to @ normal) * (-to @ front) / (to @ to) ** 2

        return integrate.quad(point, low, high, epsabs=1e-13, epsrel=1e-11)[0]

    corners = [(center + y * v + x * u) @ normal for y in (-1, 1) for x in (-1, 1)]
    low, high = corners[:2], corners[2:]
    kinks = [-1.0 + 2.0 * a / (a - b) for a, b in zip(low, high, strict=True) if a * b < 0.0]
    want = integrate.quad(strip, -1, 1, points=kinks or None, epsabs=1e-12, epsrel=1e-10)[0]
    assert factor(light, normal=tuple(normal)) == pytest.approx(want, rel=1e-8, abs=1e-10)


@pytest.mark.parametrize("size", [1e-2, 1e-4, 1e-6, 1e-8])
def test_tiny_quads_do_not_cancel(size):
    """A light of tiny solid angle is a point of intensity radiance times projected area."""
    light = QuadLight((0.3, 0.4, 2.0), (size, 0.0, 0.0), (0.0, -size, 0.0), WHITE)
    distance2 = 0.09 + 0.16 + 4.0
    want = 4.0 * size**2 * (2.0 / distance2**0.5) ** 2 / distance2
    # the quad's own size changes the factor by a share of about size^2
    assert factor(light) == pytest.approx(want, rel=max(1e-14, 4.0 * size**2))


def test_point_light_falls_off_with_the_square():
    light = PointLight((3.0, 0.0, 4.0), WHITE)
    assert factor(light) == pytest.approx(0.8 / 25.0, rel=1e-15)
    assert factor(light, normal=(0.0, 0.0, -1.0)) == 0.0


@pytest.mark.parametrize("kind", [SphereLight, DiskLight, PointLight, QuadLight])
def test_below_the_horizon_is_nothing(kind):
    sizes = {QuadLight: ((0.1, 0.0, 0.0), (0.0, 0.1, 0.0)), PointLight: ()}.get(kind, (0.1,))
    assert factor(kind((0.5, 0.2, -3.0), *sizes, WHITE)) == 0.0
