# SPDX-License-Identifier: GPL-3.0-or-later
"""Saves a small demo that writes multilayer EXRs of 32 bits, and renders it with bpy.

python make_scene.py OUT.blend leaves beside it bpy_0011.exr and bpy_0012.exr of the method RAYS,
which the file keeps, exact_0011.exr and exact_0012.exr of the method EXACT, and farm_RAYS.blend and
farm_EXACT.blend, whose engine is ours already, since a farm says nothing of it.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "demo"))

import bpy
from addon import load_addon
from build import build_demo

FRAMES = (11, 12)


def main(path: Path) -> None:
    addon = load_addon()
    addon.register()
    try:
        build_demo()
        scene = bpy.context.scene
        render = scene.render
        render.engine = "ADAPTIVE_DRT"
        render.resolution_x, render.resolution_y = 96, 64
        render.compositor_device = "CPU"
        ours = scene.adaptive_drt
        ours.method, ours.time_rays = "EXACT", 32
        settings = render.image_settings
        if hasattr(settings, "media_type"):
            settings.media_type = "MULTI_LAYER_IMAGE"
        settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
        layer = scene.view_layers[0]
        layer.use_pass_z = layer.use_pass_normal = True
        scene.frame_start, scene.frame_end = FRAMES
        render.filepath = str(path.parent / "exact_####")
        bpy.ops.render.render(animation=True)
        ours.method = "RAYS"
        render.filepath = str(path.parent / "bpy_####")
        bpy.ops.render.render(animation=True)
        render.filepath = "//farm_"
        for ours.method in ("EXACT", "RAYS"):
            farm = path.parent / f"farm_{ours.method}.blend"
            bpy.ops.wm.save_as_mainfile(filepath=str(farm), copy=True)
        # the program has to be told: -E, -o and -a
        render.engine, render.filepath = "BLENDER_WORKBENCH", "//unasked_"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
    finally:
        # bpy 4.5 hangs at exit while classes stay registered
        addon.unregister()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
