# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies a Blender scene into the tracer's own records."""

from .scene import export_scene
from .shutter import kept_frame

__all__ = ["export_scene", "kept_frame"]
