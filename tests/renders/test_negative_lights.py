# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights of negative power where rays sample visibility: before meshes and heaps of balls.

The truth is brute force: that of `oracle.mesh_rays` for meshes, and of `oracle.every_light`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.geometry.embree_library import native_library
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import SphereLight
from adaptive_drt.scene.settings import Settings
from oracle.every_light import sampled_every_light
from oracle.mesh_rays import sampled_mesh_picture
from random_meshes import random_mesh_scene
from sphere_heaps import moving_heap, sphere_heap

TOLERANCE = 1e-2
needs_library = pytest.mark.skipif(native_library() is None, reason="embree's library is not found")
STATED = 1.3
"""Largest stated error, as a multiple of the tolerance."""


def lit(scene, way):
    """The scene under negative lights: alone, or with positive ones."""
    (lamp,) = scene.lights
    power = np.array(lamp.radiance)

    def of(light, factor, **changes):
        return replace(light, radiance=tuple((factor * power).tolist()), **changes)

    x, y, z = getattr(lamp, "center", (0.0, 0.0, 5.0))
    bulb = SphereLight((-0.7 * x - 1.0, 0.5 - y, 0.8 * z), 0.4, lamp.radiance)
    lights = {
        "alone": (of(lamp, -1.0),),
        "weaker": (lamp, of(bulb, -0.5)),
        # what is not in shadow is nearly dark
        "equal": (lamp, of(lamp, -1.0, **({"center": (x + 1.5, y, z)} if z else {}))),
        "colored": (of(lamp, np.array([1.0, -1.0, 0.0])), of(bulb, np.array([0.5, 1.0, -0.5]))),
    }
    return replace(scene, lights=lights[way])


def check(film, truth, noise):
    """Compare a picture with one whose standard error is `noise`, over the mean, in tolerances."""
    mean = TOLERANCE * np.abs(truth).mean()
    error = np.sqrt(((film.color - truth) ** 2).mean()) / mean
    stated = film.stats["error_estimate"] / TOLERANCE
    print(f"error {error:.2f}, the truth's {noise:.2f}, stated {stated:.2f}")
    assert error < np.hypot(1.0, noise)
    assert stated < STATED


def pair_noise(first, second):
    """Standard error of the mean of two pictures, over the mean of their sizes, in tolerances."""
    mean = TOLERANCE * np.abs(0.5 * (first + second)).mean()
    return float(0.5 * np.sqrt(((first - second) ** 2).mean()) / mean)


@pytest.mark.parametrize(
    ("seed", "way"),
    [
        pytest.param(0, "alone", marks=pytest.mark.slow),
        pytest.param(0, "weaker", marks=pytest.mark.slow),
        (0, "equal"),
        pytest.param(0, "colored", marks=pytest.mark.slow),
        (2, "weaker"),
    ],
)
def test_before_meshes(seed, way):
    scene = lit(random_mesh_scene(seed, (24, 16)), way)
    first, second = (sampled_mesh_picture(scene, 512, k) for k in range(2))
    film = render_image(scene, Settings(tolerance=TOLERANCE, threads=1))
    check(film, 0.5 * (first + second), pair_noise(first, second))


@needs_library
@pytest.mark.parametrize(
    ("moving", "way"), [(False, "alone"), (False, "weaker"), (False, "colored"), (True, "colored")]
)
def test_before_heaps(moving, way):
    scene = sphere_heap(3, 100, "square", (16, 12))
    scene = lit(moving_heap(scene) if moving else scene, way)
    halves = sampled_every_light(scene, 2.0 * TOLERANCE, 7, threads=1).halves
    film = render_image(scene, Settings(tolerance=TOLERANCE, threads=1))
    assert film.stats["sampled_pixels"] > 50
    check(film, halves.mean(axis=0), pair_noise(*halves))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "scene",
    [
        random_mesh_scene(0, (24, 16)),
        pytest.param(sphere_heap(3, 100, "square", (16, 12)), marks=needs_library),
    ],
    ids=["mesh", "heap"],
)
def test_light_that_cancels_but_in_shadows(scene):
    """A light without shadows and its negative with them leave the light that shadows lack."""
    (lamp,) = scene.lights
    open_lamp = replace(lamp, name="open", casts_shadow=False)
    taking = replace(lamp, name="taking", radiance=tuple(-x for x in lamp.radiance))
    dark = replace(scene, background=(0.0, 0.0, 0.0))
    bright, shadowed, rest = (
        render_image(replace(dark, lights=lights), Settings(tolerance=TOLERANCE, threads=1))
        for lights in ((open_lamp,), (lamp,), (open_lamp, taking))
    )
    error = np.sqrt(((rest.color - (bright.color - shadowed.color)) ** 2).mean())
    assert error < 1.5 * TOLERANCE * bright.color.mean()
    assert 0.0 < rest.stats["error_estimate"] < STATED * TOLERANCE
