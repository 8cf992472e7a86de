# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells what a render would leave out, without rendering."""

from __future__ import annotations

from typing import Any

import bpy

from ..adaptive_drt.scene.description import SceneError, validate
from ..adaptive_drt.scene.settings import SettingsError
from . import report
from .engine_export import export_for_render
from .issues import count_text, missing_count
from .state import state


class ADRT_OT_check(bpy.types.Operator):
    """List what Adaptive Render would leave out or simplify of this scene at the current frame"""

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
        report.begin(context.scene)
        report.keep(report.subject_of(context.scene, context.view_layer), scene.issues)
        report.deliver()
        kind = "WARNING" if missing_count(scene.issues) else "INFO"
        self.report({kind}, count_text(scene.issues) or "Everything will be rendered as it is set")
        return {"FINISHED"}
