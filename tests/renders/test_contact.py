# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact, nesting, overlap and grazing light: no acne, no leaks, against long doubles.

Scenes are turned at random, so that nothing is aligned with an axis and contact is contact only
up to rounding. Pixels count where the oracle's answer is clear by `CLEAR`; there a light that is
wholly seen must bring its closed form, and one that is wholly hidden nothing at all.
"""

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    DiskLight,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.settings import Settings
from oracle.contact import camera_spots, gaps
from oracle.kernels import cap, lambert, quad_corners, small_quad
from oracle.numbers import LONG, cross, dot
from random_scenes import look_at

CLEAR = 2.0**-36
"""Of the scene's extent: 16 times `GRAZE`, in which the core may answer either way."""
INNER = 2.0**-30
"""Of the extent: hits on the inner side of spheres are 2^-37 of the radius off, on purpose."""
SETTINGS = Settings(method="RAYS", use_edges=False, use_motion=False, light_rays=4)
SIZE = 24
WHITE = (1.0, 1.0, 1.0)
GRID = 5


class World:
    """A frame of its own, turned and moved at random; `at` takes local places to the world."""

    def __init__(self, seed, scale=1.0):
        rng = np.random.default_rng(seed)
        self.turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        self.place = rng.normal(size=3) * scale
        self.scale = scale

    def at(self, *p):
        return tuple(float(x) for x in self.place + self.scale * (self.turn @ np.array(p)))

    def along(self, *p):
        return tuple(float(x) for x in self.scale * (self.turn @ np.array(p)))

    def sphere(self, p, r):
        return Sphere(self.at(*p), r * self.scale)

    def quad(self, corner, u, v):
        return Quad(self.at(*corner), self.along(*u), self.along(*v))

    def camera(self, eye, target, width):
        """A camera that sees so wide a part (local units) of what is around its target."""
        far = float(np.linalg.norm(np.subtract(eye, target)))
        return look_at(
            self.at(*eye),
            self.at(*target),
            resolution=(SIZE, SIZE),
            focal_length=min(36.0 * far / width, 36e3),
        )

    def lights(self, p, size=0.3):
        """A light of each kind at a place, that shines towards the origin of the frame."""
        aim = -np.array(p) / np.linalg.norm(p)
        u = np.cross(aim, (0.31, -0.52, 0.8))
        u *= size / np.linalg.norm(u)
        v = np.cross(aim, u)
        r = size * self.scale
        return {
            "point": PointLight(self.at(*p), WHITE),
            "quad": QuadLight(self.at(*p), self.along(*u), self.along(*v), WHITE),
            "sphere": SphereLight(self.at(*p), r, WHITE),
            "disk": DiskLight(self.at(*p), r, WHITE),
        }


def places_on(light, spots):
    """Points (m, 3, n) of a light, and by how far the farthest of all lies from the nearest one."""
    c = LONG.lift(light.center if hasattr(light, "center") else light.position)[:, None]
    c = c + 0 * spots.point
    if isinstance(light, PointLight):
        return c[None], 0.0
    steps = np.linspace(-1, 1, GRID)
    if isinstance(light, QuadLight):
        u, v = (LONG.lift(e)[:, None] for e in (light.half_u, light.half_v))
        reach = (np.linalg.norm(light.half_u) + np.linalg.norm(light.half_v)) / (GRID - 1)
        return np.stack([c + s * u + t * v for s in steps for t in steps]), reach
    # a ball around the round ones
    return c[None], light.radius


def brightness(light, spots):
    """Irradiance (n,) by a light of radiance (intensity) 1 that nothing hides."""
    c = LONG.lift(light.center if hasattr(light, "center") else light.position)[:, None]
    to = c - spots.point
    far = LONG.norm(to)
    cosine = dot(to, spots.normal) / far
    if isinstance(light, PointLight):
        return np.maximum(cosine, 0) / far**2
    if isinstance(light, QuadLight):
        u, v = (LONG.lift(e)[:, None] for e in (light.half_u, light.half_v))
        u, v = u + 0 * to, v + 0 * to
        full = lambert(LONG, quad_corners(to, u, v), spots.normal)
        small = LONG.norm(u) + LONG.norm(v) < 2.0**-7 * far
        full = np.where(small, small_quad(LONG, to, u, v, spots.normal), full)
        return np.where(dot(cross(u, v), to) < 0, full, 0)
    r = LONG.lift(light.radius)
    if isinstance(light, DiskLight):
        slant = np.sqrt(far * far + r * r)
        return cap(LONG, cosine, r / slant, far / slant)
    sine = np.minimum(r / far, 1)
    return cap(LONG, cosine, sine, np.sqrt((1 - sine) * (1 + sine)))


def check(scene, least=0.5):
    """Compare a picture of one light with the oracle; so many pixels must be clear for a point.

    Of lights with a size fewer are, since the oracle judges them by a few of their points.
    """
    color = render_image(scene, SETTINGS).color.reshape(3, -1)[0]
    spots = camera_spots(scene)
    (light,) = scene.lights
    extent = max(np.abs(LONG.norm(spots.point[:, spots.ids >= 0] - eye(scene))).max(), 0)
    clear = (spots.margin > CLEAR * extent) & (spots.ids >= 0)
    points, reach = places_on(light, spots)
    sides = np.stack([gaps(scene, spots, p) for p in points])
    slack = reach + CLEAR * (extent + LONG.norm(points[0] - spots.point))
    seen = clear & (sides > slack).all(axis=(0, 1))
    hidden = clear & (sides < -slack).all(axis=0).any(axis=0)
    found = int(seen.sum()), int(hidden.sum())
    assert sum(found) >= least * SIZE * SIZE or not isinstance(light, PointLight), found
    leaks = np.flatnonzero(hidden & (color != 0.0))
    assert not leaks.size, f"{leaks.size} of {hidden.sum()} hidden pixels are lit: {leaks[:5]}"
    want = (brightness(light, spots) * scene.shapes[0].material.color[0] / np.pi).astype(float)
    # places are off by roundoffs of the extent: that tilts small spheres, and counts in flat light
    height = np.maximum(np.abs(sides[:, 0]).min(axis=0), CLEAR * extent)
    least_radius = min([x.radius for x in scene.shapes if isinstance(x, Sphere)], default=extent)
    tilt = (1.0 + LONG.norm(points[0] - spots.point) / least_radius) * extent / height
    allowed = np.where(spots.inside, INNER * extent / height, 1e-12 + 2.0**-44 * tilt)
    wrong = np.flatnonzero(seen & (np.abs(color - want) > allowed * want))
    assert not wrong.size, (
        f"{wrong.size} of {seen.sum()} open pixels are off: {wrong[:5]}, "
        f"by up to {np.max(np.abs(color / np.where(want > 0, want, 1) - 1)[wrong]):.2g}, "
        f"{np.max((np.abs(color - want) / (allowed * want + 1e-300))[wrong]):.2g} times too much"
    )
    return found


def eye(scene):
    return LONG.lift([row[3] for row in scene.camera.matrix[:3]])[:, None]


KINDS = ("point", "quad", "sphere", "disk")
FLOOR = ((-9, -9, 0), (18, 0, 0), (0, 18, 0))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("width", [4.0, 0.1, 1e-2, 1e-3])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_sphere_rests_on_a_plane(kind, width, scale):
    """The place of contact, close to, with the light beyond it and behind the eye."""
    world = World(1, scale)
    shapes = (world.quad(*FLOOR), world.sphere((0, 0, 1), 1.0))
    camera = world.camera((2.5, -2.5, 0.8), (0.2 * width, -0.2 * width, 0.0), width)
    for place in ((-3, 1, 4), (3, -4, 1.5)):
        light = world.lights(place, 0.3 * min(width, 1.0) ** 2)[kind]
        print(check(Scene(camera, shapes, (light,)), 0.3))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("width", [4.0, 0.1, 1e-3])
@pytest.mark.parametrize("small", [1.0, 1e-2, 1e-4])
def test_two_spheres_touch(kind, width, small):
    world = World(2)
    shapes = (world.sphere((0, 0, 0), 1.0), world.sphere((0, 0, 1 + small), small))
    wide = width * small
    light = world.lights((4, -1, 2), 0.1 * min(1.0, wide))[kind]
    camera = world.camera((3.0, -3.0, 1.2), (0.0, 0.0, 1.0), wide)
    print(check(Scene(camera, shapes, (light,)), 0.3))


@pytest.mark.parametrize("kind", KINDS)
def test_spheres_overlap_and_nest(kind):
    """From outside, from between two shells and from within, with the light there as well."""
    world = World(3)
    shells = (world.sphere((0, 0, 0), 1.0), world.sphere((0.1, 0.0, 0.0), 2.0))
    lens = (*shells, world.sphere((0.8, 0.0, 0.3), 0.7))
    spots = {"outside": (5, 1, 2), "between": (0, 1.4, 0.2), "within": (0.2, 0.1, 0.0)}
    for shapes in (shells, lens):
        for eye_at in spots.values():
            for name, light_at in spots.items():
                light = world.lights(tuple(np.multiply(light_at, 1.03)), 0.05)[kind]
                if name == "outside":
                    light = world.lights((2.0, -4.0, 3.0), 0.3)[kind]
                camera = world.camera(eye_at, (0.05, -0.1, 0.1), 1.0)
                check(Scene(camera, shapes, (light,)), 0.0)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9])
def test_shells_that_nearly_coincide(kind, gap):
    """A light within the inner of two shells does not show on the outer one, nor the reverse."""
    world = World(4)
    shapes = (world.sphere((0, 0, 0), 1.0), world.sphere((0, 0, 0), 1.0 + gap))
    for light_at, eye_at in (((0.1, 0.2, 0.1), (4, 1, 0)), ((4, 0, 1), (0.3, 0.1, 0.2))):
        camera = world.camera(eye_at, (0.0, 0.0, 0.0), 2.5)
        seen, hidden = check(Scene(camera, shapes, (world.lights(light_at, 0.05)[kind],)), 0.3)
        assert hidden and not seen


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("height", [1e-1, 1e-3, 1e-5, 1e-7])
def test_light_that_grazes(kind, height):
    """A light just above a floor, a low wall between, and a sphere that touches its rays."""
    world = World(5)
    shapes = (
        world.quad(*FLOOR),
        world.quad((0.5, -2, 0), (0, 2, 0), (0, 0, 0.4 * height)),
        world.sphere((0.0, 1.0, 0.5), 0.5),
    )
    light = world.lights((4, 0.2, height), 0.4 * height)[kind]
    camera = world.camera((-2.0, -3.0, 2.0), (0.0, 0.0, 0.0), 4.0)
    print(check(Scene(camera, shapes, (light,)), 0.3))


@pytest.mark.parametrize("kind", KINDS)
def test_light_in_the_plane_of_a_quad(kind):
    """A sheet that stands upright in the light's own plane hides half of it, or an edge-on point.

    The sheet itself, lit along its plane, stays dark by a point in that plane.
    """
    world = World(6)
    shapes = (world.quad(*FLOOR), world.quad((0, -1, 0), (0, 2, 0), (0, 0, 1)))
    for at in ((0, 0.3, 3.0), (1e-6, 0.3, 3.0), (0, 5.0, 0.4)):
        light = world.lights(at, 0.2)[kind]
        camera = world.camera((-3.0, -3.0, 2.0), (0.0, 0.0, 0.3), 4.0)
        print(check(Scene(camera, shapes, (light,)), 0.1))


@pytest.mark.parametrize("kind", KINDS)
def test_camera_in_the_plane_of_a_quad(kind):
    """A sheet seen edge-on is not seen, and its shadow is."""
    world = World(7)
    shapes = (world.quad(*FLOOR), world.quad((-1, 0.5, 0.6), (2, 0, 0), (0, 2, 0)))
    light = world.lights((0.5, 1.0, 4.0), 0.1)[kind]
    camera = world.camera((0.0, -3.0, 0.6), (0.0, 1.0, 0.3), 4.0)
    print(check(Scene(camera, shapes, (light,)), 0.2))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [1e2, 1e4, 1e6])
def test_vast_sheets_in_one_plane_do_not_shadow_each_other(kind, size):
    """Hits near the eye on a sheet whose corner is far off its plane by roundoffs of that."""
    world = World(8)
    one = world.quad((-size, -0.7 * size, 0), (2 * size, 0, 0), (0.1 * size, 2 * size, 0))
    other = world.quad((-0.5 * size, -size, 0), (0.2 * size, 1.5 * size, 0), (size, 0, 0))
    light = world.lights((1, 0.5, 2), 0.2)[kind]
    camera = world.camera((-1.0, -1.0, 2.0), (0.0, 0.0, 0.0), 2.0)
    alone = render_image(Scene(camera, (one,), (light,)), SETTINGS).color
    assert alone.min() > 0.0
    for shapes in ((one, other), (other, one), (one, one, other)):
        both = render_image(Scene(camera, shapes, (light,)), SETTINGS).color
        np.testing.assert_allclose(both, alone, rtol=1e-9)
