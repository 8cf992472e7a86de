# SPDX-License-Identifier: GPL-3.0-or-later
"""Sobol' points in up to five dimensions, shifted digitally for each pixel.

Integrands over all domains of a pixel at once (its square, the shutter, a light) have edges across
several axes. There the points of one net in all dimensions have smaller errors than Kronecker
sequences: of packed spheres under a sky 1.1e-2 where two sequences of two dimensions, with eight
directions to each place, left 1.7e-2 (1,024 rays a pixel, root mean square over pixels). The
generating matrices are scrambled once (Matousek 1998), which removes the structure of the first
points; each pixel and stream then has its own digital shift, which keeps all properties of a net.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from .arrays import Array, Ints
from .low_discrepancy import hashed_shifts, splitmix64

__all__ = ["MOST_POINTS", "net_points", "stratified_copies"]


BITS = 30
"""Number of binary digits of the points."""
MOST_POINTS = 1 << 16
"""Number of points in the table."""
PRIMITIVE = ((0, 0, (1,)), (1, 0, (1,)), (2, 1, (1, 3)), (3, 1, (1, 3, 1)), (3, 2, (1, 1, 1)))
"""Degrees, coefficients and initial numbers of the primitive polynomials of each dimension; the
first one stands for van der Corput's sequence. Source: Joe and Kuo 2008."""
SCRAMBLE_KEY = 0x5CA1AB1E
"""Key of the hash that the scrambling matrices are made of."""


def net_points(
    seed: int, pixel: Ints, stream: int, index: Ints, dimensions: tuple[int, ...]
) -> Array:
    """Points of a Sobol' net in some of its dimensions, shifted by the hashes of n pixels.

    Parameters
    ----------
    seed, stream : any integers; each combination gives other shifts.
    pixel : (n,) numbers of the pixels in the whole picture.
    index : (k,) numbers of the points, the same for each pixel, or (n, k); below `MOST_POINTS`.
    dimensions : of the points, each below five.

    Returns
    -------
    (dimensions, n, k) in [0, 1).
    """
    table = _table()
    out = np.empty((len(dimensions), pixel.size, index.shape[-1]))
    for place, dimension in enumerate(dimensions):
        shift = (hashed_shifts(seed, pixel, stream, dimension) * 2.0**BITS).astype(np.int64)
        own = table[dimension][index]
        np.multiply(own ^ shift[:, None], 2.0**-BITS, out=out[place])
    return out


def stratified_copies(points: Array, number: int) -> Array:
    """Copies (2, ..., number) of points (2, ...) of the unit square, one in each of as many strata.

    number : 1, 2 or 4: halves of the square along the second axis, or its quarters.
    """
    a, b = points
    copies = []
    for copy in range(number):
        shifts = (0.5 * (copy >> 1), 0.5 * (copy & 1))
        copies.append([(each + shift) % 1.0 for each, shift in zip((a, b), shifts, strict=True)])
    return np.moveaxis(np.array(copies), 0, -1)


@cache
def _table() -> NDArray[np.int64]:
    """The numbers (5, `MOST_POINTS`) of the unshifted points, in units of 2^-`BITS`."""
    index = np.arange(MOST_POINTS)
    table = np.zeros((len(PRIMITIVE), MOST_POINTS), dtype=np.int64)
    for number, (row, polynomial) in enumerate(zip(table, PRIMITIVE, strict=True)):
        key = SCRAMBLE_KEY + 64 * number
        for bit, column in enumerate(_scrambled(_columns(*polynomial), key)):
            row ^= np.where((index >> bit) & 1, column, 0)
    return table


def _columns(degree: int, coefficients: int, start: tuple[int, ...]) -> list[int]:
    """Columns of a generating matrix as numbers of `BITS` digits: see Bratley and Fox 1988."""
    if not degree:
        return [1 << (BITS - 1 - k) for k in range(BITS)]
    numbers = list(start)
    for k in range(degree, BITS):
        value = numbers[k - degree] ^ (numbers[k - degree] << degree)
        for j in range(1, degree):
            if (coefficients >> (degree - 1 - j)) & 1:
                value ^= numbers[k - j] << j
        numbers.append(value)
    return [number << (BITS - 1 - k) for k, number in enumerate(numbers)]


def _scrambled(columns: list[int], key: int) -> list[int]:
    """The columns times a hashed lower triangular matrix whose diagonal is 1."""
    # digit d of the product is digit d of the number, plus hashed ones of those before it
    masks = []
    for digit in range(BITS):
        bits = int(splitmix64(np.uint64(key + digit))) & ((1 << BITS) - 1)
        above = ~((1 << (BITS - digit)) - 1) & ((1 << BITS) - 1)
        masks.append((bits & above) | (1 << (BITS - 1 - digit)))
    return [
        sum((bin(column & mask).count("1") & 1) << (BITS - 1 - k) for k, mask in enumerate(masks))
        for column in columns
    ]
