# SPDX-License-Identifier: GPL-3.0-or-later
"""The mask in the compositor, in each version's node trees."""

from __future__ import annotations

import importlib
import subprocess
import sys
import types
from pathlib import Path

import bpy
import numpy as np
import pytest
import things

exr = pytest.importorskip("exr", reason="OpenEXR is not installed")
GREY = (0.2126, 0.7152, 0.0722)
"""Luminance of Rec. 709, which Blender's node takes."""


@pytest.fixture
def stage(file, tmp_path):
    scene = bpy.context.scene
    things.uv_sphere().location.z = 1.0
    things.plane(size=12.0)
    things.light("AREA", energy=500.0, size=1.5, color=(1.0, 0.5, 0.2)).location = (1.0, 0.0, 5.0)
    render = scene.render
    render.resolution_x, render.resolution_y = 24, 16
    render.use_compositing, render.compositor_device = True, "CPU"
    scene.adaptive_drt.light_rays = scene.adaptive_drt.pixel_rays = 4
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    render.filepath = str(tmp_path / "composed.exr")
    return scene


def _composed(scene):
    bpy.ops.render.render(write_still=True)
    written = exr.read_exr(scene.render.filepath)
    (name,) = (n for n in written if n.startswith("Composite") or n.endswith("Composite.Combined"))
    return np.stack([written[name][c] for c in "RGB"])


def _expected(picture, mask):
    grey = np.tensordot(GREY, picture, 1)
    weight = 0.6 * mask.max(axis=0)
    return (1.0 - weight) * grey + weight * mask


def _pixels(name):
    image = bpy.data.images[name]
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    return np.moveaxis(flat.reshape(image.size[1], image.size[0], 4), -1, 0)[:3]


def _overlay_agrees(scene):
    composed = _composed(scene)
    bpy.ops.adaptive_drt.render()
    picture, mask = _pixels("Adaptive Render"), _pixels("Adaptive Mask")
    assert 0.0 < mask.mean() < 1.0
    np.testing.assert_allclose(composed, _expected(picture, mask), rtol=2e-5, atol=1e-6)


def test_of_the_engine(stage):
    stage.render.engine = "ADAPTIVE_DRT"
    assert bpy.ops.adaptive_drt.show_mask(to_output=True) == {"FINISHED"}
    _overlay_agrees(stage)


def test_of_the_images(stage):
    """Under another engine the images of the operator are shown."""
    stage.render.engine = "BLENDER_WORKBENCH"
    with pytest.raises(RuntimeError, match="press Adaptive Render first"):
        bpy.ops.adaptive_drt.show_mask(to_output=True)
    bpy.ops.adaptive_drt.render()
    assert bpy.ops.adaptive_drt.show_mask(to_output=True) == {"FINISHED"}
    stage.render.engine = "ADAPTIVE_DRT"  # it renders without a window
    _overlay_agrees(stage)


def test_the_user_s_nodes_stay(stage, addon):
    stage.render.engine = "ADAPTIVE_DRT"
    compositor = importlib.import_module(f"{addon.__name__}.operators.compositor")
    tree = compositor.compositor_tree(stage)
    tree.nodes.new("CompositorNodeInvert").label = "Mine"

    def theirs():
        ours = compositor.FRAME
        nodes = [n.name for n in tree.nodes if not n.get(ours) and n.name != ours]
        links = [
            (link.from_node.name, link.to_node.name)
            for link in tree.links
            if not (link.from_node.get(ours) or link.to_node.get(ours))
        ]
        return sorted(nodes), sorted(links)

    before = theirs()
    assert before[1], "the picture has to reach the output"
    for _ in range(2):  # the second call replaces the first one's nodes
        bpy.ops.adaptive_drt.show_mask()
        assert theirs() == before
        assert [n.bl_idname for n in tree.nodes if n.get(compositor.FRAME)].count(
            "CompositorNodeViewer"
        ) == 1
        chosen = [n for n in tree.nodes if n.select]
        assert chosen and all(n.get(compositor.FRAME) or n.type == "FRAME" for n in chosen)
    compositor.remove_overlay(tree)
    assert theirs() == before and len(tree.nodes) == len(before[0])


@pytest.mark.slow
def test_the_shipped_example(file, tmp_path):
    """`make compositor`: a file whose nodes lay the mask over the picture, and what they make."""
    script = Path(__file__).resolve().parents[2] / "demo" / "compositor.py"
    command = [sys.executable, str(script), str(tmp_path)]
    told = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert told.returncode == 0, told.stderr[-3000:]
    image = bpy.data.images.load(str(tmp_path / "compositor.png"))
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    colors = flat.reshape(-1, image.channels)[:, :3]
    colored = np.ptp(colors, axis=1) > 0.1
    assert 0.05 < colored.mean() < 0.95, "the mask's colours over a grey picture"
    with bpy.data.libraries.load(str(tmp_path / "compositor.blend")) as (held, _):
        assert held.scenes


def test_the_menus_offer_it(addon):
    """Render's own menu, and the compositor's View; in no other node editor."""
    menus = importlib.import_module(f"{addon.__name__}.ui.menus")
    for name, draw in menus.ENTRIES:
        assert draw in getattr(bpy.types, name).draw._draw_funcs, name
    offered = []
    menu, space = types.SimpleNamespace(), types.SimpleNamespace()
    menu.layout = types.SimpleNamespace(
        separator=lambda: None, operator=lambda name, **_: offered.append(name)
    )
    context = types.SimpleNamespace(space_data=space)
    menus.draw_in_render_menu(menu, context)
    assert offered == ["adaptive_drt.render", "adaptive_drt.show_mask"]
    for space.tree_type, expected in (("ShaderNodeTree", 2), ("CompositorNodeTree", 3)):
        menus.draw_in_node_menu(menu, context)
        assert len(offered) == expected
    addon.unregister()
    try:
        for name, draw in menus.ENTRIES:
            assert draw not in getattr(bpy.types, name).draw._draw_funcs, name
    finally:
        addon.register()
