# SPDX-License-Identifier: GPL-3.0-or-later
"""Molecules under a uniform sky, an image of a sky and a sun, ours beside Mitsuba and Cycles.

    python benchmarks/skies.py [--cases caffeine:sky ...] [--size 64x48] [--page FILE]

Caffeine, its atoms as balls by van der Waals' radii (Bondi, J. Phys. Chem. 68, 1964), and 300
packed balls, each on a floor. All render on one thread, and CPU seconds count. The peers' times at
an error are interpolated between sample counts, or extrapolated from the last two. Errors are root
mean squares over the mean, against Mitsuba with many more samples, whose own noise is subtracted.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import machine
import numpy as np
from many_spheres import make_scene, time_to
from sticks import ATOMS, LOOKS

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import EnvironmentLight, Material, Scene, Sphere, SunLight
from adaptive_drt.scene.settings import Settings

RADII = {"C": 1.70, "N": 1.55, "O": 1.52, "H": 1.20}
"""Van der Waals' radii, angstroms."""
PACKED = 300
"""Number of the packed balls."""
TOLERANCES = (1e-2, 1e-3)
ROWS = 256
"""Rows of the image of a sky, which has twice as many columns."""
SUN = np.array((-0.5, 0.4, 0.7)) / math.sqrt(0.9)
"""Direction to the sun."""
SUN_ANGLE, SUN_DISTANCE = math.radians(4.0), 1e5
"""Angle from side to side, and distance at which Mitsuba has it as a ball."""
IRRADIANCE = 2.0
"""Irradiance of the sun."""
LADDER = tuple(p * p for p in (3, 7, 13, 23))
"""Samples per pixel of the peers' renders: squares of primes, for Mitsuba's sampler."""
REFERENCE, REFERENCES = 73 * 73, 3
"""Samples per pixel of each render of the reference, and number of these."""
LEAST_KNOWN, FLOOR = 0.5, 0.04
"""Errors below this many times the reference's own noise are given as an upper bound; and the least
squared error, in units of the noise's square, that a difference counts as."""
CASES = ("caffeine:sky", "caffeine:image", "caffeine:sun", "packed:sky", "packed:sun")

HEAD = """\
<!-- Written by benchmarks/skies.py: `python benchmarks/skies.py --page docs/skies.md`. -->
# Molecules under skies

Measured on: {machine}. CPU seconds of one thread each, {size} pixels. "error" is measured, root
mean square over the mean. {versions}: seconds that they take to the tolerance (a * marks
extrapolation beyond {most:,} samples a pixel), and how many times ours that is. "image" is an image
of 256 x 512 pixels of a sky with a glow, "sun" a disk of 4 degrees, and "packed" are 300 balls.

| molecule | light | tolerance | ours, s | error | Mitsuba, s | Cycles, s | Mitsuba | Cycles |
|---|---|---|---|---|---|---|---|---|"""
TAIL = """
Times beyond {most:,} samples follow a power law through the last two renders, so the rows at 0.1 %
are rough, those of few seconds most of all."""


def sky_radiance(w: np.ndarray) -> np.ndarray:
    """Radiance (3, ...) in directions (3, ...): brighter above, with a glow around the sun."""
    above = 0.4 + 0.6 * np.maximum(w[2], 0.0)
    glow = 6.0 * np.exp(20.0 * (np.tensordot(SUN, w, 1) - 1.0))
    blue, warm = np.array((0.3, 0.4, 0.6)), np.array((1.0, 0.8, 0.6))
    return np.multiply.outer(blue, above) + np.multiply.outer(warm, glow)


def sky_image(rows: np.ndarray) -> np.ndarray:
    """Pixels (n, 2 ROWS, 3) at polar angles (n,), by the longitudes of `EnvironmentLight`."""
    columns = 2 * ROWS
    phi = math.pi - 2.0 * math.pi * (np.arange(columns) + 0.5) / columns
    sine, cosine = np.sin(rows)[:, None], np.cos(rows)[:, None]
    w = np.array([sine * np.cos(phi), sine * np.sin(phi), cosine * np.ones(columns)])
    return np.ascontiguousarray(np.moveaxis(sky_radiance(w), 0, -1), dtype=np.float32)


def case_scene(case: str, size: tuple[int, int]) -> Scene:
    """A molecule on a floor under a light."""
    molecule, light = case.split(":")
    scene = make_scene("packed", PACKED, size)
    if molecule == "caffeine":
        words = ATOMS.split()
        place = np.array([words[k + 1 : k + 4] for k in range(0, len(words), 4)], dtype=np.float64)
        radius = np.array([RADII[each] for each in words[::4]])
        # the plane of the molecule leans towards the camera
        place = place[:, [0, 2, 1]] * (1.0, -1.0, 1.0)
        place[:, 2] -= (place[:, 2] - radius).min()
        grown = 0.5 * (np.ptp(make_centers(scene), axis=0).max() + 1.0) / 5.2
        scene = replace(scene, shapes=(*(
            Sphere(tuple((grown * p).tolist()), float(grown * r), Material(LOOKS[name][1]))
            for p, r, name in zip(place, radius, words[::4], strict=True)
        ), scene.shapes[-1]))  # fmt: skip
    if light == "image":
        pixels = sky_image(math.pi * (np.arange(ROWS) + 0.5) / ROWS)
        return replace(scene, lights=(EnvironmentLight(pixels),))
    if light == "sun":
        way = tuple((-SUN).tolist())
        return replace(scene, lights=(SunLight(way, (IRRADIANCE,) * 3, SUN_ANGLE),))
    return scene


def make_centers(scene: Scene) -> np.ndarray:
    """Centres (n, 3) of the balls."""
    return np.array([shape.center for shape in scene.shapes if isinstance(shape, Sphere)])


def mitsuba_world(case: str, scene: Scene) -> tuple[Any, Any]:
    """Mitsuba's module and its scene, on one thread."""
    import peer_mitsuba

    mi, light = peer_mitsuba.start(), case.split(":")[1]
    import drjit

    drjit.set_thread_count(1)
    lights: tuple[Any, ...] = ()
    if light == "sun":
        radius = SUN_DISTANCE * math.sin(0.5 * SUN_ANGLE)
        radiance = IRRADIANCE / (math.pi * math.sin(0.5 * SUN_ANGLE) ** 2)
        place = (SUN_DISTANCE * SUN).tolist()
        lights = (SimpleNamespace(center=place, radius=radius, radiance=(radiance,) * 3),)
    world = peer_mitsuba.describe(mi, replace(scene, lights=()))
    for one in lights:
        world["sun"] = peer_mitsuba._placed(mi, one) | {
            "emitter": {"type": "area", "radiance": peer_mitsuba._color(one.radiance)}
        }
    if light == "sky":
        # sampling the cosine has less noise than sampling the sky uniformly
        world["integrator"] |= {"emitter_samples": 0, "bsdf_samples": 1}
        world["sky"] = {"type": "constant", "radiance": {"type": "rgb", "value": [1.0, 1.0, 1.0]}}
    if light == "image":
        world["integrator"] |= {"emitter_samples": 1, "bsdf_samples": 1}
        # its rows are at the poles first and last, and its axes are y, z, x
        pixels = sky_image(math.pi * np.arange(ROWS) / (ROWS - 1))
        turn = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)
        world["sky"] = {
            "type": "envmap",
            "bitmap": mi.Bitmap(pixels),
            "to_world": mi.ScalarTransform4f(turn),
        }
    return mi, mi.load_dict(world)


def run_mitsuba(case: str, size: tuple[int, int]) -> tuple[list[Any], np.ndarray, float, str]:
    """Rungs (samples, seconds, picture), the reference, its noise over the mean, the version."""
    mi, world = mitsuba_world(case, case_scene(case, size))

    def render(samples: int, seed: int) -> tuple[np.ndarray, float]:
        start = time.process_time()
        picture = np.array(mi.render(world, spp=samples, seed=seed))
        return np.moveaxis(picture[::-1], -1, 0).astype(np.float64), time.process_time() - start

    parts = [render(REFERENCE, 100 + k)[0] for k in range(REFERENCES)]
    truth = np.mean(parts, axis=0)
    spread = np.mean([((part - truth) ** 2).mean() for part in parts])
    noise = float(spread / (REFERENCES - 1) / truth.mean() ** 2)
    rungs = []
    for samples in LADDER:
        render(samples, 1)  # compiles
        picture, seconds = render(samples, 2)
        rungs.append((samples, seconds, picture))
    return rungs, truth, noise, f"Mitsuba {mi.__version__}"


def run_cycles(case: str, size: tuple[int, int], folder: Path) -> None:
    """Write Cycles' pictures and times; in a process of its own."""
    import bpy
    import peer_cycles

    scene, light = case_scene(case, size), case.split(":")[1]
    with peer_cycles._quiet():
        peer_cycles.build(replace(scene, lights=()))
        target = bpy.context.scene
        target.render.threads = 1
        if light == "sun":
            lamp = bpy.data.lights.new("Sun", "SUN")
            lamp.energy, lamp.angle = IRRADIANCE, SUN_ANGLE
            thing = bpy.data.objects.new("Sun", lamp)
            target.collection.objects.link(thing)
            import mathutils

            thing.rotation_euler = mathutils.Vector(SUN.tolist()).to_track_quat("Z", "Y").to_euler()
        else:
            _add_world(bpy, light)
        times = []
        for samples in (1, *LADDER):
            target.cycles.samples, target.cycles.seed = samples, samples
            start = time.process_time()
            bpy.ops.render.render()
            times.append(time.process_time() - start)
            np.save(folder / f"{samples}.npy", peer_cycles.read(None))
    text = json.dumps({"times": times[1:], "version": f"Cycles {bpy.app.version_string}"})
    (folder / "times.json").write_text(text, encoding="utf-8")
    sys.stdout.flush()
    os._exit(0)


def _add_world(bpy: Any, light: str) -> None:
    """A world of one colour, or of the image of a sky."""
    world = bpy.data.worlds.new("Sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    world.cycles_visibility.camera = False
    if light == "image":
        pixels = sky_image(math.pi * (np.arange(ROWS) + 0.5) / ROWS)[::-1]
        image = bpy.data.images.new("Sky", 2 * ROWS, ROWS, float_buffer=True, is_data=True)
        alpha = np.ones((*pixels.shape[:2], 1), dtype=np.float32)
        image.pixels.foreach_set(np.concatenate([pixels, alpha], axis=2).ravel())
        image.pack()
        node = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
        node.image = image
        world.node_tree.links.new(node.outputs[0], background.inputs["Color"])


def measure(case: str, size: tuple[int, int]) -> tuple[list[str], list[str]]:
    """Rows of the table for a case, and the peers' versions."""
    rungs, truth, noise, version = run_mitsuba(case, size)
    mean = truth.mean()

    def error_of(picture: np.ndarray) -> float:
        off = float(((picture - truth) ** 2).mean() / mean**2 - noise)
        return math.sqrt(max(off, FLOOR * noise))

    theirs = [(samples, seconds, error_of(picture)) for samples, seconds, picture in rungs]
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, __file__, "--cycles", folder, "--cases", case,
             "--size", "x".join(map(str, size))],
            check=True,
        )  # fmt: skip
        told = json.loads((Path(folder) / "times.json").read_text(encoding="utf-8"))
        pictures = [np.load(Path(folder) / f"{samples}.npy") for samples in LADDER]
    cycles = [
        (samples, seconds, error_of(picture))
        for samples, seconds, picture in zip(LADDER, told["times"], pictures, strict=True)
    ]
    print(f"{case}: noise {math.sqrt(noise):.1e}, means: Cycles {pictures[-1].mean() / mean:.5f}")
    scene, rows = case_scene(case, size), []
    render_image(case_scene(case, (16, 12)), Settings(threads=1))
    for tolerance in TOLERANCES:
        start = time.process_time()
        film = render_image(scene, Settings(tolerance=tolerance, threads=1))
        seconds = time.process_time() - start
        print(f"  ours: mean {film.color.mean() / mean:.5f}")
        cells = [(time_to(tolerance, each)) for each in (theirs, cycles)]
        off = error_of(film.color)
        error = (
            f"{off:.1e}" if off > LEAST_KNOWN * math.sqrt(noise) else f"< {math.sqrt(noise):.0e}"
        )
        far = [f"{s:.2f}{'*' if beyond else ''}" for s, beyond in cells]
        ratios = [f"{s / seconds:.2g}" for s, _ in cells]
        rows.append(
            f"| {case.replace(':', ' | ')} | {tolerance:g} | {seconds:.2f} | "
            f"{error} | {' | '.join([*far, *ratios])} |"
        )
        print(rows[-1], flush=True)
    return rows, [version, told["version"]]


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--size", default="64x48", help="as 64x48")
    parser.add_argument("--page", type=Path, help="where to write as well")
    parser.add_argument("--cycles", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    width, height = (int(part) for part in given.size.split("x"))
    if given.cycles:
        run_cycles(given.cases[0], (width, height), given.cycles)
    about, rows = machine.describe(), []
    for case in given.cases:
        own, versions = measure(case, (width, height))
        rows += own
        text = HEAD.format(
            machine=about, size=f"{width} x {height}", versions=" and ".join(versions),
            most=LADDER[-1],
        )  # fmt: skip
        if given.page:
            given.page.write_text(
                "\n".join([text, *rows, TAIL.format(most=LADDER[-1])]) + "\n", encoding="utf-8"
            )


if __name__ == "__main__":
    main()
