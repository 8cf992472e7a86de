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
    """Notes what a panel draws; everything else is allowed and does nothing.

    seen : names of properties and operators.
    said : texts, each with its icon and whether it is red.
    """

    def __init__(self, seen, said=None):
        object.__setattr__(self, "seen", seen)
        object.__setattr__(self, "said", [] if said is None else said)
        object.__setattr__(self, "alert", False)

    def __setattr__(self, name, value):
        if name == "alert":
            object.__setattr__(self, name, value)

    def label(self, text="", icon="NONE"):
        self.said.append((text, icon, self.alert))

    def prop(self, data, name, **_):
        assert name in data.bl_rna.properties, f"{data} has no {name} in this Blender"
        self.seen.append(name)

    def operator(self, name, text="", icon="NONE", **_):
        self.seen.append(name)
        self.said.append((text, icon, self.alert))
        return types.SimpleNamespace()

    def __getattr__(self, name):
        return lambda *a, **k: _Layout(self.seen, self.said)


def _drawn(addon, *panels, context=None, said=None):
    seen = []
    for name in panels:
        panel = getattr(bpy.types, name)
        stand_in = type("Panel", (), {"layout": _Layout(seen, said)})()
        panel.draw(stand_in, context or bpy.context)
    return seen


def _across(width):
    """A context whose region is so wide, at a scale of 1."""
    preferences = types.SimpleNamespace(system=types.SimpleNamespace(ui_scale=1.0))
    region = types.SimpleNamespace(width=width)
    return types.SimpleNamespace(
        region=region, preferences=preferences, scene=bpy.context.scene, engine="ADAPTIVE_DRT"
    )


@pytest.mark.parametrize("place", ["render", "sidebar"])
def test_settings_of_the_method_alone_are_drawn(addon, file, place):
    chosen = bpy.context.scene.adaptive_drt
    rays = {"order", "distribution", "light_rays", "time_rays", "pixel_rays"}
    names = f"ADRT_PT_{place}", f"ADRT_PT_{place}_effects", f"ADRT_PT_{place}_performance"
    chosen.method = "RAYS"
    seen = set(_drawn(addon, *names))
    assert seen >= rays | {"method", "use_motion_blur", "threads"} and "tolerance" not in seen
    chosen.method = "EXACT"
    seen = set(_drawn(addon, *names))
    assert seen.isdisjoint(rays) and seen >= {"tolerance", "method", "use_motion_blur", "threads"}


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
    # the scene's own switch, by another name
    seen.add("use_motion")
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


@pytest.fixture
def state(addon, file):
    return importlib.import_module(f"{addon.__name__}.operators.state").state


def _report(addon, state, *issues, width=260):
    said = []
    state.issues[str(bpy.context.scene.session_uid)] = issues
    seen = _drawn(addon, "ADRT_PT_sidebar_report", context=_across(width), said=said)
    return seen, [one for one in said if one[0]]


def test_missing_objects_are_red_and_notes_are_not(addon, state, core):
    lost = [core.Issue(f"Hair {n}", "it is left out", missing=True) for n in range(59)]
    note = core.Issue('Material "Red"', "its gloss is left out", kind="MATERIAL", target="Red")
    world = core.Issue("World", "its light is left out", kind="WORLD")
    seen, said = _report(addon, state, note, world, *lost)
    heads = [one for one in said if one[1] in ("ERROR", "INFO")]
    assert heads == [
        ("59 objects missing, 2 notes", "ERROR", True),
        ("59 objects", "ERROR", True),
        ('Material "Red"', "INFO", False),
        ("World", "INFO", False),
    ]
    assert seen.count("adaptive_drt.select") == 2, "a world is nothing to select"
    assert any('"Hair\u00a00"' in text for text, *_ in said)


def test_notes_alone_leave_nothing_red(addon, state, core):
    _, said = _report(addon, state, core.Issue("Cube", "it is flat"))
    assert ("1 note", "INFO", False) in said
    assert not any(icon == "ERROR" or alert for _, icon, alert in said)
    _, said = _report(addon, state)
    assert ("All is rendered as it is set", "CHECKMARK", False) in said


def test_a_long_list_ends_in_a_button_to_all_of_it(addon, state, core):
    seen, said = _report(addon, state, *(core.Issue(f"Cube {n}", f"reason {n}") for n in range(20)))
    assert said[-1][0] == "8 more in the Report" and seen[-1] == "adaptive_drt.show_report"


def test_the_report_stands_above_the_figures(addon):
    names = [cls.__name__ for cls in bpy.types.Panel.__subclasses__()]
    for place in ("render", "sidebar"):
        first, second = (names.index(f"ADRT_PT_{place}_{n}") for n in ("report", "figures"))
        assert first < second


RAYS = {
    "seconds": {"total": 12345.678},
    "pixels": 2_073_600,
    "counts": dict.fromkeys(("penumbra", "motion", "edge", "distributed"), 2_073_600),
    "a": 0.26318, "b": 10.9712, "b_spread": 0.2468, "c": 123.4567, "predicted_ratio": 0.0712345,
    "measured_ratio": 0.08123, "rays": {"camera": 265_420_800, "shadow": 3_317_760_000},
}  # fmt: skip


def test_no_label_is_cut_off(addon, state, core):
    """Measured with Blender's own font, in the narrowest a sidebar is by default, and wider."""
    import blf

    blf.size(0, 11.0)
    exact = {**RAYS, "tolerance": 0.001, "error_estimate": 0.000434, "cancelled": True, "done": 0.5}
    long = core.Issue("Cube", "its parents shear it; sheared area lights are left out " * 3)
    for width in (200, 260, 292, 420):
        # less than what Blender keeps for tabs, borders and the scroll bar
        inner = width - 25 - 24
        for figures in (RAYS, exact):
            state.figures[str(bpy.context.scene.session_uid)] = figures
            said = []
            _drawn(addon, "ADRT_PT_sidebar_figures", context=_across(width), said=said)
            for text, *_ in said:
                half = (inner if len(text) > _half(addon, width) else inner / 2) if text else 1e9
                assert blf.dimensions(0, text)[0] <= half, (width, text)
        _, said = _report(addon, state, long, width=width)
        for text, icon, _ in said:
            assert blf.dimensions(0, text)[0] <= inner - 20 * (icon != "NONE"), (width, text)


def _half(addon, width):
    panels = importlib.import_module(f"{addon.__name__}.ui.panels")
    return panels.characters_across(_across(width), icons=0) // 2


def test_ratios_say_of_what_they_are_and_belong_to_one_method(addon):
    panels = importlib.import_module(f"{addon.__name__}.ui.panels")
    said = dict(panels.figure_lines(RAYS))
    assert said["Predicted Time"] == "0.071 of Everywhere"
    assert said["Measured Time"] == "0.081 of Everywhere"
    assert said["b, Derivative Cost"] == "11 (spread 0.25)"
    unknown = dict(panels.figure_lines({**RAYS, "b": None, "predicted_ratio": None}))
    assert unknown["b, Derivative Cost"] == "not measured" and "Predicted Time" not in unknown
    exact = dict(panels.figure_lines({**RAYS, "tolerance": 0.001}))
    assert not any("Everywhere" in value for value in exact.values())


def test_there_is_one_switch_of_motion_blur(addon, file):
    scene = bpy.context.scene
    ours, render = scene.adaptive_drt, scene.render
    for value in (True, False):
        render.use_motion_blur = value
        assert ours.use_motion is value
        ours.use_motion = not value
        assert render.use_motion_blur is not value
    assert "use_motion" not in _drawn(addon, "ADRT_PT_render_effects")


def test_one_name(addon, file):
    assert bpy.types.ADRT_PT_render.bl_label == bpy.types.ADRT_PT_sidebar.bl_category
    engines = bpy.types.RenderEngine.__subclasses__()
    engines = (e for e in engines if e.__module__.startswith(f"{addon.__name__}."))
    (engine,) = (e for e in engines if getattr(e, "bl_idname", "") == "ADAPTIVE_DRT")
    assert engine.bl_label == bpy.ops.adaptive_drt.render.get_rna_type().name == "Adaptive Render"
