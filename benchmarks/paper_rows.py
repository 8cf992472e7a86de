# SPDX-License-Identifier: GPL-3.0-or-later
"""The rows of the paper's table 1: what each renders, and what is measured of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from paper_scenes import motion_scene, penumbra_scene

from adaptive_drt.cost_model import PixelCosts, measure_pixel_costs
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Scene, validate
from adaptive_drt.scene.film import Film
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.occluder_culling import Occluders

__all__ = ["RAYS", "SCENES", "Row", "paper_rows"]

PENUMBRA = Settings(method="RAYS", use_edges=False, use_motion=False, light_rays=49)
MOTION = Settings(method="RAYS", use_edges=False, use_penumbra=False, time_rays=128)
SCENES = {"penumbra": (penumbra_scene, PENUMBRA), "motion": (motion_scene, MOTION)}
RAYS = {"penumbra": "light_rays", "motion": "time_rays"}

COST_REPETITIONS = 15
"""Timed repetitions of each pass that measures b: their quartiles then settle to a few percent."""


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
