# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that another object hides just in front of their own are moved in, by plain rays."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.cubature.node_clipping import SCALES, clip_nodes
from adaptive_drt.scene.description import Sphere
from adaptive_drt.visibility.fragments import Boxes, find_fragments
from plain_hits import oracle_hits
from visibility_boxes import FLOOR, PLAIN, every_pair, planned

SHAPES = (Sphere((0.2, -1.0, -5.0), 1.1), Sphere((-0.8, -0.6, -5.5), 0.9), FLOOR)


def fragments_of(plan):
    y, x = (part.ravel().astype(float) for part in np.mgrid[2:14, 2:22])
    low = np.stack([x, y, 0.0 * x])
    boxes = Boxes(low, low + np.array([[1.0], [1.0], [0.0]]))
    return find_fragments(plan, boxes, every_pair(plan, x.size), 1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_nodes_are_moved_in_until_they_see_their_own_object(seed):
    rng = np.random.default_rng(seed)
    plan = planned(*SHAPES)
    found = fragments_of(plan)
    region = np.repeat(np.flatnonzero(found.item >= 0), 4)
    size = region.size
    middle = found.centroid[:, region]
    arm = rng.uniform(-0.6, 0.6, (3, size)) * np.array([[1.0], [1.0], [0.0]])
    half = np.tile([[0.5], [0.5], [0.0]], size)
    lot = np.arange(size) // 2
    part, stray = clip_nodes(plan, found, region, middle, arm, half, lot)
    assert np.isin(part, SCALES).all()
    np.testing.assert_array_equal(part[::2], part[1::2])
    own = found.item[region]

    def hidden(scale):
        """Nodes at a scale that see another object of their box."""
        at = middle + scale * arm
        hit = oracle_hits(PLAIN, SHAPES, *at)
        shown = [set(found.item[found.box == box]) for box in range(found.box.max() + 1)]
        other = np.array([h in shown[b] for h, b in zip(hit, found.box[region], strict=True)])
        return (hit != own) & (hit >= 0) & other

    either = np.zeros(size, dtype=bool)
    for scale, wider in zip(SCALES[1:], SCALES, strict=False):
        moved = part <= scale
        either = hidden(wider).reshape(-1, 2).any(axis=1).repeat(2)
        # what was moved in was hidden where it stood before, or its twin was
        assert either[moved].all(), f"seed {seed}"
    assert hidden(0.0)[stray].all()
    alone = np.bincount(found.box)[found.box[region]] == 1
    assert (part[alone] == 1.0).all() and not stray[alone].any()
    assert 0 < (part < 1.0).sum() < size
    # things that touch hide nodes within their contact: nearly all see their own object now
    still = hidden(1.0) & (part == 1.0)
    assert still.sum() < 0.5 * hidden(1.0).sum() + 10, f"seed {seed}"
