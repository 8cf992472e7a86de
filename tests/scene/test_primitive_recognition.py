# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are spheres, made here by formulas; and meshes that only look like them."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.primitive_recognition import MeshSphere, recognise_primitive


def uv_sphere(segments, rings):
    """Unit vectors (n, 3) and faces: poles first and last, rings of vertices between."""
    theta, phi = (
        np.arange(1, rings) * np.pi / rings,
        np.arange(segments) * 2.0 * np.pi / segments,
    )
    ring = np.array([(np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t))
                     for t in theta for p in phi])  # fmt: skip
    points = np.concatenate([[(0, 0, 1)], ring, [(0, 0, -1)]])

    def at(k, j):
        return 1 + k * segments + j % segments

    faces = [[0, at(0, j), at(0, j + 1)] for j in range(segments)]
    for k in range(rings - 2):
        faces += [[at(k, j), at(k + 1, j), at(k + 1, j + 1), at(k, j + 1)] for j in range(segments)]
    faces += [[len(points) - 1, at(rings - 2, j + 1), at(rings - 2, j)] for j in range(segments)]
    return points, faces


def icosphere(level):
    """A regular icosahedron, each of its faces cut in four `level` times."""
    gold = (1.0 + 5.0**0.5) / 2.0
    points = [np.roll((0.0, a, b * gold), k) for k in range(3) for a in (-1, 1) for b in (-1, 1)]
    points = [p / np.linalg.norm(p) for p in points]
    edge = min(np.linalg.norm(p - points[0]) for p in points[1:])
    near = [[np.linalg.norm(p - q) < 1.1 * edge for q in points] for p in points]
    faces = [
        [i, j, k]
        for i in range(12) for j in range(i) for k in range(j)
        if near[i][j] and near[j][k] and near[k][i]
    ]  # fmt: skip
    for _ in range(level):
        middle, cut = {}, []
        for face in faces:
            between = []
            for i, j in zip(face, face[1:] + face[:1], strict=True):
                key = min(i, j), max(i, j)
                if key not in middle:
                    middle[key] = len(points)
                    half = points[i] + points[j]
                    points.append(half / np.linalg.norm(half))
                between.append(middle[key])
            cut += [
                [a, b, c] for a, b, c in zip(face, between, between[2:] + between[:2], strict=True)
            ]
            cut.append(between)
        faces = cut
    return np.array(points), faces


def cube():
    points = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return points, [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ]


def recognised(points, faces, slots=None):
    sizes = np.array([len(face) for face in faces])
    slots = np.zeros(len(faces), dtype=np.int64) if slots is None else np.array(slots)
    corners = np.array([vertex for face in faces for vertex in face])
    return recognise_primitive(
        np.asarray(points, float).T, corners, np.cumsum(sizes) - sizes, slots
    )


def placed(rng, points):
    """Unit points turned, scaled and moved at random: points, centre, radius."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    radius, center = 10.0 ** rng.uniform(-2, 2), rng.normal(size=3)
    center *= radius
    return center + radius * points @ turn.T, center, radius


BALLS = {
    "3 x 3": uv_sphere(3, 3), "4 x 3": uv_sphere(4, 3), "32 x 16": uv_sphere(32, 16),
    "7 x 20": uv_sphere(7, 20), "icosahedron": icosphere(0), "level 1": icosphere(1),
    "level 3": icosphere(3),
}  # fmt: skip


@pytest.mark.parametrize("name", BALLS)
@pytest.mark.parametrize("seed", range(4))
def test_spheres_are_found_in_any_place_and_order_of_faces_and_vertices(name, seed):
    rng = np.random.default_rng(seed)
    points, faces = BALLS[name]
    points, center, radius = placed(rng, points)
    order = rng.permutation(len(points))
    place = np.argsort(order)
    turned = [np.roll([place[v] for v in face], rng.integers(4)).tolist() for face in faces]
    turned = [turned[k] for k in rng.permutation(len(turned))]
    found = recognised(np.float32(points[order]), turned)
    assert isinstance(found, MeshSphere), (seed, found)
    assert abs(found.radius / radius - 1.0) < 1e-5
    assert np.linalg.norm(found.center - center) < 1e-5 * radius


@pytest.mark.parametrize("name", BALLS)
def test_what_is_dented_stretched_or_cut_is_none(name):
    points, faces = BALLS[name]
    dented, stretched = points.copy(), points * (1.0, 1.0, 1.001)
    dented[len(points) // 2] *= 0.999
    for other, kept in ((dented, faces), (stretched, faces), (points, faces[1:])):
        assert not isinstance(recognised(other, kept), MeshSphere)


def slid(points, faces, size=0.004):
    """The mesh with its vertices moved along the sphere."""
    moved = points + size * np.random.default_rng(1).normal(size=points.shape)
    return moved / np.linalg.norm(moved, axis=1, keepdims=True), faces


def triangulated(points, faces):
    """All quads cut along one diagonal or the other."""
    cut = []
    for index, face in enumerate(faces):
        turned = face[index % 2 :] + face[: index % 2]
        cut += [[turned[0], *turned[k : k + 2]] for k in range(1, len(face) - 1)]
    return points, cut


def loose(points, faces):
    """Faces that share no vertices, as in an STL file; every third one is turned over."""
    apart = points[[vertex for face in faces for vertex in face]]
    ends = np.cumsum([len(face) for face in faces])
    apart_faces = [list(range(end - len(face), end)) for end, face in zip(ends, faces, strict=True)]
    return apart, [f[::-1] if k % 3 == 0 else f for k, f in enumerate(apart_faces)]


def quad_sphere(cells):
    """A cube whose sides are cut in cells * cells, moved onto the sphere; seams are not shared."""
    u, v = np.meshgrid(np.linspace(-1, 1, cells + 1), np.linspace(-1, 1, cells + 1))
    side = np.stack([u.ravel(), v.ravel(), np.ones(u.size)], axis=1)
    flipped = side * (1.0, -1.0, -1.0)
    points = np.concatenate([np.roll(x, k, axis=1) for x in (side, flipped) for k in range(3)])
    row = cells + 1
    faces = [
        [s * row * row + at for at in (k * row + j, k * row + j + 1,
                                                    (k + 1) * row + j + 1, (k + 1) * row + j)]
        for s in range(6) for k in range(cells) for j in range(cells)
    ]  # fmt: skip
    return points / np.linalg.norm(points, axis=1, keepdims=True), faces


def lathe(segments, rings):
    """A UV sphere of quads alone, whose seam and poles are not shared and differ by rounding."""
    theta, phi = np.meshgrid(
        np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2.0 * np.pi, segments + 1)
    )
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    row = rings + 1
    faces = [
        [j * row + k, j * row + k + 1, (j + 1) * row + k + 1, (j + 1) * row + k]
        for j in range(segments) for k in range(rings)
    ]  # fmt: skip
    return np.float32(points.reshape(3, -1).T), faces


FINE = {
    "triangles": triangulated(*uv_sphere(32, 16)),
    "slid": slid(*uv_sphere(32, 16)),
    "loose": loose(*uv_sphere(32, 16)),
    "loose triangles": loose(*triangulated(*slid(*uv_sphere(24, 12)))),
    "quads": quad_sphere(8),
    "loose icosphere": loose(*icosphere(3)),
    "lathe": lathe(32, 16),
    "finer lathe": lathe(64, 32),
    "mixed": triangulated(*slid(*icosphere(2))),
}


@pytest.mark.parametrize("name", FINE)
@pytest.mark.parametrize("seed", range(2))
def test_spheres_of_any_cut_are_found(name, seed):
    points, faces = FINE[name]
    points, center, radius = placed(np.random.default_rng(seed), points)
    found = recognised(np.float32(points), faces)
    assert isinstance(found, MeshSphere), found
    assert abs(found.radius / radius - 1.0) < 1e-5
    assert np.linalg.norm(found.center - center) < 1e-5 * radius


def _cylinder(points, faces):
    """A sphere cut off flat: the vertices stay on the sphere, but its top is a large face."""
    low = [face for face in faces if all(points[v][2] < 0.6 for v in face)]
    edges = [e for f in low for e in zip(f, f[1:] + f[:1], strict=True)]
    rim = [(b, a) for a, b in edges if (b, a) not in set(edges)]
    after, top = dict(rim), [rim[0][0]]
    while after[top[-1]] != top[0]:
        top.append(after[top[-1]])
    return points, [*low, top]


FALSE = {
    "a gem": slid(*uv_sphere(9, 6)),
    "a hole": (FINE["slid"][0], FINE["slid"][1][1:]),
    "a face twice": (FINE["slid"][0], [*FINE["slid"][1], FINE["slid"][1][40]]),
    "a shell twice": (FINE["slid"][0], FINE["slid"][1] * 2),
    "a dent": (
        np.where(np.arange(482)[:, None] == 77, 0.99, 1.0) * FINE["slid"][0],
        FINE["slid"][1],
    ),
    "a flat top": _cylinder(*slid(*uv_sphere(32, 16))),
    "stretched": (FINE["slid"][0] * (1.0, 1.0, 1.001), FINE["slid"][1]),
    "two balls": (
        np.concatenate([FINE["slid"][0], FINE["slid"][0] + 3.0]),
        [*FINE["slid"][1], *([v + 482 for v in face] for face in FINE["slid"][1])],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FALSE)
def test_what_does_not_cover_a_sphere_once_is_none(name):
    assert not isinstance(recognised(*FALSE[name]), MeshSphere)


def test_a_small_sphere_far_off_is_none():
    """Its vertices are rounded so far that any shape would do."""
    points, faces = FINE["slid"]
    assert not isinstance(recognised(np.float32(points + 3e3), faces), MeshSphere)


def test_cubes_are_six_parallelograms_though_their_corners_lie_on_a_sphere():
    found = recognised(*cube()).parallelograms
    normals = np.cross(found.edge_u, found.edge_v, axis=0)
    assert normals.shape == (3, 6)
    assert np.abs(normals).sum(axis=1).tolist() == [8.0, 8.0, 8.0]


def test_faces_are_cut_as_they_are_told_to_be():
    """By fans, unless triangles are given; loose vertices have no number."""
    points = np.array([(9, 9, 9), (0, 0, 0), (2, 0, 0), (0.5, 0.5, 0), (0, 2, 0)], dtype=float)
    zero, corners = np.zeros(1, dtype=np.int64), np.arange(1, 5)
    fan = recognise_primitive(points.T, corners, zero, zero).triangles
    assert fan.corners.T.tolist() == [[0, 1, 2], [0, 2, 3]] and fan.points.shape == (3, 4)
    other = np.array([[1, 2, 4], [2, 3, 4]]).T, np.zeros(2, dtype=np.int64)
    told = recognise_primitive(points.T, corners, zero, zero, other).triangles
    assert told.corners.T.tolist() == [[0, 1, 3], [1, 2, 3]]


def test_loose_vertices_are_not_looked_at():
    points, faces = uv_sphere(8, 4)
    far = np.concatenate([[(1e3, np.nan, 0.0)], points])
    found = recognised(far, [[v + 1 for v in face] for face in faces])
    assert isinstance(found, MeshSphere) and found.radius == pytest.approx(1.0, rel=1e-12)


def test_the_slot_is_that_of_most_faces():
    points, faces = uv_sphere(8, 4)
    slots = [1] * len(faces)
    slots[:5] = [0] * 5
    assert recognised(points, faces, slots).slot == 1


def test_a_sphere_about_the_origin_is_there_exactly():
    points, faces = uv_sphere(32, 16)
    assert recognised(np.float32(points * 0.3), faces).center == (0.0, 0.0, 0.0)


def test_reasons():
    nothing = np.zeros(0, dtype=np.int64)
    assert "no faces" in recognise_primitive(np.zeros((3, 1)), nothing, nothing, nothing)
    points, faces = cube()
    assert "finite" in recognised(points * (1.0, np.inf, 1.0), faces)
