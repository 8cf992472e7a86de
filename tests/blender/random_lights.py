# SPDX-License-Identifier: GPL-3.0-or-later
"""Random lamps and shapes that shine, of all kinds, over the balls of `things.balls_on_a_floor`."""

from __future__ import annotations

import math

import bmesh
import numpy as np
import things

__all__ = ["add_random_lights"]


def add_random_lights(rng):
    """Add one or two, and in some scenes a card among the balls; returns their kinds."""
    kinds = [rng.choice(KINDS) for _ in range(1 + int(rng.random() < 0.5))]
    for kind in kinds:
        kind(rng)
    if rng.random() < 0.4:
        things.plane("Card", 0.8).location = (0.3, -0.6, 1.6)
    return [kind.__name__.strip("_") for kind in kinds]


def _placed(thing, rng, low, high, turn):
    thing.location = (*rng.uniform(-1.5, 1.5, 2), rng.uniform(low, high))
    thing.rotation_euler = rng.normal(size=3) * turn
    return thing


def _area(rng):
    shape = str(rng.choice(["RECTANGLE", "SQUARE", "DISK", "ELLIPSE"]))
    size, other = rng.uniform(0.3, 2.0, 2)
    lamp = things.light("AREA", energy=120.0, shape=shape, size=size, size_y=other)
    if rng.random() < 0.5:
        lamp.data.spread = math.radians(10.0 ** rng.uniform(0.7, 2.2))
    _placed(lamp, rng, 2.7, 5.0, 0.6).visible_camera = bool(rng.random() < 0.4)
    lamp.scale = rng.uniform(0.4, 1.6, 3) * rng.choice([-1, 1], 3)


def _spot(rng):
    lamp = things.light(
        "SPOT", energy=400.0, shadow_soft_size=float(rng.choice([0.0, 0.1, 0.5])),
        use_soft_falloff=bool(rng.random() < 0.5), spot_size=rng.uniform(0.4, 2.4),
        spot_blend=rng.uniform(0.05, 1.0),
    )  # fmt: skip
    _placed(lamp, rng, 2.7, 5.0, 0.4).visible_camera = False
    if rng.random() < 0.7:
        lamp.scale = rng.uniform(0.3, 2.5, 3)


def _point(rng):
    lamp = things.light(
        "POINT", energy=200.0, shadow_soft_size=float(rng.choice([0.0, 0.3, 0.6])),
        use_soft_falloff=bool(rng.random() < 0.5),
    )  # fmt: skip
    _placed(lamp, rng, 2.7, 5.0, 0.4).visible_camera = bool(rng.random() < 0.4)
    lamp.scale = rng.uniform(0.3, 2.0, 3)


def _glow():
    return things.material("Glow", "ShaderNodeEmission", Color=(1.0, 0.7, 0.4, 1.0), Strength=4.0)


def _face(rng):
    """A polygon of a random outline, convex or not."""
    count = int(rng.integers(3, 9))
    turns, sizes = np.sort(rng.uniform(0.0, 2.0 * np.pi, count)), rng.uniform(0.3, 1.0, count)
    corners = [(r * math.cos(t), r * math.sin(t), 0.0) for r, t in zip(sizes, turns, strict=True)]
    face = things.mesh_object("Face", corners, [tuple(range(count))])
    _placed(face, rng, 2.4, 3.4, 0.6).data.materials.append(_glow())


def _solid(rng):
    """A prism, a pyramid or a truncated one, closed or without its ends."""
    caps, top = bool(rng.random() < 0.8), float(rng.choice([0.0, 0.3, 0.6]))
    segments = int(rng.integers(3, 6))
    solid = things.made(
        "Solid",
        lambda work: bmesh.ops.create_cone(
            work, cap_ends=caps, segments=segments, radius1=0.6, radius2=top, depth=0.8
        ),
    )
    _placed(solid, rng, 2.4, 3.4, 0.6).data.materials.append(_glow())


def _ball(rng):
    ball = things.uv_sphere("Glow", 0.3, segments=128, rings=64)
    _placed(ball, rng, 2.4, 3.4, 0.0).data.materials.append(_glow())


KINDS = (_area, _spot, _point, _face, _solid, _ball)
