# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene as arrays, and what a camera ray sees at one point and time, compiled."""

import math

import numpy as np

from adaptive_drt.scene.description import DiskLight, PointLight, QuadLight, Sphere, Triangle

from .camera import rays
from .light_jit import DISK, POINT, QUAD, SPHERE, factor
from .trace import flat_of
from .vectors_jit import add, cross, dot, jit, less, times, vector

__all__ = ["candidates", "events", "pack", "radiance"]

MOST_EVENTS = 4096


def pack(scene):
    """Arrays of a scene, in coordinates that go with the camera, which stays at 0.

    Returns
    -------
    balls (a, 10) : centre, radius, displacement, colour.
    quads (b, 19) : corner, edges, displacement, unit normal, colour, 4 edges, or 3 of a triangle.
    lights (c, 21) : centre, half edges, normal, radius, kind, displacement, casts, power.
    background (3,).  view (3, 3) : direction through picture point (0, 0), its changes by x and y.
    """
    camera = scene.camera
    eye = np.array([row[3] for row in camera.matrix[:3]])
    drift = _way(camera)
    balls = [
        (*(np.array(s.center) - eye), s.radius, *(_way(s) - drift), *s.material.color)
        for s in scene.shapes
        if isinstance(s, Sphere)
    ]
    quads = []
    for s in scene.shapes:
        if not isinstance(s, Sphere):
            place, u, v = flat_of(s)
            n = np.cross(u, v)
            n = n / np.linalg.norm(n)
            edges = 3.0 if isinstance(s, Triangle) else 4.0
            way = _way(s) - drift
            quads.append((*(place - eye), *u, *v, *way, *n, *s.material.color, edges))
    lights = [_light(light, eye, drift) for light in scene.lights]
    spots = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    _, d = rays(camera, spots[:, 0], spots[:, 1], np.zeros(3))
    back = np.array([row[2] for row in camera.matrix[:3]])
    d /= -(d @ (back / np.linalg.norm(back)))[:, None]
    view = np.array([d[0], d[1] - d[0], d[2] - d[0]])
    return (
        np.array(balls, dtype=float).reshape(-1, 10),
        np.array(quads, dtype=float).reshape(-1, 19),
        np.array(lights, dtype=float).reshape(-1, 21),
        np.array(scene.background, dtype=float),
        view,
    )


def _way(thing):
    return np.zeros(3) if thing.motion is None else np.array(thing.motion.displacement)


def _light(light, eye, drift):
    kinds = {QuadLight: QUAD, DiskLight: DISK, PointLight: POINT}
    kind = kinds.get(type(light), SPHERE)
    u = v = n = np.zeros(3)
    if kind == QUAD:
        u, v = np.array(light.half_u), np.array(light.half_v)
        n = np.cross(u, v)
        n = n / np.linalg.norm(n)
    power = light.intensity if kind == POINT else light.radiance
    radius = getattr(light, "radius", 0.0)
    place, way = np.array(light.center) - eye, _way(light) - drift
    return (*place, *u, *v, *n, radius, kind, *way, float(light.casts_shadow), *power)


@jit
def _ray(view, x, y):
    """Direction through a picture point, of depth 1."""
    return (
        view[0, 0] + x * view[1, 0] + y * view[2, 0],
        view[0, 1] + x * view[1, 1] + y * view[2, 1],
        view[0, 2] + x * view[1, 2] + y * view[2, 2],
    )


@jit
def candidates(scene, x, y, found):
    """Shapes that a ray through pixel (x, y) may meet at any time: their count, kept in `found`."""
    balls, quads, view = scene[0], scene[1], scene[4]
    axis = _ray(view, x + 0.5, y + 0.5)
    axis = times(1.0 / math.sqrt(dot(axis, axis)), axis)
    widest = 1.0
    for k in range(4):
        d = _ray(view, x + k % 2, y + k // 2)
        widest = min(widest, dot(axis, d) / math.sqrt(dot(d, d)))
    opening = math.sqrt(max(1.0 - widest * widest, 0.0))
    count = 0
    for i in range(balls.shape[0]):
        c, way = vector(balls[i], 0), vector(balls[i], 4)
        reach = balls[i, 3] + 0.5 * math.sqrt(dot(way, way))
        cc = dot(c, c)
        if cc > reach * reach:
            d = math.sqrt(cc)
            s, co = reach / d, math.sqrt(cc - reach * reach) / d
            # a hair wider than it is, so that rounding loses nothing
            if dot(c, axis) / d < co * widest - s * opening - 1e-9:
                continue
        found[count] = i
        count += 1
    for i in range(quads.shape[0]):
        way = vector(quads[i], 9)
        if dot(way, way) == 0.0 and _misses(quads[i], axis, opening):
            continue
        found[count] = balls.shape[0] + i
        count += 1
    return count


@jit
def _misses(quad, axis, opening):
    """Whether a cone of directions passes by a quad that stands still."""
    v, e, f = vector(quad, 0), vector(quad, 3), vector(quad, 6)
    side = dot(vector(quad, 12), v)
    if side == 0.0:
        return True
    turn = 1.0 if side > 0.0 else -1.0
    far = add(v, add(e, f))
    third = cross(e, far) if quad[18] == 4.0 else cross(add(v, e), less(f, e))
    second = cross(add(v, e), f) if quad[18] == 4.0 else third
    for m in (cross(v, e), second, third, cross(f, v)):
        if turn * dot(m, axis) / math.sqrt(dot(m, m)) < -opening - 1e-9:
            return True
    return False


@jit
def _ball_depth(q, d, dd, t):
    """Ray parameter at which a ball is met, inf if it is not."""
    c = (q[0] + t * q[4], q[1] + t * q[5], q[2] + t * q[6])
    b = dot(c, d) / dd
    off = less(c, times(b, d))
    gap = q[3] * q[3] - dot(off, off)
    if gap <= 0.0:
        return math.inf
    half = math.sqrt(gap / dd)
    return b - half if b - half > 0.0 else b + half


@jit
def _quad_depth(q, d, t):
    """Ray parameter at which a quad is met, inf if it is not."""
    v, n = (q[0] + t * q[9], q[1] + t * q[10], q[2] + t * q[11]), vector(q, 12)
    along = dot(n, d)
    if along == 0.0:
        return math.inf
    s = dot(n, v) / along
    at = less(times(s, d), v)
    e, f = vector(q, 3), vector(q, 6)
    ee, ff, ef = dot(e, e), dot(f, f), dot(e, f)
    pe, pf = dot(at, e), dot(at, f)
    det = ee * ff - ef * ef
    a, b = (pe * ff - pf * ef) / det, (pf * ee - pe * ef) / det
    most = max(a, b) if q[18] == 4.0 else a + b
    return s if a >= 0.0 and b >= 0.0 and most <= 1.0 else math.inf


@jit
def first_hit(scene, among, count, x, y, t):
    """What picture point (x, y) shows at time t, of the shapes `among`.

    Returns its number, -1 for none, the place, the unit normal to the camera's side, and whether
    the camera sees it from within.
    """
    balls, quads, _, _, view = scene
    d = _ray(view, x, y)
    dd = dot(d, d)
    s, i = math.inf, -1
    for k in range(count):
        j = among[k]
        if j < balls.shape[0]:
            depth = _ball_depth(balls[j], d, dd, t)
        else:
            depth = _quad_depth(quads[j - balls.shape[0]], d, t)
        if 0.0 < depth < s:
            s, i = depth, j
    if i < 0:
        return i, d, d, False
    p = times(s, d)
    inside = False
    if i < balls.shape[0]:
        c = add(vector(balls[i], 0), times(t, vector(balls[i], 4)))
        n = less(p, c)
        n = times(1.0 / math.sqrt(dot(n, n)), n)
        p = add(c, times(balls[i, 3], n))
        inside = dot(n, d) > 0.0
    else:
        n = vector(quads[i - balls.shape[0]], 12)
    if dot(n, d) > 0.0:
        n = times(-1.0, n)
    return i, p, n, inside


@jit
def radiance(scene, among, count, x, y, t, circles, cuts, space):
    """What picture point (x, y) shows at time t, RGB; only shapes `among` are looked for."""
    balls, quads, lights, background, _ = scene
    i, p, n, inside = first_hit(scene, among, count, x, y, t)
    if i < 0:
        return background[0], background[1], background[2]
    color = vector(balls[i], 7) if i < balls.shape[0] else vector(quads[i - balls.shape[0]], 15)
    red = green = blue = 0.0
    for k in range(lights.shape[0]):
        e = factor(balls, quads, lights[k], p, n, t, i, inside, circles, cuts, space) / math.pi
        red += e * lights[k, 18]
        green += e * lights[k, 19]
        blue += e * lights[k, 20]
    return red * color[0], green * color[1], blue * color[2]


@jit
def _roots(a, b, c, found, count):
    """Add the roots of a z^2 + b z + c that lie in 0..1, in order: new count."""
    disc = b * b - 4.0 * a * c
    if disc < 0.0:
        return count
    q = -0.5 * (b + math.copysign(math.sqrt(disc), b))
    for k in range(2):
        over, under = (q, a) if k == 0 else (c, q)
        if under == 0.0:
            continue
        z = over / under
        if 0.0 < z < 1.0 and count < found.size:
            at = count
            while at > 0 and found[at - 1] > z:
                found[at] = found[at - 1]
                at -= 1
            found[at] = z
            count += 1
    return count


@jit
def _plane_sphere(e, f, n, k, c, r, found, count):
    """Where e + z f meets the circle in which the plane n.x = k cuts a sphere."""
    ne, nf, ce, cf = dot(n, e), dot(n, f), dot(c, e), dot(c, f)
    square = dot(c, c) - r * r
    a = k * k * dot(f, f) - 2.0 * k * nf * cf + square * nf * nf
    b = 2.0 * (k * k * dot(e, f) - k * (ne * cf + nf * ce) + square * ne * nf)
    g = k * k * dot(e, e) - 2.0 * k * ne * ce + square * ne * ne
    return _roots(a, b, g, found, count)


@jit
def events(scene, among, count, x, y, t, found):
    """Where along the row from (x, y) to (x + 1, y) another shape may come into sight.

    Outlines, borders, and where two shapes cut each other: how many, in 0..1 and in order in
    `found`.
    """
    balls, quads, view = scene[0], scene[1], scene[4]
    e, f = _ray(view, x, y), vector(view[1], 0)
    got = 0
    for k in range(count):
        i = among[k]
        if i < balls.shape[0]:
            c, rr = add(vector(balls[i], 0), times(t, vector(balls[i], 4))), balls[i, 3] ** 2
            ec, fc = cross(e, c), cross(f, c)
            b = 2.0 * (rr * dot(e, f) - dot(ec, fc))
            got = _roots(rr * dot(f, f) - dot(fc, fc), b, rr * dot(e, e) - dot(ec, ec), found, got)
        else:
            q = quads[i - balls.shape[0]]
            v, u, w = add(vector(q, 0), times(t, vector(q, 9))), vector(q, 3), vector(q, 6)
            third = cross(add(v, w), u) if q[18] == 4.0 else cross(add(v, u), less(w, u))
            sides = (cross(v, u), cross(v, w), third, cross(add(v, u), w))
            for side in range(int(q[18])):
                m = sides[side]
                got = _roots(0.0, dot(m, f), dot(m, e), found, got)
            got = _roots(0.0, dot(vector(q, 12), f), dot(vector(q, 12), e), found, got)
        for other in range(k):
            got = _crossing(balls, quads, i, among[other], e, f, t, found, got)
    return got


@jit
def _crossing(balls, quads, i, j, e, f, t, found, got):
    """Add where shapes i and j < i, balls before quads, cut each other."""
    first = balls.shape[0]
    if j >= first:
        q, o = quads[i - first], quads[j - first]
        qn, on = vector(q, 12), vector(o, 12)
        qk = dot(qn, add(vector(q, 0), times(t, vector(q, 9))))
        ok = dot(on, add(vector(o, 0), times(t, vector(o, 9))))
        m = less(times(qk, on), times(ok, qn))
        return _roots(0.0, dot(m, f), dot(m, e), found, got)
    c, r = add(vector(balls[j], 0), times(t, vector(balls[j], 4))), balls[j, 3]
    if i >= first:
        q = quads[i - first]
        n = vector(q, 12)
        k = dot(n, add(vector(q, 0), times(t, vector(q, 9))))
        if abs(dot(n, c) - k) >= r:
            return got
        return _plane_sphere(e, f, n, k, c, r, found, got)
    o, s = add(vector(balls[i], 0), times(t, vector(balls[i], 4))), balls[i, 3]
    n = less(o, c)
    gap = math.sqrt(dot(n, n))
    if gap >= r + s or gap <= abs(r - s):
        return got
    k = 0.5 * (dot(o, o) - dot(c, c) + r * r - s * s)
    return _plane_sphere(e, f, n, k, c, r, found, got)
