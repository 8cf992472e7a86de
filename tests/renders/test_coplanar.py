# SPDX-License-Identifier: GPL-3.0-or-later
"""A light in the plane of a wall shines on the side that it faces, however the room is turned.

Coordinates are rounded to float32, as Blender's are: that puts the light above or below the plane
by chance, and its parts on both sides.
"""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    validate,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from oracle.contact import camera_spots, gaps, sheets_in_plane
from oracle.kernels import lambert, quad_corners
from oracle.numbers import LONG
from random_scenes import look_at, scaled
from solid_boxes import box, turned
from transforms import moved, random_rotation
from transforms import turned as rotated

SIZE = (32, 24)
TOLERANCE, CLOSE = 1e-3, 1e-2
"""Of a picture, relative to its mean: what is asked of its RMS error, and the largest difference of
a pixel, which may have several times the RMS."""
WAYS = {
    "EXACT": Settings(tolerance=TOLERANCE, threads=1),
    "RAYS": Settings(method="RAYS", light_rays=16, pixel_rays=8, time_rays=8, threads=1),
}
FLOOR = Quad((-3.0, -3.0, 0.0), (6.0, 0.0, 0.0), (0.0, 6.0, 0.0))
CEILING = Quad((-3.0, -3.0, 3.0), (6.0, 0.0, 0.0), (0.0, 6.0, 0.0), name="Ceiling")
BALL = Sphere((0.3, 0.2, 0.5), 0.5)
DOWN = QuadLight((0.2, -0.3, 3.0), (0.75, 0.0, 0.0), (0.0, -0.5, 0.0), (9.0, 8.0, 7.0))
CAMERA = look_at((0.4, -2.9, 1.3), (0.0, 0.5, 1.1), resolution=SIZE, focal_length=20.0)
ROOM = Scene(CAMERA, (FLOOR, CEILING, BALL), (DOWN,))
"""The camera sees floor, ball and the ceiling's lower side."""
SIDEWAYS = QuadLight((0.0, 3.0, 1.5), (0.6, 0.0, 0.0), (0.0, 0.0, 0.4), (9.0,) * 3)
BACK = Quad((-3.0, 3.0, 0.0), (6.0, 0.0, 0.0), (0.0, 0.0, 3.0))
CASES = {
    "ceiling": ROOM,
    "ceiling of three parts": replace(
        ROOM,
        shapes=(
            FLOOR,
            BALL,
            *(replace(CEILING, corner=(x, -3.0, 3.0), edge_u=(2.0, 0.0, 0.0)) for x in (-3, -1, 1)),
        ),
    ),
    "upper side": replace(
        ROOM,
        shapes=(FLOOR, BALL, Quad((-0.8, -1.0, 3.0), (2.0, 0.0, 0.0), (0.0, 1.4, 0.0))),
        camera=look_at((0.4, -4.0, 6.0), (0.0, 0.0, 2.0), resolution=SIZE),
    ),
    "wall": replace(ROOM, shapes=(FLOOR, BACK, BALL), lights=(SIDEWAYS,)),
    "closed room": replace(ROOM, shapes=(*box((-3, -3, 0), (6, 0, 0), (0, 6, 0), (0, 0, 3)), BALL)),
    "lamp in a box": replace(
        ROOM,
        shapes=(FLOOR, BALL, *turned((-0.3, -0.9, 3.0), (1.4, 1.2, 0.2), 0.0)),
    ),
    "small box at the ceiling": replace(
        ROOM, shapes=(*ROOM.shapes, *turned((0.1, -0.5, 2.7), (0.3, 0.3, 0.3), 0.4))
    ),
    "lit from the floor": replace(
        ROOM,
        shapes=(
            FLOOR,
            replace(BALL, center=(0.3, 0.2, 1.0)),
            *turned((0.3, -0.5, 0), (1, 1, 1), 0),
        ),
        lights=(replace(DOWN, center=(0.2, -0.3, 0.0), half_v=(0.0, 0.5, 0.0)),),
    ),
    "light slides in the ceiling": replace(
        ROOM, lights=(replace(DOWN, motion=Motion((0.4, 0.2, 0.0))),)
    ),
    "the room sinks": replace(
        ROOM,
        shapes=(FLOOR, BALL, replace(CEILING, motion=Motion((0.0, 0.1, -0.3)))),
        lights=(replace(DOWN, motion=Motion((0.0, 0.1, -0.3))),),
    ),
    "point": replace(ROOM, lights=(PointLight((0.2, -0.3, 3.0), (20.0,) * 3),)),
}


def rounded(scene):
    """The scene with all coordinates of shapes and lights rounded to float32."""

    def near(thing):
        names = ("center", "corner", "edge_u", "edge_v", "half_u", "half_v")
        changes = {
            name: tuple(float(np.float32(x)) for x in getattr(thing, name))
            for name in names
            if hasattr(thing, name)
        }
        return replace(thing, **changes)

    shapes, lights = (tuple(near(x) for x in group) for group in (scene.shapes, scene.lights))
    return replace(scene, shapes=shapes, lights=lights)


def anywhere(scene, seed, far=3.0):
    """The scene, turned and moved at random, and rounded."""
    rng = np.random.default_rng(seed)
    turn, place = random_rotation(rng), far * rng.normal(size=3)
    print(f"seed {seed}")
    return rounded(moved(rotated(scene, turn), place))


def check_alike(scene, other, settings, what, close=CLOSE):
    """No pixel of two pictures differs by more than the tolerance, relative to the mean."""
    one, two = (render_image(each, settings).color for each in (scene, other))
    mean = float(one.mean())
    off = np.abs(one - two).max(axis=0)
    assert mean > 0.0
    assert off.max() <= close * mean, (
        f"{what}: {(off > close * mean).sum()} of {off.size} pixels differ, "
        f"by up to {off.max() / mean:.2g} of the mean"
    )


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("case", CASES)
def test_turned_rooms_look_alike(case, way):
    scene = CASES[case]
    for seed in range(4):
        check_alike(scene, anywhere(scene, seed), WAYS[way], f"{case}, seed {seed}")


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_sizes_and_places(factor):
    """The bound goes with the coordinates, whatever the scene's size and place."""
    for far in (0.0, 30.0):
        room = scaled(ROOM, factor)
        check_alike(room, anywhere(room, 7, far * factor), WAYS["EXACT"], f"{factor:g}, {far:g}")


@pytest.mark.parametrize("case", ["ceiling", "wall", "closed room", "light slides in the ceiling"])
@pytest.mark.parametrize("gap", [1e-4, -1e-4])
def test_a_tenth_of_a_millimetre_is_no_contact(case, gap):
    """Of a room 3 m high: below the ceiling a light shines, above it it does not."""
    scene = CASES[case]
    (light,) = scene.lights
    aim = np.cross(light.half_u, light.half_v)
    center = np.array(light.center) + gap * aim / np.linalg.norm(aim)
    apart = replace(scene, lights=(replace(light, center=tuple(center)),))
    for seed in range(3):
        other = anywhere(apart, seed)
        (emitter,) = make_plan(validate(other), WAYS["EXACT"]).lights
        assert emitter.coplanar is None
        if gap > 0.0:
            # a pixel may be off by more than the RMS that is asked for
            check_alike(scene, other, WAYS["EXACT"], f"seed {seed}", 1.3 * CLOSE)
        else:
            assert not render_image(other, WAYS["EXACT"]).color.any(), f"seed {seed}"


def test_contact_is_counted_as_the_oracle_counts_it():
    """Which sheets a light touches, at random distances that are clear for float32."""
    rng = np.random.default_rng(1)
    found = {True: 0, False: 0}
    for seed in range(120):
        gap = float(rng.choice([0.0, 1e-4, -1e-3, 1e-2]))
        light = replace(DOWN, center=(0.2, -0.3, 3.0 - gap))
        scene = anywhere(replace(ROOM, lights=(light,)), seed)
        touching = sheets_in_plane(scene, scene.lights[0])
        (emitter,) = make_plan(validate(scene), WAYS["EXACT"]).lights
        # spheres come first in a plan
        mine = [] if emitter.coplanar is None else np.flatnonzero(emitter.coplanar).tolist()
        assert [i - 1 for i in mine] == touching == ([1] if gap == 0.0 else []), (seed, gap)
        found[bool(touching)] += 1
    assert min(found.values()) > 20


def test_light_in_a_ceiling_is_its_closed_form():
    """Where the oracle sees the whole light, turned rooms get its closed form."""
    settings, counted = replace(WAYS["RAYS"], use_edges=False), 0
    for seed in range(4):
        scene = anywhere(ROOM, seed)
        (light,) = scene.lights
        color = render_image(scene, settings).color.reshape(3, -1)[0]
        spots = camera_spots(scene)
        c, u, v = (LONG.lift(x)[:, None] for x in (light.center, light.half_u, light.half_v))
        skipped = sheets_in_plane(scene, light)
        steps = np.linspace(-1, 1, 9)
        reach = 0.3
        sides = np.stack(
            [
                gaps(scene, spots, c + a * u + b * v + 0 * spots.point, skipped)
                for a in steps
                for b in steps
            ]
        )
        seen = (spots.ids >= 0) & (spots.margin > 0.1) & (sides > reach).all(axis=(0, 1))
        to = c - spots.point
        want = lambert(LONG, quad_corners(to, u + 0 * to, v + 0 * to), spots.normal)
        want = want * light.radiance[0] * 0.8 / np.pi
        counted += int(seen.sum())
        np.testing.assert_allclose(color[seen], want[seen].astype(float), rtol=1e-6)
    assert counted > 200


@pytest.mark.parametrize("way", WAYS)
def test_a_sheet_in_the_lights_plane_gets_none_of_it(way):
    """Seen from above, where rounding may put the light over the ceiling, and from below."""
    for camera in (CAMERA, CASES["upper side"].camera):
        for seed in range(4):
            scene = anywhere(replace(ROOM, camera=camera, shapes=(CEILING,)), seed)
            assert not render_image(scene, WAYS[way]).color.any(), f"seed {seed}"


def test_what_crosses_the_plane_still_hides():
    """A ball and a box under the ceiling hide their part of the light as they do 0.01 mm lower."""
    shapes = (
        FLOOR,
        CEILING,
        Sphere((0.5, -0.3, 2.9), 0.3),
        *turned((-0.4, -0.7, 2.4), (0.4, 0.5, 0.6), 0.2),
    )
    lower = replace(DOWN, center=(0.2, -0.3, 3.0 - 1e-5))
    scene = replace(ROOM, shapes=shapes, camera=replace(CAMERA, resolution=(12, 9)))
    check_alike(replace(scene, lights=(lower,)), anywhere(scene, 0), WAYS["EXACT"], "seed 0")
