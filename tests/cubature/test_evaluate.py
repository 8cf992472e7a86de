# SPDX-License-Identifier: GPL-3.0-or-later
"""Stars: their quadrature on boxes, and what their samples say of what was foreseen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from adaptive_drt.cubature.evaluate import Subdomains, estimate_means
from adaptive_drt.cubature.nodes import rotation_index
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.variation import zero_variation
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, intersect_pairs, nearest_hits
from adaptive_drt.tracing.occluder_culling import Occluders
from adaptive_drt.visibility.fragments import empty_fragments
from random_scenes import random_scene

DIAGONAL = (0, 2, 5)


def test_centroids_that_are_known_are_not_shaded_again():
    """Every other part's is: stars come out the same, for a point less."""
    plan = make_plan(random_scene(5), Settings())
    width, height = plan.resolution
    y, x = (each.ravel() for each in np.mgrid[0:height, 0:width])
    place = np.stack([x + 0.5, y + 0.5, np.zeros(x.size)])
    objects = np.arange(plan.object_count)
    pairs = Pairs(np.tile(np.arange(x.size), objects.size), np.repeat(objects, x.size))
    w = plan.lens.directions(place[0], place[1])
    _, item = nearest_hits(x.size, pairs, intersect_pairs(plan, w[:, pairs.pixel], pairs.item))
    place, item = place[:, item >= 0], item[item >= 0]
    m = item.size
    half = np.repeat([[0.5], [0.5], [0.0]], m, axis=1)
    spread = np.zeros((6, m))
    spread[list(DIAGONAL)] = half / np.sqrt(3.0)
    no, one = np.zeros(m, dtype=bool), np.ones(m)
    bare = Subdomains(
        place, spread, half, item, np.arange(m), no, rotation_index(place), one,
        np.ones(m, dtype=int), no, np.zeros((3, 0)), zero_variation(0), np.zeros(0),
    )  # fmt: skip
    occluders, nothing = Occluders(plan), np.zeros(0, dtype=int)

    def sampled(parts):
        return estimate_means(plan, occluders, parts, empty_fragments(), nothing, np.inf)

    light = sampled(bare).light
    starred = replace(bare, multi_node=~no, error_weight=np.full(m, 1e3 / light.color.mean()))
    known = np.arange(m) % 2 == 0
    kept = light.color[:, known], light.deviation[..., known]
    fresh = sampled(starred)
    again = sampled(
        replace(
            starred, shaded=known, color=kept[0], deviation=kept[1], sampling=np.zeros(known.sum())
        )
    )
    assert (fresh.shaded_count[known] > 1).mean() > 0.2
    np.testing.assert_array_equal(again.shaded_count, fresh.shaded_count - known)
    np.testing.assert_array_equal(again.split_anyway, fresh.split_anyway)
    size = {"rtol": 1e-12, "atol": 1e-12 * light.color.mean()}
    np.testing.assert_allclose(again.light.color, fresh.light.color, **size)
    np.testing.assert_allclose(again.light.deviation, fresh.light.deviation, **size)
