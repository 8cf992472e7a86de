# SPDX-License-Identifier: GPL-3.0-or-later
"""Light over regions of directions by latitudes: brute force for all kinds of lights. No core code.

A region is all of the sphere that lies inside some circles, the horizon among them, and not inside
others, nor inside all circles of a group. Along a latitude, a circle about the axis of the light's
profile or of the sky's image, every circle is met at known angles; between them n.w has an
antiderivative, and so it has times a radiance that is linear in the longitude. Across the latitudes
the integrand is smooth but for roots where circles touch or cross each other, or rows of the
image: Gauss-Legendre between these, in a variable that removes the roots.

Circles (k, 5) : unit axis, cosine of the half angle, group. Group 0 bounds what is lit, 1 hides by
itself, others hide together with those of the same number. Polygons are circles of 90 degrees.
"""

import math

import numpy as np

from .vectors_jit import cross, dot, jit, vector

__all__ = ["ALONE", "CONE", "LIT", "SPREAD", "UNIFORM", "integrals"]

LIT, ALONE = 0.0, 1.0
UNIFORM, CONE, SPREAD = 0, 1, 2
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
COLUMN_NODES, COLUMN_WEIGHTS = np.polynomial.legendre.leggauss(7)
SHORTEST = 1e-13
"""Radians of a piece that is left out."""
ACCURACY, DEEPEST = 2e-12, 30
"""Difference of a piece and its halves that is small enough, for the sine of the half angle of the
smallest circle that bounds what is lit; and the most halvings of a piece."""
NO_IMAGE = np.zeros((0, 0, 3))


@jit
def _inside(circles, count, way):
    """Whether a direction is in the region."""
    group, within = 0.0, False
    for j in range(count):
        row = circles[j]
        inside = dot(vector(row, 0), way) > row[3]
        if row[4] == LIT:
            if not inside:
                return False
        elif row[4] == ALONE:
            if inside:
                return False
        elif row[4] == group:
            within = within and inside
        else:
            if within:
                return False
            group, within = row[4], inside
    return not within


@jit
def _sort(found, count):
    for i in range(1, count):
        x = found[i]
        j = i
        while j > 0 and found[j - 1] > x:
            found[j] = found[j - 1]
            j -= 1
        found[j] = x


@jit
def _latitudes(circles, count, frame, profile, rows, found):
    """Latitudes in order at which the integrand is not smooth: how many, in `found`."""
    x, y, z = frame
    found[0], found[1] = 0.0, math.pi
    got = 2
    for i in range(count):
        a = vector(circles[i], 0)
        beta = math.atan2(math.hypot(dot(a, x), dot(a, y)), dot(a, z))
        gamma = math.acos(circles[i, 3])
        for angle in (abs(beta - gamma), beta + gamma):
            found[got] = angle if angle <= math.pi else 2.0 * math.pi - angle
            got += 1
        for j in range(i):
            b = vector(circles[j], 0)
            n = cross(a, b)
            nn = dot(n, n)
            if nn < 1e-30:
                continue
            c, d, ab = circles[i, 3], circles[j, 3], dot(a, b)
            p, q = (c - d * ab) / nn, (d - c * ab) / nn
            rest = 1.0 - p * p - q * q - 2.0 * p * q * ab
            if rest <= 0.0:
                continue
            r = math.sqrt(rest / nn)
            for side in (-r, r):
                w = (
                    p * a[0] + q * b[0] + side * n[0],
                    p * a[1] + q * b[1] + side * n[1],
                    p * a[2] + q * b[2] + side * n[2],
                )
                found[got] = math.atan2(math.hypot(dot(w, x), dot(w, y)), dot(w, z))
                got += 1
    if profile[0] != UNIFORM:
        for k in (1, 2):
            found[got] = math.acos(profile[k])
            got += 1
    for row in range(rows):
        found[got] = (row + 0.5) * math.pi / rows
        got += 1
    _sort(found, got)
    return got


@jit
def _level(profile, cosine):
    if profile[0] == CONE:
        s = min(max((cosine - profile[1]) / (profile[2] - profile[1]), 0.0), 1.0)
        return s * s * (3.0 - 2.0 * s)
    if profile[0] == SPREAD:
        if cosine <= profile[1]:
            return 0.0
        edge = math.sqrt(1.0 - profile[1] ** 2) / profile[1]
        return 1.0 - math.sqrt(max(1.0 - cosine * cosine, 0.0)) / cosine / edge
    return 1.0


@jit
def _along(circles, count, frame, n, image, theta, cuts, value):
    """Integral (3,) of L n.w along a latitude, added to `value` with the weight 1."""
    x, y, z = frame
    s, c = math.sin(theta), math.cos(theta)
    got = 0
    cuts[got] = 0.0
    got += 1
    for j in range(count):
        a = vector(circles[j], 0)
        ax, ay, az = dot(a, x), dot(a, y), dot(a, z)
        aside = math.hypot(ax, ay) * s
        gap = circles[j, 3] - az * c
        if aside == 0.0 or abs(gap) >= aside:
            continue
        middle, half = math.atan2(ay, ax), math.acos(gap / aside)
        for k in range(2):
            turn = middle - half if k == 0 else middle + half
            turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi))
            cuts[got] = turn
            got += 1
    _sort(cuts, got)
    cuts[got] = 2.0 * math.pi
    nx, ny, nz = dot(n, x) * s, dot(n, y) * s, dot(n, z) * c
    columns, rows = image.shape[1], image.shape[0]
    low_row, along = 0, 0.0
    if columns > 0:
        v = theta / math.pi * rows - 0.5
        low_row = math.floor(v)
        along = v - low_row
    for k in range(got):
        low, high = cuts[k], cuts[k + 1]
        if high <= low:
            continue
        turn = 0.5 * (low + high)
        p, q = s * math.cos(turn), s * math.sin(turn)
        way = (
            p * x[0] + q * y[0] + c * z[0],
            p * x[1] + q * y[1] + c * z[1],
            p * x[2] + q * y[2] + c * z[2],
        )
        if not _inside(circles, count, way):
            continue
        if columns == 0:
            half = 0.5 * (high - low)
            chord = 2.0 * math.sin(half)
            value[0] += chord * (nx * math.cos(turn) + ny * math.sin(turn)) + nz * (high - low)
            continue
        # the middles of pixels are knots; the longitude falls along the row
        width = 2.0 * math.pi / columns
        start = low
        while start < high:
            cell = math.floor((start + 1e-12) / width - 0.5)
            end = min(high, (cell + 1.5) * width)
            if end - start > 1e-13:
                for node in range(COLUMN_NODES.size):
                    psi = 0.5 * (start + end) + 0.5 * (end - start) * COLUMN_NODES[node]
                    weight = 0.5 * (end - start) * COLUMN_WEIGHTS[node]
                    weight *= nx * math.cos(psi) + ny * math.sin(psi) + nz
                    u = (0.5 - psi / (2.0 * math.pi)) * columns - 0.5
                    column = math.floor(u)
                    share = u - column
                    left, right = column % columns, (column + 1) % columns
                    top, under = low_row % rows, (low_row + 1) % rows
                    for channel in range(3):
                        one = image[top, left, channel] * (1.0 - share)
                        one += image[top, right, channel] * share
                        two = image[under, left, channel] * (1.0 - share)
                        two += image[under, right, channel] * share
                        value[channel] += weight * (one * (1.0 - along) + two * along)
            start = max(end, start + 1e-13)


@jit
def _piece(circles, count, frame, n, profile, image, low, high, cuts, value, total):
    """Integral (3,) over the latitudes of a piece, in `total`."""
    total[:] = 0.0
    for node in range(NODES.size):
        angle = 0.5 * math.pi * NODES[node]
        theta = 0.5 * (low + high) + 0.5 * (high - low) * math.sin(angle)
        weight = 0.25 * math.pi * (high - low) * math.cos(angle) * WEIGHTS[node]
        weight *= math.sin(theta) * _level(profile, math.cos(theta))
        if weight == 0.0:
            continue
        value[:] = 0.0
        _along(circles, count, frame, n, image, theta, cuts, value)
        for channel in range(3):
            total[channel] += weight * value[channel]


@jit
def _integral(circles, count, frame, n, profile, image, found, cuts, value, parts, result):
    """Integral (3,) over all latitudes, in `result`: pieces are halved until their halves agree."""
    got = _latitudes(circles, count, frame, profile, image.shape[0], found)
    enough = ACCURACY
    for i in range(count):
        if circles[i, 4] == LIT:
            enough = min(enough, ACCURACY * math.sqrt(1.0 - circles[i, 3] ** 2))
    stack = np.empty((DEEPEST + 2, 6))
    result[:] = 0.0
    for k in range(got - 1):
        if found[k + 1] - found[k] < SHORTEST:
            continue
        args = (circles, count, frame, n, profile, image)
        _piece(*args, found[k], found[k + 1], cuts, value, parts[0])
        stack[0, 0], stack[0, 1], stack[0, 2] = found[k], found[k + 1], 0.0
        stack[0, 3:] = parts[0]
        size = 1
        while size:
            size -= 1
            low, high, depth = stack[size, 0], stack[size, 1], stack[size, 2]
            parts[0, :] = stack[size, 3:]
            middle = 0.5 * (low + high)
            _piece(*args, low, middle, cuts, value, parts[1])
            _piece(*args, middle, high, cuts, value, parts[2])
            off = np.abs(parts[1] + parts[2] - parts[0]).max()
            if off <= enough or depth >= DEEPEST - 1:
                result += parts[1] + parts[2]
                continue
            stack[size, 0], stack[size, 1], stack[size, 2] = low, middle, depth + 1.0
            stack[size, 3:] = parts[1]
            stack[size + 1, 0], stack[size + 1, 1], stack[size + 1, 2] = middle, high, depth + 1.0
            stack[size + 1, 3:] = parts[2]
            size += 2


@jit
def _integrals(circles, counts, frames, normal, profiles, images, result):
    most = circles.shape[1]
    found = np.empty(8 + 2 * most + most * most + images.shape[1])
    cuts = np.empty(2 * most + 4)
    value, parts = np.zeros(3), np.zeros((3, 3))
    for case in range(circles.shape[0]):
        frame = (vector(frames[case, 0], 0), vector(frames[case, 1], 0), vector(frames[case, 2], 0))
        image = images[case % images.shape[0]]
        _integral(
            circles[case], counts[case], frame, vector(normal[case], 0), profiles[case], image,
            found, cuts, value, parts, result[case],
        )  # fmt: skip


def integrals(circles, normal, frame, profile=None, images=None):
    """Integrals of L n.w over regions: (n, 3), of which the first counts without images.

    circles : (n, k, 5); rows of zeros at the end are none.  normal : (n, 3) unit vectors.
    frame : (n, 3, 3) unit vectors x, y, z, of which z is the axis of the profile or the image.
    profile : (n, 3) kind, cosines of the outer and the inner cone; of `SPREAD` the last is 1.
    images : (m, rows, columns, 3), of which case i has number i modulo m.
    """
    n = len(circles)
    counts = (np.abs(circles[:, :, :3]).max(axis=2) > 0.0).sum(axis=1)
    profile = np.zeros((n, 3)) if profile is None else np.asarray(profile, dtype=float)
    images = NO_IMAGE[None] if images is None else np.asarray(images, dtype=float)
    result = np.zeros((n, 3))
    parts = (circles, counts, frame, normal, profile, images)
    _integrals(*map(np.ascontiguousarray, parts), result)
    return result
