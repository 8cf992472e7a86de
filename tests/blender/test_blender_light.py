# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights: units, sizes, directions, and those that are left out."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
import things

PI = math.pi


def test_square_area(export, core):
    lamp = things.light("AREA", energy=100.0, shape="SQUARE", size=2.0)
    lamp.location, lamp.scale = (0.0, 0.0, 4.0), (1.0, 3.0, 1.0)
    scene = export()
    (light,) = scene.lights
    assert isinstance(light, core.QuadLight) and scene.issues == ()
    assert light.center == pytest.approx((0.0, 0.0, 4.0))
    # power over pi times the area, the scale included: 2 x 6 m
    assert light.radiance == pytest.approx((100.0 / (PI * 12.0),) * 3)
    assert np.cross(light.half_u, light.half_v) == pytest.approx((0.0, 0.0, -3.0))


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (1, 1, -1), (-1, -1, -1)])
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.4, -1.2, 2.5)])
def test_area_emits_along_its_own_minus_z(export, scale, turn):
    lamp = things.light("AREA", shape="RECTANGLE", size=1.0, size_y=0.5)
    lamp.scale, lamp.rotation_euler = scale, turn
    (light,) = export().lights
    forward = -np.array(lamp.matrix_world)[:3, 2]
    facing = np.cross(light.half_u, light.half_v)
    assert facing / np.linalg.norm(facing) == pytest.approx(forward, abs=1e-6)
    assert np.linalg.norm(facing) == pytest.approx(0.125)


def test_factors(export):
    lamp = things.light("AREA", energy=10.0, shape="SQUARE", size=1.0, color=(1.0, 0.5, 0.25))
    gain = 1.0
    if hasattr(lamp.data, "exposure"):
        lamp.data.exposure, gain = 2.0, 4.0
    (light,) = export().lights
    assert light.radiance == pytest.approx(tuple(gain * 10.0 / PI * c for c in (1, 0.5, 0.25)))
    if hasattr(lamp.data, "normalize"):
        lamp.data.size, lamp.data.normalize = 3.0, False
        (light,) = export().lights
        assert light.radiance[0] == pytest.approx(gain * 10.0 / PI)
    if hasattr(lamp.data, "use_temperature"):
        lamp.data.use_temperature, lamp.data.temperature = True, 3000.0
        warm = lamp.data.temperature_color
        (light,) = export().lights
        assert light.radiance[2] == pytest.approx(gain * 10.0 / PI * 0.25 * warm[2])


def test_point(export, core):
    things.light("POINT", energy=40.0, shadow_soft_size=0.0)
    (light,) = export().lights
    assert isinstance(light, core.PointLight)
    assert light.intensity == pytest.approx((10.0 / PI,) * 3)


@pytest.mark.parametrize("soft", [True, False])
def test_point_with_radius(export, core, soft):
    lamp = things.light("POINT", energy=40.0, shadow_soft_size=0.5, use_soft_falloff=soft)
    lamp.scale = (3.0, 3.0, 3.0)  # does not change a point light
    (light,) = export().lights
    assert type(light) is (core.DiskLight if soft else core.SphereLight)
    assert light.radius == pytest.approx(0.5)
    assert light.radiance == pytest.approx((40.0 / (4.0 * PI**2 * 0.25),) * 3)


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.4, -1.2, 2.5)])
@pytest.mark.parametrize("scale", [(1, 1, 1), (0, 2, 1), (1, 1, -1)])
def test_sun(export, core, scale, turn):
    """Neither its place nor its size matters; it shines along its own -Z, mirrored or not."""
    lamp = things.light("SUN", energy=3.0, angle=0.2, color=(1.0, 0.5, 0.25), use_shadow=False)
    lamp.location, lamp.scale, lamp.rotation_euler = (5.0, 6.0, -7.0), scale, turn
    scene = export()
    (light,) = scene.lights
    assert isinstance(light, core.SunLight) and scene.issues == ()
    assert light.irradiance == pytest.approx((3.0, 1.5, 0.75))
    assert light.angle == pytest.approx(0.2) and not light.casts_shadow
    assert light.direction == pytest.approx(tuple(-lamp.matrix_world.col[2].xyz), abs=1e-6)


@pytest.mark.parametrize("angle, factor", [(0.0, 1.0), (0.5, PI * math.sin(0.25) ** 2), (PI, PI)])
def test_the_strength_of_a_sun_that_is_not_normalized(export, angle, factor):
    """Measured in Cycles: a radiance, and of a point the irradiance."""
    lamp = things.light("SUN", energy=2.0, angle=angle)
    if hasattr(lamp.data, "normalize"):
        lamp.data.normalize = False
        (light,) = export().lights
        assert light.irradiance == pytest.approx((2.0 * factor,) * 3)
        assert light.angle == pytest.approx(angle) and light.angle <= PI


def test_the_exposure_of_the_film_brightens_suns(export):
    things.light("SUN", energy=2.0)
    if hasattr(bpy.context.scene, "cycles"):
        bpy.context.scene.cycles.film_exposure = 3.0
        (light,) = export().lights
        assert light.irradiance == pytest.approx((6.0, 6.0, 6.0))


def test_a_sun_without_direction_gives_no_light(export):
    things.light("SUN", "Flat").scale = (1.0, 1.0, 0.0)
    scene = export()
    (issue,) = scene.issues
    assert scene.lights == () and not issue.missing
    assert "scale along its Z axis is zero" in issue.reason


def test_a_sun_that_turns_during_the_shutter_is_told(export):
    still, turning = things.light("SUN", "Still"), things.light("SUN", "Turning")
    things.keyed(still, "location", (0.0, 0.0, 0.0), (9.0, 0.0, 0.0))
    things.keyed(turning, "rotation_euler", (0.0, 0.0, 0.0), (0.8, 0.0, 0.0))
    bpy.context.scene.render.use_motion_blur = True
    bpy.context.scene.frame_set(6)
    scene = export()
    assert list(things.reasons(scene)) == ["Turning"]
    assert "turns during the shutter" in things.reasons(scene)["Turning"][0]
    (light,) = (light for light in scene.lights if light.name == "Turning")
    assert light.direction == pytest.approx((0.0, math.sin(0.4), -math.cos(0.4)), abs=2e-2)
    assert all(light.motion is None for light in scene.lights)


def test_round_area_lights(export, core):
    disk = things.light("AREA", "Disk", energy=2.0, shape="DISK", size=1.0, size_y=9.0)
    disk.scale = (2.0, 3.0, 1.0)
    things.light("AREA", "Ellipse", energy=2.0, shape="ELLIPSE", size=1.0, size_y=3.0)
    scene = export()
    one, two = sorted(scene.lights, key=lambda light: light.name)
    assert type(one) is type(two) is core.EllipseLight and scene.issues == ()
    for light, x, y in ((one, 2.0, 3.0), (two, 1.0, 3.0)):
        assert light.half_u == pytest.approx((x / 2.0, 0.0, 0.0))
        assert light.half_v == pytest.approx((0.0, -y / 2.0, 0.0))
        # P / (pi A), of A = pi x y / 4
        assert light.radiance[0] == pytest.approx(2.0 / (PI * PI * x * y / 4.0))


SPOT = {"energy": 4.0 * PI, "spot_size": 0.8, "spot_blend": 0.25}


def test_a_spot_without_radius(export):
    lamp = things.light("SPOT", shadow_soft_size=0.0, **SPOT)
    lamp.location, lamp.rotation_euler, lamp.scale = (1, 2, 3), (0.0, PI / 2.0, 0.0), (2, 2, -2)
    (light,) = export().lights
    assert light.intensity == pytest.approx((1.0, 1.0, 1.0)) and light.radius == 0.0
    assert light.center == pytest.approx((1.0, 2.0, 3.0))
    assert light.direction == pytest.approx((2.0, 0.0, 0.0), abs=1e-6)
    assert light.angle == pytest.approx(0.8) and light.blend == pytest.approx(0.25)


@pytest.mark.parametrize("soft", [True, False])
def test_a_spot_with_a_radius(export, soft):
    things.light("SPOT", shadow_soft_size=0.5, use_soft_falloff=soft, **SPOT)
    scene = export()
    (light,) = scene.lights
    # as that of a point light: of its radiance P / (4 pi^2 r^2), seen as a disk of pi r^2
    assert light.intensity == pytest.approx((1.0, 1.0, 1.0))
    assert light.radius == 0.5 and light.faces is soft and scene.issues == ()


@pytest.mark.parametrize("scale", [(1.0, 1.0, 2.0), (1.0, 3.0, 1.0), (-1.0, 2.0, 1.0)])
def test_a_spot_that_is_scaled_unevenly_has_a_frame(export, scale):
    lamp = things.light("SPOT", "Odd", **SPOT)
    lamp.scale, lamp.rotation_euler = scale, (0.4, 0.2, 0.1)
    scene = export()
    (light,) = scene.lights
    assert scene.issues == ()
    linear = np.array(lamp.matrix_world)[:3, :3]
    assert np.array(light.frame) @ linear == pytest.approx(np.eye(3), abs=1e-6)
    assert light.direction == pytest.approx(tuple(-linear[:, 2]), abs=1e-6)


def test_a_spot_without_a_depth_is_left_out(export):
    things.light("SPOT", "Odd", **SPOT).scale = (1.0, 0.0, 1.0)
    scene = export()
    (issue,) = scene.issues
    assert scene.lights == () and issue.missing and "left out" in issue.reason


def test_a_spot_that_turns_is_told(export):
    turning, rolling = (things.light("SPOT", name) for name in ("Turning", "Rolling"))
    things.keyed(turning, "rotation_euler", (0.0, 0.0, 0.0), (0.8, 0.0, 0.0))
    things.keyed(rolling, "rotation_euler", (0.0, 0.0, 0.0), (0.0, 0.0, 0.8))
    bpy.context.scene.render.use_motion_blur = True
    bpy.context.scene.frame_set(6)
    assert list(things.reasons(export())) == ["Turning"]


def test_without_shadow(export):
    things.light("POINT", use_shadow=False)
    (light,) = export().lights
    assert light.casts_shadow is False


def test_emission_nodes_multiply(export):
    lamp = things.light("POINT", energy=4.0 * PI, shadow_soft_size=0.0)
    lamp.data.use_nodes = True
    node = next(n for n in lamp.data.node_tree.nodes if n.type == "EMISSION")
    node.inputs["Strength"].default_value = 2.0
    node.inputs["Color"].default_value = (1.0, 0.5, 0.0, 1.0)
    (light,) = export().lights
    assert light.intensity == pytest.approx((2.0, 1.0, 0.0))


@pytest.mark.parametrize(
    "kind, settings, said",
    [
        ("AREA", {"size": 0.0}, "size is zero"),
    ],
)
def test_left_out(export, kind, settings, said):
    things.light(kind, "Odd", **settings)
    things.light("POINT", "Kept")
    scene = export()
    assert [light.name for light in scene.lights] == ["Kept"]
    assert said in things.reasons(scene)["Odd"][0]


def test_zero_scale(export):
    things.light("AREA", "Flat").scale = (0.0, 1.0, 1.0)
    scene = export()
    assert scene.lights == () and "zero" in things.reasons(scene)["Flat"][0]


def test_a_depth_of_zero_gives_no_light(export):
    """Cycles renders none of it, and no parent shears it."""
    things.light("AREA", "Flat").scale = (1.0, 1.0, 0.0)
    scene = export()
    (issue,) = scene.issues
    assert scene.lights == () and not issue.missing
    assert "scale along its Z axis is zero" in issue.reason and "shear" not in issue.reason


@pytest.mark.parametrize("degrees", [0.0, 0.5, 1.5])
def test_a_narrow_spread_is_a_beam(export, degrees):
    things.light("AREA", "Lamp", spread=math.radians(degrees))
    scene = export()
    (light,) = scene.lights
    assert light.spread == pytest.approx(math.radians(max(degrees, 1.0)), rel=1e-5)
    told = things.reasons(scene).get("Lamp", [])
    assert (degrees >= 1.0) == (told == []) and all("as one of 1°" in reason for reason in told)
    assert not any(issue.missing for issue in scene.issues)


@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
def test_a_sheared_light_is_a_parallelogram_of_its_power(export, shape):
    parent = things.link(bpy.data.objects.new("Parent", None))
    parent.scale = (1.0, 3.0, 1.0)
    lamp = things.light("AREA", "Lamp", energy=100.0, shape=shape, size=1.0, size_y=2.0)
    lamp.parent, lamp.rotation_euler = parent, (0.0, 0.0, 0.5)
    scene = export()
    (light,) = scene.lights
    told = [issue for issue in scene.issues if "shear" in issue.reason and not issue.missing]
    # Cycles' picture of the ellipse is the same
    assert len(told) == len(scene.issues) == int(shape == "RECTANGLE")
    assert abs(np.dot(light.half_u, light.half_v)) > 0.1
    area = np.linalg.norm(np.cross(light.half_u, light.half_v)) * (4 if shape[0] == "R" else PI)
    assert light.radiance[0] * PI * area == pytest.approx(100.0, rel=1e-5)
    assert np.cross(light.half_u, light.half_v)[2] < 0.0


def test_a_shear_along_its_normal_is_not_told(export):
    """Cycles takes the rectangle alone from the matrix; of a disk, the normal as well."""
    parent = things.link(bpy.data.objects.new("Parent", None))
    parent.scale = (1.0, 1.0, 2.0)
    lamp = things.light("AREA", "Lamp", shape="SQUARE")
    lamp.parent, lamp.rotation_euler = parent, (0.5, 0.0, 0.0)
    assert export().issues == ()
    lamp.data.shape = "DISK"
    assert "shear" in export().issues[0].reason


def test_a_portal_gives_no_light_and_no_line(export):
    lamp = things.light("AREA")
    if hasattr(lamp.data, "cycles"):  # Cycles is an add-on, and may be switched off
        lamp.data.cycles.is_portal = True
        scene = export()
        assert scene.lights == () and scene.issues == ()


def test_a_light_s_nodes_that_are_left_out_are_told_once(export):
    lamp = things.light("POINT", "Lamp", energy=4.0 * PI, shadow_soft_size=0.0)
    things.link(bpy.data.objects.new("Second", lamp.data))
    lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    node = next(n for n in tree.nodes if n.type == "EMISSION")
    falloff = tree.nodes.new("ShaderNodeLightFalloff")
    tree.links.new(falloff.outputs["Linear"], node.inputs["Strength"])
    scene = export()
    assert [light.intensity for light in scene.lights] == [pytest.approx((1.0, 1.0, 1.0))] * 2
    (issue,) = scene.issues
    assert (issue.name, issue.kind, issue.target) == ('Light "Lamp"', "LIGHT", "Lamp")
    assert "Light Falloff node linked to its Strength is left out" in issue.reason


def test_a_light_that_falls_off_as_all_do_is_as_strong_as_its_nodes_say(export):
    lamp = things.light("POINT", energy=4.0 * PI, shadow_soft_size=0.0)
    lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    node = next(n for n in tree.nodes if n.type == "EMISSION")
    falloff = tree.nodes.new("ShaderNodeLightFalloff")
    falloff.inputs["Strength"].default_value = 3.0
    tree.links.new(falloff.outputs["Quadratic"], node.inputs["Strength"])
    scene = export()
    assert scene.lights[0].intensity == pytest.approx((3.0, 3.0, 3.0)) and scene.issues == ()
    falloff.inputs["Smooth"].default_value = 1.0
    (issue,) = export().issues
    assert "Light Falloff node linked to its Strength is left out" in issue.reason


def test_radiometry_against_flux(addon):
    """Flux from radiance, by integration, is the light's power: exitance pi L over its surface."""
    import importlib

    radiometry = importlib.import_module(f"{addon.__name__}.adaptive_drt.scene.units")
    power = radiometry.light_power(7.0, (1.0, 1.0, 1.0))
    radiance = radiometry.sphere_radiance(power, 0.3)[0]
    assert radiance * PI * 4.0 * PI * 0.3**2 == pytest.approx(7.0, rel=1e-14)
    assert radiometry.area_radiance(power, 0.7)[0] * PI * 0.7 == pytest.approx(7.0, rel=1e-14)
    assert radiometry.point_intensity(power)[0] * 4.0 * PI == pytest.approx(7.0, rel=1e-14)
