# SPDX-License-Identifier: GPL-3.0-or-later
"""Where things stand while the shutter is open."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.scene.description import Motion, SceneError, Vector, vector_of
from .checklist import cycles_of

Matrix = NDArray[np.float64]

CURVED = 0.01
"""Of the way covered: a middle that stands further off than this is told to the user."""

TURNED = 1e-5
"""Of a thing's size: less change of its shape during the shutter is float32's rounding."""

LAST_FRAME = 1_048_574
"""Blender's own last frame, and the first with a minus."""


@dataclass(frozen=True)
class Shutter:
    """Shutter interval in frames."""

    opens: float
    closes: float

    @property
    def middle(self) -> float:
        return (self.opens + self.closes) / 2.0


@dataclass(frozen=True)
class Track:
    """World matrices (4, 4) of one thing: at the middle of the shutter, and at both its ends.

    `opens` and `closes` are None where nothing was sampled, or the thing was not there.
    """

    middle: Matrix
    opens: Matrix | None = None
    closes: Matrix | None = None


@dataclass(frozen=True)
class Path:
    """What a track makes of a thing: its middle, its straight motion and what to tell of it."""

    position: Vector
    motion: Motion | None = None
    reason: str | None = None


def shutter_of(scene: Any) -> Shutter | None:
    """Return the shutter of a scene in frames, or None when nothing may move.

    Raises
    ------
    SceneError
        It opens or closes at no frame that Blender knows.
    """
    render = scene.render
    if not render.use_motion_blur or render.motion_blur_shutter <= 0.0:
        return None
    frame, length = scene.frame_current + scene.frame_subframe, render.motion_blur_shutter
    early = {"START": 0.0, "CENTER": 0.5, "END": 1.0}[render.motion_blur_position]
    shutter = Shutter(frame - early * length, frame + (1.0 - early) * length)
    if not all(abs(time) <= LAST_FRAME for time in (shutter.opens, shutter.closes)):
        raise SceneError(f"The scene's shutter is open for {length:g} frames: set it again")
    return shutter


@contextmanager
def kept_frame(scene: Any, host: Any | None = None) -> Iterator[Callable[[float], None]]:
    """Yield a function that moves `scene` to a time in frames; put the user's own back after.

    The user's camera comes back, too: markers of the timeline change it. The scene is left alone
    entirely when the function is never called.

    Parameters
    ----------
    host : who moves it; a render engine's own `frame_set` moves its depsgraph too. None: the scene.
    """
    host = host or scene
    frame, subframe, camera = scene.frame_current, scene.frame_subframe, scene.camera
    moved = False

    def move(time: float) -> None:
        nonlocal moved
        moved = True
        whole = math.floor(time)
        host.frame_set(whole, subframe=time - whole)

    try:
        yield move
    finally:
        if moved:
            host.frame_set(frame, subframe=subframe)
            if scene.camera != camera:
                scene.camera = camera


def blurs(*things: Any, switch: str = "use_motion_blur") -> bool:
    """Whether a switch of Cycles' for motion blur is on for all of some objects.

    Parameters
    ----------
    things : an instance's object and what repeats it; None for what nothing repeats.
    """
    own = (cycles_of(thing) for thing in things if thing is not None)
    return all(getattr(settings, switch, True) for settings in own)


def matrix_of(thing: Any) -> Matrix:
    """Return a copy of an object's or instance's world matrix, (4, 4) float64."""
    return np.array(thing.matrix_world, dtype=np.float64)


def instance_matrices(depsgraph: Any) -> Matrix:
    """Return the world matrices (n, 4, 4) of all instances, in the order of the depsgraph."""
    instances = depsgraph.object_instances
    flat = np.empty((len(instances), 16), dtype=np.float32)
    instances.foreach_get("matrix_world", flat.ravel())
    # Blender's matrices are stored column after column
    return flat.reshape(-1, 4, 4).transpose(0, 2, 1).astype(np.float64)


def matrices_of(tracks: Sequence[Track]) -> Matrix:
    """Return matrices (k, 3, 4, n) of tracks: at mid-shutter, and at its ends if one moves."""
    middle = [track.middle for track in tracks]
    times = [middle]
    if any(track.opens is not None and track.closes is not None for track in tracks):
        opens = [track.middle if track.opens is None else track.opens for track in tracks]
        closes = [track.middle if track.closes is None else track.closes for track in tracks]
        times = [opens, middle, closes]
    return np.ascontiguousarray(np.array(times)[:, :, :3].transpose(0, 2, 3, 1))


def path_of(track: Track, point: Vector = (0.0, 0.0, 0.0), shape: Matrix | None = None) -> Path:
    """Follow a point of a thing's own space through the shutter.

    Parameters
    ----------
    point : in the thing's own space.
    shape : (3, k), directions of its own space whose turning or stretching would show;
        None where none would.
    """
    middle = _moved(track.middle, point)
    if track.opens is None or track.closes is None:
        return Path(vector_of(middle))
    start, end = _moved(track.opens, point), _moved(track.closes, point)
    reason = _change(track, shape)
    if np.array_equal(start, end):
        if not np.array_equal(start, middle):
            reason = reason or "it moves and comes back during the shutter; it is rendered still"
        return Path(vector_of(middle), None, reason)
    way, mean = end - start, (start + end) / 2.0
    if np.linalg.norm(middle - mean) > CURVED * np.linalg.norm(way):
        reason = reason or (
            "its path or speed changes during the shutter; it is rendered moving straight"
        )
    return Path(vector_of(mean), Motion(vector_of(way)), reason)


def _change(track: Track, shape: Matrix | None) -> str | None:
    if shape is None:
        return None
    at = [m[:3, :3] @ shape for m in (track.middle, track.opens, track.closes) if m is not None]
    allowed = TURNED * float(np.abs(at[0]).max())
    if all(float(np.abs(other - at[0]).max()) <= allowed for other in at[1:]):
        return None
    return "it turns or changes its size during the shutter; only its location is rendered moving"


def _moved(matrix: Matrix, point: Vector) -> Matrix:
    return matrix[:3, :3] @ np.array(point) + matrix[:3, 3]
