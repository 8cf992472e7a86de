# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks the RNA of cameras, lights, worlds, materials and shader nodes in the running Blender.

It needs no pytest, so a Blender that is a program can run it too: `report` returns what is wrong.
`package` is the add-on's name as it was loaded.
"""

from __future__ import annotations

import importlib
import warnings

import bpy

ROOTS = ("Camera", "PointLight", "AreaLight", "SpotLight", "SunLight", "Light", "World", "Material")
MODULES = ("camera_table", "light_table", "world_table", "material_table", "node_table")

STARTS = {
    "BOOLEAN": lambda _: (True, False),
    "ENUM": lambda p: [item.identifier for item in p.enum_items],
    "FLOAT": lambda p: ([0.5] * p.array_length,) if p.is_array else (0.5,),
    "INT": lambda p: (p.soft_min, p.soft_max),
}
"""Values to try of a property, by the RNA types."""

UNLINKABLE = {
    "ShaderNodeScript": "has no output before it has a script",
    "FunctionNodeInputMenu": "feeds menus alone, and those are inputs of nodes that are named",
    "NodeClosureOutput": "feeds nodes for closures alone, which are named",
    "NodeCombineBundle": "feeds nodes for bundles alone, which are named",
    "NodeJoinBundle": "feeds nodes for bundles alone, which are named",
}
"""Nodes that can feed no input of a shader, and why."""


def _module(package, name):
    return importlib.import_module(f"{package}.operators.export.{name}")


def _structs():
    """RNA structs by identifier: those of the roots, and what they point to."""
    found = {}
    for root in (*ROOTS, "Node", "NodeLink", "NodeSocket", "ShaderNodeTree"):
        rna = getattr(bpy.types, root).bl_rna
        found[rna.identifier] = rna
        for prop in rna.properties:
            if prop.type in ("POINTER", "COLLECTION"):
                found.setdefault(prop.fixed_type.identifier, prop.fixed_type)
    return found


def _tree():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        material = bpy.data.materials.new("Walk")
        material.use_nodes = True
    material.node_tree.nodes.clear()
    return material


def node_types():
    """Every type of node that a shader tree of this Blender may hold, and what they come from."""
    material, found = _tree(), []
    for name in dir(bpy.types):
        kind = getattr(bpy.types, name)
        if not (isinstance(kind, type) and issubclass(kind, bpy.types.Node)):
            continue
        if not issubclass(kind, bpy.types.ShaderNode):
            try:
                material.node_tree.nodes.new(name)
            except RuntimeError:  # a node of another kind of tree
                continue
        found.append(name)
    bpy.data.materials.remove(material)
    return found


def unclassed(package):
    """Yield the name of each property, type of node and input that is in no table."""
    structs = _structs()
    for module in MODULES:
        for identifier, table in _module(package, module).TABLES.items():
            if identifier in structs:
                for prop in structs[identifier].properties:
                    if prop.identifier not in table:
                        yield f"{identifier}.{prop.identifier}"
    yield from _unclassed_nodes(_module(package, "node_table"))


def _unclassed_nodes(tables):
    common = {p.identifier for p in bpy.types.Node.bl_rna.properties} | set(tables.NODE)
    for name in node_types():
        if name not in tables.TYPES:
            yield name
            continue
        for prop in getattr(bpy.types, name).bl_rna.properties:
            if prop.identifier not in common and prop.identifier not in tables.TYPES[name]:
                yield f"{name}.{prop.identifier}"
    material = _tree()
    for name in tables.RENDERED:
        for socket in material.node_tree.nodes.new(name).inputs:
            if socket.identifier not in tables.INPUTS[name]:
                yield f"{name}: input {socket.identifier}"
    bpy.data.materials.remove(material)


class _Stage:
    """A small scene: a ball of one material, a light, a world and a camera, each made anew."""

    def __init__(self, package):
        self._export = importlib.import_module(f"{package}.operators.export").export_scene
        self._listed = _module(package, "coverage").Listed
        self._package = package

    def clear(self):
        # unlike read_factory_settings it leaves the add-ons alone
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene = bpy.context.scene
        self.camera = bpy.data.cameras.new("Eye")
        scene.camera = self.link("Eye", self.camera)
        self.material = _tree()
        bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, -5))
        bpy.context.object.data.materials.append(self.material)
        self.world = scene.world = bpy.data.worlds.new("Sky")

    def link(self, name, data):
        thing = bpy.data.objects.new(name, data)
        bpy.context.scene.collection.objects.link(thing)
        return thing

    def owner(self, identifier):
        """A datablock's struct by its identifier, in force."""
        self.clear()
        if identifier.endswith("Light"):
            kind = identifier.removesuffix("Light").upper() or "POINT"
            lamp = bpy.data.lights.new("Lamp", kind)
            self.link("Lamp", lamp)
            return lamp
        return {
            "CyclesLightSettings": lambda: self.owner("AreaLight").cycles,
            "Camera": lambda: self.camera,
            "CameraDOFSettings": lambda: self.camera.dof,
            "World": lambda: self.world,
            "WorldMistSettings": lambda: self.world.mist_settings,
            "WorldLighting": lambda: self.world.light_settings,
            "CyclesWorldSettings": lambda: self.world.cycles,
            "CyclesVisibilitySettings": lambda: self.world.cycles_visibility,
            "Material": lambda: self.material,
            "CyclesMaterialSettings": lambda: self.material.cycles,
        }[identifier]()

    def issues(self):
        bpy.context.view_layer.update()
        return self._export(bpy.context.evaluated_depsgraph_get()).issues

    def tells(self, words, kinds):
        """Whether an issue of one of these kinds of datablocks has these words in its reason."""
        return any(words in i.reason and i.kind in kinds for i in self.issues())

    def entries(self, module):
        """Each listed entry of a module's tables: struct, property and entry."""
        structs = _structs()
        for identifier, table in _module(self._package, module).TABLES.items():
            for name, entry in table.items() if identifier in structs else ():
                if isinstance(entry, self._listed) and name in structs[identifier].properties:
                    yield structs[identifier], name, entry


def unlisted(package):
    """Yield the name of each listed setting, input and node whose line is not in the list."""
    stage = _Stage(package)
    for module in MODULES[:-1]:
        for rna, name, entry in stage.entries(module):
            yield from _untold(stage, rna, name, entry)
    tables = _module(package, "node_table")
    yield from _untold_inputs(stage, tables)
    yield from _untold_nodes(stage, tables)


def _untold(stage, rna, name, entry):
    prop, tried = rna.properties[name], 0
    values = list(STARTS[prop.type](prop))
    if entry.when is not None and prop.type == "FLOAT":
        values.append(prop.hard_min)  # listed on one side of a limit
    for value in values:
        if value in entry.neutral:
            continue
        owner = stage.owner(rna.identifier)
        setattr(owner, name, value)
        if entry.when is not None and not entry.when(owner):
            continue
        tried += 1
        told = stage.issues()
        said = entry.reason.partition("{")[0]
        words = [w for w in (said, entry.reason.partition("}")[2]) if w]
        if not any(
            all(w.format() in i.reason for w in words) and i.missing == entry.missing for i in told
        ):
            yield f"{rna.identifier}.{name} = {value}"
    if not tried:
        yield f"{rna.identifier}.{name}: no value to try"


def _untold_inputs(stage, tables):
    for kind, table in tables.INPUTS.items():
        for name, entry in table.items():
            if not isinstance(entry, stage._listed):
                continue
            stage.clear()
            world = kind == "ShaderNodeOutputWorld"
            node = _placed(stage, kind)
            socket = next((s for s in node.inputs if s.identifier == name), None)
            if socket is None:  # of another version
                continue
            if entry.neutral == tables.UNLINKED:
                source = "ShaderNodeVolumeScatter" if socket.type == "SHADER" else "ShaderNodeRGB"
                tree = socket.id_data
                tree.links.new(tree.nodes.new(source).outputs[0], socket)
            else:
                socket.default_value = 0.5
            if not stage.tells(entry.reason, ("WORLD",) if world else ("MATERIAL",)):
                yield f"{kind}: input {name}"


def _placed(stage, kind):
    """A node of a kind that is rendered, where it is rendered."""
    if kind == "ShaderNodeOutputWorld":
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            stage.world.use_nodes = True
        return next(n for n in stage.world.node_tree.nodes if n.bl_idname == kind)
    tree = stage.material.node_tree
    node = tree.nodes.new(kind)
    if node.outputs:
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(node.outputs[0], output.inputs["Surface"])
    return node


def _untold_nodes(stage, tables):
    """Feed the surface with each node that is left out, by way of a Diffuse BSDF if it shades not.

    The node is named in the list, or what it feeds is.
    """
    known = set(node_types())
    for kind in sorted(tables.LEFT_OUT):
        if kind not in known:  # of another version
            continue
        stage.clear()
        tree = stage.material.node_tree
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        node = tree.nodes.new(kind)
        node.name = "This one"
        source = next((s for s in node.outputs if s.enabled and not s.is_unavailable), None)
        if source is None:
            if kind not in UNLINKABLE:
                yield f"{kind}: no output to link"
            continue
        into = output.inputs["Surface"]
        if source.type != "SHADER":
            diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
            tree.links.new(diffuse.outputs[0], into)
            into = diffuse.inputs["Color"]
        link = tree.links.new(source, into)
        bpy.context.view_layer.update()
        if not link.is_valid:
            if kind not in UNLINKABLE:
                yield f"{kind}: its output makes no valid link"
            continue
        if not stage.tells('"This one"', ("MATERIAL",)):
            yield f"{kind}: not named"


def report(package):
    """Return all that is wrong, a line each; an empty list is well."""
    return [
        *(f"in no table: {name}" for name in unclassed(package)),
        *(f"set, and not in the list: {name}" for name in unlisted(package)),
    ]
