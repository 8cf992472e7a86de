# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the example of the mask in the compositor, and composes it.

    python demo/compositor.py [FOLDER]

It writes compositor.blend, whose nodes lay the mask over the picture of the Adaptive DRT engine,
and what they make of it as compositor.png; demo/out is the folder unless another is named.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))

from addon import load_addon
from build import OUT, build_demo


def compose(folder: Path) -> None:
    """Save the example and its picture."""
    addon = load_addon()
    addon.register()
    try:
        build_demo()
        scene = bpy.context.scene
        scene.render.engine = "ADAPTIVE_DRT"
        scene.render.resolution_percentage = 50
        # no graphics card is needed to compose
        scene.render.compositor_device = "CPU"
        scene.render.image_settings.file_format = "PNG"
        scene.render.filepath = str(folder / "compositor.png")
        # the mask's colours stay what they are
        scene.view_settings.view_transform = "Standard"
        bpy.ops.adaptive_drt.show_mask(to_output=True)
        folder.mkdir(parents=True, exist_ok=True)
        bpy.ops.render.render(write_still=True)
        scene.render.filepath = "//compositor.png"
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / "compositor.blend"), compress=True)
    finally:
        # bpy 4.5 hangs at exit while classes stay registered
        addon.unregister()


if __name__ == "__main__":
    own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    if len(own) > 1:
        raise SystemExit("usage: compositor.py [FOLDER]")
    compose(Path(*own).resolve() if own else OUT.parent)
