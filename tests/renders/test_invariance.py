# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture hangs on nothing but what is seen: not on where, how large or how turned it is.

Rays are distributed at points of a light's and a pixel's own coordinates, which turn and move
with them; those of round lights lean as the surface does. Only two sets of points do not, and are
made to: a mirror turns a quad light's second coordinate about, and a reversed shutter the time.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import adaptive_drt.distributed
import adaptive_drt.shading.ratio_estimator
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    DiskLight,
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.settings import METHODS, Settings
from random_scenes import look_at, random_scene, scaled
from transforms import mirrored, moved, random_rotation, reordered, reversed_shutter, turned

pytestmark = pytest.mark.filterwarnings("error")

CLOSE, CLOSE_WHEN_MOVED = 1e-9, 1e-6
"""Largest differences, RMS relative to the picture's mean. A move by a million sizes rounds each
coordinate by 2^-53 of that, 1e-10 of the scene."""

WORST = {}
"""Largest difference by change, with its scene, for the report at the end."""

FLOOR = Quad((-5.0, -5.0, 0.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0))
BALL = Sphere((0.0, 0.0, 1.0), 1.0)
LAMP = QuadLight((1.0, -1.0, 5.0), (0.7, 0.0, 0.0), (0.0, -0.5, 0.0), (9.0,) * 3)
BULB = SphereLight((2.0, -2.0, 4.0), 0.4, (9.0, 7.0, 5.0))
SPOT = DiskLight((-2.0, -2.0, 4.0), 0.4, (5.0, 7.0, 9.0))
DOT = PointLight((1.0, -3.0, 4.0), (9.0,) * 3)
CAMERA = look_at((0.3, -8.0, 4.0), (0.1, 0.0, 0.5), resolution=(29, 23))
MADE = {
    "contact": Scene(CAMERA, (FLOOR, BALL, Sphere((1.5, 0.0, 0.5), 0.5)), (LAMP, BULB, SPOT, DOT)),
    "touching": Scene(CAMERA, (FLOOR, BALL, Sphere((2.0, 0.0, 1.0), 1.0)), (LAMP,)),
    "nested": Scene(
        CAMERA,
        (FLOOR, BALL, replace(BALL, radius=0.5), replace(BALL, center=(0.6, 0.0, 1.0))),
        (LAMP, BULB),
    ),
    "through the floor": Scene(CAMERA, (FLOOR, replace(BALL, center=(0.0, 0.0, 0.2))), (LAMP, DOT)),
    "inside": Scene(
        look_at((0.3, -2.0, 1.0), (0.1, 0.0, 0.8), resolution=(29, 23)),
        (Sphere((0.0, 0.0, 1.0), 9.0), BALL),
        (replace(LAMP, center=(1.0, -1.0, 4.0)), replace(BULB, center=(-2.0, -2.0, 3.0))),
    ),
    "light in the floor's plane": Scene(
        CAMERA, (FLOOR, BALL), (replace(LAMP, center=(2.0, -1.0, 0.0)), DOT)
    ),
    "motion": Scene(
        replace(CAMERA, motion=Motion((0.1, 0.0, 0.05))),
        (FLOOR, replace(BALL, motion=Motion((0.6, 0.3, 0.2)))),
        (LAMP, replace(DOT, motion=Motion((0.0, 0.5, 0.0)))),
    ),
}
# seen so that left and right, up and down are alike: nothing but rounding tells x from y
MADE["symmetric"] = Scene(
    look_at((0.0, -8.0, 0.0), (0.0, 0.0, 0.0), resolution=(24, 24)),
    (replace(BALL, center=(0.0, 0.0, 0.0)), replace(BALL, center=(0.0, -2.0, 0.0), radius=0.5)),
    (SphereLight((0.0, -6.0, 0.0), 0.5, (9.0,) * 3),),
)
MADE["sliding floor"] = Scene(
    CAMERA, (replace(FLOOR, motion=Motion((0.7, 0.3, 0.0))), BALL), (LAMP, BULB, DOT)
)
MADE["a ball in a bulb"] = Scene(
    CAMERA, (FLOOR, BALL, Sphere((2.2, -2.1, 3.8), 0.35), Sphere((2.0, -2.3, 3.7), 0.2)), (BULB,)
)
"""Some light has no closed form there: also method EXACT distributes rays."""
RAYS_NEEDED = {"a ball in a bulb"}
"""Scenes that take a minute each for that."""
QUICK = (*range(6), 17, 88, 1084)
"""Some, and those that showed each kind of decision that rounding turned."""
SEEDS = (
    *QUICK,
    *(pytest.param(k, marks=pytest.mark.slow) for k in (*range(60), 1031) if k not in QUICK),
)
CASES = (
    *SEEDS,
    *(pytest.param(k, marks=pytest.mark.slow) if k in RAYS_NEEDED else k for k in MADE),
)

RAYS = Settings(method="RAYS", light_rays=9, time_rays=8, pixel_rays=8, threads=1)
WAYS = {"RAYS": RAYS, "RAYS order 1": replace(RAYS, order=1)}
if "EXACT" in METHODS:
    WAYS["EXACT"] = Settings(method="EXACT", threads=1)
ways = pytest.mark.parametrize("way", WAYS)
cases = pytest.mark.parametrize("case", CASES)


def made(case):
    """A scene and the random numbers that belong to it."""
    rng = np.random.default_rng(case if isinstance(case, int) else 1)
    return (random_scene(case) if isinstance(case, int) else MADE[case]), rng


def size_of(scene):
    """How far the camera looks: metres."""
    rows = np.array(scene.camera.matrix)
    return float(np.linalg.norm(rows[:3, 3]))


@cache
def picture(case, settings):
    """A scene's picture as it is, which all changes are held against."""
    return render_image(made(case)[0], settings)


def check(change, case, scene, other, settings, close=CLOSE):
    """The two scenes' pictures are one. `scene` is None for that of the case, as it is."""
    one = picture(case, settings) if scene is None else render_image(scene, settings)
    two = render_image(other, settings)
    mean = max(float(one.color.mean()), 1e-300)
    off = float(np.sqrt(((one.color - two.color) ** 2).mean())) / mean
    WORST[change] = max(WORST.get(change, (0.0, "")), (off, str(case)))
    assert off <= close, f"{change}, {case}: relative RMSE {off:.2e}"
    differ = int((one.mask != two.mask).sum())
    assert differ <= 1e-4 * one.mask.size, f"{change}, {case}: {differ} flags differ"


@cases
@ways
def test_moved(case, way):
    scene, rng = made(case)
    for factor in (1.0, 1e3, 1e6):
        shift = rng.normal(size=3)
        shift *= factor * size_of(scene) / np.linalg.norm(shift)
        other = moved(scene, shift)
        check(f"moved by {factor:g} sizes", case, None, other, WAYS[way], CLOSE_WHEN_MOVED)


@cases
@ways
def test_scaled(case, way):
    scene, _ = made(case)
    for factor in (1e-6, 1e-3, 7.0, 1e6):
        check(f"scaled by {factor:g}", case, None, scaled(scene, factor), WAYS[way])


@cases
@ways
def test_reordered(case, way):
    """The order of the lights chooses the points that method RAYS takes of each."""
    scene, rng = made(case)
    check("reordered", case, None, reordered(scene, rng, way == "EXACT"), WAYS[way])


@cases
@ways
def test_turned(case, way):
    scene, rng = made(case)
    check("turned", case, None, turned(scene, random_rotation(rng)), WAYS[way])


def reflect(monkeypatch, last):
    """Make each set of sample points its own mirror image, in the light's v or in the time."""
    points = adaptive_drt.distributed.low_discrepancy_points

    def both(seed, pixel, stream, count, dimensions):
        half = points(seed, pixel, stream, (count + 1) // 2, dimensions)
        turn = [last and stream > 0 and k == dimensions - 1 for k in range(dimensions)]
        if not last:
            turn[0] = dimensions in (1, 5)
        twins = zip(half, turn, strict=True)
        return [
            np.concatenate([a, (1.0 - a if t else a)[:, ::-1]], axis=1)[:, :count] for a, t in twins
        ]

    for module in (adaptive_drt.distributed, adaptive_drt.shading.ratio_estimator):
        monkeypatch.setattr(module, "low_discrepancy_points", both)


@cases
@ways
def test_mirrored(case, way, monkeypatch):
    scene, rng = made(case)
    settings, normal = WAYS[way], rng.normal(size=3)
    if way == "EXACT":
        check("mirrored", case, None, mirrored(scene, normal), settings)
        return
    reflect(monkeypatch, last=True)
    check("mirrored", case, scene, mirrored(scene, normal), replace(settings, light_rays=8))


@cases
@ways
def test_reversed_shutter(case, way, monkeypatch):
    scene, _ = made(case)
    settings, own = WAYS[way], None
    if way != "EXACT":
        reflect(monkeypatch, last=False)
        settings, own = replace(settings, light_rays=8), scene
    check("shutter reversed", case, own, reversed_shutter(scene), settings)


def test_samples_stay_off_outlines():
    """A star's arms would end on the sides of its region: on outlines, and where surfaces meet."""
    ball = replace(BALL, center=(0.0, 0.0, 0.5), motion=Motion((0.6, 0.3, 0.2)))
    scene = Scene(replace(CAMERA, resolution=(15, 12)), (FLOOR, ball), (LAMP, BULB))
    settings = Settings(method="EXACT", threads=1)
    check("scaled", "sinking", scene, scaled(scene, 1e-6), settings, 1e-13)


def test_binary_moves_and_scales_change_no_bit():
    """Where the coordinates themselves do not round, nothing does."""
    scene = MADE["contact"]
    want = render_image(scene, RAYS).color
    for factor in (2.0**-40, 2.0**40):
        np.testing.assert_array_equal(render_image(scaled(scene, factor), RAYS).color, want)


def test_report_the_largest_differences(capsys):
    with capsys.disabled():
        for change, (off, case) in WORST.items():
            print(f"\n{change}: relative RMSE at most {off:.1e} (scene {case})", end="")
        print()


@pytest.mark.parametrize("light", [LAMP, BULB, DOT])
def test_a_negative_light_takes_what_a_positive_one_gives(light):
    name = "intensity" if light is DOT else "radiance"
    power = tuple(-x for x in getattr(light, name))
    pictures = [
        render_image(Scene(CAMERA, (FLOOR, BALL), (one,)), Settings(tolerance=1e-3, threads=1))
        for one in (light, replace(light, **{name: power}))
    ]
    assert np.array_equal(pictures[0].color, -pictures[1].color) and pictures[0].color.any()
