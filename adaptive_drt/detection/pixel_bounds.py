# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch of surface that a pixel shows, as a parallelogram about its centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from ..tracing.compile import Plan
from ..tracing.intersect import Surface, curvature
from .edges import half_pixel

__all__ = ["Footprint", "make_footprint"]


FLATTEST = 0.25
"""Of a sphere's radius and the cosine it is seen at: a patch up to so wide is nearly a plane's."""


APART_ROUNDING = 2.0**-40
"""Relative: rounding of a distance from a parallelogram, counted generously."""


@dataclass(frozen=True)
class Footprint:
    """The pixels' patches of surface as parallelograms about their centres.

    Attributes
    ----------
    steps : two (3, n) metres, from the centre to the middles of two sides.
    off : (n,) metres, how far the surface may lie from it; inf where it is no parallelogram.
    """

    steps: tuple[Array, Array]
    off: Array

    def change(self, slope: Array, at: Ints) -> Array:
        """How far a linear function of the place, of slope (3, m), goes either way: (m,)."""
        along = np.abs(dot(columns(self.steps[0], at), slope)) + np.abs(
            dot(columns(self.steps[1], at), slope)
        )
        with np.errstate(invalid="ignore"):  # a slope of 0 over a patch without bound
            wide: Array = along + self.off[at] * np.sqrt(dot(slope, slope))
        return np.where(np.isnan(wide), np.inf, wide)

    def clear_of(self, v: Array, r: Array, at: Ints) -> Mask:
        """Whether balls of radius r (m,), centres v (3, m) from those of patches, stay off them.

        Never a false yes. In the plane a parallelogram's points are no nearer than its sides'
        lines: from 1 in the coordinate along a step, in units of that step's height.
        """
        a, b = columns(self.steps[0], at), columns(self.steps[1], at)
        with np.errstate(over="ignore", invalid="ignore"):  # out of float64's range: not clear
            normal = cross(a, b)
            square = dot(normal, normal)
            flat = square > 0.0
            safe = np.where(flat, square, 1.0)
            beyond = np.zeros_like(r)
            for along, side in ((dot(cross(v, b), normal), b), (dot(cross(a, v), normal), a)):
                height = np.sqrt(safe / np.where(flat, dot(side, side), 1.0))
                beyond = np.maximum(beyond, (np.abs(along) / safe - 1.0) * height)
            away = np.hypot(dot(v, normal) / np.sqrt(safe), beyond)
        clear: Mask = flat & (away * (1.0 - APART_ROUNDING) > r + self.off[at])
        return clear


def make_footprint(plan: Plan, surface: Surface, reach: Array) -> Footprint:
    """Parallelograms that hold the patches: on a plane they are the pixels' images, and sheared.

    The hit of direction w + s lies off w's by t (s - w tau) / (1 + tau), tau = n.s / n.w. At the
    rim of a sphere, where that has no bound, a parallelogram along the ray holds the patch.

    Parameters
    ----------
    reach : (n,) of `patch_reach`: all of a patch is as near as that to its centre.
    """
    lens = plan.lens
    across = cross(lens.right, lens.up)[:, None]
    point, normal = surface.point, surface.normal
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # seen edge-on: no bound
        t = dot(point, across) / dot(lens.base[:, None], across)
        w = point / t
        facing = dot(normal, w)
        steps, spread = [], np.zeros(t.size)
        for step in (lens.right[:, None], lens.up[:, None]):
            tau = 0.5 * dot(normal, step) / facing
            spread = spread + np.abs(tau)
            steps.append(t * (0.5 * step - w * tau))
        grow = 1.0 / np.maximum(1.0 - spread, 0.0)
        wide = grow * sum(np.sqrt(dot(step, step)) for step in steps)
        # a sphere falls off its tangent plane by wide^2 / 2 r, seen aslant
        room = np.abs(facing) / np.sqrt(dot(w, w))
        off = 2.0 * wide * wide * curvature(plan, surface) / room
        off = np.where(wide * curvature(plan, surface) < FLATTEST * room, off, np.inf)
        held = np.isfinite(wide)
        off = np.where(held, off, np.inf)
        sides = [np.where(held, step * grow, 0.0) for step in steps]
    rim = (~np.isfinite(off)).nonzero()[0]
    if rim.size:
        off[rim], (sides[0][:, rim], sides[1][:, rim]) = _along_rays(
            plan, columns(point, rim), t[rim], reach[rim]
        )
    return Footprint((sides[0], sides[1]), off)


def _along_rays(
    plan: Plan, point: Array, t: Array, reach: Array
) -> tuple[Array, tuple[Array, Array]]:
    """`off` and steps of parallelograms that lie along the ray, and one side of the pixel.

    Of a hit t' (w + x right + y up), |x| and |y| at most 1/2, what t' x right + t' y up is long
    bounds how far (t' - t) w goes beyond the reach.
    """
    lens = plan.lens
    far = np.sqrt(dot(point, point))
    h = half_pixel(plan)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a hit at the camera
        length = far / t
        latest = (far + reach) / np.maximum(length - h, 0.5 * length)
        along = point * ((reach + latest * h) / far)
        off = 0.5 * latest * np.sqrt(dot(lens.up, lens.up))
        side = 0.5 * latest * lens.right[:, None]
        held = np.isfinite(off + along.sum(axis=0) + side.sum(axis=0))
    return np.where(held, off, np.inf), (np.where(held, along, 0.0), np.where(held, side, 0.0))
