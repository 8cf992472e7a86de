# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines of a mesh: what clusters leave out, and that numbers of faces are those of rays."""

import numpy as np
import pytest

from adaptive_drt.geometry.line_crossings import LightLines
from adaptive_drt.geometry.mesh.bvh import FaceTree
from adaptive_drt.geometry.mesh.outline_edges import OutlineEdges
from mesh_shapes import ball_mesh, bumpy_mesh, grid_mesh, triangle_soup

SOUP = triangle_soup(np.random.default_rng(3), 30, 0.4)
MESHES = {
    "ball": ball_mesh(30, 20),
    "bumpy": bumpy_mesh(24, 16, bumps=0.3),
    "open": grid_mesh(6, lambda x, y: 1.2 + 0.3 * np.sin(2.0 * x) * y, size=1.6),
}
CORNER, ALONG, ACROSS = (
    np.array(each)[:, None] for each in ((-0.8, -0.7, 4.0), (1.6, 0.1, 0.2), (0.1, 1.4, 0.0))
)
COUNT = 11


def vertices_of(name):
    if name == "soup":
        return SOUP.vertices + np.array([[0.0], [0.0], [1.4]]), SOUP.faces
    return MESHES[name].vertices, MESHES[name].faces


@pytest.mark.parametrize("name", [*MESHES, "soup"])
def test_numbers_of_faces_between_crossings_are_those_of_rays(name):
    vertices, faces = vertices_of(name)
    rng = np.random.default_rng(1)
    point = np.array([*rng.uniform(-1.2, 1.2, (2, 12)), np.zeros(12)])
    lines = LightLines(CORNER, ALONG, ACROSS, COUNT, point)
    found = OutlineEdges.make(vertices, faces).crossings(point, lines)
    assert not found.unknown.size and found.line.size > 30
    u, v = (np.arange(200) + 0.5) / 200, lines.positions
    to = CORNER[:, None] + ALONG[:, None] * u + ACROSS[:, None] * v[:, None]
    tree = FaceTree(vertices, faces)
    for k in range(12):
        way = (to - point[:, k, None, None]).reshape(3, -1)
        ray = tree._hits(np.tile(point[:, k : k + 1], way.shape[1]), way, np.ones(way.shape[1]))[0]
        truth = np.bincount(ray, minlength=way.shape[1]).reshape(COUNT, 200)
        own = (found.line // COUNT == k).nonzero()[0]
        depth = np.zeros((COUNT, 201))
        line, at = found.line[own] % COUNT, np.ceil(found.place[own] * 200 - 0.5).astype(int)
        np.add.at(depth, (line, np.clip(at, 0, 200)), found.change[own])
        depth = depth.cumsum(axis=1)[:, :200]
        off = (depth - depth[:, :1]) - (truth - truth[:, :1])
        # a ray of the comparison may pass just beside an edge
        assert (off != 0).mean() < 2e-3


@pytest.mark.parametrize("name", [*MESHES, "soup"])
def test_crossings_do_not_depend_on_the_points_beside(name):
    vertices, faces = vertices_of(name)
    edges = OutlineEdges.make(vertices, faces)
    rng = np.random.default_rng(2)
    point = np.array([*rng.uniform(-1.2, 1.2, (2, 8)), np.zeros(8)])
    both = edges.crossings(point, LightLines(CORNER, ALONG, ACROSS, COUNT, point))
    for k in range(8):
        alone = np.ascontiguousarray(point[:, k : k + 1])
        one = edges.crossings(alone, LightLines(CORNER, ALONG, ACROSS, COUNT, alone))
        own = (both.line // COUNT == k).nonzero()[0]
        order, other = (np.lexsort((c.place, c.line)) for c in (one, both))
        other = other[np.isin(other, own)]
        np.testing.assert_array_equal(one.place[order], both.place[other])
        np.testing.assert_array_equal(one.change[order], both.change[other])


def test_a_closed_mesh_has_no_lone_edges_and_an_open_one_has():
    closed = OutlineEdges.make(*vertices_of("ball"))
    assert (closed.turn.sum(axis=0) == 0.0).all()
    border = OutlineEdges.make(*vertices_of("open"))
    assert (np.abs(border.turn.sum(axis=0)) == 1.0).sum() == 4 * 6
