# SPDX-License-Identifier: GPL-3.0-or-later
"""Which meshes stand for cylinders: those built as Blender's primitive, and no others."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.cylinder_recognition import FEWEST_SIDES, recognise_cylinder


def cylinder(sides=16, fans=False, radius=1.0, length=2.0, taper=1.0):
    """Vertices (3, n) and faces of a primitive that is turned and moved, in float32."""
    angle = np.arange(sides) * 2.0 * np.pi / sides
    ring = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    height = np.array([[0.0], [0.0], [length]])
    points = [radius * ring, radius * taper * ring + height]
    after = (np.arange(sides) + 1) % sides
    faces = [(k, after[k], sides + after[k], sides + k) for k in range(sides)]
    if fans:
        points.append(np.array([[0.0, 0.0], [0.0, 0.0], [0.0, length]]))
        for end in (0, 1):
            middle, base = 2 * sides + end, end * sides
            faces += [(middle, base + k, base + after[k]) for k in range(sides)]
    else:
        faces += [tuple(range(sides)), tuple(range(2 * sides - 1, sides - 1, -1))]
    turn = np.linalg.qr(np.random.default_rng(sides).normal(size=(3, 3)))[0]
    shape = turn @ np.concatenate(points, axis=1) + np.array([[0.3], [-0.2], [0.5]])
    return np.float64(np.float32(shape)), faces


def recognised(points, faces, slots=None):
    corners = np.concatenate([np.array(face) for face in faces])
    starts = np.cumsum([0, *(len(face) for face in faces[:-1])])
    slots = np.zeros(len(faces), dtype=np.int64) if slots is None else slots
    return recognise_cylinder(points, corners, starts, slots)


@pytest.mark.parametrize("fans", [False, True])
@pytest.mark.parametrize("sides", [FEWEST_SIDES, 32, 65])
def test_primitives_are_cylinders(sides, fans):
    points, faces = cylinder(sides, fans, 0.3, 1.7)
    found = recognised(points, faces)
    assert found.sides == sides and found.radius == pytest.approx(0.3, rel=1e-5)
    ends = np.array([found.start, found.end])
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(1.7, rel=1e-5)
    np.testing.assert_allclose(ends[0], points[:, :sides].mean(axis=1), atol=1e-6)


@pytest.mark.parametrize("taper", [0.8, 1.0, 1.3])
@pytest.mark.parametrize("sides", [FEWEST_SIDES, 33])
def test_two_rings_without_ends_are_open_tubes(sides, taper):
    points, faces = cylinder(sides, radius=0.3, length=1.7, taper=taper)
    assert not recognised(points, faces).is_open
    rng = np.random.default_rng(sides)
    order = rng.permutation(points.shape[1])
    place = np.argsort(order)
    mixed = [np.roll(place[list(face)], rng.integers(4)) for face in faces[:sides]]
    found = recognised(points[:, order], [mixed[k] for k in rng.permutation(sides)])
    assert found.is_open and found.sides == sides
    assert sorted([found.radius, found.end_radius or found.radius]) == pytest.approx(
        sorted([0.3, 0.3 * taper]), rel=1e-5
    )
    ends = sorted([found.start, found.end])
    middles = [points[:, :sides].mean(axis=1), points[:, sides:].mean(axis=1)]
    np.testing.assert_allclose(ends, sorted(map(tuple, middles)), atol=1e-6)


@pytest.mark.parametrize("kind", ["gap", "two", "twisted", "moebius"])
def test_other_strips_of_quads_are_none(kind):
    points, faces = cylinder(24)
    faces = faces[:24]
    if kind == "gap":
        faces = faces[:-1]
    if kind == "two":
        # two tubes of half as many sides
        own, tube = cylinder(12)
        points = np.concatenate([own, own + 5.0], axis=1)
        faces = [*tube[:12], *(tuple(24 + k for k in face) for face in tube[:12])]
    if kind == "twisted":
        turn = np.roll(np.arange(24), -1)
        faces = [(a, b, 24 + turn[c - 24], 24 + turn[d - 24]) for a, b, c, d in faces]
    if kind == "moebius":
        a, b, c, d = faces[-1]
        faces[-1] = (a, c, b, d)
    assert recognised(points, faces) is None


@pytest.mark.parametrize("fans", [False, True])
@pytest.mark.parametrize("taper", [0.05, 0.8, 1.3])
def test_rings_of_two_sizes_are_truncated_cones(fans, taper):
    points, faces = cylinder(16, fans, 0.3, 1.7, taper)
    found = recognised(points, faces)
    assert found.radius == pytest.approx(0.3, rel=1e-5)
    assert found.end_radius == pytest.approx(0.3 * taper, rel=1e-5)


def cone(sides=16, fan=False, length=2.0):
    """Vertices (3, n) and faces of a cone: the first two rings of a cylinder, the last a point."""
    points, faces = cylinder(sides, True, 1.0, length)
    apex, base = 2 * sides + 1, 2 * sides
    faces = [(k, (k + 1) % sides, apex) for k in range(sides)]
    faces += [face for face in cylinder(sides, True)[1][sides : 2 * sides]] if fan else []
    keep = [*range(sides), apex, *([base] if fan else [])]
    number = {old: new for new, old in enumerate(keep)}
    faces = [tuple(number[int(each)] for each in face) for face in faces]
    return points[:, keep], faces if fan else [*faces, tuple(range(sides))]


@pytest.mark.parametrize("fan", [False, True])
@pytest.mark.parametrize("sides", [FEWEST_SIDES, 33])
def test_a_ring_and_an_apex_are_a_cone(sides, fan):
    points, faces = cone(sides, fan, 0.7)
    rng = np.random.default_rng(sides)
    order = rng.permutation(points.shape[1])
    place = np.argsort(order)
    mixed = [np.roll(place[list(face)], rng.integers(3)) for face in faces]
    found = recognised(points[:, order], [mixed[k] for k in rng.permutation(len(mixed))])
    assert (found.sides, found.end_radius) == (sides, 0.0)
    assert found.radius == pytest.approx(1.0, rel=1e-5)
    np.testing.assert_allclose(found.end, points[:, sides], atol=1e-6)


@pytest.mark.parametrize("kind", ["few", "open", "slanted", "dented", "twice"])
def test_other_pyramids_are_none(kind):
    points, faces = cone(FEWEST_SIDES - 1 if kind == "few" else 16)
    if kind == "open":
        faces = faces[:-1]
    if kind == "slanted":
        points[0, -1] += 0.01
    if kind == "dented":
        points[:, 3] *= 1.001
    if kind == "twice":
        faces = [faces[1], *faces[1:]]
    assert recognised(points, faces) is None


@pytest.mark.parametrize("fans", [False, True])
def test_the_order_of_faces_and_vertices_does_not_matter(fans):
    points, faces = cylinder(16, fans)
    rng = np.random.default_rng(0)
    order = rng.permutation(points.shape[1])
    place = np.argsort(order)
    mixed = [np.roll(place[list(face)], rng.integers(4)) for face in faces]
    mixed = [face[::-1] if rng.random() < 0.5 else face for face in mixed]
    found = recognised(points[:, order], [mixed[k] for k in rng.permutation(len(mixed))])
    assert found is not None and found.sides == 16


def changed(kind):
    points, faces = cylinder(16, kind == "open fan")
    if kind == "few":
        return cylinder(FEWEST_SIDES - 1)
    if kind == "open":
        faces = faces[:-1]
    if kind == "open fan":
        faces = faces[:-1]
    if kind == "dented":
        points[:, 3] *= 1.001
    if kind == "sheared":
        points[0] += 0.01 * points[1]
    if kind == "oval":
        points[0] *= 1.01
    if kind == "twice":
        faces = [faces[1], *faces[1:]]
    return points, faces


@pytest.mark.parametrize("kind", ["few", "open", "open fan", "dented", "sheared", "oval", "twice"])
def test_others_are_none(kind):
    assert recognised(*changed(kind)) is None


def test_faces_of_several_materials_are_none():
    points, faces = cylinder()
    slots = np.zeros(len(faces), dtype=np.int64)
    slots[-1] = 1
    assert recognised(points, faces, slots) is None
    assert recognised(points, faces, slots * 0 + 1).slot == 1
