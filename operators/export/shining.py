# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes that shine: balls and flat faces of four parallel sides are lights, on both sides."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...adaptive_drt.scene.description import (
    Light,
    Quad,
    QuadLight,
    Quads,
    ShapeBatch,
    ShapeRecord,
    Sphere,
    SphereLight,
    vector_of,
)
from ...adaptive_drt.scene.sphere_batch import Spheres

MAX_FACES = 6
"""Number of shining faces of an object up to which each is a light: a box has six."""

MAX_POINTS = 64
"""Number of shining points of a cloud up to which each is a light: each light adds to the time of
every pixel."""

LIGHTS_NOTHING = (
    f"it shines and is seen, but lights nothing: only balls and up to {MAX_FACES} flat faces "
    "with four parallel sides are lights"
)
POINTS_LIGHT_NOTHING = (
    f"its points shine and are seen, but light nothing: only up to {MAX_POINTS} points are lights"
)


def shines(shape: ShapeRecord) -> bool:
    """Whether a shape, or some of several, has a material that shines."""
    if not isinstance(shape, ShapeBatch):
        return any(shape.material.emission)
    if not any(any(worn.emission) for worn in shape.materials):
        return False
    return any(any(shape.materials[slot].emission) for slot in np.unique(shape.slot).tolist())


def shining_lights(
    shapes: Sequence[ShapeRecord], name: str
) -> tuple[list[ShapeRecord], list[Light], str]:
    """Return an object's shapes with the lights that they are, and why some are none, or "".

    Each light is named after the object, and knows its own shape: that hides none of it, and is not
    lit by it.
    """
    kept: list[ShapeRecord] = []
    lights: list[Light] = []
    reason = ""
    for shape in shapes:
        if isinstance(shape, Sphere) and shines(shape):
            own, found = _ball(shape, _numbered(name, lights))
            kept.append(own)
            lights += found
        elif isinstance(shape, Spheres) and shines(shape):
            if shape.count > MAX_POINTS:
                kept.append(shape)
                reason = POINTS_LIGHT_NOTHING
                continue
            for ball in shape.records():
                assert isinstance(ball, Sphere)
                own, found = _ball(ball, _numbered(name, lights))
                kept.append(own)
                lights += found
        elif isinstance(shape, Quads) and shines(shape):
            glow = np.array([any(shape.materials[slot].emission) for slot in shape.slot.tolist()])
            if int(glow.sum()) > MAX_FACES:
                kept.append(shape)
                reason = LIGHTS_NOTHING
                continue
            if not glow.all():
                kept.append(shape.take(~glow))
            for face in shape.take(glow).records():
                assert isinstance(face, Quad)
                own, found = _face(face, _numbered(name, lights))
                kept.append(own)
                lights += found
        else:
            kept.append(shape)
            reason = LIGHTS_NOTHING if shines(shape) else reason
    return kept, lights, reason


def _numbered(name: str, lights: Sequence[Light]) -> str:
    """Return a name for an object's next light, other than those of its others."""
    return name if not lights else f"{name} ({len(lights) + 1})"


def _own(shape: Sphere | Quad, name: str) -> ShapeRecord:
    own = frozenset((name,))
    seen = replace(
        shape.visibility,
        unlit_by=shape.visibility.unlit_by | own,
        passed_by=shape.visibility.passed_by | own,
    )
    return replace(shape, visibility=seen)


def _ball(ball: Sphere, name: str) -> tuple[ShapeRecord, Iterator[Light]]:
    light = SphereLight(ball.center, ball.radius, ball.material.emission, ball.motion, True, name)
    return _own(ball, name), iter((light,))


def _face(face: Quad, name: str) -> tuple[ShapeRecord, Iterator[Light]]:
    """The face with the lights on its two sides."""
    u, v = np.array(face.edge_u) / 2.0, np.array(face.edge_v) / 2.0
    center = vector_of(np.array(face.corner) + u + v)
    sides = ((vector_of(u), vector_of(v)), (vector_of(v), vector_of(u)))
    glow = face.material.emission
    lights = (QuadLight(center, a, b, glow, face.motion, True, name) for a, b in sides)
    return _own(face, name), lights
