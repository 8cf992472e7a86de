# SPDX-License-Identifier: GPL-3.0-or-later
"""Lists those settings of a table that stand where they would change the picture."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from .coverage import Listed, Table

ROUNDING = 1e-6
"""Relative: Blender's float32 holds no number more exactly."""


def left_out(table: Table, owner: Any) -> Iterator[tuple[str, bool]]:
    """Yield a reason, and whether the owner is missing, for each setting that is not heeded.

    Parameters
    ----------
    table : of the owner's RNA struct.
    owner : None yields nothing: Cycles' own settings are not there while its add-on is off.
    """
    for name, entry in table.items():
        if not isinstance(entry, Listed) or not hasattr(owner, name):
            continue
        value = plain(getattr(owner, name))
        if any(same(value, plain(neutral)) for neutral in entry.neutral):
            continue
        if entry.when is None or entry.when(owner):
            yield entry.reason.format(value=_said(value), degrees=_degrees(value)), entry.missing


def plain(value: Any) -> Any:
    """Return a property's value as what can be compared: arrays as tuples."""
    return value if isinstance(value, str) or not hasattr(value, "__len__") else tuple(value)


def same(one: Any, other: Any) -> bool:
    """Whether two values are equal but for float32's rounding."""
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float) and isinstance(other, (int, float)):
        if math.isnan(one) and math.isnan(other):
            return True
        return math.isclose(one, other, rel_tol=ROUNDING)
    return bool(one == other)


def _said(value: Any) -> str:
    if isinstance(value, str):
        return value.replace("_", " ").title()
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _degrees(value: Any) -> str:
    return f"{math.degrees(value):.3g}°" if isinstance(value, float) else ""
