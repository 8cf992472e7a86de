# SPDX-License-Identifier: GPL-3.0-or-later
"""One whole render of very many packed balls: CPU time and memory of all its processes.

    python benchmarks/million.py [--count 1000000] [--size 1920x1080] [--tolerance 0.01]
        [--threads 2]

Under a square light half as wide as the heap. Linux alone.
"""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import machine
from many_spheres import make_scene

from adaptive_drt.parallel.pool import worker_pool
from adaptive_drt.render import render
from adaptive_drt.scene.settings import Settings

LOOK, TELL = 0.05, 60.0
"""Seconds between two looks at memory, and between two lines that tell how far it is."""


class Watch:
    """What all processes of a render take.

    Attributes
    ----------
    peak : most resident memory of all at one time, bytes; pages that they share count in each.
    workers : CPU seconds of each worker process, by its number.
    """

    def __init__(self) -> None:
        self.peak, self.workers = 0, dict[int, float]()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look)

    def __enter__(self) -> Watch:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _look(self) -> None:
        while not self._over.wait(LOOK):
            total = _resident(os.getpid())
            for process in worker_pool.process_ids:
                total += _resident(process)
                self.workers[process] = max(self.workers.get(process, 0.0), _seconds(process))
            self.peak = max(self.peak, total)


def _resident(process: int) -> int:
    try:
        pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    except OSError:
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")


def _seconds(process: int) -> float:
    try:
        words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--tolerance", type=float, default=0.01)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    print(machine.describe(), flush=True)
    width, height = map(int, options.size.split("x"))
    scene = make_scene("packed", options.count, (width, height), "square", batch=True)
    before, began = _resident(os.getpid()), time.process_time()
    clock = told = time.monotonic()
    settings = Settings(tolerance=options.tolerance, threads=options.threads)
    with Watch() as watch:
        film = None
        for progress in render(scene, settings):
            film = progress.film
            if time.monotonic() > told + TELL:
                told = time.monotonic()
                part = progress.done / max(progress.total, 1)
                print(f"{told - clock:.0f} s, {progress.stage} {part:.1%}, "
                      f"{watch.peak / 2**20:.0f} MiB", flush=True)  # fmt: skip
    own = time.process_time() - began
    print(f"CPU: {own:.0f} s here, {sum(watch.workers.values()):.0f} s in worker processes; "
          f"{time.monotonic() - clock:.0f} s by the clock")  # fmt: skip
    print(f"memory: {before / 2**20:.0f} MiB before, peak of all {watch.peak / 2**20:.0f} MiB")
    if film is not None:
        print(film.stats)


if __name__ == "__main__":
    main()
