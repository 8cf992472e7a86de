# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells what a render would leave out, without rendering."""

from __future__ import annotations

from typing import Any

import bpy

from ..adaptive_drt.scene import SceneError, validate
from ..adaptive_drt.settings import SettingsError
from .engine_export import export_for_render
from .state import issues_key, state


class ADRT_OT_check(bpy.types.Operator):
    """List what Adaptive Render would leave out of this scene at the current frame"""

    bl_idname = "adaptive_drt.check"
    bl_label = "Check Scene"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.scene is not None and state.job is None

    def execute(self, context: Any) -> set[str]:
        try:
            exported, _settings = export_for_render(context.scene, context.view_layer)
            scene = validate(exported)
        except (SceneError, SettingsError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        state.issues[issues_key(context.scene)] = scene.issues
        found = len(scene.issues)
        self.report({"INFO"}, f"{found} left out" if found else "Everything will be rendered")
        return {"FINISHED"}
