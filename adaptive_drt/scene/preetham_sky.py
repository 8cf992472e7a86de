# SPDX-License-Identifier: GPL-3.0-or-later
"""The clear sky of Preetham, Shirley and Smits 1999, "A practical analytic model for daylight"."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .values import Vector

__all__ = ["preetham_radiance"]

Array = NDArray[np.float64]

PEREZ = {
    "Y": ((0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771),
          (-0.0670, 0.3703)),
    "x": ((-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989),
          (-0.0033, 0.0452)),
    "y": ((-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537),
          (-0.0109, 0.0529)),
}  # fmt: skip
"""Coefficients A to E of Perez's formula, linear in the turbidity: slope and constant (appendix A.2
of the paper)."""
ZENITH = {
    "x": ((0.00166, -0.00375, 0.00209, 0.0), (-0.02903, 0.06377, -0.03202, 0.00394),
          (0.11693, -0.21196, 0.06052, 0.25886)),
    "y": ((0.00275, -0.00610, 0.00317, 0.0), (-0.04214, 0.08970, -0.04153, 0.00516),
          (0.15346, -0.26756, 0.06670, 0.26688)),
}  # fmt: skip
"""Chromaticity of the zenith: coefficients of T^2, T and 1, each a cubic of the sun's angle."""
LUMINANCE_SCALE = 0.06
"""Factor on the paper's kcd / m^2 by which Blender shows this sky. Measured."""
LOWEST = 0.5 * np.pi - 0.001
"""Largest angle from the zenith, in radians: what is below the horizon is as bright as that."""
RGB_OF_XYZ = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)
"""Linear Rec. 709 of CIE XYZ (IEC 61966-2-1)."""


def preetham_radiance(way: Array, sun: Vector, turbidity: float) -> Array:
    """Return the radiance (..., 3) in unit directions (..., 3), as Blender scales it.

    sun : direction to the sun, of any length.
    """
    toward = np.array(sun) / np.linalg.norm(sun)
    zenith = float(np.arccos(np.clip(toward[2], -1.0, 1.0)))
    theta = np.minimum(np.arccos(np.clip(way[..., 2], -1.0, 1.0)), LOWEST)
    gamma = np.arccos(np.clip(way @ toward, -1.0, 1.0))
    powers = np.array([zenith**3, zenith**2, zenith, 1.0])
    square = np.array([turbidity * turbidity, turbidity, 1.0])
    angle = (4.0 / 9.0 - turbidity / 120.0) * (np.pi - 2.0 * zenith)
    top = {name: float(square @ (np.array(rows) @ powers)) for name, rows in ZENITH.items()}
    bright = (4.0453 * turbidity - 4.9710) * np.tan(angle) - 0.2155 * turbidity + 2.4192
    top["Y"] = LUMINANCE_SCALE * float(bright)
    found = {}
    for name, rows in PEREZ.items():
        terms = [slope * turbidity + constant for slope, constant in rows]
        found[name] = top[name] * _perez(terms, theta, gamma) / _perez(terms, 0.0, zenith)
    x, y, height = found["x"], found["y"], found["Y"]
    xyz = np.stack([x / y * height, height, (1.0 - x - y) / y * height], axis=-1)
    radiance: Array = np.maximum(xyz @ RGB_OF_XYZ.T, 0.0)
    return radiance


def _perez(terms: list[float], theta: Array | float, gamma: Array | float) -> Array:
    """Perez's formula, relative."""
    a, b, c, d, e = terms
    value: Array = (1.0 + a * np.exp(b / np.cos(theta))) * (
        1.0 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2
    )
    return value
