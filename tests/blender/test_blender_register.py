# SPDX-License-Identifier: GPL-3.0-or-later
"""The package as Blender sees it."""

from __future__ import annotations

import importlib
import re
import tomllib
from pathlib import Path

import bpy
import pytest

ROOT = Path(__file__).resolve().parents[2]


def _ours():
    return sorted(n for n in dir(bpy.types) if n.startswith("ADRT_"))


@pytest.fixture
def switched_off(addon):
    addon.unregister()
    yield addon
    addon.register()


def test_twice(switched_off):
    for _ in range(2):
        switched_off.register()
        assert hasattr(bpy.types.Scene, "adaptive_drt") and _ours()
        switched_off.unregister()
        assert not hasattr(bpy.types.Scene, "adaptive_drt") and _ours() == []
        assert bpy.app.handlers.save_pre == []


@pytest.mark.parametrize("name", ["adaptive_drt", "some_other_name"])
def test_under_another_name(switched_off, name, monkeypatch):
    import sys

    from addon import load_addon

    kept = {k: v for k, v in sys.modules.items() if k == name or k.startswith(f"{name}.")}
    for key in kept:
        monkeypatch.delitem(sys.modules, key)
    package = load_addon(name)
    try:
        package.register()
        assert bpy.types.Scene.bl_rna.properties["adaptive_drt"] is not None
        package.unregister()
    finally:
        for key in [k for k in sys.modules if k == name or k.startswith(f"{name}.")]:
            del sys.modules[key]
        sys.modules.update(kept)


def test_its_processes_end_with_it(switched_off):
    switched_off.register()
    module = importlib.import_module(f"{switched_off.__name__}.adaptive_drt.parallel.pool")
    module.worker_pool.start_workers(1)
    (worker,) = module.worker_pool._idle
    switched_off.unregister()
    assert not worker.alive


def test_labels_and_places(addon):
    assert bpy.ops.adaptive_drt.render.get_rna_type().name == "Adaptive Render"
    sidebar, render = bpy.types.ADRT_PT_sidebar, bpy.types.ADRT_PT_render
    assert (sidebar.bl_space_type, sidebar.bl_category) == ("VIEW_3D", "Adaptive Render")
    assert (render.bl_space_type, render.bl_context) == ("PROPERTIES", "render")


def test_tooltips_have_no_final_dot(addon):
    group = bpy.context.scene.adaptive_drt.bl_rna
    for prop in group.properties:
        if prop.identifier in ("rna_type", "name"):
            continue
        assert prop.name and prop.description and not prop.description.endswith(".")
        items = prop.enum_items if prop.type == "ENUM" else ()
        assert all(i.description and not i.description.endswith(".") for i in items)
    for name in dir(bpy.ops.adaptive_drt):
        kind = getattr(bpy.ops.adaptive_drt, name).get_rna_type()
        assert kind.description and not kind.description.endswith(".")
        for prop in kind.properties:
            assert prop.identifier == "rna_type" or not prop.description.endswith(".")


def test_manifest():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    assert manifest["id"] == "adaptive_drt" and manifest["type"] == "add-on"
    assert manifest["blender_version_min"] == "4.2.0"
    assert len(manifest["tagline"]) <= 64 and re.search(r"\w$", manifest["tagline"])
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"] and manifest["tags"] == ["Render"]


def test_imports_inside_are_relative():
    for folder in ("operators", "ui"):
        for path in (ROOT / folder).rglob("*.py"):
            assert not re.search(r"^\s*(from|import) adaptive_drt", path.read_text(), re.M), path
