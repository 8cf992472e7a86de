# SPDX-License-Identifier: GPL-3.0-or-later
"""What an instancer asks for its instances is listed or rendered, as far as Cycles heeds it."""

from __future__ import annotations

import importlib

import bpy
import numpy as np
import pytest
import things

FLAGS = {"is_shadow_catcher": True}
RAYS = {"visible_camera": "camera", "visible_shadow": "shadow"}
REPEATS = [
    lambda ball: _instanced("Field", ball),
    lambda b: _on_vertices(b),
    lambda b: _by_nodes(b),
]


def _instanced(name, *members):
    """An empty that instances a collection of these objects, which stand nowhere else."""
    inside = bpy.data.collections.new(name)
    for member in members:
        for collection in member.users_collection:
            collection.objects.unlink(member)
        inside.objects.link(member)
    empty = things.link(bpy.data.objects.new(name, None))
    empty.instance_type, empty.instance_collection = "COLLECTION", inside
    return empty


def _on_vertices(ball):
    field = things.plane("Field")
    ball.parent, field.instance_type = field, "VERTS"
    field.show_instancer_for_render = False
    return field


def _by_nodes(ball):
    field = things.plane("Field")
    things.scatter(field, ball)
    ball.hide_render = True
    return field


@pytest.mark.parametrize("flag", FLAGS)
@pytest.mark.parametrize("repeat", REPEATS)
def test_an_instancer_s_switches_are_listed_once(rendered, repeat, flag):
    field = repeat(things.uv_sphere("Ball", radius=0.2))
    (scene,) = rendered()
    assert not any(issue.name == "Field" for issue in scene.issues)
    setattr(field, flag, FLAGS[flag])
    (scene,) = rendered()
    (issue,) = (issue for issue in scene.issues if issue.name == "Field")
    assert (issue.kind, issue.missing) == ("OBJECT", False)
    assert len(scene.shapes) >= 1  # what it repeats is there, simplified


@pytest.mark.parametrize("rays", RAYS)
@pytest.mark.parametrize("repeat", REPEATS)
def test_an_instancer_s_ray_visibility_is_that_of_what_it_repeats(export, repeat, rays):
    field = repeat(things.uv_sphere("Ball", radius=0.2))
    assert all(getattr(shape.visibility, RAYS[rays]) for shape in export().shapes)
    setattr(field, rays, False)
    scene = export()
    balls = [shape for shape in scene.shapes if shape.name == "Field/Ball"]
    assert balls and not any(getattr(shape.visibility, RAYS[rays]) for shape in balls)
    assert all(shape.visibility.shadow or rays == "visible_shadow" for shape in scene.shapes)
    assert scene.issues == ()


def test_only_the_outermost_instancer_is_asked(export):
    """As Cycles does, which never sees an instancer within another one."""
    inner = _instanced("Inner", things.uv_sphere("Ball"))
    outer = _instanced("Outer", inner)
    inner.visible_camera, inner.is_shadow_catcher = False, True
    scene = export()
    assert scene.issues == () and scene.shapes[0].visibility.camera
    outer.visible_camera = False
    (ball,) = export().shapes
    assert not ball.visibility.camera and ball.visibility.shadow


def test_an_instancer_s_holdout_replaces_that_of_the_instance(export):
    ball = things.uv_sphere("Ball")
    ball.is_holdout = True
    assert export().shapes[0].visibility.holdout
    empty = _instanced("Empty", ball)
    assert not export().shapes[0].visibility.holdout
    empty.is_holdout = True
    scene = export()
    assert scene.shapes[0].visibility.holdout and scene.issues == ()
    ball.is_shadow_catcher = True
    assert set(things.reasons(export())) == {"Ball"}


def test_of_what_is_missing_nothing_else_is_told(export):
    flat = things.uv_sphere("Flat")
    flat.scale.z = 0.0
    (said,) = things.reasons(export())["Flat"]
    flat.visible_camera = _instanced("Empty", flat).visible_shadow = False
    assert things.reasons(export()) == {"Empty/Flat": [said]}


@pytest.mark.parametrize("flag", ["is_holdout", "is_shadow_catcher", "visible_shadow"])
def test_what_changes_no_light_is_not_listed_for_one(export, flag):
    for thing in (things.light("POINT", "Lamp"), _instanced("E", things.light("POINT", "Inside"))):
        setattr(thing, flag, not getattr(thing, flag))
    scene = export()
    assert scene.issues == () and len(scene.lights) == 2


def test_objects_are_read_once_however_often_they_are_instanced(export, addon, monkeypatch):
    checklist = importlib.import_module(f"{addon.__name__}.operators.export.checklist")
    count, read = [0], checklist.left_out

    def counted(*arguments):
        count[0] += 1
        return read(*arguments)

    monkeypatch.setattr(checklist, "left_out", counted)
    ball, fields = things.uv_sphere("Ball", radius=0.01), []
    for side in (1, 20):
        fields.append(things.plane("Field", segments=side))
        things.scatter(fields[-1], ball)
        fields[0].hide_render = fields[0].hide_viewport = side > 1
        count.append(len(export().shapes))
        count[0], before = 0, count[0]
    few, many = count[1:]
    assert many > 100 * few / 4 and many >= 400
    export()
    assert count[0] <= before


def test_many_instances_share_a_mesh(export):
    bpy.ops.mesh.primitive_monkey_add()
    head = bpy.context.object
    field = things.plane("Field", segments=9)
    things.scatter(field, head)
    head.hide_render = True
    scene = export()
    (record,) = (shape for shape in scene.shapes if type(shape).__name__ == "MeshInstances")
    assert record.name == "Field/Suzanne" and record.instances >= 100 and scene.issues == ()
    assert record.mesh.faces.shape[1] == 968
    scene = bpy.context.scene
    scene.render.use_motion_blur = True
    things.keyed(field, "rotation_euler", (0.0, 0.0, 0.0), (0.0, 0.0, 3.0))
    scene.frame_set(5)
    moving = export()
    (turning,) = (s for s in moving.shapes if getattr(s, "mesh", None) and s.instances >= 100)
    assert turning.matrices.shape == (3, 3, 4, record.instances) and moving.issues == ()


def test_a_light_without_diffuse_rays_gives_no_light(export):
    lamp = things.light("POINT", "Lamp")
    assert len(export().lights) == 1
    lamp.visible_diffuse = False
    scene = export()
    assert scene.lights == () and scene.issues == ()


def test_an_instancer_takes_diffuse_rays_from_its_lights(export, tmp_path):
    """Cycles does so from 4.5 on."""
    from peer import render_cycles

    floor = things.plane("Floor", size=40.0)
    floor.data.materials.append(things.material("Matt", "ShaderNodeBsdfDiffuse", Roughness=0.0))
    lamp = things.light("AREA", "Lamp", energy=1000.0, size=4.0)
    lamp.location.z, lamp.visible_camera = 5.0, False
    _instanced("Empty", lamp).visible_diffuse = False
    assert bool(export().lights) == bool(render_cycles(tmp_path, samples=4).max() > 0.01)
    assert bool(export().lights) == (bpy.app.version < (4, 5, 0))


def test_an_instancer_may_be_left_unblurred(export):
    ball = things.uv_sphere("Ball")
    empty = _instanced("Empty", ball)
    things.keyed(empty, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    bpy.context.scene.render.use_motion_blur = True
    bpy.context.scene.frame_set(6)
    assert np.any(export().shapes[0].motion.displacement)
    empty.cycles.use_motion_blur = False
    scene = export()
    assert scene.shapes[0].motion is None and scene.issues == ()
