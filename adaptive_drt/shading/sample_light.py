# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at points that belong to pixels, by a few rays from each point.

The points of a pixel share one search for occluders. The rays of each to a light form a lattice,
which is shifted from point to point by a low-discrepancy sequence of the pixel; or all rays of a
pixel form one sequence, where its points form none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..detection.occlusion import classify_occluders
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.low_discrepancy import LATTICE_SIZE, hashed_kronecker_points, hashed_subpoints
from ..numerics.sobol_points import net_points, stratified_copies
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from ..tracing.occluder_culling import Occluders, find_group_candidates
from .direct_light import diffuse_brdf
from .ratio_estimator import gather_light, unoccluded_factor

__all__ = ["LIGHT_RAYS", "LightSampler", "SampledLight"]


LIGHT_RAYS = LATTICE_SIZE
"""Number of rays from each point to each light that may be hidden in part. A point costs as much as
some ten rays."""
NET_RAYS = 4
"""The same where rays to the lights and places in the pixel are points of one net
(`Plan.samples_by_nets`): a point before spheres or instances costs as much as some three rays."""
LIGHT_STREAM = 41
"""Stream of the hashes that shift the sequence of the first light; each other one has the next."""


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
            sums = gather_light(
                plan, part, light, pairs, spots, moment, tracer=self.occluders.tracer
            )
            every[some], visible[some] = sums.total[:, 0], sums.visible[:, 0]
        weight = diffuse_brdf(plan, hits.item) * light.power[:, None]
        sampled = np.zeros(row.size, dtype=np.bool_)
        sampled[some] = True
        return SampledLight((weight * whole, weight * every, weight * visible), sampled)

    @property
    def rays(self) -> int:
        """Number of rays from each point."""
        return LIGHT_RAYS if self.axes is None or not self.plan.samples_by_nets else NET_RAYS

    def _spots(self, pixel: Ints, index: Ints) -> tuple[Array, Array]:
        """Points on the light, two (m, rays), of points (m,) by pixel and number in it."""
        seed, stream = self.plan.settings.seed, LIGHT_STREAM + self.number
        if self.axes is None:
            return hashed_kronecker_points(seed, pixel, stream, index * self.rays, self.rays)
        if not self.plan.samples_by_nets:
            return hashed_subpoints(seed, pixel, stream, index)
        axes = (self.axes, self.axes + 1)
        net = net_points(seed, pixel, stream, index[:, None], axes)[..., 0]
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
