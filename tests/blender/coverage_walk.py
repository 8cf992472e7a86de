# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks Blender's RNA beside the tables of settings, and sets each setting that is to be listed.

Without pytest, so that a Blender that is a program can run it, too.
"""

from __future__ import annotations

import importlib
from types import SimpleNamespace

import bpy

CYCLES = {
    "CyclesRenderSettings": "Scene",
    "CyclesObjectSettings": "Object",
    "CyclesRenderLayerSettings": "ViewLayer",
}
"""Whose `cycles` an add-on's struct is; bpy.types has no name for it."""


def properties(struct):
    """The identifiers of a struct's properties in this Blender."""
    if struct in CYCLES:
        owner = getattr(bpy.types, CYCLES[struct])
        rna = owner.bl_rna.properties["cycles"].fixed_type
    elif struct == "CyclesCurveRenderSettings":
        rna = bpy.types.Scene.bl_rna.properties["cycles_curves"].fixed_type
    else:
        rna = getattr(bpy.types, struct).bl_rna
    assert rna.identifier == struct
    return {one.identifier for one in rna.properties}


def unclassified(package):
    """Properties that this Blender has and that are in no class, as Struct.property."""
    tables = importlib.import_module(f"{package}.operators.export.settings_tables")
    return sorted(
        {
            f"{one.struct}.{name}"
            for one in tables.COVERED
            for name in properties(one.struct) - one.table.keys()
        }
    )


def unknown(package):
    """Names in the tables that this Blender does not have, as Struct.property."""
    tables = importlib.import_module(f"{package}.operators.export.settings_tables")
    shared = importlib.import_module(f"{package}.operators.export.datablock_table")
    return sorted(
        {
            f"{one.struct}.{name}"
            for one in tables.COVERED
            for name in one.table.keys() - properties(one.struct) - shared.ID.keys()
        }
    )


class COVERAGE_RE_export(bpy.types.RenderEngine):
    """Exports what it is asked to render, and renders nothing."""

    bl_idname, bl_label = "COVERAGE_EXPORT", "Export"
    package, issues = "", ()

    def render(self, depsgraph):
        export = importlib.import_module(f"{self.package}.operators.export").export_scene
        COVERAGE_RE_export.issues = export(depsgraph).issues


def exported():
    """The issues of the open scene, as a render of Blender's own makes them."""
    scene = bpy.context.scene
    scene.render.engine = "COVERAGE_EXPORT"
    COVERAGE_RE_export.issues = None
    bpy.ops.render.render()
    assert COVERAGE_RE_export.issues is not None, "the export failed"
    return COVERAGE_RE_export.issues


def _quad(name, collection):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], [(0, 1, 2, 3)])
    thing = bpy.data.objects.new(name, mesh)
    collection.objects.link(thing)
    return thing


def stage():
    """A small scene in which each struct of the tables has an owner."""
    # as read_factory_settings does, which takes seven times as long
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene, data = bpy.context.scene, bpy.data
    scene.render.resolution_x = scene.render.resolution_y = 4
    camera = data.objects.new("Camera", data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera, camera.location = camera, (0, 0, 10)
    outer, inner = data.collections.new("Outer"), data.collections.new("Inner")
    scene.collection.children.link(outer)
    shape, instanced = _quad("Shape", outer), _quad("Instanced", inner)
    instancer = data.objects.new("Instancer", None)
    instancer.instance_type, instancer.instance_collection = "COLLECTION", inner
    lamp = data.objects.new("Lamp", data.lights.new("Lamp", "AREA"))
    lamp.visible_camera = False
    for thing in (instancer, lamp):
        scene.collection.objects.link(thing)
    layer = bpy.context.view_layer
    return SimpleNamespace(
        scene=scene,
        layer=layer,
        shape=shape,
        parts={"shape": shape, "instanced": instanced, "instancer": instancer, "lamp": lamp},
        inner=inner,
        # (owner, kind and name of the datablock that its issues are about)
        owners={
            "Scene": (scene, "SCENE", scene.name),
            "RenderSettings": (scene.render, "SCENE", scene.name),
            "ImageFormatSettings": (scene.render.image_settings, "SCENE", scene.name),
            "ColorManagedViewSettings": (scene.view_settings, "SCENE", scene.name),
            "ColorManagedDisplaySettings": (scene.display_settings, "SCENE", scene.name),
            "CyclesRenderSettings": (scene.cycles, "SCENE", scene.name),
            "ViewLayer": (layer, "VIEW_LAYER", layer.name),
            "CyclesRenderLayerSettings": (layer.cycles, "VIEW_LAYER", layer.name),
            "LayerCollection": (layer.layer_collection.children[0], "COLLECTION", "Outer"),
            "Collection": (outer, "COLLECTION", "Outer"),
            "CyclesObjectSettings": (shape.cycles, "OBJECT", "Shape"),
            "ObjectLightLinking": (lamp.light_linking, "OBJECT", "Lamp"),
        },
    )


def _multilayer(made):
    output = made.scene.render.image_settings
    if hasattr(output, "media_type"):  # from 5.0 on
        output.media_type = "MULTI_LAYER_IMAGE"
    output.file_format = "OPEN_EXR_MULTILAYER"


def _blurred(made):
    made.scene.render.use_motion_blur = True


def _culled(switch):
    def prepare(made):
        made.scene.render.use_simplify = True
        setattr(made.shape.cycles, switch, True)

    return prepare


def _subdivided(made):
    made.shape.modifiers.new("Subdivision", "SUBSURF").subdivision_type = "SIMPLE"
    if hasattr(made.scene.cycles, "feature_set"):  # until 4.5
        made.scene.cycles.feature_set = "EXPERIMENTAL"


PREPARED = {
    "ViewLayer": _multilayer,
    "CyclesRenderLayerSettings": _multilayer,
    "RenderSettings.motion_blur_shutter_curve": _blurred,
    "CyclesRenderSettings.rolling_shutter_type": _blurred,
    "CyclesRenderSettings.fast_gi_method": lambda s: setattr(s.scene.cycles, "use_fast_gi", True),
    "CyclesRenderSettings.use_camera_cull": _culled("use_camera_cull"),
    "CyclesRenderSettings.use_distance_cull": _culled("use_distance_cull"),
    "CyclesObjectSettings.use_adaptive_subdivision": _subdivided,
}
"""What else must be so for a setting to be in force."""


def _shape_shutter(render):
    curve = render.motion_blur_shutter_curve
    curve.curves[0].points[0].location = (0.0, 0.2)
    curve.update()


def _link(name):
    def change(linking):
        members = bpy.data.collections.new("Linked")
        members.objects.link(bpy.data.objects["Shape"])
        setattr(linking, name, members)

    return change


def _subdivide_adaptively(thing):
    modifier = thing.modifiers.new("Subdivision", "SUBSURF")
    modifier.subdivision_type = "SIMPLE"  # it stays a parallelogram
    if not hasattr(modifier, "use_adaptive_subdivision"):
        assert bpy.app.version < (5, 0, 0)
        return False
    modifier.use_adaptive_subdivision = True
    return True


CHANGES = {
    "RenderSettings.motion_blur_shutter_curve": _shape_shutter,
    "ViewLayer.aovs": lambda layer: layer.aovs.add(),
    "ViewLayer.lightgroups": lambda layer: layer.lightgroups.add(name="Sun"),
    "ObjectLightLinking.receiver_collection": _link("receiver_collection"),
    "ObjectLightLinking.blocker_collection": _link("blocker_collection"),
    "CyclesRenderSettings.filter_width": lambda cycles: setattr(cycles, "filter_width", 4.0),
    "Object.modifiers": _subdivide_adaptively,
}
"""How to set what is no plain value; False where this Blender has no such thing."""


def _change(owner, name, entry):
    """Set a property to a value at which it would change the picture."""
    rna = owner.bl_rna.properties[name]
    if rna.type == "BOOLEAN":
        value = True not in entry.neutral
    elif rna.type == "ENUM":
        value = next(v for v in rna.enum_items.keys() if v not in entry.neutral)
    else:
        value = min(entry.neutral[0] + 1, rna.hard_max)
    setattr(owner, name, value)
    assert getattr(owner, name) not in entry.neutral


def _fault_of(covered, name, entry):
    """Why a listed property is not listed, or ""; None where this Blender does not have it."""
    said = f"{covered.struct}.{name}"
    made = stage()
    if covered.part:
        owner = made.parts[covered.part]
        kind, target = "OBJECT", owner.name
    else:
        owner, kind, target = made.owners[covered.struct]
    if not hasattr(owner, name):
        return None
    for prepare in (PREPARED.get(covered.struct), PREPARED.get(said)):
        if prepare is not None:
            prepare(made)
    before = exported()
    change = CHANGES.get(said)
    if change is None:
        _change(owner, name, entry)
    elif change(owner) is False:
        return None
    start, _, end = entry.reason.partition("{value}")

    def says_so(issue):
        return issue.reason.startswith(start) and issue.reason.endswith(end)

    if any(map(says_so, before)):
        return f"{said} ({covered.part}) is listed where it is not set"
    found = list(filter(says_so, exported()))
    if [(i.kind, i.target, i.missing) for i in found] != [(kind, target, entry.missing)]:
        return f"{said} ({covered.part}) is not listed: {found}"
    return ""


def unlisted(package):
    """What is to be listed and is not, and how many properties were set."""
    tables = importlib.import_module(f"{package}.operators.export.settings_tables")
    coverage = importlib.import_module(f"{package}.operators.export.coverage")
    COVERAGE_RE_export.package = package
    bpy.utils.register_class(COVERAGE_RE_export)
    try:
        found = [
            _fault_of(covered, name, entry)
            for covered in tables.COVERED
            for name, entry in covered.table.items()
            if isinstance(entry, coverage.Listed)
        ]
    finally:
        bpy.utils.unregister_class(COVERAGE_RE_export)
    return [fault for fault in found if fault], sum(fault is not None for fault in found)


def factory_issues(package):
    """What a render of Blender's own startup file lists, if the scene can be exported."""
    COVERAGE_RE_export.package = package
    bpy.utils.register_class(COVERAGE_RE_export)
    try:
        bpy.ops.wm.read_factory_settings()
        scene = bpy.context.scene
        scene.render.resolution_x = scene.render.resolution_y = 4
        return exported()
    finally:
        bpy.utils.unregister_class(COVERAGE_RE_export)
