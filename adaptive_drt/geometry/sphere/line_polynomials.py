# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres seen through boxes, as polynomials."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ...numerics.arrays import Array, Ints
from ...numerics.box_polynomials import linear_coefficients, product_coefficients
from ...numerics.vector import cross, dot
from ..line_forms import BoxRays, DepthSurface
from ..quadric_lines import QuadricForms

__all__ = ["SphereForms", "sphere_forms"]


class SphereForms(QuadricForms):
    """Sphere candidates: see `QuadricForms`. Two spheres have equal depth in a plane."""

    surface: ClassVar[DepthSurface] = DepthSurface.SPHERE


def sphere_forms(
    rows: Ints, rays: BoxRays, center: Array, displacement: Array | None, radius: Array
) -> SphereForms:
    """Polynomials of spheres in boxes.

    With w x v = c + t e, the discriminant is r^2 |w|^2 - |c|^2 - 2 t c.e - t^2 |e|^2: it compares
    the radius with the distance of the closest approach, and stays accurate far away.

    Parameters
    ----------
    rows : (m,) positions among all candidates.
    center, displacement : (3, m) metres, at mid-shutter and over the shutter; None if none moves.
    radius : (m,) metres.
    """
    v, change = rays.positions(center, displacement)
    w = rays.directions
    rr = radius**2
    square = product_coefficients(w, w)
    c = (cross(w[0], v), cross(w[1], v), cross(w[2], v))
    d = [rr * square - product_coefficients(c, c)]
    center_dot = [linear_coefficients(w, v)]
    power = [(dot(v, v) - rr)[None]]
    if change is not None:
        e = (cross(w[0], change), cross(w[1], change), cross(w[2], change))
        d += [-2.0 * product_coefficients(c, e), -product_coefficients(e, e)]
        center_dot.append(linear_coefficients(w, change))
        power += [2.0 * dot(v, change)[None], dot(change, change)[None]]
    return SphereForms(rows, (np.array(d), np.array(center_dot), square[None], np.array(power)))
