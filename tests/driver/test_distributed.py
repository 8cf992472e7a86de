# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive pictures against distributed ones, and one picture for every way to compute it."""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.distributed import DistributedRender, Resolver
from adaptive_drt.render import render, render_image
from adaptive_drt.scene.description import (
    Material,
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
)
from adaptive_drt.scene.film import Film
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.occluder_culling import Occluders
from detected import detected
from random_scenes import look_at, random_scene

RAYS = {"method": "RAYS", "light_rays": 9, "time_rays": 8, "pixel_rays": 4}
ALONE = {
    "penumbra": {"use_motion": False, "use_edges": False},
    "motion": {"use_penumbra": False, "use_edges": False},
    "edge": {"use_penumbra": False, "use_motion": False},
}
SEEDS = (0, 2, 5, 7, 8, 12, 13, 16)


def settings(**changes):
    return Settings(**{**RAYS, "threads": 1, **changes})


def apart(a, b):
    """Largest difference of two pictures (3, ...) relative to the second one's largest value."""
    return np.abs(a - b).max(initial=0.0) / max(np.abs(b).max(initial=0.0), 1e-300)


def assert_same_film(a, b):
    for name in ("color", "alpha", "mask", "samples", "depth", "normal"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)


@pytest.mark.parametrize("effect", ALONE)
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("order", [1, 2])
def test_flagged_pixels_are_what_everywhere_gives(effect, seed, order):
    scene = random_scene(seed)
    some = settings(order=order, **ALONE[effect])
    film = render_image(scene, some)
    full = render_image(scene, replace(some, distribution="EVERYWHERE"))
    flagged = film.mask.any(axis=0)
    np.testing.assert_allclose(
        film.color[:, flagged], full.color[:, flagged], rtol=1e-12, atol=0, err_msg=f"seed {seed}"
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_with_penumbrae_alone_every_pixel_is_what_everywhere_gives(seed):
    scene = random_scene(seed)
    some = settings(**ALONE["penumbra"])
    film = render_image(scene, some)
    full = render_image(scene, replace(some, distribution="EVERYWHERE"))
    np.testing.assert_allclose(film.color, full.color, rtol=1e-12, atol=0, err_msg=f"seed {seed}")


@pytest.mark.parametrize("seed", SEEDS)
def test_reuse_does_not_change_the_picture(seed):
    scene = random_scene(seed)
    kept, again = (render_image(scene, settings(reuse=reuse)) for reuse in (True, False))
    np.testing.assert_allclose(kept.color, again.color, rtol=1e-12, atol=0, err_msg=f"seed {seed}")
    np.testing.assert_array_equal(kept.mask, again.mask)


@pytest.mark.parametrize("seed", SEEDS)
def test_order_two_flags_no_more_than_order_one(seed):
    first, second = (render_image(random_scene(seed), settings(order=k)).mask for k in (1, 2))
    assert not (second & ~first).any(), f"seed {seed}"


@pytest.mark.parametrize("seed", SEEDS[:4])
@pytest.mark.parametrize(
    "changes",
    [
        {"threads": 2},
        {"threads": 5},
        {"batch": 100},
        {"batch": 1000, "threads": 2},
        {"batch": 1},
        {"accelerator": "ARRAYS"},
        {"accelerator": "EMBREE"},
        {"accelerator": "EMBREE", "batch": 100, "threads": 2},
    ],
    ids=str,
)
def test_the_picture_is_the_same_to_the_last_bit(seed, changes):
    scene = random_scene(seed)
    assert_same_film(render_image(scene, settings(**changes)), render_image(scene, settings()))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("distribution", ["ADAPTIVE", "EVERYWHERE"])
def test_a_border_is_a_crop(seed, distribution):
    scene = random_scene(seed)
    width, height = scene.camera.resolution
    left, bottom, right, top = 3, 5, width - 7, height - 2
    border = replace(scene.camera, border=(left, bottom, right, top))
    whole = render_image(scene, settings(distribution=distribution))
    part = render_image(replace(scene, camera=border), settings(distribution=distribution))
    for name in ("color", "alpha", "mask", "samples", "depth", "normal"):
        crop = getattr(whole, name)[..., bottom:top, left:right]
        np.testing.assert_array_equal(getattr(part, name), crop, err_msg=f"{name}, seed {seed}")


FLOOR = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0), Material((0.5, 0.6, 0.7)))
BALL = Sphere((0.0, 0.0, 1.5), 0.7)
LAMP = QuadLight((0.0, 0.0, 6.0), (0.8, 0.0, 0.0), (0.0, -0.8, 0.0), (5.0, 5.0, 5.0))
CAMERA = look_at((0.0, -9.0, 5.0), (0.0, 0.0, 0.5), resolution=(40, 30))


def test_domains_nest():
    """A pixel flagged for penumbra alone keeps its camera ray: its samples are light rays."""
    moving = replace(BALL, center=(2.5, 0.0, 1.5), motion=Motion((0.4, 0.0, 0.0)))
    film = render_image(Scene(CAMERA, (FLOOR, BALL, moving), (LAMP,)), settings())
    only = film.mask & (film.mask.sum(axis=0) == 1)
    assert (film.samples[~film.mask.any(axis=0)] == 1).all()
    assert only[0].any() and (film.samples[only[0]] == RAYS["light_rays"]).all()
    assert only[2].any() and film.samples[only[2]].min() >= RAYS["pixel_rays"]
    assert film.mask[1].any() and film.samples[film.mask[1]].min() >= RAYS["time_rays"]


def test_seed_changes_the_points_alone():
    scene = Scene(CAMERA, (FLOOR, BALL), (LAMP,))
    one, two = (render_image(scene, settings(seed=k)) for k in (1, 2))
    np.testing.assert_array_equal(one.mask, two.mask)
    assert (one.color != two.color).any()
    plain = ~one.mask.any(axis=0)
    np.testing.assert_array_equal(one.color[:, plain], two.color[:, plain])


def test_a_still_scene_spends_nothing_on_time():
    film = render_image(Scene(CAMERA, (FLOOR, BALL), (LAMP,)), settings())
    assert not film.mask[1].any()
    assert film.stats["counts"]["motion"] == 0


def test_a_point_light_makes_no_penumbra():
    lamp = PointLight((0.0, 0.0, 6.0), (50.0,) * 3)
    film = render_image(Scene(CAMERA, (FLOOR, BALL), (lamp,)), settings())
    assert not film.mask[0].any() and film.mask[2].any()


def test_statistics_count_the_masks():
    film = render_image(random_scene(8), settings())
    counts = film.stats["counts"]
    for index, name in enumerate(("penumbra", "motion", "edge")):
        assert counts[name] == film.mask[index].sum()
    assert counts["distributed"] == film.mask.any(axis=0).sum()
    assert film.stats["pixels"] == film.width * film.height
    assert film.stats["a"] == pytest.approx(counts["distributed"] / film.stats["pixels"])


def test_a_closed_generator_leaves_a_film():
    steps = render(random_scene(2), settings(batch=50))
    first = next(steps)
    steps.close()
    assert np.isfinite(first.film.color).all() and 0 <= first.done <= first.total


def test_a_tile_is_resolved_as_the_picture_is():
    scene, few = random_scene(4), {"light_rays": 4, "time_rays": 4, "pixel_rays": 4}
    plan, tile, center, flags = detected(scene, method="RAYS", threads=1, **few)
    resolver = Resolver(plan, Occluders(plan), tile, center, flags)
    resolver.resolve_single_ray()
    resolver.resolve_distributed()
    found = resolver.out
    film = render_image(scene, Settings(method="RAYS", threads=1, **few))
    np.testing.assert_array_equal(found.color, film.color.reshape(3, -1))
    np.testing.assert_array_equal(found.samples, film.samples.ravel())
    found.count("anything", 3)
    found.count("anything", 2)
    assert found.rays["anything"] == 5
    # and written to any film, tile by tile
    again = Film(film.width, film.height)
    done = list(DistributedRender(plan, Occluders(plan)).run(again))
    assert done == sorted(done) and done[-1] == 1.0
    np.testing.assert_array_equal(again.color, film.color)
