# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's active camera, and the picture it takes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...adaptive_drt.scene.description import Camera, Issue, SceneError
from .camera_table import CAMERA, DEPTH_OF_FIELD
from .listing import left_out
from .nodes import called
from .shutter import Track, path_of

FRAME = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
"""Directions of a camera's own space whose turning shows; its scale does not."""


def resolution_of(render: Any) -> tuple[int, int]:
    """Return the picture's width and height in pixels, rounded as Blender does."""
    percent = render.resolution_percentage
    return (render.resolution_x * percent // 100, render.resolution_y * percent // 100)


def border_of(render: Any, resolution: tuple[int, int]) -> tuple[int, int, int, int] | None:
    """Return the render border in pixels (left, bottom, right, top), or None."""
    if not render.use_border:
        return None
    # Blender multiplies in float32: 0.7 of 10 pixels is 7 there, and 6.9999999 in float64
    width, height = np.float32(resolution[0]), np.float32(resolution[1])
    return (
        int(np.float32(render.border_min_x) * width),
        int(np.float32(render.border_min_y) * height),
        int(np.float32(render.border_max_x) * width),
        int(np.float32(render.border_max_y) * height),
    )


def camera_of(thing: Any, track: Track, render: Any, issues: list[Issue]) -> Camera:
    """Return the camera of an evaluated camera object.

    Raises
    ------
    SceneError
        It is not a perspective camera.
    """
    name = thing.original.name
    data = thing.data if thing.type == "CAMERA" else None
    if data is None:
        raise SceneError(f'"{name}" is no camera: make a camera the active one')
    if data.type != "PERSP":
        kind = {"ORTHO": "orthographic", "PANO": "panoramic"}.get(data.type, data.type.lower())
        raise SceneError(f'The camera "{name}" is {kind}: set its type to Perspective')
    for table, owner in ((CAMERA, data), (DEPTH_OF_FIELD, data.dof)):
        issues.extend(
            Issue(called("Camera", data.name), reason, kind="CAMERA", target=data.name)
            for reason, _ in left_out(table, owner)
        )
    path = path_of(_unscaled(track), shape=FRAME)
    if path.reason:
        issues.append(Issue(name, path.reason))
    matrix = track.middle.copy()
    matrix[:3, 3] = path.position
    rows = tuple(tuple(row) for row in matrix.tolist())
    resolution = resolution_of(render)
    return Camera(
        matrix=rows,  # type: ignore[arg-type]
        focal_length=data.lens,
        sensor_width=data.sensor_width,
        sensor_height=data.sensor_height,
        sensor_fit=data.sensor_fit,
        shift_x=data.shift_x,
        shift_y=data.shift_y,
        pixel_aspect=(render.pixel_aspect_x, render.pixel_aspect_y),
        resolution=resolution,
        border=border_of(render, resolution),
        motion=path.motion,
    )


def _unscaled(track: Track) -> Track:
    """Return a track whose matrices only turn and move."""
    matrices = []
    for matrix in (track.middle, track.opens, track.closes):
        if matrix is not None:
            length = np.linalg.norm(matrix[:3, :3], axis=0)
            matrix = matrix.copy()
            matrix[:3, :3] /= np.where(length > 0.0, length, 1.0)
        matrices.append(matrix)
    return Track(*matrices)
