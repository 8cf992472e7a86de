# SPDX-License-Identifier: GPL-3.0-or-later
"""The ends of cylinders, and which of them are left out because nothing can see them."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.cylinder.ends import with_ends
from adaptive_drt.scene.description import Cylinder, Ellipse, Ellipsoid, Motion, Sphere, Visibility
from adaptive_drt.scene.sphere_batch import Spheres

FAR = np.array([9.0, 0.0, 0.0]), np.zeros(3)
BOND = Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 2.0), 0.25)
ATOM = Sphere((0.0, 0.0, 2.0), 0.5)


def ends(*shapes, camera=FAR):
    """The ends that are shapes of their own."""
    return [each for each in with_ends(shapes, camera) if isinstance(each, Ellipse)]


def test_ends_are_disks_that_face_outwards():
    first, last = ends(BOND)
    for disk, place, way in ((first, 0.0, -1.0), (last, 2.0, 1.0)):
        assert disk.center == (0.0, 0.0, place) and disk.body == 0
        normal = np.cross(disk.half_u, disk.half_v)
        np.testing.assert_allclose(normal, (0.0, 0.0, way * 0.25**2), atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(disk.half_u), 0.25)


def test_shapes_without_cylinders_stay_as_they_are():
    assert with_ends([ATOM], FAR) == [ATOM]


def test_ends_in_balls_are_left_out():
    assert [each.center[2] for each in ends(BOND, ATOM)] == [0.0]
    balls = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 2.0]])
    slot = np.zeros(2, dtype=np.int64)
    atoms = Spheres(balls, np.array([0.5, 0.5]), slot, (ATOM.material,))
    assert not ends(BOND, atoms)


def test_ends_that_may_be_seen_are_kept():
    small = Sphere(ATOM.center, 0.24)
    moving = Sphere(ATOM.center, 0.5, motion=Motion((0.0, 0.0, 1.0)))
    unseen = Sphere(ATOM.center, 0.5, visibility=Visibility(camera=False))
    for atom in (small, moving, unseen):
        assert len(ends(BOND, atom)) == 2
    within = np.array([0.0, 0.0, 2.3]), np.zeros(3)
    passing = np.array([0.0, 0.0, 2.9]), np.array([0.0, 0.0, 1.0])
    for camera in (within, passing):
        assert len(ends(BOND, ATOM, camera=camera)) == 2


def ellipsoid(center, axes):
    return Ellipsoid(tuple(center), *(tuple(each) for each in axes.T))


@pytest.mark.parametrize("seed", range(5))
def test_ends_in_ellipsoids_are_left_out(seed):
    """Against points of the rims: none is left out wrongly, and few are kept that are within."""
    rng = np.random.default_rng(seed)
    print("seed", seed)
    angle = np.linspace(0.0, 2.0 * np.pi, 720)
    wrong = missed = within = 0
    for _ in range(200):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.2, 0.6, 3)
        center = np.array(BOND.end) + rng.uniform(-0.15, 0.15, 3)
        rim = np.array([np.cos(angle), np.sin(angle), 0.0 * angle]) * 0.25
        local = np.linalg.solve(axes, rim + np.array(BOND.end)[:, None] - center[:, None])
        is_in = np.linalg.norm(local, axis=0).max() < 1.0
        left_out = len(ends(BOND, ellipsoid(center, axes))) == 1
        wrong += left_out and not is_in
        missed += is_in and not left_out
        within += is_in
    assert wrong == 0 and missed < 0.3 * within and within > 20


def test_ends_in_an_ellipsoid_that_holds_the_camera_are_kept():
    atom = ellipsoid(BOND.end, np.diag([3.0, 0.5, 0.5]))
    within, beside = (np.array(place) for place in ((2.5, 0.0, 2.0), (0.0, 2.5, 2.0)))
    assert len(ends(BOND, atom, camera=(within, np.zeros(3)))) == 2
    assert len(ends(BOND, atom, camera=(beside, np.zeros(3)))) == 1


def test_points_of_no_radius_hide_no_end():
    slot = np.zeros(2, dtype=np.int64)
    points = Spheres(np.zeros((3, 2)), np.array([0.0, 0.5]), slot, (ATOM.material,))
    cone = Cylinder(BOND.end, BOND.start, 0.25, end_radius=0.0)
    assert len(ends(BOND, points)) == 1 and len(ends(cone, points)) == 1


def test_ends_between_halves_of_a_bond_are_left_out():
    other = Cylinder((0.0, 0.0, 2.0), (0.0, 0.0, 3.0), 0.25)
    assert [each.center[2] for each in ends(BOND, other)] == [0.0, 3.0]
    assert len(ends(BOND, Cylinder((0.0, 0.0, 2.0), (0.0, 0.0, 3.0), 0.2))) == 4
    assert len(ends(BOND, Cylinder((0.0, 0.0, 2.0), (0.0, 1.0, 3.0), 0.25))) == 4


def test_ends_of_cones_have_their_own_radii():
    first, last = ends(Cylinder(BOND.start, BOND.end, 0.25, end_radius=0.5))
    np.testing.assert_allclose(np.linalg.norm([first.half_u, last.half_u], axis=1), (0.25, 0.5))
    (base,) = ends(Cylinder(BOND.start, BOND.end, 0.25, end_radius=0.0))
    assert base.center == BOND.start
