# SPDX-License-Identifier: GPL-3.0-or-later
"""What pixels cost by light in closed form and by rays: the figures of `tracing/ray_costs.py`.

    python benchmarks/ray_costs.py

Prints, for heaps and gases of several numbers of balls under a sky, the CPU time of a point in
closed form beside the number of spheres above its horizon, and the straight line fitted to them;
and the time of a sampled point with its rays, and the mean numbers of points that pixels take at
two tolerances by either way.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from many_spheres import make_scene

from adaptive_drt.detection.detect import trace_center_rays
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import validate
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.direct_light import shade_with_candidates
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.few_occluders import FewOccluders
from adaptive_drt.tracing.intersect import Tile, find_candidates, screen_bounds
from adaptive_drt.tracing.occluder_culling import Occluders

SCENES = (
    ("packed", 100), ("packed", 300), ("packed", 1_000), ("packed", 3_000),
    ("gas", 100), ("gas", 300), ("gas", 1_000),
)  # fmt: skip
SIZE = (48, 36)
POINTS = 120
"""Number of points in closed form of each scene."""
REACH = 0.02
"""Extent in metres of the patches around the points."""
RENDERED, TOLERANCES = (("packed", 300), ("gas", 300)), (1e-2, 3e-3)


def closed_form(kind: str, count: int) -> tuple[float, float]:
    """Mean number of spheres above the horizon, and seconds, of a point in closed form."""
    plan = make_plan(validate(make_scene(kind, count, SIZE)), Settings(threads=1))
    occluders = Occluders(plan)
    tile = Tile.make(plan, 0, 4)
    pairs = find_candidates(plan, screen_bounds(plan), tile)
    hits = trace_center_rays(plan, tile.x, tile.y, pairs).hits
    hits = hits.take((hits.item < count).nonzero()[0])
    hits = hits.take(np.arange(0, hits.item.size, max(1, hits.item.size // POINTS)))
    number = FewOccluders(occluders).count_above_horizons(hits, np.ones(plan.object_count)).mean()
    start = time.process_time()
    found = occluders.find_candidates(plan.lights[0], hits, np.full(hits.item.size, REACH))
    shade_with_candidates(plan, hits, 0.0, [found])
    return float(number), (time.process_time() - start) / hits.item.size


def by_pixel(kind: str, count: int, tolerance: float, accelerator: str) -> None:
    """Print the points and seconds of cut and of filled pixels of a picture."""
    scene = make_scene(kind, count, SIZE)
    start = time.process_time()
    film = render_image(scene, Settings(tolerance=tolerance, threads=1, accelerator=accelerator))
    seconds = time.process_time() - start
    cut = film.mask[2]
    filled = film.mask[0] & ~cut
    print(
        f"{count:>6,} {kind:8} {tolerance:g} {'rays' if accelerator == 'AUTO' else 'closed':6} "
        f"cut {film.samples[cut].mean():8.1f} filled {film.samples[filled].mean():8.1f} points, "
        f"{1e6 * seconds / film.samples.sum():7.2f} us a point, {seconds:.1f} s"
    )


def main() -> None:
    """Measure and print."""
    rows = []
    for kind, count in SCENES:
        number, seconds = closed_form(kind, count)
        rows.append((number, seconds))
        print(
            f"{count:>6,} {kind:8} {number:7.0f} above the horizon, {1e6 * seconds:8.1f} us a point"
        )
    number, seconds = np.array(rows).T
    # relative errors count alike
    terms = np.array([np.ones_like(number), number]) / seconds
    fixed, each = np.linalg.lstsq(terms.T, np.ones_like(seconds), rcond=None)[0]
    print(f"a point: {fixed:.1e} s and {each:.1e} s for each sphere above its horizon")
    for kind, count in RENDERED:
        for tolerance in TOLERANCES:
            for accelerator in ("AUTO", "ARRAYS"):
                by_pixel(kind, count, tolerance, accelerator)


if __name__ == "__main__":
    main()
