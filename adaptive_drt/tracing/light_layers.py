# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that the camera sees: a picture of each, which is added to that of the objects.

As in Cycles, a light that is seen hides nothing: its radiance is added to what is behind it. So
what the camera sees of it is a picture of its own, in which all objects are black and the light's
shape shines. That picture is as large as the light on the screen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..geometry.registry import SHAPES, kind_of
from ..geometry.shape_table import ShapeTable
from ..lights.emitter import Emitter
from ..numerics.arrays import Array
from ..numerics.vector import dot
from .compile import Plan
from .intersect import screen_bounds

__all__ = ["LightLayer", "make_light_layers"]

LEAST_TOLERANCE = 2.0**-20
"""Least tolerance of the picture of a light: those of tiny lights ask for less than can be seen."""


@dataclass(frozen=True)
class LightLayer:
    """The picture of one light.

    Attributes
    ----------
    plan : its scene; the picture is the light's part of the screen.
    left, bottom : pixels of the rendered region at which the rendered part of it begins.
    """

    plan: Plan
    left: int
    bottom: int

    @property
    def width(self) -> int:
        """Width in pixels of the part that is rendered."""
        return self.plan.region[2] - self.plan.region[0]

    @property
    def height(self) -> int:
        """Height in pixels of the part that is rendered."""
        return self.plan.region[3] - self.plan.region[1]


def make_light_layers(plan: Plan) -> list[LightLayer]:
    """Return the pictures of the lights that may be seen in the region of a compiled scene."""
    if not plan.seen_lights:
        return []
    center, radius = plan.shapes.bounding_spheres
    d = plan.shapes.displacement
    path = np.zeros_like(radius) if d is None else np.sqrt(dot(d, d))
    reach = float((np.sqrt(dot(center, center)) + radius + path).max(initial=0.0))
    found = (_layer(plan, light, reach) for light in plan.seen_lights)
    return [layer for layer in found if layer is not None]


def _layer(plan: Plan, light: Emitter, reach: float) -> LightLayer | None:
    """The picture of a light; None if it is not in the region.

    reach : metres, beyond which there are no objects.
    """
    shapes = light.visible_shapes(reach)
    if not shapes:
        return None
    parts, motion = len(shapes), shapes[0].motion
    move = np.zeros((3, parts))
    if motion is not None and plan.settings.use_motion:
        move += np.array(motion.displacement)[:, None]
    kind = dict(SHAPES)[kind_of(shapes[0])]
    own = kind.from_records(list(shapes), np.zeros((3, 1)), move if move.any() else None)
    table = ShapeTable((*plan.shapes.sets, own))
    seen = np.ones(plan.object_count, dtype=np.bool_) if plan.seen is None else plan.seen
    is_moving = np.append(plan.is_moving, np.full(parts, move.any()))
    emission = np.zeros((3, table.count))
    emission[:, -parts:] = light.power[:, None]
    layer = replace(
        plan, shapes=table, albedo=np.zeros((3, table.count)), is_moving=is_moving,
        lights=(), background=np.zeros(3), transparent=False, penumbra=False,
        motion=plan.settings.use_motion and bool(is_moving.any()),
        edges=plan.settings.use_edges, may_use_embree=False, emission=emission,
        emission_profile=light.profile, seen=np.append(seen, np.ones(parts, dtype=np.bool_)),
        holdout=None, backdrop=None, skipped=(), traced=None,
    )  # fmt: skip
    return _within_window(layer, parts)


def _within_window(layer: Plan, parts: int) -> LightLayer | None:
    """The picture of the last objects' part of the screen; None if that is not in the region."""
    width, height = layer.resolution
    whole = replace(layer, region=(0, 0, width, height))
    bounds = screen_bounds(whole)[:, -parts:]
    (x0, y0), (x1, y1) = bounds[:2].min(axis=1).tolist(), bounds[2:].max(axis=1).tolist()
    left, bottom, right, top = layer.region
    region = max(left, x0), max(bottom, y0), min(right, x1), min(top, y1)
    if region[0] >= region[2] or region[1] >= region[3]:
        return None
    share = (x1 - x0) * (y1 - y0) / (width * height)
    # errors of a small part are a small part of the whole picture's error
    tolerance = max(layer.settings.tolerance * math.sqrt(share), LEAST_TOLERANCE)
    plan = replace(
        layer,
        settings=replace(layer.settings, tolerance=min(tolerance, layer.settings.tolerance)),
        lens=replace(layer.lens, base=_direction(layer, x0, y0)),
        resolution=(x1 - x0, y1 - y0),
        region=(region[0] - x0, region[1] - y0, region[2] - x0, region[3] - y0),
    )
    return LightLayer(plan, region[0] - left, region[1] - bottom)


def _direction(plan: Plan, x: int, y: int) -> Array:
    """Direction (3,) through the lower left corner of a pixel."""
    base: Array = plan.lens.base + x * plan.lens.right + y * plan.lens.up
    return base
