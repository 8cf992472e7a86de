# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of meshes of triangles: against the same surfaces as quads, against the oracle, and
without light that leaks through shared edges."""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Material,
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    SphereLight,
    Triangle,
    Triangles,
)
from adaptive_drt.scene.settings import Settings
from oracle.converged import relative_rmse
from oracle.kept import converged_color, masks
from oracle.picture import reference
from random_scenes import look_at, random_scene

FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.8, 0.8)))
LAMP = QuadLight((1.0, -1.0, 5.0), (0.9, 0.0, 0.0), (0.0, -0.6, 0.0), (12.0, 11.0, 9.0))
BULB = SphereLight((-2.0, -1.5, 4.0), 0.5, (20.0, 15.0, 10.0))
DOT = PointLight((2.0, -2.0, 4.0), (40.0, 40.0, 40.0))
CAMERA = look_at((0.5, -6.0, 3.5), (0.0, 0.0, 0.6), resolution=(48, 32))
ROUNDING = 1e-9
"""Difference of pictures, as a fraction of their mean, that only rounding makes."""


DARK = 1e-11
"""Radiance that rounding leaves of lights whose radiance is up to 50."""


def mesh(vertices, faces, motion=None, color=(0.7, 0.6, 0.5)):
    """Triangles of a mesh of vertices (n, 3) and faces (t, 3)."""
    corners = np.array(vertices, dtype=float)[np.array(faces)].transpose(1, 2, 0)
    slot = np.zeros(len(faces), dtype=np.int64)
    return Triangles(np.ascontiguousarray(corners), slot, (Material(color),), motion)


def cube(size=1.0, middle=(0.0, 0.0, 0.8), turn=True):
    """Quads (corner, u, v) of a turned cube."""
    rng = np.random.default_rng(0)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] if turn else np.eye(3)
    axes = size * axes.T
    found = []
    for k in range(3):
        u, v, w = np.roll(axes, -k, axis=0)
        for side in (-0.5, 0.5):
            found.append((np.array(middle) + side * w - (u + v) / 2.0, u, v))
    return found


def quads_of(sides, motion=None, color=(0.7, 0.6, 0.5)):
    return [Quad(*(tuple(x.tolist()) for x in side), Material(color), motion) for side in sides]


def halves_of(sides, motion=None):
    """The same surfaces as two triangles each."""
    found = [[half for q, u, v in sides for half in ((q, q + u, q + u + v), (q, q + u + v, q + v))]]
    corners = np.array(found[0]).transpose(1, 2, 0)
    slot = np.zeros(2 * len(sides), dtype=np.int64)
    return Triangles(corners, slot, (Material((0.7, 0.6, 0.5)),), motion)


def dented_ball(middle=(0.0, 0.0, 0.0), cuts=1):
    """Vertices and faces of an icosphere whose vertices are moved in and out."""
    g = 0.5 * (1.0 + 5.0**0.5)
    points = [
        p for a in (-1.0, 1.0) for b in (-g, g) for p in ((0.0, a, b), (a, b, 0.0), (b, 0.0, a))
    ]
    points = [np.array(p) for p in points]
    near = [[k for k, q in enumerate(points) if 1.9 < np.linalg.norm(p - q) < 2.1] for p in points]
    faces = [
        (a, b, c) for a in range(12) for b in near[a] for c in near[b] if a < b < c and c in near[a]
    ]
    for _ in range(cuts):
        middles, smaller = {}, []
        for face in faces:
            half = []
            for a, b in zip(face, face[1:] + face[:1], strict=True):
                key = (min(a, b), max(a, b))
                if key not in middles:
                    middles[key] = len(points)
                    points.append((points[a] + points[b]) / 2.0)
                half.append(middles[key])
            (a, b, c), (ab, bc, ca) = face, half
            smaller += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = smaller
    rng = np.random.default_rng(1)
    unit = np.array([p / np.linalg.norm(p) for p in points])
    return np.array(middle) + unit * rng.uniform(0.75, 1.25, (len(points), 1)), faces


@pytest.mark.parametrize("light", [LAMP, BULB, DOT], ids=["quad", "sphere", "point"])
@pytest.mark.parametrize("method", ["EXACT", "RAYS"])
def test_a_cube_of_triangles_is_a_cube_of_quads(light, method):
    sides = cube()
    few = Settings(method=method, tolerance=1e-3, light_rays=64, pixel_rays=64, threads=2)
    whole, halves = (
        render_image(Scene(CAMERA, (FLOOR, *box), (light,)), few)
        for box in (quads_of(sides), [halves_of(sides)])
    )
    assert relative_rmse(halves.color, whole.color) < (2e-3 if method == "EXACT" else 0.02)
    # pixels are the same to rounding where neither has anything to integrate, nor is interpolated
    plain = ~(whole.mask.any(axis=0) | halves.mask.any(axis=0))
    off = np.abs(halves.color - whole.color)[:, plain].max() / whole.color.mean()
    assert plain.mean() > 0.2 and off < (1e-2 if method == "EXACT" else ROUNDING)


@pytest.mark.parametrize("light", [LAMP, DOT], ids=["quad", "point"])
def test_the_mask_of_a_cube_of_triangles_leaves_nothing_out(light):
    """Edges within a side may be flagged, and are none in the picture."""
    camera = replace(CAMERA, resolution=(36, 24))
    scene = Scene(camera, (FLOOR, halves_of(cube())), (light,))
    mask = render_image(scene, Settings(method="RAYS", light_rays=2, threads=2)).mask
    truth = masks(replace(scene, shapes=(FLOOR, *quads_of(cube()))))
    assert not (truth & ~mask).any()


def test_moving_triangles_are_moving_quads():
    sides, motion = cube(), Motion((0.8, 0.3, 0.2))
    few = Settings(tolerance=3e-3, threads=2)
    camera = replace(CAMERA, resolution=(24, 16))
    whole, halves = (
        render_image(Scene(camera, (FLOOR, *box), (LAMP,)), few)
        for box in (quads_of(sides, motion), [halves_of(sides, motion)])
    )
    assert relative_rmse(halves.color, whole.color) < 6e-3


PYRAMID = (
    [(-1.0, -1.0, 0.2), (1.0, -1.0, 0.2), (1.0, 1.0, 0.2), (-1.0, 1.0, 0.2), (0.1, 0.0, 1.8)],
    [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4), (0, 2, 1), (0, 3, 2)],
)


@pytest.mark.parametrize("light", [LAMP, BULB], ids=["quad", "sphere"])
@pytest.mark.parametrize(
    "motion",
    [
        pytest.param(None, id="still"),
        pytest.param(Motion((0.6, 0.2, 0.3)), id="moving", marks=pytest.mark.slow),
    ],
)
def test_the_soft_shadow_of_a_pyramid(light, motion):
    """Against the oracle, which has its own code for triangles."""
    camera = replace(CAMERA, resolution=(24, 16))
    pyramid = mesh(*PYRAMID, motion)
    scene = Scene(camera, (FLOOR, pyramid), (light,))
    pixels = np.random.default_rng(0).integers(
        (0, 0), camera.resolution, (100 if motion is None else 30, 2)
    )
    # the oracle's shapes must not share edges: here each triangle is a millionth larger
    middle = pyramid.vertices.mean(axis=0)
    larger = replace(pyramid, vertices=middle + (1.0 + 1e-6) * (pyramid.vertices - middle))
    apart = replace(scene, shapes=(FLOOR, *larger.records()))
    truth = converged_color(apart, pixels, goal=1e-3)
    film = render_image(scene, Settings(tolerance=2e-3, threads=2))
    x, y = pixels.T
    error = relative_rmse(film.color[:, y, x].T, truth)
    print(f"off by {error:.1e}")
    assert error < 2e-3


def cut(scene):
    """A scene with the first half of each quad but the first shape, and a triangle through all."""
    flat = []
    for shape in scene.shapes[1:]:
        if isinstance(shape, Quad):
            q, u, v = (np.array(x) for x in (shape.corner, shape.edge_u, shape.edge_v))
            corners = tuple(tuple(x.tolist()) for x in (q, q + u, q + v))
            flat.append(Triangle(corners, shape.material, shape.motion))
    others = [s for k, s in enumerate(scene.shapes) if k == 0 or not isinstance(s, Quad)]
    return replace(scene, shapes=(*others, *flat)), len(flat)


@pytest.mark.parametrize(
    "seed", [1, 3, 5, 12, *(pytest.param(k, marks=pytest.mark.slow) for k in (8, 17, 19, 26))]
)
def test_the_mask_leaves_nothing_out(seed):
    scene, count = cut(random_scene(seed))
    if not count:
        pytest.skip("no quads to cut")
    truth = masks(scene)
    few = Settings(method="RAYS", light_rays=2, time_rays=2, pixel_rays=2, threads=2)
    gone = truth & ~render_image(scene, few).mask
    assert not gone.any(), np.argwhere(gone).tolist()


@pytest.mark.parametrize("seed", [3, 12, pytest.param(8, marks=pytest.mark.slow)])
def test_pictures_agree_with_brute_force(seed):
    scene, count = cut(random_scene(seed))
    if not count:
        pytest.skip("no quads to cut")
    want, error = reference(scene, 256)
    film = render_image(scene, Settings(tolerance=5e-3, threads=2))
    noise = np.sqrt((error**2).mean()) / want.mean()
    assert relative_rmse(film.color, want) < 0.01 + 2.0 * noise


def box_of(size):
    return halves_of(cube(size, (0.0, 0.0, 0.0)))


CLOSED = {"box": box_of(2.0), "dented ball": mesh(*dented_ball())}
LIGHTS = {"quad": LAMP, "sphere": BULB, "point": DOT}
SLOWEST = "dented ball", "quad"


@pytest.mark.parametrize(
    "kind, light",
    [
        pytest.param(kind, light, marks=pytest.mark.slow if (kind, light) == SLOWEST else ())
        for kind in CLOSED
        for light in LIGHTS
    ],
)
def test_no_light_comes_in(kind, light):
    """All directions from a camera within a closed mesh are black."""
    # by rays, slivers of area lights over the horizon are not shadowed
    method = "RAYS" if light == "point" else "EXACT"
    for target in ((1.0, 0.2, 0.1), (-0.3, 0.1, 1.0)):
        camera = look_at((0.0, 0.0, 0.0), target, resolution=(20, 20), focal_length=12.0)
        scene = Scene(camera, (CLOSED[kind],), (LIGHTS[light],), background=(1.0, 1.0, 1.0))
        assert render_image(scene, Settings(method=method, threads=2)).color.max() <= DARK


@pytest.mark.parametrize("kind", CLOSED)
@pytest.mark.parametrize("light", ["sphere", "point"])
def test_no_light_comes_out(kind, light):
    small = {
        "sphere": SphereLight((0.1, 0.0, 0.1), 0.2, (50.0,) * 3),
        "point": PointLight((0.1, 0.0, 0.1), (50.0,) * 3),
    }[light]
    camera = look_at((0.5, -6.0, 3.5), (0.0, 0.0, -0.6), resolution=(24, 16))
    floor = replace(FLOOR, corner=(-6.0, -6.0, -2.0))
    scene = Scene(camera, (floor, CLOSED[kind]), (small,))
    # the background, which is seen beside them, gives the picture a mean to be accurate to
    scene = replace(scene, background=(1.0, 1.0, 1.0))
    chosen = Settings(method="RAYS" if light == "point" else "EXACT", threads=2)
    lit, unlit = (render_image(each, chosen).color for each in (scene, replace(scene, lights=())))
    shown = unlit.max(axis=0) == 0.0
    assert shown.mean() > 0.3 and lit[:, shown].max() <= DARK
