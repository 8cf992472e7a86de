# SPDX-License-Identifier: GPL-3.0-or-later
"""The axes of the boxes over which radiance is integrated: pixel x, pixel y and shutter time."""

from __future__ import annotations

__all__ = ["SHUTTER_ENDS", "TIME"]

TIME = 2
"""Number of the axis of shutter time; 0 and 1 are the pixel's x and y."""
SHUTTER_ENDS = (-0.5, 0.5)
"""Shutter times at which the shutter opens and closes; the unit is the time that it is open."""
