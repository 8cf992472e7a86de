# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair curves, as objects and as nodes make them: round tubes of triangles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.scene.curve_tubes import curve_tubes
from .mesh import Layout, digest_of
from .point_cloud import read_attribute
from .triangle_mesh import MeshForm

DEFAULT_RADIUS = 0.005
"""Radius of curves without the attribute "radius", in metres, as in Cycles."""

FINENESS = ((20_000, (16, 32)), (200_000, (8, 4)), (1 << 62, (4, 1)))
"""Number of sides of a tube, whose outline is off its circle by 1, 5 and 21 % at most, and chords
between two points at most, where an object's curves have fewer points than the number before. A
triangle takes some 400 bytes while tubes are made."""

NOT_FINITE = "some of its curves are left out: their points or radii are not finite numbers"


@dataclass(frozen=True)
class Strands:
    """The curves of an object, in its own space.

    Attributes
    ----------
    positions : (n, 3) float32.  radii : (n,) float32.
    offsets : (k + 1,) int32, the first point of each curve, and n.
    """

    positions: NDArray[np.float32]
    radii: NDArray[np.float32]
    offsets: NDArray[np.int32]

    @property
    def layout(self) -> Layout:
        """The layout by which a change during the shutter is told."""
        return Layout(self.positions, digest_of(self.radii, self.offsets))


def strands_of(curves: Any) -> Strands:
    """Return the curves of a Blender datablock of hair curves."""
    positions = read_attribute(curves.attributes.get("position"), "vector", 3, len(curves.points))
    attribute = curves.attributes.get("radius")
    has_radius = attribute is not None and (attribute.domain, attribute.data_type) == (
        "POINT",
        "FLOAT",
    )
    radii = (
        read_attribute(attribute, "value", 1, len(positions))[:, 0]
        if has_radius
        else np.full(len(positions), DEFAULT_RADIUS, dtype=np.float32)
    )
    offsets = np.zeros(len(curves.curves) + 1, dtype=np.int32)
    if len(positions):
        curves.curve_offset_data.foreach_get("value", offsets)
    return Strands(positions, radii, offsets)


def tubes_of(strands: Strands, straight: bool) -> tuple[MeshForm | None, str]:
    """Return the tubes around curves, None where there are none; and what is wrong, or "".

    straight : whether the points are joined by straight lines.
    """
    finite = np.isfinite(strands.positions).all(axis=1) & np.isfinite(strands.radii)
    size = np.diff(strands.offsets).astype(np.int64)
    owner = np.repeat(np.arange(size.size), size)
    whole = np.bincount(owner[~finite], minlength=size.size) == 0
    kept = whole[owner]
    offsets = np.concatenate([[0], np.cumsum(size[whole])])
    fineness = next(each for most, each in FINENESS if np.count_nonzero(kept) < most)
    tubes = curve_tubes(
        np.ascontiguousarray(strands.positions[kept].T, dtype=np.float64),
        strands.radii[kept].astype(np.float64),
        offsets,
        *fineness,
        straight,
    )
    reason = "" if whole.all() else NOT_FINITE
    count = tubes.corners.shape[1]
    if not count:
        return None, reason
    slot = np.zeros(count, dtype=np.int64)  # Cycles takes no other
    return MeshForm(tubes.points, tubes.corners, slot, tubes.normals), reason


def are_straight(scene: Any) -> bool:
    """Whether a scene's curves are straight between their points, as Cycles' settings say."""
    settings = getattr(scene, "cycles_curves", None)
    return settings is not None and settings.shape == "THICK_LINEAR"
