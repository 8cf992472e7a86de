# SPDX-License-Identifier: GPL-3.0-or-later
"""Where instances of a mesh are: linear maps and offsets from its own space, which may move.

Motion follows Cycles (`transform_motion_decompose` and `transform_motion_array_interpolate`,
util/transform.cpp): each matrix is split into a translation, a rotation and a symmetric map by the
polar decomposition; between two times the rotation is interpolated on the shortest great circle of
unit quaternions (Shoemake 1985), and the rest linearly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...numerics.arrays import Array, Ints
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.vector import cross, dot

__all__ = ["Placements", "applied", "stretch", "transposed"]


SAMPLES_PER_STEP = 16
"""Number of intervals of each step of a motion between whose ends paths are bounded by chords."""
NEARLY_PARALLEL = 1.0 - 1e-10
"""Cosine between quaternions from which they are interpolated linearly: the sines of the spherical
formula vanish there, and the two differ by less than rounding does."""
MARGIN = 1.0 + 2.0**-40
"""Factor of bounds on radii against their rounding."""


@dataclass(frozen=True)
class Placements:
    """Places of n instances relative to the camera.

    Attributes
    ----------
    linear : (3, 3, n) row, column; own space to metres, at the middle of the shutter.
    offset : (3, n) metres.
    motion : how these change during the shutter; None if they do not.
    """

    linear: Array
    offset: Array
    motion: _Motion | None = None

    @classmethod
    def make(cls, matrices: Array, origin: Array, displacement: Array | None) -> Placements:
        """Places from the matrices (k, 3, 4, n) of a record.

        origin : (3, 1) metres, the camera in world space.
        displacement : (3,) metres over the shutter that come to the motion of the matrices: that of
            the world relative to the camera; None for none.
        """
        linear, offset = matrices[:, :, :3], matrices[:, :, 3] - origin
        moves = len(matrices) > 1 and bool((matrices != matrices[:1]).any())
        if not moves and displacement is None:
            return cls(np.ascontiguousarray(linear[0]), np.ascontiguousarray(offset[0]))
        if not moves:
            linear, offset = (np.repeat(each[:1], 2, axis=0) for each in (linear, offset))
        if displacement is not None:
            time = np.linspace(-0.5, 0.5, len(linear))[:, None, None]
            offset = offset + time * displacement[:, None]
        motion = _Motion.make(linear, offset)
        middle = motion.at(np.arange(offset.shape[2]), np.zeros(offset.shape[2]))
        return cls(*middle, motion)

    @property
    def count(self) -> int:
        """Number of instances."""
        return int(self.offset.shape[1])

    def take(self, some: Ints) -> Placements:
        """Some of the instances, at the middle of the shutter."""
        return Placements(columns(self.linear, some, -1), columns(self.offset, some))

    @cached_property
    def inverse(self) -> Array:
        """Inverse maps (3, 3, n) at the middle of the shutter."""
        return _inverse(self.linear)

    def at(self, item: Ints, time: Array | float) -> tuple[Array, Array]:
        """Linear maps (3, 3, m) and offsets (3, m) of instances (m,) at times, a number or (m,)."""
        if self.motion is None or (not isinstance(time, np.ndarray) and time == 0.0):
            return columns(self.linear, item, -1), columns(self.offset, item)
        return self.motion.at(item, np.broadcast_to(np.asarray(time, dtype=np.float64), item.shape))

    def inverse_at(self, item: Ints, time: Array | float) -> Array:
        """Inverse maps (3, 3, m) of instances (m,) at times; 0 where an instance is flat."""
        if self.motion is None or (not isinstance(time, np.ndarray) and time == 0.0):
            return columns(self.inverse, item, -1)
        return _inverse(self.at(item, time)[0])

    def to_own(
        self, item: Ints, start: Array, way: Array, time: Array | float
    ) -> tuple[Array, Array]:
        """Starts and ways (3, m) of rays in the own spaces of instances (m,) at times.

        The way is 0 where an instance is flat.
        """
        linear, offset = self.at(item, time)
        moving = self.motion is not None and (isinstance(time, np.ndarray) or time != 0.0)
        inverse = _inverse(linear) if moving else columns(self.inverse, item, -1)
        return applied(inverse, start - offset), applied(inverse, way)

    def swept_balls(self, center: Array, radius: float) -> tuple[Array, Array, Array]:
        """Balls that enclose a moving ball of the own space.

        center : (3,) of that ball, and its radius.

        Returns
        -------
        center : (3, n) metres, at the middle of the shutter.  displacement : (3, n) metres over the
        shutter.  radius : (n,) metres, of balls whose centres move straight, that enclose the
        instances at all times.
        """
        middle = center[:, None]
        if self.motion is None:
            place = applied(self.linear, middle) + self.offset
            return place, np.zeros_like(place), stretch(self.linear) * radius * MARGIN
        return self.motion.swept_balls(middle, radius)


@dataclass(frozen=True)
class _Motion:
    """Decomposed matrices of n instances at k times; columns are numbered time * n + instance.

    Attributes
    ----------
    count : n.
    quaternion : (4, k n) unit, real part first; neighbours in time lie on one side.
    scale : (9, k n) symmetric maps, row by row.  offset : (3, k n) metres.
    """

    count: int
    quaternion: Array
    scale: Array
    offset: Array

    @classmethod
    def make(cls, linear: Array, offset: Array) -> _Motion:
        """Decompose linear maps (k, 3, 3, n); offset (k, 3, n)."""
        u, _, v = np.linalg.svd(linear.transpose(0, 3, 1, 2))
        turn = u @ v
        # a mirrored map is a turned one that is scaled by -1
        turn *= np.sign(np.linalg.det(turn))[..., None, None]
        scale = np.swapaxes(turn, -1, -2) @ linear.transpose(0, 3, 1, 2)
        quaternion = _quaternions(turn)
        for step in range(1, len(quaternion)):
            away = (quaternion[step] * quaternion[step - 1]).sum(axis=0) < 0.0
            quaternion[step] = np.where(away, -quaternion[step], quaternion[step])
        flat = quaternion.transpose(1, 0, 2), scale.transpose(2, 3, 0, 1), offset.transpose(1, 0, 2)
        sizes = zip(flat, (4, 9, 3), strict=True)
        return cls(
            offset.shape[2], *(np.ascontiguousarray(each).reshape(size, -1) for each, size in sizes)
        )

    @property
    def _steps(self) -> int:
        """Number of intervals between the times."""
        return self.offset.shape[1] // self.count - 1

    def at(self, item: Ints, time: Array) -> tuple[Array, Array]:
        """Linear maps (3, 3, m) and offsets (3, m) of instances (m,) at times (m,)."""
        last = self._steps
        place = (np.clip(time, -0.5, 0.5) + 0.5) * last
        step = np.minimum(place.astype(np.int64), last - 1)
        part = place - step
        one = step * self.count + item
        other = one + self.count
        turn = _slerp(columns(self.quaternion, one), columns(self.quaternion, other), part)
        scale, offset = (
            (1.0 - part) * columns(values, one) + part * columns(values, other)
            for values in (self.scale, self.offset)
        )
        return _product(_rotations(turn), scale.reshape(3, 3, -1)), offset

    def swept_balls(self, center: Array, radius: float) -> tuple[Array, Array, Array]:
        """See `Placements.swept_balls`; center (3, 1)."""
        steps, n = self._steps, self.count
        times = np.linspace(-0.5, 0.5, steps * SAMPLES_PER_STEP + 1)
        every = np.arange(n)
        ends = [self.at(every, np.full(n, time)) for time in (-0.5, 0.5)]
        first, last = (applied(linear, center) + offset for linear, offset in ends)
        middle, way = 0.5 * (first + last), last - first
        reach = np.zeros(n)
        for time in times:
            linear, offset = self.at(every, np.full(n, time))
            gap = applied(linear, center) + offset - (middle + time * way)
            reach = np.maximum(reach, np.sqrt(dot(gap, gap)) + stretch(linear) * radius)
        # between samples each point leaves its chord by up to h^2 / 8 of its acceleration, and the
        # chord lies within balls whose radii are those of its ends
        far = float(np.sqrt(dot(center[:, 0], center[:, 0]))) + radius
        scale = self.scale.reshape(3, 3, -1)
        size = stretch(scale).reshape(-1, n) * far
        change = stretch(scale[..., n:] - scale[..., :-n]).reshape(-1, n) * far
        cosine = (self.quaternion[:, n:] * self.quaternion[:, :-n]).sum(axis=0).reshape(-1, n)
        angle = 2.0 * np.arccos(np.minimum(cosine, 1.0))
        bent = angle * angle * np.maximum(size[1:], size[:-1]) + 2.0 * angle * change
        sagitta = bent.max(axis=0) / (8.0 * SAMPLES_PER_STEP**2)
        return middle, way, (reach + sagitta) * MARGIN


def applied(linear: Array, vector: Array) -> Array:
    """Vectors (3, m) mapped by linear maps (3, 3, m), by the same operations for each."""
    found: Array = linear[:, 0] * vector[0]
    found = found + linear[:, 1] * vector[1]
    found += linear[:, 2] * vector[2]
    return found


def transposed(linear: Array, vector: Array) -> Array:
    """Vectors (3, m) mapped by the transposes of linear maps (3, 3, m)."""
    return applied(linear.transpose(1, 0, 2), vector)


def stretch(linear: Array) -> Array:
    """Upper bounds (n,) on the factors by which linear maps (3, 3, n) lengthen vectors.

    They are the largest row sums of the metric, which are exact where the axes stay orthogonal.
    """
    metric = np.array([[dot(linear[:, i], linear[:, j]) for j in range(3)] for i in range(3)])
    found: Array = np.sqrt(np.abs(metric).sum(axis=1).max(axis=0)) * MARGIN
    return found


def _product(a: Array, b: Array) -> Array:
    """Products (3, 3, m) of linear maps."""
    return np.stack([applied(a, b[:, k]) for k in range(3)], axis=1)


def _inverse(linear: Array) -> Array:
    """Inverses (3, 3, m) of linear maps by their cofactors; 0 for maps without one."""
    a, b, c = linear[:, 0], linear[:, 1], linear[:, 2]
    rows = [cross(b, c), cross(c, a), cross(a, b)]
    volume = dot(a, rows[0])
    flat = ~(np.abs(volume) > TINY)
    with np.errstate(over="ignore", invalid="ignore"):
        found: Array = np.array(rows) / np.where(flat, 1.0, volume)
    found[:, :, flat] = 0.0
    return found


def _quaternions(turn: Array) -> Array:
    """Unit quaternions (k, 4, n) of rotations (k, n, 3, 3)."""
    m = np.moveaxis(turn, (-2, -1), (0, 1))
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    square = [trace, *(2.0 * m[k, k] - trace for k in range(3))]
    # four ways to get the same quaternion, of which the one by the largest component is exact
    ways = [
        (1.0 + trace, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]),
        (m[2, 1] - m[1, 2], 1.0 + square[1], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]),
        (m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], 1.0 + square[2], m[1, 2] + m[2, 1]),
        (m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 1.0 + square[3]),
    ]
    best = np.argmax(np.array(square), axis=0)
    found = np.take_along_axis(np.array(ways), best[None, None], axis=0)[0]
    found /= np.sqrt((found * found).sum(axis=0))
    unit: Array = np.ascontiguousarray(found.transpose(1, 0, 2))
    return unit


def _rotations(q: Array) -> Array:
    """Rotations (3, 3, m) of unit quaternions (4, m)."""
    w, x, y, z = q
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def _slerp(a: Array, b: Array, part: Array) -> Array:
    """Unit quaternions (4, m) on the great circle from a to b."""
    cosine = np.clip((a * b).sum(axis=0), -1.0, 1.0)
    angle = np.arccos(cosine)
    across = b - cosine * a
    size = np.sqrt((across * across).sum(axis=0))
    near = cosine > NEARLY_PARALLEL
    unit = across / np.where(near, 1.0, np.maximum(size, TINY))
    turned = np.cos(part * angle) * a + np.sin(part * angle) * unit
    straight = (1.0 - part) * a + part * b
    straight /= np.sqrt((straight * straight).sum(axis=0))
    found: Array = np.where(near, straight, turned)
    return found
