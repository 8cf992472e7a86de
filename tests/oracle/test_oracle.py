# SPDX-License-Identifier: GPL-3.0-or-later
"""The oracle against what is known without it: Blender's camera, circles, published formulas."""

import numpy as np
import pytest

from adaptive_drt.scene.description import (
    DiskLight,
    Material,
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
)
from oracle.camera import project, rays
from oracle.lights import aim, emitted, place
from oracle.picture import reference
from oracle.truth import edges, masks, motion, penumbrae, pixels_of
from random_scenes import look_at, random_scene, scaled

FLOOR = Quad((-5.0, -5.0, 0.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0), Material((1.0, 1.0, 1.0)))
ABOVE = look_at((0.0, 0.0, 10.0), (0.0, 0.0, 0.0), resolution=(40, 40))


def floor_points(scene):
    """Points (n, 2) of the floor z = 0 under the pixels' centres."""
    spots = pixels_of(scene.camera) + 0.5
    o, d = rays(scene.camera, spots[:, 0], spots[:, 1], np.zeros(len(spots)))
    return (o - (o[:, 2:] / d[:, 2:]) * d)[:, :2]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_camera_is_blenders(seed):
    bpy = pytest.importorskip("bpy")
    scene = random_scene(seed)
    camera = scene.camera
    data = bpy.data.cameras.new("C")
    data.lens, data.sensor_width, data.sensor_height = (
        camera.focal_length,
        camera.sensor_width,
        camera.sensor_height,
    )
    data.sensor_fit, data.shift_x, data.shift_y = (
        camera.sensor_fit,
        camera.shift_x,
        camera.shift_y,
    )
    thing = bpy.data.objects.new("C", data)
    aspect = np.array(camera.pixel_aspect) / min(camera.pixel_aspect)
    width, height = camera.resolution
    matrix = np.array(
        thing.calc_matrix_camera(
            bpy.context.evaluated_depsgraph_get(),
            x=width,
            y=height,
            scale_x=aspect[0],
            scale_y=aspect[1],
        )
    )
    bpy.data.objects.remove(thing)
    spots = np.random.default_rng(seed).random((20, 2)) * camera.resolution
    o, d = rays(camera, spots[:, 0], spots[:, 1], np.zeros(20))
    world = np.linalg.inv(np.array(camera.matrix))
    local = (o + 3.0 * d) @ world[:3, :3].T + world[:3, 3]
    clip = np.concatenate([local, np.ones((20, 1))], axis=1) @ matrix.T
    seen = (clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * camera.resolution
    np.testing.assert_allclose(seen, spots, atol=1e-4)  # Blender computes in float32


@pytest.mark.parametrize("seed", range(6))
def test_project_undoes_rays(seed):
    camera = random_scene(seed).camera
    rng = np.random.default_rng(seed)
    spots, t = rng.random((50, 2)) * camera.resolution, rng.random(50) - 0.5
    o, d = rays(camera, spots[:, 0], spots[:, 1], t)
    np.testing.assert_allclose(project(camera, o + 2.5 * d, t), spots, rtol=0, atol=1e-9)


def test_irradiance_of_round_lights_straight_above():
    p, n, zero = np.zeros((4096, 3)), np.tile([0.0, 0.0, 1.0], (4096, 1)), np.zeros(4096)
    grid = (np.stack(np.meshgrid(np.arange(64), np.arange(64)), -1).reshape(-1, 2) + 0.5) / 64
    ball = SphereLight((0.0, 0.0, 3.0), 1.0, (1.0,) * 3)
    disk = DiskLight((0.0, 0.0, 3.0), 1.0, (1.0,) * 3)
    _, share = emitted(ball, p, n, zero, grid)
    assert share.mean() == pytest.approx(np.pi / 9.0, rel=1e-4)
    _, share = emitted(disk, p, n, zero, grid)
    assert share.mean() == pytest.approx(np.pi / 10.0, rel=1e-4)


@pytest.mark.parametrize("kind", [DiskLight, SphereLight, QuadLight])
def test_aim_finds_the_point_that_place_gives(kind):
    rng = np.random.default_rng(3)
    sizes = ((0.5, 0.1, 0.0), (0.2, 0.9, 0.1)) if kind is QuadLight else (0.7,)
    light = kind((0.3, 0.2, 4.0), *sizes, (1.0,) * 3)
    uv = rng.uniform(-0.65, 0.65, (100, 2))
    p, zero = rng.uniform(-1.0, 1.0, (100, 3)), np.zeros(100)
    point = place(light, p, zero, uv)
    np.testing.assert_allclose(aim(light, p, zero, p + 0.4 * (point - p)), uv, atol=1e-9)


def test_red_is_the_ring_between_umbra_and_light():
    """A sphere over a floor under a disk-like ball: the ring's radii follow from tangents."""
    light = SphereLight((0.0, 0.0, 6.0), 0.5, (1.0,) * 3)
    ball = Sphere((0.0, 0.0, 2.0), 1.0)
    floor = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
    # seen from the side, as from above the ball hides its own shadow
    camera = look_at((0.0, -12.0, 1.5), (0.0, 0.0, 0.5), resolution=(60, 40))
    scene = Scene(camera, (floor, ball), (light,))
    red = penumbrae(scene, pixels_of(camera))
    spots = pixels_of(camera) + 0.5
    o, d = rays(camera, spots[:, 0], spots[:, 1], np.zeros(len(spots)))
    depth = -o[:, 2] / np.where(d[:, 2] < 0.0, d[:, 2], -1e-9)
    p = o + depth[:, None] * d
    off = np.linalg.norm(np.cross(np.array([0.0, 0.0, 2.0]) - o, d), axis=1)
    on_floor = (d[:, 2] < 0.0) & (np.abs(p[:, :2]).max(axis=1) < 9.0) & (off > 1.0)
    radius = np.hypot(p[:, 0], p[:, 1])
    # tangents to both circles meet the axis at z = 6 - 4 r_light / (r_light -+ r_ball)
    inner_apex, outer_apex = 6.0 + 4.0 * 0.5 / 0.5, 6.0 - 4.0 * 0.5 / 1.5
    slope = [1.0 / np.sqrt((a - 2.0) ** 2 - 1.0) for a in (inner_apex, outer_apex)]
    inner, outer = inner_apex * slope[0], outer_apex * slope[1]
    ring = (radius > inner) & (radius < outer)
    np.testing.assert_array_equal(red[on_floor], ring[on_floor])
    assert ring[on_floor].sum() > 20


def test_blue_is_the_circle_of_a_sphere():
    ball = Sphere((0.0, 0.0, 0.0), 2.0)
    scene = Scene(ABOVE, (ball,), ())
    blue = edges(scene, pixels_of(ABOVE))
    pixels = pixels_of(ABOVE)
    corners = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])
    # the silhouette's radius in pixels: tan of the outline's angle, 40 pixels per sensor side
    size = 2.0 / np.sqrt(100.0 - 4.0) * 40.0 * 50.0 / 36.0
    radii = np.linalg.norm(pixels[:, None] + corners - 20.0, axis=2)
    near = np.linalg.norm(np.clip(20.0, pixels, pixels + 1.0) - 20.0, axis=1)
    np.testing.assert_array_equal(blue, (near < size) & (radii.max(axis=1) > size))


def test_blue_finds_a_sphere_smaller_than_a_pixel():
    scene = Scene(ABOVE, (FLOOR, Sphere((0.51, 0.33, 1.0), 1e-4)), ())
    blue = edges(scene, pixels_of(ABOVE))
    assert blue.sum() == 1


def test_red_finds_an_occluder_smaller_than_the_light():
    light = QuadLight((0.0, 0.0, 5.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (1.0,) * 3)
    scene = Scene(ABOVE, (FLOOR, Sphere((0.1, 0.2, 2.5), 1e-3)), (light,))
    red = penumbrae(scene, pixels_of(ABOVE))
    p = floor_points(scene)
    # half way up, the light's square maps on the floor's of twice the offset, mirrored
    shadow = (np.abs(p - 2.0 * np.array([0.1, 0.2])) < 0.99).all(axis=1)
    assert red[shadow].all() and shadow.sum() > 50
    wide = (np.abs(p - 2.0 * np.array([0.1, 0.2])) < 1.01).all(axis=1)
    assert not red[~wide].any()


def test_green_is_what_a_moving_sphere_sweeps():
    ball = Sphere((0.0, 0.0, 0.0), 1.0, motion=Motion((3.0, 0.0, 0.0)))
    scene = Scene(ABOVE, (ball,), (), (0.5, 0.5, 0.5))
    green = motion(scene, pixels_of(ABOVE), use_edges=False)
    spots = pixels_of(ABOVE) + 0.5
    o, d = rays(ABOVE, spots[:, 0], spots[:, 1], np.zeros(len(spots)))
    best = np.full(len(spots), np.inf)
    for x in np.linspace(-1.5, 1.5, 2001):
        best = np.minimum(best, np.linalg.norm(np.cross(np.array([x, 0.0, 0.0]) - o, d), axis=1))
    np.testing.assert_array_equal(green, best < 1.0)


def test_green_knows_a_quad_that_slides_in_its_plane():
    plate = Quad((-1.0, -1.0, 1.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), motion=Motion((0.5, 0, 0)))
    scene = Scene(ABOVE, (FLOOR, plate), (PointLight((0.0, 0.0, 8.0), (1.0,) * 3),))
    p = floor_points(scene) * 0.9
    green = motion(scene, pixels_of(ABOVE), use_edges=False)
    middle = (np.abs(p) < 0.7).all(axis=1)
    assert not green[middle].any()
    ends = (np.abs(np.abs(p[:, 0]) - 1.0) < 0.2) & (np.abs(p[:, 1]) < 0.9)
    assert green[ends].all()


def test_reference_is_exact_for_an_open_light():
    scene = Scene(ABOVE, (FLOOR,), (PointLight((0.0, 0.0, 5.0), (np.pi,) * 3),))
    picture, _ = reference(scene, 8, use_motion=False, use_edges=False)
    p = floor_points(scene)
    distance = np.sqrt((p**2).sum(axis=1) + 25.0)
    np.testing.assert_allclose(picture[0].ravel(), 5.0 / distance**3, rtol=1e-12)


def test_scaling_a_scene_keeps_its_masks():
    scene = random_scene(2)
    np.testing.assert_array_equal(masks(scene), masks(scaled(scene, 1024.0)))
