# SPDX-License-Identifier: GPL-3.0-or-later
"""Visible fractions by lines across a light, against shadow rays that test every triangle."""

from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Material, PolygonLight, Quad, QuadLight, Scene
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.line_light import line_fractions, points_for_lines
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, Surface
from mesh_shapes import ball_mesh, grid_mesh, mesh_of, triangle_soup
from oracle.mesh_rays import _blocked, _groups, _sample, triangles_of
from random_scenes import look_at

FLOOR = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0), Material((0.8, 0.8, 0.8)))
LAMP = QuadLight((0.4, -0.3, 4.0), (0.8, 0.1, 0.1), (0.1, -0.6, 0.0), (12.0, 11.0, 9.0))
CAMERA = look_at((0.5, -6.0, 3.5), (0.0, 0.0, 0.6), resolution=(8, 6))
SIDE = 160


def inverted(mesh):
    return replace(mesh, faces=np.ascontiguousarray(mesh.faces[::-1]))


def doubled(mesh):
    faces = np.concatenate([mesh.faces, mesh.faces[::-1]], axis=1)
    return mesh_of(mesh.vertices, faces)


def raised(mesh, height=1.3):
    return replace(mesh, vertices=mesh.vertices + np.array([[0.0], [0.0], [height]]))


PLATE = grid_mesh(1, lambda x, y: 0.0 * x + 1.5, size=1.0)
MESHES = {
    "plate": PLATE,
    "ball": ball_mesh(14, 9),
    "inverted": inverted(ball_mesh(14, 9)),
    "doubled": doubled(grid_mesh(3, lambda x, y: 1.2 + 0.2 * x * y, size=1.5)),
    "open": grid_mesh(4, lambda x, y: 1.2 + 0.3 * np.sin(2.0 * x) * y, size=1.6),
    "half inverted": mesh_of(
        PLATE.vertices, np.array([PLATE.faces[:, 0], PLATE.faces[::-1, 1]]).T.copy()
    ),
    "soup": raised(triangle_soup(np.random.default_rng(3), 14, 0.4)),
}


@njit
def shares(plain, groups, light, points, side):
    """Visible share of irradiance at points on a floor z = 0, by side x side rays each."""
    found = np.zeros(len(points))
    for k in range(len(points)):
        whole, seen = 0.0, 0.0
        for i in range(side):
            for j in range(side):
                to, weight = _sample(light, points[k], (i + 0.5) / side, (j + 0.5) / side)
                weight *= to[2] / np.sqrt(to[0] ** 2 + to[1] ** 2 + to[2] ** 2)
                whole += weight
                if not _blocked(plain, groups, -1, points[k], to, 0.0):
                    seen += weight
        found[k] = seen / whole
    return found


def by_lines(mesh, lines, count=60, lamp=LAMP):
    """Points, the share that is visible by lines, its errors, and what is visible in all (sr)."""
    rng = np.random.default_rng(0)
    points = np.array([*rng.uniform(-1.6, 1.6, (2, count)), np.zeros(count)])
    plan = make_plan(Scene(CAMERA, (FLOOR, mesh), (lamp,)), Settings())
    hits = Surface(
        points - plan.lens.origin[:, None],
        np.tile(np.array([[0.0], [0.0], [1.0]]), count),
        np.zeros(count, dtype=np.int64),
        np.zeros(count, dtype=np.bool_),
    )
    pairs = Pairs(np.arange(count), np.ones(count, dtype=np.int64))
    assert points_for_lines(plan, plan.lights[0], hits, pairs).all()
    share, error = line_fractions(plan, plan.lights[0], hits, pairs, lines)
    to = plan.lights[0].to_center(hits.point)
    whole = plan.lights[0].irradiance_factor(to, hits.point, hits.normal)
    return points, share, error, share * whole


def compared(mesh, lines, count=60):
    """Shares by lines, their errors, and the shares by brute force."""
    points, share, error, _ = by_lines(mesh, lines, count)
    corners, _, _, moves, _ = triangles_of(Scene(CAMERA, (mesh,), (LAMP,)))
    edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    plain = np.concatenate([corners[:, 0], *edges, moves], axis=1)
    light = np.array([0.0, *LAMP.center, *LAMP.half_u, *LAMP.half_v, *LAMP.radiance])
    return share, error, shares(plain, _groups(plain), light, np.ascontiguousarray(points.T), SIDE)


@pytest.mark.parametrize("name", MESHES)
def test_fractions_are_those_of_rays(name):
    share, error, truth = compared(MESHES[name], 81)
    assert np.isfinite(error).all()
    assert ((truth > 0.0) & (truth < 1.0)).sum() > 10
    # a regular grid of rays is off by some SIDE ** -1.5 itself
    assert np.abs(share - truth).max() < 3e-3
    assert np.sqrt(((share - truth) ** 2).mean()) < 8e-4
    # where nothing is hidden, or everything, there is no error at all
    assert (share[truth == 1.0] > 1.0 - 1e-4).all()
    assert (error[(share == 1.0) | (share == 0.0)] == 0.0).all()


def corners_of(lamp):
    center, u, v = (np.array(each) for each in (lamp.center, lamp.half_u, lamp.half_v))
    return [tuple(center + a * u + b * v) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]


@pytest.mark.parametrize("name", ["plate", "ball"])
def test_parts_of_a_light_add_up(name):
    """A parallelogram is as bright as the triangles that it is cut into."""
    a, b, c, d = corners_of(LAMP)
    parts = (PolygonLight((a, b, c), LAMP.radiance), PolygonLight((a, c, d), LAMP.radiance))
    whole = by_lines(MESHES[name], 243)[3]
    found = [by_lines(MESHES[name], 243, lamp=part)[3] for part in parts]
    assert np.abs(sum(found) - whole).max() < 1e-3 * whole.max()
    same = by_lines(MESHES[name], 243, lamp=PolygonLight((a, b, c, d), LAMP.radiance))[3]
    assert np.abs(same - whole).max() < 1e-3 * whole.max()


@pytest.mark.slow
def test_stated_errors_are_right_on_average():
    measured, stated = [], []
    for name in ("plate", "ball", "open", "soup"):
        share, error, _ = compared(MESHES[name], 27, 200)
        exact, _, _ = compared(MESHES[name], 729, 200)
        measured.append(share - exact)
        stated.append(error)
    measured, stated = np.concatenate(measured), np.concatenate(stated)
    assert 0.2 < np.sqrt((measured**2).mean() / (stated**2).mean()) < 1.3


@pytest.mark.slow
def test_more_lines_are_nearer_the_truth():
    exact = compared(MESHES["ball"], 729)[0]
    off = [np.sqrt(((compared(MESHES["ball"], n)[0] - exact) ** 2).mean()) for n in (9, 27, 81)]
    assert off[1] < 0.4 * off[0] and off[2] < 0.4 * off[1]


def test_a_mesh_that_reaches_the_plane_of_the_light_is_left_to_rays():
    mesh = grid_mesh(2, lambda x, y: 3.9 + 0.5 * x, size=1.0)
    _, error, _ = compared(mesh, 27, 40)
    assert np.isinf(error).any()
    scene = Scene(CAMERA, (FLOOR, mesh), (LAMP,))
    assert np.isfinite(render_image(scene, Settings(tolerance=0.02)).color).all()
