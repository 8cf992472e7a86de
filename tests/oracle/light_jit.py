# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance factors at one surface point, compiled: which occluders matter, then `arcs_jit`.

Shapes and lights must not touch each other: a convex occluder then lies wholly before a convex
light or wholly beyond it, and a plane between them tells which.
"""

import math

from .arcs_jit import ALONE, LIT, lit, put_arc, put_circle
from .vectors_jit import add, cross, dot, jit, less, times, vector

__all__ = ["DISK", "POINT", "QUAD", "SPHERE", "factor"]

QUAD, SPHERE, DISK, POINT = 0, 1, 2, 3


@jit
def _nearest_on_quad(corner, u, v, p):
    """Point of corner + a u + b v, a and b in 0..1, nearest p: by turns, until they rest."""
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    d = less(p, corner)
    du, dv = dot(d, u), dot(d, v)
    a = b = 0.5
    for _ in range(200):
        last = a
        a = min(max((du - b * uv) / uu, 0.0), 1.0)
        b = min(max((dv - a * uv) / vv, 0.0), 1.0)
        if a == last:
            break
    return add(corner, add(times(a, u), times(b, v)))


@jit
def _nearest_on_triangle(corner, u, v, p):
    """Point of corner + a u + b v, a, b and 1 - a - b in 0..1, nearest p."""
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    d = less(p, corner)
    du, dv = dot(d, u), dot(d, v)
    det = uu * vv - uv * uv
    a, b = (du * vv - dv * uv) / det, (dv * uu - du * uv) / det
    if a >= 0.0 and b >= 0.0 and a + b <= 1.0:
        return add(corner, add(times(a, u), times(b, v)))
    best, found = math.inf, corner
    starts, edges = (corner, corner, add(corner, u)), (u, v, less(v, u))
    for k in range(3):
        start, edge = starts[k], edges[k]
        share = min(max(dot(less(p, start), edge) / dot(edge, edge), 0.0), 1.0)
        point = add(start, times(share, edge))
        gap = less(point, p)
        if dot(gap, gap) < best:
            best, found = dot(gap, gap), point
    return found


@jit
def _before(kind, light, c, v, r):
    """Whether a ball at v, as seen from 0, lies before a light: the plane between decides."""
    if kind == QUAD:
        normal = vector(light, 9)
        ahead = dot(normal, less(v, c))
        if ahead >= r:
            return True
        if ahead <= -r:
            return False
        u, w = vector(light, 3), vector(light, 6)
        near = _nearest_on_quad(less(less(c, u), w), times(2.0, u), times(2.0, w), v)
        return dot(near, near) > dot(near, v)
    away = less(c, v)
    return dot(away, v) + r * math.sqrt(dot(away, away)) > 0.0


@jit
def _clip(polygon, count, normal, offset, spare):
    """Keep, in place, of a polygon's first rows what lies where normal.x > offset: new count."""
    n = 0
    for i in range(count):
        a, b = vector(polygon[i], 0), vector(polygon[(i + 1) % count], 0)
        ha, hb = dot(normal, a) - offset, dot(normal, b) - offset
        if ha > 0.0:
            spare[n, 0], spare[n, 1], spare[n, 2] = a
            n += 1
        if (ha > 0.0) != (hb > 0.0):
            spare[n, 0], spare[n, 1], spare[n, 2] = add(a, times(ha / (ha - hb), less(b, a)))
            n += 1
    for i in range(n):
        for k in range(3):
            polygon[i, k] = spare[i, k]
    return n


@jit
def _polygon(corners, normal, spare):
    """Lambert's formula for a quad seen from 0, its corners clipped by the horizon in place."""
    count = _clip(corners, 4, normal, 0.0, spare)
    total = 0.0
    for i in range(count):
        a, b = vector(corners[i], 0), vector(corners[(i + 1) % count], 0)
        m = cross(a, b)
        size = math.sqrt(dot(m, m))
        if size > 0.0:
            total += math.atan2(size, dot(a, b)) * dot(m, normal) / size
    return 0.5 * abs(total)


@jit
def _point_light(balls, quads, c, p, n, t, own, casts):
    dd = dot(c, c)
    cosine = dot(n, c) / math.sqrt(dd)
    if cosine <= 0.0:
        return 0.0
    for i in range(balls.shape[0] if casts else 0):
        if i == own:
            continue
        q = balls[i]
        v = less(add(vector(q, 0), times(t, vector(q, 4))), p)
        share = min(max(dot(v, c) / dd, 0.0), 1.0)
        off, last, rr = less(v, times(share, c)), less(c, v), q[3] * q[3]
        if dot(off, off) < rr and (dot(v, v) > rr or dot(last, last) > rr):
            return 0.0
    for i in range(quads.shape[0] if casts else 0):
        if balls.shape[0] + i == own:
            continue
        q = quads[i]
        v = less(add(vector(q, 0), times(t, vector(q, 9))), p)
        normal = vector(q, 12)
        k, along = dot(normal, v), dot(normal, c)
        if k * along <= 0.0 or abs(k) >= abs(along):
            continue
        at = less(times(k / along, c), v)
        e, f = vector(q, 3), vector(q, 6)
        area = dot(cross(e, f), normal)
        a, b = dot(cross(at, f), normal) / area, dot(cross(e, at), normal) / area
        if a > 0.0 and b > 0.0 and (max(a, b) if q[18] == 4.0 else a + b) < 1.0:
            return 0.0
    return cosine / dd


@jit
def _put_quad(q, group, light, p, n, t, view, circles, count, space):
    """Add a quad's edges to the circles: new count, -1 if it hides the light, else `count`."""
    kind, c, axis, _, sine, _ = view
    corners, shape, spare = space
    v = less(add(vector(q, 0), times(t, vector(q, 9))), p)
    normal = vector(q, 12)
    side = dot(normal, v)
    turn = 1.0 if side > 0.0 else -1.0
    # the light's reach beyond the quad's plane, on the other side than p
    beyond = turn * (dot(normal, c) - side)
    if kind == QUAD:
        beyond += abs(dot(normal, vector(light, 3))) + abs(dot(normal, vector(light, 6)))
    else:
        beyond += light[12]
    if side == 0.0 or beyond <= 0.0:
        return count
    e, f = vector(q, 3), vector(q, 6)
    height, he, hf = dot(n, v), dot(n, e), dot(n, f)
    if height + max(he, 0.0) + max(hf, 0.0) <= 0.0:
        return count
    sides = int(q[18])
    shape[0, 0], shape[0, 1], shape[0, 2] = v
    shape[2, 0], shape[2, 1], shape[2, 2] = add(add(v, e), f)
    one, three = (add(v, e), add(v, f)) if turn > 0.0 else (add(v, f), add(v, e))
    shape[1, 0], shape[1, 1], shape[1, 2] = one
    shape[sides - 1, 0], shape[sides - 1, 1], shape[sides - 1, 2] = three
    if kind == QUAD:
        facing = vector(light, 9)
        sides = _clip(shape, sides, facing, dot(facing, c), spare)
        if sides < 3 or _apart(corners, shape, sides):
            return count
    else:
        if sides == 4:
            near = _nearest_on_quad(v, e, f, c)
        else:
            near = _nearest_on_triangle(v, e, f, c)
        if dot(less(near, c), near) > 0.0:
            return count
    last, hides = count, True
    for k in range(sides):
        a, b = vector(shape[k], 0), vector(shape[(k + 1) % sides], 0)
        if not put_arc(circles, last, a, b, group):
            continue
        m = vector(circles[last], 0)
        if kind == QUAD:
            some, every = False, True
            for j in range(4):
                inside = dot(m, vector(corners[j], 0)) > 0.0
                some, every = some or inside, every and inside
        else:
            h = dot(m, axis)
            some, every = h > -sine, h >= sine
        if not some:
            return count
        hides = hides and every
        last += 1
    return -1 if hides else last


@jit
def _apart(corners, shape, sides):
    """Whether an edge of the light has all of a polygon on its outer side."""
    for j in range(4):
        m = cross(vector(corners[j], 0), vector(corners[(j + 1) % 4], 0))
        outside = True
        for k in range(sides):
            outside = outside and dot(m, vector(shape[k], 0)) <= 0.0
        if outside:
            return True
    return False


@jit
def _put_balls(balls, light, p, n, t, own, view, circles, count, corners):
    """Add spheres' outlines to the circles: new count, -1 if one of them hides the light."""
    kind, c, axis, cosine, sine, wide = view
    for i in range(balls.shape[0]):
        q = balls[i]
        r = q[3]
        v = (q[0] + t * q[4] - p[0], q[1] + t * q[5] - p[1], q[2] + t * q[6] - p[2])
        if dot(n, v) <= -r or i == own:
            continue
        vv = dot(v, v)
        if vv <= r * r:
            away = less(c, v)
            if dot(away, away) > r * r:
                return -1
            continue
        # together <= d cos(a + b), with d cos(a) = sqrt(vv - r r), squared: most fail here
        together = dot(v, axis)
        ahead = together + r * sine
        if not wide and (ahead <= 0.0 or ahead * ahead <= cosine * cosine * (vv - r * r)):
            continue
        if not _before(kind, light, c, v, r):
            continue
        d = math.sqrt(vv)
        sa, ca = r / d, math.sqrt((d - r) * (d + r)) / d
        if kind == QUAD:
            hidden, apart = True, False
            for k in range(4):
                a, b = vector(corners[k], 0), vector(corners[(k + 1) % 4], 0)
                hidden = hidden and dot(v, a) >= ca * d * math.sqrt(dot(a, a))
                m = cross(a, b)
                apart = apart or dot(m, v) <= -r * math.sqrt(dot(m, m))
            if apart:
                continue
        else:
            hidden = sa >= sine and together >= d * (cosine * ca + sine * sa)
        if hidden:
            return -1
        put_circle(circles, count, times(1.0 / d, v), ca, sa, ALONE)
        count += 1
    return count


@jit
def _look(light, kind, c, n, corners):
    """A light's bounding cone and its lowest and highest point over the horizon (signs count)."""
    distance = math.sqrt(dot(c, c))
    axis = times(1.0 / distance, c)
    low, high, cosine, wide = math.inf, -math.inf, 1.0, False
    if kind == QUAD:
        u, v = vector(light, 3), vector(light, 6)
        # seen from its front, so that the inside is on the left of each edge
        for k in range(4):
            a = 1.0 if k in (0, 1) else -1.0
            b = 1.0 if k in (0, 3) else -1.0
            corner = add(c, add(times(a, u), times(b, v)))
            corners[k, 0], corners[k, 1], corners[k, 2] = corner
            h = dot(n, corner)
            low, high = min(low, h), max(high, h)
            cosine = min(cosine, dot(axis, corner) / math.sqrt(dot(corner, corner)))
        wide = cosine <= 0.0
        sine = math.sqrt(max(1.0 - cosine * cosine, 0.0))
    else:
        r = light[12]
        if kind == SPHERE:
            sine, cosine = r / distance, math.sqrt((distance - r) * (distance + r)) / distance
        else:
            slant = math.sqrt(distance * distance + r * r)
            sine, cosine = r / slant, distance / slant
        h = dot(n, axis)
        low, high = h - sine, h + sine
    return axis, cosine, sine, wide, low, high


@jit
def factor(balls, quads, light, p, n, t, own, inside, circles, cuts, space):
    """Irradiance over radiance (over intensity for a point) that a light brings to p.

    Parameters
    ----------
    balls, quads, light : of `rays_jit.pack`.  p, n : the point and the unit normal on the
        camera's side.  t : shutter time.  own : index of the shape p lies on.
    inside : whether that is a sphere seen from within.  space : three (6, 3) scratch arrays.
    """
    kind = int(light[13])
    c = less(add(vector(light, 0), times(t, vector(light, 14))), p)
    casts = light[17] != 0.0
    if inside and casts:
        v = less(add(vector(balls[own], 0), times(t, vector(balls[own], 4))), add(p, c))
        if dot(v, v) > balls[own, 3] ** 2:
            return 0.0
    if kind == POINT:
        return _point_light(balls, quads, c, p, n, t, own, casts)
    corners, _, spare = space
    if kind == QUAD and dot(vector(light, 9), c) >= 0.0:
        return 0.0
    axis, cosine, sine, wide, low, high = _look(light, kind, c, n, corners)
    if high <= 0.0:
        return 0.0
    first = 5 if kind == QUAD else 2
    count = first
    if casts:
        view = (kind, c, axis, cosine, sine, wide)
        count = _put_balls(balls, light, p, n, t, own, view, circles, count, corners)
        for i in range(quads.shape[0] if count > 0 else 0):
            if balls.shape[0] + i != own:
                count = _put_quad(quads[i], 2.0 + i, light, p, n, t, view, circles, count, space)
                if count < 0:
                    break
        if count < 0:
            return 0.0
    if count == first:
        if kind == QUAD:
            return _polygon(corners, n, spare)
        if low >= 0.0:
            return math.pi * sine * sine * 0.5 * (low + high)
    start = 1
    if kind == QUAD:
        for k in range(4):
            a, b = vector(corners[k], 0), vector(corners[(k + 1) % 4], 0)
            put_arc(circles, 1 + k, a, b, LIT)
    else:
        put_circle(circles, 1, axis, cosine, sine, LIT)
    if low < 0.0:
        start = 0
        put_circle(circles, 0, n, 0.0, 1.0, LIT)
    return lit(circles[start:], count - start, n, cuts)
