# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions do not hang on the order in which the scene lists its objects."""

import numpy as np
import pytest

from adaptive_drt.scene.description import Sphere
from adaptive_drt.visibility.fragments import Boxes, find_fragments
from visibility_boxes import every_pair, planned


@pytest.mark.parametrize("away", (5.0, 0.0))
def test_lines_do_not_depend_on_the_scenes_order(away):
    """Which axis they run along hangs on seams, and seams are those of neighbours in depth.

    Spheres that cut each other, in front of the camera or around it: there all begin at 0.
    """
    y, x = (part.ravel() for part in np.mgrid[8:16:2, 8:16:2].astype(float))
    boxes = Boxes(np.stack([x, y, 0.0 * x]), np.stack([x + 2.0, y + 2.0, 0.0 * x]))
    for seed in range(40):
        rng = np.random.default_rng(seed)
        shapes = [
            Sphere((a, b, c - away), float(rng.uniform(0.8, 1.3)))
            for a, b, c in (0.3 * rng.normal(size=(4, 3))).tolist()
        ]
        found = [
            find_fragments(planned(*(shapes[k] for k in order)), boxes, pairs, 1e-2)
            for order in (range(4), rng.permutation(4))
            for pairs in [every_pair(planned(*shapes), x.size)]
        ]
        for one, two in zip(*(lines_of(each, boxes) for each in found), strict=True):
            np.testing.assert_allclose(one, two, rtol=0.0, atol=1e-9, err_msg=f"seed {seed}")


def lines_of(found, boxes):
    """What does not name objects: each box's weights and errors in order of size."""
    for values in (found.weight, found.error):
        order = np.lexsort((values, found.box))
        yield values[order]
