# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' Exposure of the film: a factor on the picture, and so on all light in the scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ...adaptive_drt.scene.description import (
    EnvironmentLight,
    Light,
    Material,
    ShapeBatch,
    ShapeRecord,
    Vector,
)
from .checklist import cycles_of


def exposure_of(scene: Any) -> float:
    """Return the factor of an evaluated scene; 1 where Cycles, its add-on, is off."""
    return float(getattr(cycles_of(scene), "film_exposure", 1.0))


def exposed(
    lights: Sequence[Light], background: Vector, backdrop: EnvironmentLight | None, factor: float
) -> tuple[Sequence[Light], Vector, EnvironmentLight | None]:
    """Return lights, and both kinds of background, so many times as bright."""
    if factor == 1.0:
        return lights, background, backdrop
    brighter = [light.brightened(factor) for light in lights]
    behind = None if backdrop is None else backdrop.brightened(factor)
    return brighter, _times(background, factor), behind


def brightened(shapes: Sequence[ShapeRecord], factor: float) -> list[ShapeRecord]:
    """Return shapes that shine so many times as bright."""
    if factor == 1.0:
        return list(shapes)
    found: list[ShapeRecord] = []
    for shape in shapes:
        if isinstance(shape, ShapeBatch):
            materials = tuple(_brighter(each, factor) for each in shape.materials)
            found.append(replace(shape, materials=materials))  # type: ignore[type-var]
        else:
            found.append(replace(shape, material=_brighter(shape.material, factor)))
    return found


def _brighter(material: Material, factor: float) -> Material:
    return replace(material, emission=_times(material.emission, factor))


def _times(color: Vector, factor: float) -> Vector:
    r, g, b = color
    return (r * factor, g * factor, b * factor)
