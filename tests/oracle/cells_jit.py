# SPDX-License-Identifier: GPL-3.0-or-later
"""Means over pixel and shutter to a stated error, compiled: nested adaptive quadrature.

Along a row of the pixel the places where another shape comes into sight are roots of quadratics;
between them, and over the rows and the shutter, intervals are halved until the seven points of
Kronrod and the three of Gauss among them agree.
"""

import numpy as np

from .arcs_jit import CIRCLE
from .rays_jit import MOST_EVENTS, candidates, events, radiance
from .vectors_jit import jit

__all__ = ["means"]

NODES = np.array(
    [
        -0.960491268708020283,
        -0.774596669241483377,
        -0.434243749346802558,
        0.0,
        0.434243749346802558,
        0.774596669241483377,
        0.960491268708020283,
    ]
)
KRONROD = np.array(
    [
        0.104656226026467265,
        0.268488089868333440,
        0.401397414775962222,
        0.450916538658474142,
        0.401397414775962222,
        0.268488089868333440,
        0.104656226026467265,
    ]
)
GAUSS = np.array([0.0, 5.0 / 9.0, 0.0, 8.0 / 9.0, 0.0, 5.0 / 9.0, 0.0])

END = 0.9999
"""Of half an interval: where its ends are looked at. A step farther out is worth nothing."""
OUTER = END + NODES[0]
"""From there to the outermost node."""
OUTWARD = OUTER / (NODES[1] - NODES[0])
"""The same, in spaces between that and the next."""

HALVINGS = 22
"""Intervals are halved this often at most: 2e-7 of a pixel, which a jump may be off by."""

INNER = 0.2
"""Error of an inner integral as a share of the outer one's, so that it does not look like shape."""

SLICES = 8
"""Parts of the shutter, at least: what 7 places found all alike may still hold a flash."""

BANDS = 4
"""Parts of a pixel's height, at least, for the same reason."""

PARTS = 4
"""Parts of a pixel's width, at least: thin shadows stand between the places that are looked at."""

LEAST = 1e-13
"""Shorter intervals, as shares of a pixel, are left out: they are roundings of one root."""


@jit
def _sum(values, half, total):
    """Add Kronrod's integral to `total` (3,); how far Gauss's is from it."""
    off = 0.0
    for c in range(3):
        fine = coarse = 0.0
        for k in range(7):
            fine += KRONROD[k] * values[k, c]
            coarse += GAUSS[k] * values[k, c]
        off = max(off, half * abs(fine - coarse))
        total[c] += half * fine
    return off


@jit
def _beyond(values, near, next_, row, half):
    """What a step between an interval's end and its outermost node may be worth.

    All seven nodes may lie to one side of it: then Kronrod and Gauss agree. So a row at the end is
    held against the line through the two nodes next to it.
    """
    off = 0.0
    for c in range(3):
        line = values[near, c] + OUTWARD * (values[near, c] - values[next_, c])
        off = max(off, half * OUTER * abs(row[c] - line))
    return off


@jit
def _row(scene, among, count, x, y, t, goal, work):
    """Mean over the row from (x, y) to (x + 1, y): (3,) in work.row."""
    circles, cuts, spots, stack, values, row, tally, trial, space = work
    got = events(scene, among, count, x, y, t, spots)
    row[:] = 0.0
    low = 0.0
    for k in range(got + 1):
        high = spots[k] if k < got else 1.0
        if high - low < LEAST:
            continue
        left = int(np.ceil((high - low) * PARTS))
        for j in range(left):
            stack[j, 0] = low + (high - low) * j / left
            stack[j, 1] = low + (high - low) * (j + 1) / left
            stack[j, 2] = 0.0
        while left:
            left -= 1
            a, b, depth = stack[left, 0], stack[left, 1], stack[left, 2]
            middle, half = 0.5 * (a + b), 0.5 * (b - a)
            for j in range(7):
                r, g, u = radiance(
                    scene, among, count, x + middle + half * NODES[j], y, t, circles, cuts, space
                )
                values[j, 0], values[j, 1], values[j, 2] = r, g, u
            tally[0] += 7
            trial[:] = 0.0
            if _sum(values, half, trial) <= goal or depth >= HALVINGS:
                row += trial
            else:
                stack[left, 0], stack[left, 1], stack[left, 2] = a, middle, depth + 1
                stack[left + 1, 0], stack[left + 1, 1], stack[left + 1, 2] = middle, b, depth + 1
                left += 2
        low = high


@jit
def _area(scene, among, count, x, y, t, goal, work, stack, values, area):
    """Mean over the pixel at time t: (3,) in `area`."""
    row = work[5]
    area[:] = 0.0
    trial = np.empty(3)
    left = BANDS
    for k in range(BANDS):
        stack[k, 0], stack[k, 1], stack[k, 2] = k / BANDS, (k + 1) / BANDS, 0.0
    while left:
        left -= 1
        a, b, depth = stack[left, 0], stack[left, 1], stack[left, 2]
        middle, half = 0.5 * (a + b), 0.5 * (b - a)
        for j in range(7):
            _row(scene, among, count, x, y + middle + half * NODES[j], t, INNER * goal, work)
            values[j] = row
        trial[:] = 0.0
        off = _sum(values, half, trial)
        for side, near, next_ in ((-1.0, 0, 1), (1.0, 6, 5)):
            _row(scene, among, count, x, y + middle + side * END * half, t, INNER * goal, work)
            off = max(off, _beyond(values, near, next_, row, half))
        if off <= goal or depth >= HALVINGS:
            area += trial
        else:
            stack[left, 0], stack[left, 1], stack[left, 2] = a, middle, depth + 1
            stack[left + 1, 0], stack[left + 1, 1], stack[left + 1, 2] = middle, b, depth + 1
            left += 2


@jit
def means(scene, pixels, goal, moving, most, result, evaluations):
    """Mean radiance over pixels and shutter.

    Parameters
    ----------
    pixels : (n, 2) lower left corners.  goal : error, in the units of radiance, at which an
        interval is not halved again; the mean's own error is mostly well below it.
    most : circles that scratch is made for.  result : (n, 3).  evaluations : (n,).
    """
    circles, cuts = np.empty((most, CIRCLE)), np.empty(2 * most + 2)
    found, among = np.empty(MOST_EVENTS), np.empty(most, dtype=np.int64)
    tally = np.zeros(1)
    stacks, values = np.empty((3, 64, 3)), np.empty((3, 7, 3))
    row, area = np.empty(3), np.empty(3)
    space = (np.empty((6, 3)), np.empty((6, 3)), np.empty((6, 3)))
    work = (circles, cuts, found, stacks[0], values[0], row, tally, np.empty(3), space)
    stack, trial = stacks[2], np.empty(3)
    for i in range(pixels.shape[0]):
        x, y = pixels[i, 0], pixels[i, 1]
        count = candidates(scene, x, y, among)
        tally[0] = 0.0
        result[i] = 0.0
        if not moving:
            _area(scene, among, count, x, y, 0.0, goal, work, stacks[1], values[1], area)
            result[i] = area
            evaluations[i] = tally[0]
            continue
        left = SLICES
        for k in range(SLICES):
            stack[k, 0], stack[k, 1], stack[k, 2] = k / SLICES - 0.5, (k + 1) / SLICES - 0.5, 0.0
        while left:
            left -= 1
            a, b, depth = stack[left, 0], stack[left, 1], stack[left, 2]
            middle, half = 0.5 * (a + b), 0.5 * (b - a)
            for j in range(7):
                t = middle + half * NODES[j]
                _area(scene, among, count, x, y, t, INNER * goal, work, stacks[1], values[1], area)
                values[2, j] = area
            trial[:] = 0.0
            if _sum(values[2], half, trial) <= goal or depth >= HALVINGS:
                result[i] += trial
            else:
                stack[left, 0], stack[left, 1], stack[left, 2] = a, middle, depth + 1
                stack[left + 1, 0], stack[left + 1, 1], stack[left + 1, 2] = middle, b, depth + 1
                left += 2
        evaluations[i] = tally[0]
