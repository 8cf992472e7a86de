# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the shutter for light: may the light on a pixel's surface change with time?

The pixel's square and the light's area are taken into account by enlarging the objects by a bound
on their effect. The tests are conservative: they never miss a change.
"""

from __future__ import annotations

import numpy as np

from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Mask
from ..numerics.axes import SHUTTER_ENDS
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, curvature, receivers_of
from ..tracing.occluder_culling import may_shadow
from .occlusion import classify_horizon, classify_occluders
from .separating_planes import out_of_light

__all__ = ["light_changes", "patch_light_changes"]


def light_changes(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array) -> Mask:
    """Whether the light on surfaces at rest may change during the shutter: (n,).

    Parameters
    ----------
    surface : n points; their hits do not move under a fixed ray.
    light : as it casts shadows.  pairs : candidate occluders.
    reach : (n,) metres, the reach of the pixel's surface around the point (0 without edges).
    """
    moving = plan.is_moving[pairs.item]
    bend = curvature(plan, surface)
    if light.displacement is not None:
        return _changes_of_moving_light(plan, surface, light, pairs.take(~moving), reach, bend)
    dark = classify_horizon(light, light.to_center(surface.point), surface, reach, bend)[0]
    live = ~dark[pairs.pixel]
    changes = np.zeros(surface.item.size, dtype=np.bool_)
    candidates = pairs.take(moving & live)
    if not candidates.item.size:
        return changes
    touched = may_shadow(plan, surface, light, candidates, reach)
    touched &= ~out_of_light(plan, surface, light, candidates, reach, moving=True)
    changes[candidates.pixel[touched]] = True
    rows = changes[candidates.pixel].nonzero()[0]
    candidates, touched = candidates.take(rows), touched[rows]
    always = _always_hidden(plan, surface, light, candidates, reach)
    changes[:] = False
    changes[candidates.pixel[touched & ~always]] = True
    # nothing changes where one occluder, at rest or moving, always hides all of the light
    still = pairs.take(~moving & live & changes[pairs.pixel])
    hidden = np.zeros_like(changes)
    hidden[still.pixel[_always_hidden(plan, surface, light, still, reach)]] = True
    hidden[candidates.pixel[always]] = True
    changes &= ~hidden
    return changes


def patch_light_changes(
    plan: Plan, patch: Surface, light: Emitter, pairs: Pairs, reach: Array
) -> Mask:
    """Whether the light on surfaces of unknown shape may change during the shutter: (n,).

    Parameters
    ----------
    patch : centres of balls that hold the surfaces. Their normals are 0, so that no light is below
        their horizon.  reach : (n,) radii of the balls, metres.
    pairs : candidate occluders that hold for the whole balls.
    """
    changes = np.zeros(patch.item.size, dtype=np.bool_)
    if light.displacement is not None:
        changes[:] = True
        return changes
    candidates = pairs.take(plan.is_moving[pairs.item])
    touched = may_shadow(plan, patch, light, candidates, reach)
    changes[candidates.pixel[touched]] = True
    return changes


def _always_hidden(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array
) -> Mask:
    """Whether an occluder hides all of the light at both ends of the shutter, so at all times.

    Shapes are convex: the positions at which a shape blocks a fixed ray fill a convex set, and so
    do the points that a fixed shape hides from a point. So both ends decide.
    """
    opens, closes = SHUTTER_ENDS
    always = classify_occluders(plan, surface, light, pairs, opens)[1]
    rows = always.nonzero()[0]
    always[rows] = classify_occluders(plan, surface, light, pairs.take(rows), closes)[1]
    wide = (always & (reach[pairs.pixel] > 0.0)).nonzero()[0]
    for shapes, rows, index in plan.shapes.groups(pairs.item[wide]):
        chosen = wide[rows]
        receivers = receivers_of(surface, pairs.take(chosen), reach)
        for time in SHUTTER_ENDS:
            always[chosen] &= shapes.hides_from_patch(index, light, receivers, time)
    return always


def _changes_of_moving_light(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array, bend: Array
) -> Mask:
    """Whether the light of a moving light may change: (n,). `pairs` are occluders at rest."""
    dark = [
        classify_horizon(light, light.to_center(surface.point, time), surface, reach, bend)[0]
        for time in SHUTTER_ENDS
    ]
    changes = ~(dark[0] & dark[1])
    pairs = pairs.take(changes[pairs.pixel])
    always = _always_hidden(plan, surface, light, pairs, reach)
    changes[pairs.pixel[always]] = False
    return changes
