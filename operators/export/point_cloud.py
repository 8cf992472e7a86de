# SPDX-License-Identifier: GPL-3.0-or-later
"""Point clouds: each point is a sphere, as in Cycles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.scene.description import Issue, Material, vector_of
from ...adaptive_drt.scene.sphere_batch import Spheres
from .mesh import NO_SCALE, Layout, digest_of, uniform_scale
from .shutter import Track, path_of

DEFAULT_RADIUS = 0.01
"""Radius of points without the attribute "radius", in metres, as in Cycles."""

LEAST_EXTENT = 1e-30
"""Least length of the axes of a box around points, in metres: those of a single point have a
direction that may turn, but no length."""

STRETCHED = (
    "its points are left out: it is scaled unevenly, which makes ellipsoids of them in Cycles; "
    "scale all axes alike"
)
NOT_FINITE = "some of its points are left out: their positions or radii are not finite numbers"

COMPONENTS = {
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT": ("value", 1),
}
"""Types of attributes that are colours in Cycles: the property that holds their values, and how
many numbers it has."""


@dataclass(frozen=True)
class Cloud:
    """The points of a point cloud, in its own space, in the order that Blender has them in.

    Attributes
    ----------
    positions : (n, 3) float32.  radii : (n,) float32.
    shown : (n,) bool, whether a point is one that can be seen.
    reason : what is wrong with some of the points, or "".
    """

    positions: NDArray[np.float32]
    radii: NDArray[np.float32]
    shown: NDArray[np.bool_]
    reason: str

    @property
    def layout(self) -> Layout:
        """The layout by which a change during the shutter is told."""
        return Layout(self.positions, digest_of(self.radii))


def cloud_of(points: Any) -> Cloud:
    """Return the points of a Blender point cloud."""
    # attributes are read some 10 times as fast as the properties of points
    positions = read_attribute(points.attributes.get("position"), "vector", 3, len(points.points))
    attribute = points.attributes.get("radius")
    has_radius = attribute is not None and attribute.data_type == "FLOAT"
    radii = (
        read_attribute(attribute, "value", 1, len(positions))[:, 0]
        if has_radius
        else np.full(len(positions), DEFAULT_RADIUS, dtype=np.float32)
    )
    finite = np.isfinite(positions).all(axis=1) & np.isfinite(radii)
    return Cloud(positions, radii, finite & (radii > 0.0), "" if finite.all() else NOT_FINITE)


def colors_of(points: Any, name: str) -> NDArray[np.float64] | None:
    """Return the colours (3, n), scene-linear, that an attribute has for the points, or None."""
    attribute = points.attributes.get(name)
    if attribute is None or attribute.domain != "POINT" or attribute.data_type not in COMPONENTS:
        return None
    values = read_attribute(attribute, *COMPONENTS[attribute.data_type], len(points.points))
    return np.broadcast_to(values.T[:3], (3, len(values))).astype(np.float64)


def placed_points(
    cloud: Cloud,
    colors: NDArray[np.float64] | None,
    track: Track,
    material: Material,
    name: str,
    issues: list[Issue],
) -> list[Spheres]:
    """Return the points where a track places them; none, and an issue, where that cannot be.

    Parameters
    ----------
    colors : (3, n) of the points; None: all have the material's colour.
    """
    if cloud.reason:
        issues.append(Issue(name, cloud.reason, missing=True))
    if not cloud.shown.any():
        return []
    linear = track.middle[:3, :3]
    scale = uniform_scale(linear)
    if not scale:
        issues.append(Issue(name, STRETCHED if scale is None else NO_SCALE, missing=True))
        return []
    own = cloud.positions[cloud.shown].T.astype(np.float64)
    radii = cloud.radii[cloud.shown].astype(np.float64)
    low, high = own.min(axis=1), own.max(axis=1)
    middle = (low + high) / 2.0
    # a point in the middle is followed; the axes of the box around all tell how the cloud turns
    extent = high - low
    sizes = np.eye(3) * radii.max() if not extent.any() else np.diag(extent + LEAST_EXTENT)
    path = path_of(track, vector_of(middle), sizes)
    if path.reason:
        issues.append(Issue(name, path.reason))
    own -= middle[:, None]
    place = linear @ own
    place += np.array(path.position)[:, None]
    slot = np.zeros(radii.size, dtype=np.int64)
    albedo = None if colors is None else np.ascontiguousarray(colors[:, cloud.shown])
    return [Spheres(place, radii * scale, slot, (material,), path.motion, name, albedo=albedo)]


def read_attribute(attribute: Any, key: str, size: int, count: int) -> NDArray[np.float32]:
    """Return the values (count, size) of an attribute."""
    values = np.empty((count, size), dtype=np.float32)
    if count:
        attribute.data.foreach_get(key, values.ravel())
    return values
