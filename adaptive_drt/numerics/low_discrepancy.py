# SPDX-License-Identifier: GPL-3.0-or-later
"""Low-discrepancy points as a stateless function of (seed, pixel, stream, index).

The first dimension is i / n; the others are Kronecker sequences with Roberts' generators
(powers of the root of x^(d+1) = x + 1; Roberts 2018, "The unreasonable effectiveness of
quasirandom sequences"); d = 1 is the golden ratio and gives Fibonacci's lattice. Each pixel and
stream shifts all points by its own hash (Cranley and Patterson 1976), so that errors of
neighbouring pixels are not correlated. Ohbuchi and Aono 1996 is the paper's own source for such
points.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .arrays import Array, Ints

__all__ = [
    "LATTICE_SIZE",
    "generalized_golden_ratio",
    "hashed_kronecker_points",
    "hashed_sequence_points",
    "hashed_shifts",
    "low_discrepancy_points",
    "sequence_points",
    "shifted_lattices",
    "splitmix64",
]


TWO_TO_MINUS_53 = 2.0**-53
LATTICE_SIZE, FIBONACCI_STEPS = 8, (1, 5)
"""Number of points of Fibonacci's lattice in the unit square, and its steps along both axes, as
multiples of the reciprocal of that number."""
FIXED_POINT_STEPS = 64
"""Number of fixed-point iterations for the root; each gains at least one bit."""


def hashed_shifts(seed: int, pixel: Ints, stream: int, dimension: int) -> Array:
    """Return hashed uniform numbers in [0, 1), one for each pixel.

    Parameters
    ----------
    seed, stream, dimension : any integers; each combination gives an independent sequence.
    pixel : (n,) index of the pixel in the whole picture.

    Returns
    -------
    (n,) float64. Source: SplitMix64 (Steele, Lea and Flood 2014).
    """
    key = splitmix64(np.uint64(seed % 2**64)) ^ np.uint64((stream * 64 + dimension) % 2**64)
    bits = splitmix64(splitmix64(key) ^ pixel.astype(np.uint64))
    return (bits >> np.uint64(11)).astype(np.float64) * TWO_TO_MINUS_53


def low_discrepancy_points(
    seed: int, pixel: Ints, stream: int, count: int, dimensions: int
) -> list[Array]:
    """Return `count` points of the unit cube for each pixel.

    Returns
    -------
    One (n, count) float64 array in [0, 1) per dimension.
    """
    index = np.arange(count, dtype=np.float64)
    base = [index / count]
    if dimensions > 1:
        root = generalized_golden_ratio(dimensions - 1)
        base += [index * root ** -(k + 1.0) % 1.0 for k in range(dimensions - 1)]
    out = []
    for k in range(dimensions):
        moved = base[k] + hashed_shifts(seed, pixel, stream, k)[:, None]
        moved -= np.floor(moved)
        out.append(moved)
    return out


def sequence_points(seed: int, first: int, end: int, dimensions: int) -> list[Array]:
    """Points `first` to `end` - 1 of a Kronecker sequence in the unit cube: (end - first,) each.

    Its generators are Roberts'; unlike the points of `low_discrepancy_points`, those of a shorter
    sequence are the first ones of a longer sequence.
    """
    index = np.arange(first, end, dtype=np.float64)
    root, origin = generalized_golden_ratio(dimensions), np.zeros(1, dtype=np.int64)
    out = []
    for k in range(dimensions):
        moved = index * root ** -(k + 1.0) % 1.0 + hashed_shifts(seed, origin, 0, k)
        out.append(moved - np.floor(moved))
    return out


def hashed_sequence_points(
    seed: int, pixel: Ints, stream: int, span: tuple[int, int], dimensions: int
) -> Array:
    """Points span[0] to span[1] - 1 of a Kronecker sequence for each pixel, shifted by its hash.

    Returns an array (dimensions, n, span[1] - span[0]) in [0, 1); see `sequence_points`.
    """
    index = np.arange(*span, dtype=np.float64)
    return _shifted_sequence(seed, pixel, stream, index, dimensions)


def hashed_kronecker_points(
    seed: int, pixel: Ints, stream: int, first: Ints, count: int
) -> tuple[Array, Array]:
    """Points `first` to `first + count - 1` of a sequence in the unit square for each pixel.

    pixel, first : (n,).  Returns two arrays (n, count): see `hashed_sequence_points`.
    """
    index = first[:, None].astype(np.float64) + np.arange(count)
    a, b = _shifted_sequence(seed, pixel, stream, index, 2)
    return a, b


def shifted_lattices(points: Array) -> tuple[Array, Array]:
    """Fibonacci's lattice of eight points in the unit square, shifted by each of n points (2, n).

    The points are the last coordinates of those that a pixel has: eight consecutive points of one
    sequence for each point of another one of the same generators would lie on a few surfaces in the
    space of all dimensions.

    Returns
    -------
    Two arrays (n, 8).
    """
    out = []
    for shift, step in zip(points, FIBONACCI_STEPS, strict=True):
        spread = shift[:, None] + step * np.arange(LATTICE_SIZE) / LATTICE_SIZE
        out.append(spread - np.floor(spread))
    return out[0], out[1]


def _shifted_sequence(seed: int, pixel: Ints, stream: int, index: Array, dimensions: int) -> Array:
    """Points of numbers (count,) or (n, count) of a Kronecker sequence, shifted by n hashes."""
    root = generalized_golden_ratio(dimensions)
    out = []
    for k in range(dimensions):
        moved = index * root ** -(k + 1.0) % 1.0 + hashed_shifts(seed, pixel, stream, k)[:, None]
        out.append(moved - np.floor(moved))
    return np.array(out)


def generalized_golden_ratio(dimensions: int) -> float:
    """Return the root above 1 of x^(d + 1) = x + 1, d = `dimensions`."""
    x = 1.5
    for _ in range(FIXED_POINT_STEPS):
        x = (1.0 + x) ** (1.0 / (dimensions + 1.0))
    return x


def splitmix64(z: NDArray[np.uint64] | np.uint64) -> NDArray[np.uint64]:
    """Return the SplitMix64 hash of 64-bit numbers (...) (Steele, Lea and Flood 2014)."""
    with np.errstate(over="ignore"):  # arithmetic modulo 2^64 is intended
        z = np.asarray(z, dtype=np.uint64) + np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return z ^ (z >> np.uint64(31))
