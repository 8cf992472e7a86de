# SPDX-License-Identifier: GPL-3.0-or-later
"""Cancelling a render: an event is set, and code that polls it raises `RenderCancelled`."""

from __future__ import annotations

__all__ = ["RenderCancelled"]


class RenderCancelled(Exception):
    """The render was cancelled."""
