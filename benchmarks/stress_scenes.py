# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole scenes by seed: hostile ones, moved and turned ones, and masks on adversarial ones.

Each function takes one seed and returns what was found; they are run by many processes.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import dataclass, field, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "helpers"))

import numpy as np

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Scene, SceneError
from adaptive_drt.scene.settings import Settings
from adversarial_case import Case
from adversarial_scenes import FAMILIES
from adversarial_scenes import adversarial as adversarial_case
from adversarial_solids import adversarial_solid
from hostile_meshes import hostile_mesh_scene, many_doubled_faces
from hostile_scenes import brightest, hostile_scene
from random_scenes import random_scene, scaled
from transforms import mirrored, moved, random_rotation, reordered, turned

__all__ = [
    "CLOSEST",
    "CLOSEST_EACH",
    "LIMITS",
    "MOST_FLAGGED",
    "WAYS",
    "Found",
    "adversarial",
    "adversarial_solids",
    "hostile",
    "hostile_meshes",
    "invariance",
]

RAYS = Settings(method="RAYS", light_rays=4, time_rays=4, pixel_rays=4, threads=1)
WAYS = {
    "order 2": RAYS,
    "order 1": replace(RAYS, order=1),
    "everywhere": replace(RAYS, distribution="EVERYWHERE"),
    "embree": replace(RAYS, accelerator="EMBREE"),
}
WAYS |= {
    f"exact to {tolerance:g}": Settings(method="EXACT", tolerance=tolerance, threads=1)
    for tolerance in (1e-1, 1e-2, 1e-3)
}
CLOSEST, CLOSEST_EACH = "exact to 0.001", 8
"""A way that takes as long as all others: one scene in so many is rendered so."""
MESH_WAYS = ("order 2", "everywhere", "exact to 0.1")
"""The ways in which scenes of meshes are rendered."""
MILLION_EACH = 200
"""One scene of meshes in so many is one of a million faces."""
CHANGED = {"exact": Settings(method="EXACT", threads=1), "rays": RAYS}
LIMITS = {
    f"{method}, {change}": limit
    for method in CHANGED
    for change, limit in {
        "moved by 1e3 sizes": 1e-6,
        "moved by 1e6 sizes": 1e-6,
        "scaled by 2^-130": 0.0,
        "scaled by 2^30": 0.0,
        "scaled by 1e-6": 1e-9,
        "scaled by 1e6": 1e-9,
        "reordered": 1e-9,
        "turned": 1e-9,
        "mirrored": 1e-9,
    }.items()
}
"""Relative RMSE between the pictures of a scene before and after a change. A move by a million
sizes rounds every coordinate by 1e-10 of the scene."""
MOST_FLAGGED = 1.1
"""Flagged over truly dependent pixels at order 2."""


@dataclass
class Found:
    """What one seed showed: `faults`, each a sentence, and figures by name."""

    seed: int
    faults: list[str] = field(default_factory=list)
    figures: dict[str, float] = field(default_factory=dict)


def hostile(seed: int) -> Found:
    """Render a hostile scene in every way; every number must be one that can be shown."""
    ways = {name: s for name, s in WAYS.items() if name != CLOSEST or not seed % CLOSEST_EACH}
    return _rendered(seed, hostile_scene(seed), ways)


def hostile_meshes(seed: int) -> Found:
    """Render a hostile scene of meshes and instances in some ways; of a million doubled faces,
    one in so many."""
    ways = {name: WAYS[name] for name in MESH_WAYS}
    if not seed % MILLION_EACH:
        return _rendered(seed, many_doubled_faces(), {MESH_WAYS[-1]: WAYS[MESH_WAYS[-1]]})
    return _rendered(seed, hostile_mesh_scene(seed), ways)


def _rendered(seed: int, scene: Scene, ways: dict[str, Settings]) -> Found:
    """Render a scene in several ways."""
    found = Found(seed)
    for name, settings in ways.items():
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                film = render_image(scene, settings)
        except SceneError:
            found.figures["refused"] = 1.0
            continue
        except Exception as error:
            found.faults.append(f"{name}: {type(error).__name__}: {error}")
            continue
        fine = all(np.isfinite(x).all() for x in (film.color, film.alpha, film.depth, film.normal))
        if not fine:
            found.faults.append(f"{name}: a number that is not finite")
        elif not ((film.color >= 0.0) & (film.color <= brightest(scene)[:, None, None])).all():
            found.faults.append(f"{name}: light that is below zero or more than the lights send")
        found.figures["renders"] = found.figures.get("renders", 0.0) + 1.0
        if name.startswith("exact"):
            found.figures[f"points, {name}"] = float(film.samples.mean())
    return found


def invariance(seed: int) -> Found:
    """Relative RMSE between a random scene's pictures before and after changes of the whole."""
    found = Found(seed)
    rng = np.random.default_rng((seed, 5))
    scene = random_scene(seed)
    place = np.array([row[3] for row in scene.camera.matrix[:3]])
    shift = rng.normal(size=3)
    shift *= np.linalg.norm(place) / np.linalg.norm(shift)
    turn, mirror = random_rotation(rng), rng.normal(size=3)
    for method, settings in CHANGED.items():
        rays = method == "rays"
        changes = {
            "moved by 1e3 sizes": moved(scene, 1e3 * shift),
            "moved by 1e6 sizes": moved(scene, 1e6 * shift),
            "scaled by 2^-130": scaled(scene, 2.0**-130),
            "scaled by 2^30": scaled(scene, 2.0**30),
            "scaled by 1e-6": scaled(scene, 1e-6),
            "scaled by 1e6": scaled(scene, 1e6),
            # the order of the lights chooses the points that rays take of each
            "reordered": reordered(scene, rng, not rays),
            "turned": turned(scene, turn),
            "mirrored": mirrored(scene, mirror),
        }
        # a mirror turns a quad light's second coordinate about
        hard = replace(settings, use_penumbra=False) if rays else settings
        wants = {id(s): render_image(scene, s).color for s in (settings, hard)}
        for change, other in changes.items():
            way = hard if change == "mirrored" else settings
            name = f"{method}, {change}"
            found.figures[name] = off = _difference(wants[id(way)], other, way)
            if not off <= LIMITS[name]:
                found.faults.append(f"{name}: relative RMSE {off:.1e}")
    return found


def _difference(want: np.ndarray, scene: Scene, settings: Settings) -> float:
    picture = render_image(scene, settings).color
    return float(np.sqrt(((picture - want) ** 2).mean()) / max(want.mean(), 1e-300))


def adversarial(seed: int) -> Found:
    """Hold the mask of an adversarial scene against the truth in extended precision."""
    name = FAMILIES[seed % len(FAMILIES)].__name__.replace("_", " ")
    return _masked(seed, adversarial_case(seed), name)


def adversarial_solids(seed: int) -> Found:
    """The same with an ellipsoid, cylinder, cone or ellipse."""
    case, family, kind = adversarial_solid(seed)
    return _masked(seed, case, f"{family}, {kind}")


def _masked(seed: int, case: Case, name: str) -> Found:
    """What masks of both orders leave out, and what that of order 2 flags."""
    found = Found(seed)
    for order in (2, 1):
        settings = replace(RAYS, order=order, **case.switches)
        mask = render_image(case.scene, settings).mask[case.row]
        gone = case.left_out(mask)
        if gone.size:
            found.faults.append(f"{name}, order {order}: {gone.size} pixels, by {gone.max():.1e}")
        if order == 2:
            depend, flagged = case.counts(mask)
            found.figures = {f"{name}:depend": float(depend), f"{name}:flagged": float(flagged)}
    return found
