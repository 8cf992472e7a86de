# SPDX-License-Identifier: GPL-3.0-or-later
"""Ellipsoids in the oracle: brute force in units of their half axes.

The oracle's own modules stay as they are, since its answers are kept by a digest of their source:
here its functions for whatever is not a sphere are extended while a block of code runs.
"""

from __future__ import annotations

from contextlib import contextmanager
from functools import lru_cache

import numpy as np

from adaptive_drt.scene.description import Ellipsoid, Sphere
from oracle import samples, trace, truth

__all__ = ["ellipsoids_known"]

UNIT = Sphere((0.0, 0.0, 0.0), 1.0)
"""What an ellipsoid is in units of its half axes."""


@lru_cache(maxsize=256)
def _to_unit(ellipsoid):
    """Matrix that takes offsets from the centre to units of half axes, and the shortest one."""
    axes = np.array([ellipsoid.half_u, ellipsoid.half_v, ellipsoid.half_w], dtype=float).T
    return np.linalg.inv(axes), np.linalg.svd(axes, compute_uv=False)[-1]


def _ray(ellipsoid, o, d, t, margin):
    inverse, shortest = _to_unit(ellipsoid)
    start = (o - trace.moved(ellipsoid, ellipsoid.center, t)) @ inverse.T
    way = d @ inverse.T
    length = trace.norm(way)
    hit = trace._ray_sphere(UNIT, start, way / length[:, None], t, margin / shortest)
    normals = hit[2] @ inverse
    return hit[0] / length, hit[1], normals / trace.norm(normals)[:, None]


def _segment(ellipsoid, a, b, t, margin):
    inverse, shortest = _to_unit(ellipsoid)
    center = trace.moved(ellipsoid, ellipsoid.center, t)
    start, end = ((x - center) @ inverse.T for x in (a, b))
    return trace._segment_sphere(UNIT, start, end, t, margin / shortest)


def _flat(ellipsoid):
    """A parallelogram within an ellipsoid, whose corners are the places where it is looked for."""
    u, v = np.array(ellipsoid.half_u), np.array(ellipsoid.half_v)
    return np.array(ellipsoid.center) - (u + v) / 2.0, u, v


def _extended(known, own):
    """A function that is `own` for ellipsoids, and else as it was."""

    def either(shape, *arguments):
        return (own if isinstance(shape, Ellipsoid) else known)(shape, *arguments)

    return either


@contextmanager
def ellipsoids_known():
    """The oracle knows ellipsoids that the camera is outside of."""
    ways = (("_ray_quad", _ray), ("_segment_quad", _segment), ("flat_of", _flat))
    places = [(module, name, own) for name, own in ways for module in (trace, samples, truth)]
    before = [(m, name, getattr(m, name)) for m, name, _ in places if hasattr(m, name)]
    for module, name, own in places:
        if hasattr(module, name):
            setattr(module, name, _extended(getattr(module, name), own))
    try:
        yield
    finally:
        for module, name, known in before:
            setattr(module, name, known)
