# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds datablocks of the open file."""

from __future__ import annotations

from typing import Any


def own_datablock(collection: Any, name: str) -> Any | None:
    """Return this file's own datablock of that name, or None; a linked one may share the name."""
    return next((d for d in collection if d.name == name and d.library is None), None)
