# SPDX-License-Identifier: GPL-3.0-or-later
"""Random elliptic cones, and which directions lie in them."""

import numpy as np

from adaptive_drt.geometry.elliptic_cones import cones_of_ellipses

MARGIN = 1e-12
"""How near to a boundary a point may not be to count as evidence, times 1 / b."""


def unit(rng, *shape):
    vectors = rng.normal(size=(3, *shape))
    return vectors / np.linalg.norm(vectors, axis=0)


def random_cones(rng, count, low, high, middle=None, spread=1.0):
    """Cones of ellipses of sizes 10^low to 10^high about `middle`, both seen from the origin."""
    center = (unit(rng, 1) if middle is None else middle) + spread * rng.normal(size=(3, count))
    size = 10.0 ** rng.uniform(low, high, (2, count))
    return cones_of_ellipses(
        center, size[0] * rng.normal(size=(3, count)), size[1] * rng.normal(size=(3, count))
    )


def form(cones, w):
    """Values that are negative inside, the sum of their positive terms, and heights."""
    x, y, z = ((axis * w).sum(axis=0) for axis in (cones.x, cones.y, cones.z))
    scale = (x / cones.a) ** 2 + (y / cones.b) ** 2
    return scale - z * z, scale, z
