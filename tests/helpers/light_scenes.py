# SPDX-License-Identifier: GPL-3.0-or-later
"""Seeded random scenes of all kinds of lights and skies, seen lights and linking.

Shapes, motion and cameras are those of `random_scenes`, with boxes and triangles. Pictures are
small, so that many scenes can be compared with brute force (`oracle.every_light`).
"""

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import (
    EllipseLight,
    EnvironmentLight,
    Material,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    SkyLight,
    Sphere,
    SphereLight,
    SpotLight,
    SunLight,
    Triangle,
    Visibility,
    vector_of,
)
from adaptive_drt.scene.preetham_sky import preetham_radiance
from random_scenes import (
    random_camera,
    random_floor,
    random_light,
    random_motion,
    random_quad,
    random_sphere,
    touch,
)
from sphere_images import glow, noise, random_turn

__all__ = ["light_scene"]

SKIES = "sky", "image", "noise", "clear sky"
"""Kinds of light from all directions; there is one at most, with a sun in the last."""
LIGHTS = "any", "sun", "hard sun", "spot", "ball spot", "point spot", "ellipse", "quad", "spread"
MOST_LIGHTS = 4
SKY_SHARE = 0.5
"""Share of the scenes that have a sky."""
SEEN_SHARE, LINKED_SHARE, STILL_SHARE = 0.3, 0.25, 0.4
"""Shares of lights that are seen, of scenes with linking, and of those in which nothing moves."""

CLEARANCE = 0.5
"""Least distance of lights from the camera, in metres."""


def light_scene(seed, side=16):
    """Scene of a seed: the same on every machine. side : pixels of the longer side."""
    rng = np.random.default_rng([seed, 11])
    shapes = [random_floor(rng)] if rng.random() < 0.85 else []
    shapes += [random_sphere(rng) for _ in range(rng.integers(1, 5))]
    shapes += [random_quad(rng) for _ in range(rng.integers(0, 3))]
    shapes += [_triangle(rng) for _ in range(rng.integers(0, 2))]
    shapes += _box(rng) if rng.random() < 0.4 else []
    lights, backdrop = [], None
    if rng.random() < SKY_SHARE:
        lights, backdrop = _sky(rng, str(rng.choice(SKIES)))
    count = max(len(lights), rng.integers(1, MOST_LIGHTS + 1))
    camera = random_camera(rng)
    while len(lights) < count:
        light = _light(rng, str(rng.choice(LIGHTS)))
        if isinstance(light, SunLight) or not any(
            touch(light, thing) for thing in (*shapes, _around(camera))
        ):
            lights.append(light)
    lights = [replace(light, name=f"Light {k}") for k, light in enumerate(lights)]
    lights = [
        replace(light, seen=True) if _may_be_seen(light) and rng.random() < SEEN_SHARE else light
        for light in lights
    ]
    if rng.random() < LINKED_SHARE:
        shapes = [_linked(rng, shape, lights) for shape in shapes]
    background = (0.0, 0.0, 0.0) if rng.random() < 0.3 else vector_of(rng.random(3))
    width, height = camera.resolution
    size = side / max(width, height)
    resolution = max(2, round(width * size)), max(2, round(height * size))
    camera = replace(camera, resolution=resolution)
    scene = Scene(camera, tuple(shapes), tuple(lights), background, backdrop=backdrop)
    return _still(scene) if rng.random() < STILL_SHARE else scene


def _around(camera):
    """A ball around the camera and its way."""
    return Sphere(vector_of(row[3] for row in camera.matrix[:3]), CLEARANCE)


def _may_be_seen(light):
    return not isinstance(light, SkyLight | EnvironmentLight | PointLight)


def _still(scene):
    return replace(
        scene,
        camera=replace(scene.camera, motion=None),
        shapes=tuple(replace(shape, motion=None) for shape in scene.shapes),
        lights=tuple(
            light if light.motion is None else replace(light, motion=None) for light in scene.lights
        ),
    )


def _material(rng):
    return Material(vector_of(rng.uniform(0.1, 1.0, 3)))


def _triangle(rng):
    center = rng.uniform((-2.0, -2.0, 0.3), (2.0, 2.0, 3.0))
    vertices = tuple(vector_of(center + rng.normal(size=3)) for _ in range(3))
    return Triangle(vertices, _material(rng), random_motion(rng, 0.3))


def _box(rng):
    """Six faces of a box that stands on the floor, or turned at random above it."""
    turn = np.array(random_turn(rng))
    if rng.random() < 0.6:
        angle = rng.uniform(0.0, 2.0 * np.pi)
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([(c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)])
    edges = turn * rng.uniform(0.3, 1.5, 3)[:, None]
    center = rng.uniform((-2.0, -2.0, 0.5), (2.0, 2.0, 2.5))
    if turn[2, 2] == 1.0:
        center[2] = edges[2, 2] / 2.0
    material, motion = _material(rng), random_motion(rng, 0.3)
    faces = []
    for k in range(3):
        u, v, w = edges[(k + 1) % 3], edges[(k + 2) % 3], edges[k]
        for side in (-0.5, 0.5):
            corner = vector_of(center + side * w - (u + v) / 2.0)
            faces.append(Quad(corner, vector_of(u), vector_of(v), material, motion, "Box"))
    return faces


def _color(rng, low, high):
    return vector_of(rng.uniform(low, high, 3))


def _sky(rng, kind):
    """Lights from all directions, and what the camera sees behind all shapes."""
    if kind == "sky":
        return [SkyLight(_color(rng, 0.2, 2.0), casts_shadow=bool(rng.random() < 0.95))], None
    suns = []
    if kind == "noise":
        rows = int(rng.choice((4, 12, 40)))
        pixels, turn = noise(rng, rows, 2 * rows), random_turn(rng)
    elif kind == "image":
        pixels, turn = glow(int(rng.choice((16, 48))), 64), random_turn(rng)
    else:
        way = rng.normal(size=3)
        way[2] = abs(way[2]) + 0.1
        pixels, turn = _clear_sky(way, rng.uniform(2.0, 6.0)), None
        suns = [SunLight(vector_of(-way), _color(rng, 1.0, 5.0), 0.00918)]
    pixels.flags.writeable = False
    light = EnvironmentLight(pixels, _color(rng, 0.5, 1.5))
    if turn is not None:
        light = replace(light, rotation=tuple(vector_of(row) for row in turn))
    return [light, *suns], light if rng.random() < 0.7 else None


def _clear_sky(sun, turbidity, rows=24):
    """Image of the sky about a sun, dark below the horizon."""
    theta = (np.arange(rows) + 0.5) * np.pi / rows
    psi = np.pi * (1.0 - (2.0 * np.arange(2 * rows) + 1.0) / (2 * rows))
    z = np.broadcast_to(np.cos(theta)[:, None], (rows, 2 * rows))
    aside = np.sin(theta)[:, None]
    way = np.stack([aside * np.cos(psi), aside * np.sin(psi), z], axis=2)
    pixels = preetham_radiance(way, vector_of(sun), turbidity)
    return np.maximum(pixels, 0.0) * np.where(z > 0.0, 1.0, 0.3)[..., None]


def _light(rng, kind):
    """A light of a kind."""
    if kind in ("any", "quad"):
        light = random_light(rng)
        while kind == "quad" and not isinstance(light, QuadLight):
            light = random_light(rng)
        return light
    if kind in ("sun", "hard sun"):
        way = rng.normal(size=3)
        way[2] = -abs(way[2]) - 0.2
        angle = float(10.0 ** rng.uniform(-2.5, -0.2)) if kind == "sun" else 0.0
        return SunLight(vector_of(way), _color(rng, 0.5, 4.0), angle)
    light = random_light(rng)
    if "spot" in kind:
        while not isinstance(light, SphereLight):
            light = random_light(rng)
        way = -np.array(light.center) + 0.8 * rng.normal(size=3)
        blend = float(rng.choice((0.0, 0.15, 1.0, rng.random())))
        radius = 0.0 if kind == "point spot" else light.radius
        intensity = vector_of(10.0 * np.array(light.radiance))
        return SpotLight(
            light.center, vector_of(way), intensity, float(rng.uniform(0.2, 2.5)), blend, radius,
            kind == "spot", light.motion, light.casts_shadow,
        )  # fmt: skip
    while not isinstance(light, QuadLight):
        light = random_light(rng)
    if kind == "ellipse" or rng.random() < 0.5:
        light = EllipseLight(
            light.center, light.half_u, light.half_v, light.radiance, light.motion,
            light.casts_shadow,
        )  # fmt: skip
    if kind == "spread":
        light = replace(light, spread=float(rng.uniform(0.3, 3.0)))
    return light


def _linked(rng, shape, lights):
    """A shape that some lights do not light, or that does not hide some."""
    names = [light.name for light in lights]
    unlit, passed = (frozenset(n for n in names if rng.random() < 0.15) for _ in range(2))
    return replace(shape, visibility=Visibility(unlit_by=unlit, passed_by=passed))
