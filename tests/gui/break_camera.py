# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender: makes the camera one that the engine cannot take."""

import bpy

bpy.context.scene.camera.data.type = "ORTHO"
