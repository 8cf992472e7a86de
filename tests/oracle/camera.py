# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels to rays and points to pixels, after the text of Blender's manual and camera code.

Source: Blender, blenkernel/intern/camera.cc, BKE_camera_params_compute_viewplane: the fitted side
(the longer one of the aspect-corrected picture for AUTO) spans the sensor; AUTO always takes the
sensor's width; shifts are in units of the fitted side.
"""

import numpy as np

__all__ = ["origins", "project", "rays"]


def _frame(camera):
    """Axes right, up, back as unit rows (3, 3) and the location (3,)."""
    matrix = np.array([row for row in camera.matrix[:3]], dtype=float)
    axes = matrix[:, :3].T
    return axes / np.linalg.norm(axes, axis=1, keepdims=True), matrix[:, 3]


def _window(camera):
    """Size of one pixel at depth 1 as (x, y), and the picture's offset by the shift, at depth 1."""
    width, height = camera.resolution
    aspect_x, aspect_y = camera.pixel_aspect
    wide, tall = width * aspect_x, height * aspect_y
    fit = camera.sensor_fit
    if fit == "AUTO":
        horizontal, sensor = wide >= tall, camera.sensor_width
    elif fit == "HORIZONTAL":
        horizontal, sensor = True, camera.sensor_width
    else:
        horizontal, sensor = False, camera.sensor_height
    fitted_side = sensor / camera.focal_length
    unit = fitted_side / (wide if horizontal else tall)
    pixel = np.array([unit * aspect_x, unit * aspect_y])
    shift = np.array([camera.shift_x, camera.shift_y]) * fitted_side
    return pixel, shift


def origins(camera, t):
    """Camera's location (n, 3) at times t (n,)."""
    _, location = _frame(camera)
    t = np.asarray(t, dtype=float)
    move = np.zeros(3) if camera.motion is None else np.array(camera.motion.displacement)
    return location + t[:, None] * move


def rays(camera, x, y, t):
    """Origins and unit directions (n, 3) of rays through picture points x, y (pixels) at t.

    Pixel (i, j) is the square i..i+1, j..j+1 from the bottom left of the whole picture.
    """
    axes, _ = _frame(camera)
    pixel, shift = _window(camera)
    half = np.array(camera.resolution) / 2.0
    plane_x = (np.asarray(x) - half[0]) * pixel[0] + shift[0]
    plane_y = (np.asarray(y) - half[1]) * pixel[1] + shift[1]
    local = np.stack([plane_x, plane_y, np.full_like(plane_x, -1.0)], axis=1)
    local /= np.linalg.norm(local, axis=1, keepdims=True)
    return origins(camera, t), local @ axes


def project(camera, points, t):
    """Picture points (n, 2) in pixels of world points (n, 3); NaN behind the camera."""
    axes, _ = _frame(camera)
    pixel, shift = _window(camera)
    local = (np.asarray(points) - origins(camera, t)) @ axes.T
    depth = np.where(local[:, 2] < 0.0, -local[:, 2], np.nan)
    plane = local[:, :2] / depth[:, None]
    return (plane - shift) / pixel + np.array(camera.resolution) / 2.0
