# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance of a spot light whose cone is not circular, since the light is scaled unevenly.

As in Cycles, it depends on the angle from the axis in the light's own frame, to which directions
are mapped by the inverse of its matrix.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..numerics.arrays import Array
from ..numerics.floats import TINY
from ..numerics.vector import dot
from .axial_profile import AxialProfile

__all__ = ["UnevenProfile"]


@dataclass(frozen=True)
class UnevenProfile(AxialProfile):
    """A profile of the angle from the axis in a frame that is not orthonormal.

    Its integrals are not those of `AxialProfile`: arcs cannot be integrated along.

    frame : (3, 3) matrix to that frame, whose third axis is the profile's.
    """

    frame: Array

    @cached_property
    def stretch(self) -> float:
        """By how much angles in the frame may exceed those of directions: its condition number."""
        size = np.linalg.svd(self.frame, compute_uv=False)
        return float(size[0] / size[-1])

    def cosine_along(self, vector: Array) -> Array:
        """Length of vectors (3, ...) times their cosine with the axis in the frame: (...)."""
        rows = self.frame.reshape((3, 3) + (1,) * (vector.ndim - 1))
        x, y, z = (dot(row, vector) for row in rows)
        size = np.maximum(np.sqrt(x * x + y * y + z * z), TINY)
        cosine: Array = np.sqrt(dot(vector, vector)) * (z / size)
        return cosine
