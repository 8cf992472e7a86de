# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels in the Render properties and in the 3D View's sidebar: one content, two places."""

from __future__ import annotations

from typing import Any

import bpy

from ..operators.engine import ENGINE
from ..operators.figures import derivative_cost, read_figures
from ..operators.images import MASK, RESULT, find_image
from ..operators.issues import Group, count_text, grouped, missing_count
from ..operators.selection import is_selectable, known_issues
from ..operators.state import issues_key, state

MOST_LINES = 12
"""Lines of the list; the text datablock has all of them."""

NO_BREAK = "\u00a0"
"""A space at which a line is not broken."""

MOST_WRAPPED = 5
"""Rows of a line: many names are in the text datablock, and in the line's tooltip."""


class _RenderProperties:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"


class _Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Adaptive Render"


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
        else:
            # in the button's place, so that nothing jumps under the mouse
            row.progress(factor=job.factor, type="BAR", text=job.text)
            row.operator("adaptive_drt.cancel", text="", icon="X")
        _draw_images(layout)
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
            if use == "use_motion":
                # Blender's own switch, so that its tooltip and its keyframes are the same
                column.prop(context.scene.render, "use_motion_blur", text="Motion Blur")
            else:
                column.prop(chosen, use)
            below = column.column()
            below.active = getattr(chosen, use)
            if chosen.method == "RAYS":
                below.prop(chosen, rays)
            if use == "use_motion":
                _draw_shutter(below, context.scene.render)
        layout.prop(chosen, "spheres")


def _draw_images(layout: Any) -> None:
    """Offer to show what was rendered."""
    if find_image(RESULT) is None:
        return
    row = layout.row(align=True)
    row.operator(
        "adaptive_drt.show_image", text="Show Picture", icon="IMAGE_DATA"
    ).image = "PICTURE"
    row.operator("adaptive_drt.show_image", text="Show Mask", icon="IMAGE_ALPHA").image = "MASK"


def _draw_shutter(layout: Any, render: Any) -> None:
    """Blender's own motion blur settings; its panels for them belong to its own engines."""
    layout.prop(render, "motion_blur_position", text="Position")
    layout.prop(render, "motion_blur_shutter")


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


class _Report:
    bl_label = "Report"

    def draw(self, context: Any) -> None:
        layout = self.layout
        row = layout.row(align=True)
        row.operator("adaptive_drt.check", icon="VIEWZOOM")
        row.operator("adaptive_drt.show_report", icon="TEXT")
        issues = known_issues(context.scene)
        if issues is None:
            layout.label(text="Not checked yet")
            return
        count = layout.row()
        count.alert = bool(missing_count(issues))
        count.label(text=count_text(issues) or "All is rendered as it is set", icon=_icon(issues))
        groups = grouped(issues)
        for number, group in enumerate(groups[:MOST_LINES]):
            _draw_group(layout.column(align=True), number, group, characters_across(context))
        if len(groups) > MOST_LINES:
            more = f"{len(groups) - MOST_LINES} more in the Report"
            layout.operator("adaptive_drt.show_report", text=more, icon="TEXT")


def _icon(issues: Any) -> str:
    if not issues:
        return "CHECKMARK"
    return "ERROR" if missing_count(issues) else "INFO"


def _draw_group(column: Any, number: int, group: Group, width: int) -> None:
    """Draw a line of the list: a click on its name selects the objects."""
    row = column.row()
    row.alignment = "LEFT"
    row.alert = group.missing
    icon = "ERROR" if group.missing else "INFO"
    if is_selectable(group):
        button = row.operator("adaptive_drt.select", text=group.title, icon=icon, emboss=False)
        button.line = number
    else:
        row.label(text=group.title, icon=icon)
    said = group.reason
    if len(group.members) > 1:
        # a name is not broken at its spaces
        said = f"{said}: {', '.join(name.replace(' ', NO_BREAK) for name in group.names)}"
    lines = wrapped(said, width)
    if len(lines) > MOST_WRAPPED:
        lines = [*lines[: MOST_WRAPPED - 1], f"{lines[MOST_WRAPPED - 1]} …"]
    for line in lines:
        column.label(text=line, icon="BLANK1")


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
        half = characters_across(context, icons=0) // 2
        for said, value in figure_lines(figures):
            row = column.row()
            row.label(text=said)
            if max(len(said), len(value)) > half:  # Blender gives each label half of a row
                row = column.row()
                row.alignment = "RIGHT"
            row.label(text=value)
        layout.operator("adaptive_drt.show_mask", icon="NODE_COMPOSITING")


COSTS = (
    ("a", "a, Pixel Share", "{:.4g}"),
    ("b", "b, Derivative Cost", "{:.4g}"),
    ("c", "c, Rays per Pixel", "{:.4g}"),
    ("predicted_ratio", "Predicted Time", "{:.2g} of Everywhere"),
    ("measured_ratio", "Measured Time", "{:.2g} of Everywhere"),
)
"""Figures of the method Distributed Rays: the paper's cost model, equation 10, whose ratios are of
the time that the distribution Everywhere takes."""


def is_of_rays(figures: dict[str, Any]) -> bool:
    """Whether figures are of the method Distributed Rays, which has no tolerance."""
    return "tolerance" not in figures


def figure_lines(figures: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the last render's figures as pairs of a label and a value."""
    lines = []
    seconds = figures.get("seconds", {}).get("total")
    if seconds is not None:
        lines.append(("Time", f"{seconds:.2f} s"))
    if figures.get("cancelled"):
        lines.append(("Cancelled at", f"{int(100.0 * figures.get('done', 0.0))} %"))
    for name, said in (("error_estimate", "Estimated Error"), ("tolerance", "Tolerance")):
        if isinstance(figures.get(name), (int, float)):
            lines.append((said, f"{figures[name]:.2g}"))
    if figures.get("sampled_pixels"):
        said = f"{figures['sampled_pixels']:,}, {figures.get('sampling_error', 0.0):.2g}"
        lines.append(("Pixels With Sampled Light, Error", said))
    pixels = figures.get("pixels") or 0
    for name, count in figures.get("counts", {}).items():
        share = f" ({100.0 * count / pixels:.1f} %)" if pixels else ""
        lines.append((f"{name.title()} Pixels", f"{count:,}{share}"))
    for name, said, form in COSTS if is_of_rays(figures) else ():
        cost = derivative_cost(figures) if name == "b" else None
        if cost is not None:
            lines.append((said, cost))
        elif isinstance(figures.get(name), (int, float)):
            lines.append((said, form.format(figures[name])))
    for kind, count in figures.get("rays", {}).items():
        if isinstance(count, (int, float)):
            lines.append((f"{kind.title()} Rays", f"{int(count):,}"))
    return lines


def characters_across(context: Any, icons: int = 1) -> int:
    """Return how many characters fit across a panel; Blender wraps no text itself.

    Parameters
    ----------
    icons : how many stand before the text, 20 pixels each at a scale of 1.
    """
    # an average character is about 6.5 pixels at a scale of 1, the margins take 40
    width = context.region.width / context.preferences.system.ui_scale
    return max(20, int((width - 40.0 - 20.0 * icons) / 6.5))


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
        for content in (_Effects, _Performance, _Report, _Figures):
            name = f"{parent}_{content.__name__.strip('_').lower()}"
            attributes = {"bl_idname": name, "bl_parent_id": parent}
            made.append(type(name, (mixin, content, bpy.types.Panel), attributes))
    return tuple(made)


classes = _panels()


def register() -> None:
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
