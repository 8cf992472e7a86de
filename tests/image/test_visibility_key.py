# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility keys: what passes over a pixel, and when."""

from __future__ import annotations

import numpy as np

from adaptive_drt.image.visibility_key import NO_KEY, find_visibility_keys
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Motion, Quad, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs
from moving_floor import moving_scene
from oracle.converged import relative_rmse
from oracle.kept import converged_color


def sights_of(shapes, places):
    plan = make_plan(moving_scene(shapes), Settings())
    count = len(places)
    objects = plan.object_count
    pairs = Pairs(np.repeat(np.arange(count), objects), np.tile(np.arange(objects), count))
    return find_visibility_keys(plan, np.array(places, dtype=float).T, 0.5, pairs)


def test_sights_tell_what_passes_and_when():
    ball = Sphere((0.0, 0.0, 1.0), 0.8, motion=Motion((2.0, 0.0, 0.0)))
    # across the middle of the ball's way: the floor; left within the shutter; passed; entered
    found = sights_of([ball], [(x + 0.5, 34.5) for x in range(96)])
    kept = found[found != NO_KEY]
    stretches = kept[np.flatnonzero(np.diff(kept, prepend=NO_KEY))]
    assert len(stretches) == 5 and len(set(stretches)) == 4 and stretches[0] == stretches[-1]
    # kinks run through the pixels between
    assert (found == NO_KEY).sum() <= 8


def test_an_outline_that_stands_still_is_no_sight():
    still = Sphere((0.0, 0.0, 1.0), 0.8)
    ball = Sphere((3.0, 0.0, 1.0), 0.3, motion=Motion((0.1, 0.0, 0.0)))
    found = sights_of([still, ball], [(x + 0.5, 34.5) for x in range(96)])
    assert 1 <= (found == NO_KEY).sum() <= 8


def test_what_is_smaller_than_a_pixel_is_no_sight():
    crumb = Sphere((0.0, 0.0, 1.0), 0.01, motion=Motion((0.5, 0.0, 0.0)))
    found = sights_of([crumb], [(x + 0.5, y + 0.5) for x in range(96) for y in range(64)])
    passed = found[found != sights_of([crumb], [(1.5, 1.5)])[0]]
    assert (passed == NO_KEY).any()


def test_what_moves_along_its_own_edge_has_an_outline_that_stands_still():
    plate = Quad((-2.0, 0.0, 0.3), (2.0, 0.0, 0.0), (0.0, 0.0, 1.0), motion=Motion((1.5, 0.0, 0.0)))
    scene = moving_scene([plate])
    x, y = np.full(64, 40), np.arange(64)
    found = sights_of([plate], np.stack([x, y], axis=1) + 0.5)
    # its upper edge and the lower one, and the floor's
    assert (found == NO_KEY).sum() == 3
    film = render_image(scene, Settings(tolerance=1e-3, threads=1))
    truth = converged_color(scene, np.stack([x, y], axis=1), 1e-4)
    assert relative_rmse(film.color[:, y, x].T, truth) < 1e-3
