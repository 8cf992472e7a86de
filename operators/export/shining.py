# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes that shine: balls and flat faces are lights, on both sides."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ...adaptive_drt.scene.convex_parts import convex_parts
from ...adaptive_drt.scene.description import (
    Light,
    PolygonLight,
    Quad,
    QuadLight,
    Quads,
    ShapeBatch,
    ShapeRecord,
    Sphere,
    SphereLight,
    Triangles,
    Visibility,
    vector_of,
)
from ...adaptive_drt.scene.primitive_recognition import Facets
from ...adaptive_drt.scene.sphere_batch import Spheres

MAX_FACES = 24
"""Number of shining convex faces of an object up to which each is a light on both sides. Each takes
time wherever it may be seen from."""
MAX_SHINING_TRIANGLES = 128
"""Number of triangles that the faces of a shining object may be cut into: a disk of 128 sides has
126."""

MAX_POINTS = 64
"""Number of shining points of a cloud up to which each is a light: each light adds to the time of
every pixel."""

LIGHTS_NOTHING = (
    f"it shines and is seen, but lights nothing: only balls and up to {MAX_FACES} flat faces "
    "are lights"
)
POINTS_LIGHT_NOTHING = (
    f"its points shine and are seen, but light nothing: only up to {MAX_POINTS} points are lights"
)

Own = TypeVar("Own", Sphere, Quad, Triangles)


def shines(shape: ShapeRecord) -> bool:
    """Whether a shape, or some of several, has a material that shines."""
    if not isinstance(shape, ShapeBatch):
        return any(shape.material.emission)
    if not any(any(worn.emission) for worn in shape.materials):
        return False
    return any(any(shape.materials[slot].emission) for slot in np.unique(shape.slot).tolist())


def are_lights(facets: Facets, shining: Set[int]) -> bool:
    """Whether the faces of a mesh that shine are few enough to be lights.

    shining : slots of the materials that shine.
    """
    flat, cut = (
        np.isin(each.slot, list(shining)) for each in (facets.parallelograms, facets.triangles)
    )
    vertices = facets.triangles.points[:, facets.triangles.corners[:, cut]].transpose(1, 0, 2)
    parts = convex_parts(vertices, facets.triangles.slot[cut]) if cut.any() else []
    return int(flat.sum()) + len(parts) <= MAX_FACES


def shining_lights(
    shapes: Sequence[ShapeRecord], name: str
) -> tuple[list[ShapeRecord], list[Light], str]:
    """Return an object's shapes with the lights that they are, and why they are none, or "".

    Each light is named after the object, and knows its own shape: that hides none of it, and is not
    lit by it.
    """
    kept: list[ShapeRecord] = []
    lights: list[Light] = []
    faces = 0
    for shape in shapes:
        parts: list[tuple[ShapeRecord, list[Light]]] = [(shape, [])]
        if isinstance(shape, Sphere) and shines(shape):
            parts = [_ball(shape, _numbered(name, len(lights)))]
        elif isinstance(shape, Spheres) and shines(shape):
            if shape.count > MAX_POINTS:
                return list(shapes), [], POINTS_LIGHT_NOTHING
            balls = (ball for ball in shape.records() if isinstance(ball, Sphere))
            parts = [_ball(ball, _numbered(name, k)) for k, ball in enumerate(balls)]
        elif isinstance(shape, Quads | Triangles) and shines(shape):
            glow = np.array([any(shape.materials[slot].emission) for slot in shape.slot.tolist()])
            parts = [] if glow.all() else [(shape.take(~glow), [])]
            some, first = shape.take(glow), len(lights)
            made = (
                _quads(some, name, first) if isinstance(some, Quads) else _flats(some, name, first)
            )
            parts += made
            faces += len(made)
        elif shines(shape):
            return list(shapes), [], LIGHTS_NOTHING
        for own, found in parts:
            kept.append(own)
            lights += found
    if faces > MAX_FACES:
        return list(shapes), [], LIGHTS_NOTHING
    return kept, lights, ""


def _numbered(name: str, count: int) -> str:
    """Return a name for an object's next light, other than those of its `count` others."""
    return name if not count else f"{name} ({count + 1})"


def _own(shape: Own, name: str) -> Own:
    own = frozenset((name,))
    seen: Visibility = replace(
        shape.visibility,
        unlit_by=shape.visibility.unlit_by | own,
        passed_by=shape.visibility.passed_by | own,
    )
    return replace(shape, visibility=seen)


def _ball(ball: Sphere, name: str) -> tuple[ShapeRecord, list[Light]]:
    light = SphereLight(ball.center, ball.radius, ball.material.emission, ball.motion, True, name)
    return _own(ball, name), [light]


def _quads(faces: Quads, name: str, count: int) -> list[tuple[ShapeRecord, list[Light]]]:
    """Return parallelograms with the lights on the two sides of each.

    count : number of the object's lights before them.
    """
    records = (face for face in faces.records() if isinstance(face, Quad))
    return [_quad(face, _numbered(name, count + 2 * k)) for k, face in enumerate(records)]


def _quad(face: Quad, name: str) -> tuple[ShapeRecord, list[Light]]:
    u, v = np.array(face.edge_u) / 2.0, np.array(face.edge_v) / 2.0
    center = vector_of(np.array(face.corner) + u + v)
    sides = ((vector_of(u), vector_of(v)), (vector_of(v), vector_of(u)))
    glow = face.material.emission
    lights = [QuadLight(center, a, b, glow, face.motion, True, name) for a, b in sides]
    return _own(face, name), list[Light](lights)


def _flats(faces: Triangles, name: str, count: int) -> list[tuple[ShapeRecord, list[Light]]]:
    """Return triangles with the lights on the two sides of each convex polygon that they make up.

    count : number of the object's lights before them.
    """
    found: list[tuple[ShapeRecord, list[Light]]] = []
    for k, part in enumerate(convex_parts(faces.vertices, faces.slot)):
        own, own_name = faces.take(part.members), _numbered(name, count + 2 * k)
        corners = tuple(vector_of(corner) for corner in part.corners)
        glow = faces.materials[int(own.slot[0])].emission
        lights: Iterator[Light] = (
            PolygonLight(way, glow, faces.motion, True, own_name)
            for way in (corners, corners[::-1])
        )
        found.append((_own(own, own_name), list(lights)))
    return found
