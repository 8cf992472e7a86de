# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows and slits of light thinner than a pixel: are they met wherever they lie?

First, the shadow of a bar lies between the centres of two rows, or across those of one. Then random
scenes: wires, fences, needles, and slots in plates, along rows and columns of pixels and across, of
hard and soft shadows. The camera sees the floor alone, from below what casts the shadows. One line
for each scene: error over each tolerance, less that of the truth, and the stated error.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "helpers")]

from adaptive_drt.render import render_image  # noqa: E402
from adaptive_drt.scene.description import (  # noqa: E402
    Material,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    SphereLight,
)
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


SMALL, EYE = (20, 15), 0.45
"""Pixels of the pictures of random scenes, and height of their camera, metres."""
FINE = 0.0162
"""Size of a pixel of these on the floor, metres, roughly."""
TOLERANCES = (1e-2, 1e-3)
POWER = 9.0
"""Power of the lights of random scenes, over their solid angle in which they shine evenly."""
CORNERS = [(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
"""Corners of a box, and the corners of its sides."""


def boxes(parts):
    """A mesh of boxes, by their middles and half edges (3,)."""
    points, faces = [], []
    for number, (middle, *edges) in enumerate(parts):
        points += [middle + np.array(signs) @ np.array(edges) for signs in CORNERS]
        for a, b, c, d in SIDES:
            faces += [8 * number + np.array(each) for each in ((a, b, c), (a, c, d))]
    return mesh_of(np.array(points).T, np.array(faces).T)


def needles(rng, middle, along, across, width):
    """Some thin pyramids."""
    up, points, faces = np.array([0.0, 0.0, 1.0]), [], []
    for k in range(rng.integers(1, 6)):
        foot = middle + rng.uniform(-0.15, 0.15) * across + rng.uniform(-0.1, 0.1) * along
        way = rng.uniform(0.1, 0.5) * along + rng.uniform(-0.02, 0.2) * up
        for a, b in ((0.5, 0.0), (-0.25, 0.4), (-0.25, -0.4)):
            points.append(foot + width * (a * across + b * up))
        points.append(foot + way + 0.02 * rng.normal() * across)
        faces += [4 * k + np.array(x) for x in ((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1))]
    return mesh_of(np.array(points).T, np.array(faces).T)


def lamp_of(rng):
    """A light of some kind."""
    place = (rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), rng.uniform(2.5, 3.5))
    size, kind = 10.0 ** rng.uniform(-3.0, -0.7), rng.integers(0, 4)
    if kind == 0:
        return PointLight(place, (POWER,) * 3)
    if kind == 1:
        return SphereLight(place, size, (POWER / (np.pi * size * size),) * 3)
    turn, part = rng.uniform(0.0, 3.0), rng.uniform(0.2, 1.0)
    u = size * np.array([np.cos(turn), np.sin(turn), 0.0])
    v = part * size * np.array([np.sin(turn), -np.cos(turn), 0.0])
    return QuadLight(place, tuple(u), tuple(v), (POWER / (4.0 * part * size * size),) * 3)


def random_thin_scene(seed):
    """What casts thin shadows, in words, and the scene."""
    rng = np.random.default_rng(seed)
    kind = ("wire", "fence", "needles", "slot", "slots")[seed % 5]
    lamp = lamp_of(rng)
    turn = rng.choice([0.0, 0.5 * np.pi, 0.01, -0.03, rng.uniform(-1.6, 1.6)])
    along = np.array([np.cos(turn), np.sin(turn), 0.0])
    across, up = np.array([-np.sin(turn), np.cos(turn), 0.0]), np.array([0.0, 0.0, 1.0])
    height, width = rng.uniform(0.6, 1.5), FINE * 10.0 ** rng.uniform(-1.5, 0.0)
    # the shadow of its middle is in the picture
    on_floor = np.array([*rng.uniform(-0.06, 0.06, 2), 0.0])
    middle = on_floor + height / lamp.center[2] * (np.array(lamp.center) - on_floor)
    pitch = FINE * rng.choice([1.0, rng.uniform(0.7, 4.0)])
    thin, rows = min(width, 0.4 * pitch), np.arange(rng.integers(3, 10)) - 3.0
    if kind == "needles":
        mesh = needles(rng, middle, along, across, width)
    elif kind == "wire":
        mesh = boxes([(middle, 4.0 * along, 0.5 * width * across, 0.5 * width * up)])
    elif kind == "slot":
        half = (4.0 * along, 2.0 * across, 1e-3 * up)
        mesh = boxes([(middle + s * (2.0 + 0.5 * width) * across, *half) for s in (-1, 1)])
    else:
        wide = 0.5 * (thin if kind == "fence" else pitch - thin)
        half = (4.0 * along, wide * across, 0.5 * min(thin, 1e-3) * up)
        mesh = boxes([(middle + k * pitch * across, *half) for k in rows])
    camera = look_at((0.0, -1e-3, EYE), (0.0, 0.0, 0.0), resolution=SMALL)
    words = f"{seed} {kind}, {width / FINE:.2f} pixels, {type(lamp).__name__}"
    return words, Scene(camera, (FLOOR, mesh), (lamp,), (0.1, 0.1, 0.1))


def compare(words, scene, points):
    """Print the errors of a scene."""
    truths = [sampled_mesh_picture(scene, points, seed) for seed in range(2)]
    truth = np.mean(truths, axis=0)
    noise = 0.5 * np.sqrt(((truths[0] - truths[1]) ** 2).mean()) / truth.mean()
    parts = [f"{words} (truth {noise:.0e})"]
    for tolerance in TOLERANCES:
        film = render_image(scene, Settings(tolerance=tolerance, threads=1))
        error = np.sqrt(((film.color - truth) ** 2).mean()) / truth.mean()
        error = np.sqrt(max(error**2 - noise**2, 0.0)) / tolerance
        stated = film.stats["error_estimate"] / tolerance
        parts.append(f"{tolerance:g}: {error:.2f} ({stated:.2f}){' !' * bool(error > 1.0)}")
    print(" | ".join(parts), flush=True)


def main() -> None:
    """Print a line for each place of the bar, and for each random scene."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0, help="first seed of random scenes")
    parser.add_argument("--count", type=int, default=40, help="number of random scenes")
    options = parser.parse_args()
    for offset in np.linspace(0.0, PITCH, PLACES) if not options.first else ():
        compare(f"{offset:.4f} m", scene_of(1.2 + offset), POINTS)
    for seed in range(options.first, options.first + options.count):
        compare(*random_thin_scene(seed), 2 * POINTS)


if __name__ == "__main__":
    main()
