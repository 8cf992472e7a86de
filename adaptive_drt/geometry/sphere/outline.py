# SPDX-License-Identifier: GPL-3.0-or-later
"""How spheres hide lights from points: which of their outlines have a closed form."""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.vector import dot
from ..light_protocol import AreaLight
from ..occluder_outline import CIRCLE, CUT, ELLIPSE, NOTHING, RAYS

__all__ = ["kinds_before_ball", "sphere_outline_kinds"]


def sphere_outline_kinds(
    center: Array,
    r: Array,
    point: Array,
    own: Mask,
    light: AreaLight,
    time: Array | float,
) -> Ints:
    """Kinds (m,) of the outlines of spheres.

    From inside a sphere, and where it reaches into a solid light, no closed form is known.

    Parameters
    ----------
    center, point : (3, m) metres, relative to the camera.  r : (m,) radii, metres.
    own : (m,) whether the point lies on the sphere itself.
    time : shutter times, a number or (m,).
    """
    v, to = center - point, light.to_center(point, time)
    enclosed = own | (dot(v, v) <= r * r)
    if light.solid:
        kind = kinds_before_ball(center, r, to, light, time, CIRCLE)
    else:
        height = light.plane(to).height_of(v)
        kind = np.where(height >= r, CIRCLE, np.where(height <= -r, NOTHING, CUT))
    return np.where(enclosed, RAYS, kind)


def kinds_before_ball(
    center: Array,
    r: Array,
    to: Array,
    light: AreaLight,
    time: Array | float,
    before: int = ELLIPSE,
) -> Ints:
    """Kinds (m,) of the outlines, before a solid light, of shapes within balls of radii r (m,).

    They are of no known kind where the ball reaches into the light. A plane separates two disjoint
    balls: the one on the side of the point is in front.

    Parameters
    ----------
    center : (3, m) metres, relative to the camera.  to : (3, m) metres from the points to the
        light's centre.
    before : the kind of those that are in front.
    """
    gap = light.to_center(center, time)
    away = np.sqrt(dot(gap, gap))
    ahead = dot(to, gap) > light.radius * away
    return np.where(away <= r + light.radius, RAYS, np.where(ahead, before, NOTHING))
