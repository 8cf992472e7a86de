# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of docs/algorithm.md, drawn from what the tracer itself computes.

They take less than a minute: `python benchmarks/algorithm_figures.py`.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import matplotlib
import numpy as np

matplotlib.use("Agg")
from algorithm_scene import Watched, example_scene, plan_of, seen_at, watch
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.patches import Ellipse

from adaptive_drt.cubature.nodes import make_nodes, rotation_index
from adaptive_drt.detection.occlusion import classify_light_visibility
from adaptive_drt.geometry.sphere.kernels import discriminant
from adaptive_drt.geometry.sphere.shape import SphereSet
from adaptive_drt.numerics.arrays import Array
from adaptive_drt.numerics.axes import TIME
from adaptive_drt.numerics.jet import Jet
from adaptive_drt.numerics.line_lattice import Lattice
from adaptive_drt.numerics.low_discrepancy import low_discrepancy_points
from adaptive_drt.numerics.taylor_range import interval_range, rectangle_range
from adaptive_drt.numerics.vector import dot
from adaptive_drt.scene.film import Film
from adaptive_drt.shading.partial_occlusion import apply_occluders
from adaptive_drt.shading.ratio_estimator import gather_light, unoccluded_factor
from adaptive_drt.tracing.compile import Plan
from adaptive_drt.tracing.intersect import Pairs, surface
from adaptive_drt.tracing.occluder_culling import Occluders
from adaptive_drt.visibility.fragments import Boxes, find_fragments
from adaptive_drt.visibility.line_intervals import hit_intervals
from adaptive_drt.visibility.polynomials import make_polynomials

ROOT = Path(__file__).resolve().parent.parent
FINER = 0.05
"""Of the tolerance: that of the picture which errors are held against."""
FINE = 160
"""Places an axis at which a pixel or a light is looked at, to draw it."""
OBJECTS = ListedColormap(["#182030", "#d9534f", "#5b7fd6", "#e3b94c", "#c9c5bd", "#9c968c"])
"""Background, red, blue, gold, floor, wall."""
RED, MOVING = 0, 2
ASLANT = 0.5
"""Of a sphere's radius: how far above its middle an outline is looked at."""


def _spheres(plan: Plan) -> SphereSet:
    """The spheres of a compiled scene, whose object numbers begin with 0."""
    found = plan.shapes.sets[0]
    assert isinstance(found, SphereSet)
    return found


def shown(color: Array) -> Array:
    """Radiance (3, height, width) as sRGB (IEC 61966-2-1), clipped."""
    linear = np.clip(np.moveaxis(color, 0, -1), 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def picture(axes: Axes, image: Array, title: str, **how: object) -> object:
    """Show an image, row 0 at the bottom."""
    axes.set_title(title, fontsize=9)
    axes.set_xticks([])
    axes.set_yticks([])
    return axes.imshow(image, origin="lower", interpolation="nearest", **how)


def result(watched: Watched, film: Film) -> plt.Figure:
    """The finished picture beside the one ray a pixel of the first pass."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.1))
    picture(axes[0], shown(watched.first), "first pass: one shaded point a pixel, or fewer")
    picture(axes[1], shown(film.color), "finished, tolerance 0.1 %")
    return figure


def masks(film: Film) -> plt.Figure:
    """The mask by effect."""
    figure, axes = plt.subplots(1, 3, figsize=(10, 2.4))
    for row, (name, axis) in enumerate(zip(("penumbra", "motion", "edge"), axes, strict=True)):
        flagged = film.mask[row]
        image = 0.45 * shown(film.color).mean(axis=2, keepdims=True).repeat(3, axis=2)
        image[flagged] *= 0.5
        image[..., row] += 0.7 * flagged
        picture(axis, np.clip(image, 0, 1), f"{name}: {100 * flagged.mean():.1f} % of the pixels")
    return figure


def jets(plan: Plan) -> plt.Figure:
    """Discriminants as jets: over the shutter, and over a pixel."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.3))
    _over_shutter(plan, axes[0])
    _over_pixel(plan, axes[1], figure)
    return figure


def _over_shutter(plan: Plan, axis: Axes) -> None:
    """A ray that the moving sphere only just meets."""
    assert _spheres(plan).displacement is not None
    v, d = (part[:, MOVING, None] for part in (_spheres(plan).center, _spheres(plan).displacement))
    r = _spheres(plan).radius[MOVING]
    end = v + 0.5 * d
    x, y = _project(plan, end)
    radius = r * _project(plan, end + np.array([[1.0], [0.0], [0.0]]))[0] - r * x
    w = plan.lens.directions(x + 0.75 * radius, y)
    t = np.linspace(-0.5, 0.5, 201)
    axis.plot(t, discriminant(w, v + t * d, r), "k", lw=3, alpha=0.3, label="D itself")
    remainder = 0.25 * dot(w, w) * dot(d, d)
    for order, colour in ((1, "tab:orange"), (2, "tab:blue")):
        jet = discriminant(w, Jet.linear(v, (d,), order), r)
        axis.plot(t, jet.at([t]), colour, lw=1.2, label=f"jet of order {order} at t = 0")
        low, high = interval_range(jet, 0.5, remainder)
        place = 0.53 + 0.04 * order
        axis.plot([place, place], [low[0], high[0]], colour, lw=3)
    axis.axhline(0.0, color="grey", lw=0.6)
    axis.set_xlabel("shutter time t; bars: range that the test may use", fontsize=8)
    axis.set_title("over the shutter: a sphere comes to a ray", fontsize=9)
    axis.legend(fontsize=7)


def _project(plan: Plan, place: Array) -> tuple[Array, Array]:
    """Picture coordinates of places (3, n), relative to the camera."""
    lens = plan.lens
    x, y, t = np.linalg.solve(np.array([lens.right, lens.up, lens.base]).T, place)
    return x / t, y / t


def _over_pixel(plan: Plan, axis: Axes, figure: plt.Figure) -> None:
    """A pixel that the outline of a sphere passes through."""
    v, r = _spheres(plan).center[:, RED, None], _spheres(plan).radius[RED]
    x, y = _edge_pixel(plan)
    lens = plan.lens
    w = lens.directions(np.array([x + 0.5]), np.array([y + 0.5]))
    ray = Jet.linear(w, (lens.right[:, None], lens.up[:, None]), 2)
    jet = discriminant(ray, v, r)
    low, high = rectangle_range(jet, 0.5, 0.5)
    s = np.linspace(-0.5, 0.5, FINE)
    values = jet.at([s[None, :], s[:, None]])
    image = axis.imshow(values, origin="lower", extent=(-0.5, 0.5, -0.5, 0.5), cmap="RdBu")
    image.set_clim(-abs(values).max(), abs(values).max())
    axis.contour(s, s, values, [0.0], colors="k")
    axis.set_title(f"over a pixel: D from {low[0]:.3f} to {high[0]:.3f}, D = 0 black", fontsize=9)
    axis.set_xlabel("x", fontsize=8)
    axis.set_ylabel("y", fontsize=8)
    figure.colorbar(image, ax=axis, shrink=0.9)


def _edge_pixel(plan: Plan) -> tuple[int, int]:
    """A pixel that the red sphere's outline crosses aslant, up on its right."""
    x, y = (float(part[0]) for part in _project(plan, _spheres(plan).center[:, RED, None]))
    return _last_of_red(plan, x, int(y + ASLANT * (_last_of_red(plan, x, int(y))[0] - x)))


def _last_of_red(plan: Plan, x: float, row: int) -> tuple[int, int]:
    """The last pixel of a row, from x on, in whose middle the red sphere is seen."""
    across, still = np.arange(int(x), plan.resolution[0]), np.zeros(plan.resolution[0] - int(x))
    item, _ = seen_at(plan, across + 0.5, still + row + 0.5, still)
    return int(across[item == RED].max()), row


def blocks(watched: Watched, film: Film) -> plt.Figure:
    """Blocks proven smooth, and the nodes at which they are shaded."""
    figure, axis = plt.subplots(figsize=(8, 4.9))
    picture(axis, 0.6 * shown(film.color) + 0.4, "")
    share = 0
    for block in (block for found in watched.first_passes for block in found.blocks):
        side, colour = block.side, "tab:green" if block.side == 8 else "tab:purple"
        corner = np.array([block.x, block.y]).T * side - 0.5
        inside = ((corner > -1) & (corner < np.array(film.color.shape[:0:-1]))).all(axis=1)
        share += side * side * int(inside.sum())
        square = np.array([[0, 0], [side, 0], [side, side], [0, side], [0, 0]])
        lines = LineCollection(corner[:, None] + square, colors=colour, linewidths=0.6)
        axis.add_collection(lines)
    part = 100 * share / film.samples.size
    title = f"blocks of 8 x 8 (green) and 4 x 4 pixels (violet), {part:.0f} % of the picture"
    axis.set_title(f"{title}: at most 16 points each", fontsize=9)
    axis.set_xlim(-0.5, film.width - 0.5)
    axis.set_ylim(-0.5, film.height - 0.5)
    return figure


def light(plan: Plan, film: Film) -> plt.Figure:
    """The light as a point in a penumbra sees it: outline against rays."""
    occluders, emitter = Occluders(plan), plan.lights[0]
    y, x = _half_hidden(plan, film)
    w = plan.lens.directions(np.array([x + 0.5]), np.array([y + 0.5]))
    item, depth = seen_at(plan, np.array([x + 0.5]), np.array([y + 0.5]), np.zeros(1))
    point = surface(plan, w, depth, item)
    pairs = classify_light_visibility(
        plan, point, emitter, occluders.find_candidates(emitter, point)
    ).pairs
    open_ = unoccluded_factor(emitter, emitter, emitter.to_center(point.point), point)
    closed = open_.copy()
    apply_occluders(plan, point, emitter, pairs, 0.0, closed)
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.5))
    _light_plane(plan, point.point, pairs, axes[0])
    counts = 2 ** np.arange(2, 15)
    off = []
    for rays in counts:
        spots = low_discrepancy_points(0, np.zeros(1, dtype=np.int64), 1, int(rays), 2)
        estimate = gather_light(plan, point, emitter, pairs, (spots[0], spots[1]), 0.0).estimate()
        off.append(float(abs(estimate - closed)[0] / open_[0]))
    axes[1].loglog(counts, off, "o-", ms=3)
    axes[1].axvline(49, color="grey", lw=0.6)
    axes[1].set_xlabel("rays to the light (grey: the paper's 49)", fontsize=8)
    axes[1].set_title("rays less the closed form, of the unhidden light", fontsize=9)
    return figure


def _half_hidden(plan: Plan, film: Film) -> tuple[int, int]:
    """Row and column of a pixel on the floor in the middle of the red sphere's penumbra."""
    x, y = (float(part[0]) for part in _project(plan, _spheres(plan).center[:, RED, None]))
    rows = np.arange(5, int(y))
    radiance = film.color[0, rows, int(x) + 30]
    mask = film.mask[0, rows, int(x) + 30] & ~film.mask[1:, rows, int(x) + 30].any(axis=0)
    middle = 0.5 * (radiance[mask].max() + radiance[mask].min())
    return int(rows[mask][np.argmin(abs(radiance[mask] - middle))]), int(x) + 30


def _light_plane(plan: Plan, point: Array, pairs: Pairs, axis: Axes) -> None:
    """What is hidden of the light, over its own plane, and the paper's rays."""
    emitter = plan.lights[0]

    def sign(u: Array, v: Array) -> Array:
        to = emitter.to_center(point) + u * emitter.span.half_u + v * emitter.span.half_v
        way = _spheres(plan).center[:, :, None] - point[:, :, None]
        balls = pairs.item[pairs.item < _spheres(plan).count]
        return np.max(
            [discriminant(to, way[:, k], _spheres(plan).radius[k]) for k in balls], axis=0
        )

    s = np.linspace(-1.25, 1.25, FINE)
    u, v = (part.ravel() for part in np.meshgrid(s, s))
    values = sign(u, v).reshape(FINE, FINE)
    axis.contourf(s, s, values, [-1e9, 0.0, 1e9], colors=["#fff3c4", "#566"])
    axis.contour(s, s, values, [0.0], colors="k")
    axis.plot([-1, 1, 1, -1, -1], [-1, -1, 1, 1, -1], "tab:orange", lw=2)
    a, b = low_discrepancy_points(0, np.zeros(1, dtype=np.int64), 1, 49, 2)
    u, v = 2.0 * a[0] - 1.0, 2.0 * b[0] - 1.0
    free = sign(u, v) <= 0.0
    axis.plot(u[free], v[free], "o", color="tab:green", ms=3)
    axis.plot(u[~free], v[~free], "x", color="tab:red", ms=4)
    axis.set_aspect("equal")
    axis.set_title("the light's plane seen from a point in a penumbra", fontsize=9)


def regions(plan: Plan) -> plt.Figure:
    """A pixel with an edge, and one in which something moves."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 4.2))
    x, y = _edge_pixel(plan)
    _show_regions(plan, axes[0], np.array([x, y, 0.0]), np.array([x + 1.0, y + 1.0, 0.0]), (0, 1))
    axes[0].set_title("a still pixel: x and y", fontsize=9)
    assert _spheres(plan).displacement is not None
    end = _spheres(plan).center[:, MOVING] + 0.1 * _spheres(plan).displacement[:, MOVING]
    right = end + _spheres(plan).radius[MOVING] * np.array([1.0, 0.0, 0.0])
    x, y = (float(np.floor(part[0])) for part in _project(plan, right[:, None]))
    _show_regions(plan, axes[1], np.array([x, y, -0.5]), np.array([x + 1.0, y + 1.0, 0.5]), (0, 2))
    axes[1].set_title("a pixel that a sphere passes: x and time, at the middle of y", fontsize=9)
    return figure


def _show_regions(
    plan: Plan, axis: Axes, low: Array, high: Array, shown_axes: tuple[int, int]
) -> None:
    one, other = shown_axes
    place = np.repeat(0.5 * (low + high)[:, None], FINE * FINE, axis=1)
    s = [low[k] + (np.arange(FINE) + 0.5) / FINE * (high[k] - low[k]) for k in shown_axes]
    place[one], place[other] = (part.ravel() for part in np.meshgrid(*s))
    item, _ = seen_at(plan, *place)
    extent = (low[one], high[one], low[other], high[other])
    axis.imshow(
        item.reshape(FINE, FINE) + 1, origin="lower", extent=extent, aspect="auto",
        cmap=OBJECTS, vmin=-0.5, vmax=5.5,
    )  # fmt: skip
    boxes = Boxes(low[:, None], high[:, None])
    every = np.arange(plan.object_count)
    pairs = Pairs(np.zeros_like(every), every)
    found = find_fragments(plan, boxes, pairs, 1e-3, 16)
    wide = (high > low)[:, None] & np.ones(found.item.size, dtype=np.bool_)
    star, turn = np.ones(found.item.size, dtype=np.bool_), rotation_index(found.centroid)
    arms = make_nodes(found.centroid, found.cholesky, wide, star, ~star, turn)
    samples = found.centroid[:, arms.subdomain] + arms.offset
    axis.plot(samples[one], samples[other], "ko", ms=4, mfc="w")
    axis.plot(found.centroid[one], found.centroid[other], "k+", ms=9, mew=2)
    for k in range(found.item.size):
        axis.add_patch(_ellipse(found.centroid[:, k], found.cholesky[:, k], shown_axes))
    _show_lines(plan, axis, boxes, pairs, other == TIME)


def _ellipse(place: Array, spread: Array, shown_axes: tuple[int, int]) -> Ellipse:
    """One standard deviation of a region."""
    xx, yx, yy, tx, ty, tt = spread
    root = np.array([[xx, 0, 0], [yx, yy, 0], [tx, ty, tt]])[list(shown_axes)]
    size, way = np.linalg.eigh(root @ root.T)
    angle = np.degrees(np.arctan2(way[1, 1], way[0, 1]))
    size = 2.0 * np.sqrt(np.maximum(size, 0.0))
    return Ellipse(place[list(shown_axes)], size[1], size[0], angle=angle, fill=False, ls=":")


def _show_lines(plan: Plan, axis: Axes, boxes: Boxes, pairs: Pairs, timed: bool) -> None:
    """Eight lines, along x or t, and where they meet the outlines of spheres."""
    forms, cover = make_polynomials(plan, boxes, pairs)
    low, size = boxes.low[:, 0], (boxes.high - boxes.low)[:, 0]
    along, across = (TIME, 0) if timed else (0, 1)
    first, last = hit_intervals(forms, cover.all_hit, Lattice(along, 8, 1))
    for k in range(8):
        place = low[across] + (k + 0.5) / 8 * size[across]
        met = last[k, 0, : _spheres(plan).count] > first[k, 0, : _spheres(plan).count]
        ends = np.concatenate([end[k, 0, : _spheres(plan).count][met] for end in (first, last)])
        ends = low[along] + (ends[abs(ends) < 0.5] + 0.5) * size[along]
        (axis.axvline if timed else axis.axhline)(place, color="k", lw=0.4)
        axis.plot(*((place + 0 * ends, ends) if timed else (ends, place + 0 * ends)), "k.", ms=6)


def samples(film: Film) -> plt.Figure:
    """Points shaded in each pixel."""
    figure, axis = plt.subplots(figsize=(8, 4.6))
    image = picture(axis, film.samples, "", norm=LogNorm(1, film.samples.max()), cmap="magma")
    one = 100 * (film.samples == 1).mean()
    axis.set_title(
        f"shaded points: {film.samples.mean():.1f} a pixel on average, "
        f"at most {film.samples.max()}; {one:.0f} % of the pixels count 1",
        fontsize=9,
    )
    figure.colorbar(image, ax=axis, shrink=0.8)
    return figure


def errors(watched: Watched, film: Film, finer: Film) -> plt.Figure:
    """The estimated error of each pixel, and what a finer picture says."""
    assert watched.frame is not None
    tolerance, mean = watched.plan.settings.tolerance, film.color.mean()
    estimate = watched.table(watched.frame.error) / mean
    true = np.sqrt(((film.color - finer.color) ** 2).mean(axis=0)) / mean
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.0), width_ratios=(1, 1, 1.1))
    for axis, values, name in ((axes[0], estimate, "estimated"), (axes[1], true, "measured")):
        rms = np.sqrt((values**2).mean())
        title = f"{name}: {rms / tolerance:.2f} of the tolerance"
        image = picture(axis, np.maximum(values, 1e-7), title, norm=LogNorm(1e-6, 1e-2))
    figure.colorbar(image, ax=axes[:2].tolist(), shrink=0.8, location="bottom")
    bins = np.logspace(-7, -1, 60)
    begin = watched.before / mean
    for values, name in ((begin, "after the first pass"), (estimate, "estimated in the end"),
                         (true, "measured in the end")):  # fmt: skip
        axes[2].hist(np.maximum(values, 1e-7).ravel(), bins, histtype="step", label=name, log=True)
    axes[2].axvline(tolerance, color="k", lw=0.8)
    axes[2].axvline(watched.goal.error / mean, color="k", lw=0.8, ls=":")
    axes[2].set_xscale("log")
    axes[2].set_title("pixels by error (line: tolerance; dotted: goal)", fontsize=9)
    axes[2].legend(fontsize=7)
    return figure


def main() -> None:
    """Draw all figures."""
    parser = argparse.ArgumentParser(description="The figures of docs/algorithm.md.")
    parser.add_argument("--pictures", type=Path, default=ROOT / "docs" / "pictures")
    given = parser.parse_args()
    scene = example_scene()
    watched, film = watch(scene)
    _, finer = watch(scene, tolerance=FINER * watched.plan.settings.tolerance)
    plan = plan_of(scene)
    drawn = {
        "result": result(watched, film),
        "mask": masks(film),
        "jets": jets(plan),
        "blocks": blocks(watched, film),
        "light": light(plan, film),
        "regions": regions(plan),
        "samples": samples(film),
        "error": errors(watched, film, finer),
    }
    for name, figure in drawn.items():
        path = given.pictures / f"algorithm-{name}.png"
        figure.savefig(path, dpi=100, bbox_inches="tight", pil_kwargs={"optimize": True})
    print(f"error estimate {watched.error_estimate:.2e}, {film.samples.mean():.2f} points a pixel")


if __name__ == "__main__":
    main()
