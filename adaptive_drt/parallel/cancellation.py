# SPDX-License-Identifier: GPL-3.0-or-later
"""How a render is cancelled: an event is set, and whoever looks at it raises `Stopped`."""

from __future__ import annotations

__all__ = ["Stopped"]


class Stopped(Exception):
    """The render was cancelled."""
