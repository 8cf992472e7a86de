# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance that depends on the direction, as an image of the whole sphere, and its integrals.

In the map's own frame a direction has a longitude psi from 0 to 2 pi and a colatitude theta from
the zenith z. Radiance is bilinear in both between the texels' centres, so along each meridian

    S(theta, psi) = integral of L sin^2,   C(theta, psi) = integral of L sin cos,   from the zenith,

have closed forms on each texel. Then the integral of L w over a region of directions is, by Green's
theorem, the sum along its boundary, anticlockwise, of (S cos psi, S sin psi, C) dpsi, as long as
the region does not hold the nadir, where that form is singular. `environment_arcs` deals with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..scene.description import EnvironmentLight
from .environment_reduction import MOST_TEXELS, reduced_image

__all__ = ["EnvironmentMap", "make_environment_map"]


TWO_PI = 2.0 * np.pi
TEXEL_BYTES = 8 * (1 + 4 + 1)
"""Bytes that a texel and channel takes: its radiance, four numbers of the table, and its radiance
less the mean of the map, as float64."""


@dataclass(frozen=True)
class EnvironmentMap:
    """Radiance by direction, in k channels.

    Attributes
    ----------
    turn : (3, 3) rows of the rotation from the tracer's axes to those of the map.
    knots : (rows + 2,) colatitudes of the rows of values: the poles, and the texels' centres.
    values : (rows + 2, columns, k) radiance there; columns are equally spaced from longitude 0.
    reduction_error : error of the irradiance, relative to a radiance of 1, of the image itself, and
        by fewer pixels than it has: see `environment_reduction`.
    """

    turn: Array
    knots: Array
    values: Array
    reduction_error: float = 0.0

    @property
    def channel_count(self) -> int:
        """Number of channels k."""
        return int(self.values.shape[2])

    @property
    def column_count(self) -> int:
        """Number of columns of texels."""
        return int(self.values.shape[1])

    @property
    def table_bytes(self) -> int:
        """Bytes of the radiance, and of the table made of it for irradiance."""
        return TEXEL_BYTES * self.channel_count * int(self.values.shape[0] * self.values.shape[1])

    def _lines(self) -> tuple[Array, Array]:
        """Radiance c0 + c1 theta along meridians, on each texel: (rows + 1, columns, k) each."""
        step = np.diff(self.knots)[:, None, None]
        slope = np.diff(self.values, axis=0) / step
        return self.values[:-1] - slope * self.knots[:-1, None, None], slope

    @cached_property
    def _table(self) -> Array:
        """For each texel c0, c1 and what makes the antiderivatives continuous: (texels, 4 k)."""
        first, slope = self._lines()
        parts = [first, slope]
        for moments in _moments(self.knots):
            low, high = (m[:-1, None, None] for m in moments), (m[1:, None, None] for m in moments)
            (a, b), (c, d) = low, high
            steps = first * (c - a) + slope * (d - b)
            start = np.concatenate([np.zeros_like(steps[:1]), np.cumsum(steps[:-1], axis=0)])
            parts.append(start - first * a - slope * b)
        joined = np.concatenate(parts, axis=2)
        return np.ascontiguousarray(joined.reshape(-1, joined.shape[2]))

    @cached_property
    def nadir(self) -> Array:
        """S and C of whole meridians, (2, columns, k)."""
        count, k = self.column_count, self.channel_count
        last = self._table.reshape(-1, count, 4 * k)[-1]
        first, slope, *starts = (last[:, j * k : (j + 1) * k] for j in range(4))
        ends = _moments(self.knots[-1:])
        pairs = zip(starts, ends, strict=True)
        return np.array([start + a * first + b * slope for start, (a, b) in pairs])

    @cached_property
    def _nadir_integrals(self) -> Array:
        """Integrals over the longitude, from 0 on, of S cos, S sin and C of whole meridians at the
        columns and beyond the last: (3, columns + 1, k).
        """
        count = self.column_count
        knots = TWO_PI * np.arange(count + 1) / count
        steps = self._nadir_step(np.arange(count), knots[:-1], knots[1:])
        return np.concatenate([np.zeros_like(steps[:, :1]), np.cumsum(steps, axis=1)], axis=1)

    def _nadir_step(self, column: Ints, low: Array, high: Array) -> Array:
        """The same integrals (3, n, k) from longitudes to others within one column of texels."""
        width = TWO_PI / self.column_count
        here, after = self.nadir[:, column], self.nadir[:, (column + 1) % self.column_count]
        slope = (after - here) / width
        base = here - slope * (width * column)[:, None]
        (sine, height), (sine_slope, height_slope) = base, slope
        ends = []
        for psi in (low[:, None], high[:, None]):
            s, c = np.sin(psi), np.cos(psi)
            ends.append(
                np.array(
                    [
                        sine * s + sine_slope * (psi * s + c),
                        -sine * c + sine_slope * (s - psi * c),
                        height * psi + 0.5 * height_slope * psi * psi,
                    ]
                )
            )
        change: Array = ends[1] - ends[0]
        return change

    @cached_property
    def total(self) -> Array:
        """Integral of L w over all directions, (3, k)."""
        total: Array = self._nadir_integrals[:, -1]
        return total

    @cached_property
    def mean(self) -> Array:
        """Mean radiance over all directions, (k,)."""
        first, slope = self._lines()
        cosine, sine = np.cos(self.knots), np.sin(self.knots)
        # of sin and theta sin
        plain, linear = -np.diff(cosine), np.diff(sine - self.knots * cosine)
        rows = first * plain[:, None, None] + slope * linear[:, None, None]
        mean: Array = rows.sum(axis=0).mean(axis=0) / 2.0
        return mean

    def cell_means(self, rows: int, columns_: int) -> Array:
        """Mean radiance (k, rows, columns), roughly, over equal steps of both angles."""
        height, width = self.values.shape[0] - 2, self.column_count
        fine = max(1, -(-height // rows)), max(1, -(-width // columns_))
        theta = (np.arange(rows * fine[0]) + 0.5) * (np.pi / (rows * fine[0]))
        psi = (np.arange(columns_ * fine[1]) + 0.5) * (TWO_PI / (columns_ * fine[1]))
        total: Array = np.zeros((self.channel_count, rows, columns_))
        for part in range(fine[0]):
            t, p = np.meshgrid(theta[part :: fine[0]], psi, indexing="ij")
            row, column, at, share = self._place(t, p)
            value = self._mixed(row, column, at, share)
            total += value.reshape(*total.shape, fine[1]).mean(axis=3) / fine[0]
        return total

    def shifted(self, level: Array) -> EnvironmentMap:
        """The map less some radiance (k,)."""
        return replace(self, values=self.values - level)

    def channel(self, index: int) -> EnvironmentMap:
        """One channel of the map."""
        part = np.ascontiguousarray(self.values[:, :, index : index + 1])
        return replace(self, values=part)

    def turned(self, vector: Array) -> Array:
        """Vectors (3, ...) in the frame of the map."""
        x, y, z = vector
        return np.array([row[0] * x + row[1] * y + row[2] * z for row in self.turn])

    def radiance(self, direction: Array) -> Array:
        """Radiance (k, ...) in directions (3, ...) of any length."""
        x, y, z = self.turned(direction)
        aside = np.hypot(x, y)
        return self._mixed(*self._place(np.arctan2(aside, z), np.arctan2(y, x)))

    def _mixed(self, row: Ints, column: Ints, theta: Array, share: Array) -> Array:
        """Radiance (k, ...) at places as `_place` gives them."""
        low, high = self.knots[row], self.knots[row + 1]
        along = (theta - low) / (high - low)
        after = column + 1
        after = np.where(after == self.column_count, 0, after)
        flat, count = self.values.reshape(-1, self.channel_count), self.column_count

        def line(start: Ints) -> Array:
            one, two = flat.take(start + column, axis=0), flat.take(start + after, axis=0)
            mixed: Array = one + share[..., None] * (two - one)
            return mixed

        one, two = line(row * count), line((row + 1) * count)
        return np.moveaxis(one + along[..., None] * (two - one), -1, 0)

    def _place(self, theta: Array, psi: Array) -> tuple[Ints, Ints, Array, Array]:
        """Row and column (...) of the texels, the colatitude, and the fraction of the column."""
        rows, count = self.knots.size - 2, self.column_count
        row = np.minimum((theta * (rows / np.pi) + 0.5).astype(np.int64), rows)
        x = psi * (count / TWO_PI)
        x = x + count * (x < 0.0)
        column = np.minimum(x.astype(np.int64), count - 1)
        return row, column, theta, x - column

    def antiderivatives(self, theta: Array, psi: Array) -> tuple[Array, Array]:
        """S and C (k, n) from the zenith at colatitudes and longitudes (n,)."""
        row, column, theta, share = self._place(theta, psi)
        count, k = self.column_count, self.channel_count
        after = column + 1
        after = np.where(after == count, 0, after)
        one = self._table.take(row * count + column, axis=0)
        two = self._table.take(row * count + after, axis=0)
        two -= one
        two *= share[:, None]
        one += two
        mixed = one.T
        (a, b), (c, d) = _moments(theta)
        first, slope = mixed[:k], mixed[k : 2 * k]
        sine: Array = mixed[2 * k : 3 * k] + first * a + slope * b
        height: Array = mixed[3 * k :] + first * c + slope * d
        return sine, height

    def slope_changes(self, theta: Array, column: Ints, south: Mask) -> tuple[Array, Array]:
        """Changes (k, n) of the slopes of S and C along the longitude at columns (n,) of texels.

        theta : (n,) colatitudes.  south : (n,) where S and C of whole meridians are taken off.
        """
        rows, count, k = self.knots.size - 2, self.column_count, self.channel_count
        row = np.minimum((theta * (rows / np.pi) + 0.5).astype(np.int64), rows)
        around = [(column + step) % count for step in (-1, 0, 1)]
        one, two, three = (self._table.take(row * count + c, axis=0) for c in around)
        mixed = (one - 2.0 * two + three).T
        (a, b), (c, d) = _moments(theta)
        first, slope = mixed[:k], mixed[k : 2 * k]
        sine: Array = mixed[2 * k : 3 * k] + first * a + slope * b
        height: Array = mixed[3 * k :] + first * c + slope * d
        one, two, three = (self.nadir[:, c] for c in around)
        last = np.moveaxis((one - 2.0 * two + three) * south[:, None], -1, 1)
        width = TWO_PI / count
        return (sine - last[0]) / width, (height - last[1]) / width

    def nadir_antiderivatives(self, psi: Array) -> tuple[Array, Array]:
        """S and C (k, n) of whole meridians at longitudes (n,)."""
        _, column, _, share = self._place(np.zeros_like(psi), psi)
        here, after = self.nadir[:, column], self.nadir[:, (column + 1) % self.column_count]
        sine, height = np.moveaxis(here + share[:, None] * (after - here), -1, 1)
        return sine, height

    def nadir_integrals(self, psi: Array) -> Array:
        """Integrals (3, k, n) of S cos, S sin and C of whole meridians, over longitudes from 0 to
        psi (n,), less the part that grows: they have one value at each longitude.
        """
        psi = psi + TWO_PI * (psi < 0.0)
        _, column, _, _ = self._place(np.zeros_like(psi), psi)
        low = TWO_PI / self.column_count * column
        found = self._nadir_integrals[:, column] + self._nadir_step(column, low, psi)
        found -= psi[:, None] / TWO_PI * self.total[:, None]
        return np.moveaxis(found, -1, 1)


def _moments(theta: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Antiderivatives of sin^2 and theta sin^2, and of sin cos and theta sin cos."""
    sine, cosine = np.sin(2.0 * theta), np.cos(2.0 * theta)
    quarter = 0.25 * sine
    return (
        (0.5 * theta - quarter, 0.25 * theta * theta - theta * quarter - 0.125 * cosine),
        (-0.25 * cosine, 0.125 * sine - 0.25 * theta * cosine),
    )


def make_environment_map(light: EnvironmentLight, lights: bool = True) -> EnvironmentMap:
    """Return the map of an image of the sphere.

    The longitude grows against the columns of the image, and is 0 in the middle of its last one.

    lights : whether the map is made for irradiance, so that large images are reduced; else it is
        for what is seen of them, and large ones are kept in float32.
    """
    image, reduction = light.pixels, 0.0
    large = image.shape[0] * image.shape[1] > MOST_TEXELS
    if lights:
        image, reduction = reduced_image(image)
    kind = np.float32 if large and not lights else np.float64
    pixels: Any = np.asarray(image, dtype=kind)[:, ::-1]
    rows, columns_, _ = pixels.shape
    # the image repeats, so that its first and last row meet at both poles
    pole = 0.5 * (pixels[:1] + pixels[-1:])
    values = np.concatenate([pole, pixels, pole])
    values *= np.array(light.radiance, dtype=kind)
    knots = np.concatenate([[0.0], (np.arange(rows) + 0.5) * (np.pi / rows), [np.pi]])
    # the middle of the image has longitude 0 of Blender, its left end pi
    back = np.pi - np.pi / columns_
    own = np.array(
        [[np.cos(back), -np.sin(back), 0.0], [np.sin(back), np.cos(back), 0.0], [0.0, 0.0, 1.0]]
    )
    turn: Any = own @ np.array(light.rotation, dtype=np.float64)
    error = (light.error + reduction) * float(np.abs(light.radiance).max())
    return EnvironmentMap(turn, knots, values, error)
