# SPDX-License-Identifier: GPL-3.0-or-later
"""Light from one point, compiled: what is seen of a light, by brute force over arcs.

Every boundary is a circle on the sphere of directions, or an arc of one: an edge of a rectangle,
the horizon, a round outline. Each is cut wherever it meets any other, and the middle of each
piece is tested against everything. No unions of intervals, no order: that is the difference to
the core.

A row of `circles` is: axis (0:3), cosine and sine of the half angle (3, 4), frame u, w (5:8,
8:11), group (11), length of the arc from u on (12; 0 = all of the circle). Groups: 0 = bounds what
is lit (its inside counts), 1 = hides alone, more = hides with the others of its group.
"""

import math

from .vectors_jit import cross, dot, jit, times, vector

__all__ = ["CIRCLE", "lit", "put_arc", "put_circle"]

CIRCLE = 13
"""Numbers in a row of `circles`."""

LIT, ALONE = 0.0, 1.0
TURN = 2.0 * math.pi


@jit
def _put(circles, k, axis, cosine, sine, u, w, group, length):
    row = circles[k]
    row[0], row[1], row[2], row[3], row[4] = axis[0], axis[1], axis[2], cosine, sine
    row[5], row[6], row[7] = u[0], u[1], u[2]
    row[8], row[9], row[10] = w[0], w[1], w[2]
    row[11], row[12] = group, length


@jit
def put_circle(circles, k, axis, cosine, sine, group):
    """Write row k: a whole circle about a unit axis."""
    x, y, z = axis
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        u = (0.0, -z, y)
    elif abs(y) <= abs(z):
        u = (z, 0.0, -x)
    else:
        u = (-y, x, 0.0)
    u = times(1.0 / math.sqrt(dot(u, u)), u)
    _put(circles, k, axis, cosine, sine, u, cross(axis, u), group, 0.0)


@jit
def put_arc(circles, k, a, b, group):
    """Write row k: the arc in which the edge from a to b is seen; inside is on its left.

    Returns whether there is one.
    """
    m = cross(a, b)
    size = math.sqrt(dot(m, m))
    if size == 0.0:
        return False
    m = times(1.0 / size, m)
    u = times(1.0 / math.sqrt(dot(a, a)), a)
    _put(circles, k, m, 0.0, 1.0, u, cross(m, u), group, math.atan2(size, dot(a, b)))
    return True


@jit
def _kept(circles, count, mine, direction):
    """Whether a direction on circle `mine` borders on light that is seen."""
    own = circles[mine, 11]
    arc = circles[mine, 12] > 0.0
    group, within = LIT, False
    for j in range(count):
        row = circles[j]
        kind = row[11]
        if j == mine or (arc and kind == own and row[12] > 0.0):
            continue
        inside = dot(vector(row, 0), direction) >= row[3]
        if kind == LIT:
            if not inside:
                return False
        elif kind == ALONE:
            if inside:
                return False
        elif kind == group:
            within = within and inside
        else:
            if within:
                return False
            group, within = kind, inside
    return not within


@jit
def _cut(circles, count, i, cuts):
    """Angles, in order, at which circle or arc i meets others: how many, kept in `cuts`."""
    row = circles[i]
    axis, c, s, u, w = vector(row, 0), row[3], row[4], vector(row, 5), vector(row, 8)
    length = row[12]
    top = length if length > 0.0 else TURN
    found = 0
    for j in range(count):
        other = circles[j]
        if j == i or (length > 0.0 and other[12] > 0.0 and other[11] == row[11]):
            continue
        b = vector(other, 0)
        p, q = s * dot(u, b), s * dot(w, b)
        d = c * dot(axis, b) - other[3]
        r = math.sqrt(p * p + q * q)
        if abs(d) >= r:
            continue
        middle, half = math.atan2(q, p), math.acos(-d / r)
        for side in range(2):
            turn = middle - half if side == 0 else middle + half
            if turn < 0.0:
                turn += TURN
            elif turn >= TURN:
                turn -= TURN
            if turn >= top:
                continue
            k = found
            while k > 0 and cuts[k - 1] > turn:
                cuts[k] = cuts[k - 1]
                k -= 1
            cuts[k] = turn
            found += 1
    return found


@jit
def lit(circles, count, n, cuts):
    """Integral of max(0, n.w) over what the first `count` circles leave; rows of a group adjoin.

    `cuts` is scratch for 2 * count + 2 angles. The horizon is to be one of the circles if it
    cuts the light.
    """
    total = 0.0
    for i in range(count):
        row = circles[i]
        axis, c, s, u, w = vector(row, 0), row[3], row[4], vector(row, 5), vector(row, 8)
        found = _cut(circles, count, i, cuts)
        na, nu, nw = dot(n, axis), dot(n, u), dot(n, w)
        pieces = found
        if row[12] > 0.0:
            low, pieces = 0.0, found + 1
            cuts[found] = row[12]
        elif found == 0:
            low, pieces = 0.0, 1
            cuts[0] = TURN
        else:
            low = cuts[found - 1] - TURN
        part = 0.0
        for k in range(pieces):
            high = cuts[k]
            if high > low:
                middle = 0.5 * (low + high)
                cosine, sine = math.cos(middle), math.sin(middle)
                p, q = s * cosine, s * sine
                direction = (
                    c * axis[0] + p * u[0] + q * w[0],
                    c * axis[1] + p * u[1] + q * w[1],
                    c * axis[2] + p * u[2] + q * w[2],
                )
                if _kept(circles, count, i, direction):
                    part += s * s * (high - low) * na
                    if c != 0.0:
                        # differences of sines and cosines as products: short arcs keep digits
                        part -= (
                            s * c * 2.0 * math.sin(0.5 * (high - low)) * (nu * cosine + nw * sine)
                        )
            low = high
        total += 0.5 * part if row[11] == LIT else -0.5 * part
    return max(total, 0.0)
