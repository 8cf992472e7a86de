# SPDX-License-Identifier: GPL-3.0-or-later
"""All golden cases by name, in the order in which they are rendered and stored."""

from .lights import LIGHT_CASES
from .meshes import MESH_CASES
from .motion import MOTION_CASES
from .shapes import SHAPE_CASES
from .ways import WAY_CASES

__all__ = ["CASES"]

CASES = {**LIGHT_CASES, **SHAPE_CASES, **MESH_CASES, **MOTION_CASES, **WAY_CASES}
