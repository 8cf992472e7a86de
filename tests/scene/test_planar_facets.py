# SPDX-License-Identifier: GPL-3.0-or-later
"""Parallelograms that meshes are made of, cut and joined at random, and all other faces."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from adaptive_drt.scene.planar_facets import (
    MAX_TRIANGLES,
    NO_AREA,
    TOO_MANY,
    Mesh,
    mesh_edges,
    planar_facets,
)


def mesh_of(points, faces, slots=None, fit=1e-9):
    """A mesh of points (n, 3) and faces, lists of their vertices."""
    sizes = np.array([len(face) for face in faces])
    slots = np.zeros(len(faces), dtype=np.int64) if slots is None else np.array(slots)
    corners = np.array([vertex for face in faces for vertex in face])
    return Mesh(
        np.array(points, dtype=float).T, corners, np.cumsum(sizes) - sizes, sizes, slots, 0.0, fit
    )


def sheet(rng, corner, u, v, columns, rows, first=0, triangles=False):
    """Points and faces of a parallelogram cut at random places."""
    x, y = (
        np.concatenate([[0.0], np.sort(rng.uniform(0.05, 0.95, n - 1)), [1.0]])
        for n in (columns, rows)
    )
    points = [corner + a * u + b * v for b in y for a in x]
    faces = []
    for j in range(rows):
        for i in range(columns):
            a = first + j * (columns + 1) + i
            b, c, d = a + 1, a + columns + 2, a + columns + 1
            faces += [[a, b, c], [a, c, d]] if triangles else [[a, b, c, d]]
    return points, faces


def facets(mesh):
    """The facets of a mesh whose faces are cut from their first corners, or why there are none."""
    ends = [
        (mesh.starts[face], mesh.starts[face] + k, face)
        for face in range(mesh.sizes.size)
        for k in range(1, mesh.sizes[face] - 1)
    ]
    first, second, owner = np.array(ends).T
    return planar_facets(mesh, mesh.corners[np.array([first, second, second + 1])], owner)


def parallelograms(mesh):
    """The parallelograms of a mesh one by one, of which no face is cut."""
    found = facets(mesh)
    assert not found.triangles.slot.size
    found = found.parallelograms
    rows = zip(found.corner.T, found.edge_u.T, found.edge_v.T, found.slot, strict=True)
    return [
        SimpleNamespace(corner=corner, edge_u=u, edge_v=v, slot=slot) for corner, u, v, slot in rows
    ]


def same(one, corner, u, v, size=1e-9):
    """Whether a parallelogram is the one of a corner and two edges, wherever it begins."""
    a, p, q = (np.array(each) for each in (one.corner, one.edge_u, one.edge_v))
    mine = np.array([a, a + p, a + p + q, a + q])
    want = np.array([corner, corner + u, corner + u + v, corner + v])
    apart = np.linalg.norm(mine[:, None] - want[None], axis=2)
    return apart.min(axis=1).max() < size and abs(np.cross(p, q) @ np.cross(u, v)) > 0.0


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("triangles", [False, True])
def test_a_sheet_is_one_parallelogram_however_it_is_cut(seed, triangles):
    rng = np.random.default_rng(seed)
    corner, u, v = rng.normal(size=(3, 3))
    columns, rows = rng.integers(1, 6, 2)
    points, faces = sheet(rng, corner, u, v, columns, rows, 0, triangles)
    found = parallelograms(mesh_of(points, faces))
    assert len(found) == 1 and same(found[0], corner, u, v)


@pytest.mark.parametrize("seed", range(10))
def test_sheets_that_do_not_touch_are_so_many(seed):
    rng = np.random.default_rng(seed)
    points, faces, slots, want = [], [], [], []
    for slot in range(int(rng.integers(2, 6))):
        corner, u, v = rng.normal(size=(3, 3))
        more, cut = sheet(rng, corner, u, v, *rng.integers(1, 4, 2), len(points))
        points += more
        faces += cut
        slots += [slot] * len(cut)
        want.append((slot, corner, u, v))
    order = rng.permutation(len(faces))
    found = parallelograms(mesh_of(points, [faces[k] for k in order], np.array(slots)[order]))
    assert len(found) == len(want)
    for one in found:
        slot, *edges = want[one.slot]
        assert slot == one.slot and same(one, *edges), seed


def test_materials_cut_a_sheet():
    rng = np.random.default_rng(1)
    points, faces = sheet(rng, np.zeros(3), np.eye(3)[0], np.eye(3)[1], 2, 1)
    found = parallelograms(mesh_of(points, faces, [0, 1]))
    assert sorted(one.slot for one in found) == [0, 1]


def test_a_bent_strip_falls_into_its_flat_parts():
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 1), (2, 1, 1)]
    found = parallelograms(mesh_of(points, [[0, 1, 2, 3], [1, 4, 5, 2]]))
    corners = [(0, 0, 0), (1, 0, 0)]
    edges = [(1, 0, 0), (1, 0, 1)]
    assert len(found) == 2
    for corner, u in zip(corners, edges, strict=True):
        assert any(same(one, np.array(corner), np.array(u), np.array([0, 1, 0])) for one in found)


def test_an_ell_of_three_squares_is_three():
    points = [
        (0, 0, 0),
        (1, 0, 0),
        (2, 0, 0),
        (0, 1, 0),
        (1, 1, 0),
        (2, 1, 0),
        (0, 2, 0),
        (1, 2, 0),
    ]
    found = parallelograms(mesh_of(points, [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6]]))
    assert len(found) == 3
    assert sum(np.linalg.norm(np.cross(one.edge_u, one.edge_v)) for one in found) == 3.0


@pytest.mark.parametrize(
    "points, faces, whole, cut",
    [
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [[0, 1, 2]], 0, 1),
        ([(0, 0, 0), (1, 0, 0), (2, 1, 0), (0, 1, 0)], [[0, 1, 2, 3]], 0, 2),
        ([(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)], [[0, 1, 2, 3]], 0, 2),
        # a square and one of its triangles once more
        ([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 0)],
         [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 1, 2]], 0, 5),
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
         [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], 0, 4),
        # a house: its front and back are no parallelograms
        ([(x, y, z) for y in (0, 2) for x, z in ((0, 0), (2, 0), (2, 1), (1, 2), (0, 1))],
         [[4, 3, 2, 1, 0], [5, 6, 7, 8, 9]]
         + [[k, (k + 1) % 5, (k + 1) % 5 + 5, k + 5] for k in range(5)], 5, 6),
        # a sliver without an area beside a triangle
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)], [[0, 1, 2], [0, 2, 3]], 0, 1),
    ],
)  # fmt: skip
def test_all_other_faces_are_cut(points, faces, whole, cut):
    slots = np.arange(len(faces))
    found = facets(mesh_of(points, faces, slots))
    assert found.parallelograms.slot.size == whole and found.triangles.slot.size == cut
    a, b, c = (found.triangles.points[:, each] for each in found.triangles.corners)
    area = np.linalg.norm(np.cross(b - a, c - a, axis=0), axis=0) / 2.0
    flat = found.parallelograms
    total = area.sum() + np.linalg.norm(np.cross(flat.edge_u, flat.edge_v, axis=0), axis=0).sum()
    want = 0.0
    for face in faces:
        p = np.array(points, dtype=float)[face]
        want += sum(np.linalg.norm(np.cross(y - p[0], z - p[0])) / 2 for y, z in pairwise(p[1:]))
    assert total == pytest.approx(want, rel=1e-12)
    assert set(found.slot) <= set(slots)


def test_a_mesh_without_an_area_has_a_reason():
    assert facets(mesh_of([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [[0, 1, 2]])) == NO_AREA


def test_too_many_triangles_are_counted():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(3 * (MAX_TRIANGLES + 1), 3))
    faces = np.arange(len(points)).reshape(-1, 3)
    assert facets(mesh_of(points, faces)) == TOO_MANY
    assert facets(mesh_of(points, faces[1:])).slot.size == MAX_TRIANGLES
    # of a flat group, too
    angle = np.linspace(0.0, 2.0 * np.pi, MAX_TRIANGLES + 3, endpoint=False)
    disk = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    assert facets(mesh_of(disk, [range(len(disk))])) == TOO_MANY


@pytest.mark.parametrize("seed", range(5))
def test_rounding_within_the_fit_does_not_matter_and_dents_do(seed):
    rng = np.random.default_rng(seed)
    corner, u, v = rng.normal(size=(3, 3))
    points, faces = sheet(rng, corner, u, v, 3, 3)
    points = np.array(points)
    shaken = points + 1e-7 * rng.normal(size=points.shape)
    found = parallelograms(mesh_of(shaken, faces, fit=1e-5))
    assert len(found) == 1 and same(found[0], corner, u, v, 1e-5)
    normal = np.cross(u, v)
    points[5] += 0.1 * normal / np.linalg.norm(normal)
    dented = facets(mesh_of(points, faces, fit=1e-5))
    assert dented.triangles.slot.size > 0


def test_edges_are_numbered_once():
    vertices, edge = mesh_edges(mesh_of(np.zeros((4, 3)), [[0, 1, 2], [0, 2, 3]]))
    assert vertices.T.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    assert edge.tolist() == [0, 3, 1, 1, 4, 2]


def test_selected_faces_keep_their_corners():
    mesh = mesh_of(np.zeros((6, 3)), [[0, 1, 2], [0, 2, 3, 4], [3, 4, 5]], [7, 8, 9])
    taken = mesh.take(np.array([2, 1]))
    assert taken.corners.tolist() == [3, 4, 5, 0, 2, 3, 4]
    assert taken.starts.tolist() == [0, 3] and taken.material_slots.tolist() == [9, 8]
