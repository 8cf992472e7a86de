# SPDX-License-Identifier: GPL-3.0-or-later
"""Films as small 8-bit PNG pictures: results, masks laid over them, sheets of several."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from adaptive_drt.scene.film import Film

__all__ = ["display_picture", "mask_picture", "overlay_picture", "result_picture", "save", "sheet"]

OVERLAY = 0.55
"""How much of a flagged pixel is the mask's colour in an overlay."""
LABEL_HEIGHT = 16
"""Pixels above each picture of a sheet."""
MOST_BYTES = 150_000
"""Larger pictures are stored with a palette of 256 colours."""


def result_picture(film: Film) -> Image.Image:
    """The picture as sRGB (IEC 61966-2-1), clipped; nothing else is done to it."""
    return display_picture(film.color)


def display_picture(color: NDArray[np.float64]) -> Image.Image:
    """Scene-linear colour (3, height, width), row 0 at the bottom, as sRGB, clipped."""
    return _image(_display(color))


def mask_picture(film: Film) -> Image.Image:
    """The mask: red = penumbra, green = motion, blue = edge."""
    return _image(np.moveaxis(film.mask, 0, -1).astype(np.float64))


def overlay_picture(film: Film) -> Image.Image:
    """The picture in grey with the flagged pixels in the mask's colours."""
    shown = np.repeat(_display(film.color).mean(axis=2, keepdims=True), 3, axis=2)
    mask = np.moveaxis(film.mask, 0, -1)
    flagged = mask.any(axis=2)
    shown[flagged] = (1.0 - OVERLAY) * shown[flagged] + OVERLAY * mask[flagged]
    return _image(shown)


def sheet(pictures: list[tuple[str, Image.Image]], columns: int, side: int) -> Image.Image:
    """Pictures with labels above them, row by row, each `side` pixels wide."""
    rows = -(-len(pictures) // columns)
    height = max(round(p.height * side / p.width) for _, p in pictures)
    whole = Image.new("RGB", (columns * side, rows * (height + LABEL_HEIGHT)), "white")
    pen = ImageDraw.Draw(whole)
    for index, (label, picture) in enumerate(pictures):
        x, y = index % columns * side, index // columns * (height + LABEL_HEIGHT)
        pen.text((x + 3, y + 2), label, fill="black")
        small = picture.resize((side - 2, height), Image.Resampling.LANCZOS)
        whole.paste(small, (x, y + LABEL_HEIGHT))
    return whole


def save(picture: Image.Image, path: Path) -> None:
    """Write a PNG, with a palette if it would be too large."""
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, optimize=True)
    if path.stat().st_size > MOST_BYTES:
        picture.quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)


def _display(color: NDArray[np.float64]) -> NDArray[np.float64]:
    linear = np.clip(np.moveaxis(color, 0, -1), 0.0, 1.0)
    curve = 1.055 * np.maximum(linear, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curve)


def _image(pixels: NDArray[np.float64]) -> Image.Image:
    """From (height, width, 3) in 0..1, row 0 at the bottom."""
    return Image.fromarray((pixels[::-1] * 255.0 + 0.5).astype(np.uint8))
