# SPDX-License-Identifier: GPL-3.0-or-later
"""No setting of a camera, light, world, material or shader node is left out in silence."""

from __future__ import annotations

import importlib

import bpy
import pytest
import rna_walk_nodes as walk
from conftest import PACKAGE


def test_every_setting_is_in_a_class(addon, file):
    assert list(walk.unclassed(PACKAGE)) == []


def test_the_walk_finds_a_setting_that_is_new(addon, file):
    bpy.types.Light.adrt_new_setting = bpy.props.BoolProperty()
    try:
        assert "PointLight.adrt_new_setting" in list(walk.unclassed(PACKAGE))
    finally:
        del bpy.types.Light.adrt_new_setting


def test_the_walk_finds_a_node_and_an_input_that_are_new(addon, file, monkeypatch):
    tables = importlib.import_module(f"{PACKAGE}.operators.export.node_table")
    monkeypatch.delitem(tables.TYPES, "ShaderNodeBsdfGlass")
    monkeypatch.delitem(tables.PRINCIPLED, "Coat Tint")
    found = list(walk.unclassed(PACKAGE))
    assert found == ["ShaderNodeBsdfGlass", "ShaderNodeBsdfPrincipled: input Coat Tint"]


def test_cycles_settings_are_walked(addon, file):
    structs = walk._structs()
    for name in ("Light", "World", "Material"):
        if hasattr(getattr(bpy.types, name), "cycles"):  # an add-on, which may be switched off
            assert f"Cycles{name}Settings" in structs


def test_each_listed_setting_gives_its_line(addon, file):
    assert list(walk.unlisted(PACKAGE)) == []


def test_the_factory_scene_misses_nothing(addon):
    bpy.ops.wm.read_factory_settings(use_empty=False)
    export = importlib.import_module(f"{PACKAGE}.operators.export").export_scene
    issues = export(bpy.context.evaluated_depsgraph_get()).issues
    assert not any(issue.missing for issue in issues)
    assert {(i.name, i.reason) for i in issues} == {
        ('Material "Material"', "Specular is left out: only its base colour is used"),
    }


@pytest.mark.parametrize("value, same", [(3.1415927410125732, True), (3.14, False)])
def test_neutral_values_are_met_to_float32(addon, value, same):
    listing = importlib.import_module(f"{PACKAGE}.operators.export.listing")
    assert listing.same(value, 3.141592653589793) is same
