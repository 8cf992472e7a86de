# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair curves as objects: round tubes of their radii, with motion, instances and materials."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import things

STRAIGHT = [[(0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 2.0)], [(3.0, 0.0, 0.0), (4.0, 0.0, 0.0)]]


def hair(curves=STRAIGHT, radius=None, name="Hair"):
    """An object of hair curves; radius: one number for each point, or None for no attribute."""
    data = bpy.data.hair_curves.new(name)
    data.add_curves([len(each) for each in curves])
    points = np.concatenate([np.array(each) for each in curves]).astype(np.float32)
    data.position_data.foreach_set("vector", points.ravel())
    if radius is not None:
        values = np.broadcast_to(np.array(radius, dtype=np.float32), len(points)).copy()
        data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", values)
    return things.link(bpy.data.objects.new(name, data))


def test_straight_curves_are_tubes_of_their_radius(export, core):
    thing = hair(radius=0.25)
    thing.data.materials.append(things.matt("Red", 0.8, 0.1, 0.1))
    thing.location, thing.scale = (1.0, 2.0, 3.0), (1.0, 2.0, 1.0)
    scene = export()
    (shape,) = scene.shapes
    assert scene.issues == () and shape.name == "Hair"
    assert shape.materials[0].color == pytest.approx((0.8, 0.1, 0.1))
    x, y, z = shape.vertices[:, np.unique(shape.faces)] - [[1.0], [2.0], [3.0]]
    upright = x < 2.0
    corner = np.pi / 16 / np.sin(np.pi / 16) * 0.25
    np.testing.assert_allclose(np.hypot(x, y / 2.0)[upright], corner, rtol=1e-5)
    np.testing.assert_allclose(np.hypot(y / 2.0, z)[~upright], corner, rtol=1e-5)
    assert z[upright].max() == pytest.approx(2.0) and z[upright].min() == pytest.approx(0.0)
    assert x[~upright].max() == pytest.approx(4.0) and x[~upright].min() == pytest.approx(3.0)


def test_radius_without_an_attribute_is_that_of_cycles(export):
    hair()
    (shape,) = export().shapes
    wide = shape.vertices[:, shape.vertices[0] < 2.0]
    assert np.hypot(wide[0], wide[1]).max() == pytest.approx(0.005, rel=0.01)


def test_curves_bend_through_their_points(export):
    hair([[(0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (2.0, 0.0, 0.0)]], 0.1)
    (shape,) = export().shapes
    rings = shape.vertices.reshape(3, -1, 16).mean(axis=2)
    assert rings.shape[1] > 8
    assert np.linalg.norm(rings - [[1.0], [1.0], [0.0]], axis=0).min() < 1e-6


def test_linear_curves_do_not_bend(export):
    settings = bpy.context.scene.cycles_curves
    if "THICK_LINEAR" not in settings.bl_rna.properties["shape"].enum_items:
        pytest.skip("Cycles has no linear curves here")
    settings.shape = "THICK_LINEAR"
    hair([[(0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (2.0, 0.0, 0.0)]], 0.1)
    (shape,) = export().shapes
    assert shape.vertices.shape[1] == 3 * 16


def test_what_is_not_finite_is_told_and_empty_curves_are_nothing(export):
    hair([[(np.nan, 0.0, 0.0), (0.0, 0.0, 1.0)], [(3.0, 0.0, 0.0), (4.0, 0.0, 0.0)]], 0.1)
    hair([[(0.0, 0.0, 0.0)]], 0.1, name="Point")
    things.link(bpy.data.objects.new("None", bpy.data.hair_curves.new("None")))
    scene = export()
    (shape,) = scene.shapes
    assert shape.vertices[0].min() > 2.9
    assert [(i.name, i.missing) for i in scene.issues] == [("Hair", True)]


def test_motion_and_filters(export):
    thing = hair(radius=0.1)
    things.keyed(thing, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    bpy.context.scene.frame_set(5)
    bpy.context.scene.render.use_motion_blur = True
    scene = export()
    (shape,) = scene.shapes
    assert scene.issues == () and shape.motion.displacement[0] == pytest.approx(0.5, rel=1e-3)
    bpy.context.view_layer.use_strand = False
    assert not export().shapes


def test_instances_share_the_curves(export):
    carrier, thing = things.plane("Carrier", segments=6), hair(radius=0.1)
    things.scatter(carrier, thing)
    thing.hide_render = True
    scene = export()
    names = {shape.name for shape in scene.shapes}
    assert scene.issues == () and "Carrier/Hair" in names


def test_curves_with_a_bevel_come_as_meshes(export):
    data = bpy.data.curves.new("Wire", "CURVE")
    data.dimensions, data.bevel_depth, data.bevel_resolution = "3D", 0.1, 4
    spline = data.splines.new("NURBS")
    spline.points.add(3)
    for point, x in zip(spline.points, range(4), strict=True):
        point.co = (x, x % 2, 0.0, 1.0)
    things.link(bpy.data.objects.new("Wire", data))
    scene = export()
    assert scene.issues == () and {shape.name for shape in scene.shapes} == {"Wire"}
    assert sum(shape.faces.shape[1] for shape in scene.shapes) > 100
