# SPDX-License-Identifier: GPL-3.0-or-later
"""What the kernels compute, by formulas of their own, over better numbers (`numbers`).

`m` is the kind of number; all arrays are lifted to it, components first. Sides that decide come
as signed margins, positive where the answer is yes.
"""

import numpy as np

from .numbers import LONG, cross, dot

CORNERS = ((1, 1), (-1, 1), (-1, -1), (1, -1))


def positive(x):
    return np.where((x > 0).astype(bool), x, 0 * x)


def where(mask, a, b):
    return np.where(np.asarray(mask).astype(bool), a, b)


def discriminant(m, w, v, r):
    side = cross(w, v)
    return r * r * dot(w, w) - dot(side, side)


def sphere_roots(m, w, v, r):
    """Near and far root of |t w - v| = r in units of |w|, from the foot; half chord 0 for none."""
    length = m.norm(w)
    foot = dot(w, v) / length
    half = m.sqrt(positive(discriminant(m, w, v, r))) / length
    return foot - half, foot + half, half


def lambert(m, corners, n):
    """Integral of max(0, n.w) over a convex polygon (list of (3, n)), clipped by the horizon."""
    total = 0
    heights = [dot(n, c) for c in corners]
    leave = enter = corners[0]
    for k, start in enumerate(corners):
        end, h0, h1 = corners[k - 1], heights[k], heights[k - 1]
        down, rise = (h0 > 0) & (h1 <= 0), (h0 <= 0) & (h1 > 0)
        gap = where(down | rise, h0 - h1, 1 + 0 * h0)
        meet = start + h0 / gap * (end - start)
        a, b = where(rise, meet, start), where(down, meet, end)
        leave, enter = where(down, meet, leave), where(rise, meet, enter)
        total = total + where((h0 > 0) | (h1 > 0), wedge(m, a, b, n), 0 * h0)
    some = heights[0] > 0
    every = heights[0] > 0
    for h in heights[1:]:
        some, every = some | (h > 0), every & (h > 0)
    cut = where(some & ~every.astype(bool), wedge(m, leave, enter, n), 0 * heights[0])
    return where(some, abs(total + cut) / 2, 0 * heights[0])


def wedge(m, a, b, n):
    side = cross(a, b - a)
    size = m.norm(side)
    none = size == 0
    return where(none, 0 * size, m.atan2(size, dot(a, b)) * dot(n, side) / where(none, 1, size))


def quad_corners(to, a, b):
    return [to + x * a + y * b for x, y in CORNERS]


def cap(m, cosine, half_sine, half_cosine):
    """Integral of max(0, n.w) over a cone: by the lune and the horizon's chord (Snyder 1996)."""
    size = m.sqrt(half_sine * half_sine + half_cosine * half_cosine)
    s, half_cosine, c = half_sine / size, half_cosine / size, cosine
    whole = m.pi * s * s * c
    inside = (s - c) * (s + c) > 0
    # half the horizon's arc within the cone, and half the cone's arc above the horizon
    chord = m.sqrt(where(inside, (s - c) * (s + c), 0 * s))
    half_arc = m.atan2(chord, half_cosine)
    above = m.atan2(chord, -c * half_cosine)
    # Stokes over the two arcs: the cone's own, and the horizon's, which adds its length
    part = c * (s * s) * above - half_cosine * chord + half_arc
    # the same for small cones, where the last two cancel: the series of p - atan p
    p = chord / where(half_cosine > s, half_cosine, 1 + 0 * c)
    rest = 0 * p
    for k in range(24, 0, -1):
        rest = 1 / (2 * k + 1 + 0 * p) - p * p * rest
    small = (c * above + p) * (s * s) - rest * p * p * p
    part = where((m is LONG) & (p < 0.2) & (half_cosine > s), small, part)
    return where(inside, part, positive(whole))


def gauss(m):
    """Six Gauss-Legendre places and weights on [0, 1], refined in the arithmetic of m."""
    x, _ = np.polynomial.legendre.leggauss(6)
    x = m.lift(x)
    for _ in range(3):  # Newton on P6
        p0, p1 = 1 + 0 * x, x
        for k in range(2, 7):
            p0, p1 = p1, ((2 * k - 1) * x * p1 - (k - 1) * p0) / k
        slope = 6 * (x * p1 - p0) / (x * x - 1)
        x = x - p1 / slope
    return (1 + x) / 2, 1 / ((1 - x * x) * slope * slope)


def small_quad(m, to, a, b, n):
    """`lambert` of a quad much smaller than its distance, without its cancellation.

    The part above the horizon as a fan of triangles in (x, y), each a squeezed square.
    """
    h, ha, hb = dot(n, to), dot(n, a), dot(n, b)
    spots = [np.stack([x + 0 * h, y + 0 * h]) for x, y in CORNERS]
    heights = [h + x * ha + y * hb for x, y in spots]
    pieces, pivot = [], spots[0]
    for k, start in enumerate(spots):
        end, h0, h1 = spots[k - 1], heights[k], heights[k - 1]
        down, rise = (h0 > 0) & (h1 <= 0), (h0 <= 0) & (h1 > 0)
        gap = where(down | rise, h0 - h1, 1 + 0 * h0)
        meet = start + h0 / gap * (end - start)
        pivot = where(rise, meet, pivot)
        p, q = where(rise, meet, start), where(down, meet, end)
        pieces.append((p, q, (h0 > 0) | (h1 > 0)))
    total = 0 * h
    places, weights = gauss(m)
    for start, end, seen in pieces:
        p, q = start - pivot, end - pivot
        area = abs(p[0] * q[1] - p[1] * q[0])
        for s, weight in zip(places, weights, strict=True):
            for t, other in zip(places, weights, strict=True):
                x, y = pivot + s * ((1 - t) * p + t * q)
                place = to + x * a + y * b
                square = dot(place, place)
                value = s * weight * other * area * (h + x * ha + y * hb) / (square * square)
                total = total + where(seen, value, 0 * h)
    return -dot(to, cross(a, b)) * total
