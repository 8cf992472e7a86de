# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates of mean radiance over subdomains of cells, by the centroid rule or a multi-node rule.

The centroid rule is exact for radiance linear in x, y and t; the multi-node rule, which matches
second moments, for quadratic radiance. The errors of both are predicted at the centroid alone, by
searching for shadow edges over the surface patch that the subdomain covers, once and not for each
node. The same prediction decides for which subdomains the multi-node rule is worth its cost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.axes import TIME
from ..numerics.error_coefficients import MULTI_NODE_ERROR
from ..numerics.floats import TINY
from ..numerics.gather import columns, place
from ..numerics.vector import dot
from ..parallel.call_progress import progress_range
from ..shading.direct_light import DirectLight, shade, shade_with_candidates
from ..shading.footprint import make_patch
from ..shading.variation import zero_variation
from ..tracing.closest_approach import hits_or_closest_points
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, surface
from ..tracing.occluder_culling import Occluders
from ..visibility.fragments import Fragments
from .limb_correction import limb_gains
from .node_clipping import clip_nodes
from .nodes import Nodes, make_nodes
from .posteriori import correct_errors
from .regions import grouped_sums

__all__ = [
    "SPLIT_ANYWAY_ERROR",
    "Estimates",
    "Subdomains",
    "concatenate_subdomains",
    "estimate_means",
    "multi_node_error",
]


SHADOW_SEARCH_RADIUS = 1.6
"""Radius, as a multiple of a subdomain's extent, within which shadow edges are searched for around
its centroid. A patch is linearised on a plane, and so is the growth of an occluder's angular size;
near contact both change faster Chosen, not fitted (135 random scenes at 0.1 %: the worst error is
1.21 of the tolerance without this margin, 0.97 with it)."""
CENTROID_RULE_ERROR = 0.1
"""Largest predicted error for which a still subdomain keeps the centroid rule, as a fraction of its
pixel's goal over the square root of the pixel's number of cells. Chosen for cost, not fitted. The
multi-node rule also detects errors that were not predicted (400 spheres, 0.01 %: at 0.01, 0.05 and
0.2 the picture's error is 0.46, 0.50 and 0.64 of the tolerance, with 19.2, 18.6 and 18.1 points a
pixel; the errors of 210 random scenes are the same at 0.1 as at 0.01)."""
CENTROIDS_WORK_SHARE = 0.5
"""Fraction of the work of `estimate_means` that shading the centroids takes, for a progress bar."""
NO_SEARCH_RADIUS = -1.0
"""Search radius, in metres, of centroids around which no search for occluders was made: negative,
so that every node lies beyond it."""
SPLIT_ANYWAY_ERROR = 1.5
"""Predicted error of a cell under the multi-node rule, as a multiple of its pixel's goal, above
which the cell will be split in any case and the rule is not applied. Chosen for cost, not
fitted."""


@dataclass(frozen=True)
class Subdomains:
    """Subdomains: m parts of cells, each showing one object, whose mean radiance is to be
    estimated.

    Attributes
    ----------
    centroid : (3, m) centroids in x, y, t.
    moment_root : (6, m) lower triangular roots of the second moments: xx, yx, yy, tx, ty, tt.
    half_extent : (3, m) half extents of the bounding boxes.
    item : (m,) object indices.  cell : (m,) cell indices.
    multi_node : (m,) whether the multi-node rule may be used.  turn : (m,) its rotations.
    error_weight : (m,) error of the pixel, in units of its goal, per unit error of the part's
        radiance.
    cell_count : (m,) number of cells of the pixel.
    shaded : (m,) whether the centroid has been shaded already. For the k of which this is true,
        `color` is (3, k), `deviation` (4, 3, k) and `sampling` (k,), the error of the light there.
    """

    centroid: Array
    moment_root: Array
    half_extent: Array
    item: Ints
    cell: Ints
    multi_node: Mask
    rotation: Ints
    error_weight: Array
    cell_count: Ints
    shaded: Mask
    color: Array
    deviation: Array
    sampling: Array


@dataclass(frozen=True)
class Estimates:
    """Estimates for m subdomains.

    Attributes
    ----------
    light : mean radiance and its estimated errors.
    shaded_count : (m,) points shaded for each, not counting centroids that were known already.
    split_anyway : (m,) whether the multi-node rule was skipped, as the part's cell would be split
        anyway.
    hidden_fraction : (m,) fraction of the nodes that are hidden by another object even at the
        centroid.
    """

    light: DirectLight
    shaded_count: Ints
    split_anyway: Mask
    hidden_fraction: Array


@dataclass(frozen=True)
class _Centroids:
    """Centroids of m subdomains.

    `hits` are the surfaces there, `light` their radiance with predicted errors, `search_radius`
    (m,) the radius in metres within which their candidate occluders are complete, and `cosine` (m,)
    the cosines between normals and rays.
    """

    hits: Surface
    light: DirectLight
    search_radius: Array
    cosine: Array


def concatenate_subdomains(one: Subdomains, other: Subdomains) -> Subdomains:
    """Concatenate two sets of subdomains, those of `one` first."""
    fields = [
        np.concatenate([getattr(one, name), getattr(other, name)], axis=-1)
        for name in Subdomains.__dataclass_fields__
    ]
    return Subdomains(*fields)


def estimate_means(
    plan: Plan,
    occluders: Occluders,
    parts: Subdomains,
    found: Fragments,
    hit: Ints,
    allowed: float,
) -> Estimates:
    """Estimate the mean radiance of m subdomains, each by the centroid rule or the multi-node rule.

    Parameters
    ----------
    parts : the subdomains.
    found, hit : all visible regions of the cells, and the indices of those that are the first
        subdomains; the subdomains after them are whole cells.
    allowed : radiance error that distributed rays may have at a point before more are used.
    """
    size, wide = parts.item.size, parts.half_extent > 0.0
    axes, box = wide.sum(axis=0), np.arange(size) >= hit.size
    with progress_range(0.0, CENTROIDS_WORK_SHARE):
        centers = _shade_centroids(plan, occluders, parts, allowed)
    needed, split_anyway = _choose_rule(parts, centers.light.deviation, axes, box)
    arms = make_nodes(
        parts.centroid, parts.moment_root, wide, needed & ~split_anyway, box, parts.rotation
    )
    left, hidden_nodes = _clip_offsets(plan, parts, found, hit, arms)
    star, part = arms.count > 1, 1.0 / arms.count[arms.subdomain]
    points, hidden_fraction = (
        arms.count + star - parts.shaded,
        grouped_sums(arms.subdomain, part * hidden_nodes, size),
    )
    light = centers.light
    if star.any():
        with progress_range(CENTROIDS_WORK_SHARE, 1.0):
            light = _multi_node_means(plan, occluders, parts, centers, arms, left, axes, allowed)
    return Estimates(light, points, split_anyway, hidden_fraction)


def _clip_offsets(
    plan: Plan, parts: Subdomains, found: Fragments, hit: Ints, arms: Nodes
) -> tuple[Array, Mask]:
    """Scale factor of each node's offset, and whether the node is hidden even at factor 0: (k,)
    each.
    """
    left, hidden_nodes = np.ones(arms.subdomain.size), np.zeros(arms.subdomain.size, dtype=np.bool_)
    if hit.size:
        own = slice(int(arms.count[: hit.size].sum()))
        region = arms.subdomain[own]
        left[own], hidden_nodes[own] = clip_nodes(
            plan, found, hit[region], columns(parts.centroid, region), arms.offset[:, own],
            columns(parts.half_extent, region), arms.group[own],
        )  # fmt: skip
    return left, hidden_nodes


def _multi_node_means(
    plan: Plan,
    occluders: Occluders,
    parts: Subdomains,
    centers: _Centroids,
    arms: Nodes,
    left: Array,
    axes: Ints,
    allowed: float,
) -> DirectLight:
    """Mean radiance of m subdomains, where some use the multi-node rule.

    Parameters
    ----------
    left : (k,) scale factors of the nodes' offsets.
    axes : (m,) along how many axes each subdomain has an extent.
    """
    size, region, star = axes.size, arms.subdomain, arms.count > 1
    center, foreseen, offset = centers.light.color, centers.light.deviation, left * arms.offset
    part = 1.0 / arms.count[region]
    shown, cosine = columns(center, region), centers.cosine[region]
    rows = star[region].nonzero()[0]
    spots = columns(parts.centroid, region[rows]) + columns(offset, rows)
    light, error, cosine[rows] = _shade_nodes(
        plan, occluders, parts, centers, spots, region[rows], allowed
    )
    place(shown, rows, light)
    sampling = centers.light.error[region]
    sampling[rows] = error
    sampling = grouped_sums(region, part * sampling, size)
    sampling += arms.centroid_weight * (centers.light.error - sampling)
    color = np.array([grouped_sums(region, part * row, size) for row in shown])
    color += arms.centroid_weight * (center - color)
    round_ = (star & ~plan.shapes.planar[parts.item]).nonzero()[0]
    if round_.size:
        gain = _limb_gains((cosine, centers.cosine), round_, arms, left, axes[round_])
        off = columns(color - center, round_)
        bent = columns(center, round_) + gain * off
        color[:, round_] = np.maximum(bent, plan.least_radiance)
    best = MULTI_NODE_ERROR[axes - 1].T
    short = grouped_sums(region, part * (1.0 - left * left), size)
    deviation = foreseen * np.where(star, best + (1.0 - best) * short, 1.0)[:, None]
    rows = star.nonzero()[0]
    deviation[..., rows] = correct_errors(
        columns(deviation, rows, -1),
        columns(foreseen, rows, -1),
        columns(center - color, rows),
        *_node_differences(shown - columns(color, region), offset, parts.half_extent, region, star),
    )
    return DirectLight(color, deviation, sampling)


def _choose_rule(parts: Subdomains, foreseen: Array, axes: Ints, box: Mask) -> tuple[Mask, Mask]:
    """Decide which of m subdomains need the multi-node rule, and which are in cells to be split
    anyway.

    Parameters
    ----------
    foreseen : (4, 3, m) predicted errors of the centroid rule.
    axes : (m,) along how many axes each subdomain has an extent.
    box : (m,) which are whole cells, not regions within them.
    """
    lasting = parts.half_extent[TIME] > 0.0
    with np.errstate(over="ignore"):  # lights of 1e30 beside a picture of 1e-214
        each = parts.error_weight * foreseen.sum(axis=(0, 1))
        # errors are predicted less well under motion: with a moving occluder node values were 3
        # times as far off
        needed = each * np.sqrt(parts.cell_count) > np.where(lasting, 0.0, CENTROID_RULE_ERROR)
        # a region with an extent in time may be in several pieces, some far from the centroid
        needed |= lasting & ~box
        left = parts.error_weight * multi_node_error(foreseen, axes)
        split_anyway = (
            grouped_sums(parts.cell, left, int(parts.cell.max(initial=-1)) + 1) > SPLIT_ANYWAY_ERROR
        )
    return parts.multi_node & needed, split_anyway[parts.cell]


def multi_node_error(foreseen: Array, axes: Ints) -> Array:
    """Predicted errors (m,) of the multi-node rule.

    foreseen : (4, 3, m) predicted errors of the centroid rule, by kind and axis.
    axes : (m,) along how many axes the subdomains have an extent.
    """
    left: Array = (MULTI_NODE_ERROR[axes - 1].T * foreseen.sum(axis=1)).sum(axis=0)
    return left


def _limb_gains(
    cosine: tuple[Array, Array], rows: Ints, arms: Nodes, left: Array, axes: Ints
) -> Array:
    """Evaluate `limb_gains` for some subdomains on spheres.

    Parameters
    ----------
    slant : cosines at the nodes (k,) and at the centroids (m,).
    rows : the subdomains.
    left : (k,) scale factors of the nodes' offsets.
    axes : along how many axes those subdomains have an extent.
    """
    number = np.full(arms.count.size, -1)
    number[rows] = np.arange(rows.size)
    own = number[arms.subdomain]
    # nodes that were moved back to the centroid carry no information
    some = ((own >= 0) & (left > 0.0)).nonzero()[0]
    own, region = own[some], arms.subdomain[some]
    weight = (1.0 - arms.centroid_weight[region]) / arms.count[region]
    return limb_gains(cosine[0][some], cosine[1][rows], weight, left[some], own, axes)


def _node_differences(
    away: Array, offset: Array, half: Array, region: Ints, star: Mask
) -> tuple[Ints, Array, Array]:
    """Nodes of the subdomains that use the multi-node rule.

    Returns
    -------
    index : the subdomain of each node, counted among those that use the rule.
    away : (3, k) the nodes' radiance less the mean.
    place : (3, k) their offsets, in half extents of the subdomain.
    """
    rows = star[region].nonzero()[0]
    own = region[rows]
    place = columns(offset, rows) / np.maximum(columns(half, own), TINY)
    return np.cumsum(star)[own] - 1, columns(away, rows), place


def _shade_centroids(
    plan: Plan, occluders: Occluders, parts: Subdomains, allowed: float
) -> _Centroids:
    """Shade the centroids of m subdomains and predict the errors of the centroid rule."""
    hits, w, t, time = _hits(plan, parts.centroid, parts.item)
    cosine, known = _incidence_cosines(hits, w), parts.shaded
    if not known.any():
        light, reach = _shade_with_errors(
            plan, occluders, hits, w, t, time, parts.half_extent, allowed
        )
        return _Centroids(hits, light, reach, cosine)
    rows, same = (~known).nonzero()[0], known.nonzero()[0]
    when = time[rows] if isinstance(time, np.ndarray) else time
    near = hits.take(rows), columns(w, rows), t[rows], when, columns(parts.half_extent, rows)
    light, far = _shade_with_errors(plan, occluders, *near, allowed)
    reach = np.full(known.size, NO_SEARCH_RADIUS)
    reach[rows] = far
    color, deviation = np.empty((3, known.size)), zero_variation(known.size)
    error = np.empty(known.size)
    error[rows], error[same] = light.error, parts.sampling
    place(color, rows, light.color)
    place(color, same, parts.color)
    place(deviation, rows, light.deviation)
    place(deviation, same, parts.deviation)
    found = tuple(Pairs(rows[pairs.pixel], pairs.item) for pairs in light.candidates)
    return _Centroids(hits, DirectLight(color, deviation, error, found), reach, cosine)


def _shade_with_errors(
    plan: Plan,
    occluders: Occluders,
    hits: Surface,
    w: Array,
    t: Array,
    time: Array | float,
    half: Array,
    allowed: float,
) -> tuple[DirectLight, Array]:
    """Shade hits, with predicted errors of their means over boxes of half extents (3, m).

    Returns with it the radius in metres within which the candidate occluders are complete: (m,).
    """
    with np.errstate(over="ignore", invalid="ignore"):  # overflow affects error estimates only
        patch = replace(make_patch(plan, w, t, hits, half), margin=SHADOW_SEARCH_RADIUS)
    return shade(plan, occluders, hits, time, patch, allowed=allowed), patch.radius


def _shade_nodes(
    plan: Plan,
    occluders: Occluders,
    parts: Subdomains,
    centers: _Centroids,
    spots: Array,
    region: Ints,
    allowed: float,
) -> tuple[Array, Array, Array]:
    """Radiance (3, k) at nodes, its error (k,) and the cosines (k,) there.

    spots : (3, k) positions in x, y, t.  region : (k,) subdomain of each.
    """
    hits, w, _, time = _hits(plan, spots, parts.item[region])
    away = hits.point - columns(centers.hits.point, region)
    farthest = np.zeros(parts.item.size)
    np.maximum.at(farthest, region, np.sqrt(dot(away, away)))
    around = [
        _node_occluders(occluders, plan.as_shadow_caster(light), centers, known, farthest)
        for light, known in zip(plan.lights, centers.light.candidates, strict=True)
    ]
    candidates = [pairs.for_pixels(region, parts.item.size) for pairs in around]
    light, error = shade_with_candidates(plan, hits, time, candidates, allowed)
    return light, error, _incidence_cosines(hits, w)


def _node_occluders(
    occluders: Occluders, light: Emitter, centers: _Centroids, known: Pairs, farthest: Array
) -> Pairs:
    """Candidate occluders that are complete for all nodes of each subdomain.

    Parameters
    ----------
    light : as it casts shadows.
    known : those that are complete within `centers.reach`, sorted by subdomain.
    farthest : (m,) metres from each centroid to its farthest node.
    """
    # nodes may lie outside the patch that was searched for occluders
    beyond = farthest > centers.search_radius
    rows = beyond.nonzero()[0]
    if not rows.size:
        return known
    more = occluders.find_candidates(light, centers.hits.take(rows), farthest[rows])
    near = known.take(~beyond[known.pixel])
    pixel = np.concatenate([near.pixel, rows[more.pixel]])
    item = np.concatenate([near.item, more.item])
    return Pairs(pixel, item).take(np.argsort(pixel, kind="stable"))


def _hits(plan: Plan, spots: Array, item: Ints) -> tuple[Surface, Array, Array, Array | float]:
    """Intersect given objects with the rays at positions (3, k) in x, y and t.

    Returns surfaces, ray directions, ray parameters and times.
    """
    w = plan.lens.directions(spots[0], spots[1])
    time: Array | float = spots[2] if plan.motion else 0.0
    t = hits_or_closest_points(plan, w, item, time)
    return surface(plan, w, t, item, time), w, t, time


def _incidence_cosines(hits: Surface, w: Array) -> Array:
    """Cosines (k,) between surface normals and rays, without sign."""
    cosine: Array = np.abs(dot(hits.normal, w)) / np.sqrt(dot(w, w))
    return cosine
