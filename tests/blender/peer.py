# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the open scene with Cycles: direct light only, box filter, no tricks.

This file must not be called cycles: it would hide Blender's own add-on of that name.
"""

from __future__ import annotations

import bpy
import numpy as np


def render_cycles(folder, samples=1024, seed=0, alpha=False):
    """Return Cycles' picture of the open scene, (height, width, 3 or 4) scene-linear."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples, scene.cycles.seed = samples, seed
    for name in ("use_adaptive_sampling", "use_denoising"):
        setattr(scene.cycles, name, False)
    scene.cycles.max_bounces = 0
    scene.cycles.light_sampling_threshold = 0.0
    scene.cycles.sample_clamp_direct = 0.0
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 1.0
    scene.view_settings.view_transform = "Raw"
    picture = saved(folder / f"cycles_{seed}.exr")
    return picture if alpha else picture[..., :3]


def saved(path):
    """Render with the chosen engine into a file, and read it: (height, width, 4)."""
    scene = bpy.context.scene
    output = scene.render.image_settings
    if hasattr(output, "media_type"):
        output.media_type = "IMAGE"
    output.file_format, output.color_depth, output.color_mode = "OPEN_EXR", "32", "RGBA"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    picture = flat.reshape(image.size[1], image.size[0], -1).astype(np.float64)
    bpy.data.images.remove(image)
    return picture
