# SPDX-License-Identifier: GPL-3.0-or-later
"""Run time against error, ours beside Cycles and Mitsuba: `make bench` writes docs/benchmark.md.

Each renderer runs in a process of its own, one after the other, with two threads.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import bench_plots
import bench_report
import machine
import numpy as np
from bench_fit import Curve, Result, Rung
from bench_scenes import SCENES, bench_scene, moves
from bench_truth import error_with_doubt, truth_of

from oracle.converged import Truth

HERE = Path(__file__).resolve().parent
SIZES = {"300": (300, 300), "1080": (1920, 1080)}
PEERS = {
    "ours": ["bench_ours.py"],
    "Cycles": ["peer_cycles.py"],
    "Cycles, adaptive": ["peer_cycles.py", "--adaptive"],
    "Mitsuba": ["peer_mitsuba.py"],
}
STILL_ONLY = {"Mitsuba"}
PIXELS = {False: 30_000, True: 6_000}
"""Random pixels that errors are measured on, of scenes without and with motion."""
SLOW = {"all at once": 3_000}


def measure(name: str, size: str, given: argparse.Namespace) -> Result:
    """One scene at one size: the truth first, then all renderers in turn."""
    width, height = SIZES[size]
    scene = bench_scene(name, width, height)
    count = SLOW.get(name, PIXELS[moves(scene)])
    start = time.perf_counter()
    truth = truth_of(scene, count)
    say(
        f"{name}, {width} x {height}: truth of {len(truth.pixels):,} pixels, "
        f"{time.perf_counter() - start:.1f} s"
    )
    result = Result(name, width, height, moves(scene), len(truth.pixels))
    for peer in given.renderers:
        if peer in STILL_ONLY and result.moves:
            continue
        with tempfile.TemporaryDirectory() as folder:
            curve = run(peer, name, size, Path(folder), given, truth, result)
        if curve:
            result.curves[peer] = curve
    return result


def run(
    peer: str,
    name: str,
    size: str,
    folder: Path,
    given: argparse.Namespace,
    truth: Truth,
    result: Result,
) -> Curve | None:
    """Run a renderer's process and measure its pictures. None if it fails."""
    script, *switches = PEERS[peer]
    if peer == "ours":
        switches = ["--tolerances", ",".join(f"{t:g}" for t in given.tolerances)]
        switches += ["--method", given.method]
    width, height = SIZES[size]
    words = [sys.executable, str(HERE / script), name, str(width), str(height), str(folder)]
    start = time.perf_counter()
    words += [str(given.seconds), *switches]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=given.patience)
        if done.returncode:
            say(f"  {peer} failed ({done.returncode}):\n{done.stderr[-2000:]}")
    except subprocess.TimeoutExpired:
        say(f"  {peer} was stopped after {given.patience:g} s; what it had finished counts")
    if not (folder / "rungs.json").exists():
        return None
    said = json.loads((folder / "rungs.json").read_text(encoding="utf-8"))
    rungs = []
    for k, rung in enumerate(said["rungs"]):
        picture = np.load(folder / f"{k}.npy").astype(np.float64)
        rungs.append(Rung(**rung, **error_with_doubt(picture, truth)))
    x, y = truth.pixels.T
    off = (picture[:, y, x].T - truth.color).mean(axis=1)
    scale = truth.color.mean()
    result.proof[peer] = (off.mean() / scale, off.std() / len(off) ** 0.5 / scale)
    reached = "  ".join(f"{r.setting:g}: {r.least:.3f} s {r.error:.1e}" for r in rungs)
    say(f"  {peer}: {reached}  ({time.perf_counter() - start:.0f} s)")
    return Curve(peer, said["version"], tuple(rungs))


def say(text: str) -> None:
    """Progress, at once."""
    print(text, flush=True)


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--large", nargs="+", choices=SCENES, help="scenes at 1080; all of them")
    parser.add_argument("--sizes", nargs="+", choices=SIZES, default=list(SIZES))
    parser.add_argument("--tolerances", nargs="+", type=float, default=[1e-2, 1e-3, 1e-4])
    parser.add_argument("--renderers", nargs="+", choices=PEERS, default=list(PEERS))
    parser.add_argument("--method", default="EXACT", help="ours: EXACT or RAYS")
    parser.add_argument("--seconds", type=float, default=30.0, help="longest render of a peer")
    parser.add_argument("--patience", type=float, default=150.0, help="seconds for all of a ladder")
    parser.add_argument("--docs", type=Path, default=HERE.parent / "docs", help="where to write")
    given = parser.parse_args()
    about = machine.describe()
    start = time.perf_counter()
    results = [
        measure(name, size, given)
        for size in given.sizes
        for name in ((given.large or given.scenes) if size == "1080" else given.scenes)
    ]
    minutes = (time.perf_counter() - start) / 60.0
    given.docs.mkdir(parents=True, exist_ok=True)
    bench_plots.write(results, given.docs / "pictures")
    text = bench_report.compose(results, about, minutes, given.seconds)
    (given.docs / "benchmark.md").write_text(text, encoding="utf-8")
    say(f"{given.docs / 'benchmark.md'}, after {minutes:.1f} minutes")


if __name__ == "__main__":
    main()
