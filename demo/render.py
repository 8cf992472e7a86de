# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a .blend headless through the add-on's own operator, and writes what it leaves.

    python demo/render.py [SCENE.blend FOLDER]
    blender -b --factory-startup -P demo/render.py -- [SCENE.blend FOLDER]

It writes result.png, mask.png and overlay.png, and prints one line of statistics.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parent))

from addon import load_addon

OUT = Path(__file__).resolve().parent / "out"

OVERLAY = 0.6
"""How much of an overlay's flagged pixel is the mask's colour."""


def read_pixels(name: str) -> NDArray[np.float32]:
    """Return an image datablock's pixels, (height, width, 4), row 0 at the bottom."""
    image = bpy.data.images[name]
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    return flat.reshape(image.size[1], image.size[0], 4)


def display(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return scene-linear colour as sRGB (IEC 61966-2-1), clipped to 0..1."""
    linear = np.clip(linear, 0.0, 1.0)
    curve = 1.055 * np.maximum(linear, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curve).astype(np.float32)


def write_png(path: Path, rgba: NDArray[np.float32]) -> None:
    """Write pixels (height, width, 4), already as displayed, to an 8-bit PNG."""
    height, width, _ = rgba.shape
    image = bpy.data.images.new(path.stem, width, height, alpha=True)
    image.pixels.foreach_set(np.ascontiguousarray(rgba, dtype=np.float32).reshape(-1))
    image.file_format = "PNG"
    image.filepath_raw = str(path)
    image.save()
    bpy.data.images.remove(image)


def overlay(picture: NDArray[np.float32], mask: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the picture in grey with the mask's colours over it."""
    mixed = picture.copy()
    mixed[..., :3] = picture[..., :3].mean(axis=2, keepdims=True)
    flagged = mask[..., :3].any(axis=2)
    mixed[flagged, :3] = (1.0 - OVERLAY) * mixed[flagged, :3] + OVERLAY * mask[flagged, :3]
    mixed[..., 3] = 1.0
    return mixed


def render_demo(scene: Path, folder: Path) -> str:
    """Render a .blend into three pictures and return the line of statistics."""
    addon = load_addon()
    addon.register()
    try:
        bpy.ops.wm.open_mainfile(filepath=str(scene))
        bpy.ops.adaptive_drt.render()
        picture, mask = read_pixels("Adaptive Render"), read_pixels("Adaptive Mask")
        stats = json.loads(bpy.data.images["Adaptive Mask"]["adaptive_drt"])
    finally:
        # bpy 4.5 hangs at exit while classes stay registered
        addon.unregister()
    shown = picture.copy()
    shown[..., :3] = display(picture[..., :3])
    folder.mkdir(parents=True, exist_ok=True)
    write_png(folder / "result.png", shown)
    write_png(folder / "mask.png", mask)
    write_png(folder / "overlay.png", overlay(shown, mask))
    return statistics(picture.shape[1], picture.shape[0], stats)


def statistics(width: int, height: int, stats: dict) -> str:
    counts, seconds = stats["counts"], stats["seconds"]
    effects = ", ".join(f"{n} {counts[n]}" for n in ("penumbra", "motion", "edge"))
    known = [k for k in ("a", "b", "b_spread", "c") if stats.get(k) is not None]
    costs = ", ".join(f"{k} = {stats[k]:.4g}" for k in known)
    parts = (
        f"{width} x {height} in {seconds['total']:.2f} s: "
        f"{counts['distributed']} pixels distributed ({effects})",
        costs,
        f"{sum(stats['rays'].values())} rays",
    )
    return "; ".join(part for part in parts if part)


def main(arguments: list[str]) -> None:
    if len(arguments) not in (0, 2):
        raise SystemExit("usage: render.py [SCENE.blend FOLDER]")
    scene, folder = (Path(a).resolve() for a in arguments or (OUT / "demo.blend", OUT))
    line = render_demo(scene, folder)
    sys.stdout.write(line + "\n")


if __name__ == "__main__":
    own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    main(own)
