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
from .environment_arcs import LONGEST_ARC, integrate_over_arcs, uniform_factor
from .environment_map import EnvironmentMap
from .occluded_form_factor import HEMISPHERE_ROUNDING, visible_boundaries, visible_factor

__all__ = ["Environment"]


TRIAL_NORMALS = 64
"""Number of horizons on which the length of pieces is tried."""
TRIAL_ERROR = 0.0025
"""Largest error of them, as a fraction of the mean irradiance: a quarter of 1 %."""
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
"""Angle, in radians, by which Fibonacci's lattice turns from point to point."""
ROUNDING = 2.0**-44
"""Largest deviation of a map from its mean, as a fraction of that, that counts as none."""
PYRAMID_LEVELS = 6
"""Number of resolutions of the mean radiance around directions: from 64 x 128 cells to 2 x 4."""
FINEST_CELL = np.pi / (2 << (PYRAMID_LEVELS - 1))
"""Size of the smallest cells, in radians."""
NARROWEST = 0.2
"""Least sine of the colatitude by which cells count as narrower than at the equator."""


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
        """The map less its mean, which is 0 where only rounding is left."""
        rest = self.map.shifted(self.level)
        if (np.abs(rest.values) <= ROUNDING * np.abs(self.level)).all():
            rest.values[:] = 0.0
        return rest

    @cached_property
    def longest_arc(self) -> float:
        """Length of the first pieces of arcs, in radians, such that they miss nothing.

        The pair of rules may agree by chance where both miss a narrow bright part of the map: the
        length is halved until whole horizons agree with those of much shorter pieces.
        """
        index = np.arange(TRIAL_NORMALS) + 0.5
        z, psi = 1.0 - 2.0 * index / TRIAL_NORMALS, GOLDEN_ANGLE * index
        normal = np.array([np.sqrt(1.0 - z * z) * f(psi) for f in (np.cos, np.sin)] + [z])
        none = np.zeros((0, 3, TRIAL_NORMALS)), np.zeros((0, TRIAL_NORMALS))
        _, arcs = next(visible_boundaries(normal, none, np.zeros((0, 4, 3, TRIAL_NORMALS))))
        most = TRIAL_ERROR * np.pi * float(self.level.max())
        allowed, lengths = np.full(TRIAL_NORMALS, most), LONGEST_ARC * 0.5 ** np.arange(6)
        want, _ = integrate_over_arcs(self.rest, normal, arcs, 0.1 * allowed, lengths[-1])
        for length in lengths[:-2]:
            value, _ = integrate_over_arcs(self.rest, normal, arcs, allowed, length)
            if np.abs(value - want).max() <= most:
                return float(length)
        return float(lengths[-2])

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
        count = normal.shape[1]
        if not self.rest.values.any():
            plain = visible_factor(Hemisphere(), normal, spheres, polygons)
            return self.level[:, None] * plain, np.zeros(count)
        value, error = np.zeros((self.level.size, count)), np.zeros(count)
        for rows, arcs in visible_boundaries(normal, spheres, polygons):
            n = columns(normal, rows)
            plain = uniform_factor(n, arcs)
            # what is wholly hidden up to rounding has no boundary that closes
            hidden = plain < HEMISPHERE_ROUNDING
            if hidden.any():
                arcs = arcs.take((~hidden[arcs.point]).nonzero()[0])
            more, error[rows] = integrate_over_arcs(
                self.rest, n, arcs, allowed[rows], self.longest_arc
            )
            value[:, rows] = np.where(hidden, 0.0, self.level[:, None] * plain + more)
        return np.maximum(value, 0.0), error

    @cached_property
    def _pyramid(self) -> list[Array]:
        """Mean radiance (k, rows, 2 rows) over cells of longitude and colatitude, by level."""
        rows = 2 << (PYRAMID_LEVELS - 1)
        theta = (np.arange(rows) + 0.5) * np.pi / rows
        own = self.map.cell_means(rows, 2 * rows)
        weight = np.sin(theta)[:, None] + np.zeros(2 * rows)
        levels: list[Array] = []
        while rows >= 2:
            levels.append(own / weight if levels else own)
            if not levels[1:]:
                own = own * weight
            own = own.reshape(len(own), rows // 2, 2, rows, 2).sum(axis=(2, 4))
            weight = weight.reshape(rows // 2, 2, rows, 2).sum(axis=(1, 3))
            rows //= 2
        return levels

    def brightness(self, direction: Array, half: Array) -> Array:
        """Largest mean radiance (k, m) of cells in cones about unit directions (3, m), roughly.

        half : (m,) radians, half angles of the cones, whose size the cells have.
        """
        x, y, z = self.map.turned(direction)
        theta, psi = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x) + 2.0 * np.pi * (y < 0.0)
        # cells narrow towards the poles
        size = np.maximum(half, FINEST_CELL) / np.maximum(np.sin(theta), NARROWEST)
        level = np.clip(np.log2(size / FINEST_CELL), 0, PYRAMID_LEVELS - 1).astype(np.int64)
        found = np.zeros((self.map.channel_count, half.size))
        for number, grid in enumerate(self._pyramid):
            some = (level == number).nonzero()[0]
            if not some.size:
                continue
            rows, count = grid.shape[1:]
            row = (theta[some] * (rows / np.pi)).astype(np.int64)
            column = (psi[some] * (count / (2.0 * np.pi))).astype(np.int64)
            around = [
                grid[:, np.clip(row + i, 0, rows - 1), (column + j) % count]
                for i in (-1, 0, 1)
                for j in (-1, 0, 1)
            ]
            found[:, some] = np.maximum.reduce(around)
        return found

    def open_factor(self, normal: Array, allowed: Array) -> tuple[Array, Array]:
        """The same without occluders."""
        n = normal.shape[1]
        none = np.zeros((0, 3, n)), np.zeros((0, n))
        return self.visible_factor(normal, none, np.zeros((0, 4, 3, n)), allowed)
