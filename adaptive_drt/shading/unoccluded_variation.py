# SPDX-License-Identifier: GPL-3.0-or-later
"""How far one sample of light may be from its mean over a patch where no occluder hides it.

What changes there is the distance to the light, the turn of the surface, and what passes through
a plane: the light through the surface's horizon, the patch through the plane of a quad light.
Estimates by kind and by axis, as in `variation`.
"""

from __future__ import annotations

import numpy as np

from ..lights.emitter import POINT, QUAD, Emitter
from ..numerics.arrays import Array, Ints
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..tracing.intersect import Surface
from ..visibility.line_intervals import TIME
from .footprint import Patch
from .silhouette_rates import half_angle
from .variation import BENDS, KINKS, ROOTS, no_variation

__all__ = ["open_variation"]


NEAR = 0.8
"""Irradiance over the half extent in units of the distance to the light: the factor of its square
(second derivatives of cos / d^2 are at most some 3 to 6 in that unit, over 6)."""
STEEP, PEAKED = 0.3, 1.0
"""Half a patch's extent over the distance to the light: from where on stars leave as much of how
light falls off as of a power of 3/2, and as of a kink: its peak is hardly wider than the patch.
(Point lights over planes, 40,000 random patches, RMS: of what is foreseen of a square they leave
0.002 at 0.15, 0.017 at 0.35, 0.05 at 0.6, 0.09 at 0.85 and 0.13 at 1.2.)"""
NEAREST = 0.3
"""Of the distance to such a light: how near it may be elsewhere in the patch, at least. (Without
that one patch in a hundred was off by 28 times what was foreseen, with it by 3.)"""
ROUND = 1.0 / 6.0
"""The same for the turn of the normal over the half extent."""
SET = 1.0 / 12.0
"""Where a light goes down behind the surface's own horizon: of the square of the turn over the
light's half angle (the slope then changes over twice that angle), or of the turn of a kink."""
RIM = 0.3
"""Half a patch's extent over twice its distance from the rim of a sphere (0.5: it reaches the
rim): from there on the root with which the surface turns is no parabola. Of the centroid's
deviation a star leaves 0.04 at 0.25 and 0.18 at 0.5, and less with the gains of `limb_correction`:
as of a power of 3/2."""


def open_variation(
    light: Emitter, center: Array, surface: Surface, patch: Patch, factor: Array
) -> Array:
    """Of a light that nothing hides but the surface's own horizon: deviations (4, 3, n).

    Parameters
    ----------
    center : (3, n) or (3, 1) the light's centre.  factor : (n,) unblocked, of `irradiance_factor`.
    """
    to = center - surface.point
    square = np.maximum(dot(to, to), TINY)
    distance = np.sqrt(square)
    half = half_angle(light, distance)
    head_on = _head_on(light, square, half)
    most = head_on
    if light.kind == QUAD:
        facing = np.maximum(-dot(light.normal, to), 0.0) / distance
        most = np.minimum(head_on * facing, np.pi)
    result = no_variation(factor.size)
    clear = np.maximum(distance - light.radius, 0.25 * distance)
    moves, turns = np.zeros((3, factor.size)), np.zeros((3, factor.size))
    for axis in patch.axes:
        step = patch.steps[axis]
        if axis == TIME and light.displacement is not None:
            step = step - light.displacement * patch.time
        moves[axis] = np.sqrt(dot(step, step)) / clear
        turns[axis] = patch.slides[axis] * patch.bend
    bent, turns = turns, turns + moves
    sine = dot(surface.normal, to) / distance
    risen = sine > -(np.sqrt(dot(turns, turns)) + np.sin(half))
    near = np.sqrt(dot(moves, moves)) * clear / distance
    _add_falloff(result, factor * NEAR * moves**2, near, sine)
    result[BENDS] += np.where(risen, most * ROUND, 0.0) * np.minimum(bent * bent, 1.0)
    rows = (risen & (patch.bend > 0.0)).nonzero()[0]
    _add_rim(result, rows, patch, to, surface, most, bent)
    _add_setting(result, sine, half, most, turns)
    if light.kind == QUAD:
        lean = -dot(light.normal, to) / distance
        _add_setting(result, lean, np.zeros_like(half), np.minimum(head_on, np.pi), moves)
    return result


def _head_on(light: Emitter, square: Array, half: Array) -> Array:
    """The factor (n,) of a light that faces the point at normal incidence, roughly."""
    if light.kind == POINT:
        most: Array = 1.0 / square
        return most
    if light.kind == QUAD:
        u, v = light.half_u, light.half_v
        most = 4.0 * float(np.sqrt(dot(u, u) * dot(v, v))[0]) / square
        return most
    most = np.pi * np.sin(half) ** 2
    return most


def _add_falloff(result: Array, size: Array, near: Array, sine: Array) -> None:
    """Add what a light's falling off brings about, in place.

    Parameters
    ----------
    size : (3, n) by the light at the centroids.  near : (n,) half the patch's extent over the
        light's distance.  sine : (n,) of its height over the plane.
    """
    steep = near >= STEEP
    if not steep.any():
        result[BENDS] += size
        return
    # its peak may be in the patch: no nearer than it is above the plane
    least = np.maximum(np.maximum(np.abs(sine), 1.0 - near), NEAREST)
    size = np.where(steep, size / (least * least), size)
    peaked = near >= PEAKED
    result[BENDS] += np.where(steep, 0.0, size)
    result[ROOTS] += np.where(steep & ~peaked, size, 0.0)
    result[KINKS] += np.where(peaked, size, 0.0)


def _add_rim(
    result: Array, rows: Ints, patch: Patch, to: Array, surface: Surface, most: Array, bent: Array
) -> None:
    """Add what spheres' ever faster turn at their rims brings about, at some points, in place."""
    if not rows.size:
        return
    to, view, slant = columns(to, rows), columns(surface.point, rows), patch.slant[rows]
    # there the normal turns to the viewer, or from him
    toward = np.abs(dot(to, view)) / np.maximum(np.sqrt(dot(to, to) * dot(view, view)), TINY)
    slope = np.sqrt(np.maximum(1.0 - slant**2, 0.0)) * patch.bend[rows] / slant**2
    near = np.minimum(columns(patch.cross, rows) * slope, 1.0)
    size = most[rows] * toward * ROUND * np.minimum(columns(bent, rows) * near, 1.0)
    result[BENDS][:, rows] += np.where(near < RIM, size, 0.0)
    result[ROOTS][:, rows] += np.where(near >= RIM, size, 0.0)


def _add_setting(result: Array, sine: Array, half: Array, most: Array, turns: Array) -> None:
    """Add what a light brings about that passes through a plane, in place.

    Parameters
    ----------
    sine : (n,) of its height over the plane.  half : (n,) half its angle.  most : (n,) its factor.
    turns : (3, n) radians that it moves against the plane over the half extents.
    """
    turn = np.sqrt(dot(turns, turns))
    rows = ((np.abs(sine) < turn + np.sin(half)) & (most > 0.0)).nonzero()[0]
    if not rows.size:
        return
    size = SET * most[rows] / np.maximum(turn[rows] + half[rows], TINY) * columns(turns, rows) ** 2
    sharp = turn[rows] > half[rows]
    result[BENDS][:, rows] += np.where(sharp, 0.0, size)
    result[KINKS][:, rows] += np.where(sharp, size, 0.0)
