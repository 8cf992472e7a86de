# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender: lays the mask over the picture and writes composed.exr beside the file."""

import sys

import bpy

scene = bpy.context.scene
scene.render.engine = "ADAPTIVE_DRT"
scene.render.filepath = "//composed.exr"
bpy.ops.adaptive_drt.show_mask(to_output=True)
bpy.ops.render.render(write_still=True)
sys.stdout.write("composed\n")
