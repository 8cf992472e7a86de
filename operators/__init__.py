# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on does in Blender: export, render, output."""

import bpy

from . import (
    check,
    command,
    compositor,
    engine,
    images,
    join,
    render,
    report,
    selection,
    show,
    undo,
)

classes = (
    render.ADRT_OT_render,
    render.ADRT_OT_cancel,
    check.ADRT_OT_check,
    show.ADRT_OT_show_image,
    report.ADRT_OT_show_report,
    selection.ADRT_OT_select,
    compositor.ADRT_OT_show_mask,
    engine.ADRT_RE_engine,
)


def register() -> None:
    for cls in classes:
        bpy.utils.register_class(cls)
    images.register()
    undo.register()
    report.register()
    command.register()
    join.register()


def unregister() -> None:
    render.stop()
    join.unregister()
    command.unregister()
    report.unregister()
    undo.unregister()
    images.unregister()
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
