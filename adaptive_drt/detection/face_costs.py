# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether tracing rays against flat faces costs less than summing light behind them in closed form.

What closed forms cost is told from some pixels of the picture before it is rendered. Two things
make them expensive:

- Under a light that surrounds the scene, the faces above the horizon of a point, whose outlines
  cross each other.
- In pixels that show several faces, as bars thinner than a pixel, each region between outlines is
  lit by itself, behind all faces that may shade the pixel: the work grows with the square of both
  numbers.

`benchmarks/face_costs.py` renders scenes both ways; the constants are read off its table.
"""

from __future__ import annotations

import numpy as np

from ..lights.emitter import Emitter
from ..numerics.arrays import Ints
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Tile, find_candidates, screen_bounds
from ..tracing.occluder_culling import Occluders
from ..tracing.ray_costs import REFERENCE_TOLERANCE
from .detect import DetectionFlags, detect, trace_center_rays

__all__ = [
    "detected",
    "faces_above_horizons",
    "rays_cost_less_than_faces",
    "surrounds",
    "work_in_cut_pixels",
]


PROBE_PIXELS, PROBE_ROWS = 256, 16
"""Numbers of pixels that are looked at, and of the rows of the picture that they lie in: they tell
a mean to some 15 %."""
FACES_ABOVE, FACES_POWER = 12.0, 0.5
"""Mean number of faces above the horizons of points, from which rays cost less under a light that
surrounds the scene, at `REFERENCE_TOLERANCE`; and the power of the inverse of the tolerance that it
grows with. Cubes at 1 %, seconds in closed form and by rays, 64 x 48 pixels: 7 faces 0.6 and 0.7,
18 faces 4 and 0.9, 37 faces 22 and 1; at 0.1 %: 18 faces 8 and 35, 37 faces 49 and 35."""
LEAST_FACES = 12
"""Number of faces below which they are always summed: two cubes are no slower than by rays."""
MANY_ABOVE = 16.0
"""Number of faces from which no pixel is looked at, as a multiple of those above horizons."""
CUT_WORK, WORK_POWER = 2_000.0, 1.3
"""Work in pixels with outlines (`work_in_cut_pixels`) from which rays cost less, at the same
tolerance, and its power.
Seconds at 1 %, 48 x 36 pixels: work of 700 0.7 and 0.3, of 2,700 2 and 0.5, of 30,000 5 and 1.2,
of 90,000 7 to 30 and 0.4; at 0.1 %: 1,300 1 and 2, 5,000 12 and 30, 90,000 over 30 and 5."""


def rays_cost_less_than_faces(plan: Plan, faces: int) -> bool:
    """Whether flat faces are better rendered as meshes than in closed form.

    Parameters
    ----------
    plan : the scene with the faces in closed form.
    faces : number of faces that would be replaced: see `scene.face_meshes`.
    """
    if faces < LEAST_FACES:
        return False
    finer = REFERENCE_TOLERANCE / plan.settings.tolerance
    above, work = FACES_ABOVE * finer**FACES_POWER, CUT_WORK * finer**WORK_POWER
    around = [surrounds(plan, light) for light in plan.lights]
    if any(around) and faces > MANY_ABOVE * above:
        return True
    found = detected(plan)
    if found is None:
        return False
    hits, flags = found
    if any(around) and faces_above_horizons(hits, flags, around) > above:
        return True
    return bool(work_in_cut_pixels(hits, flags, around) > work)


def surrounds(plan: Plan, light: Emitter) -> bool:
    """Whether what surrounds a point hides parts of a light."""
    shape = plan.as_shadow_caster(light)
    return bool(shape.surrounds and shape.casts_shadow)


def detected(plan: Plan) -> tuple[Ints, DetectionFlags] | None:
    """The pixels, among those looked at, whose centres hit something, and the flags of all."""
    left, bottom, right, top = plan.region
    rows = min(PROBE_ROWS, top - bottom)
    step = -(-(top - bottom) // rows)
    tile = Tile.make(plan, step // 2, step)
    kept = np.zeros(tile.index.size, dtype=np.bool_)
    kept[:: -(-rows * (right - left) // PROBE_PIXELS)] = True
    pairs = find_candidates(plan, screen_bounds(plan), tile)
    pairs = pairs.take(kept[pairs.pixel])
    pairs = Pairs((kept.cumsum() - 1)[pairs.pixel], pairs.item)
    center = trace_center_rays(plan, tile.x[kept], tile.y[kept], pairs)
    if not center.rows.size:
        return None
    return center.rows, detect(plan, Occluders(plan), center, lambda _: None)


def faces_above_horizons(hits: Ints, flags: DetectionFlags, around: list[bool]) -> float:
    """Mean number of objects that may hide lights that surround the points.

    Parameters
    ----------
    hits : (k,) the pixels whose centres hit something.  flags : of all pixels.
    around : whether each light surrounds the points.
    """
    counts = [pairs.item.size for pairs, each in zip(flags.candidates, around, strict=True) if each]
    return float(max(counts)) / hits.size


def work_in_cut_pixels(hits: Ints, flags: DetectionFlags, around: list[bool]) -> float:
    """Mean over pixels that hit something of the product of two squares where outlines may pass:
    of the number of objects that may be seen in the pixel, and of those that may shade it.

    Parameters are those of `faces_above_horizons`; lights that surround the points do not count.
    """
    size = flags.silhouette.size
    shading = np.zeros(size)
    for pairs, each in zip(flags.candidates, around, strict=True):
        if not each:
            shading[hits] += np.bincount(pairs.pixel, minlength=hits.size)
    seen = np.bincount(flags.visible_candidates.pixel, minlength=size)
    work = (shading * seen) ** 2 * flags.silhouette
    return float(work.sum()) / hits.size
