# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the pixel for light: may a shadow edge sharper than a pixel cross it?

It may if one occluder can hide all of a light from one point of the pixel's footprint (the patch of
surface that it shows) and nothing from another. Shadow edges of point lights are always that sharp,
those of area lights near contact. A wide penumbra is smooth over a pixel and needs no distribution.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.receivers import Receivers
from ..geometry.shape import ShapeSet
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from ..parallel.call_progress import report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, cache_sized_chunks, receivers_of
from .pixel_footprint import make_footprint
from .separating_planes import planes_help, separated

__all__ = ["detect_shadow_edges", "detect_steep_irradiance", "patch_reach"]


def patch_reach(plan: Plan, surface: Surface, w: Array) -> Array:
    """Bound on the distance of a pixel's patch of surface from its centre: (n,) metres.

    A step of the ray's direction moves the hit by t |step| / cos, cos the least cosine within the
    pixel. Where there is no bound, the distance to the camera is returned.

    Parameters
    ----------
    surface : hits of the centre rays.  w : (3, n) their directions.
    """
    h = plan.lens.half_pixel
    length = np.sqrt(dot(w, w))
    t = np.sqrt(dot(surface.point, surface.point)) / length
    cosine = np.abs(dot(w, surface.normal)) / length
    # the direction turns by at most h / |w|
    turn = h / np.maximum(length - h, 0.5 * length)
    least = np.zeros(length.size)
    for shapes, rows, index in plan.shapes.groups(surface.item):
        least[rows] = shapes.least_cosine(
            index, cosine[rows], turn[rows], columns(surface.point, rows)
        )
    # a patch that is seen edge-on or contains the camera has no bound
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        reach = t * h * (1.0 + turn) / np.maximum(least, 0.0)
        # t is larger in the parts of the patch that are farther away
        reach = reach / np.maximum(1.0 - reach / np.maximum(t * length, TINY), 0.0)
    return np.where(np.isfinite(reach), reach, np.sqrt(dot(surface.point, surface.point)))


MAX_PATCH_TO_EDGE = 0.25
"""Largest reach of a patch, seen from a light, as a fraction of the width of the edge of the
light's profile, up to which irradiance counts as smooth there: a cubic then follows the edge to a
hundredth, and the blocks' own estimates see what it does not. Chosen, not fitted."""
MAX_PATCH_TO_DISTANCE = 0.25
"""Largest reach of a patch over which irradiance is not steep, as a fraction of its distance to the
light. Over a quarter of the distance the irradiance may change by half."""
MAX_DISTANCE_CHANGE = 0.1
"""Largest change, either way, of the distance to a light over a footprint, as a fraction of it.
On a plane irradiance falls with the cube of the distance: by 0.45 over that range."""


def detect_steep_irradiance(
    light: Emitter,
    surface: Surface,
    reach: Array,
    plan: Plan | None = None,
    time: float | None = None,
) -> Mask:
    """Find the pixels over which unoccluded irradiance is steep: (n,) bool.

    It is where the light is near, and at the edge of a spot's cone.

    Parameters
    ----------
    surface : n hits of centre rays.  reach : (n,) of `patch_reach`.
    plan : given where the patches are those of single pixels; their footprints are then used too.
    time : shutter time; None for the middle.
    """
    away, distance = light.falloff_offset(surface.point, time)
    edge = _at_profile_edge(light, surface, reach, time)
    steep: Mask = reach > MAX_PATCH_TO_DISTANCE * distance
    rows = steep.nonzero()[0]
    if plan is None or plan.settings.order == 1 or not rows.size:
        return steep | edge
    length = np.sqrt(dot(away, away))[rows]
    axis = columns(away, rows) / np.maximum(length, TINY)
    patch = make_footprint(plan, surface.take(rows), reach[rows])
    change = patch.linear_variation(axis, np.arange(rows.size))
    # bound on the second-order term of the distance; unbounded at the light
    with np.errstate(over="ignore"):
        change += reach[rows] ** 2 / (2.0 * np.maximum(length - reach[rows], TINY))
    steep[rows] = change > MAX_DISTANCE_CHANGE * length
    return steep | edge


def _at_profile_edge(light: Emitter, surface: Surface, reach: Array, time: float | None) -> Mask:
    """Where the edge of a light's profile crosses patches that are wide beside it: (n,) bool."""
    to = light.to_center(surface.point, time)
    edge = light.profile_edge(to)
    if edge is None:
        return np.zeros(reach.size, dtype=np.bool_)
    path = 2.0 * (light.swept_radius - light.radius)
    near = np.sqrt(dot(to, to)) - reach - path
    turn = np.where(near > 0.0, (reach + path) / np.where(near > 0.0, near, 1.0), np.inf)
    found: Mask = (edge.gap < turn) & (turn > MAX_PATCH_TO_EDGE * edge.width)
    return found


def detect_shadow_edges(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array
) -> Mask:
    """Find the pixels that a sharp shadow edge may cross at the middle of the shutter: (n,) bool.

    Parameters
    ----------
    surface : n hits of centre rays.  light : as it casts shadows.
    pairs : candidate occluders that hold for the whole patches.  reach : (n,) of `patch_reach`.
    """
    edge = np.zeros(surface.item.size, dtype=np.bool_)
    patch = None
    if plan.settings.order == 2 and pairs.item.size:
        patch = make_footprint(plan, surface, reach)
    order = plan.settings.order
    for shapes, all_rows, all_index in plan.shapes.groups(pairs.item):
        chunks = zip(cache_sized_chunks(all_rows), cache_sized_chunks(all_index), strict=True)
        for rows, index in chunks:
            plan.raise_if_cancelled()
            report_progress(rows[0] / pairs.item.size)
            receivers = receivers_of(surface, pairs.take(rows), reach, patch)
            sharp = shapes.casts_sharp_edge(index, light, receivers, order).nonzero()[0]
            if patch is not None and light.extended and sharp.size:
                found = _Suspects(shapes, index[sharp], light, receivers.take(sharp), order)
                sharp = sharp[found.enough_shadow_lines_cross()]
            if patch is not None and not light.extended and shapes.uneven:
                item = pairs.item[rows[sharp]]
                sharp = sharp[~_out_of_footprints(plan, item, light, receivers.take(sharp))]
            edge[pairs.pixel[rows[sharp]]] = True
    if patch is not None and not light.extended:
        some = pairs.take(edge[pairs.pixel])
        for shapes, rows, index in plan.shapes.groups(some.item):
            receivers = receivers_of(surface, some.take(rows), reach, patch)
            hidden = shapes.hides_from_footprint(index, light, receivers)
            edge[receivers.at[hidden]] = False
    return edge


def _out_of_footprints(plan: Plan, item: Ints, light: Emitter, receivers: Receivers) -> Mask:
    """Whether planes through a point light separate shapes at rest from footprints: (m,)."""
    apart = np.zeros(item.size, dtype=np.bool_)
    patch = receivers.footprint
    rows = planes_help(plan, item)
    if patch is None or not rows.size:
        return apart
    some = receivers.take(rows)
    to, thick = light.to_center(some.point), patch.thickness[some.at]
    # a light at infinity is no point that planes go through
    near = light.distance_or(np.ones(rows.size), np.zeros(rows.size)) > 0.0
    held = np.isfinite(thick)
    u, v = (np.where(held, columns(step, some.at), 0.0) for step in patch.steps)
    corners = [u + v - to, u - v - to, -u - v - to, v - u - to]
    wide = np.where(held, thick, some.reach)
    apart[rows] = near & separated(plan, item[rows], some.point + to, corners, wide)
    return apart


LIGHT_PROBES = ((0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5))
"""Points of a light, in its half extents, whose shadow lines are tested besides its centre's.
A shadow line is the edge of the shadow that the point would cast as a point light."""
MIN_PROBES_CROSSED = 2
"""Least number of probes whose shadow lines cross a patch in which the visible part of the light
changes by half. The part hidden from one place of the patch and visible from another is then a band
that holds half of the light. It contains the centre, for a half plane without it holds less, and
two of the probes, for a band with only one would be narrower than half of the light."""


ALIGNMENT_TOLERANCE = 2.0**-40
"""Largest distance from the line to a light, relative to the light's, of an occluder on it."""


@dataclass(frozen=True)
class _Suspects:
    """m shapes of one set that may cast sharp shadow edges of an area light on receivers."""

    shapes: ShapeSet
    index: Ints
    light: Emitter
    receivers: Receivers
    order: int

    def enough_shadow_lines_cross(self) -> Mask:
        """Whether the shadow lines of the light's centre and of enough probes cross patches: (m,).

        If all of a light is visible from one place of a patch and nothing of it from another, the
        shadow lines of all its points cross the patch. So no such patch is missed.
        """
        light, point = self.light, self.receivers.point
        to = light.to_center(point)
        sides = light.probe_sides
        if sides is not None:
            odd = np.zeros(self.index.size, dtype=np.bool_)
        else:
            sides, odd = self._facing_half_extents(to), self._probes_unreliable(to)
        rows = np.arange(self.index.size)
        result = self._crosses(light.as_point(), rows)
        rows = (result & ~odd).nonzero()[0]
        # all probes in one call: few pairs are left, and a call costs more than they do
        u, v = (columns(np.broadcast_to(side, point.shape), rows) for side in sides)
        probes = light.point_at(
            np.concatenate([a * u for a, _ in LIGHT_PROBES], axis=1),
            np.concatenate([b * v for _, b in LIGHT_PROBES], axis=1),
        )
        found = self._crosses(probes, np.tile(rows, len(LIGHT_PROBES)))
        result[rows] = found.reshape(len(LIGHT_PROBES), -1).sum(axis=0) >= MIN_PROBES_CROSSED
        return result | odd

    def _crosses(self, spot: Emitter, rows: Ints) -> Mask:
        """Whether the shadow lines of points of the light, one or one for each row, cross."""
        receivers = self.receivers.take(rows)
        return self.shapes.casts_sharp_edge(self.index[rows], spot, receivers, self.order)

    def _facing_half_extents(self, to: Array) -> tuple[Array, Array]:
        """Half extents (3, m) of a round light across the view: to the shape, and normal to that.

        to : (3, m) metres from the receivers' points to the light's centre.
        """
        far = np.maximum(np.sqrt(dot(to, to)), TINY)
        axis = to / far
        aside = columns(self.shapes.bounding_spheres[0], self.index) - self.receivers.point
        aside = aside - dot(aside, axis) * axis
        size = np.sqrt(dot(aside, aside))
        # if the light and the shape are seen in the same direction, any perpendicular will do
        least = np.abs(axis)
        least = least == least.min(axis=0)
        other = cross(axis, least.astype(np.float64))
        aside = np.where(size > ALIGNMENT_TOLERANCE * far, aside, other)
        first = aside * (self.light.radius / np.maximum(np.sqrt(dot(aside, aside)), TINY))
        return first, cross(axis, first)

    def _probes_unreliable(self, to: Array) -> Mask:
        """Where the probes of a round light of radius R do not prove anything: (m,).

        A probe at R / 2 is in the cone in which each place of the patch sees the light if
        R reach / d^2 <= 1. If the shape is farther than R from the light's centre, it is in front
        of both the probe and the visible points in the same direction, or of neither.
        """
        reach = self.receivers.reach
        near = np.maximum(np.sqrt(dot(to, to)) - reach, 0.0)
        odd: Mask = self.light.radius * reach > near * near
        return odd | self.shapes.may_reach_light(self.index, self.light)
