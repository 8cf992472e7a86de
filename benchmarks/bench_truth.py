# SPDX-License-Identifier: GPL-3.0-or-later
"""The truth about a scene's pixels, kept in the user's cache folder; and a quick comparison.

    python benchmarks/bench_truth.py "moving sphere" --size 100 100 --tolerance 1e-3

renders one scene and prints the error of the picture, and where it is greatest.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

import numpy as np
from bench_ours import settings_for
from bench_scenes import SCENES, bench_scene

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Scene
from oracle.converged import Truth, converged, relative_rmse

__all__ = ["error_of", "error_with_doubt", "truth_of"]

CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "adaptive-drt" / "truth"
VERSION = 2
"""Raise it when the oracle changes what it says: kept truths are then not used any more."""


def truth_of(scene: Scene, count: int = 0, goal: float = 1e-4, threads: int = 2) -> Truth:
    """The truth of `count` random pixels (0 = all), from the cache if it is there.

    `goal` is the error, relative to the picture's mean, at which the oracle refines a pixel no
    more; the RMSE it reaches is about a tenth of it.
    """
    said = repr((VERSION, scene, count, goal)).encode()
    path = CACHE / f"{hashlib.sha256(said).hexdigest()[:24]}.npz"
    if path.exists():
        with np.load(path) as kept:
            return Truth(kept["pixels"], kept["color"], kept["work"])
    truth = converged(scene, _pixels(scene, count), goal, threads)
    CACHE.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(f".{os.getpid()}.npz")
    np.savez(part, pixels=truth.pixels, color=truth.color, work=truth.work)
    part.replace(path)
    return truth


def _pixels(scene: Scene, count: int) -> np.ndarray | None:
    """`count` different pixels of the whole picture, the same on every machine."""
    width, height = scene.camera.resolution
    if not 0 < count < width * height:
        return None
    chosen = np.random.default_rng(width * 7919 + height).choice(width * height, count, False)
    chosen.sort()
    return np.stack([chosen % width, chosen // width], axis=1)


def error_of(color: np.ndarray, truth: Truth) -> float:
    """Relative RMSE of a picture (3, height, width), row 0 at the bottom, where truth is known."""
    x, y = truth.pixels.T
    return relative_rmse(color[:, y, x].T, truth.color)


def error_with_doubt(color: np.ndarray, truth: Truth) -> dict[str, float]:
    """`error_of`, and its standard error ("doubt"), as the pixels are a sample of the picture."""
    x, y = truth.pixels.T
    square = ((color[:, y, x].T - truth.color) ** 2).mean(axis=1)
    mean = max(float(square.mean()), float(np.finfo(float).tiny))
    doubt = float(square.std()) / len(square) ** 0.5 / mean / 2.0
    error = error_of(color, truth)
    return {"error": error, "doubt": error * doubt}


def main() -> None:
    """Render a scene with the core and compare."""
    parser = argparse.ArgumentParser(description="One render against the truth.")
    parser.add_argument("scene", choices=SCENES)
    parser.add_argument("--size", type=int, nargs=2, default=(100, 100))
    parser.add_argument("--pixels", type=int, default=0, help="random pixels compared; 0 = all")
    parser.add_argument("--method", default="EXACT")
    parser.add_argument("--tolerance", type=float, nargs="+", default=[1e-2, 1e-3, 1e-4])
    parser.add_argument(
        "--goal", type=float, default=1e-4, help="error at which a pixel is not refined any more"
    )
    given = parser.parse_args()
    scene = bench_scene(given.scene, *given.size)
    start = time.perf_counter()
    truth = truth_of(scene, given.pixels, given.goal)
    print(f"truth of {len(truth.pixels):,} pixels: {time.perf_counter() - start:.1f} s")
    for tolerance in given.tolerance:
        report(scene, truth, given.method, tolerance)


def report(scene: Scene, truth: Truth, method: str, tolerance: float) -> None:
    """Render and print seconds, error, and the three worst pixels."""
    start = time.perf_counter()
    film = render_image(scene, settings_for(method, tolerance))
    seconds = time.perf_counter() - start
    x, y = truth.pixels.T
    off = film.color[:, y, x].T - truth.color
    square = (off**2).sum(axis=1)
    worst = np.argsort(square)[::-1]
    share = square[worst[: max(len(worst) // 100, 1)]].sum() / square.sum()
    print(
        f"{method} {tolerance:g}: {seconds:.3f} s, error {error_of(film.color, truth):.3e};"
        f" the worst 1 % of pixels have {share:.0%} of it (squared)"
    )
    for i in worst[:3]:
        drop = np.abs(off[i]).max() / truth.color.mean()
        flags = film.mask[:, y[i], x[i]].astype(int)
        print(f"    pixel ({x[i]}, {y[i]}): {drop:.2e} of the mean, mask {flags}")


if __name__ == "__main__":
    main()
