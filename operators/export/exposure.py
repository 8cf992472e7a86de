# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' Exposure of the film: a factor on the picture, and so on all light in the scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ...adaptive_drt.scene import Light, PointLight, Vector
from .checklist import cycles_of


def exposure_of(scene: Any) -> float:
    """Return the factor of an evaluated scene; 1 where Cycles, its add-on, is off."""
    return float(getattr(cycles_of(scene), "film_exposure", 1.0))


def exposed_light(light: Light, factor: float) -> Light:
    """Return a light that shines so many times as bright."""
    if isinstance(light, PointLight):
        return replace(light, intensity=exposed(light.intensity, factor))
    return replace(light, radiance=exposed(light.radiance, factor))


def exposed(color: Vector, factor: float) -> Vector:
    """Return a colour so many times as bright."""
    r, g, b = color
    return (r * factor, g * factor, b * factor)
