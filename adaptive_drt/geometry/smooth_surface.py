# SPDX-License-Identifier: GPL-3.0-or-later
"""The smooth surface that interpolated normals of flat facets stand for, and its shadow rays.

Shadow rays from a coarse facet would meet its neighbours where the smooth surface is lit: light
that is near the horizon then shows the facets. There rays begin on the smooth surface instead, as
in Cycles (`shadow_ray_offset`, kernel/light/sample.h), whose smooth transition by the cosines of
the light on the facet and on the smooth surface is followed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot

__all__ = ["SmoothSurface"]


TERMINATOR_COSINE = 0.1
"""Cosine of the light's direction below which rays begin above the facet: Blender's default for
the shadow terminator's geometry offset of an object."""


@dataclass(frozen=True)
class SmoothSurface:
    """The smooth surface over n points of facets.

    Attributes
    ----------
    rise : (3, n) metres from the points to the smooth surface.
    facet : (3, n) unit normals of the facets, on the viewer's side.
    """

    rise: Array
    facet: Array

    def take(self, rows: Mask | Ints) -> SmoothSurface:
        """The surface over some of the points."""
        return SmoothSurface(columns(self.rise, rows), columns(self.facet, rows))

    def offsets(self, normal: Array, to: Array) -> Array:
        """By how much (3, n, k) metres the starts of shadow rays are moved.

        Parameters
        ----------
        normal : (3, n) unit shading normals.  to : (3, n, k) metres to points of a light.
        """
        far = np.maximum(np.sqrt(dot(to, to)), TINY)
        shaded = dot(normal[:, :, None], to) / far
        flat = dot(self.facet[:, :, None], to) / far
        near = np.where(
            shaded < TERMINATOR_COSINE,
            2.0 - (flat + shaded) / TERMINATOR_COSINE,
            1.0 - flat / TERMINATOR_COSINE,
        )
        moved: Array = np.clip(near, 0.0, 1.0) * self.rise[:, :, None]
        return moved
