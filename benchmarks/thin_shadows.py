# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows thinner than a pixel, along rows of pixels: are they met wherever they lie?

The shadow of a bar out of the picture lies between the centres of two rows, or across those of one.
Rays from centres alone cannot tell the first case from a floor that is fully lit. One line for each
place of the bar: error over each tolerance, and the stated error. A finding, not a test: at some
places the shadow is stepped over.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "helpers")]

from adaptive_drt.render import render_image  # noqa: E402
from adaptive_drt.scene.description import Material, Quad, QuadLight, Scene  # noqa: E402
from adaptive_drt.scene.settings import Settings  # noqa: E402
from mesh_shapes import mesh_of  # noqa: E402
from oracle.mesh_rays import sampled_mesh_picture  # noqa: E402
from random_scenes import look_at  # noqa: E402

SIZE, PITCH = (32, 24), 0.09
"""Pixels of the picture, and their size on the floor, metres, roughly."""
WIDTH, LIGHT = 0.03, 0.05
"""Width of the bar, and half a side of the light, metres: the shadow has half a pixel's width."""
PLACES, POINTS = 9, 1_024
"""Number of places of the bar, and points a pixel of the truth."""
FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.8, 0.8)))
LAMP = QuadLight((0.0, 3.0, 3.0), (LIGHT, 0.0, 0.0), (0.0, -LIGHT, 0.0), (900.0, 900.0, 900.0))


def scene_of(place):
    """A bar along the rows of a picture from above; place is its y, metres."""
    x, y = 6.0 * np.array([-1.0, 1.0, 1.0, -1.0]), place + WIDTH * np.array([0.0, 0.0, 1.0, 1.0])
    bar = mesh_of(np.array([x, y, np.ones(4)]), np.array([(0, 1, 2), (0, 2, 3)]).T)
    camera = look_at((0.0, -1e-3, 4.0), (0.0, 0.0, 0.0), resolution=SIZE)
    return Scene(camera, (FLOOR, bar), (LAMP,), (0.1, 0.1, 0.1))


def main() -> None:
    """Print a line for each place of the bar."""
    for offset in np.linspace(0.0, PITCH, PLACES):
        scene = scene_of(1.2 + offset)
        truth = np.mean([sampled_mesh_picture(scene, POINTS, seed) for seed in range(2)], axis=0)
        words = [f"{offset:.4f} m"]
        for tolerance in (1e-2, 1e-3):
            film = render_image(scene, Settings(tolerance=tolerance, threads=1))
            error = np.sqrt(((film.color - truth) ** 2).mean()) / truth.mean()
            stated = film.stats["error_estimate"]
            words.append(f"{tolerance:g}: {error / tolerance:.2f} ({stated / tolerance:.2f})")
        print(" | ".join(words), flush=True)


if __name__ == "__main__":
    main()
