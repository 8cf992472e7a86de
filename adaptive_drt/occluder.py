# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects may come between surface points and a light, during the whole shutter.

Conservative candidates: an object is dropped only where a bounding test proves that it matters
for no point of the light at no time. Blocks of neighbouring points are tested as one first
(shaft culling, Haines and Wallace 1991); with very many objects embree does that part.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .embree import ProxyScene
from .emitter import QUAD, Emitter, view_cone
from .plan import Plan
from .primary import Pairs, Surface
from .quadric import cone_touch
from .vector import dot

__all__ = ["Occluders", "every_pair"]

Array: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]

BLOCK = 128
"""Points that share one culling test: a compromise, measured flat between 64 and 256."""
MATRIX = 1 << 20
"""Block-object tests at a time, to bound memory."""


class Occluders:
    """Bounding spheres of all objects over the shutter, ready to be asked for candidates."""

    def __init__(self, plan: Plan) -> None:
        """Prepare the bounds, and embree's proxies where the plan wants them."""
        self._plan = plan
        center, radius = plan.quads.bounds
        self.center = np.concatenate([plan.spheres.center, center], axis=1)
        radius = np.concatenate([plan.spheres.radius, radius])
        for part, first in ((plan.spheres, 0), (plan.quads, plan.sphere_count)):
            d = part.displacement
            if d is not None:
                radius[first : first + d.shape[1]] += 0.5 * np.sqrt(dot(d, d))
        self.radius = radius
        flat = np.zeros(center.shape[1])
        self._bend = np.concatenate([1.0 / plan.spheres.radius, flat])
        self._proxies: dict[str, ProxyScene] = {}
        balls = plan.sphere_count
        if plan.embree and balls:
            for light in plan.lights:
                if light.casts_shadow:
                    reach = plan.shadow_light(light).radius + _half_path(light)
                    self._proxies[_key(light)] = ProxyScene(
                        self.center[:, :balls], self.radius[:balls] + reach
                    )

    def find(self, light: Emitter, surface: Surface, reach: Array | float = 0.0) -> Pairs:
        """Candidate pairs (point, object) for a light, sorted by point.

        Parameters
        ----------
        light : as it casts shadows.
        surface : n points.
        reach : (n,) metres; the candidates also serve all points within it of each point.
        """
        count = surface.item.size
        if not count or not self.radius.size or not light.casts_shadow:
            return Pairs(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
        reach = np.broadcast_to(np.asarray(reach, dtype=np.float64), (count,))
        proxies = None if (reach > 0.0).any() else self._proxies.get(_key(light))
        if proxies is None:
            pairs = self._shafts(light, surface, reach, 0)
        else:
            # quads have wide bounding spheres: embree would find them everywhere
            pairs = self._shafts(light, surface, reach, self._plan.sphere_count)
            pixel, item = proxies.along(surface.point, light.center)
            pairs = Pairs(np.concatenate([pixel, pairs.pixel]), np.concatenate([item, pairs.item]))
        pairs = pairs.take(self._matter(light, surface, reach, pairs))
        return pairs.take(np.lexsort((pairs.item, pairs.pixel)))

    def _shafts(self, light: Emitter, surface: Surface, reach: Array, begin_item: int) -> Pairs:
        """Candidates from object `begin_item` on, of blocks of points, spread to their points."""
        count = surface.item.size
        starts = np.arange(0, count, BLOCK)
        low = np.minimum.reduceat(surface.point, starts, axis=1)
        high = np.maximum.reduceat(surface.point, starts, axis=1)
        middle = 0.5 * (low + high)
        span = 0.5 * np.sqrt(dot(high - low, high - low)) + np.maximum.reduceat(reach, starts)
        pixels, items = [], []
        items_from = slice(begin_item, None)
        center, radius = self.center[:, items_from], self.radius[items_from]
        step = max(1, MATRIX // max(radius.size, 1))
        for first in range(0, starts.size, step):
            rows = slice(first, first + step)
            seen = _seen(light, middle[:, rows], span[rows], center, radius)
            block, item = np.nonzero(seen)
            begin = starts[block + first]
            size = np.minimum(begin + BLOCK, count) - begin
            offset = np.arange(size.sum()) - np.repeat(np.cumsum(size) - size, size)
            pixels.append(np.repeat(begin, size) + offset)
            items.append(np.repeat(item + begin_item, size))
        return Pairs(np.concatenate(pixels), np.concatenate(items))

    def _matter(
        self, light: Emitter, surface: Surface, reach: Array, pairs: Pairs
    ) -> NDArray[np.bool_]:
        """Which pairs stay when each point is tested by itself."""
        p = pairs.pixel
        point, item = surface.point[:, p], pairs.item
        center, radius = self.center[:, item], self.radius[item] + reach[p]
        v = center - point
        vv = dot(v, v)
        ball = _swept(light)
        cone = view_cone(ball, ball.center, point)
        touch, _, _ = cone_touch(cone.axis, cone.cosine, cone.sine, v, radius)
        keep: NDArray[np.bool_] = (vv <= radius * radius) | (
            touch & (np.sqrt(vv) - radius < cone.far)
        )
        # what lies below the point's horizon hides only light that does not count
        # (a sphere's normal turns by reach / r within reach)
        turn = self._bend[surface.item[p]] * reach[p] * np.sqrt(vv)
        keep &= dot(surface.normal[:, p], v) > -(radius + turn)
        if light.kind == QUAD:
            # a quad light emits to its front: what lies behind its plane is never between
            drift = (
                0.0
                if light.displacement is None
                else 0.5 * float(np.abs(dot(light.normal, light.displacement))[0])
            )
            keep &= dot(light.normal, center - light.center) > -(radius + drift)
        # an object does not shadow itself but for the inner side of a sphere
        own = (item == surface.item[p]) & ~surface.inside[p]
        keep &= ~own
        return keep


def _seen(
    light: Emitter, point: Array, span: Array, center: Array, radius: Array
) -> NDArray[np.bool_]:
    """Whether balls (blocks,) of points may have objects before the light: (blocks, objects)."""
    ball = _swept(light)
    cone = view_cone(ball, ball.center[:, :, None], point[:, :, None])
    v = center[:, None, :] - point[:, :, None]
    wide = radius + span[:, None]
    touch, _, _ = cone_touch(cone.axis, cone.cosine, cone.sine, v, wide)
    vv = dot(v, v)
    seen: NDArray[np.bool_] = (vv <= wide * wide) | (touch & (np.sqrt(vv) - wide < cone.far))
    return seen


def every_pair(plan: Plan, surface: Surface) -> Pairs:
    """All pairs of points and objects, but a point's own object: what a plain tracer tests."""
    count, objects = surface.item.size, plan.object_count
    pixel = np.repeat(np.arange(count), objects)
    item = np.tile(np.arange(objects), count)
    keep = (item != surface.item[pixel]) | surface.inside[pixel]
    return Pairs(pixel[keep], item[keep])


def _swept(light: Emitter) -> Emitter:
    """A spherical light around a light and its path."""
    return replace(light, kind="BALL", radius=light.radius + _half_path(light))


def _half_path(light: Emitter) -> float:
    if light.displacement is None:
        return 0.0
    return 0.5 * float(np.sqrt(dot(light.displacement, light.displacement))[0])


def _key(light: Emitter) -> str:
    return light.name + repr(light.center.tolist())
