# SPDX-License-Identifier: GPL-3.0-or-later
"""Larger smooth blocks under a sky that many objects hide in part."""

import numpy as np
import pytest

from adaptive_drt.image import coarse_blocks
from adaptive_drt.image.chebyshev_blocks import SIDES, PixelBlocks, coarse_plan
from adaptive_drt.image.coarse_blocks import has_coarse_blocks, interpolate_coarse_blocks
from adaptive_drt.image.first_pass import trace_first_pass
from adaptive_drt.scene.description import Camera, Material, Quad, Scene, SkyLight, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.direct_light import smooth_radiance
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Tile, screen_bounds, surface
from adaptive_drt.tracing.occluder_culling import Occluders

FLOOR = Quad((-60.0, -60.0, 0.0), (120.0, 0.0, 0.0), (0.0, 120.0, 0.0), Material((0.5, 0.5, 0.5)))


def cluster(seed, count=80, size=(96, 64)):
    """Balls above a floor, seen from above."""
    rng = np.random.default_rng(seed)
    center = rng.uniform((-2.0, -2.0, 0.5), (2.0, 2.0, 3.0), (count, 3))
    balls = [Sphere(tuple(c), 0.4, Material((0.7, 0.6, 0.5))) for c in center.tolist()]
    eye = np.array((1.0, 2.0, 30.0))
    matrix = tuple((*row, offset) for row, offset in zip(np.eye(3).tolist(), eye, strict=True))
    camera = Camera((*matrix, (0.0, 0.0, 0.0, 1.0)), focal_length=40.0, resolution=size)
    return Scene(camera, (*balls, FLOOR), (SkyLight((1.0, 0.9, 0.8)),))


def blocks_of(plan, rows=slice(None)):
    """Blocks of the smaller side of some rows of blocks."""
    rough = coarse_plan(plan, SIDES[0])
    bounds = screen_bounds(rough)
    tile = Tile.make(rough, 0, 1)
    blocks = PixelBlocks.of_tile(rough, SIDES[0], bounds, tile)
    kept = np.isin(blocks.y, np.unique(blocks.y)[rows]).nonzero()[0]
    return blocks.subdivide(kept, SIDES[0], plan.region, screen_bounds(plan))


def coarse(plan, blocks):
    """Interpolated blocks, by their places: mean radiance."""
    found, left, points = interpolate_coarse_blocks(
        plan, Occluders(plan), screen_bounds(plan), blocks, lambda _: None
    )
    means = {}
    for part in found:
        assert part.side == SIDES[0]
        for k, place in enumerate(zip(part.x.tolist(), part.y.tolist(), strict=True)):
            means[place] = part.color[..., k], part.error[k]
    rest = set(zip(left.x.tolist(), left.y.tolist(), strict=True))
    every = set(zip(blocks.x.tolist(), blocks.y.tolist(), strict=True))
    assert rest | set(means) == every and not rest & set(means)
    return means, points


def test_means_are_those_of_the_light_at_the_pixels():
    seed = int(np.random.default_rng().integers(1 << 31))
    print("seed", seed)
    plan = make_plan(cluster(seed), Settings(tolerance=1e-3))
    means, points = coarse(plan, blocks_of(plan))
    assert has_coarse_blocks(plan) and means
    assert points < 16 * len(means), "fewer nodes than blocks of the smaller side have"
    occluders = Occluders(plan)
    at = np.arange(SIDES[0]) + 0.5
    for (x, y), (color, error) in list(means.items())[::7]:
        across, up = np.meshgrid(SIDES[0] * x + at, SIDES[0] * y + at)
        w = plan.lens.directions(across.ravel(), up.ravel())
        t = -30.0 / w[2]
        hits = surface(plan, w, t, np.full(t.size, plan.object_count - 1))
        hidden = [np.zeros(t.size, dtype=bool)]
        want, exact = smooth_radiance(plan, occluders, hits, 0.0, hidden)
        assert exact.all()
        off = np.abs(color.reshape(3, -1) - want).max() / want.mean()
        assert off < 1e-3, "the light bends little within a pixel"
        assert error <= 1e-4 * want.mean()


def test_blocks_do_not_depend_on_the_others_of_a_call():
    plan = make_plan(cluster(3), Settings(tolerance=1e-3))
    every, _ = coarse(plan, blocks_of(plan))
    some, _ = coarse(plan, blocks_of(plan, slice(1, None, 2)))
    assert some
    for place, (color, error) in some.items():
        np.testing.assert_array_equal(color, every[place][0])
        assert error == every[place][1]


@pytest.mark.parametrize("count", [20, 80])
def test_only_many_objects_have_larger_blocks(count, monkeypatch):
    plan = make_plan(cluster(5, count), Settings(tolerance=1e-3))
    assert has_coarse_blocks(plan) == (count == 80)
    blocks, bounds = blocks_of(plan), screen_bounds(plan)
    with_them = trace_first_pass(plan, Occluders(plan), bounds, blocks, lambda _: None)
    monkeypatch.setattr(coarse_blocks, "COARSE_SIDES", ())
    without = trace_first_pass(plan, Occluders(plan), bounds, blocks, lambda _: None)
    if count == 80:
        assert with_them.points < without.points
    else:
        assert with_them.points == without.points
