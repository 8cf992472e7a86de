# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures like the paper's figures 3 to 19: results and detections, one by one and on a sheet."""

from __future__ import annotations

from pathlib import Path

from paper_rows import Row
from pictures import overlay_picture, result_picture, save, sheet

from adaptive_drt.scene.film import Film

__all__ = ["write"]

SHEET = "paper-sheet.png"


def write(rows: list[Row], truths: dict[tuple[str, int], Film], folder: Path) -> str:
    """Write the pictures of the 300 x 300 rows; returns the name of the sheet."""
    shown = []
    for effect in ("penumbra", "motion"):
        overlays = []
        for row in rows:
            if row.effect != effect or row.size != 300 or not row.settings.reuse:
                continue
            label = f"{row.label}, {row.rays} rays"
            picture = result_picture(row.film)
            shown.append((f"{effect}: {label}", picture))
            save(picture, folder / f"{effect}-{_slug(label)}.png")
            if not row.everywhere:
                overlay = overlay_picture(row.film)
                overlays.append((f"{effect}: flagged at {row.label}", overlay))
                save(overlay, folder / f"{effect}-flagged-{_slug(row.label)}.png")
        shown += overlays
        shown.append((f"{effect}: reference", result_picture(truths[effect, 300])))
        shown.insert(len(shown) - 3, shown.pop())
    save(sheet(shown, columns=7, side=180), folder / SHEET)
    return SHEET


def _slug(label: str) -> str:
    return label.replace(",", "").replace(" ", "-")
