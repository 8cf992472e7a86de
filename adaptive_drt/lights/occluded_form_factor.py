# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance from partly occluded lights of uniform radiance, in closed form.

The visible part of a light is bounded by arcs: those of the light's outline and of the horizon that
no occluder covers, and those of the occluders' outlines that lie on the light and behind no other
occluder. Where outlines coincide, ties are broken as if each occluder were enlarged by an
infinitesimal amount, the first by the most: so an edge that two faces share lies inside both, and
of two equal occluders only the first contributes an outline.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..geometry.axial_profile import AxialProfile, ProfileAtPoints
from ..geometry.boundary_arcs import BoundaryArcs, arcs_of_curve
from ..geometry.crossing_circles import open_circles, open_circles_integral
from ..geometry.crossing_cones import open_cones
from ..geometry.crossing_polygons import (
    open_arcs,
    open_arcs_integral,
    open_edges,
    open_edges_integral,
)
from ..geometry.elliptic_cones import (
    EllipticCones,
    arcs_inside_elliptic_cones,
    cone_antiderivative,
    cone_boundary_values,
    cone_heights,
    cones_of_circles,
    elliptic_cones_outside_half_spaces,
)
from ..geometry.silhouettes import (
    CircularSilhouette,
    EllipticSilhouette,
    Hemisphere,
    LightSilhouette,
    OpenSilhouette,
    PolygonSilhouettes,
    circular_silhouette,
    elliptic_silhouette,
    hemisphere_silhouette,
    make_polygon_silhouettes,
    polygon_silhouette,
)
from ..geometry.spherical_curves import (
    Circles,
    GreatCircleArcs,
    HalfSpaces,
    Intervals,
    arcs_inside_cones,
    arcs_inside_outline,
    boundary_integral,
    circles_inside_cones,
    circles_outside_half_spaces,
    complement_intervals,
    complement_on_circle,
    make_antiderivative,
    make_circles,
)
from ..numerics.arrays import Array, Ints
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot

__all__ = ["HEMISPHERE_ROUNDING", "visible_boundaries", "visible_factor"]


CROSSING_CIRCLES = 12
"""Number of circles from which only the pairs of them that cross are integrated. Measured: below
it the pairs are found in no less time than they take."""
CROSSING_POLYGONS = 24
"""Number of polygons from which only those that come near each other are compared. Measured: below
it the pairs are found in no less time than they take."""
NEAR_POLYGON_PAIRS = 8
"""Number of pairs of polygons and edges that are looked at, for one whose arcs are computed: about
as many as in scattered triangles."""
HEMISPHERE_ROUNDING = 2.0**-40
"""Largest factor of a hemisphere that counts as wholly occluded, in sr: 3e-13 of an open one. It is
thousands of times the rounding error of what polygons around a point leave open."""
BLOCK_PAIRS = 1 << 20
"""Number of pairs of outlines, all points together, evaluated at a time, which bounds memory."""
FEW_EDGES = 4
"""Number of edges of a light up to which its own do not bound the size of blocks."""
BLOCK_POINTS = 32_768
"""Number of points evaluated at a time, which bounds memory. Measured: blocks that fit the cache
make threads wait for each other."""


@dataclass(frozen=True)
class _Silhouettes:
    """A light's outline, circles and polygons that occlude it, and normals, at n points.

    profile : the light's radiance over its outline; None where it is uniform.
    cones : elliptic cones that occlude it, if there are any or the light is elliptic: then all
        circles are among them.
    """

    normal: Array
    light: LightSilhouette
    circles: Circles
    polygons: PolygonSilhouettes | None
    profile: ProfileAtPoints | None = None
    cones: EllipticCones | None = None


def visible_factor(
    light: OpenSilhouette,
    normal: Array,
    spheres: tuple[Array, Array],
    polygons: Array,
    profile: AxialProfile | None = None,
    ellipses: EllipticCones | None = None,
) -> Array:
    """Integral of max(0, n.w) over the directions in which a light is visible.

    Parameters
    ----------
    light : the light's silhouette, such as a quad's corners in order, from the points, in metres.
    normal : (3, n) unit vectors.
    spheres : (k, 3, n) and (k, n) metres, centres from the points, and radii; the points lie
        outside, the spheres between points and light.
    polygons : (m, j, 3, n) metres, corners in order of convex polygons between points and light;
        a corner may be repeated.
    profile : of a round or flat light, the relative radiance by which directions count; None for
        1. Its error is that of a quadrature: see `ProfileAtPoints`.
    ellipses : (e, n) further occluders, as elliptic cones; None for none. Neither they nor lights
        with an elliptic silhouette have a profile.

    Returns
    -------
    (n,) in sr, at least 0, bitwise independent of the rest of the batch. Source: see
    `spherical_curves`. Error of an open light: 32 u (|a| + |b|) / h sr, half edges a, b and h as
    for `form_factor.parallelogram_factor`, and 32 u sin t for a round one of half angle t,
    u = 2^-53. If it is partly occluded, the visible and the occluded part sum to it to
    64 u (|a| + |b|) / d sr. Coincident thin quads may count as distinct: their length over their
    width, as seen, times 64 u sr. Measured, relative to the unoccluded factor (or 1e-5 sr where
    that is less): at most 1.3e-12 over 11,800 random cases of quads with half edges of 0.2 to 1 at
    distances of about 2.5, and round lights with half angles of 0.05 to 1.3 rad; 3e-10 for squares
    about 1e-6 rad wide. Arcs of elliptic outlines are off by at most 64 u sr each.

    Occluders that intersect the light's surface must be passed as polygons clipped by the caller.
    """
    if profile is not None:
        assert ellipses is None, "elliptic outlines of lights with a profile have no closed form"
        return _profiled_factor(light, normal, spheres, polygons, profile)
    return _factor_in_blocks(light, normal, spheres, polygons, None, ellipses)


def _profiled_factor(
    light: OpenSilhouette,
    normal: Array,
    spheres: tuple[Array, Array],
    polygons: Array,
    profile: AxialProfile,
) -> Array:
    """`visible_factor` of a light with a profile: by quadrature only where that varies."""
    axis, half = _enclosing_cone(light)
    level, varies = profile.at(axis, half)
    total = np.zeros(level.size)
    for chosen, some in ((varies, profile), (~varies & (level > 0.0), None)):
        rows = chosen.nonzero()[0]
        if not rows.size:
            continue
        own, n = _take_silhouette(light, rows), columns(normal, rows)
        seen = None
        if some is not None:
            seen = ProfileAtPoints.make(some, columns(axis, rows), half[rows], n)
        round_ = columns(spheres[0], rows, -1), columns(spheres[1], rows, -1)
        part = _factor_in_blocks(own, n, round_, columns(polygons, rows, -1), seen)
        total[rows] = part if seen is not None else level[rows] * part
    return total


def _enclosing_cone(light: OpenSilhouette) -> tuple[Array, Array]:
    """Axes (3, n), unit, and half angles (n,) in radians of cones that hold a light."""
    assert not isinstance(light, Hemisphere | EllipticSilhouette), "such lights have no profile"
    if isinstance(light, CircularSilhouette):
        return light.axis, np.arctan2(light.sine, light.cosine)
    ways = [corner / np.maximum(np.sqrt(dot(corner, corner)), TINY) for corner in light]
    middle = np.sum(ways, axis=0)
    axis = middle / np.maximum(np.sqrt(dot(middle, middle)), TINY)
    least = np.minimum.reduce([dot(axis, way) for way in ways])
    return axis, np.arccos(np.clip(least, -1.0, 1.0))


def _factor_in_blocks(
    light: OpenSilhouette,
    normal: Array,
    spheres: tuple[Array, Array],
    polygons: Array,
    profile: ProfileAtPoints | None,
    ellipses: EllipticCones | None = None,
) -> Array:
    """`visible_factor` by blocks of points."""
    total = np.zeros(normal.shape[1])
    more = 0 if ellipses is None else ellipses.a.shape[0]
    for rows in _blocks(light, normal.shape[1], spheres[0].shape[0] + more, polygons):
        part = _take_silhouette(light, rows)
        v, radius = columns(spheres[0], rows, -1), columns(spheres[1], rows, -1)
        seen = None if profile is None else profile.take(rows)
        own = None if ellipses is None else ellipses.take(rows)
        total[rows] = _block_factor(
            part, columns(normal, rows), v, radius, columns(polygons, rows, -1), seen, own
        )
    return total


def _blocks(light: OpenSilhouette, count: int, k: int, polygons: Array) -> Iterator[slice]:
    """Yield blocks of `count` points whose pairs of `k` circles and of polygons fit memory."""
    m, j = polygons.shape[:2]
    pairs = max(1, (k + m) * (k + m * j))
    if m >= CROSSING_POLYGONS:
        # of the pairs of polygons most are only looked at
        pairs = max(1, (k + m) * k + m * m * j // NEAR_POLYGON_PAIRS)
    if isinstance(light, np.ndarray) and light.shape[0] > FEW_EDGES:
        pairs = max(pairs, light.shape[0] * (1 + k + m))
    step = max(1, min(BLOCK_POINTS, BLOCK_PAIRS // pairs))
    for first in range(0, count, step):
        yield slice(first, min(first + step, count))


def visible_boundaries(
    normal: Array, spheres: tuple[Array, Array], polygons: Array
) -> Iterator[tuple[slice, BoundaryArcs]]:
    """Yield blocks of points, and the boundaries of what they see of the hemispheres above them.

    Parameters as for `visible_factor`. The arcs count their points from the first of the block.
    """
    light = Hemisphere()
    for rows in _blocks(light, normal.shape[1], spheres[0].shape[0], polygons):
        v, radius = columns(spheres[0], rows, -1), columns(spheres[1], rows, -1)
        part = columns(polygons, rows, -1)
        yield (
            rows,
            _boundary(_make_silhouettes(light, columns(normal, rows), v, radius, part, True)),
        )


def _boundary(outlines: _Silhouettes) -> BoundaryArcs:
    """Return all visible arcs of the horizons, and of the occluders' outlines."""
    edges, circles, polygons = outlines.light.edges, outlines.circles, outlines.polygons
    near = polygons is not None and _compares_near_polygons(outlines, polygons)
    reach = outlines.light.reach
    if polygons is not None and near:
        hidden = _hidden_by_round(outlines, edges)
        found = [arcs_of_curve(edges, *open_arcs(edges, polygons, hidden, reach), 1.0)]
    else:
        found = [_arcs_of_spans(edges, _unoccluded_intervals(outlines, edges, None), 1.0)]
    if circles.sine.shape[0] >= CROSSING_CIRCLES:
        spans = _circles_behind_polygons(outlines, circles)
        open_ = open_circles(circles, *_off_the_light(outlines), spans)
        found.append(arcs_of_curve(circles, *open_, -1.0))
    elif circles.sine.shape[0]:
        found.append(_arcs_of_spans(circles, _visible_sphere_silhouettes(outlines), -1.0))
    if polygons is not None:
        segments, base = polygons.segments, _edges_on_the_light(outlines, polygons)
        if near:
            hidden = _hidden_by_round(outlines, segments)
            parts = open_edges(polygons, base, hidden, reach)
            found.append(arcs_of_curve(segments, *parts, -1.0))
        else:
            spans = _unoccluded_intervals(outlines, segments, base)
            found.append(_arcs_of_spans(segments, spans, -1.0))
    return BoundaryArcs.join(found)


def _arcs_of_spans(curve: Circles | GreatCircleArcs, spans: Intervals, sign: float) -> BoundaryArcs:
    """Return the intervals (j, k, n) of curves (k, n) that are not empty."""
    low, high = np.broadcast_arrays(*spans)
    index = (high > low).ravel().nonzero()[0]
    ring = index % low[0].size
    return arcs_of_curve(curve, ring, low.ravel()[index], high.ravel()[index], sign)


def _take_silhouette(light: OpenSilhouette, rows: slice | Ints) -> OpenSilhouette:
    """Return the light of some of the points."""
    if isinstance(light, Hemisphere):
        return light
    if isinstance(light, CircularSilhouette):
        return CircularSilhouette(columns(light.axis, rows), light.cosine[rows], light.sine[rows])
    if isinstance(light, EllipticSilhouette):
        return EllipticSilhouette(light.cones.take(rows))
    return columns(light, rows, -1)


def _block_factor(
    light: OpenSilhouette,
    normal: Array,
    v: Array,
    radius: Array,
    polygons: Array,
    profile: ProfileAtPoints | None,
    ellipses: EllipticCones | None,
) -> Array:
    """The factor, separately for points with the light cut by the horizon and wholly above it."""
    total = np.zeros(normal.shape[1])
    if isinstance(light, Hemisphere):
        low, high = np.zeros((2, normal.shape[1]))
    elif isinstance(light, CircularSilhouette):
        height = dot(normal, light.axis)
        low, high = height - light.sine, height + light.sine
    elif isinstance(light, EllipticSilhouette):
        low, high = cone_heights(normal, light.cones)
    else:
        heights = [dot(normal, corner) for corner in light]
        low, high = np.minimum.reduce(heights), np.maximum.reduce(heights)
    for cut, chosen in ((False, low >= 0.0), (True, (low < 0.0) & (high > 0.0))):
        rows: slice | Ints = slice(None) if chosen.all() else chosen.nonzero()[0]
        n = columns(normal, rows)
        if n.shape[1]:
            outline = _take_silhouette(light, rows)
            outlines = _make_silhouettes(
                outline,
                n,
                columns(v, rows, -1),
                columns(radius, rows, -1),
                columns(polygons, rows, -1),
                cut,
                None if ellipses is None else ellipses.take(rows),
            )
            if profile is not None:
                outlines = replace(outlines, profile=profile.take(rows))
            total[rows] = _integrate(outlines)
    if isinstance(light, Hemisphere):
        total[total < HEMISPHERE_ROUNDING] = 0.0
    return total


def _make_silhouettes(
    light: OpenSilhouette,
    normal: Array,
    v: Array,
    radius: Array,
    polygons: Array,
    cut: bool,
    ellipses: EllipticCones | None = None,
) -> _Silhouettes:
    """Return the outlines of the light and its occluders; arguments as for `visible_factor`.

    cut : whether the horizon cuts the light for all points, or for none.
    """
    if isinstance(light, Hemisphere):
        outline = hemisphere_silhouette(normal)
    elif isinstance(light, CircularSilhouette):
        outline = circular_silhouette(light, normal, cut)
    elif isinstance(light, EllipticSilhouette):
        outline = elliptic_silhouette(light.cones, normal, cut)
    else:
        outline = polygon_silhouette(light, normal, cut)
    place = v.swapaxes(0, 1)
    length = np.sqrt(dot(place, place))
    sine = radius / length
    cosine = np.sqrt(np.maximum((length - radius) * (length + radius), 0.0)) / length
    circles = make_circles(place / length, sine, cosine, outline.center)
    flat = make_polygon_silhouettes(polygons, outline.center) if polygons.shape[0] else None
    if ellipses is None and outline.ellipse is None:
        return _Silhouettes(normal, outline, circles, flat)
    cones = cones_of_circles(circles)
    cones = cones if ellipses is None else ellipses.joined(cones)
    if outline.cone is not None:
        outline = replace(outline, cone=None, ellipse=cones_of_circles(outline.cone))
    circles = _take_circles(circles, np.arange(0))
    return _Silhouettes(normal, outline, circles, flat, cones=cones)


def _integrate(outlines: _Silhouettes) -> Array:
    """Sum the boundary integrals of all visible arcs of the light and of its occluders: (n,)."""
    edges, cone = outlines.light.edges, outlines.light.cone
    double = np.zeros(outlines.normal.shape[1])
    if edges.half_angle.shape[0]:
        double += _integral_along_edges(outlines, edges)
    if cone is not None:
        double += _integral_along(outlines, cone, _visible_light_silhouette(outlines, cone))
    if outlines.circles.sine.shape[0]:
        double -= _integral_along_spheres(outlines)
    if outlines.cones is not None:
        double += _integral_along_cones(outlines, outlines.cones)
    if outlines.polygons is not None:
        double -= _integral_along_polygons(outlines, outlines.polygons)
    return np.maximum(0.5 * double, 0.0)


def _integral_along_cones(outlines: _Silhouettes, cones: EllipticCones) -> Array:
    """Integral of n.(w x dw) along an elliptic light, less that along elliptic occluders: (n,)."""
    light, n = outlines.light, outlines.normal.shape[1]
    k = cones.a.shape[0]
    if light.ellipse is not None:
        cones = cones.joined(light.ellipse)
    aside = elliptic_cones_outside_half_spaces(cones, light.bounds.planes)
    spans = _behind_polygons(
        outlines, lambda planes: elliptic_cones_outside_half_spaces(cones, planes)
    )
    ring, low, high = open_cones(cones, light.ellipse is not None, *aside, spans)
    part = cone_antiderivative(outlines.normal, light.center, cones).take(ring)
    value = cone_boundary_values(part, high) - cone_boundary_values(part, low)
    # in the order of the cones, whatever other points there are
    total = np.zeros(n)
    total += np.bincount(ring % n, weights=np.where(ring < k * n, -value, value), minlength=n)
    return total


def _integral_along(
    outlines: _Silhouettes, curve: Circles | GreatCircleArcs, spans: Intervals
) -> Array:
    """Integral of n.(w x dw) along intervals of a curve: (n,), twice its part of the factor."""
    plain = boundary_integral(
        make_antiderivative(outlines.normal, outlines.light.center, curve), spans
    )
    profile = outlines.profile
    if profile is None:
        return plain
    more: Array = profile.level * plain + 2.0 * profile.integral_along(curve, spans)
    return more


def _unoccluded_intervals(
    outlines: _Silhouettes, segments: GreatCircleArcs, base: Intervals | None
) -> Intervals:
    """Intervals of arcs that no occluder covers.

    base : intervals within which arcs of the occluding polygons themselves are to lie; None for
        the whole arcs of the light.
    """
    low, high = (-segments.half_angle, segments.half_angle) if base is None else base
    starts, ends = [], []
    if outlines.circles.sine.shape[0]:
        start, end = arcs_inside_cones(segments, outlines.circles)
        starts.append(start)
        ends.append(end)
    if outlines.cones is not None:
        start, end = arcs_inside_elliptic_cones(segments, outlines.cones)
        starts.append(start)
        ends.append(end)
    if outlines.polygons is not None:
        for i in range(outlines.polygons.edge_on.shape[0]):
            start, end = _arcs_behind_polygon(
                outlines, outlines.polygons, i, segments, base is not None
            )
            starts.append(start[None])
            ends.append(end[None])
    if not starts:
        return low[None], high[None]
    return complement_intervals(low, high, (np.concatenate(starts), np.concatenate(ends)))


def _arcs_behind_polygon(
    outlines: _Silhouettes,
    polygons: PolygonSilhouettes,
    i: int,
    segments: GreatCircleArcs,
    own: bool,
) -> Intervals:
    """Intervals (j, n) of arcs that run behind polygon i.

    own : whether the arcs are the edges of `polygons` themselves, so that i's own are left out.
    """
    start, end = np.zeros_like(segments.half_angle), np.zeros_like(segments.half_angle)
    rows, count = polygons.edge_rows(i), segments.half_angle.shape[0]
    parts = (slice(0, rows.start), slice(rows.stop, count)) if own else (slice(0, count),)
    for part in parts:
        if part.start == part.stop:
            continue
        # of coincident edges with equal directions, the first polygon's is the outer one
        alike = np.full((part.stop - part.start, 1), not own or part.start > 0)
        outline = polygons.segments.take(rows)
        low, high = arcs_inside_outline(segments.take(part), outline, alike, outlines.light.reach)
        start[part] = low
        end[part] = np.where(polygons.edge_on[i], low, np.maximum(high, low))
    return start, end


def _integral_along_spheres(outlines: _Silhouettes) -> Array:
    """Integral of n.(w x dw) along the outlines of spheres that are visible on the light: (n,)."""
    circles = outlines.circles
    if circles.sine.shape[0] < CROSSING_CIRCLES or outlines.profile is not None:
        return _integral_along(outlines, circles, _visible_sphere_silhouettes(outlines))
    spans = _circles_behind_polygons(outlines, circles)
    potential = make_antiderivative(outlines.normal, outlines.light.center, circles)
    return open_circles_integral(circles, *_off_the_light(outlines), spans, potential)


def _visible_sphere_silhouettes(outlines: _Silhouettes) -> Intervals:
    """Intervals of the outlines of spheres that lie on the light and behind no other occluder."""
    circles = outlines.circles
    k = circles.sine.shape[0]
    center, half = _off_the_light(outlines)
    centers, halves = [center], [half]
    if k > 1:
        mine = np.tile(np.arange(k), (k - 1, 1))
        other = (mine + np.arange(1, k)[:, None]) % k
        wins = np.where(other < mine, 1.0, -1.0)[..., None]
        center, half, _ = circles_inside_cones(
            _take_circles(circles, mine), _take_circles(circles, other), wins
        )
        centers.append(center)
        halves.append(half)
    spans = _circles_behind_polygons(outlines, circles)
    return complement_on_circle(np.concatenate(centers), np.concatenate(halves), spans)


def _off_the_light(outlines: _Silhouettes) -> Intervals:
    """Where the outlines of spheres leave the light: centres and half widths (j, k, n), radians."""
    circles = outlines.circles
    center, half = circles_outside_half_spaces(circles, outlines.light.bounds.planes)
    if outlines.light.cone is None:
        return center, half
    wins = -np.ones((circles.sine.shape[0], 1))
    aside, _, width = circles_inside_cones(circles, outlines.light.cone, wins)
    return np.concatenate([center, (aside + np.pi)[None]]), np.concatenate([half, width[None]])


def _visible_light_silhouette(outlines: _Silhouettes, cone: Circles) -> Intervals:
    """Intervals of a round light's own outline that are above the horizon and not occluded."""
    circles = outlines.circles
    center, half = circles_outside_half_spaces(cone, outlines.light.edges.planes)
    if circles.sine.shape[0]:
        k = circles.sine.shape[0]
        repeated = _take_circles(cone, np.zeros(k, dtype=np.int64))
        inside, width, _ = circles_inside_cones(repeated, circles, np.ones((k, 1)))
        center = np.concatenate([center, inside[:, None]])
        half = np.concatenate([half, width[:, None]])
    if not center.shape[0]:
        center = half = np.zeros((1, *cone.sine.shape))
    return complement_on_circle(center, half, _circles_behind_polygons(outlines, cone))


def _circles_behind_polygons(outlines: _Silhouettes, circles: Circles) -> Intervals | None:
    """Intervals (i, k, n) of circles behind polygons, for each polygon one more than its edges."""
    return _behind_polygons(outlines, lambda planes: circles_outside_half_spaces(circles, planes))


def _behind_polygons(
    outlines: _Silhouettes, outside: Callable[[HalfSpaces], Intervals]
) -> Intervals | None:
    """Intervals (i, k, n) of curves behind polygons, from those `outside` of half-spaces."""
    if outlines.polygons is None:
        return None
    starts, ends = [], []
    for i in range(outlines.polygons.edge_on.shape[0]):
        rows = outlines.polygons.edge_rows(i)
        low, high = complement_on_circle(*outside(outlines.polygons.segments.take(rows).planes))
        starts.append(low)
        ends.append(np.where(outlines.polygons.edge_on[i], low, high))
    return np.concatenate(starts), np.concatenate(ends)


def _integral_along_edges(outlines: _Silhouettes, edges: GreatCircleArcs) -> Array:
    """Integral of n.(w x dw) along the visible parts of a light's edges: (n,)."""
    polygons = outlines.polygons
    if polygons is None or not _compares_near_polygons(outlines, polygons):
        return _integral_along(outlines, edges, _unoccluded_intervals(outlines, edges, None))
    hidden = _hidden_by_round(outlines, edges)
    potential = make_antiderivative(outlines.normal, outlines.light.center, edges)
    return open_arcs_integral(edges, polygons, hidden, outlines.light.reach, potential)


def _hidden_by_round(outlines: _Silhouettes, arcs: GreatCircleArcs) -> Intervals | None:
    """Intervals (k, j, n) of arcs that lie behind circles or elliptic cones; None without any."""
    if outlines.cones is not None:
        return arcs_inside_elliptic_cones(arcs, outlines.cones)
    if not outlines.circles.sine.shape[0]:
        return None
    return arcs_inside_cones(arcs, outlines.circles)


def _compares_near_polygons(outlines: _Silhouettes, polygons: PolygonSilhouettes) -> bool:
    """Whether there are so many polygons that pairs of them are found before their arcs."""
    return polygons.edge_on.shape[0] >= CROSSING_POLYGONS and outlines.profile is None


def _integral_along_polygons(outlines: _Silhouettes, polygons: PolygonSilhouettes) -> Array:
    """Integral of n.(w x dw) along the visible edges of occluding polygons: (n,)."""
    segments, base = polygons.segments, _edges_on_the_light(outlines, polygons)
    if not _compares_near_polygons(outlines, polygons):
        return _integral_along(outlines, segments, _unoccluded_intervals(outlines, segments, base))
    hidden = _hidden_by_round(outlines, segments)
    potential = make_antiderivative(outlines.normal, outlines.light.center, segments)
    return open_edges_integral(polygons, base, hidden, outlines.light.reach, potential)


def _edges_on_the_light(outlines: _Silhouettes, polygons: PolygonSilhouettes) -> Intervals:
    """Intervals (j, n) of the edges of polygons that lie on the light, none of those edge-on."""
    segments = polygons.segments
    half = segments.half_angle
    along = np.zeros((half.shape[0], 1), dtype=np.bool_)
    low, high = arcs_inside_outline(segments, outlines.light.bounds, along, outlines.light.reach)
    if outlines.light.cone is not None:
        start, end = arcs_inside_cones(segments, outlines.light.cone)
        low, high = np.maximum(low, start[0]), np.minimum(high, end[0])
    if outlines.light.ellipse is not None:
        start, end = arcs_inside_elliptic_cones(segments, outlines.light.ellipse)
        low, high = np.maximum(low, start[0]), np.minimum(high, end[0])
    low, high = np.clip(low, -half, half), np.clip(high, -half, half)
    high = np.maximum(low, high)
    flat = np.repeat(polygons.edge_on, half.shape[0] // polygons.edge_on.shape[0], axis=0)
    return low, np.where(flat, low, high)


def _take_circles(circles: Circles, index: Ints) -> Circles:
    """Return the circles selected by `index`."""
    rows = (circles.axis, circles.u, circles.w)
    axis, u, w = (row[:, index] for row in rows)
    return Circles(axis, u, w, circles.sine[index], circles.cosine[index], circles.versine[index])
