# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials and the world, and what of them is left out."""

from __future__ import annotations

import bpy
import pytest
import things

COLOR = (0.1, 0.2, 0.3, 1.0)


def _worn(export, material):
    ball = things.uv_sphere()
    ball.data.materials.append(material)
    scene = export()
    (sphere,) = scene.shapes
    return sphere.material.color, things.reasons(scene)


def test_none_is_cycles_grey(export):
    assert _worn(export, None) == (pytest.approx((0.8, 0.8, 0.8)), {})


def test_diffuse(export):
    color, told = _worn(
        export, things.material(node="ShaderNodeBsdfDiffuse", Color=COLOR, Roughness=0.0)
    )
    assert color == pytest.approx(COLOR[:3]) and told == {}


def test_rough_diffuse_is_told(export):
    _, told = _worn(export, things.material(node="ShaderNodeBsdfDiffuse", Roughness=0.5))
    assert "Roughness is left out" in told['Material "Material"'][0]


def test_principled_without_its_other_terms(export):
    matt = things.material(Base_Color=COLOR, Specular_IOR_Level=0.0)
    color, told = _worn(export, matt)
    assert color == pytest.approx(COLOR[:3]) and told == {}


def test_principled_terms_are_told(export):
    rich = things.material(
        Base_Color=COLOR, Metallic=0.5, Coat_Weight=1.0, Alpha=0.5, Emission_Strength=2.0
    )
    color, told = _worn(export, rich)
    assert color == pytest.approx(COLOR[:3])
    (reason,) = told['Material "Material"']
    assert reason.startswith("Metallic, Specular, Coat, Alpha are left out")


def test_principled_default_has_specular(export):
    _, told = _worn(export, things.material())
    assert told['Material "Material"'] == ["Specular is left out: only its base colour is used"]


def test_linked_colour(export):
    textured = things.material(Base_Color=COLOR, Specular_IOR_Level=0.0)
    tree = textured.node_tree
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs["Color"], shader.inputs[0])
    color, told = _worn(export, textured)
    assert color == pytest.approx(COLOR[:3])
    assert "linked to its Base Color" in told['Material "Material"'][0]


def test_rgb_node_through_a_reroute(export):
    matt = things.material(node="ShaderNodeBsdfDiffuse", Roughness=0.0)
    tree = matt.node_tree
    shader = next(n for n in tree.nodes if n.type == "BSDF_DIFFUSE")
    source, bend = tree.nodes.new("ShaderNodeRGB"), tree.nodes.new("NodeReroute")
    source.outputs[0].default_value = COLOR
    tree.links.new(source.outputs[0], bend.inputs[0])
    tree.links.new(bend.outputs[0], shader.inputs["Color"])
    color, told = _worn(export, matt)
    assert color == pytest.approx(COLOR[:3]) and told == {}


def test_other_shaders_are_told(export):
    glass = things.material(node="ShaderNodeBsdfGlass")
    glass.diffuse_color = COLOR
    color, told = _worn(export, glass)
    assert color == pytest.approx(COLOR[:3])
    assert "Glass BSDF node is left out" in told['Material "Material"'][0]


def _mixture(kind, *nodes, factor=0.25):
    """A material of a Mix Shader or an Add Shader, and its tree."""
    mixture = things.material(node=kind)
    tree = mixture.node_tree
    mix = next(n for n in tree.nodes if n.bl_idname == kind)
    if kind == "ShaderNodeMixShader":
        mix.inputs[0].default_value = factor
    for socket, (name, inputs) in zip((mix.inputs[-2], mix.inputs[-1]), nodes, strict=True):
        part = tree.nodes.new(name)
        for key, value in inputs.items():
            part.inputs[key].default_value = value
        tree.links.new(part.outputs[0], socket)
    return mixture, tree, mix


RED = ("ShaderNodeBsdfDiffuse", {"Color": (0.8, 0.0, 0.0, 1.0), "Roughness": 0.0})
BLUE = ("ShaderNodeBsdfDiffuse", {"Color": (0.0, 0.0, 0.4, 1.0), "Roughness": 0.0})
GLOSS = ("ShaderNodeBsdfAnisotropic", {})


def test_a_mixture_of_diffuse_shaders(export):
    color, told = _worn(export, _mixture("ShaderNodeMixShader", RED, BLUE)[0])
    assert color == pytest.approx((0.6, 0.0, 0.1)) and told == {}


def test_a_sum_with_an_emission(export):
    glow = ("ShaderNodeEmission", {"Color": (0.0, 1.0, 0.0, 1.0), "Strength": 2.0})
    ball = things.uv_sphere()
    ball.data.materials.append(_mixture("ShaderNodeAddShader", RED, glow)[0])
    scene = export()
    assert scene.shapes[0].material.color == pytest.approx((0.8, 0.0, 0.0))
    assert scene.shapes[0].material.emission == pytest.approx((0.0, 2.0, 0.0))
    assert len(scene.lights) == 1 and things.reasons(scene) == {}


def test_what_is_mixed_and_not_rendered_is_told(export):
    color, told = _worn(export, _mixture("ShaderNodeMixShader", RED, GLOSS)[0])
    assert color == pytest.approx((0.6, 0.0, 0.0))
    (reason,) = told['Material "Material"']
    assert "Glossy BSDF node is left out, which is mixed with others" in reason


def test_what_has_no_weight_is_not_told(export):
    color, told = _worn(export, _mixture("ShaderNodeMixShader", RED, GLOSS, factor=0.0)[0])
    assert color == pytest.approx((0.8, 0.0, 0.0)) and told == {}


def test_a_mixture_of_nothing_that_is_rendered(export):
    glass = ("ShaderNodeBsdfGlass", {})
    mixture, _, _ = _mixture("ShaderNodeMixShader", GLOSS, glass)
    mixture.diffuse_color = COLOR
    color, told = _worn(export, mixture)
    assert color == pytest.approx(COLOR[:3])
    (reason,) = told['Material "Material"']
    assert "Glass BSDF node and Glossy BSDF node are left out; its viewport colour" in reason


def test_a_factor_that_is_not_constant_is_told(export):
    mixture, tree, mix = _mixture("ShaderNodeMixShader", RED, BLUE)
    tree.links.new(tree.nodes.new("ShaderNodeFresnel").outputs[0], mix.inputs[0])
    color, told = _worn(export, mixture)
    assert color == pytest.approx((0.6, 0.0, 0.1))
    (reason,) = told['Material "Material"']
    assert reason == ("the Fresnel node linked to its Factor is left out; its own value is used")


def test_mixtures_of_mixtures_and_of_nothing(export):
    mixture, tree, outer = _mixture("ShaderNodeMixShader", RED, BLUE, factor=0.5)
    inner = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(outer.inputs[2].links[0].from_socket, inner.inputs[0])
    tree.links.new(outer.inputs[1].links[0].from_socket, inner.inputs[1])
    tree.links.new(inner.outputs[0], outer.inputs[2])
    tree.links.remove(outer.inputs[1].links[0])
    color, told = _worn(export, mixture)
    assert color == pytest.approx((0.4, 0.0, 0.2)) and told == {}


def test_object_slot_and_several_materials(export):
    ball = things.uv_sphere()
    for name, shade in (("One", 0.1), ("Two", 0.9)):
        ball.data.materials.append(
            things.material(name, "ShaderNodeBsdfDiffuse", Color=(shade,) * 3 + (1.0,), Roughness=0)
        )
    for face in ball.data.polygons[:400]:
        face.material_index = 1
    # by default its faces are rendered, each with its own material: one part for each
    assert not any(hasattr(part, "radius") for part in export().shapes)
    bpy.context.scene.adaptive_drt.spheres = "SPHERES"
    scene = export()
    assert scene.shapes[0].material.color == pytest.approx((0.9, 0.9, 0.9))
    assert "several materials" in things.reasons(scene)["Sphere"][0]
    ball.material_slots[1].link = "OBJECT"
    ball.material_slots[1].material = bpy.data.materials["One"]
    assert export().shapes[0].material.color == pytest.approx((0.1, 0.1, 0.1))


def _world(color, strength):
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    node = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    node.inputs["Color"].default_value = color
    node.inputs["Strength"].default_value = strength
    bpy.context.scene.world = world
    return world


def test_world(export):
    assert export().background == (0.0, 0.0, 0.0) and export().lights == ()
    _world(COLOR, 2.0)
    scene = export()
    assert scene.background == pytest.approx((0.2, 0.4, 0.6))
    (sky,) = scene.lights
    assert sky.radiance == pytest.approx((0.2, 0.4, 0.6)) and sky.casts_shadow
    assert scene.issues == ()


def test_world_that_the_camera_does_not_see(export):
    world = _world(COLOR, 2.0)
    if not hasattr(world, "cycles_visibility"):  # Cycles is an add-on, and may be switched off
        return
    world.cycles_visibility.camera = False
    scene = export()
    assert scene.background == (0.0, 0.0, 0.0) and scene.issues == ()
    assert scene.lights[0].radiance == pytest.approx((0.2, 0.4, 0.6))
    world.cycles_visibility.diffuse = False
    assert export().lights == () and export().issues == ()


def test_world_that_is_only_seen(export):
    world = _world(COLOR, 2.0)
    if not hasattr(world, "cycles_visibility"):
        return
    world.cycles_visibility.diffuse = False
    scene = export()
    assert scene.background == pytest.approx((0.2, 0.4, 0.6))
    assert scene.lights == () and scene.issues == ()


def test_volume_without_a_surface(export):
    fog = things.material(node="ShaderNodeVolumeScatter")
    tree = fog.node_tree
    scatter = next(n for n in tree.nodes if n.outputs)
    output = next(n for n in tree.nodes if not n.outputs)
    tree.links.clear()
    tree.links.new(scatter.outputs[0], output.inputs["Volume"])
    color, told = _worn(export, fog)
    assert color == (0.0, 0.0, 0.0)
    reasons = told['Material "Material"']
    assert reasons[0] == "its volume is left out" and "its surface is shown black" in reasons[1]


def test_principled_that_reflects_nothing(export):
    """An IOR of 1 has no reflection in Cycles, whatever the Specular."""
    _, told = _worn(export, things.material(IOR=1.0))
    assert told == {}


def test_issues_say_which_datablock_they_are_about(export):
    things.uv_sphere().data.materials.append(things.material("Gold"))
    tree = _world(COLOR, 1.0).node_tree
    node = next(n for n in tree.nodes if n.type == "BACKGROUND")
    tree.links.new(tree.nodes.new("ShaderNodeCameraData").outputs[0], node.inputs["Color"])
    found = {(i.kind, i.target) for i in export().issues}
    assert found == {("MATERIAL", "Gold"), ("WORLD", "World")}


def test_black_world_leaves_nothing_out(export):
    _world((0.0, 0.0, 0.0, 1.0), 1.0)
    scene = export()
    assert scene.background == (0.0, 0.0, 0.0) and scene.issues == () and scene.lights == ()


def test_world_without_nodes(export):
    world = bpy.data.worlds.new("World")
    world.color = COLOR[:3]
    bpy.context.scene.world = world
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = False
        assert export().background == pytest.approx(COLOR[:3])
        assert export().lights[0].radiance == pytest.approx(COLOR[:3])


def test_names_in_the_list(export):
    _, told = _worn(export, things.material("Gold"))
    assert list(told) == ['Material "Gold"']


def test_transparent_film(export):
    assert export().transparent is False
    bpy.context.scene.render.film_transparent = True
    assert export().transparent is True
