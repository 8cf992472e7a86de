# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels in the Render properties and in the 3D View's sidebar: one content, two places."""

from __future__ import annotations

from typing import Any

import bpy

from ..adaptive_drt.scene import Issue
from ..operators.engine import ENGINE
from ..operators.figures import issues_of, read_figures
from ..operators.images import MASK, find_image
from ..operators.render import redraw_panels
from ..operators.state import issues_key, state

MOST_ISSUES = 12
"""Lines of the list of what was left out; the log has all of them."""

AGAIN = 0.2
"""Seconds between two looks at whether a render of the engine has ended."""


class _RenderProperties:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"


class _Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Adaptive"


class _Main:
    bl_label = "Adaptive Render"

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        row = layout.row(align=True)
        row.scale_y = 1.5
        job = state.job
        if job is None or bpy.app.is_job_running("RENDER"):
            row.operator("adaptive_drt.render", icon="RENDER_STILL")
            if job is not None and not bpy.app.timers.is_registered(_when_idle):
                bpy.app.timers.register(_when_idle, first_interval=AGAIN)
        else:
            # in the button's place, so that nothing jumps under the mouse
            row.progress(factor=job.factor, type="BAR", text=job.text)
            row.operator("adaptive_drt.cancel", text="", icon="X")
        chosen = context.scene.adaptive_drt
        column = layout.column()
        column.prop(chosen, "method")
        if chosen.method == "EXACT":
            column.prop(chosen, "tolerance")
        else:
            column.prop(chosen, "order")
            column.prop(chosen, "distribution")


class _Effects:
    bl_label = "Effects"

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        chosen = context.scene.adaptive_drt
        for use, rays in (
            ("use_penumbra", "light_rays"),
            ("use_motion", "time_rays"),
            ("use_edges", "pixel_rays"),
        ):
            column = layout.column()
            column.prop(chosen, use)
            below = column.column()
            below.active = getattr(chosen, use)
            if chosen.method == "RAYS":
                below.prop(chosen, rays)
            if use == "use_motion":
                _draw_shutter(below, context.scene.render)


def _when_idle() -> float | None:
    """Draw the panels again once no render greys their button out.

    A render of the engine has a bar of its own, and Blender draws the sidebar neither while it
    runs nor when it ends.
    """
    if state.job is not None:
        return AGAIN
    redraw_panels()
    return None


def _draw_shutter(layout: Any, render: Any) -> None:
    """Blender's own motion blur settings; its panels for them belong to its own engines."""
    layout.prop(render, "use_motion_blur", text="Scene's Motion Blur")
    column = layout.column()
    column.active = render.use_motion_blur
    column.prop(render, "motion_blur_position", text="Position")
    column.prop(render, "motion_blur_shutter")


class _Performance:
    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        chosen = context.scene.adaptive_drt
        layout.prop(chosen, "seed")
        layout.prop(chosen, "threads")
        # the engine's picture alone is composed
        if context.engine == ENGINE:
            column = layout.column(heading="Compositor")
            column.prop(context.scene.render, "compositor_device", text="Device")
            column.prop(context.scene.render, "compositor_precision", text="Precision")


class _Figures:
    bl_label = "Last Render"

    def draw(self, context: Any) -> None:
        layout = self.layout
        kept = state.figures.get(issues_key(context.scene))
        figures = read_figures(find_image(MASK)) if kept is None else kept
        if not figures:
            layout.label(text="Nothing rendered yet")
            return
        column = layout.column(align=True)
        for said, value in figure_lines(figures):
            row = column.row()
            row.label(text=said)
            row.label(text=value)
        layout.operator("adaptive_drt.show_mask", icon="NODE_COMPOSITING")


class _LeftOut:
    bl_label = "Left Out"

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.operator("adaptive_drt.check", icon="VIEWZOOM")
        issues = known_issues(context.scene)
        if issues is None:
            layout.label(text="Not checked yet")
            return
        if not issues:
            layout.label(text="Nothing", icon="CHECKMARK")
        for issue in issues[:MOST_ISSUES]:
            column = layout.column(align=True)
            column.alert = True
            column.label(text=issue.name, icon="ERROR")
            column.alert = False
            for line in wrapped(issue.reason, characters_across(context)):
                column.label(text=line, icon="BLANK1")
        if len(issues) > MOST_ISSUES:
            layout.label(text=f"and {len(issues) - MOST_ISSUES} more: see the log")


def known_issues(scene: Any) -> tuple[Issue, ...] | None:
    """Return what was last found to be left out of a scene, or None when it never was asked."""
    found = state.issues.get(issues_key(scene))
    if found is not None:
        return found
    figures = read_figures(find_image(MASK))
    return tuple(issues_of(figures)) if figures else None


def figure_lines(figures: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the last render's figures as pairs of a label and a value."""
    lines = []
    seconds = figures.get("seconds", {}).get("total")
    if seconds is not None:
        lines.append(("Time", f"{seconds:.2f} s"))
    if figures.get("cancelled"):
        lines.append(("Cancelled at", f"{int(100.0 * figures.get('done', 0.0))} %"))
    for name, said in (("error_estimate", "Error, estimated"), ("tolerance", "Tolerance")):
        if isinstance(figures.get(name), (int, float)):
            lines.append((said, f"{figures[name]:.2g}"))
    pixels = figures.get("pixels") or 0
    for name, count in figures.get("counts", {}).items():
        share = f" ({100.0 * count / pixels:.1f} %)" if pixels else ""
        lines.append((f"{name.title()} Pixels", f"{count:,}{share}"))
    for name, said in (
        ("a", "a, distributed pixels"),
        ("b", "b, cost of derivatives"),
        ("c", "c, rays a pixel"),
        ("predicted_ratio", "Time, predicted"),
        ("measured_ratio", "Time, measured"),
    ):
        if isinstance(figures.get(name), (int, float)):
            lines.append((said, f"{figures[name]:.4g}"))
    for kind, count in figures.get("rays", {}).items():
        if isinstance(count, (int, float)):
            lines.append((f"{kind.title()} Rays", f"{int(count):,}"))
    return lines


def characters_across(context: Any) -> int:
    """Return how many characters fit across a panel; Blender wraps no text itself."""
    # an average character is about 6.5 pixels at a scale of 1, the icon and margins take 60
    width = context.region.width / context.preferences.system.ui_scale
    return max(20, int((width - 60.0) / 6.5))


def wrapped(text: str, width: int) -> list[str]:
    """Return a text's lines, none longer than `width` characters unless a word is."""
    import textwrap

    return textwrap.wrap(text, width, break_long_words=False)


def _panels() -> tuple[type, ...]:
    """Return each content in each of the two places, parents before children."""
    made: list[type] = []
    for place, mixin in (("render", _RenderProperties), ("sidebar", _Sidebar)):
        parent = f"ADRT_PT_{place}"
        made.append(type(parent, (mixin, _Main, bpy.types.Panel), {"bl_idname": parent}))
        for content in (_Effects, _Performance, _Figures, _LeftOut):
            name = f"{parent}_{content.__name__.strip('_').lower()}"
            attributes = {"bl_idname": name, "bl_parent_id": parent}
            made.append(type(name, (mixin, content, bpy.types.Panel), attributes))
    return tuple(made)


classes = _panels()


def register() -> None:
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister() -> None:
    if bpy.app.timers.is_registered(_when_idle):
        bpy.app.timers.unregister(_when_idle)
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
