# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixel means by sampled rays alone, for all kinds of lights, skies, seen lights and linking.

As `sampled`, of which it takes the points, the counts and the sums, but with more kinds of lights,
and with skies, for scenes in which lights do not reach into shapes. Needs numba and SciPy. What
counts, besides what `sampled` tells:

- Suns and skies are beyond all shapes. A sun is a cone of directions, or one direction.
- Flat lights of limited spread, and spots, have a radiance that depends on the direction only.
- An environment is an image that is bilinear between the middles of its pixels, and repeats.
- A light that the camera sees adds its radiance where no shape is before it, and hides nothing. A
  disk that faces what it lights faces the camera as it does at the middle of the shutter.
- A shape may be unlit by some lights, and hide none of the light of others.
"""

import math
from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import (
    DiskLight,
    EllipseLight,
    EnvironmentLight,
    PointLight,
    QuadLight,
    SkyLight,
    SphereLight,
    SpotLight,
    SunLight,
)

from .directions_jit import balanced, turned
from .rays_jit import candidates, first_hit, pack
from .sampled import UNIT, render_samples
from .vectors_jit import add, cross, dot, jit, less, times, vector

__all__ = ["sampled_every_light"]

QUAD, BALL, DISK, POINT, ELLIPSE, SUN, HARD_SUN, SKY, ENVIRONMENT = range(9)
PLAIN, CONE, SPREAD = range(3)
"""How a light's radiance depends on the direction."""
WIDTH = 26
"""Numbers of a light: centre or direction to it 0:3, half edges 3:9, axis against which it shines
9:12, radius or sine of the half angle 12, kind 13, displacement 14:17, whether it casts shadows 17,
power 18:21, profile 21, cosines of the profile 22 and 23, whether it is seen 24 and lights 25."""


def sampled_every_light(scene, noise=1e-3, seed=0, threads=2):
    """Estimate all pixels of a scene's region: see `sampled.sampled`."""
    packed = _pack(scene)
    return render_samples(packed, _means, 3 + 2 * len(scene.lights), scene, noise, seed, threads)


def _pack(scene):
    """Arrays of a scene: those of `pack`, lights, images of the sky, and linking."""
    shapes = pack(replace(scene, lights=()))
    eye = np.array([row[3] for row in scene.camera.matrix[:3]])
    drift = _way(scene.camera)
    rows = [_light(light, eye, drift) for light in scene.lights]
    lights = np.array(rows, dtype=float).reshape(-1, WIDTH)
    skies = [light for light in scene.lights if isinstance(light, EnvironmentLight)]
    sky = _sky(skies[0]) if skies else _sky(None)
    # the order of `pack`: balls first
    order = [s for s in scene.shapes if hasattr(s, "radius")]
    order += [s for s in scene.shapes if not hasattr(s, "radius")]
    lit = np.array([[light.name not in s.visibility.unlit_by for s in order]
                    for light in scene.lights], dtype=bool)  # fmt: skip
    hides = np.array([[s.visibility.shadow and light.name not in s.visibility.passed_by
                       for s in order] for light in scene.lights], dtype=bool)  # fmt: skip
    shape = len(scene.lights), len(order)
    linking = lit.reshape(shape), hides.reshape(shape)
    return shapes, lights, sky, _sky(scene.backdrop), linking


def _way(thing):
    return np.zeros(3) if thing.motion is None else np.array(thing.motion.displacement)


def _sky(light):
    """Pixels (rows, columns, 3) of an image of the sphere, and its rotation (3, 3)."""
    if light is None:
        return np.zeros((0, 0, 3)), np.eye(3)
    pixels = np.array(light.pixels, dtype=float) * np.array(light.radiance)
    return np.ascontiguousarray(pixels), np.array(light.rotation, dtype=float)


def _light(light, eye, drift):
    kind, place, way, radius, axis = _kind(light), np.zeros(3), np.zeros(3), 0.0, np.zeros(3)
    u = v = np.zeros(3)
    profile, power = (PLAIN, 0.0, 0.0), getattr(light, "radiance", None)
    if kind in (SUN, HARD_SUN):
        place = -np.array(light.direction) / np.linalg.norm(light.direction)
        radius = math.sin(0.5 * light.angle)
        power = light.irradiance
        if kind == SUN:
            power = np.array(power) / (math.pi * radius**2)
    elif kind not in (SKY, ENVIRONMENT):
        place, way = np.array(light.center) - eye, _way(light) - drift
        radius = getattr(light, "radius", 0.0)
    if kind in (QUAD, ELLIPSE):
        u, v = np.array(light.half_u), np.array(light.half_v)
        axis = np.cross(u, v)
        axis = axis / np.linalg.norm(axis)
        if light.spread < math.pi:
            half = 0.5 * light.spread
            profile = (SPREAD, math.cos(half), math.tan(half))
            # power of a Lambertian emitter over that of the profile, with the same radiance ahead
            share = math.sin(half) ** 2 - (half - math.sin(half) * math.cos(half)) / math.tan(half)
            power = np.array(power) / share
    elif isinstance(light, SpotLight):
        axis = np.array(light.direction) / np.linalg.norm(light.direction)
        outer = math.cos(0.5 * light.angle)
        profile = (CONE, outer, outer + (1.0 - outer) * max(light.blend, 2.0**-12))
        power = np.array(light.intensity) / (math.pi * radius**2 if radius else 1.0)
    elif kind == POINT:
        power = light.intensity
    casts, seen, lights = map(float, (light.casts_shadow, light.seen, light.lights_surfaces))
    return (*place, *u, *v, *axis, radius, kind, *way, casts, *power, *profile, seen, lights)


def _kind(light):
    if isinstance(light, SpotLight):
        return POINT if not light.radius else DISK if light.faces else BALL
    if isinstance(light, SunLight):
        return SUN if light.angle > 2.0**-40 else HARD_SUN
    kinds = {QuadLight: QUAD, SphereLight: BALL, DiskLight: DISK, PointLight: POINT,
             EllipseLight: ELLIPSE, SkyLight: SKY, EnvironmentLight: ENVIRONMENT}  # fmt: skip
    return kinds[type(light)]


@jit
def _means(packed, pixels, points, shifts, result):
    """Mean radiance (n, 3) of pixels (n, 2)."""
    scene, lights, sky, backdrop, linking = packed
    balls, quads, _, background, view = scene
    among = np.empty(balls.shape[0] + quads.shape[0], dtype=np.int64)
    for row in range(pixels.shape[0]):
        x, y = pixels[row, 0], pixels[row, 1]
        count = candidates(scene, x, y, among)
        shift = shifts[row]
        for k in range(points.shape[0]):
            u = (points[k, 0] ^ shift[0]) * UNIT
            v = (points[k, 1] ^ shift[1]) * UNIT
            t = (points[k, 2] ^ shift[2]) * UNIT - 0.5
            i, p, n, _ = first_hit(scene, among, count, x + u, y + v, t)
            way = (
                view[0, 0] + (x + u) * view[1, 0] + (y + v) * view[2, 0],
                view[0, 1] + (x + u) * view[1, 1] + (y + v) * view[2, 1],
                view[0, 2] + (x + u) * view[1, 2] + (y + v) * view[2, 2],
            )
            way = times(1.0 / math.sqrt(dot(way, way)), way)
            limit = math.inf if i < 0 else dot(p, way)
            total = (0.0, 0.0, 0.0)
            if i < 0:
                total = vector(background, 0)
                if backdrop[0].shape[0] > 0:
                    total = _sky_radiance(backdrop, way)
            for j in range(lights.shape[0]):
                light = lights[j]
                if light[24] > 0.0:
                    total = add(total, times(_seen(light, way, t, limit), vector(light, 18)))
                if i < 0 or light[25] == 0.0 or not linking[0][j, i]:
                    continue
                a = (points[k, 3 + 2 * j] ^ shift[3 + 2 * j]) * UNIT
                b = (points[k, 4 + 2 * j] ^ shift[4 + 2 * j]) * UNIT
                e = _from_light(balls, quads, sky, light, linking[1][j], (p, n, t, i), a, b)
                if i < balls.shape[0]:
                    color = vector(balls[i], 7)
                else:
                    color = vector(quads[i - balls.shape[0]], 15)
                e = times(1.0 / math.pi, e)
                total = add(total, (e[0] * color[0], e[1] * color[1], e[2] * color[2]))
            for channel in range(3):
                result[row, channel] += total[channel]
        for channel in range(3):
            result[row, channel] /= points.shape[0]


@jit
def _sky_radiance(sky, way):
    """Radiance of an image in a unit direction."""
    pixels, turn = sky
    rows, columns = pixels.shape[0], pixels.shape[1]
    x, y, z = (
        dot(vector(turn[0], 0), way),
        dot(vector(turn[1], 0), way),
        dot(vector(turn[2], 0), way),
    )
    u = (0.5 - math.atan2(y, x) / (2.0 * math.pi)) * columns - 0.5
    v = math.acos(min(max(z, -1.0), 1.0)) / math.pi * rows - 0.5
    i, j = math.floor(u), math.floor(v)
    a, b = u - i, v - j
    left, right, top, low = i % columns, (i + 1) % columns, j % rows, (j + 1) % rows
    upper = add(
        times(1.0 - a, vector(pixels[top, left], 0)), times(a, vector(pixels[top, right], 0))
    )
    lower = add(
        times(1.0 - a, vector(pixels[low, left], 0)), times(a, vector(pixels[low, right], 0))
    )
    return add(times(1.0 - b, upper), times(b, lower))


@jit
def _profile(light, way):
    """Relative radiance that a light sends against a unit direction to it."""
    cosine = -dot(vector(light, 9), way)
    if light[21] == CONE:
        x = min(max((cosine - light[22]) / (light[23] - light[22]), 0.0), 1.0)
        return x * x * (3.0 - 2.0 * x)
    if light[21] == SPREAD:
        if cosine <= light[22]:
            return 0.0
        return 1.0 - math.sqrt(max(1.0 - cosine * cosine, 0.0)) / cosine / light[23]
    return 1.0


@jit
def _within(kind, light, at):
    """Whether a point of a flat light's plane, relative to its centre, is in it."""
    u, v = vector(light, 3), vector(light, 6)
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    au, av = dot(at, u), dot(at, v)
    det = uu * vv - uv * uv
    x, y = (au * vv - av * uv) / det, (av * uu - au * uv) / det
    if kind == QUAD:
        return abs(x) <= 1.0 and abs(y) <= 1.0
    return x * x + y * y <= 1.0


@jit
def _seen(light, way, t, limit):
    """Relative radiance that the camera sees of a light in a direction, before a distance."""
    kind = int(light[13])
    if kind in (POINT, HARD_SUN, SKY, ENVIRONMENT):
        return 0.0
    if kind == SUN:
        cosine = dot(vector(light, 0), way)
        inside = cosine > 0.0 and 1.0 - cosine * cosine < light[12] ** 2
        return 1.0 if inside and limit == math.inf else 0.0
    middle = vector(light, 0)
    c = add(middle, times(t, vector(light, 14)))
    if kind == BALL:
        along = dot(c, way)
        off = less(c, times(along, way))
        gap = light[12] ** 2 - dot(off, off)
        if gap <= 0.0 or along <= 0.0 or along - math.sqrt(gap) >= limit:
            return 0.0
        return _profile(light, way)
    axis = vector(light, 9) if kind != DISK else times(-1.0, middle)
    slope = dot(axis, way)
    # the side is that of the middle of the shutter
    if dot(axis, middle) >= 0.0 or slope == 0.0:
        return 0.0
    depth = dot(axis, c) / slope
    if depth <= 0.0 or depth >= limit:
        return 0.0
    at = less(times(depth, way), c)
    if kind == DISK:
        inside = dot(at, at) < light[12] ** 2
    else:
        inside = _within(kind, light, at)
    return _profile(light, way) if inside else 0.0


@jit
def _from_light(balls, quads, sky, light, hides, spot, a, b):
    """One sample of the irradiance (RGB) that a light brings to a spot."""
    n = spot[1]
    kind = int(light[13])
    power = vector(light, 18)
    none = (0.0, 0.0, 0.0)
    if kind == SKY or kind == ENVIRONMENT:
        w = turned(n, math.sqrt(1.0 - a), 2.0 * math.pi * b)
        if _blocked(balls, quads, light, hides, spot, times(math.inf, w), w):
            return none
        return times(math.pi, power if kind == SKY else _sky_radiance(sky, w))
    if kind == SUN or kind == HARD_SUN:
        w, weight = vector(light, 0), 1.0
        if kind == SUN:
            opening = light[12] ** 2 / (1.0 + math.sqrt(1.0 - light[12] ** 2))
            w, weight = turned(w, 1.0 - a * opening, 2.0 * math.pi * b), 2.0 * math.pi * opening
        cosine = dot(n, w)
        if cosine <= 0.0 or _blocked(balls, quads, light, hides, spot, times(math.inf, w), w):
            return none
        return times(weight * cosine, power)
    c = less(add(vector(light, 0), times(spot[2], vector(light, 14))), spot[0])
    if kind == QUAD or kind == ELLIPSE:
        return times(_from_flat(balls, quads, light, hides, spot, c, a, b), power)
    dd = dot(c, c)
    d, r = math.sqrt(dd), light[12]
    w, weight, reach = times(1.0 / d, c), 1.0 / dd, d
    if kind != POINT:
        if kind == DISK:
            lowest = d / math.sqrt(dd + r * r)
            opening = r * r / (dd + r * r) / (1.0 + lowest)
        else:
            lowest = math.sqrt((d - r) * (d + r)) / d
            opening = r * r / dd / (1.0 + lowest)
        height, weight = 1.0 - a * opening, 2.0 * math.pi * opening
        w = turned(w, height, 2.0 * math.pi * b)
        reach = d / height
        if kind == BALL:
            along = dot(w, c)
            off = less(c, times(along, w))
            reach = along - math.sqrt(max(r * r - dot(off, off), 0.0))
    weight *= dot(w, n)
    if weight <= 0.0 or _blocked(balls, quads, light, hides, spot, times(reach, w), w):
        return none
    return times(weight * _profile(light, w), power)


@jit
def _from_flat(balls, quads, light, hides, spot, c, a, b):
    """A flat light: a point of it and a direction, weighted by the balance heuristic."""
    n, kind = spot[1], int(light[13])
    front = vector(light, 9)
    ahead = -dot(front, c)
    if ahead <= 0.0:
        return 0.0
    u, v = vector(light, 3), vector(light, 6)
    edge = cross(u, v)
    size, total = math.sqrt(dot(edge, edge)), 0.0
    area = 4.0 * size if kind == QUAD else math.pi * size
    x, y = 2.0 * a - 1.0, 2.0 * b - 1.0
    if kind == ELLIPSE:
        x, y = (
            math.sqrt(a) * math.cos(2.0 * math.pi * b),
            math.sqrt(a) * math.sin(2.0 * math.pi * b),
        )
    to = add(c, add(times(x, u), times(y, v)))
    dd = dot(to, to)
    w = times(1.0 / math.sqrt(dd), to)
    cosine = dot(n, w)
    if cosine > 0.0 and not _blocked(balls, quads, light, hides, spot, to, w):
        total += _profile(light, w) * balanced(cosine, ahead, dd, area)
    w = turned(n, math.sqrt(1.0 - a), 2.0 * math.pi * b)
    slope = -dot(front, w)
    if slope > 0.0:
        to = times(ahead / slope, w)
        if _within(kind, light, less(to, c)):
            if not _blocked(balls, quads, light, hides, spot, to, w):
                total += _profile(light, w) * balanced(dot(n, w), ahead, dot(to, to), area)
    return total


@jit
def _blocked(balls, quads, light, hides, spot, to, way):
    """Whether a shape that hides the light is met from a spot before the end of a segment.

    to : the segment's vector, infinite for lights beyond all shapes.  way : its unit direction.
    """
    if light[17] == 0.0:
        return False
    p, _, t, own = spot
    limit = math.inf
    if math.isfinite(to[0]) and math.isfinite(to[1]) and math.isfinite(to[2]):
        limit = dot(to, way)
    for i in range(balls.shape[0]):
        if i == own or not hides[i]:
            continue
        q = balls[i]
        v = less(add(vector(q, 0), times(t, vector(q, 4))), p)
        along = dot(v, way)
        off = less(v, times(along, way))
        gap = q[3] * q[3] - dot(off, off)
        if gap > 0.0 and along > 0.0 and along - math.sqrt(gap) < limit:
            return True
    for i in range(quads.shape[0]):
        if balls.shape[0] + i == own or not hides[balls.shape[0] + i]:
            continue
        q = quads[i]
        v = less(add(vector(q, 0), times(t, vector(q, 9))), p)
        normal = vector(q, 12)
        height, slope = dot(normal, v), dot(normal, way)
        if height * slope <= 0.0 or height / slope >= limit:
            continue
        at = less(times(height / slope, way), v)
        e, f = vector(q, 3), vector(q, 6)
        area = dot(cross(e, f), normal)
        x, y = dot(cross(at, f), normal) / area, dot(cross(e, at), normal) / area
        if x > 0.0 and y > 0.0 and (max(x, y) if q[18] == 4.0 else x + y) < 1.0:
            return True
    return False
