# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture, the mask and the work per pixel as image datablocks.

They are generated float images with a fake user. Blender reloads such an image as black unless it
is packed, and packing a 1920 x 1080 one takes 0.06 to 0.2 s and 33 MB; so they are packed when
the file is saved, not at every render.
"""

from __future__ import annotations

import json
import logging
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from bpy.app.handlers import persistent
from numpy.typing import NDArray

from ..adaptive_drt.scene.film import Film
from .datablocks import own_datablock
from .figures import KEY
from .job import Job
from .state import state

log = logging.getLogger(__name__)

RESULT, MASK, SAMPLES = "Adaptive Render", "Adaptive Mask", "Adaptive Samples"
OUTPUTS = (
    (RESULT, "Combined", False),
    (SAMPLES, "Sample Count", True),
    (MASK, "Adaptive Mask", True),
)
"""Image, pass and whether it is data rather than colour."""
NAMES = frozenset(name for name, _source, _is_data in OUTPUTS)

BLENDERS = {"RENDER_RESULT": "Render Result", "COMPOSITING": "Viewer Node"}
"""Types of images that Blender itself fills, and what it calls them."""


@dataclass(frozen=True)
class Frame:
    """Where the rendered pixels lie in the image.

    size : pixels of the image (width, height).
    left, bottom : place of the film's first pixel in it.
    """

    size: tuple[int, int]
    left: int = 0
    bottom: int = 0


def frame_of(camera: Any, crop: bool) -> Frame:
    """Return the image of a camera: all of the picture, or what lies in its border."""
    left, bottom, right, top = camera.region
    if crop:
        return Frame((right - left, top - bottom))
    return Frame(camera.resolution, left, bottom)


def find_image(name: str) -> Any | None:
    """Return this file's own image of that name, or None."""
    return own_datablock(bpy.data.images, name)


def write_images(job: Job, frame: Frame, figures: dict[str, Any]) -> None:
    """Put what a job has into its images, made now or reused."""
    made = {
        name: _write(name, is_data, job.rgba(source), job.film, frame)
        for name, source, is_data in OUTPUTS
    }
    made[MASK][KEY] = json.dumps(figures)


def write_picture(flat: NDArray[np.float32], film: Film, frame: Frame) -> None:
    """Put the pixels of the picture alone into its image, while the rest is being rendered."""
    name, _source, is_data = OUTPUTS[0]
    _write(name, is_data, flat, film, frame)


def _write(name: str, is_data: bool, flat: NDArray[np.float32], film: Film, frame: Frame) -> Any:
    return fill_image(name, is_data, _framed(flat, film, frame), frame.size)


def fill_image(name: str, is_data: bool, flat: NDArray[np.float32], size: tuple[int, int]) -> Any:
    """Return the image of that name, made now or reused, with these pixels in it."""
    image = _ready(name, size, is_data)
    image.pixels.foreach_set(flat)
    image.update()
    return image


def _ready(name: str, size: tuple[int, int], is_data: bool) -> Any:
    """Return the image of that name, as a float image of that size."""
    image = find_image(name)
    if image is not None and image.type in BLENDERS:
        # nobody can write its pixels; it gets its own name back
        image.name, image = BLENDERS[image.type], None
    if image is not None and not holds_picture(image):
        # what cannot hold our pixels is replaced under its users' hands, not beside them
        image.source = "GENERATED"
        image.use_generated_float = True
    if image is None:
        image = bpy.data.images.new(name, 1, 1, alpha=True, float_buffer=True, is_data=is_data)
        # somebody else's linked image may hold the name already
        image.name = name
        image.use_fake_user = True
    _show_as_render(image, is_data)
    if tuple(image.size) != size:
        image.scale(*size)
    # what a new image of Blender's is saved as by `Image.save`; packing makes it OpenEXR
    image.file_format = "PNG"
    return image


def _show_as_render(image: Any, is_data: bool) -> None:
    """Let Blender show and save an image as it does its own Render Result.

    That is with the scene's view transform, look, exposure and gamma. An Image Editor heeds
    `use_view_as_render` only where an image is not generated (Blender 5.2,
    draw_color_management.cc); a generated image that is packed counts as a file's from then
    on. Alpha is premultiplied, as that of the Combined pass is.
    """
    image.alpha_mode = "PREMUL"
    image.use_view_as_render = not is_data
    if image.source == "GENERATED":
        if tuple(image.size) != (1, 1):  # only one pixel is to be compressed
            image.scale(1, 1)
        image.pixels[0] = 0.0
        image.update()
        image.pack()


def holds_picture(image: Any) -> bool:
    """Whether its pixels are there, and are such as ours."""
    return bool(image.has_data and image.is_float and image.channels == 4)


def _framed(flat: NDArray[np.float32], film: Film, frame: Frame) -> NDArray[np.float32]:
    """Return flat pixels of the film within the whole image; what was not rendered is clear."""
    width, height = frame.size
    if (film.width, film.height) == (width, height):
        return flat
    whole = np.zeros((height, width, 4), dtype=np.float32)
    rows = slice(frame.bottom, frame.bottom + film.height)
    columns = slice(frame.left, frame.left + film.width)
    whole[rows, columns] = flat.reshape(film.height, film.width, 4)
    return whole.reshape(-1)


@persistent
def pack_outputs(*_: Any) -> None:
    """Pack our images if they changed, so that they survive in the file.

    Not while they are being rendered: the processors are busy, so packing took a window 4.5 s at
    1280 x 960, for a picture that is soon another.
    """
    if state.job is not None:
        log.info("the picture in progress is not saved; save again when it is rendered")
        return
    for name, _source, _is_data in OUTPUTS:
        image = find_image(name)
        if image is not None and image.is_dirty and image.has_data:
            image.pack()


def register() -> None:
    bpy.app.handlers.save_pre.append(pack_outputs)


def unregister() -> None:
    bpy.app.handlers.save_pre.remove(pack_outputs)
