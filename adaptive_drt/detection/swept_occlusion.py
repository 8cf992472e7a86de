# SPDX-License-Identifier: GPL-3.0-or-later
"""Occlusion of a light from patches of surface during the whole shutter, by bounding balls.

Let q be within d of a point p. The segments from p and from q to the same point of a light are
within d of each other. So if a ball of radius r + d hides nothing of the light from p, a ball of
radius r hides nothing from q; and if one of radius r - d hides all of it from p, one of radius r
hides all of it from q. The displacements of the light and the ball add to d in the same way.
"""

from __future__ import annotations

import numpy as np

from ..geometry.sphere.kernels import origin_inside, sphere_blocks_segment, surface_tolerance
from ..geometry.sphere.light_occlusion import ball_occlusion
from ..lights.bounds import LightBounds
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot, norm
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from ..tracing.occluder_culling import Occluders

__all__ = ["classify_patches"]


def classify_patches(
    plan: Plan,
    occluders: Occluders,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    reach: Array,
) -> tuple[Mask, Mask]:
    """Whether each occluder hides nothing of a light from a patch, or all of it, at all times.

    Parameters
    ----------
    surface : n points.  reach : (n,) metres, bounds on the reach of their patches.
    light : as it casts shadows.  pairs : m pairs of points and objects.

    Returns
    -------
    none, full : (m,) bool; both are false where nothing is proven, and for all objects that do not
        fill their bounding spheres.
    """
    none, full = np.zeros((2, pairs.item.size), dtype=np.bool_)
    own = surface.item[pairs.pixel] == pairs.item
    rows = ((pairs.item < plan.shapes.proxied) & ~own).nonzero()[0]
    bounds = light.bounds_from_anywhere()
    item, pixel = pairs.item[rows], pairs.pixel[rows]
    point, place = columns(surface.point, pixel), columns(occluders.center, item)
    path = bounds.swept_radius - bounds.radius
    # `occluders.radius` are the radii of balls around the swept objects
    wide, at_rest = occluders.radius[item], plan.shapes.bounding_spheres[1][item]
    away = reach[pixel] + path + surface_tolerance(point, at_rest)
    around, within = wide + away, plan.shapes.inner_radii[item] + at_rest - wide - away
    none[rows] = _classify_from_outside(plan, bounds, point, place, around)[0]
    # a ball that contains both the point and the light hides nothing
    apart = norm(place - point) >= around
    apart |= norm(bounds.to_center(place)) - bounds.radius >= around
    some = (~none[rows] & (within > 0.0) & apart).nonzero()[0]
    full[rows[some]] = _classify_from_outside(
        plan, bounds, columns(point, some), columns(place, some), within[some]
    )[1]
    return none, full


def _classify_from_outside(
    plan: Plan, light: LightBounds, point: Array, place: Array, r: Array
) -> tuple[Mask, Mask]:
    """Whether balls hide nothing, or all of a light; both false for points inside: (m,) each."""
    v = place - point
    enclosed = origin_inside(dot(v, v), r, 0.0)
    to = light.to_center(point)
    if not light.extended:
        block = sphere_blocks_segment(to, v, r)
        return ~block & ~enclosed, block & ~enclosed
    none, full = ball_occlusion(
        light, to, light.to_center(place), v, r, enclosed, plan.settings.order
    )
    return none & ~full & ~enclosed, full & ~enclosed
