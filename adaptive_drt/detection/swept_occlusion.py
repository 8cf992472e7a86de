# SPDX-License-Identifier: GPL-3.0-or-later
"""What occluders surely do to a light as pieces of surfaces see it, during the whole shutter.

A ray from a point near p to a point of a light stays as near to the ray from p to the same point:
what a ball of radius r + d leaves alone as seen from p, one of radius r leaves alone as seen from
anywhere within d of p; what one of radius r - d hides, it hides as well. The same is true of where
the light and the ball are at other times of the shutter.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..geometry.sphere import blocks_segment, graze_of, starts_within
from ..lights.emitter import POINT, QUAD, Emitter
from ..numerics.arrays import Array, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot, norm
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from ..tracing.occluder_culling import Occluders
from .occlusion import ball_hides

__all__ = ["classify_patches"]


def classify_patches(
    plan: Plan,
    occluders: Occluders,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    reach: Array,
) -> tuple[Mask, Mask]:
    """Whether each occluder hides nothing of a light from a patch, or all of it, all the time.

    Parameters
    ----------
    surface : n points.  reach : (n,) metres, how far their patches extend from them.
    light : as it casts shadows.  pairs : (m) points and objects; only of spheres is anything sure.

    Returns
    -------
    none, full : (m,).
    """
    none, full = np.zeros((2, pairs.item.size), dtype=np.bool_)
    own = surface.item[pairs.pixel] == pairs.item
    rows = ((pairs.item < plan.sphere_count) & ~own).nonzero()[0]
    if light.kind not in (POINT, QUAD):
        # a disk faces who looks at it: wherever that is, it is in this ball
        light = replace(light, kind="BALL")
    item, pixel = pairs.item[rows], pairs.pixel[rows]
    point, place = columns(surface.point, pixel), columns(occluders.center, item)
    path = light.ball - light.radius
    # the radii of the occluders are those of balls around their paths
    wide, own_radius = occluders.radius[item], plan.spheres.radius[item]
    away = reach[pixel] + path + graze_of(point, own_radius)
    around, within = wide + away, 2.0 * own_radius - wide - away
    none[rows] = _hides(plan, light, point, place, around)[0]
    # where a ball may hold both a point and the light, it hides nothing
    apart = (norm(place - point) >= around) | (norm(light.center - place) - light.radius >= around)
    some = (~none[rows] & (within > 0.0) & apart).nonzero()[0]
    full[rows[some]] = _hides(
        plan, light, columns(point, some), columns(place, some), within[some]
    )[1]
    return none, full


def _hides(plan: Plan, light: Emitter, point: Array, place: Array, r: Array) -> tuple[Mask, Mask]:
    """Whether balls hide nothing, or all of a light from points outside them: (m,) each."""
    v = place - point
    enclosed = starts_within(dot(v, v), r, 0.0)
    if light.kind == POINT:
        block = blocks_segment(light.center - point, v, r)
        return ~block & ~enclosed, block & ~enclosed
    none, full = ball_hides(plan, light, light.center, point, place, r, enclosed)
    return none & ~full & ~enclosed, full & ~enclosed
