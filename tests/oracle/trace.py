# SPDX-License-Identifier: GPL-3.0-or-later
"""Nearest hits and blocked segments, each with whether the answer is clear by a margin."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from adaptive_drt.scene.description import Sphere, Triangle

__all__ = [
    "BLOCKED",
    "OPEN",
    "UNSURE",
    "Hits",
    "extent",
    "flat_of",
    "moved",
    "moves",
    "nearest",
    "norm",
    "states",
]

MARGIN = 1e-8
"""Share of the scene's extent by which an answer must be clear to count as evidence."""

LEAST_SLOPE = 1e-6
"""Sine of the angle between a line and a plane below which their meeting is not trusted."""

BLOCKED, OPEN, UNSURE = 1, -1, 0


@dataclass
class Hits:
    """ids (n,), -1 = background; clear (n,); points, normals (n, 3) towards the ray's origin."""

    ids: np.ndarray
    clear: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    inside: np.ndarray


def dot(a, b):
    """Row-wise dot product of (n, 3) arrays."""
    return np.einsum("ij,ij->i", a, b)


def norm(a):
    """Row-wise length of an (n, 3) array."""
    return np.sqrt(np.einsum("ij,ij->i", a, a))


def moves(thing):
    """Whether it has a motion other than zero."""
    return thing.motion is not None and any(thing.motion.displacement)


def moved(thing, position, t):
    """A position (3,) of a thing at times t (n,): (n, 3)."""
    move = np.zeros(3) if thing.motion is None else np.array(thing.motion.displacement)
    return np.array(position, dtype=float) + np.asarray(t, dtype=float)[:, None] * move


FLAT = ("corner", "edge_u", "edge_v")
"""Vectors of a quad."""


def flat_of(shape):
    """Corner and two edges (3,) of a quad or triangle."""
    if isinstance(shape, Triangle):
        a, b, c = (np.array(vertex, dtype=float) for vertex in shape.vertices)
        return a, b - a, c - a
    return tuple(np.array(getattr(shape, name), dtype=float) for name in FLAT)


@lru_cache(maxsize=64)
def extent(scene):
    """Largest coordinate or radius of the scene: the length that margins are a share of."""
    sizes = [1e-300]
    for thing in (*scene.shapes, *scene.lights):
        for name in (*FLAT, "center", "half_u", "half_v", "radius", "vertices"):
            sizes.append(np.abs(getattr(thing, name, 0.0)).max())
    sizes.append(max(abs(row[3]) for row in scene.camera.matrix[:3]))
    return float(max(sizes))


@lru_cache(maxsize=256)
def frame_of(flat):
    """Matrix that takes world offsets to (u, v, height over the plane); the sides; the normal.

    Each side is (a, b, c, width): a + b u + c v is 0 on the edge and 1 where the shape ends, that
    many metres away.
    """
    _, u, v = flat_of(flat)
    normal = np.cross(u, v)
    area = np.linalg.norm(normal)
    normal = normal / area
    sides = [(0.0, 1.0, 0.0, v), (0.0, 0.0, 1.0, u)]
    if isinstance(flat, Triangle):
        sides += [(1.0, -1.0, -1.0, v - u)]
    else:
        sides += [(1.0, -1.0, 0.0, v), (1.0, 0.0, -1.0, u)]
    sides = tuple((a, b, c, area / np.linalg.norm(edge)) for a, b, c, edge in sides)
    return np.linalg.inv(np.stack([u, v, normal], axis=1)), sides, normal


def _inner(at, sides):
    """How many metres points (n, 2) of a plane lie within the edge that is nearest."""
    return np.min([(a + b * at[:, 0] + c * at[:, 1]) * width for a, b, c, width in sides], axis=0)


def _ray_sphere(sphere, o, d, t, margin):
    center = moved(sphere, sphere.center, t)
    along = dot(center - o, d)
    foot = o + along[:, None] * d
    off = norm(center - foot)
    half = np.sqrt(np.maximum((sphere.radius - off) * (sphere.radius + off), 0.0))
    near, far = along - half, along + half
    gap = off - sphere.radius
    depth = np.where(near > 0.0, near, np.where(far > 0.0, far, np.inf))
    depth = np.where(gap < 0.0, depth, np.inf)
    behind = along < -(sphere.radius + margin)
    pierced = (gap < -margin) & (np.abs(near) > margin) & (np.abs(far) > margin)
    normals = (o + np.where(np.isfinite(depth), depth, 0.0)[:, None] * d - center) / sphere.radius
    return depth, pierced | behind | (gap > margin), normals


def _ray_quad(quad, o, d, t, margin):
    inverse, sides, normal = frame_of(quad)
    start = (o - moved(quad, flat_of(quad)[0], t)) @ inverse.T
    step = d @ inverse.T
    slope = step[:, 2]
    safe = np.abs(slope) > LEAST_SLOPE
    depth = np.where(safe, -start[:, 2] / np.where(safe, slope, 1.0), np.inf)
    at = start[:, :2] + np.where(safe, depth, 0.0)[:, None] * step[:, :2]
    inner = _inner(at, sides)
    hit = safe & (inner >= 0.0) & (depth > 0.0)
    slack = margin / np.maximum(np.abs(slope), LEAST_SLOPE)
    clear = safe & ((np.abs(inner) > slack) & (np.abs(depth) > slack) | (depth < -slack))
    return np.where(hit, depth, np.inf), clear, np.broadcast_to(normal, o.shape)


def nearest(scene, o, d, t):
    """Nearest shape along unit directions d (n, 3) from o at times t (n,): `Hits`."""
    margin = MARGIN * extent(scene)
    n = len(o)
    best, second = np.full(n, np.inf), np.full(n, np.inf)
    ids, clear = np.full(n, -1), np.ones(n, dtype=bool)
    normals = np.zeros((n, 3))
    for index, shape in enumerate(scene.shapes):
        meet = _ray_sphere if isinstance(shape, Sphere) else _ray_quad
        depth, sure, normal = meet(shape, o, d, t, margin)
        clear &= sure
        closer = depth < best
        second = np.where(closer, best, np.minimum(second, depth))
        normals = np.where(closer[:, None], normal, normals)
        ids = np.where(closer, index, ids)
        best = np.where(closer, depth, best)
    hit = ids >= 0
    first = np.where(hit, best, 0.0)
    gap = np.where(np.isfinite(second), second, np.inf) - first
    clear &= ~hit | (gap > margin)
    away = dot(normals, d) > 0.0
    normals = np.where(away[:, None], -normals, normals)
    return Hits(ids, clear, o + first[:, None] * d, normals, away)


def _segment_sphere(sphere, a, b, t, margin):
    """State of segments a to b against the surface of a sphere at t."""
    center = moved(sphere, sphere.center, t)
    whole = b - a
    length2 = np.maximum(dot(whole, whole), np.finfo(float).tiny)
    share = np.clip(dot(center - a, whole) / length2, 0.0, 1.0)
    closest = norm(a + share[:, None] * whole - center)
    ends = norm(a - center), norm(b - center)
    farthest, r = np.maximum(*ends), sphere.radius
    blocked = (closest < r - margin) & (farthest > r + margin)
    free = (closest > r + margin) | (farthest < r - margin)
    return np.where(blocked, BLOCKED, np.where(free, OPEN, UNSURE))


def _segment_quad(quad, a, b, t, margin):
    """State of segments a to b against a quad or triangle at t."""
    inverse, sides, _ = frame_of(quad)
    corner = moved(quad, flat_of(quad)[0], t)
    first, last = (a - corner) @ inverse.T, (b - corner) @ inverse.T
    h0, h1 = first[:, 2], last[:, 2]
    same = ((h0 > margin) & (h1 > margin)) | ((h0 < -margin) & (h1 < -margin))
    opposite = ((h0 > margin) & (h1 < -margin)) | ((h0 < -margin) & (h1 > margin))
    share = h0 / np.where(opposite, h0 - h1, 1.0)
    at = first[:, :2] + share[:, None] * (last[:, :2] - first[:, :2])
    inner = _inner(at, sides)
    # a grazing segment magnifies the error of the place where it meets the plane
    drop = np.maximum(np.abs(h0 - h1), margin)
    slack = margin * (1.0 + norm(b - a) / np.where(drop > 0.0, drop, 1.0))
    apart = same | (opposite & (inner < -slack))
    # both ends past the same side: nothing to meet, whatever the heights are
    for side in sides:
        apart |= np.maximum(_inner(first, [side]), _inner(last, [side])) < -margin
    blocked = opposite & (inner > slack)
    return np.where(blocked, BLOCKED, np.where(apart, OPEN, UNSURE))


def _own_sphere(sphere, hits_normals, a, b, inside, margin):
    """State against the sphere that a lies on: only its far wall can block, from inside."""
    whole = b - a
    length = np.maximum(norm(whole), np.finfo(float).tiny)
    leave = 2.0 * sphere.radius * dot(hits_normals, whole) / length
    blocked = inside & (leave < length - margin) & (leave > margin)
    free = ~inside | (leave > length + margin)
    return np.where(blocked, BLOCKED, np.where(free, OPEN, UNSURE))


def states(scene, a, b, t, own, normals, inside, which=None, share=MARGIN):
    """BLOCKED, OPEN or UNSURE for the open segments a to b (n, 3) at times t (n,).

    Parameters
    ----------
    own : (n,) shape that a lies on; normals, inside : its normal there, and whether seen from
        within. which : indices of the shapes that count, None = all. share : of the scene's
        extent, by which an answer must be clear; 0 decides all but exact contacts.
    """
    margin = share * extent(scene)
    result = np.full(len(a), OPEN)
    for index in range(len(scene.shapes)) if which is None else which:
        shape = scene.shapes[index]
        if isinstance(shape, Sphere):
            state = _segment_sphere(shape, a, b, t, margin)
            self_state = _own_sphere(shape, normals, a, b, inside, margin)
        else:
            state = _segment_quad(shape, a, b, t, margin)
            self_state = np.full(len(a), OPEN)
        state = np.where(own == index, self_state, state)
        blocked = (result == BLOCKED) | (state == BLOCKED)
        unsure = (result == UNSURE) | (state == UNSURE)
        result = np.where(blocked, BLOCKED, np.where(unsure, UNSURE, OPEN))
    return result
