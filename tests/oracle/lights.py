# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of lights as a shaded point sees them, and what each of them sends."""

import numpy as np

from adaptive_drt.scene.description import (
    DiskLight,
    EllipseLight,
    PointLight,
    PolygonLight,
    QuadLight,
    SkyLight,
    SphereLight,
    SpotLight,
    SunLight,
)

from .trace import dot, moved, norm

__all__ = ["aim", "emitted", "facing", "is_area", "is_dark", "place", "power_of", "source"]

FAR = 1e6
"""Metres from a point at which it sees a sun or a sky: beyond all shapes of a test."""

TINY = 1e-30
"""Replaces a length of zero in a quotient whose result is then not used, or clamped."""


def without_cone(light):
    """A spot light as the point, disk or ball that shines to all sides; others as they are."""
    if not isinstance(light, SpotLight):
        return light
    common = (light.motion, light.casts_shadow, light.name)
    if not light.radius:
        return PointLight(light.center, light.intensity, *common)
    radiance = tuple(x / (np.pi * light.radius**2) for x in light.intensity)
    kind = DiskLight if light.faces else SphereLight
    return kind(light.center, light.radius, radiance, *common)


def in_cone(light, p, t, point):
    """How much (n,) of a spot's light goes from its points (n, 3) towards p (n, 3)."""
    way = p - point
    axis = np.array(light.direction) / np.linalg.norm(light.direction)
    if light.frame is not None:
        way, axis = way @ np.array(light.frame).T, np.array([0.0, 0.0, -1.0])
    cosine = way @ axis / np.maximum(norm(way), TINY)
    edge = np.cos(light.angle / 2.0)
    width = np.maximum((1.0 - edge) * light.blend, 1e-9)
    x = np.clip((cosine - edge) / width, 0.0, 1.0)
    held = norm(moved(light, light.center, t) - p) <= (0.0 if light.faces else light.radius)
    return np.where(held, 1.0, x * x * (3.0 - 2.0 * x))


def is_area(light):
    """Whether it has an extent."""
    light = without_cone(light)
    return not isinstance(light, PointLight) and getattr(light, "angle", 1.0) > 0.0


def power_of(light):
    """What `emitted` is multiplied by: radiance, radiant intensity or irradiance."""
    light = without_cone(light)
    for name in ("radiance", "intensity", "irradiance"):
        if hasattr(light, name):
            return getattr(light, name)
    raise TypeError(light)


def source(light, q):
    """Where the centre of a light is at mid-shutter, for things near a place q (3,)."""
    if isinstance(light, SunLight):
        return np.asarray(q) - FAR * np.array(light.direction) / np.linalg.norm(light.direction)
    if isinstance(light, SkyLight):
        return np.asarray(q) + FAR * np.array([0.0, 0.0, 1.0])
    return _center(light)


def _center(light):
    if isinstance(light, PolygonLight):
        return np.mean(light.vertices, axis=0)
    return np.array(light.center, dtype=float)


def _corners(light):
    """Offsets (k, 3) of a polygon's corners from `_center`."""
    return np.array(light.vertices) - _center(light)


def _around(light, b):
    """Offsets (n, 3) along a polygon's outline: b (n,) from 0 to 1 in proportion to the area that
    is passed as seen from `_center`, as uv is of a point that far out."""
    corners = _corners(light)
    following = np.roll(corners, -1, axis=0)
    area = np.linalg.norm(np.cross(corners, following), axis=1)
    passed = np.cumsum(area) / area.sum()
    at = np.minimum((b[:, None] >= passed).sum(axis=1), len(area) - 1)
    before = np.append(0.0, passed)[at]
    part = ((b - before) / (passed[at] - before))[:, None]
    return (1.0 - part) * corners[at] + part * following[at]


def _flat_normal(light):
    """Area vector (3,) of a flat light: of a polygon, or of the parallelogram of its half axes."""
    if isinstance(light, PolygonLight):
        corners = _corners(light)
        return np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0) / 2.0
    return np.cross(light.half_u, light.half_v)


def is_dark(light):
    """Whether it sends nothing at all."""
    return not any(power_of(light))


def _basis(axis):
    """Two unit vectors (n, 3) that complete unit axes (n, 3), by the smallest component."""
    least = np.eye(3)[np.abs(axis).argmin(axis=1)]
    first = np.cross(axis, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(axis, first)


def _axis(light, p, t):
    """Unit axis from p to the light's centre, distance, two side vectors, sine of its radius."""
    if isinstance(light, SunLight):
        axis = np.broadcast_to(source(light, np.zeros(3)) / FAR, p.shape)
        far, sine = np.full(len(p), FAR), np.full(len(p), np.sin(light.angle / 2.0))
        return (axis, far, *_basis(axis), sine)
    offset = moved(light, light.center, t) - p
    distance = norm(offset)
    axis = offset / np.where(distance > 0.0, distance, 1.0)[:, None]
    axis[distance == 0.0] = (0.0, 0.0, 1.0)
    sine = np.minimum(light.radius / np.where(distance > 0.0, distance, 1.0), 1.0)
    return (axis, distance, *_basis(axis), sine)


def facing(light, p, t):
    """Height in metres of p over the front of a flat light; infinite for all others."""
    if not isinstance(light, QuadLight | EllipseLight | PolygonLight):
        return np.full(len(p), np.inf)
    normal = _flat_normal(light)
    normal = normal / np.linalg.norm(normal)
    return (p - moved(light, _center(light), t)) @ normal


def place(light, p, t, uv):
    """Points (n, 3) of a light at time t: uv (n, 2) in the square -1..1, or in the unit disk.

    For a disk and a sphere the points are those that face p; a sphere's uv is the sine of the
    angle from the axis to its centre, as a share of its outline's. A polygon's is in the unit disk,
    by the area that is passed around its centre. A sky's is the whole sphere of
    directions, by Lambert's projection, below the horizon, too.
    """
    light = without_cone(light)
    if isinstance(light, SkyLight):
        square = np.minimum((uv**2).sum(axis=1, keepdims=True), 1.0)
        side = 2.0 * np.sqrt(1.0 - square) * uv
        return p + FAR * np.concatenate([side, 1.0 - 2.0 * square], axis=1)
    if isinstance(light, PolygonLight):
        turn = np.arctan2(uv[:, 1], uv[:, 0]) / (2.0 * np.pi) % 1.0
        return moved(light, _center(light), t) + norm(uv)[:, None] * _around(light, turn)
    if isinstance(light, QuadLight | EllipseLight):
        return moved(light, light.center, t) + uv @ np.array([light.half_u, light.half_v])
    if isinstance(light, PointLight):
        return moved(light, light.center, t)
    axis, distance, first, second, sine = _axis(light, p, t)
    if isinstance(light, SunLight):
        side = uv * sine[:, None]
        ahead = np.sqrt(np.maximum(1.0 - (side**2).sum(axis=1), 0.0))
        return p + FAR * (side[:, :1] * first + side[:, 1:] * second + ahead[:, None] * axis)
    if isinstance(light, SphereLight):
        side = uv * sine[:, None]
        ahead = np.sqrt(np.maximum(1.0 - (side**2).sum(axis=1), 0.0))
        toward = side[:, :1] * first + side[:, 1:] * second + ahead[:, None] * axis
        rho2 = np.minimum((uv**2).sum(axis=1), 1.0)
        reach = distance * ahead - light.radius * np.sqrt(1.0 - rho2)
        return p + reach[:, None] * toward
    disk = light.radius * (uv[:, :1] * first + uv[:, 1:] * second)
    return moved(light, light.center, t) + disk


def aim(light, p, t, q):
    """The uv (n, 2) of the light's point that lies nearest the line from p through q (n, 3)."""
    toward, light = q - p, without_cone(light)
    if not is_area(light):
        return np.zeros((len(p), 2))
    if isinstance(light, SkyLight):
        way = toward / np.maximum(norm(toward), TINY)[:, None]
        rho = np.sqrt(np.maximum(1.0 - way[:, 2], 0.0) / 2.0)
        side = np.hypot(way[:, 0], way[:, 1])
        return way[:, :2] * (rho / np.maximum(side, TINY))[:, None]
    if isinstance(light, PolygonLight):
        return _aim_polygon(light, p, t, toward)
    if isinstance(light, QuadLight | EllipseLight):
        u, v = np.array(light.half_u), np.array(light.half_v)
        columns = np.stack([np.broadcast_to(u, p.shape), np.broadcast_to(v, p.shape), -toward], 2)
        flat = np.abs(np.linalg.det(columns)) < np.finfo(float).tiny
        columns[flat] = np.eye(3)
        start = p - moved(light, light.center, t)
        # columns . (u, v, s) = p - center, as center + u U + v V = p + s toward
        uvs = np.linalg.solve(columns, start[:, :, None])[:, :, 0]
        uvs[flat | (uvs[:, 2] < 0.0)] = 0.0
        if isinstance(light, EllipseLight):
            return uvs[:, :2] / np.maximum(norm(uvs[:, :2]), 1.0)[:, None]
        return np.clip(uvs[:, :2], -1.0, 1.0)
    axis, distance, first, second, sine = _axis(light, p, t)
    ahead = dot(toward, axis)
    side = np.stack([dot(toward, first), dot(toward, second)], axis=1)
    if isinstance(light, SphereLight | SunLight):
        scale = norm(toward) * sine
    else:
        scale = np.where(ahead > 0.0, ahead, 0.0) * light.radius / np.maximum(distance, TINY)
    uv = side / np.maximum(scale, TINY)[:, None]
    rho = norm(uv)
    outside = (rho > 1.0) | (ahead <= 0.0)
    return np.where(outside[:, None], uv / np.maximum(rho, TINY)[:, None], uv)


def _aim_polygon(light, p, t, toward):
    """`aim` of a polygon, for vectors toward (n, 3): those that miss it, at its outline."""
    corners, normal = _corners(light), _flat_normal(light)
    start = p - moved(light, _center(light), t)
    drop = toward @ normal
    flat = np.abs(drop) < np.finfo(float).tiny
    s = -(start @ normal) / np.where(flat, 1.0, drop)
    place = start + s[:, None] * toward
    place[flat | (s < 0.0)] = 0.0
    following = np.roll(corners, -1, axis=0)
    # the place is a share of each pair of corners; both shares are positive of the one around it
    area = np.cross(corners, following) @ normal
    one = np.stack([np.cross(place, b) @ normal for b in following], axis=1) / area
    other = np.stack([np.cross(a, place) @ normal for a in corners], axis=1) / area
    at = np.minimum(one, other).argmax(axis=1)
    rows = np.arange(len(p))
    one, other = (np.maximum(x[rows, at], 0.0) for x in (one, other))
    out = one + other
    passed = np.append(0.0, np.cumsum(area) / area.sum())
    turn = 2.0 * np.pi * (passed[at] + np.diff(passed)[at] * other / np.maximum(out, TINY))
    return np.minimum(out, 1.0)[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def emitted(light, p, normals, t, square):
    """Point (n, 3) and estimate (n,) of its irradiance at p per unit radiance (or intensity).

    `square` (n, 2) in 0..1 chooses the point; the mean over the square is the irradiance of the
    unoccluded light.
    """
    if isinstance(light, SpotLight):
        point, share = emitted(without_cone(light), p, normals, t, square)
        return point, share * in_cone(light, p, t, point)
    if isinstance(light, SphereLight):
        return _emitted_sphere(light, p, normals, t, square)
    if isinstance(light, SkyLight):
        return p + FAR * _above(normals, square), np.full(len(p), np.pi)
    if isinstance(light, SunLight):
        if is_area(light):
            point, share = _emitted_sphere(light, p, normals, t, square)
            return point, share / (np.pi * np.sin(light.angle / 2.0) ** 2)
        point = place(light, p, t, np.zeros((len(p), 2)))
        return point, np.maximum(dot(point - p, normals) / FAR, 0.0)
    if isinstance(light, QuadLight):
        uv = 2.0 * square - 1.0
        area = 4.0 * np.linalg.norm(np.cross(light.half_u, light.half_v))
    else:
        rho, phi = np.sqrt(square[:, :1]), 2.0 * np.pi * square[:, 1:]
        uv = rho * np.concatenate([np.cos(phi), np.sin(phi)], axis=1)
        area = np.pi * getattr(light, "radius", 0.0) ** 2
        if isinstance(light, EllipseLight):
            area = np.pi * np.linalg.norm(np.cross(light.half_u, light.half_v))
        if isinstance(light, PolygonLight):
            area = np.linalg.norm(_flat_normal(light))
    point = place(light, p, t, uv)
    toward = point - p
    distance2 = dot(toward, toward)
    distance = np.sqrt(distance2)
    cosine = np.maximum(dot(toward, normals) / distance, 0.0)
    if isinstance(light, PointLight):
        return point, cosine / distance2
    if isinstance(light, QuadLight | EllipseLight | PolygonLight):
        height = facing(light, p, t)
    else:
        height = norm(moved(light, light.center, t) - p)
    return point, area * cosine * np.maximum(height / distance, 0.0) / distance2


def _above(normals, square):
    """Directions (n, 3) above horizons, in proportion to the cosine with the normals."""
    first, second = _basis(normals)
    rho, phi = np.sqrt(square[:, :1]), 2.0 * np.pi * square[:, 1:]
    aside = np.cos(phi) * first + np.sin(phi) * second
    return rho * aside + np.sqrt(np.maximum(1.0 - square[:, :1], 0.0)) * normals


def _emitted_sphere(light, p, normals, t, square):
    """Directions uniform over the cone of the sphere's outline."""
    *_, sine = _axis(light, p, t)
    lowest = np.sqrt(np.maximum(1.0 - sine**2, 0.0))
    height = 1.0 - square[:, 0] * (1.0 - lowest)
    rho = np.sqrt(np.maximum(1.0 - height**2, 0.0)) / sine
    phi = 2.0 * np.pi * square[:, 1]
    uv = rho[:, None] * np.stack([np.cos(phi), np.sin(phi)], axis=1)
    point = place(light, p, t, uv)
    toward = point - p
    cosine = dot(toward, normals) / norm(toward)
    return point, 2.0 * np.pi * (1.0 - lowest) * np.maximum(cosine, 0.0)
