# SPDX-License-Identifier: GPL-3.0-or-later
"""The flat ends of cylinders and truncated cones: ellipses, without those that nothing can see.

An end that lies within an opaque ball or ellipsoid, as those of bonds lie in atoms, is seen from
nowhere outside of that, and hides from there nothing that it does not hide. Where two cylinders of
one radius are continued by each other, the ends between them are inside what both fill.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...scene.description import (
    Cylinder,
    Ellipse,
    Motion,
    ShapeRecord,
    Visibility,
    vector_of,
)
from .opaque_balls import OpaqueBalls, opaque_balls

__all__ = ["hidden_ends", "with_ends"]


CONTINUATION_TOLERANCE = 2.0**-20
"""Distance between the centres of two ends, and difference of their radii, up to which one cylinder
continues the other, as a fraction of the radius: Blender's coordinates are rounded to 2^-24."""
MAX_PAIRS = 1 << 20
"""Number of pairs of ends and balls that are compared at a time, which bounds memory."""


@dataclass(frozen=True)
class _Ends:
    """The n ends of cylinders.

    Attributes
    ----------
    center : (3, n) metres.  normal : (3, n) unit, out of the solid.  radius : (n,) metres.
    solid : (n,) index of the cylinder of each.
    manner : (n,) numbers, equal for shapes that move alike and are met by the same rays.
    """

    center: Array
    normal: Array
    radius: Array
    solid: Ints
    manner: Ints


def with_ends(records: Sequence[ShapeRecord], camera: tuple[Array, Array]) -> list[ShapeRecord]:
    """The shapes, and the ends of cylinders as shapes of their own, without hidden ones.

    Parameters
    ----------
    records : with no two shapes in the same place; the bodies of their ends are the numbers of the
        cylinders, in this order.
    camera : (3,) metres, its place at mid-shutter, and its displacement over the shutter.
    """
    solids = [each for each in records if isinstance(each, Cylinder)]
    if not solids:
        return list(records)
    ends, hidden = _judged_ends(solids, records, camera)
    # a cone has one end alone
    disks = [_disk(ends, solids, k) for k in np.flatnonzero(~hidden & (ends.radius > 0.0))]
    return [*records, *disks]


def hidden_ends(
    solids: Sequence[Cylinder], records: Sequence[ShapeRecord], camera: tuple[Array, Array]
) -> Mask:
    """Whether nothing outside of balls and of other solids sees or meets the ends (2, n) of solids.

    A tube whose two ends are hidden is the same to everything outside with and without them.

    Parameters
    ----------
    records : all other shapes.  camera : see `with_ends`.
    """
    ends, hidden = _judged_ends(solids, records, camera)
    found: Mask = (hidden | (ends.radius == 0.0)).reshape(2, -1)
    return found


def _judged_ends(
    solids: Sequence[Cylinder], records: Sequence[ShapeRecord], camera: tuple[Array, Array]
) -> tuple[_Ends, Mask]:
    """The ends of solids, and whether each is hidden."""
    manners: dict[tuple[Motion | None, Visibility], int] = {}
    ends = _ends(solids, manners)
    return ends, _continued(ends) | _in_balls(ends, opaque_balls(records, manners), *camera)


def _ends(
    solids: Sequence[Cylinder], manners: dict[tuple[Motion | None, Visibility], int]
) -> _Ends:
    """Both ends of each cylinder, all first ones before all last ones."""
    first, last = (
        np.array([getattr(each, name) for each in solids], dtype=np.float64).T
        for name in ("start", "end")
    )
    way = last - first
    way /= np.sqrt((way * way).sum(axis=0))
    radius = np.array([each.radii for each in solids], dtype=np.float64).T
    own = [manners.setdefault((each.motion, each.visibility), len(manners)) for each in solids]
    return _Ends(
        np.concatenate([first, last], axis=1),
        np.concatenate([-way, way], axis=1),
        np.concatenate(radius),
        np.tile(np.arange(len(solids)), 2),
        np.tile(np.array(own), 2),
    )


def _continued(ends: _Ends) -> Mask:
    """Whether each end (n,) is that of another cylinder as well, on the other side of its plane."""
    found = np.zeros(ends.radius.size, dtype=np.bool_)
    near = CONTINUATION_TOLERANCE * ends.radius
    for one, other in _pairs_within(ends.center, ends.center, near):
        gap = ends.center[:, one] - ends.center[:, other]
        same = np.sqrt((gap * gap).sum(axis=0)) <= near[one]
        same &= np.abs(ends.radius[one] - ends.radius[other]) <= near[one]
        turned = ends.normal[:, one] + ends.normal[:, other]
        same &= np.sqrt((turned * turned).sum(axis=0)) <= CONTINUATION_TOLERANCE
        found[one[same & (ends.manner[one] == ends.manner[other])]] = True
    return found


def _in_balls(ends: _Ends, balls: OpaqueBalls, eye: Array, drift: Array) -> Mask:
    """Whether each end (n,) lies within a ball or an ellipsoid that the camera is not in."""
    found = np.zeros(ends.radius.size, dtype=np.bool_)
    balls = balls.chosen(balls.are_outside(eye, drift))
    largest = np.full(ends.radius.size, balls.reach.max(initial=0.0))
    for end, ball in _pairs_within(ends.center, balls.center, largest):
        disk = ends.center[:, end], ends.normal[:, end], ends.radius[end]
        within = balls.hold(ball, *disk) & (ends.manner[end] == balls.manner[ball])
        found[end[within]] = True
    return found


def _pairs_within(center: Array, others: Array, near: Array) -> list[tuple[Ints, Ints]]:
    """Pairs of different points of two sets whose x differ by at most `near` (n,), in batches."""
    order = np.argsort(others[0], kind="stable")
    low = np.searchsorted(others[0, order], center[0] - near, side="left")
    high = np.searchsorted(others[0, order], center[0] + near, side="right")
    count = high - low
    batch = np.cumsum(count) // MAX_PAIRS
    parts = []
    for number in np.unique(batch):
        own = np.flatnonzero(batch == number)
        size = count[own]
        one = np.repeat(own, size)
        place = np.arange(one.size) - np.repeat(np.cumsum(size) - size, size)
        other = order[np.repeat(low[own], size) + place]
        apart = (one != other) if others is center else np.ones(one.size, dtype=np.bool_)
        parts.append((one[apart], other[apart]))
    return parts


def _disk(ends: _Ends, solids: Sequence[Cylinder], k: int) -> Ellipse:
    """One of the ends as a shape of its own."""
    solid = solids[ends.solid[k]]
    normal = ends.normal[:, k]
    away = np.zeros(3)
    away[np.argmin(np.abs(normal))] = 1.0
    u = np.cross(normal, away)
    u *= ends.radius[k] / np.sqrt(u @ u)
    return Ellipse(
        vector_of(ends.center[:, k]),
        vector_of(u),
        vector_of(np.cross(normal, u)),
        solid.material,
        solid.motion,
        solid.name,
        solid.visibility,
        int(ends.solid[k]),
    )
