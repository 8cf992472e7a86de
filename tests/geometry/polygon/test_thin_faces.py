# SPDX-License-Identifier: GPL-3.0-or-later
"""Many thin flat faces are rendered as meshes of triangles; all others stay as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.geometry.polygon import thin_faces
from adaptive_drt.geometry.polygon.thin_faces import meshes_of_thin_faces, rays_cost_less_from
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Camera,
    Material,
    Motion,
    Quad,
    QuadLight,
    Quads,
    Scene,
    Visibility,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.scene.triangle_mesh import TriangleMesh

FLOOR = Quad((-4.0, -4.0, -6.0), (8.0, 0.0, 0.0), (0.0, 8.0, 0.0), Material((0.5, 0.6, 0.7)))
LIGHT = QuadLight((-0.5, 0.5, 0.5), (0.5, 0.0, 0.0), (0.0, -0.5, 0.0), (30.0, 30.0, 30.0))
RED, BLUE = Material((0.8, 0.2, 0.2)), Material((0.2, 0.2, 0.8))


def slats(count, width=0.02, length=1.5, **given):
    """Strips side by side below the camera, red and blue in turn."""
    corner, u, v = np.zeros((3, 3, count))
    corner[0] = np.linspace(-0.8, 0.8, count)
    corner[1], corner[2] = -0.5 * length, -4.0
    u[0], u[2], v[1] = width, 0.3 * width, length
    slot = np.arange(count) % 2
    return Quads(corner, u, v, slot, (RED, BLUE), name="Slats", **given)


def turned(count, **given):
    """The same, turned before the camera, so that they lie across rows and columns."""
    made = slats(count, **given)
    (cosine, sine), middle = (np.cos(0.5), np.sin(0.5)), np.array([[0.0], [0.0], [-4.0]])
    turn = np.array([(cosine, -sine, 0.0), (sine, cosine, 0.0), (0.0, 0.0, 1.0)])
    return replace(
        made,
        corner=turn @ (made.corner - middle) + middle,
        edge_u=turn @ made.edge_u,
        edge_v=turn @ made.edge_v,
    )


def scene(*shapes):
    """Shapes over a floor, seen from above."""
    return Scene(Camera(resolution=(24, 16)), (*shapes, FLOOR), (LIGHT,))


def test_many_thin_faces_become_a_mesh():
    """All of their faces, with their materials, in their places."""
    found, count = meshes_of_thin_faces((slats(30), FLOOR), Settings(tolerance=0.01))
    assert count == 30
    assert found[0] is FLOOR
    mesh = found[1]
    assert isinstance(mesh, TriangleMesh)
    assert mesh.faces.shape == (3, 60)
    u, v = mesh.edges()
    area = 0.5 * np.linalg.norm(np.cross(u, v, axis=0), axis=0)
    assert np.allclose(area, 0.5 * 1.5 * np.hypot(0.02, 0.006))
    for slot, material in enumerate(mesh.materials):
        middle = mesh.vertices[0][mesh.faces[:, mesh.face_slot == slot]].mean(axis=0)
        corner = slats(30).corner[0, {RED: 0, BLUE: 1}[material] :: 2]
        # the triangles' centroids lie at 2 / 3 and 1 / 3 of the width
        places = np.sort(np.concatenate([corner + 0.02 * 2 / 3, corner + 0.02 / 3]))
        assert np.allclose(np.sort(middle), places)


@pytest.mark.parametrize(
    ("record", "settings"),
    [
        (slats(12), Settings(tolerance=0.01)),
        (slats(30, width=0.2), Settings(tolerance=0.01)),
        (slats(30), Settings(tolerance=1e-4)),
        (slats(30), Settings(tolerance=0.01, method="RAYS")),
        (replace(slats(30), materials=(RED, Material(emission=(1.0, 1.0, 1.0)))), Settings()),
    ],
    ids=["few", "wide", "fine", "rays", "shining"],
)
def test_other_faces_stay(record, settings):
    """Few or wide ones, at fine tolerances, by distributed rays, and those that shine."""
    assert meshes_of_thin_faces((record, FLOOR), settings) == ([record, FLOOR], 0)


def test_single_bars_of_one_motion_and_visibility_are_one_mesh():
    """Those that move or are met otherwise are counted apart."""
    moving, unseen = Motion((0.1, 0.0, 0.0)), Visibility(camera=False)
    still = list(slats(25).records())
    others = [*slats(26, motion=moving).records(), *slats(5, visibility=unseen).records()]
    found, count = meshes_of_thin_faces([*still, *others], Settings(tolerance=0.01))
    assert count == 51
    assert found[:5] == others[26:]
    assert [each.motion for each in found[5:]] == [None, moving]


def test_number_grows_with_the_accuracy():
    """Closed forms gain on rays as the tolerance falls."""
    assert 24 <= rays_cost_less_from(0.01) < rays_cost_less_from(0.001) < 100


@pytest.mark.parametrize("motion", [None, Motion((0.05, 0.02, 0.0))], ids=["still", "moving"])
def test_picture_is_that_of_closed_forms(monkeypatch, motion):
    """Both within the tolerance, and the statistics tell of the faces."""
    seen = scene(turned(8, motion=motion))
    exact = render_image(seen, Settings(tolerance=5e-4, threads=1))
    assert exact.stats["plan"]["faces_in_meshes"] == 0
    monkeypatch.setattr(thin_faces, "LEAST_FACES", 4.0)
    film = render_image(seen, Settings(tolerance=5e-3, threads=1))
    assert film.stats["plan"]["faces_in_meshes"] == 8
    error = np.sqrt(((film.color - exact.color) ** 2).mean()) / exact.color.mean()
    assert error <= 5e-3
    assert not (exact.mask.any(axis=0) & ~film.mask.any(axis=0)).any()


def test_a_fence_of_many_bars_ends():
    """It did not within minutes, in closed form."""
    film = render_image(scene(slats(180, width=0.003)), Settings(tolerance=0.01, threads=1))
    assert film.stats["plan"]["faces_in_meshes"] == 180
    assert film.stats["error_estimate"] <= 0.01
