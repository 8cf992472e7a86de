# SPDX-License-Identifier: GPL-3.0-or-later
"""Perspective camera: the ray through a pixel coordinate, with a direction linear in it.

Directions are not normalised, so the discriminant of a sphere is a quadratic in the pixel's
coordinates and the ray parameter is the depth along the camera's axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..numerics.arrays import Array
from ..numerics.floats import UNIT_ROUNDOFF
from ..numerics.vector import cross, dot
from ..scene.description import Camera

__all__ = ["PinholeCamera", "make_pinhole_camera"]

PLANE_DISTANCE_OPERATIONS = 32
"""Number of rounded operations in the distance of the image plane, counted generously: its error
bound in roundoffs."""


@dataclass(frozen=True)
class PinholeCamera:
    """A perspective camera prepared for tracing; rays leave `origin`, the tracer's origin.

    Attributes
    ----------
    origin : (3,) metres, in world space.
    base : (3,) direction through the picture's lower left corner, of depth 1.
    right, up : (3,) change of direction from one pixel to the next.
    forward : (3,) unit vector of the camera's axis; a direction's depth is its dot product with it.
    """

    origin: Array
    base: Array
    right: Array
    up: Array
    forward: Array

    def directions(self, x: Array, y: Array) -> Array:
        """Directions (3, s), not normalised, through pixel coordinates x, y of equal shape (s)."""
        shape = (3,) + (1,) * x.ndim
        return self.base.reshape(shape) + x * self.right.reshape(shape) + y * self.up.reshape(shape)

    @cached_property
    def half_pixel(self) -> float:
        """Bound on |w - w0| for the directions w of a pixel's rays, w0 that of its centre."""
        lengths = np.sqrt(dot(self.right, self.right)) + np.sqrt(dot(self.up, self.up))
        return 0.5 * float(lengths)

    @cached_property
    def image_plane_distance(self) -> float:
        """Lower bound on the length of directions: the distance of the plane in which they end."""
        normal = cross(self.right, self.up)
        distance = float(np.abs(dot(normal, self.base)) / np.sqrt(dot(normal, normal)))
        return (1.0 - PLANE_DISTANCE_OPERATIONS * UNIT_ROUNDOFF) * distance

    def least_length(self, length: Array) -> Array:
        """Lower bounds (n,) on the lengths of pixels' directions, given those of centre rays (n,).

        A direction ends within `half_pixel` of the centre's, and no nearer than the image plane.
        """
        return np.maximum(length - self.half_pixel, self.image_plane_distance)

    def linear_range(self, w: Array, gradient: Array) -> tuple[Array, Array]:
        """Values (n,) of w . gradient for pixels' centres, and their largest changes in the pixels.

        w : (3, n) directions of the centre rays.  gradient : (3, n).
        """
        spread = 0.5 * (
            np.abs(dot(self.right[:, None], gradient)) + np.abs(dot(self.up[:, None], gradient))
        )
        return dot(w, gradient), spread


def make_pinhole_camera(camera: Camera) -> PinholeCamera:
    """Return the tracer's camera for a validated camera description.

    Follows Blender: sensor fit AUTO takes the longer side of the picture (in units of its
    pixels' aspect) and always the sensor's width; shift is in units of the fitted side
    (source/blender/blenkernel/intern/camera.cc, BKE_camera_params_compute_viewplane).
    """
    matrix = np.array(camera.matrix, dtype=np.float64)[:3]
    axes = matrix[:, :3] / _lengths(matrix[:, :3])
    width, height = camera.resolution
    ratio = camera.pixel_aspect[1] / camera.pixel_aspect[0]
    fit = camera.sensor_fit
    sensor = camera.sensor_height if fit == "VERTICAL" else camera.sensor_width
    if fit == "AUTO":
        fit = "HORIZONTAL" if width >= ratio * height else "VERTICAL"
    fitted = width if fit == "HORIZONTAL" else ratio * height
    pixel = sensor / (camera.focal_length * fitted)
    left = (camera.shift_x * fitted - 0.5 * width) * pixel
    bottom = (camera.shift_y * fitted - 0.5 * ratio * height) * pixel
    x_axis, y_axis, z_axis = axes.T
    return PinholeCamera(
        origin=matrix[:, 3].copy(),
        base=left * x_axis + bottom * y_axis - z_axis,
        right=pixel * x_axis,
        up=pixel * ratio * y_axis,
        forward=-z_axis,
    )


def _lengths(columns: Array) -> Array:
    """Lengths of the three columns, without overflow or underflow."""
    largest = np.max(np.abs(columns), axis=0)
    scaled = columns / largest
    lengths: Array = largest * np.sqrt(
        scaled[0] * scaled[0] + scaled[1] * scaled[1] + scaled[2] * scaled[2]
    )
    return lengths
