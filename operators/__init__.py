# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on does in Blender: export, render, output."""

import bpy

from . import check, images, render

classes = (render.ADRT_OT_render, check.ADRT_OT_check)


def register() -> None:
    for cls in classes:
        bpy.utils.register_class(cls)
    images.register()


def unregister() -> None:
    render.stop()
    images.unregister()
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
