# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of what is missing from a picture or simplified: its lines, its text, its selections."""

from __future__ import annotations

import importlib
import logging
import types

import bpy
import pytest
import things


@pytest.fixture
def issues(addon):
    return importlib.import_module(f"{addon.__name__}.operators.issues")


@pytest.fixture
def report(addon, file):
    return importlib.import_module(f"{addon.__name__}.operators.report")


@pytest.fixture
def state(addon, file):
    return importlib.import_module(f"{addon.__name__}.operators.state").state


@pytest.fixture
def known(report, core):
    """Let the scene have these issues, as after a render."""

    def keep(*found):
        context = bpy.context
        report.begin(context.scene)
        report.keep(report.subject_of(context.scene, context.view_layer), found)
        report.deliver()

    return keep


def _lost(core, name, reason="it is left out", **more):
    return core.Issue(name, reason, missing=True, **more)


def _text():
    return bpy.data.texts["Adaptive Render Report"].as_string()


def test_equal_issues_are_one_line_and_missing_objects_come_first(issues, core):
    many = [_lost(core, f"Hair {n}") for n in range(59)]
    note = core.Issue('Material "Red"', "its gloss is left out", kind="MATERIAL", target="Red")
    groups = issues.grouped([note, *many, _lost(core, "Hair 0"), _lost(core, "Text", "too odd")])
    assert [g.title for g in groups] == ["59 objects", "Text", 'Material "Red"']
    assert [g.missing for g in groups] == [True, True, False]
    assert groups[1].line == '"Text": too odd' and groups[0].names[58] == '"Hair 58"'
    assert issues.count_text([note, *many]) == "59 objects missing, 1 note"


def test_the_same_reason_of_another_kind_is_another_line(issues, core):
    found = [core.Issue("A", "why"), core.Issue("B", "why", kind="WORLD"), _lost(core, "C", "why")]
    assert len(issues.grouped(found)) == 3


@pytest.mark.parametrize(
    "missing, notes, said",
    [
        (0, 0, ""),
        (1, 0, "1 object missing"),
        (2, 3, "2 objects missing, 3 notes"),
        (0, 1, "1 note"),
        (1200, 0, "1,200 objects missing"),
    ],
)
def test_count(issues, core, missing, notes, said):
    found = [_lost(core, f"Object {n}") for n in range(missing)]
    found += [core.Issue("Cube", f"reason {n}") for n in range(notes)]
    assert issues.count_text(found) == said


def test_an_object_that_two_reasons_name_is_one(issues, core):
    assert issues.missing_count([_lost(core, "A", "one"), _lost(core, "A", "another")]) == 1


def test_the_text_has_every_name(known, core):
    known(*(_lost(core, f"Hair {n}") for n in range(59)), core.Issue("Cube", "it is flat"))
    text = _text()
    assert all(f'"Hair {n}"\n' in text for n in range(59))
    assert text.splitlines()[1] == "59 objects missing, 1 note"
    assert text.index("Missing from the picture") < text.index("Notes") < text.index('"Cube"')
    known()
    assert "Hair" not in _text() and "Nothing is missing" in _text()


def test_the_text_of_a_linked_file_is_left_alone(known, core, tmp_path):
    known(_lost(core, "Theirs"))
    path = str(tmp_path / "theirs.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (source, target):
        target.texts = list(source.texts)
    known(_lost(core, "Ours"))
    texts = {t.library is None: t.as_string() for t in bpy.data.texts}
    assert "Ours" in texts[True] and "Theirs" in texts[False] and len(bpy.data.texts) == 2


def test_the_log_has_every_name(known, core, caplog):
    with caplog.at_level(logging.WARNING):
        known(*(_lost(core, f"Hair {n}") for n in range(20)), core.Issue("Cube", "it is flat"))
        known(*(_lost(core, f"Hair {n}") for n in range(20)), core.Issue("Cube", "it is flat"))
    said = [r.getMessage() for r in caplog.records]
    assert len(said) == 2, "what the log has already is not said again, frame by frame"
    assert said[0].startswith("Missing: 20 objects: it is left out: ") and '"Hair 19"' in said[0]
    assert said[1] == 'Note: "Cube": it is flat'


def test_undo_leaves_the_report(known, core):
    bpy.ops.ed.undo_push(message="before")
    things.link(bpy.data.objects.new("Edit", None))
    bpy.ops.ed.undo_push(message="an edit")
    known(_lost(core, "Lost"))
    bpy.ops.ed.undo()
    assert "Edit" not in bpy.data.objects and '"Lost"' in _text()
    bpy.ops.ed.redo()
    assert "Edit" in bpy.data.objects and '"Lost"' in _text()


def test_another_file_gets_no_report_of_this_one(known, core):
    known(_lost(core, "Lost"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert not bpy.data.texts and not bpy.ops.adaptive_drt.show_report.poll()


def test_a_report_is_opened_or_said_where_it_is(known, core):
    known(_lost(core, "Lost"))
    assert bpy.ops.adaptive_drt.show_report() == {"FINISHED"}


def _selected():
    return {o.name for o in bpy.context.view_layer.objects if o.select_get()}


def _select(line=0):
    return bpy.ops.adaptive_drt.select(line=line)


def test_a_click_selects_the_objects_and_no_others(known, core):
    for name in ("A", "B", "C"):
        things.plane(name).select_set(name == "C")
    known(_lost(core, "A"), _lost(core, "B"), core.Issue("C", "it is flat"))
    bpy.ops.ed.undo_push(message="before")
    assert _select() == {"FINISHED"}
    assert _selected() == {"A", "B"} and bpy.context.view_layer.objects.active.name == "A"
    assert _select(1) == {"FINISHED"} and _selected() == {"C"}
    assert _select(2) == {"CANCELLED"} and _selected() == {"C"}


def test_a_click_is_a_step_of_undo(addon):
    kind = bpy.types.ADAPTIVE_DRT_OT_select
    assert kind.bl_options == {"REGISTER", "UNDO"}


def test_what_belongs_to_a_material_a_collection_or_a_light(known, core):
    red = bpy.data.materials.new("Red")
    for name in ("A", "B", "C"):
        things.plane(name).data.materials.append(red if name != "C" else None)
    group = bpy.data.collections.new("Group")
    bpy.context.scene.collection.children.link(group)
    things.link(bpy.data.objects["C"], group)
    things.light("POINT", "Bulb").name = "Lamp"
    known(
        core.Issue('Material "Red"', "1", kind="MATERIAL", target="Red"),
        core.Issue("Material Red", "2", kind="MATERIAL"),
        core.Issue('Collection "Group"', "3", kind="COLLECTION", target="Group"),
        core.Issue('Light "Bulb"', "4", kind="LIGHT", target="Bulb"),
        core.Issue("Camera", "5", kind="CAMERA"),
        core.Issue("A/B", "6"),
        core.Issue("Lamp", "7", kind="LIGHT"),
    )
    found = []
    for line in range(7):
        assert _select(line) == {"FINISHED"}
        found.append(_selected())
    assert found == [{"A", "B"}, {"A", "B"}, {"C"}, {"Lamp"}, {"Camera"}, {"A"}, {"Lamp"}]


def test_what_cannot_be_selected_is_said(known, core, capfd):
    shown, hidden, outside, fixed = (things.plane(n) for n in ("A", "Hidden", "Outside", "Fixed"))
    hidden.hide_set(True)
    fixed.hide_select = True
    elsewhere = bpy.data.collections.new("Elsewhere")
    bpy.context.scene.collection.children.link(elsewhere)
    bpy.context.scene.collection.objects.unlink(outside)
    elsewhere.objects.link(outside)
    bpy.context.view_layer.layer_collection.children["Elsewhere"].exclude = True
    shown.select_set(True)
    known(*(_lost(core, n) for n in ("Hidden", "Outside", "Fixed")), _lost(core, "Gone", "gone"))
    assert _select() == {"CANCELLED"} and _selected() == {"A"}, "nothing is selected in vain"
    told = "".join(capfd.readouterr())
    assert '"Hidden": hidden in the viewport' in told
    assert '"Outside": not in the view layer "ViewLayer"' in told
    assert '"Fixed": not selectable' in told
    assert _select(1) == {"CANCELLED"} and _selected() == {"A"}
    assert 'No object of this scene belongs to "Gone"' in "".join(capfd.readouterr())
    known(*(_lost(core, n) for n in ("Hidden", "A")))
    assert _select() == {"FINISHED"} and _selected() == {"A"}
    assert "1 of 2 selected" in "".join(capfd.readouterr())


def test_a_click_while_something_else_is_edited(known, core):
    things.plane("A")
    edited = things.plane("B")
    bpy.context.view_layer.objects.active = edited
    bpy.ops.object.mode_set(mode="EDIT")
    known(_lost(core, "A"))
    assert _select() == {"FINISHED"} and _selected() == {"A"}
    assert edited.mode == "OBJECT"


def test_what_has_no_objects_is_a_plain_line(addon, issues, core):
    selection = importlib.import_module(f"{addon.__name__}.operators.selection")
    for kind in ("WORLD", "SCENE", "VIEW_LAYER"):
        (group,) = issues.grouped([core.Issue("Thing", "why", kind=kind)])
        assert not selection.is_selectable(group)
    (group,) = issues.grouped([core.Issue("Thing", "why")])
    assert selection.is_selectable(group)


def _far_ball():
    """An object that no picture can hold."""
    ball = things.uv_sphere("Far")
    ball.location.x = 1e31
    return ball


def test_the_button_s_last_line_keeps_the_count(state, capfd):
    _far_ball()
    things.light("AREA", energy=100.0).location.z = 5.0
    assert bpy.ops.adaptive_drt.render() == {"FINISHED"}
    (found,) = state.issues.values()
    assert [one.name for one in found if one.missing] == ["Far"]
    told = "".join(capfd.readouterr()).splitlines()
    last = [line for line in told if "Adaptive Render: " in line][-1]
    assert last.startswith("Warning: Adaptive Render: 1 object missing") and " s, " in last
    assert '"Far"' in _text()


def test_the_header_of_f12_keeps_the_count(report, state, monkeypatch, capfd):
    _far_ball()
    things.plane("Floor")
    said, tell = [], report.tell
    monkeypatch.setattr(report, "tell", lambda *words: said.append(tell(*words)) or said[-1])
    bpy.context.scene.render.engine = "ADAPTIVE_DRT"
    assert bpy.ops.render.render() == {"FINISHED"}
    (line,) = said
    assert line.startswith("1 object missing, 1 note; ") and " s, " in line
    told = "".join(capfd.readouterr())
    # Blender 5 prints the status on demand alone
    assert line in told or bpy.app.version >= (5, 0)
    assert '"Far"' in _text()


def test_panels_are_drawn_again_after_a_render_that_told_nothing(report, monkeypatch):
    """Cancelled by ESC, say: their button was greyed out."""
    drawn, running = [], [True]
    blender = types.SimpleNamespace(
        background=False, is_job_running=lambda kind: running[0] and kind == "RENDER"
    )
    stand_in = types.SimpleNamespace(app=blender, data=bpy.data, context=bpy.context)
    monkeypatch.setattr(report, "redraw_panels", lambda: drawn.append(1))
    monkeypatch.setattr(report, "bpy", stand_in)
    report.deliver()
    drawn.clear()
    assert report._look() and not drawn
    running[0] = False
    assert report._look() and drawn == [1]
    assert report._look() and drawn == [1], "and not again"


def test_the_list_holds_all_view_layers(state, core, rendered):
    """And none of a frame before."""
    scene = bpy.context.scene
    things.plane("Floor")
    second = scene.view_layers.new("Second")
    worn = bpy.data.materials.new("Shiny")
    worn.use_nodes = True
    second.material_override = worn
    for _ in range(2):
        rendered(1, 2)
        (layers,) = state.layers.values()
        assert set(layers) == {"ViewLayer", "Second"}
        assert layers["ViewLayer"] != layers["Second"]
        (found,) = state.issues.values()
        assert set(found) == {one for part in layers.values() for one in part}
        assert len(set(found)) == len(found)


def test_the_factory_scene_has_notes_alone(addon, issues, state):
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.engine = "ADAPTIVE_DRT"
    bpy.ops.render.render()
    (found,) = (v for k, v in state.issues.items() if k == str(scene.session_uid))
    assert found and issues.missing_count(found) == 0
    assert bpy.ops.adaptive_drt.check() == {"FINISHED"}
    assert issues.missing_count(state.issues[str(scene.session_uid)]) == 0
