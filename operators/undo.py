# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the pictures through undo and redo, as Blender keeps its own Render Result.

Rendering is no edit, so it is no step of the undo history: going back over an edit made after the
first render would take the images away, and coming forth again would bring them back black.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from bpy.app.handlers import persistent
from numpy.typing import NDArray

from .figures import KEY
from .images import NAMES, OUTPUTS, fill_image, find_image, holds_picture


@dataclass(frozen=True)
class _Kept:
    """One image as it was before the step: `uid` tells whether it still is the same datablock."""

    name: str
    is_data: bool
    uid: int
    size: tuple[int, int]
    flat: NDArray[np.float32]
    figures: Any


_kept: list[_Kept] = []
_shown: dict[int, str] = {}
"""Names of our images by the Image Editor that shows them, counted over all windows."""


@persistent
def remember(*_: Any) -> None:
    """Before a step: copy what our images hold, some 10 ms each at 1920 x 1080."""
    _kept.clear()
    for name, _source, is_data in OUTPUTS:
        image = find_image(name)
        if image is None or not holds_picture(image):
            continue
        flat = np.empty(len(image.pixels), dtype=np.float32)
        image.pixels.foreach_get(flat)
        size = (image.size[0], image.size[1])
        _kept.append(_Kept(name, is_data, image.session_uid, size, flat, image.get(KEY)))
    _shown.clear()
    for number, space in enumerate(_editors()):
        if space.image is not None and space.image.name in NAMES:
            _shown[number] = space.image.name


@persistent
def restore(*_: Any) -> None:
    """After a step: make good what it took."""
    for kept in _kept:
        image = find_image(kept.name)
        # the same datablock keeps its pixels, but what is written on it goes back
        if image is None or image.session_uid != kept.uid or not holds_picture(image):
            image = fill_image(kept.name, kept.is_data, kept.flat, kept.size)
        if kept.figures is not None and image.get(KEY) != kept.figures:
            image[KEY] = kept.figures
    for number, space in enumerate(_editors()):
        if number in _shown and space.image is None:
            space.image = find_image(_shown[number])
    _kept.clear()
    _shown.clear()


def _editors() -> Iterator[Any]:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                yield area.spaces.active


HANDLERS = (
    ("undo_pre", remember),
    ("redo_pre", remember),
    ("undo_post", restore),
    ("redo_post", restore),
)


def register() -> None:
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
