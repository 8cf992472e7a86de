# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the shutter for visibility: may a moving object pass through a pixel?

For a fixed ray, the discriminant of a sphere in linear motion is a quadratic in t, and the edge
functions of a quad are linear in t. The pixel's square is taken into account by enlarging the
objects by a bound on its effect. The tests are conservative: they never miss a passage.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.polygon.kernels import edge_planes
from ..geometry.sphere.kernels import discriminant, discriminant_rounding
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.jet import Jet
from ..numerics.taylor_range import interval_range
from ..numerics.vector import cross, dot
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from .edges import half_pixel

__all__ = ["SHUTTER_ENDS", "clip_positive", "detect_moving_silhouettes", "moves_under_fixed_ray"]


SHUTTER_ENDS = (-0.5, 0.5)
"""Shutter times at which the shutter opens and closes; it is 1 long."""


def detect_moving_silhouettes(
    plan: Plan, count: int, pairs: Pairs, w: Array, depth: Array, clear: Array
) -> tuple[Mask, Mask]:
    """Find the pixels in which a moving object may be visible at some time.

    Parameters
    ----------
    count : number of pixels.  pairs : their m candidate pairs with moving objects.
    w : (3, m) directions through the pixels' centres, per pair.
    depth : (count,) ray parameter beyond which objects at rest hide everything, inf for none.
    clear : (count,) ray parameter below which no object at rest is visible.

    Returns
    -------
    motion : (count,) a moving object may be visible, and its silhouette may pass through the pixel
        or the point that a fixed ray hits moves along the ray.
    outline : (count,) a moving silhouette, or a curve in which a moving object intersects another,
        may pass through the pixel's square (only with edges).
    """
    motion = np.zeros(count, dtype=np.bool_)
    outline = np.zeros(count, dtype=np.bool_)
    parts = []
    front = np.full(count, np.inf)
    ball = pairs.item < plan.sphere_count
    for rows, part in (
        (ball.nonzero()[0], _sphere_passages),
        ((~ball).nonzero()[0], _quad_passages),
    ):
        if not rows.size:
            continue
        chosen = pairs.take(rows)
        seen, always, near, far, shifts = part(plan, chosen, columns(w, rows))
        seen &= near <= depth[chosen.pixel]
        parts.append((chosen, seen, always, near, far, shifts))
        np.minimum.at(front, chosen.pixel[always], far[always])
    movers = np.zeros(count, dtype=np.int64)
    for chosen, seen, always, near, far, shifts in parts:
        # an object is invisible behind another that covers the pixel all the time
        seen = seen & (near <= front[chosen.pixel])
        motion[chosen.pixel[seen & (shifts | ~always)]] = True
        # a silhouette, or an intersection with an object at rest
        outline[chosen.pixel[seen & (~always | (far > clear[chosen.pixel]))]] = True
        movers += np.bincount(chosen.pixel[seen], minlength=count)
    # or an intersection of two moving objects
    outline |= movers > 1
    if not plan.edges:
        outline[:] = False
    return motion, outline


def _sphere_passages(plan: Plan, pairs: Pairs, w: Array) -> tuple[Mask, Mask, Array, Array, Mask]:
    """How moving spheres pass through pixels: (m,) each.

    Returns
    -------
    seen : whether the sphere may be hit at some time.
    always : whether all rays of the pixel hit it at all times.
    near, far : bounds on the ray parameter of the hits.
    shifts : whether the hit of a fixed ray moves; always true.
    """
    spheres = plan.spheres
    assert spheres.displacement is not None
    v, d = columns(spheres.center, pairs.item), columns(spheres.displacement, pairs.item)
    r = spheres.radius[pairs.item]
    ww = dot(w, w)
    v0, v1 = v - 0.5 * d, v + 0.5 * d
    farthest = np.maximum(dot(v0, v0), dot(v1, v1))
    # a ray of the pixel passes the sphere no farther than `widen` from where the centre ray does
    widen = np.zeros_like(r)
    if plan.edges:
        h = half_pixel(plan)
        length = np.sqrt(ww)
        widen = np.sqrt(farthest) * (h / np.maximum(length - h, 0.5 * length))
    place = Jet.linear(v, (d,), plan.settings.order)
    remainder = 0.25 * ww * dot(d, d)
    miss = np.maximum(_length(cross(w, v0)), _length(cross(w, v1)))
    rounding = discriminant_rounding(ww, farthest, r + widen, miss)
    outer = discriminant(w, place, r + widen)
    high = interval_range(outer, 0.5, remainder)[1]
    inner = discriminant(w, place, np.maximum(r - widen, 0.0))
    low = interval_range(inner, 0.5, remainder)[0]
    a0, a1 = dot(w, v0), dot(w, v1)
    length = np.sqrt(ww)
    reach = (r + 2.0 * widen) * length
    ahead = np.maximum(a0, a1) + reach > 0.0
    holds = np.minimum(dot(v0, v0), dot(v1, v1)) < (r + widen) ** 2
    always = (low > rounding) & (np.minimum(a0, a1) > reach) & ~holds
    near = np.maximum(np.minimum(a0, a1) - np.sqrt(np.maximum(high, 0.0)) - widen * length, 0.0)
    near = near / (length + (half_pixel(plan) if plan.edges else 0.0)) ** 2
    seen = (high > -rounding) & ahead
    shortest = np.maximum(length - (half_pixel(plan) if plan.edges else 0.0), 0.5 * length)
    far = np.maximum(a0, a1) - np.sqrt(np.maximum(low, 0.0)) + widen * length
    far = np.where(always, far / (shortest * shortest), np.inf)
    return seen, always, near, far, np.ones_like(seen)


def _quad_passages(plan: Plan, pairs: Pairs, w: Array) -> tuple[Mask, Mask, Array, Array, Mask]:
    """How moving quads pass through pixels: as `_sphere_passages`.

    Edge functions are linear in time while the camera stays on one side of the quad's plane.
    """
    quads = plan.quads
    assert quads.displacement is not None
    ids = pairs.item - plan.sphere_count
    u, v, d = (
        columns(quads.edge_u, ids),
        columns(quads.edge_v, ids),
        columns(quads.displacement, ids),
    )
    ends = [edge_planes(columns(quads.corner, ids) + t * d, u, v) for t in SHUTTER_ENDS]
    normal = cross(u, v)
    sides = [dot(columns(quads.corner, ids) + t * d, normal) for t in SHUTTER_ENDS]
    crosses = sides[0] * sides[1] <= 0.0
    first, last = np.full(ids.size, -0.5), np.full(ids.size, 0.5)
    always = ~crosses
    for k in range(4):
        values = []
        for planes, _, _ in ends:
            spread = np.zeros(ids.size)
            if plan.edges:
                for step in (plan.lens.right, plan.lens.up):
                    spread = spread + 0.5 * np.abs(dot(step[:, None], planes[k]))
            value = dot(w, planes[k])
            always &= value - spread > 0.0
            values.append(value + spread)
        first, last = clip_positive(first, last, values[0], values[1])
    spread = np.zeros(ids.size)
    if plan.edges:
        for step in (plan.lens.right, plan.lens.up):
            spread = spread + 0.5 * np.abs(dot(step[:, None], normal))
    facing = np.abs(dot(w, normal)) + spread
    near = np.minimum(np.abs(sides[0]), np.abs(sides[1])) / np.maximum(facing, TINY)
    least = np.maximum(facing - 2.0 * spread, 0.0)
    with np.errstate(over="ignore"):  # unbounded where seen edge-on
        far = np.maximum(np.abs(sides[0]), np.abs(sides[1])) / np.maximum(least, TINY)
    seen = crosses | (first <= last)
    shifts = ~_moves_in_own_plane(d, u, v)
    return seen, always, np.where(crosses, 0.0, near), far, shifts


TRIPLE_PRODUCT_ROUNDING = 2.0**-48
"""Generous bound on the rounding error of the triple product of a displacement and two edges.

It is relative to the product of their lengths, and also holds in a scene that was rotated."""


def clip_positive(first: Array, last: Array, start: Array, end: Array) -> tuple[Array, Array]:
    """The part of [first, last] on which a linear function of time is >= 0.

    `start` and `end` are its values at -1/2 and 1/2. The result is empty if first > last.
    """
    slope = end - start
    safe = np.where(slope != 0.0, slope, 1.0)
    root = -0.5 - start / safe
    first = np.where(slope > 0.0, np.maximum(first, root), first)
    last = np.where(slope < 0.0, np.minimum(last, root), last)
    never = (slope == 0.0) & (start < 0.0)
    return np.where(never, np.inf, first), last


def moves_under_fixed_ray(plan: Plan, item: NDArray[np.int64]) -> Mask:
    """Whether the point that a fixed ray hits moves with the object: (n,) for objects, -1 for none.

    It does on a moving sphere, and on a moving quad unless that moves within its own plane.
    """
    shifts = plan.moves.copy()
    quads = plan.quads
    if quads.displacement is not None:
        shifts[plan.sphere_count :] &= ~_moves_in_own_plane(
            quads.displacement, quads.edge_u, quads.edge_v
        )
    return np.append(shifts, False)[item]


def _moves_in_own_plane(d: Array, u: Array, v: Array) -> Mask:
    """Whether displacements d of parallelograms with edges u, v are in their planes: (n,)."""
    rounding = TRIPLE_PRODUCT_ROUNDING * _length(d) * _length(u) * _length(v)
    within: Mask = np.abs(dot(d, cross(u, v))) <= rounding
    return within


def _length(vector: Array) -> Array:
    length: Array = np.sqrt(dot(vector, vector))
    return length
