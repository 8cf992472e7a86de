# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' Exposure of the film: a factor on the picture, and so on all light in the scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...adaptive_drt.scene.description import Light, Vector
from .checklist import cycles_of


def exposure_of(scene: Any) -> float:
    """Return the factor of an evaluated scene; 1 where Cycles, its add-on, is off."""
    return float(getattr(cycles_of(scene), "film_exposure", 1.0))


def exposed(
    lights: Sequence[Light], background: Vector, factor: float
) -> tuple[Sequence[Light], Vector]:
    """Return lights and a background so many times as bright."""
    if factor == 1.0:
        return lights, background
    return [light.brightened(factor) for light in lights], _times(background, factor)


def _times(color: Vector, factor: float) -> Vector:
    r, g, b = color
    return (r * factor, g * factor, b * factor)
