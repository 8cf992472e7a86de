# SPDX-License-Identifier: GPL-3.0-or-later
"""Muted nodes, muted links, reroutes and groups: what the tracer reads is what Cycles shows.

The world's colour is what Cycles puts in a pixel that looks past everything, so each tree of nodes
below is compared with a picture of Cycles, of one sample and exact.
"""

from __future__ import annotations

import importlib

import bpy
import pytest
import things
from conftest import PACKAGE
from peer import render_cycles

OWN = (0.9, 0.8, 0.7, 1.0)
"""The Background node's own colour."""
FED = (0.1, 0.2, 0.3, 1.0)
OTHER = (0.4, 0.5, 0.6, 1.0)

ROUNDING = 1e-4
"""Relative: Cycles' weights of red, green and blue in a number differ that much from Rec. 709's."""


class Tree:
    """A world's nodes, or those of a group, with short ways to add more."""

    def __init__(self, tree):
        self.tree = tree

    def node(self, kind, mute=False):
        made = self.tree.nodes.new(kind)
        made.mute = mute
        return made

    def color(self, value=FED, mute=False):
        made = self.node("ShaderNodeRGB", mute)
        made.outputs[0].default_value = value
        return made.outputs[0]

    def number(self, value=0.5, mute=False):
        made = self.node("ShaderNodeValue", mute)
        made.outputs[0].default_value = value
        return made.outputs[0]

    def link(self, source, into, mute=False):
        self.tree.links.new(source, into).is_muted = mute

    def through(self, kind, source, name=0, mute=True):
        """The output of a node that gets `source`, or nothing."""
        made = self.node(kind, mute)
        if source is not None:
            self.link(source, made.inputs[name])
        return made.outputs[0]

    def group(self, fill, kind="NodeSocketColor", own=OTHER):
        """A group of one input and one output, whose nodes `fill` makes."""
        tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        for way in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Socket", in_out=way, socket_type=kind)
        fill(Tree(tree), tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput"))
        made = self.node("ShaderNodeGroup")
        made.node_tree = tree
        if own is not None:
            made.inputs[0].default_value = own
        return made


def _pass(tree, start, end):
    tree.link(start.outputs[0], end.inputs[0])


def _inner(tree, start, end):
    tree.link(tree.color(), end.inputs[0])


def _grouped(tree, group, source=None, mute=False, mute_link=False):
    group.mute = mute
    if source is not None:
        tree.link(source, group.inputs[0], mute_link)
    return group.outputs[0]


HUE = "ShaderNodeHueSaturation"

COLORS = {
    "nothing": lambda t: None,
    "a colour": lambda t: t.color(),
    "a muted colour": lambda t: t.color(mute=True),
    "a number": lambda t: t.number(),
    "a reroute": lambda t: t.through("NodeReroute", t.color(), mute=False),
    "a muted reroute": lambda t: t.through("NodeReroute", t.color()),
    "an empty reroute": lambda t: t.through("NodeReroute", None, mute=False),
    "a reroute of a muted colour": lambda t: t.through("NodeReroute", t.color(mute=True)),
    "a muted node": lambda t: t.through(HUE, t.color(), "Color"),
    "a muted node of nothing": lambda t: t.through(HUE, None),
    "a muted node of a muted colour": lambda t: t.through(HUE, t.color(mute=True), "Color"),
    "a muted number node": lambda t: t.through("ShaderNodeMath", t.color()),
    "a shader": lambda t: t.node("ShaderNodeEmission").outputs[0],
    "a group": lambda t: _grouped(t, t.group(_inner)),
    "a muted group": lambda t: _grouped(t, t.group(_inner), mute=True),
    "a muted group of a colour": lambda t: _grouped(t, t.group(_inner), t.color(OWN), mute=True),
    "a group's own value": lambda t: _grouped(t, t.group(_pass)),
    "a group that passes a colour": lambda t: _grouped(t, t.group(_pass), t.color()),
    "a group of a muted link": lambda t: _grouped(t, t.group(_pass), t.color(), mute_link=True),
    "a group of a muted colour": lambda t: _grouped(t, t.group(_pass), t.color(mute=True)),
    "a group of numbers": lambda t: _grouped(t, t.group(_pass, "NodeSocketFloat", 0.25), t.color()),
    "an empty group": lambda t: _grouped(t, t.group(lambda *_: None)),
    "a group in a group": lambda t: _grouped(
        t, t.group(lambda g, start, end: g.link(_grouped(g, g.group(_inner)), end.inputs[0]))
    ),
    "a group without an output": lambda t: _grouped(
        t, t.group(lambda g, start, end: g.tree.nodes.remove(end))
    ),
    "a group with a muted output": lambda t: _grouped(
        t, t.group(lambda g, start, end: (_inner(g, start, end), setattr(end, "mute", True)))
    ),
    "a group with a muted input": lambda t: _grouped(
        t, t.group(lambda g, start, end: (_pass(g, start, end), setattr(start, "mute", True)))
    ),
}


@pytest.fixture
def world(file):
    made = bpy.context.scene.world = bpy.data.worlds.new("World")
    made.use_nodes = True
    made.node_tree.nodes.clear()
    return made


def _background(tree):
    output = tree.node("ShaderNodeOutputWorld")
    made = tree.node("ShaderNodeBackground")
    tree.link(made.outputs[0], output.inputs["Surface"])
    made.inputs["Color"].default_value = OWN
    return made, output


def _compare(export, folder):
    scene = export()
    assert scene.background == pytest.approx(render_cycles(folder, samples=1)[0, 0], rel=ROUNDING)
    return things.reasons(scene)


@pytest.mark.parametrize("name", COLORS)
def test_a_colour_is_what_cycles_reads(export, world, tmp_path, name):
    tree = Tree(world.node_tree)
    node, _ = _background(tree)
    source = COLORS[name](tree)
    if source is not None:
        tree.link(source, node.inputs["Color"])
    told = _compare(export, tmp_path)
    assert not any("linked" in reason for reasons in told.values() for reason in reasons)


@pytest.mark.parametrize("source", ["color", "number"])
def test_a_number_is_what_cycles_reads(export, world, tmp_path, source):
    tree = Tree(world.node_tree)
    node, _ = _background(tree)
    tree.link(getattr(tree, source)(), node.inputs["Strength"])
    _compare(export, tmp_path)


def test_a_muted_link(export, world, tmp_path):
    tree = Tree(world.node_tree)
    node, _ = _background(tree)
    tree.link(tree.color(), node.inputs["Color"], mute=True)
    _compare(export, tmp_path)


SURFACES = {
    "a muted link": lambda t, n, o: setattr(t.tree.links[0], "is_muted", True),
    "a muted shader": lambda t, n, o: setattr(n, "mute", True),
    "a muted output": lambda t, n, o: setattr(o, "mute", True),
    "an emission": lambda t, n, o: t.link(
        t.node("ShaderNodeEmission").outputs[0], o.inputs["Surface"]
    ),
    "a muted mix": lambda t, n, o: t.link(
        t.through("ShaderNodeMixShader", n.outputs[0], 2), o.inputs["Surface"]
    ),
    "a group": lambda t, n, o: t.link(
        t.group(
            lambda g, start, end: g.link(g.node("ShaderNodeBackground").outputs[0], end.inputs[0]),
            "NodeSocketShader",
            None,
        ).outputs[0],
        o.inputs["Surface"],
    ),
    "no output": lambda t, n, o: t.tree.nodes.remove(o),
}


@pytest.mark.parametrize("name", SURFACES)
def test_a_surface_is_what_cycles_takes(export, world, tmp_path, name):
    tree = Tree(world.node_tree)
    SURFACES[name](tree, *_background(tree))
    _compare(export, tmp_path)


def test_a_muted_frame_mutes_nothing_in_it(export, world, tmp_path):
    tree = Tree(world.node_tree)
    node, _ = _background(tree)
    node.parent = tree.node("NodeFrame", mute=True)
    _compare(export, tmp_path)


def _by_camera_ray(tree, output, name="Is Camera Ray", kind="ShaderNodeMixShader"):
    """Two shaders of worlds, mixed by an output of a Light Path node."""
    mix, path = tree.node(kind), tree.node("ShaderNodeLightPath")
    for socket, color in ((mix.inputs[-2], FED), (mix.inputs[-1], OWN)):
        part = tree.node("ShaderNodeBackground")
        part.inputs["Color"].default_value, part.inputs["Strength"].default_value = color, 2.0
        tree.link(part.outputs[0], socket)
    if kind == "ShaderNodeMixShader":
        tree.link(path.outputs[name], mix.inputs[0])
    tree.link(mix.outputs[0], output.inputs["Surface"])


def test_a_world_that_is_seen_in_another_colour(export, world, tmp_path):
    tree = Tree(world.node_tree)
    _by_camera_ray(tree, _background(tree)[1])
    scene = export()
    assert scene.issues == ()
    assert scene.background == pytest.approx([2.0 * x for x in OWN[:3]])
    assert scene.lights[0].radiance == pytest.approx([2.0 * x for x in FED[:3]])
    assert _compare(export, tmp_path) == {}


def test_a_world_whose_strength_asks_for_camera_rays(export, world, tmp_path):
    tree = Tree(world.node_tree)
    node, _ = _background(tree)
    tree.link(tree.node("ShaderNodeLightPath").outputs["Is Camera Ray"], node.inputs["Strength"])
    scene = export()
    assert scene.background == pytest.approx(OWN[:3]) and scene.lights == ()
    assert _compare(export, tmp_path) == {}


def test_the_sum_of_two_worlds(export, world, tmp_path):
    tree = Tree(world.node_tree)
    _by_camera_ray(tree, _background(tree)[1], kind="ShaderNodeAddShader")
    both = [2.0 * (a + b) for a, b in zip(FED[:3], OWN[:3], strict=True)]
    assert export().lights[0].radiance == pytest.approx(both)
    assert _compare(export, tmp_path) == {}


def test_other_rays_are_named(export, world):
    """What Cycles makes of diffuse rays depends on how it samples the world."""
    tree = Tree(world.node_tree)
    _by_camera_ray(tree, _background(tree)[1], "Is Diffuse Ray")
    scene = export()
    assert scene.lights == ()
    assert "linked to its Factor is left out" in things.reasons(scene)['World "World"'][1]


def test_what_is_not_understood_is_named(export, world):
    tree = Tree(world.node_tree)
    node, _ = _background(tree)
    view = tree.node("ShaderNodeCameraData")
    view.name = "Eye"
    tree.link(view.outputs[0], node.inputs["Color"])
    scene = export()
    assert scene.background == pytest.approx(OWN[:3])
    why, reason = things.reasons(scene)['World "World"']
    assert 'its nodes are not tabulated: the Camera Data node "Eye" depends on the ray' in why
    assert 'Camera Data node "Eye" linked to its Color is left out' in reason
    assert "and the light that it throws" in reason and scene.lights == ()


@pytest.mark.parametrize("kind", ["Emission", "Background"])
def test_a_light_s_emitter_that_is_muted_is_dark(export, kind):
    lamp = things.light("POINT", shadow_soft_size=0.0)
    lamp.data.use_nodes = True
    tree = Tree(lamp.data.node_tree)
    tree.tree.nodes.clear()
    node, output = tree.node(f"ShaderNode{kind}"), tree.node("ShaderNodeOutputLight")
    tree.link(node.outputs[0], output.inputs["Surface"])
    assert any(export().lights[0].intensity)
    node.mute = True
    scene = export()
    assert scene.lights[0].intensity == (0.0, 0.0, 0.0) and scene.issues == ()


def test_a_muted_shader_of_a_material_is_black(export):
    shade = things.material(node="ShaderNodeBsdfDiffuse", Color=FED)
    next(n for n in shade.node_tree.nodes if n.outputs).mute = True
    things.uv_sphere().data.materials.append(shade)
    scene = export()
    assert scene.shapes[0].material.color == (0.0, 0.0, 0.0) and scene.issues == ()


def test_a_muted_bump_leaves_nothing_out(export):
    shade = things.material(node="ShaderNodeBsdfDiffuse", Color=FED)
    tree = Tree(shade.node_tree)
    diffuse = next(n for n in tree.tree.nodes if n.outputs)
    bump = tree.through("ShaderNodeBump", tree.node("ShaderNodeTexNoise").outputs[0], "Height")
    tree.link(bump, diffuse.inputs["Normal"])
    things.uv_sphere().data.materials.append(shade)
    assert export().issues == ()
    bump.node.mute = False
    assert "Normal is left out" in things.reasons(export())['Material "Material"'][0]


def test_sees_through_a_group_to_a_material_s_shader(export):
    shade = things.material(node="ShaderNodeBsdfDiffuse")
    tree = Tree(shade.node_tree)
    output = next(n for n in tree.tree.nodes if not n.outputs)

    def fill(inner, start, end):
        node = inner.node("ShaderNodeBsdfDiffuse")
        inner.tree.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
        inner.link(start.outputs["Tint"], node.inputs["Color"])
        inner.link(node.outputs[0], end.inputs[0])

    group = tree.group(fill, "NodeSocketShader", None)
    group.inputs["Tint"].default_value = FED
    tree.link(group.outputs[0], output.inputs["Surface"])
    things.uv_sphere().data.materials.append(shade)
    scene = export()
    assert scene.shapes[0].material.color == pytest.approx(FED[:3]) and scene.issues == ()


def test_a_group_s_term_that_is_left_out_is_told(export):
    shade = things.material()
    tree = Tree(shade.node_tree)
    output = next(n for n in tree.tree.nodes if not n.outputs)

    def fill(inner, start, end):
        node = inner.node("ShaderNodeBsdfPrincipled")
        inner.tree.interface.new_socket("Shine", in_out="INPUT", socket_type="NodeSocketFloat")
        inner.link(start.outputs["Shine"], node.inputs["Metallic"])
        node.inputs["Specular IOR Level"].default_value = 0.0
        inner.link(node.outputs[0], end.inputs[0])

    group = tree.group(fill, "NodeSocketShader", None)
    tree.link(group.outputs[0], output.inputs["Surface"])
    things.uv_sphere().data.materials.append(shade)
    assert export().issues == ()
    group.inputs["Shine"].default_value = 0.5
    assert "Metallic is left out" in things.reasons(export())['Material "Material"'][0]


def test_names_are_quoted(addon):
    nodes = importlib.import_module(f"{PACKAGE}.operators.export.nodes")
    assert nodes.called("Material", "Material") == 'Material "Material"'
