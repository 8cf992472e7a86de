# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at points that belong to pixels, by a few rays from each point.

The points of a pixel share one search for occluders. The rays of each to a light form a lattice,
which is shifted from point to point by a low-discrepancy sequence of the pixel; or all rays of a
pixel form one sequence, where its points form none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..detection.occlusion import classify_occluders
from ..lights.emitter import Emitter
from ..lights.environment_factor import Environment
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.low_discrepancy import LATTICE_SIZE, hashed_kronecker_points, shifted_lattices
from ..numerics.sobol_points import net_points, stratified_copies
from ..numerics.vector import total
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from ..tracing.occluder_culling import Occluders, find_group_candidates
from .direct_light import diffuse_brdf
from .ratio_estimator import gather_light, unoccluded_factor

__all__ = ["LIGHT_RAYS", "NET_RAYS", "LightSampler", "SampledLight", "SkyRays", "rays_of_point"]


LIGHT_RAYS = LATTICE_SIZE
"""Number of rays from each point to each light that may be hidden in part. A point costs as much as
some ten rays."""
NET_RAYS = 4
"""The same before sets of spheres and instances (`Plan.foresees_errors`), where a point costs as
much as some three rays."""
LIGHT_STREAM = 41
"""Stream of the hashes that shift the sequence of the first light; each other one has the next."""


def rays_of_point(plan: Plan) -> int:
    """Number of rays from each point of a sampled pixel to each such light."""
    return NET_RAYS if plan.foresees_errors else LIGHT_RAYS


@dataclass(frozen=True)
class SampledLight:
    """Light at m points.

    Attributes
    ----------
    colors : radiance (3, m) towards the camera: of the unhidden light in closed form, and the means
        over the points of the light, all and the visible ones. All three are equal where nothing
        hides the light; the last is 0 where one object hides all of it.
    sampled : (m,) whether rays were traced.
    """

    colors: tuple[Array, Array, Array]
    sampled: Mask


class SkyRays:
    """Rays that lights share which are channels of one environment."""

    def __init__(self) -> None:
        """No rays are known yet."""
        self._whole: Environment | None = None
        self._rays: tuple[Mask, NDArray[np.float32] | None] | None = None
        self._radiance: Array | None = None

    def find(
        self, light: Emitter, trace: Callable[[], tuple[Mask, NDArray[np.float32] | None]]
    ) -> tuple[Mask, NDArray[np.float32] | None]:
        """The rays of a light: those before, if it is a channel of the same environment."""
        whole = None if light.channel_of is None else light.channel_of[0]
        if self._rays is None or whole is None or whole is not self._whole:
            self._whole, self._rays, self._radiance = whole, trace(), None
        return self._rays

    def radiance(self, light: Emitter, way: NDArray[np.float32]) -> Array:
        """Radiance (...) of a light in directions (3, ...) of the rays that were found last."""
        whole, channel = light.channel_of or (light.environment, 0)
        assert whole is not None
        if self._radiance is None or light.channel_of is None:
            self._radiance = whole.map.radiance(way.astype(np.float64))
        part: Array = self._radiance[channel]
        return part


def _sky_factors(
    light: Emitter, rays: tuple[Mask, NDArray[np.float32] | None], known: SkyRays
) -> tuple[Array, Array]:
    """Factors (n,) by all rays of points and by open ones, whose density is the cosine over pi."""
    free, way = rays
    if way is None:
        share = free.sum(axis=0, dtype=np.float64) / len(free)
        return np.full(share.size, np.pi), np.pi * share
    radiance = known.radiance(light, way)
    scale = np.pi / len(free)
    return scale * total(radiance), scale * total(radiance * free)


@dataclass(frozen=True)
class LightSampler:
    """Sends rays to one light.

    Attributes
    ----------
    plan, occluders : the compiled scene.  number : the light's, among those of the plan.
    axes : number of dimensions of the sequences of points; or None where points are no sequence:
        their rays then are consecutive points of one sequence of the pixel.
    """

    plan: Plan
    occluders: Occluders
    number: int
    axes: int | None

    def sample(
        self, hits: Surface, row: Ints, time: Array, numbers: tuple[Ints, Ints]
    ) -> SampledLight:
        """Light at m points.

        Parameters
        ----------
        hits : the points.  row : (m,) the pixel that each belongs to, ascending.
        time : (m,) shutter times.
        numbers : for each point its pixel's number in the picture, and its own number (m,) in the
            pixel's sequence.
        """
        light = self.plan.lights[self.number]
        whole, every, visible, sampled = self._general(hits, row, time, numbers)
        weight = diffuse_brdf(self.plan, hits.item) * light.power[:, None]
        return SampledLight((weight * whole, weight * every, weight * visible), sampled)

    def _general(
        self, hits: Surface, row: Ints, time: Array, numbers: tuple[Ints, Ints]
    ) -> tuple[Array, Array, Array, Mask]:
        """Factors (m,) of light at points: unhidden, by all rays and by open ones; if sampled."""
        plan, light = self.plan, self.plan.lights[self.number]
        shape = plan.as_shadow_caster(light)
        when: Array | float = time if plan.motion else 0.0
        whole = unoccluded_factor(light, shape, light.to_center(hits.point, when), hits)
        every, visible = whole.copy(), whole.copy()
        some, pairs, blocked = self._occluders(shape, hits, row, when, whole)
        visible[blocked] = 0.0
        if some.size:
            part = hits.take(some)
            spots = None
            if shape.extended:
                spots = self._spots(numbers[0][some], numbers[1][some])
            moment = when[some][:, None] if isinstance(when, np.ndarray) else when
            tracer = self.occluders.tracer
            # the factors without hiding are known: to compute them took 7 % of such a render
            sums = gather_light(
                plan, part, light, pairs, spots, moment, tracer=tracer, wants_closed=False
            )
            every[some], visible[some] = sums.total[:, 0], sums.visible[:, 0]
        sampled = np.zeros(row.size, dtype=np.bool_)
        sampled[some] = True
        return whole, every, visible, sampled

    @property
    def traces_sky(self) -> bool:
        """Whether `sample_sky` samples the light."""
        shape = self.plan.as_shadow_caster(self.plan.lights[self.number])
        tracer = self.occluders.tracer
        if tracer is None or self.axes is None or self.plan.motion:
            return False
        free = shape.passes is None and shape.casts_shadow
        return free and shape.surrounds and shape.extended and tracer.holds_all

    def sample_sky(
        self, hits: Surface, pixel: Ints, index: Ints, place: tuple[Ints, Ints], known: SkyRays
    ) -> SampledLight:
        """Light of a sky or an environment at m points of which all is at rest.

        Parameters
        ----------
        hits : the points.  pixel : (n,) numbers of the pixels in the picture.
        index : (k,) numbers of points in the sequences of pixels.
        place : rows (m,) of `pixel` and of `index` that tell of each point, in order.
        known : rays of lights that are channels of one environment.
        """
        tracer, light = self.occluders.tracer, self.plan.lights[self.number]
        assert tracer is not None and self.axes is not None
        count = hits.item.size
        weight = diffuse_brdf(self.plan, hits.item) * light.power[:, None]
        shape = self.plan.as_shadow_caster(light)
        whole = unoccluded_factor(light, shape, light.to_center(hits.point, 0.0), hits)
        every, visible, sampled = whole.copy(), whole.copy(), np.ones(count, dtype=np.bool_)
        near = tracer.is_near(hits.point)
        close, far = near.nonzero()[0], (~near).nonzero()[0]
        if close.size:
            rays = known.find(light, lambda: self._sky_rays(hits, pixel, index, place, close))
            every[close], visible[close] = _sky_factors(light, rays, known)
        if far.size:
            numbers = pixel[place[0][far]], index[place[1][far]]
            found = self._general(hits.take(far), place[0][far], np.zeros(far.size), numbers)
            whole[far], every[far], visible[far], sampled[far] = found
        return SampledLight((weight * whole, weight * every, weight * visible), sampled)

    def _sky_rays(
        self, hits: Surface, pixel: Ints, index: Ints, place: tuple[Ints, Ints], rows: Ints
    ) -> tuple[Mask, NDArray[np.float32] | None]:
        """Which rays from the points `rows` (r,) are open, (k, r), and directions (3, k, r)."""
        tracer, light = self.occluders.tracer, self.plan.lights[self.number]
        assert tracer is not None and self.axes is not None
        axes, stream = (self.axes, self.axes + 1), LIGHT_STREAM + self.number
        net = net_points(self.plan.settings.seed, pixel, stream, index, axes)
        whole = rows.size == pixel.size * index.size
        a, b = net.reshape(2, -1) if whole else net[:, place[0][rows], place[1][rows]]
        point, normal = columns(hits.point, rows), columns(hits.normal, rows)
        return tracer.open_rays(point, normal, a, b, not light.uniform_hemisphere)

    @property
    def rays(self) -> int:
        """Number of rays from each point."""
        return LIGHT_RAYS if self.axes is None else rays_of_point(self.plan)

    def _spots(self, pixel: Ints, index: Ints) -> tuple[Array, Array]:
        """Points on the light, two (m, rays), of points (m,) by pixel and number in it."""
        seed, stream = self.plan.settings.seed, LIGHT_STREAM + self.number
        if self.axes is None:
            return hashed_kronecker_points(seed, pixel, stream, index * self.rays, self.rays)
        axes = (self.axes, self.axes + 1)
        net = net_points(seed, pixel, stream, index[:, None], axes)[..., 0]
        if not self.plan.foresees_errors:
            return shifted_lattices(net)
        a, b = stratified_copies(net, self.rays)
        return a, b

    def _occluders(
        self, shape: Emitter, hits: Surface, row: Ints, time: Array | float, whole: Array
    ) -> tuple[Ints, Pairs, Mask]:
        """The points that may be hidden in part, their occluders, and which points are hidden."""
        if self.occluders.tracer is None:
            pairs = find_group_candidates(self.occluders, shape, hits, row)
        else:
            pairs = self.occluders.find_ray_candidates(shape, hits)
        pairs = pairs.take(whole[pairs.pixel] > 0.0)
        moment = time[pairs.pixel] if isinstance(time, np.ndarray) else time
        unknown = self.plan.traced
        if unknown is not None and shape.surrounds:
            # from most points a sky is hidden in part, and to prove more costs more than rays
            unknown = np.ones_like(unknown)
        none, full = classify_occluders(self.plan, hits, shape, pairs, moment, unknown)
        blocked = np.zeros(row.size, dtype=np.bool_)
        blocked[pairs.pixel[full]] = True
        some, pairs = pairs.take(~none & ~blocked[pairs.pixel]).numbered(row.size)
        return some, pairs, blocked
