# SPDX-License-Identifier: GPL-3.0-or-later
"""Log-log plots of the benchmark: seconds against error, one panel for each scene."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
from bench_fit import Result

matplotlib.use("Agg")
from matplotlib import pyplot as plt

__all__ = ["name_of", "write"]

STYLES = {
    "ours": ("o-", "#c02020"),
    "Cycles": ("s-", "#2060b0"),
    "Cycles, adaptive": ("^--", "#6aa0dd"),
    "Mitsuba": ("D-", "#308030"),
}
COLUMNS = 3


def name_of(width: int, height: int) -> str:
    """File name of a size's plot."""
    return f"benchmark-{width}x{height}.png"


def write(results: Sequence[Result], folder: Path) -> None:
    """One picture for each size."""
    folder.mkdir(parents=True, exist_ok=True)
    for size in dict.fromkeys((r.width, r.height) for r in results):
        some = [r for r in results if (r.width, r.height) == size]
        rows = -(-len(some) // COLUMNS)
        figure, axes = plt.subplots(
            rows, COLUMNS, figsize=(4.2 * COLUMNS, 3.6 * rows), squeeze=False
        )
        for panel, result in zip(axes.flat, some, strict=False):
            _draw(panel, result)
        for panel in axes.flat[len(some) :]:
            panel.set_visible(False)
        axes.flat[0].legend(fontsize=8)
        figure.tight_layout()
        figure.savefig(folder / name_of(*size), dpi=80)
        plt.close(figure)


def _draw(panel: plt.Axes, result: Result) -> None:
    for name, curve in result.curves.items():
        mark, color = STYLES[name]
        errors, seconds = zip(*((r.error, r.least) for r in curve.rungs), strict=True)
        panel.loglog(errors, seconds, mark, color=color, label=name, markersize=4, linewidth=1.2)
    panel.invert_xaxis()
    panel.set_title(result.scene, fontsize=10)
    panel.set_xlabel("relative RMSE", fontsize=8)
    panel.set_ylabel("seconds", fontsize=8)
    panel.grid(True, which="major", linewidth=0.4)
    panel.tick_params(labelsize=7)
