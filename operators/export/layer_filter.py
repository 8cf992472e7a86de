# SPDX-License-Identifier: GPL-3.0-or-later
"""What a view layer's filter lets through, as in Cycles."""

from __future__ import annotations

from typing import Any

FILTERS = {
    "MESH": "use_solid",
    "CURVE": "use_solid",
    "SURFACE": "use_solid",
    "META": "use_solid",
    "FONT": "use_solid",
    "POINTCLOUD": "use_solid",
    "CURVES": "use_strand",
    "VOLUME": "use_volumes",
}
"""Switches of a view layer (Surfaces, Curves, Volumes) by the types of objects they filter."""


def lets_through(layer: Any, kind: str) -> bool:
    """Whether a view layer shows objects of a type."""
    switch = FILTERS.get(kind)
    return switch is None or bool(getattr(layer, switch))
