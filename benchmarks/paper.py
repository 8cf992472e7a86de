# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's table 1, its twelve rows, on two scenes like its own: `make bench-paper`.

Writes docs/paper-table.md and docs/pictures/. Rows that are compared run in turn, round after
round, so that a busy machine slows them alike; each row's best round counts.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import machine
import numpy as np
import paper_pictures
import paper_report
from paper_rows import RAYS, SCENES, Row, paper_rows

from adaptive_drt.render import render_image
from adaptive_drt.scene.film import Film

ROOT = Path(__file__).resolve().parent.parent
REFERENCE_RAYS = {("penumbra", 300): 4096, ("motion", 300): 2048}
REFERENCE_RAYS |= {("penumbra", 600): 1024, ("motion", 600): 512}
REFERENCE_SEED = 1009
"""Any seed but the rows' own, so that their errors are not the reference's."""


def run_rounds(rows: Iterable[Row], rounds: dict[int, int]) -> None:
    """Run all rows in turn, as many rounds as their size has."""
    rows = list(rows)
    scenes = {(r.effect, r.size): SCENES[r.effect][0](r.size) for r in rows}
    for turn in range(max(rounds.values())):
        for row in rows:
            if turn < rounds[row.size]:
                row.run(scenes[row.effect, row.size])
                print(
                    f"round {turn + 1}: {row.effect} {row.size} {row.label} {row.rays} rays,"
                    f" reuse {row.settings.reuse}: {row.best:.3f} s",
                    flush=True,
                )


def reference(effect: str, size: int) -> Film:
    """A converged picture: many rays, another seed, wherever order 1 cannot rule a change out.

    The rest needs none: `paper_report.checks` shows it to equal EVERYWHERE's.
    """
    make, base = SCENES[effect]
    many = {RAYS[effect]: REFERENCE_RAYS[effect, size]}
    return render_image(make(size), replace(base, order=1, seed=REFERENCE_SEED, **many))


def relative_rmse(film: Film, truth: Film) -> float:
    """Root mean square error over the mean of the truth."""
    return float(np.sqrt(np.mean((film.color - truth.color) ** 2)) / truth.color.mean())


def main() -> None:
    """Run the table."""
    parser = argparse.ArgumentParser(description="The paper's table 1 on scenes like its own.")
    parser.add_argument("--rounds", type=int, default=3, help="rounds at 300 x 300")
    parser.add_argument("--large-rounds", type=int, default=1, help="rounds at 600 x 600")
    parser.add_argument("--docs", type=Path, default=ROOT / "docs", help="where to write")
    given = parser.parse_args()
    about = machine.describe()
    rows = [row for effect in SCENES for row in paper_rows(effect)]
    run_rounds(rows, {300: given.rounds, 600: given.large_rounds})
    for row in rows:
        if not row.everywhere:
            row.measure_costs(SCENES[row.effect][0](row.size))
    truths = {key: reference(*key) for key in REFERENCE_RAYS}
    errors = [relative_rmse(row.film, truths[row.effect, row.size]) for row in rows]
    given.docs.mkdir(parents=True, exist_ok=True)
    names = paper_pictures.write(rows, truths, given.docs / "pictures")
    run = paper_report.Run(about, given.rounds, given.large_rounds, REFERENCE_RAYS, names)
    text = paper_report.compose(rows, errors, run)
    (given.docs / "paper-table.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
