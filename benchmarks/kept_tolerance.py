# SPDX-License-Identifier: GPL-3.0-or-later
"""Is the tolerance kept? Errors of random scenes that the error model has not been fitted to.

The truth is the same renderer at a tenth of the smallest tolerance; the tests compare it with other
renderers. One line for each scene, and the number of scenes within each tolerance.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "helpers")]

from error_model_renders import true_picture  # noqa: E402

from adaptive_drt.render import render_image  # noqa: E402
from adaptive_drt.scene.settings import Settings  # noqa: E402
from random_scenes import random_scene  # noqa: E402


def main() -> None:
    """Render the scenes and print their errors, relative to the tolerance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", type=int, help="first seed; the fit uses 400 to 515")
    parser.add_argument("count", type=int)
    parser.add_argument("--tolerances", type=float, nargs="+", default=[1e-2, 1e-3])
    options = parser.parse_args()
    ratios = []
    for seed in range(options.first, options.first + options.count):
        scene = random_scene(seed)
        truth = true_picture(scene, 0.1 * min(options.tolerances))
        mean, row = np.abs(truth).mean(), []
        for tolerance in options.tolerances:
            color = render_image(scene, Settings(tolerance=tolerance, threads=1)).color
            row.append(np.sqrt(((color - truth) ** 2).mean()) / mean / tolerance)
        ratios.append(row)
        print(seed, *(f"{each:.2f}" for each in row), flush=True)
    within = np.array(ratios)
    for tolerance, column in zip(options.tolerances, within.T, strict=True):
        kept = int((column <= 1.0).sum())
        print(f"{tolerance:g}: {kept} of {column.size} within, worst {column.max():.2f}")


if __name__ == "__main__":
    main()
