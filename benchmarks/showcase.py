# SPDX-License-Identifier: GPL-3.0-or-later
"""The README's pictures: all three effects at once, and what each colour of the mask means."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from paper_scenes import look_at
from pictures import mask_picture, overlay_picture, result_picture, save, sheet

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    DiskLight,
    Material,
    Motion,
    Quad,
    QuadLight,
    Scene,
    Sphere,
)
from adaptive_drt.scene.settings import Settings

ROOT = Path(__file__).resolve().parent.parent
SIZE = (720, 420)
SETTINGS = Settings(light_rays=144, time_rays=144, pixel_rays=36)
"""More rays than the defaults: the picture is to look at."""


def showcase_scene() -> Scene:
    """Still and moving spheres, a wall, a quad light and a soft point light."""
    balls = (
        Sphere((-3.0, 0.6, 1.0), 1.0, Material((0.75, 0.13, 0.10)), name="Red"),
        Sphere((2.9, 1.0, 1.1), 1.1, Material((0.10, 0.48, 0.20)), name="Green"),
        Sphere((-1.0, 2.6, 1.25), 1.25, Material((0.12, 0.26, 0.75)), name="Blue"),
        Sphere((1.7, -1.6, 0.42), 0.42, Material((0.85, 0.84, 0.80)), name="White"),
        Sphere((-1.7, -1.5, 0.26), 0.26, Material((0.80, 0.45, 0.10)), name="Small"),
        Sphere(
            (0.1, -0.2, 1.15),
            0.62,
            Material((0.85, 0.66, 0.12)),
            Motion((1.3, 0.0, 0.25)),
            "Moving",
        ),
    )
    floor = Quad(
        (-12.0, -12.0, 0.0), (24.0, 0.0, 0.0), (0.0, 24.0, 0.0), Material((0.62, 0.60, 0.57))
    )
    wall = Quad(
        (-5.2, 4.6, 0.0),
        (10.4, 0.0, 0.0),
        (0.0, 0.0, 3.4),
        Material((0.50, 0.42, 0.36)),
        name="Wall",
    )
    quad = QuadLight((-2.6, -2.4, 6.0), (0.8, 0.0, 0.0), (0.0, -0.8, 0.3), (42.0, 40.0, 37.0))
    point = DiskLight((4.6, -3.2, 3.6), 0.3, (44.0, 34.0, 24.0))
    camera = look_at((0.0, -9.6, 4.3), (0.0, 0.6, 0.75), 40.0, 1)
    return Scene(
        replace(camera, resolution=SIZE), (*balls, floor, wall), (quad, point), (0.02, 0.03, 0.05)
    )


def main() -> None:
    """Render the README's pictures."""
    parser = argparse.ArgumentParser(description="The README's pictures.")
    parser.add_argument("--pictures", type=Path, default=ROOT / "docs" / "pictures")
    given = parser.parse_args()
    scene = showcase_scene()
    film = render_image(scene, SETTINGS)
    pair = [("result", result_picture(film)), ("mask", mask_picture(film))]
    save(sheet(pair, columns=2, side=460), given.pictures / "showcase.png")
    save(overlay_picture(film), given.pictures / "showcase-overlay.png")
    print(film.stats["counts"], film.stats["seconds"]["total"])


if __name__ == "__main__":
    main()
