# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of a render: kept on the mask image, and said in one line."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, fields, replace
from typing import Any

from ..adaptive_drt.scene.description import Issue, Scene
from ..adaptive_drt.scene.settings import Settings

KEY = "adaptive_drt"
"""Custom property of the mask image that holds the figures as JSON."""

REGION = "region"
"""The figure in a written file's header that says which pixels were rendered."""


def fingerprint(scene: Scene, settings: Settings) -> str:
    """Return what two renders share that differ in nothing but their distribution."""
    same = replace(settings, distribution="ADAPTIVE")
    return hashlib.sha256(repr((scene, same)).encode()).hexdigest()


def read_figures(image: Any | None) -> dict[str, Any]:
    """Return the figures of an image, empty where there are none that can be read."""
    try:
        return dict(json.loads(image.get(KEY, "{}"))) if image is not None else {}
    except (TypeError, ValueError):
        return {}


def gather_figures(
    stats: dict[str, Any], scene: Scene, settings: Settings, before: dict[str, Any]
) -> dict[str, Any]:
    """Return the figures of a render, beside those of its counterpart if that ran before it.

    Parameters
    ----------
    stats : `Film.stats`.
    before : figures of the render before this one; if they are of the same scene and settings
        but the other distribution, "measured_ratio" is this pair's adaptive seconds over
        everywhere seconds, to be held against "predicted_ratio" of equation 10.
    """
    figures = dict(stats)
    figures["settings"] = asdict(settings)
    key = fingerprint(scene, settings)
    kept = before.get("runs", {}) if before.get("fingerprint") == key else {}
    runs = dict(kept)
    seconds = stats.get("seconds", {}).get("total")
    if seconds is not None and not stats.get("cancelled"):
        runs[settings.distribution] = {
            "seconds": seconds,
            "predicted": stats.get("predicted_ratio"),
        }
    figures["fingerprint"], figures["runs"] = key, runs
    if {"ADAPTIVE", "EVERYWHERE"} <= runs.keys():
        everywhere = runs["EVERYWHERE"]["seconds"]
        if everywhere > 0.0:
            figures["measured_ratio"] = runs["ADAPTIVE"]["seconds"] / everywhere
        figures["predicted_ratio"] = runs["ADAPTIVE"]["predicted"]
    return figures


def issues_of(figures: dict[str, Any]) -> list[Issue]:
    """Return what a render left out."""
    known = {one.name for one in fields(Issue)}
    found = figures.get("issues", [])
    return [Issue(**{key: i[key] for key in i.keys() & known}) for i in found]


def derivative_cost(figures: dict[str, Any]) -> str | None:
    """Return b of the paper's cost model with its interquartile range, None where it has none."""
    if "b" not in figures:
        return None
    if figures["b"] is None:
        return "not measured"
    spread = figures.get("b_spread")
    return f"{figures['b']:.3g}" + (f" (spread {spread:.2g})" if spread else "")


def summary(figures: dict[str, Any]) -> str:
    """Return one line about a render."""
    counts = figures.get("counts", {})
    pixels = figures.get("pixels") or 1
    parts = []
    seconds = figures.get("seconds", {}).get("total")
    if seconds is not None:
        parts.append(f"{seconds:.2f} s")
    if "distributed" in counts:
        parts.append(f"{100.0 * counts['distributed'] / pixels:.1f} % of pixels distributed")
    for name in ("penumbra", "motion", "edge"):
        if name in counts:
            parts.append(f"{name} {counts[name]:,}")
    costs = {
        "a": f"{figures['a']:.4g}" if "a" in figures else None,
        "b": derivative_cost(figures),
        "c": f"{figures['c']:.4g}" if "c" in figures else None,
    }
    parts += [f"{name} = {value}" for name, value in costs.items() if value]
    return ", ".join(parts)
