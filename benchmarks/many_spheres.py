# SPDX-License-Identifier: GPL-3.0-or-later
"""Many spheres on a floor under a sky or a square light, ours beside Mitsuba: CPU time to an error.

    python benchmarks/many_spheres.py [--kinds packed] [--numbers 20 1000] [--lights sky square]
        [--sizes 80x60] [--tolerances 0.01] [--page FILE] [--append]

A packed cluster (overlapping balls, as a molecule) and a sparse gas (5 % of its volume). Both
renderers run on one thread, and CPU seconds count, so that other work on the machine matters
little.
Mitsuba samples the cosine under a sky, and else the light, by its direct integrator; its time at
an error is interpolated between sample counts, or extrapolated by a power law from the last two.
Errors are root mean squares over the mean, against Mitsuba with many more samples, whose own noise
is subtracted.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from dataclasses import replace
from itertools import product
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import machine
import numpy as np
import peer_mitsuba

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Camera,
    Material,
    Quad,
    QuadLight,
    Scene,
    ShapeRecord,
    SkyLight,
    Sphere,
)
from adaptive_drt.scene.film import Film
from adaptive_drt.scene.settings import Settings
from adaptive_drt.scene.sphere_batch import Spheres

RADIUS, GAP = 0.5, 0.62
"""Radius of the balls, and least distance of centres in a packed cluster, metres."""
GAS_FRACTION = 0.05
"""Fraction of the volume of a gas that balls fill."""
TOLERANCES = (1e-2, 1e-3)
LADDER = tuple(p * p for p in (5, 11, 23, 47))
"""Samples per pixel of the measured renders of Mitsuba: squares of primes, for its sampler."""
REFERENCE = 97 * 97
"""Samples per pixel of each of the renders of the reference."""
REFERENCES = 2
"""Number of renders of the reference."""
MOST_SAMPLES, MOST_REFERENCE = 1e8, 2.5e8
"""Numbers of samples of a picture up to which Mitsuba and its reference are rendered."""
LEAST_KNOWN = 0.5
"""Errors below this many times the reference's own noise are given as an upper bound."""

HEAD = """\
<!-- Written by benchmarks/many_spheres.py: `python benchmarks/many_spheres.py --page ...`. -->
# Many spheres

Measured on: {machine}. CPU seconds of one thread each; "error" is measured, root mean square over
the mean. Mitsuba {version}: seconds that it takes to the tolerance (a * marks extrapolation beyond
{most:,} samples a pixel). "faster" is Mitsuba's time over ours; "sampled" the share of the pixels
whose light rays find, because closed forms would cost more (`tracing/ray_costs`).

| balls | light | pixels | tolerance | ours, s | error | sampled | Mitsuba, s | faster |
|---|---|---|---|---|---|---|---|---|"""


TAIL = """
## Where the time goes

Of 1,000 packed balls under a sky at 1 %, 300 x 300 pixels, six tenths of the time go into the
pixels that rays sample, pilots included: 2.7 million points with four shadow rays each, 0.3
microseconds a ray, of which embree takes half. Mitsuba takes 0.12 to 0.16 microseconds a ray. The
rest of the time goes into the mask, candidates and interpolated blocks. Of 80 x 60 pixels the
pilots, which tell how errors end, take 18 %. The measured error is below the tolerance, because
what pilots tell is known to some 10 %, and 0.8 of the tolerance is aimed at.

A million packed balls under a square light, 160 x 90 pixels, 1 %, take 38 s of processor time (70
before few occluders stood for all of them; load 11), of which camera rays, the mask and candidates
take 21 s, sampled pixels and pilots 15 s. 5.6 million points are traced. The peak is 711 MB: 230
bytes a ball in what is kept for the whole render, with embree's own tree, and up to 400 MB for the
candidates of one call.

At 0.1 % (100 x 100 pixels) a pixel that rays sample takes 5,400 points with four rays each. A point
of a floor beside the heap has all 1,000 balls above its horizon, of which 60 bound what is open.
Such points took milliseconds, and half of the whole time, before circles that others cover all
around were dropped first (`geometry/covered_circles`); they take a third of that since. Half of
what is left are closed forms, and a quarter rays; a seventh of all goes into pilots.
"""


def packed(count: int, rng: np.random.Generator) -> np.ndarray:
    """Centres (n, 3) in a ball, as close as throwing them at random gets."""
    size, kept = RADIUS * count ** (1.0 / 3.0), _Kept(count)
    # the ball grows with each batch: were they small, very many balls would be far apart
    batch = max(64, count // 16)
    while kept.number < count:
        thrown = rng.uniform(-size, size, (batch, 3))
        kept.add(thrown[(thrown**2).sum(axis=1) < size * size])
        size *= 1.001
    return kept.centers


class _Kept:
    """Centres with a gap between them, by cells of a cube, each of which has room for one.

    The cells near a centre are looked at rather than all centres, of which there may be a million.
    """

    def __init__(self, count: int) -> None:
        self.number, self.centers = 0, np.empty((count, 3))
        self.reach = 2.0 * RADIUS * count ** (1.0 / 3.0)
        self.cell = GAP / math.sqrt(3.0)
        # two cells around, so that all neighbours are there
        self.side = int(2.0 * self.reach / self.cell) + 6
        self.cells = np.full(self.side**3, -1, dtype=np.int32)
        steps = np.array(list(product(range(-2, 3), repeat=3)))
        self.around = (steps[:, 0] * self.side + steps[:, 1]) * self.side + steps[:, 2]

    def add(self, thrown: np.ndarray) -> None:
        """Keep those of some centres (n, 3) that have the gap to all before them."""
        place = ((thrown + self.reach) / self.cell).astype(np.int64) + 2
        index = (place[:, 0] * self.side + place[:, 1]) * self.side + place[:, 2]
        for step in self.around:  # most are too near to centres of earlier calls
            other = self.cells[index + step]
            gap = ((self.centers[other] - thrown) ** 2).sum(axis=1)
            free = (other < 0) | (gap > GAP * GAP)
            thrown, index = thrown[free], index[free]
        for center, cell in zip(thrown, index.tolist(), strict=True):
            near = self.cells[cell + self.around]
            near = near[near >= 0]
            gap = ((self.centers[near] - center) ** 2).sum(axis=1).min(initial=np.inf)
            if self.number < len(self.centers) and gap > GAP * GAP:
                self.centers[self.number] = center
                self.cells[cell] = self.number
                self.number += 1


def gas(count: int, rng: np.random.Generator) -> np.ndarray:
    """Centres (n, 3) in a cube, at random."""
    size = (count * 4.0 / 3.0 * math.pi * RADIUS**3 / GAS_FRACTION) ** (1.0 / 3.0)
    return rng.uniform(-0.5 * size, 0.5 * size, (count, 3))


KINDS = {"packed": packed, "gas": gas}


def sky(_: float) -> SkyLight:
    """A sky of uniform radiance."""
    return SkyLight((1.0, 1.0, 1.0))


def square(span: float) -> QuadLight:
    """A square light above a cluster of some span, half as wide, that faces down."""
    half = 0.25 * span
    return QuadLight((0.0, 0.0, 2.0 * span), (0.0, half, 0.0), (half, 0.0, 0.0), (8.0, 8.0, 8.0))


LIGHTS = {"sky": sky, "square": square}


def make_scene(
    kind: str, count: int, size: tuple[int, int], light: str = "sky", batch: bool = False
) -> Scene:
    """The balls on a floor under a sky or a square light, and a camera that they fill.

    batch : whether they are one record, as a point cloud is: a million records take a gigabyte.
    """
    rng = np.random.default_rng(count)
    center = KINDS[kind](count, rng)
    center[:, 2] += RADIUS - center[:, 2].min()
    span = float(np.ptp(center, axis=0).max()) + 2.0 * RADIUS
    colors = rng.uniform(0.3, 0.85, (6, 3)).tolist()
    looks = tuple(Material(tuple(color)) for color in colors)
    balls: list[ShapeRecord]
    if batch:
        place = np.ascontiguousarray(center.T)
        balls = [Spheres(place, np.full(count, RADIUS), np.arange(count) % len(looks), looks)]
    else:
        balls = [
            Sphere(tuple(place), RADIUS, looks[k % len(looks)])
            for k, place in enumerate(center.tolist())
        ]
    far = 4.0 * span
    floor = Quad((-far, -far, 0.0), (2.0 * far, 0.0, 0.0), (0.0, 2.0 * far, 0.0))
    eye, target = np.array((0.0, -2.0 * span, 1.2 * span)), np.array((0.0, 0.0, 0.45 * span))
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    frame = np.stack([right, np.cross(back, right), back, eye], axis=1).tolist()
    matrix = (*map(tuple, frame), (0.0, 0.0, 0.0, 1.0))
    camera = Camera(matrix=matrix, focal_length=50.0, resolution=size)
    return Scene(camera, (*balls, floor), (LIGHTS[light](span),))


class Mitsuba:
    """Mitsuba's renders of a scene, on one thread."""

    def __init__(self, scene: Scene) -> None:
        self.mi = peer_mitsuba.start()
        import drjit

        drjit.set_thread_count(1)
        self.version = f"{self.mi.__version__} {self.mi.variant()}"
        skies = isinstance(scene.lights[0], SkyLight)
        world = peer_mitsuba.describe(self.mi, replace(scene, lights=()) if skies else scene)
        if skies:
            # sampling the cosine has less noise than sampling the sky uniformly
            world["integrator"] |= {"emitter_samples": 0, "bsdf_samples": 1}
            white = {"type": "rgb", "value": [1.0, 1.0, 1.0]}
            world["sky"] = {"type": "constant", "radiance": white}
        self.world = self.mi.load_dict(world)

    def render(self, samples: int, seed: int) -> tuple[np.ndarray, float]:
        """A picture (3, height, width), row 0 below, and its CPU seconds."""
        start = time.process_time()
        picture = np.array(self.mi.render(self.world, spp=samples, seed=seed))
        return np.moveaxis(picture[::-1], -1, 0), time.process_time() - start


def time_to(error: float, rungs: list[tuple[int, float, float]]) -> tuple[float, bool]:
    """Seconds to an error by a power law between rungs (samples, seconds, error), and whether it
    lies beyond them.
    """
    upper = next((k for k, rung in enumerate(rungs) if rung[2] <= error), len(rungs) - 1)
    upper = max(upper, 1)
    (_, t0, e0), (_, t1, e1) = rungs[upper - 1 : upper + 1]
    slope = math.log(t1 / t0) / math.log(e1 / e0)
    return t1 * (error / e1) ** slope, error < rungs[-1][2]


def beside(scene: Scene, tolerances: list[float]) -> tuple[list[tuple[Film, list[str]]], str]:
    """For each tolerance our film and cells of a table: seconds, the error, Mitsuba's seconds, and
    how many times ours they are; and Mitsuba's version.
    """
    peer = Mitsuba(scene)
    pixels = math.prod(scene.camera.resolution)
    best = max(each for each in (*LADDER, REFERENCE) if each * pixels <= MOST_REFERENCE)
    parts = [peer.render(best, 100 + k)[0] for k in range(REFERENCES)]
    truth = np.mean(parts, axis=0)
    mean = truth.mean()
    spread = np.mean([((part - truth) ** 2).mean() for part in parts])
    noise = spread / (REFERENCES - 1) / mean**2

    def error_of(picture: np.ndarray) -> float:
        return float(((picture - truth) ** 2).mean() / mean**2 - noise)

    rungs = []
    for samples in (each for each in LADDER if each * pixels <= MOST_SAMPLES):
        peer.render(samples, 1)  # compiles
        picture, seconds = peer.render(samples, 2)
        rungs.append((samples, seconds, math.sqrt(max(error_of(picture), noise))))
    render_image(make_scene("packed", 8, (16, 12)), Settings(threads=1))
    found = []
    for tolerance in tolerances:
        start = time.process_time()
        film = render_image(scene, Settings(tolerance=tolerance, threads=1))
        seconds = time.process_time() - start
        off, floor = error_of(film.color), LEAST_KNOWN**2 * noise
        error = f"{math.sqrt(off):.1e}" if off > floor else f"< {math.sqrt(noise):.1e}"
        theirs, beyond = time_to(tolerance, rungs)
        far = f"{theirs:.2f}{'*' if beyond else ''}"
        found.append((film, [f"{seconds:.1f}", error, far, f"{theirs / seconds:.2f}"]))
    return found, peer.version


def measure(
    kind: str, count: int, size: tuple[int, int], light: str, tolerances: list[float]
) -> tuple[list[str], str]:
    """Rows of the table for one scene, and Mitsuba's version."""
    rows = []
    found, version = beside(make_scene(kind, count, size, light), tolerances)
    for tolerance, (film, (seconds, error, theirs, faster)) in zip(tolerances, found, strict=True):
        sampled = film.stats["sampled_pixels"] / (size[0] * size[1])
        rows.append(
            f"| {count:,} {kind} | {light} | {size[0]} x {size[1]} | {tolerance:g} | "
            f"{seconds} | {error} | {sampled:.2f} | {theirs} | {faster} |"
        )
        print(rows[-1], flush=True)
    return rows, version


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--numbers", nargs="+", type=int, default=[20, 100, 300, 1000])
    parser.add_argument("--lights", nargs="+", choices=LIGHTS, default=["sky"])
    parser.add_argument("--sizes", nargs="+", default=["80x60"], help="as 80x60")
    parser.add_argument("--tolerances", nargs="+", type=float, default=list(TOLERANCES))
    parser.add_argument("--page", type=Path, help="where to write as well")
    parser.add_argument("--append", action="store_true", help="keep the rows of the page")
    given = parser.parse_args()
    about, rows, version = machine.describe(), [], ""
    if given.append and given.page and given.page.exists():
        lines = given.page.read_text(encoding="utf-8").splitlines()
        rows = [line for line in lines if line.startswith("| ") and line[2].isdigit()]
    cases = product(given.lights, given.kinds, given.numbers, given.sizes)
    for light, kind, count, size in cases:
        width, height = (int(part) for part in size.split("x"))
        own, version = measure(kind, count, (width, height), light, given.tolerances)
        rows += own
        text = HEAD.format(machine=about, version=version, most=LADDER[-1])
        if given.page:
            given.page.write_text("\n".join([text, *rows]) + "\n" + TAIL, encoding="utf-8")


if __name__ == "__main__":
    main()
