# SPDX-License-Identifier: GPL-3.0-or-later
"""Opaque balls and ellipsoids, and the disks that lie within them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.vector import cross, dot, norm, perpendicular_pair
from ...scene.description import (
    Ellipsoid,
    Motion,
    ShapeBatch,
    ShapeRecord,
    Sphere,
    Visibility,
)
from ...scene.sphere_batch import Spheres

__all__ = ["OpaqueBalls", "opaque_balls"]


@dataclass(frozen=True)
class OpaqueBalls:
    """Balls and ellipsoids.

    Attributes
    ----------
    center : (3, k) metres.  reach : (k,) metres, how far they go from there along x.
    inverse : (3, 3, k) per metre, of the matrix whose columns are three half axes: it makes unit
        balls of them.
    manner : (k,) numbers, equal for shapes that move alike and are met by the same rays.
    moved : (3, k) metres, over the shutter.
    """

    center: Array
    reach: Array
    inverse: Array
    manner: Ints
    moved: Array

    def chosen(self, which: Mask) -> OpaqueBalls:
        """Some of them."""
        own = np.flatnonzero(which)
        places = self.center[:, own], self.reach[own], self.inverse[:, :, own]
        return OpaqueBalls(*places, self.manner[own], self.moved[:, own])

    def are_outside(self, eye: Array, drift: Array) -> Mask:
        """Whether a camera is outside of each (k,) during the whole shutter.

        eye : (3,) metres, its place at mid-shutter.  drift : its displacement.
        """
        start = _images(self.inverse, self.center - eye[:, None])
        way = _images(self.inverse, self.moved - drift[:, None])
        square = np.maximum(dot(way, way), np.finfo(np.float64).tiny)
        time = np.clip(-dot(start, way) / square, -0.5, 0.5)
        outside: Mask = norm(start + time * way) > 1.0
        return outside

    def hold(self, ball: Ints, center: Array, normal: Array, radius: Array) -> Mask:
        """Whether disks (m,) lie within balls (m,). The answer may be no for stretched ellipsoids
        that a disk nearly touches.

        The unit ball has an ellipse for each disk: it is not larger than the disk about its centre
        whose radius is its longer half axis.

        Parameters
        ----------
        center, normal : (3, m) metres and unit.  radius : (m,) metres.
        """
        inverse = self.inverse[:, :, ball]
        gap = _images(inverse, center - self.center[:, ball])
        u, v = (radius * _images(inverse, each) for each in perpendicular_pair(normal))
        out = cross(u, v)
        out = out / np.maximum(norm(out), np.finfo(np.float64).tiny)
        height = dot(gap, out)
        uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
        longest = np.sqrt(0.5 * (uu + vv) + np.hypot(0.5 * (uu - vv), uv))
        within: Mask = np.hypot(height, norm(gap - height * out) + longest) < 1.0
        return within


def opaque_balls(
    records: Iterable[ShapeRecord], manners: Mapping[tuple[Motion | None, Visibility], int]
) -> OpaqueBalls:
    """Return the balls and ellipsoids among shapes.

    manners : numbers by how shapes move and are met; those of other manners are left out.
    """
    places, axes, manner, moved = [np.zeros((3, 0))], [np.zeros((3, 3, 0))], [], []
    for each in records:
        if (each.motion, each.visibility) not in manners:
            continue
        if isinstance(each, Ellipsoid):
            own = np.array([each.half_u, each.half_v, each.half_w], dtype=np.float64).T[..., None]
        elif isinstance(each, Sphere | Spheres):
            if isinstance(each, ShapeBatch) and each.displacements() is not None:
                continue
            own = np.eye(3)[:, :, None] * np.asarray(each.radius, dtype=np.float64)
        else:
            continue
        places.append(np.asarray(each.center, dtype=np.float64).reshape(3, -1))
        count = places[-1].shape[1]
        axes.append(np.broadcast_to(own, (3, 3, count)))
        manner.append(np.full(count, manners[each.motion, each.visibility]))
        way = (0.0, 0.0, 0.0) if each.motion is None else each.motion.displacement
        moved.append(np.broadcast_to(np.array(way, dtype=np.float64)[:, None], (3, count)))
    every = np.concatenate(axes, axis=2)
    # points of no radius are no balls
    full = np.flatnonzero(np.linalg.det(every.transpose(2, 0, 1)) != 0.0)
    every = every[:, :, full]
    inverse = np.linalg.inv(every.transpose(2, 0, 1)).transpose(1, 2, 0)
    return OpaqueBalls(
        np.concatenate(places, axis=1)[:, full],
        norm(np.ascontiguousarray(every[0])),
        np.ascontiguousarray(inverse),
        np.concatenate([np.zeros(0, dtype=np.int64), *manner])[full],
        np.concatenate([np.zeros((3, 0)), *moved], axis=1)[:, full],
    )


def _images(matrix: Array, vector: Array) -> Array:
    """Products (3, n) of matrices (3, 3, n) and vectors (3, n)."""
    return np.stack([dot(row, vector) for row in matrix])
