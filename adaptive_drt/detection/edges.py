# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the pixel: may the nearest object change within the pixel's square?

The discriminant of a sphere is a quadratic in the pixel's coordinates, and the edge functions of
a quad are linear, so a jet of order 2 decides up to rounding whether an object covers the pixel,
misses it or covers a part. Objects behind one that covers the whole pixel are ignored.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry.polygon.kernels import edge_planes
from ..geometry.sphere.kernels import discriminant, discriminant_rounding
from ..numerics.arrays import Array, Mask
from ..numerics.floats import UNIT_ROUNDOFF
from ..numerics.gather import columns
from ..numerics.jet import Jet
from ..numerics.taylor_range import rectangle_range
from ..numerics.vector import cross, dot
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, nearest_hits
from .surface_intersections import detect_intersections

__all__ = ["EdgeTest", "PixelCoverage", "detect_edges", "half_pixel"]


EDGE_FUNCTION_OPERATIONS = 32
"""Number of rounded operations behind one edge function w.plane.

Its rounding error is at most so many unit roundoffs of |w| |plane|."""


@dataclass(frozen=True)
class PixelCoverage:
    """Coverage of pixels by their candidate objects, at the middle of the shutter.

    Attributes
    ----------
    some : (m,) whether some ray of the pixel may hit the object.
    full : (m,) whether all rays of the pixel certainly hit it.
    near, far : (m,) lower and upper bounds on the ray parameter of those hits.
    """

    some: Mask
    full: Mask
    near: Array
    far: Array


@dataclass(frozen=True)
class EdgeTest:
    """Result of detection over n pixels with m candidate pairs.

    Attributes
    ----------
    edge : (n,) whether the nearest object may change within the pixel.
    front : (n,) least upper bound on the ray parameters of an object that covers the whole pixel;
        inf if none does.
    front_still : (n,) the same among objects that do not move.
    nearest_still : (n,) lower bound on the ray parameters of objects that do not move; inf if none.
    some : (m,) whether some ray of the pixel may hit the candidate.
    seen : (m,) whether that hit may also be visible.
    near, far : (m,) bounds on the ray parameter of the visible part of the candidate.
    """

    edge: Mask
    front: Array
    front_still: Array
    nearest_still: Array
    some: Mask
    seen: Mask
    near: Array
    far: Array


def half_pixel(plan: Plan) -> float:
    """Bound on |w - w0| for directions w of a pixel's rays (not normalised), w0 at its centre."""
    lens = plan.lens
    return 0.5 * float(np.sqrt(dot(lens.right, lens.right)) + np.sqrt(dot(lens.up, lens.up)))


def detect_edges(plan: Plan, count: int, pairs: Pairs, w: Array, t: Array) -> EdgeTest:
    """Find the pixels in which a silhouette, or a change of depth order, may be visible.

    Parameters
    ----------
    count : number of pixels in the batch.  pairs : their m candidate pairs.
    w : (3, m) directions through the pixels' centres, per pair.
    t : (m,) ray parameters of the centre rays' hits, inf for a miss.
    """
    cover = _classify_coverage(plan, pairs, w)
    front = np.full(count, np.inf)
    full = cover.full.nonzero()[0]
    np.minimum.at(front, pairs.pixel[full], cover.far[full])
    still = full[~plan.moves[pairs.item[full]]]
    front_still = np.full(count, np.inf)
    np.minimum.at(front_still, pairs.pixel[still], cover.far[still])
    seen = cover.some & (cover.near <= front[pairs.pixel])
    edge = np.zeros(count, dtype=np.bool_)
    edge[pairs.pixel[seen & ~cover.full]] = True
    both = seen & cover.full
    edge |= _intersection_edges(plan, count, pairs.take(both), w, t, both)
    nearest_still = np.full(count, np.inf)
    some_still = (cover.some & ~plan.moves[pairs.item]).nonzero()[0]
    np.minimum.at(nearest_still, pairs.pixel[some_still], cover.near[some_still])
    far = np.minimum(cover.far, front[pairs.pixel])
    return EdgeTest(edge, front, front_still, nearest_still, cover.some, seen, cover.near, far)


def _intersection_edges(
    plan: Plan, count: int, pairs: Pairs, w: Array, t: Array, chosen: Mask
) -> Mask:
    """Whether objects that cover a pixel and overlap in depth may intersect in it: (count,).

    It is enough to test the object that the centre ray hits first against each of the others.
    """
    w, t = columns(w, chosen), t[chosen]
    rivals = np.bincount(pairs.pixel, minlength=count)
    _, front = nearest_hits(count, pairs, t)
    rows = ((rivals[pairs.pixel] > 1) & (pairs.item != front[pairs.pixel])).nonzero()[0]
    seam = np.zeros(count, dtype=np.bool_)
    other = front[pairs.pixel[rows]]
    # no hit at the centre though the pixel is covered is an effect of rounding: flag the pixel
    found = other >= 0
    cut = ~found
    cut[found] = detect_intersections(
        plan, columns(w, rows[found]), other[found], pairs.item[rows[found]], half_pixel(plan)
    )
    seam[pairs.pixel[rows[cut]]] = True
    return seam


def _classify_coverage(plan: Plan, pairs: Pairs, w: Array) -> PixelCoverage:
    """Coverage of pixels by candidates; w (3, m) are the pixels' centre directions, per pair."""
    m = pairs.item.size
    cover = PixelCoverage(
        np.zeros(m, dtype=np.bool_), np.zeros(m, dtype=np.bool_), np.zeros(m), np.full(m, np.inf)
    )
    for _, rows, index in plan.shapes.runs(pairs.item):
        ids = pairs.item[rows][: index.size]
        part = _sphere_coverage if ids[0] < plan.sphere_count else _quad_coverage
        some, full, near, far = part(plan, ids, columns(w, rows))
        cover.some[rows], cover.full[rows] = some, full
        cover.near[rows], cover.far[rows] = near, far
    return cover


def _sphere_coverage(
    plan: Plan, item: NDArray[np.int64], w: Array
) -> tuple[Mask, Mask, Array, Array]:
    """Coverage of pixels by spheres: `some`, `full`, `near` and `far` of `PixelCoverage`."""
    lens = plan.lens
    v, r = columns(plan.spheres.center, item), plan.spheres.radius[item]
    h = half_pixel(plan)
    ww, vv, along = dot(w, w), dot(v, v), dot(w, v)
    length = np.sqrt(ww)
    closest = cross(w, v)
    square = dot(closest, closest)
    d = r * r * ww - square
    # |w - w0| <= h changes D by no more than this
    change = 2.0 * h * (r * r * length + np.sqrt(square * vv)) + h * h * (r * r + vv)
    low, high = d - change, d + change
    unsure = ((low <= 0.0) & (high >= 0.0)).nonzero()[0]
    if unsure.size:
        which = unsure if item.size > 1 else np.zeros_like(unsure)
        low[unsure], high[unsure] = _discriminant_range(
            plan, columns(w, unsure), columns(v, which), r[which]
        )
    # over the pixel w x v grows by no more than h |v|
    rounding = discriminant_rounding(ww, vv, r, np.sqrt(square) + h * np.sqrt(vv))
    some, full = high >= -rounding, low > rounding
    slope = 0.5 * (np.abs(dot(lens.right[:, None], v)) + np.abs(dot(lens.up[:, None], v)))
    inside = vv < r * r
    some &= inside | (along + slope >= 0.0)
    full &= inside | (along - slope > 0.0)
    small, large = _least_direction_length(plan, length), length + h
    root_low, root_high = np.sqrt(np.maximum(low, 0.0)), np.sqrt(np.maximum(high, 0.0))
    sign = np.where(inside, 1.0, -1.0)
    first = along - slope + np.where(inside, root_low, -root_high)
    last = along + slope + sign * np.where(inside, root_high, root_low)
    near = np.maximum(first, 0.0) / (large * large)
    far = np.maximum(last, 0.0) / (small * small)
    return some, full, near, far


def _least_direction_length(plan: Plan, length: Array) -> Array:
    """Lower bound on the lengths of a pixel's directions, given that of its centre ray.

    None is shorter than the distance of the image plane, however wide the pixel is.
    """
    lens = plan.lens
    normal = cross(lens.right, lens.up)
    plane = np.abs(dot(normal, lens.base)) / np.sqrt(dot(normal, normal))
    return np.maximum(
        length - half_pixel(plan), (1.0 - EDGE_FUNCTION_OPERATIONS * UNIT_ROUNDOFF) * plane
    )


def _discriminant_range(plan: Plan, w: Array, v: Array, r: Array) -> tuple[Array, Array]:
    """Range of the discriminant D over the pixel, by its jet in the pixel's x and y."""
    lens = plan.lens
    order = plan.settings.order
    ray = Jet.linear(w, (lens.right[:, None], lens.up[:, None]), order)
    d = discriminant(ray, v, r)
    h = half_pixel(plan)
    # the remainder of order 1 is r^2 |o|^2 - |o x v|^2 for an offset |o| <= h
    remainder = h * h * np.maximum(r * r, dot(v, v))
    return rectangle_range(d, 0.5, 0.5, remainder)


def _quad_coverage(
    plan: Plan, item: NDArray[np.int64], w: Array
) -> tuple[Mask, Mask, Array, Array]:
    """Coverage of pixels by quads: `some`, `full`, `near` and `far` of `PixelCoverage`."""
    lens = plan.lens
    ids = item - plan.sphere_count
    planes, normal, height = edge_planes(
        columns(plan.quads.corner, ids),
        columns(plan.quads.edge_u, ids),
        columns(plan.quads.edge_v, ids),
    )
    seen = height > 0.0
    some = seen & np.ones(w.shape[1], dtype=np.bool_)
    full = some.copy()
    length = np.sqrt(dot(w, w))
    for plane in planes:
        value, spread = _linear_range(lens.right, lens.up, w, plane)
        rounding = EDGE_FUNCTION_OPERATIONS * UNIT_ROUNDOFF * length * np.sqrt(dot(plane, plane))
        some &= value + spread >= -rounding
        full &= value - spread > rounding
    facing, spread = _linear_range(lens.right, lens.up, w, normal)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # edge-on: unbounded
        near = np.where(some, height / np.maximum(facing + spread, 0.0), 0.0)
        least = facing - spread
        far = np.where(least > 0.0, height / least, np.inf)
    # `far` is also bounded by the farthest corner
    q, u, v = (
        columns(plan.quads.corner, ids),
        columns(plan.quads.edge_u, ids),
        columns(plan.quads.edge_v, ids),
    )
    farthest = np.max([dot(c, c) for c in (q, q + u, q + v, q + u + v)], axis=0)
    far = np.minimum(far, np.sqrt(farthest) / _least_direction_length(plan, length))
    return some, full, np.where(np.isnan(near), 0.0, near), far


def _linear_range(right: Array, up: Array, w: Array, plane: Array) -> tuple[Array, Array]:
    """Value of w.plane at the pixel's centre, and its largest change within the pixel."""
    spread = 0.5 * (np.abs(dot(right[:, None], plane)) + np.abs(dot(up[:, None], plane)))
    return dot(w, plane), spread
