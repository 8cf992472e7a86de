# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole Blender scene, through its depsgraph."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...adaptive_drt.scene.cylinder_recognition import MeshCylinder
from ...adaptive_drt.scene.description import (
    EVERYWHERE,
    Camera,
    EnvironmentLight,
    Issue,
    Light,
    Material,
    Scene,
    SceneError,
    ShapeRecord,
    Vector,
    validate,
)
from ...adaptive_drt.scene.primitive_recognition import UNUSABLE, Facets, MeshSphere
from .animated import Animated, Key
from .ball_instances import BallInstances, Entry, Motions
from .camera import camera_of
from .checklist import ObjectIssues, instancer_of, scene_issues
from .clipping import clipped
from .closed_solids import ClosedSolid, closed_solid, is_closed, unseen_lights
from .components import Components, holds_smoke
from .copies import Copies, placed_shapes
from .deforming import Deforming, LayoutReader, Snapshot, mesh_of
from .exposure import brightened, exposed, exposure_of
from .hair import gather_curves, gather_particle_hair
from .hair_curves import Strands, are_straight
from .instances import key_of, name_of, owner_of, repetition_of
from .layer_filter import lets_through
from .light import Lamp, gives_light, is_seen, lamp_of, light_of
from .material import color_attribute, material_of, slot_material
from .mesh import (
    NO_SCALE,
    NOT_FINITE,
    Form,
    Layout,
    cylinder_of,
    is_stretched,
    layout_of,
    mesh_form,
    shapes_of,
    stays_cylinder,
    turns,
    wears_several,
)
from .open_tubes import OpenTubes
from .point_cloud import Cloud, cloud_of, colors_of, placed_points
from .shading import CUSTOM_BALL, FLAT_FACETS, facets_left_out, is_round, shading_left_out
from .shining import LIGHTS_NOTHING, MAX_SHINING_TRIANGLES, are_lights, shines, shining_lights
from .shutter import (
    Matrix,
    Shutter,
    Track,
    blurs,
    instance_matrices,
    matrix_of,
    shutter_of,
)
from .triangle_mesh import MeshForm, triangle_form, vanishes
from .visibility import LightLinks, linked, links_of, names_of, visibility_of
from .world import World, world_of

CAMERA_KEY = "camera"

SPHERE_FACES = 400
"""Number of faces of a flat-shaded mesh in the form of a sphere, below which its facets are meant
to be seen: the menu's UV sphere has 512, an icosphere of three subdivisions 320."""

SEVERAL = "it wears several materials; the one of most faces is used"
PASSING = "it is not there all the shutter; it is rendered still"


@dataclass(frozen=True)
class _Known:
    """A mesh that has been read: what it stands for, and what of it that lacks.

    sphere : what it stands for where it shines, if that is another form: meshes light nothing.
    cylinder : what it stands for where it stays one and does not shine.
    smooth : whether its faces are shaded as if they were bent.
    """

    form: Form | MeshForm
    left_out: tuple[str, ...] = ()
    layout: Layout | None = None
    sphere: MeshSphere | None = None
    cylinder: MeshCylinder | None = None
    smooth: bool = False


@dataclass(frozen=True)
class _Around:
    """What a world gives, and what of it is left out."""

    world: World
    issues: tuple[Issue, ...]

    @classmethod
    def of(cls, world: Any | None) -> _Around:
        issues: list[Issue] = []
        return cls(world_of(world, issues), tuple(issues))

    def enter(self, depsgraph: Any, gathered: _Export) -> Any | None:
        """Enter the world's light and its issues; returns the world."""
        gathered.issues.extend(self.issues)
        if self.world.light is not None:
            gathered.lights.append(self.world.light)
        gathered.lights.extend(self.world.suns)
        return _shown_world(depsgraph)


@dataclass
class _Export:
    """What has been gathered so far; meshes and materials are read once however often used.

    override : the material that the view layer puts on everything, if any.
    deforming : tells which meshes change during the shutter; None without motion blur.
    meshes, clouds, curves : by their pointers; hair of particle systems by those of their objects.
    straight_curves : whether hair is straight between its points.
    stretched : balls as meshes, for instances that are no balls.
    members : for each shape, the names by which collections hold its object.
    materials, colored : by their names; what points have colours of their own wear.
    entries : shapes, and copies of meshes, with those names, in the order of the instances; what
        they come to are the `shapes`.
    repeated : copies of what an instancer repeats, by `repetition_of`.
    links : what each light is linked to, by its name.
    owners : the objects to select, by the names of their instances.
    layer : the view layer, by whose collections shapes are holdouts.
    spheres : which meshes in the form of a sphere are rendered as spheres: see `export_scene`.
    solids : closed meshes that shine, with their own shapes.
    tubes : meshes in the form of tubes without ends.
    """

    opens: Snapshot | None = None
    closes: Snapshot | None = None
    deforming: Deforming | None = None
    override: Any | None = None
    shapes: list[ShapeRecord] = field(default_factory=list)
    members: list[frozenset[str]] = field(default_factory=list)
    entries: list[tuple[ShapeRecord | Copies, frozenset[str]]] = field(default_factory=list)
    repeated: dict[Hashable, Copies] = field(default_factory=dict)
    links: dict[str, LightLinks] = field(default_factory=dict)
    lights: list[Light] = field(default_factory=list)
    issues: list[Issue] = field(default_factory=list)
    meshes: dict[int, _Known] = field(default_factory=dict)
    stretched: dict[int, _Known] = field(default_factory=dict)
    clouds: dict[int, Cloud] = field(default_factory=dict)
    curves: dict[Hashable, tuple[Strands, MeshForm | None, str]] = field(default_factory=dict)
    straight_curves: bool = False
    known: dict[bytes, Form] = field(default_factory=dict)
    materials: dict[str, Material] = field(default_factory=dict)
    colored: dict[str, Material] = field(default_factory=dict)
    lamps: dict[str, Lamp] = field(default_factory=dict)
    owners: dict[str, str] = field(default_factory=dict)
    layer: Any | None = None
    spheres: str = "AUTO"
    solids: list[tuple[ClosedSolid, Sequence[ShapeRecord]]] = field(default_factory=list)
    tubes: OpenTubes = field(default_factory=OpenTubes)

    def called(self, instance: Any) -> str:
        """Return an instance's name, and keep whose it is."""
        name = name_of(instance)
        self.owners[name] = owner_of(instance).name
        return name

    def tell(self, name: str, *reasons: str, missing: bool = False) -> None:
        self.issues.extend(Issue(name, reason, missing) for reason in reasons)

    def scene(
        self,
        camera: Camera,
        lights: Sequence[Light],
        background: Vector,
        backdrop: EnvironmentLight | None,
        transparent: bool,
    ) -> Scene:
        """Return all that has been gathered, each issue once with the object to select."""
        linked_shapes = linked(
            list(zip(self.shapes, self.members, strict=True)), self.links.items()
        )
        shapes, issues = tuple(linked_shapes), tuple(self.issues)
        # the core would find the same faults, but does not know which object to select
        made = validate(
            Scene(camera, shapes, tuple(lights), background, transparent, issues, backdrop)
        )
        # an issue of a mesh or material is told once, however many instances share it
        return replace(made, issues=tuple(map(self._aimed, dict.fromkeys(made.issues))))

    def _aimed(self, issue: Issue) -> Issue:
        owner = self.owners.get(issue.name, issue.name)
        if issue.kind != "OBJECT" or issue.target or owner == issue.name:
            return issue
        return replace(issue, target=owner)

    def add_shapes(
        self, shapes: Sequence[ShapeRecord], instance: Any, name: str, closed: bool = False
    ) -> None:
        """Take in the shapes of an instance, and the lights that they are.

        closed : whether they are all faces of a mesh without gaps.
        """
        thing, instancer = instance.object, instancer_of(instance)
        seen, names = visibility_of(thing, instancer, self.layer), names_of(thing, instancer)
        if seen is not EVERYWHERE:
            shapes = [replace(shape, visibility=seen) for shape in shapes]
        if any(map(shines, shapes)) and gives_light(thing, instancer):
            shapes, lights, reason = shining_lights(shapes, name)
            solid = closed_solid(shapes, lights) if closed and seen.shadow else None
            if solid is not None and links_of(thing) == LightLinks():
                self.solids.append((solid, shapes))
            self.lights += lights
            self.links.update((light.name, links_of(thing)) for light in lights)
            self.tell(name, *((reason,) if reason else ()))
        self.entries += [(shape, names) for shape in shapes]

    def keeps_faces(self, instance: Any, form: MeshSphere) -> bool:
        """Whether a mesh in the form of a sphere, where it is stretched, is no ellipsoid.

        It stays a mesh where it shines, since no light has that form.
        """
        if not is_stretched(matrix_of(instance)):
            return False
        worn = self.material(slot_material(instance.object, form.slot))
        return any(worn.emission)

    def turning_form(self, thing: Any) -> MeshForm:
        """Return the triangles of a mesh that was read as another form, but turns or grows."""
        with mesh_of(thing) as mesh:
            found = self.with_faces(thing.data.as_pointer(), mesh).form
        assert isinstance(found, MeshForm)
        return found

    def with_faces(self, pointer: int, mesh: Any) -> _Known:
        """Return what is known of a mesh, with its triangles instead of the form that it has."""
        if pointer not in self.stretched:
            form = triangle_form(mesh)
            self.stretched[pointer] = replace(self.meshes[pointer], form=form, left_out=())
        return self.stretched[pointer]

    def add_copy(
        self,
        form: MeshForm,
        worn: dict[int, Material],
        track: Track,
        instance: Any,
        name: str,
        tube: MeshCylinder | None = None,
    ) -> None:
        """Take in a mesh where a track places it; tube : what it stands for where it can."""
        thing, instancer = instance.object, instancer_of(instance)
        seen, names = visibility_of(thing, instancer, self.layer), names_of(thing, instancer)
        shining = any(any(each.emission) for each in worn.values())
        if shining and gives_light(thing, instancer):
            self.tell(name, LIGHTS_NOTHING)
        copies = Copies(form, worn, seen, names, [(track, name)])
        if tube is not None and tube.is_open and not shining:
            self.tubes.found.append((copies, tube))
        self.entries.append((copies, names))
        if (key := repetition_of(instance)) is not None:
            self.repeated[key] = copies

    def add_repetition(self, instance: Any, key: Hashable) -> bool:
        """Whether an instance repeats a mesh that has been read, which then has another place.

        key : its `repetition_of`.
        """
        if key not in self.repeated:
            return False
        copies = self.repeated[key]
        name = copies.places[0][1]
        track = self.track(
            key_of(instance), matrix_of(instance), name, instance.object, instancer_of(instance)
        )
        if np.isfinite(track.middle).all():
            copies.places.append((track, name))
        else:
            self.tell(name, NOT_FINITE, missing=True)
        return True

    def place(self, camera: Camera) -> None:
        """Make the shapes of all entries."""
        by_names = any(links != LightLinks() for links in self.links.values())
        if not by_names:  # what hides a light may depend on the object
            self.issues += self.tubes.settle(self.entries, camera)
        self.shapes, self.members = placed_shapes(self.entries, by_names, self.issues)

    def motions(self) -> Motions | None:
        """Return what tells how instances move; None without motion blur."""
        if self.opens is None or self.closes is None or self.deforming is None:
            return None
        return Motions(self.opens, self.closes, self.deforming)

    def material(self, worn: Any | None) -> Material:
        """Return the Lambert material of what a face wears."""
        worn = self.override or worn
        key = worn.name_full if worn is not None else ""
        if key not in self.materials:
            self.materials[key] = material_of(worn, self.issues)
        return self.materials[key]

    def colored_material(self, worn: Any) -> Material:
        """Return the Lambert material of points that have its colour attribute."""
        if worn.name_full not in self.colored:
            self.colored[worn.name_full] = material_of(worn, self.issues, True)
        return self.colored[worn.name_full]

    def shining_form(
        self, mesh: Any, known: _Known, form: MeshForm, worn: dict[int, Material]
    ) -> Facets | MeshForm:
        """Return the flat faces of a mesh that shines, which are lights, or its own form.

        known : what the mesh stands for, as `_read` returns it, with all its faces as `form`.
        worn : materials by their slots; what is black as well looks alike however it is shaded.
        """
        if known.sphere is not None or (known.smooth and any(any(m.color) for m in worn.values())):
            return form
        found = mesh_form(mesh, layout_of(mesh), self.known, MAX_SHINING_TRIANGLES)
        shining = {slot for slot, each in worn.items() if any(each.emission)}
        return found if isinstance(found, Facets) and are_lights(found, shining) else form

    def lamp(self, light: Any) -> Lamp:
        """Return what the datablock of a light object says."""
        if light.name_full not in self.lamps:
            self.lamps[light.name_full] = lamp_of(light, self.issues)
        return self.lamps[light.name_full]

    def track(self, key: Hashable, middle: Matrix, name: str, *things: Any) -> Track:
        """Return the matrices of a thing, at the middle alone unless all `things` are to blur."""
        if self.opens is None or self.closes is None or not blurs(*things):
            return Track(middle)
        opens, closes = self.opens.matrix(key), self.closes.matrix(key)
        ends = [m for m in (opens, closes) if m is not None]
        if len(ends) < 2 or not all(np.isfinite(m).all() for m in ends):
            self.tell(name, PASSING)
            return Track(middle)
        return Track(middle, opens, closes)


def export_scene(
    depsgraph: Any,
    move: Callable[[float], None] | None = None,
    use_motion: bool = True,
    draws_strokes: bool = True,
    spheres: str = "AUTO",
) -> Scene:
    """Return a depsgraph's scene as the tracer's records; whatever is left out is in its issues.

    Parameters
    ----------
    depsgraph : an evaluated `bpy.types.Depsgraph`.
    move : moves the scene to a time in frames; the caller puts the user's own frame back. It
        is called only if the scene has motion blur and `use_motion` is set. None: no motion.
    use_motion : whether motion blur is wanted at all.
    draws_strokes : whether Blender draws Grease Pencil over the picture afterwards, as it does
        for F12. False: its strokes are listed.
    spheres : "SPHERES": all meshes in the form of a sphere are rendered as spheres. "FACES": none,
        nor any as a cylinder. "AUTO": those whose facets, normals or materials are not to be seen.

    Raises
    ------
    SceneError
        There is no camera, or it is not a perspective one.
    """
    scene = depsgraph.scene.original
    # at another time of the shutter a marker may have made another one active
    if (camera_object := scene.camera) is None:
        raise SceneError("The scene has no camera: add one, or make one active")
    # at each frame the evaluated layer is another one
    moves = use_motion and move is not None and depsgraph.view_layer_eval.use_motion_blur
    gathered, animated = _Export(spheres=spheres, layer=depsgraph.view_layer), Animated()
    if moves and move is not None and (shutter := shutter_of(scene)) is not None:
        _sample_ends(depsgraph, camera_object, move, shutter, gathered, animated)
    gathered.override = depsgraph.view_layer_eval.material_override
    camera = _camera(depsgraph, camera_object, gathered)
    gathered.issues.extend(scene_issues(depsgraph))
    around = _Around.of(_shown_world(depsgraph))
    _gather(depsgraph, gathered, draws_strokes, camera)
    world = around.enter(depsgraph, gathered)
    lens = camera_object.evaluated_get(depsgraph).data
    gathered.issues.extend(clipped(lens, camera, gathered.shapes, animated.clip(lens)))
    gathered.issues.extend(animated.changes(depsgraph, _used(gathered, lens, world)))
    exposure = exposure_of(depsgraph.scene_eval)
    unseen = unseen_lights(gathered.solids, gathered.shapes, camera)
    gathered.lights = [light for light in gathered.lights if id(light) not in unseen]
    behind = around.world.background, around.world.backdrop
    shining = exposed(gathered.lights, *behind, exposure)
    gathered.shapes = brightened(gathered.shapes, exposure)
    return gathered.scene(camera, *shining, bool(scene.render.film_transparent))


def _sample_ends(
    depsgraph: Any,
    camera: Any,
    move: Callable[[float], None],
    shutter: Shutter,
    gathered: _Export,
    animated: Animated,
) -> None:
    """Gather what the scene is like at both ends of the shutter."""
    samplers = (
        lambda: _instances_now(depsgraph, camera),
        lambda: animated.sample(depsgraph),
    )
    ends, _ = _ends(move, shutter, samplers)
    gathered.opens, gathered.closes = ends
    gathered.deforming = Deforming(*ends)


def _used(gathered: _Export, camera: Any, world: Any | None) -> set[Key]:
    """Return the datablocks whose settings are in the picture."""
    shining = (name for name, lamp in gathered.lamps.items() if not (lamp.missing or lamp.is_dark))
    return {
        ("CAMERA", camera.name_full),
        *(("WORLD", thing.name_full) for thing in (world,) if thing is not None),
        *(("MATERIAL", name) for name in (*gathered.materials, *gathered.colored)),
        *(("LIGHT", name) for name in shining),
    }


def _ends(
    move: Callable[[float], None], shutter: Shutter, samplers: Sequence[Callable[[], Any]]
) -> list[tuple[Any, Any]]:
    """Return what each sampler finds at both ends; leave the scene at the shutter's middle."""
    move(shutter.opens)
    opens = [sample() for sample in samplers]
    move(shutter.closes)
    closes = [sample() for sample in samplers]
    move(shutter.middle)
    return list(zip(opens, closes, strict=True))


def _instances_now(depsgraph: Any, camera: Any) -> Snapshot:
    """Return the places and the geometry of all instances as they are now."""
    rows: dict[Hashable, int] = {}
    places = instance_matrices(depsgraph)
    layouts: list[Layout | None] = [None] * (len(places) + 2)
    layout_of_thing = LayoutReader().layout
    for row, instance in enumerate(depsgraph.object_instances):
        thing = instance.object
        kind = thing.type
        if kind not in ("MESH", "LIGHT", "POINTCLOUD", "CURVES"):
            continue
        rows[key_of(instance)] = row
        if kind != "LIGHT":
            layouts[row] = layout_of_thing(thing)
    rows[CAMERA_KEY] = len(places)
    eye = matrix_of(camera.evaluated_get(depsgraph))
    return Snapshot(rows, np.concatenate([places, [eye, np.full((4, 4), np.nan)]]), layouts)


def _camera(depsgraph: Any, camera: Any, gathered: _Export) -> Camera:
    thing = camera.evaluated_get(depsgraph)
    track = gathered.track(CAMERA_KEY, matrix_of(thing), thing.original.name, thing)
    return camera_of(thing, track, depsgraph.scene.original.render, gathered.issues)


def _shown_world(depsgraph: Any) -> Any | None:
    """Return the world of the view layer, or None."""
    layer = depsgraph.view_layer_eval
    return (layer.world_override or depsgraph.scene_eval.world) if layer.use_sky else None


def _gather(depsgraph: Any, gathered: _Export, draws_strokes: bool, camera: Camera) -> None:
    layer, objects = depsgraph.view_layer_eval, ObjectIssues()
    components = Components(layer, draws_strokes)
    gathered.straight_curves = are_straight(depsgraph.scene.original)
    balls = BallInstances(depsgraph, gathered.motions())
    # an instance is valid only until the next one, so all of it is copied here
    for number, instance in enumerate(depsgraph.object_instances):
        key = repetition_of(instance)
        if key is not None and (
            balls.take(number, instance, key) or gathered.add_repetition(instance, key)
        ):
            continue
        thing = instance.object
        name = gathered.called(instance)
        gathered.tell(name, *components.left_out(instance), missing=True)
        if components.shows_hair(instance):
            gather_particle_hair(instance, name, gathered)
        shows = instance.show_self and lets_through(layer, thing.type)
        if not (shows and _has_surface(thing)):
            continue
        if thing.type == "LIGHT":
            objects.read(instance)
            _gather_light(instance, name, gathered)
            continue
        before = len(gathered.entries)
        if thing.type == "POINTCLOUD":
            _gather_points(instance, name, gathered)
        elif thing.type == "CURVES":
            gather_curves(instance, name, gathered)
        else:
            _gather_faces(instance, name, gathered)
        if len(gathered.entries) > before:  # of what is missing there is no more to tell
            objects.read(instance)
        if len(gathered.entries) == before + 1 and thing.type == "MESH":
            known = gathered.meshes[thing.data.as_pointer()]
            moves = gathered.opens is not None and blurs(thing, instancer_of(instance))
            first = Entry(before, gathered.entries[before][0], known.form)
            balls.start(number, instance, key, first, moves)
    gathered.issues.extend(balls.finish(gathered.entries, PASSING))
    gathered.place(camera)
    gathered.issues.extend(objects)


def _gather_light(instance: Any, name: str, gathered: _Export) -> None:
    thing, instancer = instance.object, instancer_of(instance)
    lights, seen = gives_light(thing, instancer), is_seen(thing, instancer)
    if not (lights or seen):
        return
    track = gathered.track(key_of(instance), matrix_of(instance), name, thing, instancer)
    light = light_of(thing, gathered.lamp(thing.data), track, name, gathered.issues)
    if light is not None:
        gathered.lights.append(light.met(seen=seen, lights_surfaces=lights))
        gathered.links[light.name] = links_of(thing)


def _has_surface(thing: Any) -> bool:
    """Whether an object is a light, hair, or has faces or points; Cycles shows no edges."""
    if thing.type != "MESH":
        return thing.type in ("LIGHT", "POINTCLOUD", "CURVES")
    return (len(thing.data.polygons) > 0 or thing.data.is_editmode) and not holds_smoke(thing)


def _gather_points(instance: Any, name: str, gathered: _Export) -> None:
    thing, points = instance.object, instance.object.data
    pointer = points.as_pointer()
    if pointer not in gathered.clouds:
        gathered.clouds[pointer] = cloud_of(points)
    cloud = gathered.clouds[pointer]
    if not cloud.radii.size:
        return
    if gathered.deforming is not None:
        gathered.tell(name, *gathered.deforming.reasons(instance, points, cloud.layout))
    worn = gathered.override or slot_material(thing, 0)  # Cycles takes no other slot
    attribute = color_attribute(worn)
    colors = None if attribute is None else colors_of(points, attribute)
    material = gathered.material(worn) if colors is None else gathered.colored_material(worn)
    track = gathered.track(
        key_of(instance), matrix_of(instance), name, thing, instancer_of(instance)
    )
    if not np.isfinite(track.middle).all():
        gathered.tell(name, NOT_FINITE, missing=True)
        return
    found = placed_points(cloud, colors, track, material, name, gathered.issues)
    gathered.add_shapes(found, instance, name)


def _gather_faces(instance: Any, name: str, gathered: _Export) -> None:
    thing = instance.object
    with mesh_of(thing) as mesh:
        if not len(mesh.polygons):
            return
        pointer = thing.data.as_pointer()
        if pointer not in gathered.meshes:
            gathered.meshes[pointer] = _read(mesh, gathered)
        known = gathered.meshes[pointer]
        if isinstance(known.form, MeshSphere) and gathered.keeps_faces(instance, known.form):
            known = gathered.with_faces(pointer, mesh)
        form = known.form
        if isinstance(form, str):
            gathered.tell(name, form, missing=True)
            return
        slots = np.unique(form.slot).tolist()
        worn = {slot: gathered.material(slot_material(thing, slot)) for slot in slots}
        shining = any(any(each.emission) for each in worn.values())
        if shining and isinstance(form, MeshForm):
            form = gathered.shining_form(mesh, known, form, worn)
        closed = shining and is_closed(mesh)
        if not shining:
            form = _tube(known, form, instance, name, gathered)
        gathered.tell(name, *known.left_out)
        if gathered.deforming is not None and known.layout is not None:
            gathered.tell(name, *gathered.deforming.reasons(instance, mesh, known.layout))
    if shining and known.sphere is not None and not is_stretched(matrix_of(instance)):
        form = replace(known.sphere, slot=slots[0])
        gathered.tell(name, FLAT_FACETS)
    track = gathered.track(
        key_of(instance), matrix_of(instance), name, thing, instancer_of(instance)
    )
    if not np.isfinite(track.middle).all():
        gathered.tell(name, NOT_FINITE, missing=True)
        return
    if not (isinstance(form, MeshForm) or shining) and turns(form, track):
        form = gathered.turning_form(thing)
        slots = np.unique(form.slot).tolist()
        worn = {slot: gathered.material(slot_material(thing, slot)) for slot in slots}
    if isinstance(form, MeshForm):
        if vanishes(form, track):
            gathered.tell(name, NO_SCALE, missing=True)
        else:
            gathered.add_copy(form, worn, track, instance, name, known.cylinder)
        return
    found = shapes_of(form, track, worn, name, gathered.issues)
    gathered.add_shapes(found, instance, name, closed)


def _tube(
    known: _Known, form: Form | MeshForm, instance: Any, name: str, gathered: _Export
) -> Form | MeshForm:
    """Return the cylinder that a mesh stands for where it stays one, else its form."""
    tube = known.cylinder
    if tube is None or tube.is_open:
        return form
    if not stays_cylinder(tube, matrix_of(instance)):
        return form
    gathered.tell(name, *facets_left_out(tube))
    return tube


def _read(mesh: Any, gathered: _Export) -> _Known:
    """Return what a mesh stands for, and what that lacks.

    What is no sphere and has many or smooth faces stands for itself. Under a world that lights from
    all sides every face hides some of it, so fewer are many.
    """
    layout = layout_of(mesh)
    form = mesh_form(mesh, layout, gathered.known)
    kept = layout if gathered.deforming is not None else None
    if not isinstance(form, MeshSphere) and form not in UNUSABLE and gathered.spheres != "FACES":
        tube = cylinder_of(mesh, layout)
        if tube is not None and is_round(mesh, tube):
            return replace(_read_faces(mesh, form, kept, gathered), cylinder=tube)
    return _read_faces(mesh, form, kept, gathered)


def _read_faces(mesh: Any, form: Form, kept: Layout | None, gathered: _Export) -> _Known:
    """Return what a mesh that is no cylinder stands for.

    form : what its vertices tell.  kept : the layout to keep.
    """
    if isinstance(form, str):
        if form in UNUSABLE:
            return _Known(form, (), kept)
        triangles = triangle_form(mesh)
        return _Known(triangles, (), kept, smooth=triangles.normals is not None)
    reason = shading_left_out(mesh, form)
    if isinstance(form, MeshSphere):
        several = gathered.override is None and wears_several(mesh)
        if _shows_faces(gathered.spheres, reason, several, len(mesh.polygons)):
            sphere = form if gathered.spheres == "AUTO" and not several else None
            return _Known(triangle_form(mesh), (), kept, sphere)
        left_out = (SEVERAL if several else "", reason)
        return _Known(form, tuple(reason for reason in left_out if reason), kept)
    found = triangle_form(mesh) if reason else form
    return _Known(found, (), kept, smooth=bool(reason))


def _shows_faces(spheres: str, reason: str, several: bool, faces: int) -> bool:
    """Whether a mesh in the form of a sphere is rendered with its faces.

    spheres : the rule, see `export_scene`.  reason : what a sphere would lack.
    several : whether its faces wear several materials.
    """
    if spheres != "AUTO":
        return spheres == "FACES"
    coarse = reason == FLAT_FACETS and faces < SPHERE_FACES
    return several or coarse or reason == CUSTOM_BALL
