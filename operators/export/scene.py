# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole Blender scene, through its depsgraph."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...adaptive_drt.recognise import Ball
from ...adaptive_drt.scene import Camera, Issue, Light, Material, Scene, SceneError, Shape
from .animated import Animated, Key
from .camera import camera_of
from .checklist import ObjectIssues, cycles_of, instancer_of, scene_issues
from .clipping import clipped
from .exposure import exposed, exposure_of
from .instances import RENDERED, Visible, key_of, name_of
from .layer_filter import lets_through
from .light import Lamp, gives_light, lamp_of, light_of
from .material import material_of, slot_material
from .mesh import Form, is_smooth, mesh_form, shapes_of, wears_several
from .shutter import Matrix, Shutter, Track, matrix_of, shutter_of
from .world import background_of

CAMERA_KEY = "camera"

SEVERAL = "it wears several materials; the one of most faces is used"
SMOOTH = "its smooth shading is left out: its faces are rendered flat, as they are"


@dataclass
class _Export:
    """What has been gathered so far; meshes and materials are read once however often used.

    override : the material that the view layer puts on everything, if any.
    forms : of meshes by their pointers, and what of each is left out, or "".
    """

    opens: dict[Hashable, Matrix] | None
    closes: dict[Hashable, Matrix] | None
    override: Any | None = None
    shapes: list[Shape] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    issues: list[Issue] = field(default_factory=list)
    forms: dict[int, tuple[Form, str]] = field(default_factory=dict)
    known: dict[bytes, Form] = field(default_factory=dict)
    materials: dict[str, Material] = field(default_factory=dict)
    lamps: dict[str, Lamp] = field(default_factory=dict)

    def material(self, worn: Any | None) -> Material:
        """Return the Lambert material of what a face wears."""
        worn = self.override or worn
        key = worn.name_full if worn is not None else ""
        if key not in self.materials:
            self.materials[key] = material_of(worn, self.issues)
        return self.materials[key]

    def lamp(self, light: Any) -> Lamp:
        """Return what the datablock of a light object says."""
        if light.name_full not in self.lamps:
            self.lamps[light.name_full] = lamp_of(light, self.issues)
        return self.lamps[light.name_full]

    def track(
        self, key: Hashable, middle: Matrix, name: str, thing: Any, instancer: Any | None = None
    ) -> Track:
        if self.opens is None or self.closes is None:
            return Track(middle)
        # Cycles' own switch, of what is instanced and of what instances it
        owners = (thing,) if instancer is None else (thing, instancer)
        if not all(getattr(cycles_of(owner), "use_motion_blur", True) for owner in owners):
            return Track(middle)
        opens, closes = self.opens.get(key), self.closes.get(key)
        ends = [m for m in (opens, closes) if m is not None]
        if len(ends) < 2 or not all(np.isfinite(m).all() for m in ends):
            self.issues.append(Issue(name, "it is not there all the shutter; it is rendered still"))
            return Track(middle)
        return Track(middle, opens, closes)


def export_scene(
    depsgraph: Any, move: Callable[[float], None] | None = None, use_motion: bool = True
) -> Scene:
    """Return a depsgraph's scene as the tracer's records; whatever is left out is in its issues.

    Parameters
    ----------
    depsgraph : an evaluated `bpy.types.Depsgraph`.
    move : moves the scene to a time in frames; the caller puts the user's own frame back. It
        is called only if the scene has motion blur and `use_motion` is set. None: no motion.
    use_motion : whether motion blur is wanted at all.

    Raises
    ------
    SceneError
        There is no camera, or it is not a perspective one.
    """
    scene = depsgraph.scene.original
    # at another time of the shutter a marker may have made another one active
    camera_object = scene.camera
    if camera_object is None:
        raise SceneError("The scene has no camera: add one, or make one active")
    # at each frame the evaluated layer is another one
    moves = use_motion and move is not None and depsgraph.view_layer_eval.use_motion_blur
    shutter = shutter_of(scene) if moves else None
    opens = closes = None
    animated = Animated()
    if shutter is not None and move is not None:
        opens, closes = _ends(depsgraph, camera_object, move, shutter, animated)
    gathered = _Export(opens, closes, depsgraph.view_layer_eval.material_override)
    camera = _camera(depsgraph, camera_object, gathered)
    gathered.issues.extend(scene_issues(depsgraph))
    _gather(depsgraph, gathered)
    world = _world(depsgraph)
    background = background_of(world, gathered.issues)
    lights, background = exposed(gathered.lights, background, exposure_of(depsgraph.scene_eval))
    camera_data = camera_object.evaluated_get(depsgraph).data
    clip = animated.clip(camera_data)
    gathered.issues.extend(clipped(camera_data, camera, gathered.shapes, clip))
    gathered.issues.extend(animated.changes(depsgraph, _used(gathered, camera_data, world)))
    return Scene(
        camera=camera,
        shapes=tuple(gathered.shapes),
        lights=tuple(lights),
        background=background,
        transparent=bool(scene.render.film_transparent),
        # an issue of a mesh or material is told once, however many instances share it
        issues=tuple(dict.fromkeys(gathered.issues)),
    )


def _used(gathered: _Export, camera: Any, world: Any | None) -> set[Key]:
    """Return the datablocks whose settings are in the picture."""
    shining = (name for name, lamp in gathered.lamps.items() if not (lamp.missing or lamp.is_dark))
    return {
        ("CAMERA", camera.name_full),
        *(("WORLD", thing.name_full) for thing in (world,) if thing is not None),
        *(("MATERIAL", name) for name in gathered.materials),
        *(("LIGHT", name) for name in shining),
    }


def _ends(
    depsgraph: Any,
    camera: Any,
    move: Callable[[float], None],
    shutter: Shutter,
    animated: Animated,
) -> tuple[dict[Hashable, Matrix], dict[Hashable, Matrix]]:
    """Sample both ends of the shutter and leave the scene at its middle."""
    move(shutter.opens)
    opens = _matrices(depsgraph, camera)
    animated.sample(depsgraph)
    move(shutter.closes)
    closes = _matrices(depsgraph, camera)
    animated.sample(depsgraph)
    move(shutter.middle)
    return opens, closes


def _matrices(depsgraph: Any, camera: Any) -> dict[Hashable, Matrix]:
    found: dict[Hashable, Matrix] = {
        key_of(instance): matrix_of(instance)
        for instance in depsgraph.object_instances
        if instance.object.type in ("MESH", "LIGHT")
    }
    found[CAMERA_KEY] = matrix_of(camera.evaluated_get(depsgraph))
    return found


def _camera(depsgraph: Any, camera: Any, gathered: _Export) -> Camera:
    thing = camera.evaluated_get(depsgraph)
    track = gathered.track(CAMERA_KEY, matrix_of(thing), thing.original.name, thing)
    return camera_of(thing, track, depsgraph.scene.original.render, gathered.issues)


def _world(depsgraph: Any) -> Any | None:
    layer = depsgraph.view_layer_eval
    return (layer.world_override or depsgraph.scene_eval.world) if layer.use_sky else None


def _gather(depsgraph: Any, gathered: _Export) -> None:
    visible, layer = Visible(depsgraph), depsgraph.view_layer_eval
    objects = ObjectIssues()
    seen, meshes = set(), set()
    others: dict[str, Issue] = {}
    # an instance is valid only until the next one, so all of it is copied here
    for instance in depsgraph.object_instances:
        thing = instance.object
        if not instance.is_instance:
            seen.add(thing.original)
        if thing.type not in RENDERED or not visible(instance):
            continue
        if not lets_through(layer, thing.type):
            continue
        name = name_of(instance)
        if thing.type == "LIGHT":
            objects.read(instance)
            _gather_light(instance, name, gathered)
        elif thing.type == "MESH":
            meshes.add(name)
            before = len(gathered.shapes)
            _gather_mesh(instance, name, gathered)
            if len(gathered.shapes) > before:  # of what is missing there is no more to tell
                objects.read(instance)
        else:
            kind = thing.type.replace("_", " ").title()
            others[name] = Issue(name, f"objects of type {kind} are left out")
    # a text or a curve that has faces is there a second time, as a mesh
    gathered.issues.extend(issue for name, issue in others.items() if name not in meshes)
    gathered.issues.extend(visible.missing(seen))
    gathered.issues.extend(objects)


def _gather_light(instance: Any, name: str, gathered: _Export) -> None:
    thing, instancer = instance.object, instancer_of(instance)
    if not gives_light(thing, instancer):
        return
    track = gathered.track(key_of(instance), matrix_of(instance), name, thing, instancer)
    light = light_of(thing, gathered.lamp(thing.data), track, name, gathered.issues)
    if light is not None:
        gathered.lights.append(light)


def _gather_mesh(instance: Any, name: str, gathered: _Export) -> None:
    """Gather a mesh object; one in Edit Mode holds its faces only in a copy made of it."""
    thing = instance.object
    if not thing.data.is_editmode:
        _gather_faces(instance, thing.data, name, gathered)
        return
    try:
        _gather_faces(instance, thing.to_mesh(), name, gathered)
    finally:
        thing.to_mesh_clear()


def _gather_faces(instance: Any, mesh: Any, name: str, gathered: _Export) -> None:
    if not len(mesh.vertices):  # nodes have made instances of it, say: there is nothing to show
        return
    thing = instance.object
    pointer = thing.data.as_pointer()
    if pointer not in gathered.forms:
        gathered.forms[pointer] = _form(mesh, gathered)
    form, left_out = gathered.forms[pointer]
    if left_out:
        gathered.issues.append(Issue(name, left_out))
    if isinstance(form, str):
        return
    slots = {form.slot} if isinstance(form, Ball) else {flat.slot for flat in form}
    worn = {slot: gathered.material(slot_material(thing, slot)) for slot in slots}
    instancer = instancer_of(instance)
    track = gathered.track(key_of(instance), matrix_of(instance), name, thing, instancer)
    gathered.shapes.extend(shapes_of(form, track, worn, name, gathered.issues))


def _form(mesh: Any, gathered: _Export) -> tuple[Form, str]:
    """Return what a mesh stands for, and what of it is left out."""
    form = mesh_form(mesh, gathered.known)
    if isinstance(form, str):
        return form, form
    if isinstance(form, Ball):
        return form, SEVERAL if gathered.override is None and wears_several(mesh) else ""
    return form, SMOOTH if len(form) > 1 and is_smooth(mesh) else ""
