# SPDX-License-Identifier: GPL-3.0-or-later
"""Light over regions of directions by latitudes: brute force for all kinds of lights. No core code.

A region is all of the sphere that lies inside some circles, the horizon among them, and not inside
others, nor inside all circles of a group. Along a latitude, a circle about the axis of the light's
profile or of the sky's image, every circle is met at known angles; between them n.w has an
antiderivative, and so it has times a radiance that is linear in the longitude. Across the latitudes
the integrand is smooth but for roots where circles of the region's boundary touch a latitude or
cross each other, or rows of the image: Gauss-Legendre between these, in a variable that removes the
roots.

Circles (k, 5) : unit axis, cosine of the half angle, group. Group 0 bounds what is lit, 1 hides by
itself, others hide together with those of the same number. Polygons are circles of 90 degrees.
"""

import math

import numpy as np

from .vectors_jit import cross, dot, jit, vector

__all__ = ["ALONE", "CONE", "LIT", "SPREAD", "UNIFORM", "integrals"]

LIT, ALONE = 0.0, 1.0
UNIFORM, CONE, SPREAD = 0, 1, 2
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
SHORTEST = 1e-13
"""Radians of a piece that is left out."""
ACCURACY, DEEPEST = 2e-12, 30
"""Difference of a piece and its halves that is small enough unless told, for the sine of the half
angle of the smallest circle that bounds what is lit; and the most halvings of a piece."""
NEAR = 1e-6
"""Difference of a cosine within which a direction counts as on a circle, where latitudes are looked
for at which the integrand is not smooth: one too many costs time alone. Where circles touch, the
places at which they cross are known to 1e-8."""
NO_IMAGE = np.zeros((0, 0, 3))
AX, AY, AZ, COSINE, GROUP, ASIDE, MIDDLE = range(7)
"""A circle as a row: its axis in the frame, cosine and group, the axis' distance from the frame's
z and its longitude."""


@jit
def _above(row, way):
    """Cosine of the angle from a circle's axis to a direction, less that of its half angle."""
    return dot(vector(row, AX), way) - row[COSINE]


@jit
def _inside(circles, count, way):
    """Whether a direction is in the region."""
    group, within = 0.0, False
    for j in range(count):
        row = circles[j]
        inside = _above(row, way) > 0.0
        if row[GROUP] == LIT:
            if not inside:
                return False
        elif row[GROUP] == ALONE:
            if inside:
                return False
        elif row[GROUP] == group:
            within = within and inside
        else:
            if within:
                return False
            group, within = row[GROUP], inside
    return not within


@jit
def _on_boundary(circles, count, way, first, second):
    """Whether the region's boundary may pass through a direction on two circles (or one twice),
    along both: others neither leave it out nor keep their group from hiding there."""
    one, two = circles[first, GROUP], circles[second, GROUP]
    group, within = 0.0, False
    for j in range(count):
        if j in (first, second):
            continue
        row = circles[j]
        gap = _above(row, way)
        if row[GROUP] == LIT:
            if gap < -NEAR:
                return False
        elif row[GROUP] == ALONE:
            if gap > NEAR:
                return False
        elif row[GROUP] in (one, two):
            if gap < -NEAR:
                return False
        elif row[GROUP] == group:
            within = within and gap > NEAR
        else:
            if within:
                return False
            group, within = row[GROUP], gap > NEAR
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
def _extremes(circles, count, i, found, got):
    """Add the latitudes between which a circle lies, where it bounds the region there."""
    row = circles[i]
    beta, gamma = math.atan2(row[ASIDE], row[AZ]), math.acos(row[COSINE])
    for angle in (beta - gamma, beta + gamma):
        s = math.sin(angle)
        way = (s * math.cos(row[MIDDLE]), s * math.sin(row[MIDDLE]), math.cos(angle))
        # about the frame's own axis, a circle is at one latitude all around
        if row[ASIDE] < NEAR or _on_boundary(circles, count, way, i, i):
            found[got] = abs(angle) if angle <= math.pi else 2.0 * math.pi - angle
            got += 1
    return got


@jit
def _crossings(circles, count, i, j, found, got):
    """Add the latitudes at which two circles cross, where both bound the region there."""
    a, b = vector(circles[i], AX), vector(circles[j], AX)
    n = cross(a, b)
    nn = dot(n, n)
    if nn < 1e-30:
        return got
    c, d, ab = circles[i, COSINE], circles[j, COSINE], dot(a, b)
    p, q = (c - d * ab) / nn, (d - c * ab) / nn
    rest = 1.0 - p * p - q * q - 2.0 * p * q * ab
    if rest <= 0.0:
        return got
    r = math.sqrt(rest / nn)
    for side in (-r, r):
        w = (
            p * a[0] + q * b[0] + side * n[0],
            p * a[1] + q * b[1] + side * n[1],
            p * a[2] + q * b[2] + side * n[2],
        )
        # axes of 1e-8 apart tell of their crossings no more than that
        if nn < NEAR or _on_boundary(circles, count, w, i, j):
            found[got] = math.atan2(math.hypot(w[0], w[1]), w[2])
            got += 1
    return got


@jit
def _latitudes(circles, count, profile, rows, found):
    """Latitudes in order at which the integrand is not smooth: how many, in `found`."""
    found[0], found[1] = 0.0, math.pi
    got = 2
    for i in range(count):
        got = _extremes(circles, count, i, found, got)
        for j in range(i):
            got = _crossings(circles, count, i, j, found, got)
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
def _longitudes(circles, count, s, c, cuts):
    """Longitudes in order, from 0 to 2 pi, at which a latitude meets circles: how many."""
    cuts[0] = 0.0
    got = 1
    for j in range(count):
        aside = circles[j, ASIDE] * s
        gap = circles[j, COSINE] - circles[j, AZ] * c
        if aside == 0.0 or abs(gap) >= aside:
            continue
        half = math.acos(gap / aside)
        for turn in (circles[j, MIDDLE] - half, circles[j, MIDDLE] + half):
            cuts[got] = turn - 2.0 * math.pi * math.floor(turn / (2.0 * math.pi))
            got += 1
    _sort(cuts, got)
    cuts[got] = 2.0 * math.pi
    return got + 1


@jit
def _along(circles, count, n, image, theta, cuts, value):
    """Add the integral (3,) of L n.w along a latitude."""
    s, c = math.sin(theta), math.cos(theta)
    scaled = (n[0] * s, n[1] * s, n[2] * c)
    got = _longitudes(circles, count, s, c, cuts)
    for k in range(got - 1):
        low, high = cuts[k], cuts[k + 1]
        if high <= low:
            continue
        turn = 0.5 * (low + high)
        p, q = math.cos(turn), math.sin(turn)
        if not _inside(circles, count, (s * p, s * q, c)):
            continue
        if image.shape[1] == 0:
            half = 0.5 * (high - low)
            value[0] += 2.0 * math.sin(half) * (scaled[0] * p + scaled[1] * q)
            value[0] += scaled[2] * (high - low)
        else:
            _along_image(image, theta, scaled, low, high, value)


@jit
def _along_image(image, theta, n, low, high, value):
    """Add the integral (3,) of an image's radiance times n . (cos, sin, 1) along longitudes.

    Between the middles of pixels, which are knots, the radiance is linear in the longitude, which
    falls along the row: the integral is a closed form.
    """
    rows, columns = image.shape[0], image.shape[1]
    v = theta / math.pi * rows - 0.5
    row = math.floor(v)
    along = v - row
    top, under = row % rows, (row + 1) % rows
    width = 2.0 * math.pi / columns
    start = low
    c0, s0 = math.cos(low), math.sin(low)
    while start < high:
        cell = math.floor((start + 1e-12) / width - 0.5)
        end = min(high, (cell + 1.5) * width)
        d, c1, s1 = end - start, math.cos(end), math.sin(end)
        even = n[0] * (s1 - s0) - n[1] * (c1 - c0) + n[2] * d
        rise = n[0] * (d * s1 + c1 - c0) + n[1] * (s1 - s0 - d * c1) + 0.5 * n[2] * d * d
        u = (0.5 - 0.5 * (start + end) / (2.0 * math.pi)) * columns - 0.5
        column = math.floor(u)
        share = (0.5 - start / (2.0 * math.pi)) * columns - 0.5 - column
        left, right = column % columns, (column + 1) % columns
        for channel in range(3):
            one = image[top, left, channel] * (1.0 - along) + image[under, left, channel] * along
            two = image[top, right, channel] * (1.0 - along) + image[under, right, channel] * along
            value[channel] += even * (one + share * (two - one)) - rise * (two - one) / width
        start = max(end, start + SHORTEST)
        c0, s0 = c1, s1


@jit
def _piece(circles, count, n, profile, image, low, high, cuts, value, total):
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
        _along(circles, count, n, image, theta, cuts, value)
        for channel in range(3):
            total[channel] += weight * value[channel]


@jit
def _integral(circles, count, n, profile, image, accuracy, found, cuts, value, parts, result):
    """Integral (3,) over all latitudes, in `result`: pieces are halved until their halves agree."""
    got = _latitudes(circles, count, profile, image.shape[0], found)
    enough = accuracy
    for i in range(count):
        if circles[i, GROUP] == LIT:
            enough = min(enough, accuracy * math.sqrt(1.0 - circles[i, COSINE] ** 2))
    stack = np.empty((DEEPEST + 2, 6))
    result[:] = 0.0
    for k in range(got - 1):
        if found[k + 1] - found[k] < SHORTEST:
            continue
        args = (circles, count, n, profile, image)
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
def _in_frame(circles, count, frame, local):
    """Circles as rows in a frame, in `local`."""
    for j in range(count):
        a = vector(circles[j], 0)
        for k in range(3):
            local[j, AX + k] = dot(a, vector(frame[k], 0))
        local[j, COSINE], local[j, GROUP] = circles[j, 3], circles[j, 4]
        local[j, ASIDE] = math.hypot(local[j, AX], local[j, AY])
        local[j, MIDDLE] = math.atan2(local[j, AY], local[j, AX])


@jit
def _integrals(circles, counts, frames, normal, profiles, images, accuracy, result):
    most = circles.shape[1]
    found = np.empty(8 + 2 * most + most * most + images.shape[1])
    cuts = np.empty(2 * most + 4)
    value, parts, local = np.zeros(3), np.zeros((3, 3)), np.zeros((most, 7))
    for case in range(circles.shape[0]):
        _in_frame(circles[case], counts[case], frames[case], local)
        a = vector(normal[case], 0)
        x, y, z = vector(frames[case, 0], 0), vector(frames[case, 1], 0), vector(frames[case, 2], 0)
        n = (dot(a, x), dot(a, y), dot(a, z))
        image = images[case % images.shape[0]]
        _integral(
            local, counts[case], n, profiles[case], image, accuracy,
            found, cuts, value, parts, result[case],
        )  # fmt: skip


def integrals(circles, normal, frame, profile=None, images=None, accuracy=ACCURACY):
    """Integrals of L n.w over regions: (n, 3), of which the first counts without images.

    circles : (n, k, 5); rows of zeros at the end are none.  normal : (n, 3) unit vectors.
    frame : (n, 3, 3) unit vectors x, y, z, of which z is the axis of the profile or the image.
    profile : (n, 3) kind, cosines of the outer and the inner cone; of `SPREAD` the last is 1.
    images : (m, rows, columns, 3), of which case i has number i modulo m.
    accuracy : difference of a piece and its halves up to which it is not divided: `ACCURACY`.
    """
    n = len(circles)
    counts = (np.abs(circles[:, :, :3]).max(axis=2) > 0.0).sum(axis=1)
    profile = np.zeros((n, 3)) if profile is None else np.asarray(profile, dtype=float)
    images = NO_IMAGE[None] if images is None else np.asarray(images, dtype=float)
    result = np.zeros((n, 3))
    parts = (circles, counts, frame, normal, profile, images)
    _integrals(*map(np.ascontiguousarray, parts), accuracy, result)
    return result
