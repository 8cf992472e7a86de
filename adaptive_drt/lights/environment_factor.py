# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of environment maps that occluders hide in part, to a stated error.

The mean radiance of the map is a uniform sky, whose light has a closed form. What is left of the
map is integrated by quadrature along the same boundaries: see `environment_arcs`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry.silhouettes import Hemisphere
from ..numerics.arrays import Array
from ..numerics.gather import columns
from .environment_arcs import integrate_over_arcs
from .environment_map import EnvironmentMap
from .occluded_form_factor import visible_boundaries, visible_factor

__all__ = ["Environment"]


@dataclass(frozen=True)
class Environment:
    """A map of k channels, split into its mean and the rest."""

    map: EnvironmentMap

    @cached_property
    def level(self) -> Array:
        """Mean radiance (k,)."""
        return self.map.mean

    @cached_property
    def rest(self) -> EnvironmentMap:
        """The map less its mean."""
        return self.map.shifted(self.level)

    def visible_factor(
        self, normal: Array, spheres: tuple[Array, Array], polygons: Array, allowed: Array
    ) -> tuple[Array, Array]:
        """Integral (k, n) of L max(0, n.w) over the directions that no occluder hides, and errors.

        Parameters
        ----------
        normal, spheres, polygons : see `occluded_form_factor.visible_factor`.
        allowed : (n,) errors up to which the quadrature is not refined.

        Returns
        -------
        value : (k, n), at least 0.  error : (n,) estimated, the largest of the channels.
        """
        plain = visible_factor(Hemisphere(), normal, spheres, polygons)
        value, error = self.level[:, None] * plain, np.zeros(plain.size)
        # what is wholly hidden up to rounding has no boundary that closes
        live = (plain > 0.0).nonzero()[0]
        if not live.size or not self.rest.values.any():
            return value, error
        normal, polygons = columns(normal, live), columns(polygons, live, -1)
        spheres = columns(spheres[0], live, -1), columns(spheres[1], live, -1)
        for rows, arcs in visible_boundaries(normal, spheres, polygons):
            own = live[rows]
            n = columns(normal, rows)
            more, off = integrate_over_arcs(self.rest, n, arcs, allowed[own])
            value[:, own] += more
            error[own] = off
        return np.maximum(value, 0.0), error

    def open_factor(self, normal: Array, allowed: Array) -> tuple[Array, Array]:
        """The same without occluders."""
        n = normal.shape[1]
        none = np.zeros((0, 3, n)), np.zeros((0, n))
        return self.visible_factor(normal, none, np.zeros((0, 4, 3, n)), allowed)
