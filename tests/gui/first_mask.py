# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender's window with factory settings: the mask over the picture, in a workspace."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import bpy

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
WORKSPACE = os.environ["ADAPTIVE_DRT_WORKSPACE"]
sys.path.insert(0, str(FOLDER))

from desk import HEIGHT, act, shoot  # noqa: E402

FACTS = {}


def compositing():
    return bpy.app.is_job_running("COMPOSITE")


def editors():
    return [
        (window, area)
        for window in bpy.context.window_manager.windows
        for area in window.screen.areas
        if area.ui_type == "CompositorNodeTree"
    ]


def nodes_in_view(area, region):
    """Whether each of our nodes lies within the editor's region."""
    tree = area.spaces.active.edit_tree
    scale = bpy.context.preferences.system.ui_scale
    places = []
    for node in tree.nodes:
        if node.get("Adaptive Mask"):
            x, y = node.location_absolute
            places.append(region.view2d.view_to_region(x * scale, y * scale, clip=False))
    return bool(places) and all(0 <= x < region.width and 0 <= y < region.height for x, y in places)


def steps():
    window = bpy.context.window_manager.windows[0]
    scene = bpy.context.scene
    scene.render.resolution_percentage = 25
    bpy.context.preferences.view.render_display_type = "NONE"
    yield 1.0
    window.workspace = bpy.data.workspaces[WORKSPACE]
    yield 1.0
    area = max(window.screen.areas, key=lambda a: a.width * a.height)
    with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
        bpy.ops.adaptive_drt.render("EXEC_DEFAULT")
    yield 1.0
    with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
        bpy.ops.adaptive_drt.show_mask("INVOKE_DEFAULT")
    # without a graphics card Blender takes seconds to make its programs for the first composition
    for _ in range(60):
        yield 1.0
        viewer = bpy.data.images.get("Viewer Node")
        if editors() and viewer is not None and viewer.size[0] == 480 and not compositing():
            break
    yield 2.0
    shoot(f"mask-{WORKSPACE}")
    shown, area = editors()[0]
    region = next(r for r in area.regions if r.type == "WINDOW")
    FACTS["workspace"] = window.workspace.name
    FACTS["backdrop"] = area.spaces.active.show_backdrop
    FACTS["nodes in view"] = nodes_in_view(area, region)
    FACTS["viewer"] = list(viewer.size) if viewer else None
    left, top = shown.x + region.x, HEIGHT - (shown.y + region.y + region.height)
    FACTS["region"] = [left, top, left + region.width, top + region.height]
    viewer.save_render(str(FOLDER / "viewer.png"), scene=scene)


act(steps(), FACTS, f"mask-{WORKSPACE}")
