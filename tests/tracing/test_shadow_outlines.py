# SPDX-License-Identifier: GPL-3.0-or-later
"""From which patches the visible part of a light may change."""

import numpy as np

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Quad, QuadLight, Scene, SkyLight
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, Surface
from adaptive_drt.tracing.occluder_culling import Occluders
from adaptive_drt.tracing.shadow_outlines import ShadowOutlines
from mesh_shapes import mesh_of
from random_meshes import random_mesh_scene
from random_scenes import look_at

FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0))
LAMP = QuadLight((0.0, 0.0, 3.0), (0.05, 0.0, 0.0), (0.0, -0.05, 0.0), (9.0, 9.0, 9.0))


def reached_along(light, widths):
    """Whether outlines of a plate of a metre reach patches (n,) along the x axis of a floor."""
    corners = np.array([[-0.5, 0.5, 0.5, -0.5], [-0.5, -0.5, 0.5, 0.5], [1.0] * 4])
    plate = mesh_of(corners, np.array([(0, 1, 2), (0, 2, 3)]).T)
    camera = look_at((0.0, -4.0, 4.0), (0.0, 0.0, 0.0), resolution=(8, 8))
    plan = make_plan(Scene(camera, (FLOOR, plate), (light,)), Settings())
    occluders = Occluders(plan)
    x = np.linspace(0.0, 2.0, widths)
    place = np.array([x, np.zeros(widths), np.zeros(widths)]) - np.array([[0.0], [-4.0], [4.0]])
    kinds = plan.shapes.sampled
    own = np.full(widths, int((~kinds).nonzero()[0][0]))
    up = np.repeat([[0.0], [0.0], [1.0]], widths, axis=1)
    hits = Surface(place, up, own, np.zeros(widths, dtype=np.bool_))
    item = np.full(widths, int(kinds.nonzero()[0][0]))
    assert isinstance(occluders.outlines, ShadowOutlines)
    near = occluders.outlines.before(0, hits, np.full(widths, 0.02), Pairs(np.arange(widths), item))
    return x, near.reached(*np.array([[True], [False]]).repeat(widths, axis=1)) & near.near


def test_only_the_border_of_a_shadow_is_reached():
    x, found = reached_along(LAMP, 201)
    # by similar triangles from the light's edge
    border = np.abs(x - 0.75) < 0.5 * 0.05 + 1e-9
    assert found[border].all()
    assert not found[np.abs(x - 0.75) > 0.15].any()


def test_nothing_is_proven_under_a_sky():
    assert reached_along(SkyLight((1.0, 1.0, 1.0)), 21)[1].all()


def test_patches_that_are_all_unsure_need_no_outlines():
    """Another object decides of all patches before this mesh: no shaft is left to test."""
    scene = random_mesh_scene(81, (16, 12))
    color = render_image(scene, Settings(tolerance=1e-2, threads=1)).color
    assert np.isfinite(color).all() and color.any()
