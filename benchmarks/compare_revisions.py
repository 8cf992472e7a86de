# SPDX-License-Identifier: GPL-3.0-or-later
"""Render times of two checkouts of this repository, interleaved in one run.

    python benchmarks/compare_revisions.py OTHER_CHECKOUT [--tolerance 1e-2] [--rounds 9]

Each checkout renders the benchmark's scenes in a process of its own, in turn, by one thread. Of the
CPU times of each the least counts, since other programs only add to them; a machine that is busy
makes even those differ by some percent.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from typing import IO

HERE = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(HERE)]

from bench_scenes import SCENES  # noqa: E402

RENDER = """
import sys, time
sys.path[:0] = [sys.argv[1], sys.argv[1] + "/benchmarks"]
from bench_scenes import bench_scene
from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
settings = Settings(tolerance=float(sys.argv[2]), threads=1)
for line in sys.stdin:
    scene = bench_scene(line.strip())
    start = time.process_time()
    film = render_image(scene, settings)
    print(time.process_time() - start, film.stats["error_estimate"], flush=True)
"""
"""Program of a process: renders the scenes named on its standard input."""


def _start(checkout: Path, tolerance: float) -> subprocess.Popen[str]:
    """Start the process of a checkout."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, "-c", RENDER, str(checkout), str(tolerance)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    )


def _seconds(process: subprocess.Popen[str], scene: str) -> float:
    """CPU seconds that a process takes to render a scene."""
    pipe_in: IO[str] | None = process.stdin
    pipe_out: IO[str] | None = process.stdout
    assert pipe_in and pipe_out
    pipe_in.write(scene + "\n")
    pipe_in.flush()
    return float(pipe_out.readline().split()[0])


def main() -> None:
    """Print a table of the least CPU seconds of both checkouts, by scene, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("other", type=Path)
    parser.add_argument("--tolerance", type=float, default=1e-2)
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    processes = [_start(path, options.tolerance) for path in (options.other.resolve(), HERE)]
    print(f"tolerance {options.tolerance:g}, load {os.getloadavg()[0]:.1f}")
    print("| scene | other, s | this, s | this / other |\n|---|---|---|---|")
    for scene in SCENES:
        rounds = [[_seconds(one, scene) for one in processes] for _ in range(options.rounds + 1)]
        other, this = (min(column) for column in zip(*rounds[1:], strict=True))
        print(f"| {scene} | {other:.3f} | {this:.3f} | {this / other:.3f} |", flush=True)
    for one in processes:
        one.kill()


if __name__ == "__main__":
    main()
