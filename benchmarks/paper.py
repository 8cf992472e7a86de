# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's table 1, its twelve rows, on two scenes like its own: `make bench-paper`.

Writes docs/paper-table.md and docs/pictures/. Rows that are compared run in turn, round after
round, so that a busy machine slows them alike; each row's best round counts.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import machine
import numpy as np
import paper_pictures
import paper_report
from paper_scenes import motion_scene, penumbra_scene

from adaptive_drt.cost_model import PixelCosts, measure_pixel_costs
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Scene, validate
from adaptive_drt.scene.film import Film
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.occluder_culling import Occluders

ROOT = Path(__file__).resolve().parent.parent
PENUMBRA = Settings(method="RAYS", use_edges=False, use_motion=False, light_rays=49)
MOTION = Settings(method="RAYS", use_edges=False, use_penumbra=False, time_rays=128)
SCENES = {"penumbra": (penumbra_scene, PENUMBRA), "motion": (motion_scene, MOTION)}
RAYS = {"penumbra": "light_rays", "motion": "time_rays"}

REFERENCE_RAYS = {("penumbra", 300): 4096, ("motion", 300): 2048}
REFERENCE_RAYS |= {("penumbra", 600): 1024, ("motion", 600): 512}
COST_REPETITIONS = 15
"""Timed repetitions of each pass that measures b: their quartiles then settle to a few percent."""
REFERENCE_SEED = 1009
"""Any seed but the rows' own, so that their errors are not the reference's."""


@dataclass
class Row:
    """One way to render one scene: settings, the paper's figures, and what was measured.

    Attributes
    ----------
    paper_seconds, paper_pixels : as printed; None for a row that the paper does not have.
    best : least seconds over the rounds.  film : of that round.
    costs : times of a pixel with and without derivatives; None before they are measured.
    """

    effect: str
    size: int
    label: str
    settings: Settings
    paper_seconds: float | None = None
    paper_pixels: int | None = None
    best: float = float("inf")
    film: Film = field(default_factory=lambda: Film(1, 1))
    costs: PixelCosts | None = None

    @property
    def everywhere(self) -> bool:
        """Whether this is the paper's baseline."""
        return self.settings.distribution == "EVERYWHERE"

    @property
    def rays(self) -> int:
        """Rays distributed in a pixel."""
        count: int = getattr(self.settings, RAYS[self.effect])
        return count

    def run(self, scene: Scene) -> None:
        """Render once; keep the picture and the time if it was the fastest."""
        film = render_image(scene, self.settings)
        seconds = film.stats["seconds"]["total"]
        if seconds < self.best:
            self.film, self.best = film, seconds

    def measure_costs(self, scene: Scene) -> None:
        """Measure the times of a pixel with and without derivatives, on a sample of rows."""
        plan = make_plan(validate(scene), self.settings)
        self.costs = measure_pixel_costs(plan, Occluders(plan), repetitions=COST_REPETITIONS)


def paper_rows(effect: str) -> list[Row]:
    """The paper's six rows of an effect, and the adaptive ones once more without reuse."""
    base = SCENES[effect][1]
    few, printed = {
        "penumbra": (16, (155, 527, 550, 169, 610, 1936, 27_901, 27_706, 111_544)),
        "motion": (5, (139, 623, 2696, 129, 626, 21_805, 15_684, 10_348, 62_785)),
    }[effect]
    t1, t2, everywhere, fast, t1_large, everywhere_large, p1, p2, p_large = printed
    order1, plain = replace(base, order=1), replace(base, distribution="EVERYWHERE")
    coarse = replace(plain, **{RAYS[effect]: few})
    rows = [
        Row(effect, 300, "order 1", order1, t1, p1),
        Row(effect, 300, "order 2", base, t2, p2),
        Row(effect, 300, "everywhere", plain, everywhere),
        Row(effect, 300, "everywhere", coarse, fast),
        Row(effect, 600, "order 1", order1, t1_large, p_large),
        Row(effect, 600, "everywhere", plain, everywhere_large),
    ]
    again = [r for r in rows if not r.everywhere]
    return rows + [Row(effect, r.size, r.label, replace(r.settings, reuse=False)) for r in again]


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
