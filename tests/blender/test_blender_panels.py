# SPDX-License-Identifier: GPL-3.0-or-later
"""Which panels a person sees under this engine: what it heeds, and nothing that it does not."""

from __future__ import annotations

import importlib
import types

import bpy
import panels_shown
import pytest


def test_what_applies_is_shown_and_nothing_else(addon):
    assert panels_shown.faults() == []


def test_a_fault_would_be_found(addon):
    light, world = bpy.types.DATA_PT_light, bpy.types.EEVEE_WORLD_PT_surface
    light.COMPAT_ENGINES.add("ADAPTIVE_DRT")
    world.COMPAT_ENGINES.discard("ADAPTIVE_DRT")
    try:
        found = " ".join(panels_shown.faults())
    finally:
        light.COMPAT_ENGINES.discard("ADAPTIVE_DRT")
        world.COMPAT_ENGINES.add("ADAPTIVE_DRT")
    assert "DATA_PT_light" in found and "EEVEE_WORLD_PT_surface is not shown" in found


def test_blender_s_panels_are_left_as_they_were(addon):
    addon.unregister()
    try:
        for panel in bpy.types.Panel.__subclasses__():
            assert "ADAPTIVE_DRT" not in getattr(panel, "COMPAT_ENGINES", ())
    finally:
        addon.register()


class _Layout:
    """Notes which properties a panel draws; everything else is allowed and does nothing."""

    def __init__(self, seen):
        object.__setattr__(self, "seen", seen)

    def __setattr__(self, name, value):
        pass

    def prop(self, data, name, **_):
        assert name in data.bl_rna.properties, f"{data} has no {name} in this Blender"
        self.seen.append(name)

    def operator(self, name, **_):
        self.seen.append(name)

    def __getattr__(self, name):
        return lambda *a, **k: self


def _drawn(addon, *panels):
    seen = []
    for name in panels:
        panel = getattr(bpy.types, name)
        stand_in = type("Panel", (), {"layout": _Layout(seen)})()
        panel.draw(stand_in, bpy.context)
    return seen


@pytest.mark.parametrize("place", ["render", "sidebar"])
def test_settings_of_the_method_alone_are_drawn(addon, file, place):
    chosen = bpy.context.scene.adaptive_drt
    rays = {"order", "distribution", "light_rays", "time_rays", "pixel_rays"}
    names = f"ADRT_PT_{place}", f"ADRT_PT_{place}_effects", f"ADRT_PT_{place}_performance"
    chosen.method = "RAYS"
    seen = set(_drawn(addon, *names))
    assert seen >= rays | {"method", "use_motion", "threads"} and "tolerance" not in seen
    chosen.method = "EXACT"
    seen = set(_drawn(addon, *names))
    assert seen.isdisjoint(rays) and seen >= {"tolerance", "method", "use_motion", "threads"}


def test_each_setting_is_drawn(addon, file):
    """No setting is left that only a script could reach."""
    chosen = bpy.context.scene.adaptive_drt
    seen = set()
    for method in ("RAYS", "EXACT"):
        chosen.method = method
        seen |= set(
            _drawn(addon, *(f"ADRT_PT_render{n}" for n in ("", "_effects", "_performance")))
        )
    command = importlib.import_module(f"{addon.__name__}.operators.command")
    assert {p.identifier for p in command.settings_properties(bpy.context.scene)} <= seen


def test_while_it_renders_a_bar_and_a_button_to_cancel(addon, file):
    state = importlib.import_module(f"{addon.__name__}.operators.state").state
    assert _drawn(addon, "ADRT_PT_sidebar")[0] == "adaptive_drt.render"
    state.job = types.SimpleNamespace(factor=0.5, text="Rendering 50 %")
    try:
        assert _drawn(addon, "ADRT_PT_sidebar")[0] == "adaptive_drt.cancel"
    finally:
        state.job = None


def test_a_small_tolerance_is_not_shown_as_0(addon, file):
    """Blender shows so many digits and no more."""
    chosen = bpy.context.scene.adaptive_drt
    assert chosen.bl_rna.properties["tolerance"].precision >= 6


def test_the_engine_s_own_panels(addon, file):
    bpy.context.scene.render.engine = "ADAPTIVE_DRT"
    panels = ("ADRT_PT_film", "ADRT_PT_passes", "ADRT_PT_filter", "ADRT_PT_override")
    seen = _drawn(addon, *panels)
    if "use_grease_pencil" in seen:  # from 4.3 on
        seen.remove("use_grease_pencil")
    assert seen == [
        "film_transparent", "film_exposure", "use_pass_z", "use_pass_normal",
        "use_sky", "use_solid", "use_strand", "use_volumes", "use_motion_blur",
        "material_override", "world_override",
    ]  # fmt: skip
    assert "compositor_device" in _drawn(addon, "ADRT_PT_render_performance")
    bpy.context.scene.render.engine = "CYCLES"
    assert "compositor_device" not in _drawn(addon, "ADRT_PT_render_performance")
