# SPDX-License-Identifier: GPL-3.0-or-later
"""What all scenes on the edge of a decision share: the record, the camera, and places to touch."""

from dataclasses import dataclass

import numpy as np

from adaptive_drt.scene.description import PointLight, Quad, Scene
from oracle.exact_mask import directions, floor_points
from random_scenes import look_at

__all__ = [
    "EDGE",
    "HEIGHT",
    "LAMP",
    "MOTION",
    "PENUMBRA",
    "WIDTH",
    "Case",
    "across",
    "beside",
    "chosen_point",
    "floor",
    "light_place",
    "off",
    "raster",
    "some_camera",
    "vector",
]

WIDTH, HEIGHT = 12, 10
FLOOR_HALF = 1e3
LAMP = PointLight((0.0, 0.0, 50.0), (1.0,) * 3, casts_shadow=False)
PENUMBRA, MOTION, EDGE = 0, 1, 2
ORACLE_ROUNDING = 1e-16
"""Of a radius: what the truth itself may be off by."""


@dataclass(frozen=True)
class Case:
    """A scene, the effects that are switched on, and the truth of one row of the mask.

    `margin` (height, width) float64: by how much a pixel depends on the domain (positive), or
    does not, of the object's radius; NaN where it is not said. `bound`: what still counts as
    touching, in the same unit: 1e-9 of the radius, or 1e-11 of the distance where that is more.
    """

    scene: Scene
    switches: dict
    row: int
    margin: np.ndarray
    bound: np.ndarray

    @classmethod
    def make(cls, scene, switches, row, margin, half):
        """Arrays (n,) in extended precision to pictures; `half` (n,) the object's half angle."""
        shape = (HEIGHT, WIDTH)
        bound = np.maximum(1e-9, 1e-11 / np.asarray(half, dtype=float)) + np.zeros(WIDTH * HEIGHT)
        margin = np.asarray(margin, dtype=float).reshape(shape)
        return cls(scene, switches, row, margin, bound.reshape(shape))

    def left_out(self, mask):
        """Margins of the pixels that depend and are not in the mask (height, width)."""
        return self.margin[(self.margin > ORACLE_ROUNDING) & ~mask]

    def counts(self, mask):
        """Pixels that depend, and that are flagged, but for those that touch: (2,)."""
        known = ~np.isnan(self.margin) & (np.abs(self.margin) > self.bound)
        return np.array([(known & (self.margin > 0.0)).sum(), (known & mask).sum()])


def some_camera(rng):
    turn = rng.uniform(0.0, 2.0 * np.pi)
    # steep enough that the floor fills the picture
    place = np.array([np.cos(turn), np.sin(turn), rng.uniform(1.2, 3.0)]) * rng.uniform(3.0, 6.0)
    target = (*rng.uniform(-1.0, 1.0, 2), 0.0)
    return look_at(
        tuple(place.tolist()),
        tuple(float(x) for x in target),
        resolution=(WIDTH, HEIGHT),
        focal_length=float(rng.uniform(40.0, 400.0)),
    )


def floor():
    return Quad(
        (-FLOOR_HALF, -FLOOR_HALF, 0.0), (2.0 * FLOOR_HALF, 0.0, 0.0), (0.0, 2.0 * FLOOR_HALF, 0.0)
    )


def raster():
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    return columns.ravel().astype(float), rows.ravel().astype(float)


def vector(values):
    return tuple(float(x) for x in np.ravel(values))


def off(rng):
    """How far from touching: 1e-3 to 1e-12 of a radius, inside or outside."""
    return float(10.0 ** rng.uniform(-12.0, -3.0) * rng.choice([-1.0, 1.0]))


def chosen_point(rng, camera):
    """A point of the floor at the centre of a random pixel."""
    i, j = rng.integers(2, WIDTH - 2), rng.integers(2, HEIGHT - 2)
    way = directions(camera, [i + 0.5], [j + 0.5])
    return np.asarray(floor_points(camera, way)[0][:, 0], dtype=float)


def across(rng, axis):
    side = np.cross(axis, rng.normal(size=3))
    return side / np.linalg.norm(side)


def light_place(rng, point):
    """Where a light stands well above the floor as seen from a point, and the way to it."""
    way = rng.normal(size=3)
    way[2] = abs(way[2]) + 1.5
    way /= np.linalg.norm(way)
    return point + way * rng.uniform(3.0, 8.0), way


def beside(rng, point, way, angle, distance):
    """A place at an angle from a direction as seen from a point."""
    side = across(rng, way)
    return point + distance * (np.cos(angle) * way + np.sin(angle) * side)
