# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes docs/paper-table.md from what `paper.py` measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from paper_rows import Row

from adaptive_drt.cost_model import predicted_ratio

__all__ = ["compose"]

HEAD = """<!-- Written by benchmarks/paper.py: `make bench-paper` writes it anew. -->
# The paper's table

Table 1 of Makino and Zhao on two scenes like its own (`benchmarks/paper_scenes.py`); the paper's
scenes are lost, so ours are tuned to its share of flagged pixels at order 1. Every pixel hits
something, in both scenes.

Measured on: {about}. Rows run in turn, {rounds} rounds at 300 x 300 and {large} at 600 x 600; the
best round counts. Repeat it with `make bench-paper`.

![Results and flagged pixels](pictures/{sheet})

## The twelve rows

*Speed-up* is over the same size everywhere with the same rays, in the same run. *Error* is the
relative RMSE against a reference with {references} rays and another seed.
"""


@dataclass(frozen=True)
class Run:
    """What the page says about the run as a whole; `sheet` is a picture's file name."""

    about: str
    rounds: int
    large_rounds: int
    references: dict[tuple[str, int], int]
    sheet: str


def compose(rows: list[Row], errors: list[float], run: Run) -> str:
    """The whole page. `errors` go with `rows`."""
    head = HEAD.format(
        about=run.about,
        rounds=run.rounds,
        large=run.large_rounds,
        sheet=run.sheet,
        references=", ".join(f"{n:,} ({e}, {s})" for (e, s), n in run.references.items()),
    )
    table = _table(rows, errors)
    return "\n".join([head, *table, "", *_model(rows), "", *_checks(rows), ""])


def baseline(rows: list[Row], row: Row) -> Row:
    """The row that distributes the same rays everywhere."""
    return next(
        r
        for r in rows
        if r.everywhere and (r.effect, r.size, r.rays) == (row.effect, row.size, row.rays)
    )


def _header(names: str) -> list[str]:
    """The first two lines of a table."""
    columns = names.split("|")
    return ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]


def _table(rows: list[Row], errors: list[float]) -> list[str]:
    lines = [
        *_header("effect|size|how|rays|flagged|paper|seconds|paper|speed-up|paper|error"),
    ]
    for row, error in zip(rows, errors, strict=True):
        if row.paper_seconds is None:
            continue
        whole = baseline(rows, row)
        gain = paper_gain = ""
        if not row.everywhere:
            gain = f"**{whole.best / row.best:.1f}**"
            paper_gain = f"{whole.paper_seconds / row.paper_seconds:.1f}"
        flagged = f"{row.film.stats['counts']['distributed']:,}"
        printed = f"{row.paper_pixels:,}" if row.paper_pixels else "every hit"
        if row.everywhere and row.effect == "motion":
            printed = f"{row.size**2:,}"
        cells = (
            row.effect,
            row.size,
            row.label,
            row.rays,
            flagged,
            printed,
            f"{row.best:.3f}",
            f"{row.paper_seconds:,g}",
            gain,
            paper_gain,
            f"{error:.1e}",
        )
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return lines


MODEL = """## Equation 10

    t_img / t'_img = (a c + b - a) / c

a is the flagged share; b = t_n / t'_n, the time of a pixel with derivatives, detection and shading,
but nothing distributed, over that of a plain tracer's pixel; c the rays of a distributed pixel.
a and c are counted in the render. b is the median of 15 ratios, given with their interquartile
range: two passes alternate on one thread over the same rows of the picture, the same code with and
without derivatives (`measure_pixel_costs` in `cost_model.py`).

The paper takes a distributed pixel for c plain ones (its equation 8, t'_d = c t'_n). Here it is
cheaper: light rays need no new camera ray, and the closed form of the unblocked light is taken
once. So the equation is given twice: with c as the number of rays, and with c as the time of a
pixel distributed everywhere over that of a plain one, t'_d / t'_n, which is what equation 8 means.

The equation also supposes that a flagged pixel costs what any pixel costs when rays are
distributed everywhere. With `Settings(reuse=False)` that is so, and there it must hold. With
`reuse=True`, the default, a flagged pixel keeps what detection has proven: only objects that may
hide part of the light are tested, and what stands still is not traced again for each time. Only so
can the paper's own motion rows beat the equation, which allows them at most 1 / a = 5.7 times.

All ratios are times of the adaptive picture over that of everywhere: smaller is faster. *Off by*
compares the prediction from times with *reuse off*.
"""


def _model(rows: list[Row]) -> list[str]:
    names = "effect|size|order|a|b (spread)|c, rays|c, time|predicted, rays|predicted, time"
    lines = [*MODEL.splitlines(), "", *_header(names + "|reuse off|off by|reuse on")]
    for row in _adaptive(rows):
        model = Model.of(rows, row)
        reused = row.best / baseline(rows, row).best
        cells = (
            *(row.effect, row.size, row.settings.order),
            *(
                f"{model.a:.3f}",
                f"{model.b:.2f} ({model.spread:.2f})",
                f"{model.rays:g}",
                f"{model.times:.1f}",
            ),
            f"{predicted_ratio(model.a, model.b, model.rays):.3f}",
            *(f"{model.predicted:.3f}", f"{model.measured:.3f}", f"{model.off:+.0%}"),
            f"{reused:.3f}",
        )
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return lines


def _adaptive(rows: list[Row]) -> list[Row]:
    """The adaptive rows of the paper's table."""
    return [r for r in rows if r.settings.reuse and not r.everywhere]


@dataclass(frozen=True)
class Model:
    """Equation 10 of one row: a, b with its spread, c as rays and as times, and the measurement."""

    a: float
    b: float
    spread: float
    rays: float
    times: float
    measured: float

    @classmethod
    def of(cls, rows: list[Row], row: Row) -> Model:
        """From the same row without reuse, and everywhere's."""
        key = (row.effect, row.size, row.label)
        free = next(r for r in rows if (r.effect, r.size, r.label) == key and not r.settings.reuse)
        whole = baseline(rows, row)
        stats = free.film.stats
        stages = whole.film.stats["seconds"]
        distributed = sum(s for stage, s in stages.items() if stage not in ("prepare", "total"))
        costs = free.costs
        assert costs is not None
        times = distributed / whole.film.stats["pixels"] / costs.summary()["plain"]
        return cls(stats["a"], costs.b, costs.spread, stats["c"], times, free.best / whole.best)

    @property
    def predicted(self) -> float:
        """The equation with c as times."""
        return predicted_ratio(self.a, self.b, self.times)

    @property
    def off(self) -> float:
        """Prediction over measurement, less 1."""
        return self.predicted / self.measured - 1.0


@dataclass(frozen=True)
class Check:
    """A promise of the project, what was seen, and whether it holds."""

    promise: str
    seen: str
    holds: bool


def checks(rows: list[Row]) -> list[Check]:
    """What has to hold for the table to mean anything."""
    found = []
    for effect, least in (("penumbra", 3.0), ("motion", 10.0)):
        own = [r for r in rows if r.effect == effect]
        adaptive = _adaptive(own)
        gains = [baseline(rows, r).best / r.best for r in adaptive]
        found.append(
            Check(
                f"{effect}: at least {least:g} times faster than everywhere",
                ", ".join(f"{g:.1f}" for g in gains),
                min(gains) >= least,
            )
        )
        off = [Model.of(rows, r).off for r in adaptive]
        found.append(
            Check(
                f"{effect}: equation 10 within 25 % where only unflagged pixels are saved",
                ", ".join(f"{x:+.0%}" for x in off),
                max(map(abs, off)) <= 0.25,
            )
        )
        first, second = (r for r in adaptive if r.size == 300)
        beyond = int((second.film.mask & ~first.film.mask).sum())
        found.append(
            Check(
                f"{effect}: order 2 flags no pixel that order 1 does not",
                f"{beyond} pixels",
                beyond == 0,
            )
        )
        for flagged in (True, False):
            worst = max(_difference(r, baseline(rows, r), flagged) for r in own if not r.everywhere)
            kind = "flagged" if flagged else "unflagged"
            found.append(
                Check(
                    f"{effect}: {kind} pixels equal everywhere's to 1e-12, relative",
                    f"{worst:.1e}",
                    worst <= 1e-12,
                )
            )
    return found


def _difference(row: Row, whole: Row, flagged: bool) -> float:
    """Greatest relative difference among a picture's (un)flagged pixels."""
    chosen = row.film.mask.any(axis=0) == flagged
    ours, theirs = row.film.color[:, chosen], whole.film.color[:, chosen]
    scale = np.maximum(np.abs(ours), np.abs(theirs))
    gap = np.abs(ours - theirs)
    return float(np.max(gap / np.where(scale > 0.0, scale, 1.0), initial=0.0))


def _checks(rows: list[Row]) -> list[str]:
    lines = ["## What was checked", "", "| promise | seen | holds |", "|---|---|---|"]
    lines += [
        f"| {c.promise} | {c.seen} | {'yes' if c.holds else '**no**'} |" for c in checks(rows)
    ]
    return lines
