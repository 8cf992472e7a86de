# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes on the edge of a decision with one ellipsoid, cylinder, cone or ellipse.

Each is moved so that a plane through a chosen point and through what it shall touch, a pixel's ray,
corner or side or a light's outline, is off its own tangent plane by 1e-3 to 1e-12 of its size. The
truth is `oracle.exact_solids`. What is not said (NaN): pixels in which the solid is seen, but where
that is what it is about, and those wholly on it or hidden all the time, where a rim between two of
its faces or nothing at all may change.
"""

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import (
    Cylinder,
    Ellipse,
    Ellipsoid,
    Motion,
    PointLight,
    Scene,
    SphereLight,
)
from adversarial_case import (
    EDGE,
    HEIGHT,
    LAMP,
    MOTION,
    PENUMBRA,
    WIDTH,
    Case,
    across,
    chosen_point,
    floor,
    light_place,
    off,
    raster,
    some_camera,
    vector,
)
from adversarial_lights import facing_quad_light, light_corners, light_faces
from oracle.exact_mask import cap_of, directions, floor_points, pixel_corners, real
from oracle.exact_solids import (
    Solid,
    covers_not_all,
    lowest,
    meets_cap,
    meets_corners,
    meets_ray,
    parts_of,
    size_of,
)

__all__ = ["FAMILIES", "KINDS", "adversarial_solid"]

KINDS = ("ellipsoid", "cylinder", "cone", "truncated cone", "ellipse")
SLIMMEST = 0.1
"""Of the longest half axis: the shortest one."""
ABOVE = 0.01
"""Metres by which a solid stays above the floor and below the light, where it does not rest."""
TRIES = 1_000
UP = np.array([0.0, 0.0, 1.0])


def _shape(rng, kind, size):
    """A solid of a kind about the origin, turned at random, its smallest extent about `size`."""
    x = across(rng, rng.normal(size=3))
    y = across(rng, x)
    z = np.cross(x, y)
    ratio = 10.0 ** rng.uniform(0.0, -np.log10(SLIMMEST), 2)
    if kind == "ellipsoid":
        return Ellipsoid(
            (0.0,) * 3, vector(size * x), vector(size * ratio[0] * y), vector(size * ratio[1] * z)
        )
    if kind == "ellipse":
        return Ellipse((0.0,) * 3, vector(size * x), vector(size * ratio[0] * y))
    half = size * ratio[0] * z
    end = {"cylinder": None, "cone": 0.0}.get(kind, float(size * rng.uniform(0.1, 0.9)))
    return Cylinder(vector(-half), vector(half), float(size), end_radius=end)


def _moved(record, by):
    """A solid at another place."""
    if isinstance(record, Cylinder):
        start, end = (vector(np.array(p) + by) for p in (record.start, record.end))
        return replace(record, start=start, end=end)
    return replace(record, center=vector(np.array(record.center) + by))


def _touching(rng, record, place, n, apart):
    """A solid whose farthest point in a direction n is at a place, or beyond it by `apart`."""
    at, most = None, -np.inf
    for center, axes in parts_of(record):
        center, axes = (np.array(x, dtype=float).reshape(-1, 3) for x in (center, axes))
        reach = axes @ n
        size = np.linalg.norm(reach)
        if (height := center[0] @ n + size) > most:
            most, at = height, center[0] + (reach @ axes / size if size > 0.0 else 0.0)
    return _moved(record, place - at + apart * size_of(record) * n)


def _place(rng, kind, sizes, spots, moves=None):
    """A solid that touches one of `spots` (place, normal), above the floor and below `top`.

    sizes : the least and largest of its size, as powers of 10.  spots : draws a place, a normal
    and the height that it must stay under.
    """
    for _ in range(TRIES):
        place, n, top, scale = spots()
        record = _shape(rng, kind, float(scale * 10.0 ** rng.uniform(*sizes)))
        move = np.zeros(3) if moves is None else moves(size_of(record), n)
        # a path that leads along the normal touches at its end
        record = _touching(rng, record, place - n * abs(n @ move) / 2.0, n, off(rng))
        reach = abs(move[2]) / 2.0
        if lowest(record, UP) - reach > ABOVE and -lowest(record, -UP) + reach < top - ABOVE:
            moving = Motion(vector(move)) if moves is not None else None
            return replace(record, motion=moving)
    raise AssertionError("no place for a solid")


def _floor_view(camera):
    """Points of the floor at the centres of pixels, and where the eye is."""
    columns, rows = raster()
    way = directions(camera, columns + 0.5, rows + 0.5)
    return floor_points(camera, way)[0], real(camera.matrix)[:3, 3].reshape(3, 1), way


def _case(camera, record, light, row, margin, half):
    """The record of a scene with the one effect of a row of the mask switched on."""
    names = ("use_penumbra", "use_motion", "use_edges")
    switches = {name: False for k, name in enumerate(names) if k != row}
    return Case.make(Scene(camera, (floor(), record), (light,)), switches, row, margin, half)


def _normal_of_outline(rng, light, point):
    """A direction on a light's outline, and the normal of a plane that touches it there."""
    if isinstance(light, SphereLight):
        to = np.array(light.center) - point
        far = np.linalg.norm(to)
        axis, half = to / far, np.arcsin(light.radius / far)
        side = across(rng, axis)
        way = np.cos(half) * axis + np.sin(half) * side
        return way, np.sin(half) * axis - np.cos(half) * side
    corners = [c - point for c in light_corners(light)]
    k = rng.integers(4)
    a, b = corners[k], corners[(k + 1) % 4]
    if rng.random() < 0.5:
        way = a + rng.random() * (b - a)
        n = np.cross(a, b)
    else:
        way, n = a, across(rng, a)
    return way / np.linalg.norm(way), n / np.linalg.norm(n)


def _lamp(rng, point):
    place, _ = light_place(rng, point)
    radius = float(rng.uniform(0.05, 0.5))
    if rng.random() < 0.5:
        return SphereLight(vector(place), radius, (1.0,) * 3), place[2] - radius
    light = facing_quad_light(rng, point, place, radius)
    return light, min(c[2] for c in light_corners(light))


def _red(camera, record, light):
    """A solid and the floor under a light: which points of the floor see the light in part."""
    point, eye, way = _floor_view(camera)
    solid = Solid(record, point)
    if isinstance(light, SphereLight):
        cap = cap_of(point, light.center, light.radius)
        margin = meets_cap(solid, cap)
        rest = covers_not_all(solid, cap)
    else:
        lamp = [real(c).reshape(3, 1) - point for c in light_corners(light)]
        margin = np.where(light_faces(light, point), meets_corners(solid, lamp), -1)
        rest = covers_not_all(solid, lamp)
    margin = np.where(margin > 0, np.minimum(margin, rest), margin)
    margin = np.where(meets_ray(Solid(record, eye + 0 * way), way) < -1e-6, margin, np.nan)
    far = np.linalg.norm(np.asarray(point, dtype=float), axis=0) + 10.0
    return _case(camera, record, light, PENUMBRA, margin, size_of(record) / far)


def hidden_light(rng, kind):
    """Red: a solid touches the outline of a round or a quad light, from outside or within."""
    camera = some_camera(rng)

    def spots():
        nonlocal light
        point = chosen_point(rng, camera)
        light, top = _lamp(rng, point)
        way, n = _normal_of_outline(rng, light, point)
        distance = rng.uniform(0.3, 2.0)
        return point + distance * way, n * rng.choice([-1.0, 1.0]), top, distance

    light = None
    record = _place(rng, kind, (-2.5, -0.4), spots)
    return _red(camera, record, light)


def tiny(rng, kind):
    """Red: a solid of 1e-10 to 1e-3 of a light's size before its middle."""
    camera = some_camera(rng)

    def spots():
        nonlocal light
        point = chosen_point(rng, camera)
        light, top = _lamp(rng, point)
        way = np.array(light.center) - point
        way /= np.linalg.norm(way)
        distance = rng.uniform(0.3, 2.0)
        return point + distance * way, across(rng, way), top, 0.01 * distance

    light = None
    record = _place(rng, kind, (-10.0, -3.0), spots)
    return _red(camera, record, light)


def resting(rng, kind):
    """Red: a solid that rests on the floor, or floats by a hair."""
    camera = some_camera(rng)
    point = chosen_point(rng, camera)
    size = float(10.0 ** rng.uniform(-1.5, -0.3))
    light, _ = _lamp(rng, point)
    record = _shape(rng, kind, size)
    if isinstance(record, Cylinder) and rng.random() < 0.5:  # upright, on its end
        height = float(np.linalg.norm(np.array(record.end) - np.array(record.start)))
        record = replace(record, start=(0.0, 0.0, 0.0), end=(0.0, 0.0, height))
    way = np.append(rng.normal(size=2), 0.0)
    record = _moved(record, point + way / np.linalg.norm(way) * size * 10.0 ** rng.uniform(-1, 0.7))
    record = _moved(record, UP * (abs(off(rng)) * size - float(lowest(record, UP))))
    # below the light
    top = min(c[2] for c in light_corners(light)) if not isinstance(light, SphereLight) else (
        light.center[2] - light.radius)  # fmt: skip
    high = -float(lowest(record, -UP))
    if high > top - ABOVE:
        lift = vector(np.array(light.center) + UP * (high - top + 1.0))
        light = replace(light, center=lift)
    return _red(camera, record, light)


def outline(rng, kind):
    """Blue: a solid whose outline touches a corner or a side of a pixel."""
    camera = some_camera(rng)
    eye = np.array(camera.matrix)[:3, 3]

    def spots():
        i, j = rng.integers(2, WIDTH - 3), rng.integers(2, HEIGHT - 3)
        corners = [np.asarray(c[:, 0], dtype=float) for c in pixel_corners(camera, [i], [j])]
        way, n = _corner_or_side(rng, corners)
        distance = rng.uniform(0.1, 0.5) * abs(eye[2] / way[2])
        return eye + distance * way, n, np.inf, distance

    record = _place(rng, kind, (-5.0, -0.9), spots)
    columns, rows = raster()
    pixel = pixel_corners(camera, columns, rows)
    solid = Solid(record, real(eye).reshape(3, 1) + 0 * pixel[0])
    margin = _crossed(solid, pixel)
    return _case(camera, record, LAMP, EDGE, margin, size_of(record) / np.linalg.norm(eye))


def _corner_or_side(rng, corners):
    """A direction to a corner or a side of a polygon, and the normal of a plane through it."""
    a, b = corners[:2]
    way, n = a, across(rng, a)
    if rng.random() < 0.5:
        way, n = a + rng.random() * (b - a), np.cross(a, b)
    return way / np.linalg.norm(way), n / np.linalg.norm(n) * rng.choice([-1.0, 1.0])


def _crossed(solid, corners):
    """Margin by which a solid hides some of a polygon and not all; NaN where all or nearly."""
    margin = meets_corners(solid, corners)
    rest = covers_not_all(solid, corners)
    return np.where(margin > 0, np.where(rest > 0, np.minimum(margin, rest), np.nan), margin)


def shadow_line(rng, kind):
    """Blue: the shadow of a solid under a point light touches a corner or a side of a pixel."""
    camera = some_camera(rng)

    def spots():
        nonlocal place
        i, j = rng.integers(2, WIDTH - 3), rng.integers(2, HEIGHT - 3)
        place, _ = light_place(rng, chosen_point(rng, camera))
        corners = [floor_points(camera, c)[0][:, 0] for c in pixel_corners(camera, [i], [j])]
        way, n = _corner_or_side(rng, [np.asarray(c, dtype=float) - place for c in corners])
        distance = place[2] / abs(way[2]) * rng.uniform(0.3, 0.8)
        return place + distance * way, n, place[2], distance

    place = None
    record = _place(rng, kind, (-4.0, -0.7), spots)
    columns, rows = raster()
    pixel = pixel_corners(camera, columns, rows)
    lamp = real(place).reshape(3, 1)
    ground = [floor_points(camera, way)[0] - lamp for way in pixel]
    margin = _crossed(Solid(record, lamp + 0 * ground[0]), ground)
    _, eye, way = _floor_view(camera)
    seen = meets_corners(Solid(record, eye + 0 * way), pixel)
    margin = np.where(seen < -1e-6, margin, np.nan)
    light = PointLight(vector(place), (1.0,) * 3)
    return _case(camera, record, light, EDGE, margin, size_of(record) / np.linalg.norm(place))


def _path(rng):
    """Displacements across a normal or not, of 0.01 to 30 sizes."""

    def moves(size, n):
        move = across(rng, n) + rng.choice([0.0, 0.5 * rng.random()]) * n
        return move * size * 10.0 ** rng.uniform(-2.0, 1.5)

    return moves


def _sometimes(record, points, way):
    """Margin by which half-lines meet a solid at some time and not at all times, or NaN."""
    move = np.array(record.motion.displacement)
    margin = meets_ray(Solid(record, points, move), way)
    rests = [meets_ray(Solid(_moved(record, s * move), points), way) for s in (-0.5, 0.5)]
    rest = -np.min(rests, axis=0)
    return np.where(margin > 0, np.where(rest > 0, np.minimum(margin, rest), np.nan), margin)


def passing(rng, kind):
    """Green: a moving solid that touches a pixel's ray on its way."""
    camera = some_camera(rng)
    eye = np.array(camera.matrix)[:3, 3]

    def spots():
        i, j = rng.integers(2, WIDTH - 2), rng.integers(2, HEIGHT - 2)
        way = np.asarray(directions(camera, [i + 0.5], [j + 0.5])[:, 0], dtype=float)
        way /= np.linalg.norm(way)
        distance = rng.uniform(0.1, 0.4) * abs(eye[2] / way[2])
        return eye + distance * way, across(rng, way), np.inf, distance

    record = _place(rng, kind, (-5.0, -1.0), spots, _path(rng))
    _, at, way = _floor_view(camera)
    margin = _sometimes(record, at + 0 * way, way)
    return _case(camera, record, LAMP, MOTION, margin, size_of(record) / np.linalg.norm(eye))


def passing_shadow(rng, kind):
    """Green: a moving solid whose point shadow touches a pixel's point of the floor."""
    camera = some_camera(rng)

    def spots():
        nonlocal place
        point = chosen_point(rng, camera)
        place, way = light_place(rng, point)
        distance = rng.uniform(0.2, 0.7) * np.linalg.norm(place - point)
        return point + distance * way, across(rng, way), place[2], distance

    place = None
    record = _place(rng, kind, (-5.0, -1.0), spots, _path(rng))
    point, eye, way = _floor_view(camera)
    margin = _sometimes(record, point, real(place).reshape(3, 1) - point)
    seen = meets_ray(Solid(record, eye + 0 * way, record.motion.displacement), way)
    margin = np.where(seen < -1e-6, margin, np.nan)
    light = PointLight(vector(place), (1.0,) * 3)
    return _case(camera, record, light, MOTION, margin, size_of(record) / np.linalg.norm(place))


FAMILIES = (hidden_light, tiny, resting, outline, shadow_line, passing, passing_shadow)


def adversarial_solid(seed):
    """The scene of a seed, its family's name and its kind: families and kinds in turn."""
    rng = np.random.default_rng((seed, 7))
    family, kind = FAMILIES[seed % len(FAMILIES)], KINDS[seed // len(FAMILIES) % len(KINDS)]
    return family(rng, kind), family.__name__.replace("_", " "), kind
