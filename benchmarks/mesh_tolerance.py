# SPDX-License-Identifier: GPL-3.0-or-later
"""Is the tolerance kept on meshes? Errors of random scenes of meshes against brute force.

The truth is `oracle.mesh_rays`, which shares no code with the renderer: 2,048 to 65,536 points a
pixel, by four estimates, until these agree. Their differences tell its error, which is taken off.
Half of the scenes have coarse meshes with smooth normals. One line for each scene: error and stated
error over each tolerance, and the worst pixel's error over the mean radiance. With `--masks`, those
pixels are counted instead in which single rays differ, but whose mask is empty.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "helpers")]

from adaptive_drt.render import render_image  # noqa: E402
from adaptive_drt.scene.settings import Settings  # noqa: E402
from oracle.mesh_rays import converged_mesh_pictures, sampled_mesh_picture  # noqa: E402
from random_meshes import random_mesh_scene  # noqa: E402

SIZE = (16, 12)
"""Pixels of the pictures: tiny ones, since the truth tests every triangle."""
ROUNDED_SEEDS = 8
"""Of so many consecutive seeds, the second half has smooth coarse meshes."""
TRUTH_GOAL, TRUTH_POINTS = 1e-3, 16_384
"""Standard error of a pixel of the truth, over the picture's mean, at which it is done, and the
largest number of points of each of its four estimates."""
MASK_PICTURES = 24
"""Number of pictures of one ray a pixel that tell what a mask must hold."""


def scene_of(seed):
    """The scene of a seed."""
    rounded = seed % ROUNDED_SEEDS >= ROUNDED_SEEDS // 2
    return random_mesh_scene(seed, SIZE, rounded=rounded)


def truths(seed, folder):
    """Two independent pictures (2, 3, height, width) by brute force, kept in a folder if given."""
    file = None if folder is None else folder / f"mesh_{seed}.npy"
    if file is not None and file.exists():
        return np.load(file)
    found = converged_mesh_pictures(scene_of(seed), TRUTH_GOAL, TRUTH_POINTS)
    if file is not None:
        np.save(file, found)
    return found


def compared(seed, tolerances, folder):
    """Excess over each tolerance of a scene, and words about it."""
    pictures = truths(seed, folder)
    truth = pictures.mean(axis=0)
    mean = truth.mean()
    noise = 0.5 * np.sqrt(((pictures[0] - pictures[1]) ** 2).mean()) / mean
    excess, words = [], [f"{seed:4d} truth {noise:.1e}"]
    for tolerance in tolerances:
        began = time.process_time()
        film = render_image(scene_of(seed), Settings(tolerance=tolerance, threads=1))
        seconds = time.process_time() - began
        off = film.color - truth
        error = np.sqrt((off**2).mean()) / mean
        excess.append(np.sqrt(max(error**2 - noise**2, 0.0)) / tolerance)
        pixel = np.sqrt((off**2).mean(axis=0)) / mean
        y, x = np.unravel_index(pixel.argmax(), pixel.shape)
        stated = film.stats["error_estimate"] / tolerance
        words.append(
            f"| {tolerance:g}: {excess[-1]:.2f} (stated {stated:.2f}), worst ({x}, {y}) "
            f"{pixel.max():.1e}, {seconds:.1f} s"
        )
    return excess, " ".join(words)


def missed(seed):
    """Number of pixels without a mask in which some rays are dark and others are lit."""
    scene = scene_of(seed)
    dark = [sampled_mesh_picture(scene, 1, k).max(axis=0) == 0.0 for k in range(MASK_PICTURES)]
    unmasked = ~render_image(scene, Settings(tolerance=1e-1, threads=1)).mask.any(axis=0)
    mixed = np.any(dark, axis=0) & ~np.all(dark, axis=0)
    return int((mixed & unmasked).sum())


def main() -> None:
    """Print a line for each scene, and how many keep each tolerance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", type=int, help="first seed")
    parser.add_argument("count", type=int)
    parser.add_argument("--tolerances", type=float, nargs="+", default=[1e-2, 1e-3])
    parser.add_argument("--truths", type=Path, help="folder in which truths are kept")
    parser.add_argument("--masks", action="store_true", help="check masks instead")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.count)
    if options.masks:
        lost = {seed: missed(seed) for seed in seeds}
        lost = {seed: count for seed, count in lost.items() if count}
        print(f"{options.count} masks, pixels missed by seed: {lost or 'none'}")
        return
    rows = []
    for seed in seeds:
        excess, words = compared(seed, options.tolerances, options.truths)
        rows.append(excess)
        print(words, flush=True)
    for tolerance, column in zip(options.tolerances, np.array(rows).T, strict=True):
        kept = int((column <= 1.0).sum())
        print(f"{tolerance:g}: {kept} of {column.size} within, worst {column.max():.2f}")


if __name__ == "__main__":
    main()
