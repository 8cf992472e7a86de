# SPDX-License-Identifier: GPL-3.0-or-later
"""A molecule of balls and sticks under a softbox and a sky, and what sticks cost beside meshes.

    python benchmarks/sticks.py [--picture FILE] [--speed] [--size 300]

The molecule is caffeine, by the coordinates of PubChem (CID 2519, 3D conformer; Kim et al., Nucleic
Acids Research 51, 2023). `--speed` renders 100 balls and 100 sticks under a square light, at 1 %,
with the sticks as cylinders and as meshes of 32 smooth sides, on one thread; CPU seconds count.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from paper_scenes import look_at
from pictures import result_picture, save, sheet

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Cylinder,
    Light,
    Material,
    Quad,
    QuadLight,
    Scene,
    Shape,
    ShapeRecord,
    SkyLight,
    Sphere,
    vector_of,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.scene.triangle_mesh import TriangleMesh

PICTURE = Path(__file__).resolve().parent.parent / "docs" / "pictures" / "sticks.png"
ATOMS = """
O 0.4700 2.5688 0.0006    O -3.1271 -0.4436 -0.0003  N -0.9686 -1.3125 0.0000
N 2.2182 0.1412 -0.0003   N -1.3477 1.0797 -0.0001   N 1.4119 -1.9372 0.0002
C 0.8579 0.2592 -0.0008   C 0.3897 -1.0264 -0.0004   C 0.0307 1.4220 -0.0006
C -1.9061 -0.2495 -0.0004 C 2.5032 -1.1998 0.0003    C -1.4276 -2.6960 0.0008
C 3.1926 1.2061 0.0003    C -2.2969 2.1881 0.0007    H 3.5163 -1.5787 0.0008
H -1.0451 -3.1973 -0.8937 H -2.5186 -2.7596 0.0011   H -1.0447 -3.1963 0.8957
H 4.1992 0.7801 0.0002    H 3.0468 1.8092 -0.8992    H 3.0466 1.8083 0.9004
H -1.8087 3.1651 -0.0003  H -2.9322 2.1027 0.8881    H -2.9346 2.1021 -0.8849
"""
"""Element and place, angstroms, of each atom of caffeine."""
LOOKS = {
    "C": (0.40, (0.10, 0.10, 0.11)),
    "N": (0.40, (0.10, 0.18, 0.62)),
    "O": (0.40, (0.62, 0.06, 0.05)),
    "H": (0.26, (0.80, 0.80, 0.78)),
}
"""Radius, angstroms, and colour of the balls of each element."""
BOND, HYDROGEN_BOND = 1.65, 1.2
"""Longest bonds, angstroms: between any two atoms, and of hydrogen."""
STICK = 0.14
"""Radius of the sticks, angstroms."""
LIGHTS: dict[str, Light] = {
    "softbox": QuadLight((-3.0, -5.0, 9.0), (2.0, 0.0, 0.0), (0.0, -1.6, -1.0), (12.0, 11.7, 11.2)),
    "sky": SkyLight((1.0, 1.0, 1.0)),
}
STICKS = Material((0.6, 0.6, 0.6))
"""Material of the sticks that are compared with meshes."""
SIDES = 32
"""Number of sides of sticks as meshes."""


def molecule() -> list[Shape]:
    """Balls, and sticks of two halves in the colours of their atoms, metres for angstroms."""
    words = ATOMS.split()
    elements = words[::4]
    place = np.array(words, dtype=object).reshape(-1, 4)[:, 1:].astype(np.float64)
    tilt = np.deg2rad(52.0)
    turn = np.array(
        [[1.0, 0.0, 0.0], [0.0, np.cos(tilt), -np.sin(tilt)], [0.0, np.sin(tilt), np.cos(tilt)]]
    )
    place = place @ turn.T
    place[:, 2] -= place[:, 2].min() - LOOKS["H"][0]
    shapes: list[Shape] = []
    for element, center in zip(elements, place, strict=True):
        radius, color = LOOKS[element]
        shapes.append(Sphere(vector_of(center), radius, Material(color)))
    for i, one in enumerate(elements):
        for j in range(i):
            longest = HYDROGEN_BOND if "H" in (one, elements[j]) else BOND
            if np.linalg.norm(place[i] - place[j]) > longest:
                continue
            middle = vector_of((place[i] + place[j]) / 2.0)
            for k in (i, j):
                color = Material(LOOKS[elements[k]][1])
                shapes.append(Cylinder(vector_of(place[k]), middle, STICK, color))
    return shapes


def scene_of(shapes: list[Shape], light: Light, size: int) -> Scene:
    """Shapes on a floor before the camera."""
    floor = Quad(
        (-30.0, -30.0, 0.0), (60.0, 0.0, 0.0), (0.0, 60.0, 0.0), Material((0.60, 0.58, 0.55))
    )
    camera = look_at((1.5, -13.5, 9.0), (0.0, 0.0, 2.2), 42.0, 1)
    camera = replace(camera, resolution=(size, size * 3 // 4))
    return Scene(camera, (*shapes, floor), (light,), (0.03, 0.04, 0.06))


def random_sticks(count: int = 100) -> list[Shape]:
    """Balls in a box, and as many sticks from each to one of its nearest."""
    rng = np.random.default_rng(0)
    place = rng.uniform((-3.0, -3.0, 0.4), (3.0, 3.0, 3.6), (count, 3))
    shapes: list[Shape] = [
        Sphere(vector_of(each), 0.22, Material(vector_of(rng.uniform(0.2, 0.8, 3))))
        for each in place
    ]
    gap = np.linalg.norm(place[:, None] - place[None], axis=2)
    near = np.argsort(gap, axis=1)[:, 1 + rng.integers(2)]
    for one, other in zip(place, place[near], strict=True):
        shapes.append(Cylinder(vector_of(one), vector_of(other), 0.07, STICKS))
    return shapes


def as_mesh(sticks: list[Cylinder]) -> TriangleMesh:
    """Sticks as one mesh with smooth sides, without their ends, which are within balls."""
    angle, k = np.arange(SIDES) * 2.0 * np.pi / SIDES, np.arange(SIDES)
    after = (k + 1) % SIDES
    faces = np.concatenate([[k, after, after + SIDES], [k, after + SIDES, k + SIDES]], axis=1)
    places, normals = [], []
    for stick in sticks:
        start, way = np.array(stick.start), np.subtract(stick.end, stick.start)
        axis = way / np.linalg.norm(way)
        x = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        x /= np.linalg.norm(x)
        out = np.outer(x, np.cos(angle)) + np.outer(np.cross(axis, x), np.sin(angle))
        ring = start[:, None] + stick.radius * out
        places += [ring, ring + way[:, None]]
        normals.append(np.concatenate([out, out], axis=1)[:, faces].transpose(1, 0, 2))
    every = np.concatenate([faces + 2 * SIDES * n for n in range(len(sticks))], axis=1)
    return TriangleMesh(
        np.concatenate(places, axis=1),
        every,
        np.zeros(every.shape[1], dtype=np.int64),
        (STICKS,),
        normals=np.ascontiguousarray(np.concatenate(normals, axis=2)),
    )


def picture(file: Path, size: int) -> None:
    """Render the molecule under each light and save both pictures side by side."""
    found = []
    for name, light in LIGHTS.items():
        began = time.process_time()
        film = render_image(scene_of(molecule(), light, size), Settings(tolerance=0.005))
        print(f"{name}: {time.process_time() - began:.1f} CPU s, {film.stats['plan']}")
        found.append((name, result_picture(film)))
    save(sheet(found, columns=2, side=size), file)


def speed(size: int) -> None:
    """Print the CPU time of sticks as cylinders and as meshes."""
    shapes = random_sticks()
    sticks = [shape for shape in shapes if isinstance(shape, Cylinder)]
    meshes: list[ShapeRecord] = [s for s in shapes if not isinstance(s, Cylinder)]
    meshes.append(as_mesh(sticks))
    for name, own in (("cylinders", shapes), ("meshes", meshes)):
        scene = scene_of([], LIGHTS["softbox"], size)
        scene = replace(scene, shapes=(*own, *scene.shapes))
        began = time.process_time()
        film = render_image(scene, Settings(threads=1, tolerance=0.01))
        error = film.stats["error_estimate"]
        print(f"{name}: {time.process_time() - began:.1f} CPU s, estimated error {error:.4f}")


def main() -> None:
    """Render what the arguments ask for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--picture", type=Path, default=PICTURE)
    parser.add_argument("--speed", action="store_true", help="cylinders beside meshes instead")
    parser.add_argument("--size", type=int, default=300, help="width of a picture, pixels")
    given = parser.parse_args()
    if given.speed:
        speed(given.size)
    else:
        picture(given.picture, given.size)


if __name__ == "__main__":
    main()
