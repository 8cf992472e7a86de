# SPDX-License-Identifier: GPL-3.0-or-later
"""From how many thin faces rays cost less than closed forms: times of fences rendered as both.

Fences of three-sided bars over a floor under a square light. Their bars are 1, 2, 4 and 8 cm wide,
fill a fifth of 3 m and are about 0.15 to 1 pixels wide; with a longer lens up to 8 times that.
Prints, for each fence and tolerance, the processor seconds of closed forms and of the mesh, and
what `geometry.polygon.thin_faces` chooses. Closed forms of the finest fences take minutes and more.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from paper_scenes import look_at

from adaptive_drt.geometry.polygon import thin_faces
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Material as Matt
from adaptive_drt.scene.description import Quad, QuadLight, Quads, Scene
from adaptive_drt.scene.settings import Settings

WIDTH, HEIGHT, SPACING = 3.0, 1.8, 5.0
"""Metres, the size of a fence; and the distance of its bars over their width."""
ALWAYS, NEVER = 0.0, float("inf")
"""Numbers of faces from which fences are meshes."""


def fence(bar: float, lens: float) -> Scene:
    """A fence of bars so many metres wide, seen through a lens of so many millimetres."""
    left = np.arange(-0.5 * WIDTH, 0.5 * WIDTH, SPACING * bar)
    base = np.array([(0.0, 0.0), (bar, 0.0), (0.5 * bar, bar)])
    corner, edge = np.zeros((2, 3, 3, left.size))
    for side in range(3):
        corner[:2, side] = base[side][:, None]
        edge[:2, side] = (base[(side + 1) % 3] - base[side])[:, None]
    corner[0] += left
    up = np.zeros((3, 3 * left.size))
    up[2] = HEIGHT
    slot = np.zeros(3 * left.size, dtype=np.int64)
    bars = Quads(corner.reshape(3, -1), edge.reshape(3, -1), up, slot, (Matt((0.3, 0.3, 0.35)),))
    floor = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0))
    light = QuadLight((-1.5, -1.0, 4.5), (0.5, 0.0, 0.0), (0.0, -0.5, 0.0), (20.0, 20.0, 20.0))
    camera = replace(look_at((0.0, -5.0, 2.2), (0.0, 0.0, 0.6), 40.0, 64), resolution=(64, 48))
    return Scene(replace(camera, focal_length=lens * camera.focal_length), (bars, floor), (light,))


def seconds(scene: Scene, tolerance: float, least: float) -> float:
    """Processor seconds of a render in which so many thin faces make a mesh."""
    with mock.patch.object(thin_faces, "LEAST_FACES", least):
        began = time.process_time()
        render_image(scene, Settings(tolerance=tolerance, threads=1))
        return time.process_time() - began


def main() -> None:
    """Print a line for each fence."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bars", type=float, nargs="+", default=[0.08, 0.04], help="metres")
    parser.add_argument("--lenses", type=float, nargs="+", default=[1.0, 4.0], help="factors")
    parser.add_argument("--tolerances", type=float, nargs="+", default=[1e-2, 1e-3])
    given = parser.parse_args()
    print("faces, lens, tolerance: closed forms, mesh, chosen")
    for bar in given.bars:
        for lens in given.lenses:
            for tolerance in given.tolerances:
                scene = fence(bar, lens)
                mesh = seconds(scene, tolerance, ALWAYS)
                closed = seconds(scene, tolerance, NEVER)
                count = scene.shapes[0].count
                rays = count >= thin_faces.rays_cost_less_from(tolerance)
                print(
                    f"{count}, {lens:g}, {tolerance:g}: {closed:.2f} s, {mesh:.2f} s, "
                    f"{'mesh' if rays else 'closed'}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
