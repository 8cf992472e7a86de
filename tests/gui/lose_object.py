# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender: moves a copy of an object to where no picture can hold it."""

import bpy

lost = bpy.data.objects.new("Lost", bpy.data.objects["Red"].data)
lost.location.x = 1e31
bpy.context.scene.collection.objects.link(lost)
