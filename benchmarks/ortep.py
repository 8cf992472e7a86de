# SPDX-License-Identifier: GPL-3.0-or-later
"""A plate of thermal ellipsoids and bonds as crystallographers draw it, under a softbox and a sky.

    python benchmarks/ortep.py [--picture FILE] [--size 360] [--tolerance 0.005]

The molecule is C10 H14 N2 O2 S, N-tert-butyl-4-nitrobenzenesulfenamide, at 173 K: cell, coordinates
and anisotropic displacement parameters by W. Zhang, A. F. Cozzolino, A. H. Mahmoudkhani, M.
Tulumello, S. Mansour, I. Vargas-Baca, J. Phys. Chem. B 109, 18378 (2005), doi 10.1021/jp053142u,
entry 1506408 of the Crystallography Open Database, whose data are in the public domain.

The ellipsoids hold their atoms with a probability of 50 %; hydrogen has balls of one size, as in C.
K. Johnson, ORTEP, report ORNL-3794 (1965). Bonds are cylinders.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from pictures import result_picture, save, sheet
from sticks import LIGHTS, LOOKS, scene_of

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Cylinder,
    Ellipsoid,
    Material,
    Shape,
    Sphere,
    vector_of,
)
from adaptive_drt.scene.settings import Settings

PICTURE = Path(__file__).resolve().parent.parent / "docs" / "pictures" / "ortep.png"
CELL = np.array((24.370, 31.908, 5.941))
"""Edges of the cell, angstroms; it is orthorhombic, so all angles are right ones."""
ATOMS = """
C1 .30289 .05300 -.0281 .0247 .0283 .0270 -.0053 -.0014 -.0003
C2 .32649 .05830 -.2403 .0288 .0246 .0319 .0012 .0021 -.0028
C3 .34871 .02438 -.3499 .0274 .0357 .0297 -.0029 .0035 -.0037
C4 .34697 -.01469 -.2493 .0243 .0276 .0371 -.0057 -.0036 .0019
C5 .32345 -.02075 -.0395 .0323 .0296 .0374 .0061 -.0054 -.0013
C6 .30116 .01310 .0700 .0311 .0398 .0254 .0021 .0000 -.0023
C7 .23667 .15774 -.1366 .0308 .0278 .0410 -.0070 .0022 .0046
C8 .25932 .19140 -.2932 .0464 .0314 .0703 .0056 .0032 .0011
C9 .20306 .12670 -.2733 .0365 .0387 .0368 -.0019 .0005 -.0013
C10 .20076 .17723 .0465 .0515 .0501 .0475 -.0154 .0042 .0145
N1 .28533 .13612 -.0403 .0330 .0264 .0444 -.0089 -.0035 -.0019
N2 .37112 -.05053 -.3664 .0312 .0370 .0516 -.0122 -.0084 .0034
O1 .39152 -.04450 -.5539 .0641 .0537 .0545 -.0166 .0126 .0159
O2 .36986 -.08483 -.2752 .0465 .0268 .0816 -.0083 -.0093 .0043
S1 .27556 .094728 .13091 .0446 .0364 .0291 -.0057 .0042 .0064
"""
"""Label, fractional coordinates, and U11, U22, U33, U23, U13 and U12, square angstroms."""
HYDROGENS = """
.3069 .1519 .017   .3272 .0852 -.3085 .3652 .0278 -.4938 .3228 -.0478 .0272 .2845 .0094 .2132
.2849 .2093 -.2099 .2290 .2085 -.3512 .2786 .1781 -.4191 .2262 .1142 -.3903 .1721 .1413 -.3437
.1892 .1046 -.1740 .1881 .1553 .1494  .1690 .1909 -.0231 .2221 .1980 .1304
"""
"""Fractional coordinates."""
HALF_PROBABILITY = 1.5382
"""Half axis of the ellipsoid, in standard deviations, that holds a point of a normal distribution
in space with a probability of 50 %: the root of the median of chi squared of 3 degrees."""
HYDROGEN = 0.11
"""Radius of the balls of hydrogen, angstroms."""
BOND, HYDROGEN_BOND, SULPHUR_BOND = 1.65, 1.2, 1.9
"""Longest bonds, angstroms."""
RADIUS, HYDROGEN_RADIUS = 0.06, 0.045
"""Radii of bonds, angstroms."""
GROWN, ABOVE = 1.1, 0.4
"""Metres for an angstrom, and of the lowest atom above the floor."""
COLORS = {name: color for name, (_, color) in LOOKS.items()} | {"S": (0.66, 0.48, 0.05)}
BONDS = Material((0.55, 0.53, 0.5))


def atoms() -> tuple[list[str], np.ndarray, np.ndarray]:
    """Elements, places (n, 3) and displacement tensors (n, 3, 3), of hydrogen 0; angstroms."""
    words = ATOMS.split()
    rows = np.array(words, dtype=object).reshape(-1, 10)
    numbers = rows[:, 1:].astype(np.float64)
    spare = np.array(HYDROGENS.split(), dtype=np.float64).reshape(-1, 3)
    place = np.concatenate([numbers[:, :3], spare]) * CELL
    spread = np.zeros((len(place), 3, 3))
    # the axes of the reciprocal cell are those of the cell, of reciprocal lengths
    for column, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))):
        spread[: len(rows), i, j] = spread[: len(rows), j, i] = numbers[:, 3 + column]
    elements = [label.rstrip("0123456789") for label in rows[:, 0]] + ["H"] * len(spare)
    return elements, place, spread


def turned(place: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) that lays the molecule's longest direction along x, its plane upwards."""
    axes = np.linalg.svd(place - place.mean(axis=0))[2]
    axes[2] = np.cross(axes[0], axes[1])
    lean, roll = np.deg2rad(40.0), np.deg2rad(-12.0)
    tilt = np.array(
        [[1.0, 0.0, 0.0], [0.0, np.cos(lean), -np.sin(lean)], [0.0, np.sin(lean), np.cos(lean)]]
    )
    spin = np.array(
        [[np.cos(roll), -np.sin(roll), 0.0], [np.sin(roll), np.cos(roll), 0.0], [0.0, 0.0, 1.0]]
    )
    rotation: np.ndarray = tilt @ spin @ axes
    return rotation


def plate() -> list[Shape]:
    """The molecule's ellipsoids, balls and bonds above the floor."""
    elements, place, spread = atoms()
    rotation = turned(place[: ATOMS.count("\n") - 1])
    place = GROWN * place @ rotation.T
    low, high = place.min(axis=0), place.max(axis=0)
    place -= (*(0.5 * (low + high))[:2], low[2] - ABOVE)
    shapes: list[Shape] = []
    for element, center, tensor in zip(elements, place, spread, strict=True):
        material = Material(COLORS[element])
        if element == "H":
            shapes.append(Sphere(vector_of(center), GROWN * HYDROGEN, material))
            continue
        square, axes = np.linalg.eigh(rotation @ tensor @ rotation.T)
        half = GROWN * HALF_PROBABILITY * np.sqrt(square) * axes
        shapes.append(Ellipsoid(vector_of(center), *(vector_of(each) for each in half.T), material))
    for i, one in enumerate(elements):
        for j in range(i):
            pair = {one, elements[j]}
            light = "H" in pair
            longest = HYDROGEN_BOND if light else SULPHUR_BOND if "S" in pair else BOND
            if np.linalg.norm(place[i] - place[j]) <= GROWN * longest:
                ends, size = (vector_of(place[i]), vector_of(place[j])), RADIUS
                shapes.append(Cylinder(*ends, GROWN * (HYDROGEN_RADIUS if light else size), BONDS))
    return shapes


def main() -> None:
    """Render the plate under each light and save both pictures side by side."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--picture", type=Path, default=PICTURE)
    parser.add_argument("--size", type=int, default=360, help="width of a picture, pixels")
    parser.add_argument("--tolerance", type=float, default=0.005)
    given = parser.parse_args()
    found = []
    for name, light in LIGHTS.items():
        began = time.process_time()
        scene = scene_of(plate(), light, given.size)
        film = render_image(scene, Settings(tolerance=given.tolerance))
        error, plan = film.stats["error_estimate"], film.stats["plan"]
        print(f"{name}: {time.process_time() - began:.1f} CPU s, estimated error {error:.1e}")
        print(f"  {plan}")
        found.append((name, result_picture(film)))
    save(sheet(found, columns=2, side=given.size), given.picture)


if __name__ == "__main__":
    main()
