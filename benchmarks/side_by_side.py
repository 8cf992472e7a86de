# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's factory scene and a molecule under a sky, ours beside Cycles: README's pictures.

    python benchmarks/side_by_side.py [--width 300] [--tolerance 0.01] [--limit 120]

Both render through Blender's F12 on the same threads, with direct light only. Three pictures of
each scene: ours; the best that Cycles has after the same time; the first of Cycles' that has our
error. "Cycles" is whichever of three ways is best: plain, adaptive, and denoised by
OpenImageDenoise with albedo and normals. Errors are root mean squares over the mean, against our
picture at a tolerance of 0.01 %. It prints how far the mean of Cycles' best picture is from that.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "demo"))

import bpy
import machine
import numpy as np
from addon import load_addon
from pictures import display_picture, save, sheet

PICTURES = Path(__file__).resolve().parent.parent / "docs" / "pictures"
TRUTH_TOLERANCE = 1e-4
"""Tolerance of the picture that errors are measured against."""
SAMPLES = tuple(4**k for k in range(9))
"""Samples a pixel of Cycles' renders, from coarse to fine."""
THRESHOLDS = tuple(0.4 / 2**k for k in range(10))
"""Noise thresholds of Cycles' adaptive renders, from coarse to fine."""
MOST_SAMPLES = 65_536
"""Samples a pixel that an adaptive render may take."""
SAME_TIME = 1.1
"""A render of Cycles that takes up to this many times our time counts as one of the same time."""
GROWTH = 4.0
"""The next render of a series is taken to cost this many times the last one's time."""
BOND = 1.43
"""Mean distance of neighbours in C60, angstroms (Hedberg et al., Science 254, 1991, table 1)."""
SUN_PLACE = (math.radians(38.0), math.radians(135.0))
"""Elevation and rotation of the sun, radians."""
BALL = 0.95
"""Radius of the balls that show its atoms, angstroms."""


@dataclass
class Picture:
    """A finished render: label, colour (3, height, width), seconds, error over the mean."""

    label: str
    color: np.ndarray
    seconds: float
    error: float = math.nan


def factory_scene() -> None:
    """Blender's own first scene, without gloss, which we do not render."""
    bpy.ops.wm.read_factory_settings()
    for material in bpy.data.materials:
        if material.node_tree and "Principled BSDF" in material.node_tree.nodes:
            material.node_tree.nodes["Principled BSDF"].inputs[
                "Specular IOR Level"
            ].default_value = 0


def carbon_atoms() -> np.ndarray:
    """Places (60, 3) of the atoms of C60: the corners of a truncated icosahedron, angstroms."""
    golden = 0.5 * (1.0 + math.sqrt(5.0))
    seeds = ((0, 1, 3 * golden), (1, 2 + golden, 2 * golden), (golden, 2, golden**3))
    places = {
        tuple(float(v) for v in np.roll(np.multiply(seed, signs), turn))
        for seed in seeds
        for signs in np.ndindex(2, 2, 2)
        for signs in [1 - 2 * np.array(signs)]
        for turn in range(3)
    }
    # the formula's edge is 2
    return np.unique(np.round(sorted(places), 12) + 0.0, axis=0) * (0.5 * BOND)


def molecule_scene() -> None:
    """C60 on a floor under a sky, and a sun of 4 degrees.

    The balls are cut so finely that Cycles' picture of them is that of spheres. The sun is a lamp,
    since we render that of a Sky Texture as bright alike all over.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    atoms = carbon_atoms()
    atoms[:, 2] += BALL - atoms[:, 2].min()
    bpy.ops.mesh.primitive_uv_sphere_add(segments=192, ring_count=96, radius=BALL)
    first = bpy.context.object
    first.data.materials.append(_diffuse("Carbon", (0.55, 0.56, 0.60)))
    first.data.shade_smooth()
    first.location = atoms[0]
    for place in atoms[1:]:
        other = bpy.data.objects.new("Atom", first.data)
        other.location = place
        bpy.context.collection.objects.link(other)
    bpy.ops.mesh.primitive_plane_add(size=60.0)
    bpy.context.object.data.materials.append(_diffuse("Floor", (0.62, 0.52, 0.40)))
    bpy.ops.object.camera_add(location=(0.0, -24.0, 12.5), rotation=(math.radians(71.0), 0.0, 0.0))
    bpy.context.scene.camera = bpy.context.object
    world = bpy.data.worlds.new("Sky")
    world.use_nodes = True
    sky = world.node_tree.nodes.new("ShaderNodeTexSky")
    sky.sun_disc = False
    sky.sun_elevation, sky.sun_rotation = SUN_PLACE
    bpy.ops.object.light_add(type="SUN", rotation=(0.5 * math.pi - SUN_PLACE[0], 0.0, math.pi / 4))
    bpy.context.object.data.energy, bpy.context.object.data.angle = 2.5, math.radians(4.0)
    background = world.node_tree.nodes["Background"]
    background.inputs["Strength"].default_value = 0.05
    world.node_tree.links.new(sky.outputs[0], background.inputs["Color"])
    bpy.context.scene.world = world


def _diffuse(name: str, color: tuple[float, float, float]) -> Any:
    """A material of a Diffuse BSDF."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*color, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


SCENES = {"factory": factory_scene, "molecule": molecule_scene}


def set_up(width: int) -> None:
    """What both renderers share: size, and what Cycles needs to show direct light alone."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = width, width * 2 // 3
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Raw"
    scene.cycles.device, scene.cycles.max_bounces = "CPU", 0
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    scene.cycles.light_sampling_threshold = scene.cycles.sample_clamp_direct = 0.0
    scene.cycles.denoiser, scene.cycles.denoising_prefilter = "OPENIMAGEDENOISE", "ACCURATE"
    scene.cycles.denoising_input_passes = "RGB_ALBEDO_NORMAL"


def f12(engine: str, label: str) -> Picture:
    """Render the open scene with an engine."""
    scene = bpy.context.scene
    scene.render.engine = engine
    output = scene.render.image_settings
    output.file_format, output.color_depth, output.color_mode = "OPEN_EXR", "32", "RGB"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "picture.exr")
        start = time.perf_counter()
        bpy.ops.render.render(write_still=True)
        seconds = time.perf_counter() - start
        image = bpy.data.images.load(scene.render.filepath)
        flat = np.empty(len(image.pixels), dtype=np.float32)
        image.pixels.foreach_get(flat)
        shape = (image.size[1], image.size[0], -1)
        bpy.data.images.remove(image)
    color = np.moveaxis(flat.reshape(shape)[..., :3].astype(np.float64), -1, 0)
    return Picture(label, color, seconds)


def ours(tolerance: float) -> Picture:
    """Our picture of the open scene."""
    bpy.context.scene.adaptive_drt.tolerance = tolerance
    return f12("ADAPTIVE_DRT", f"Adaptive DRT, {100 * tolerance:g} %")


def cycles_pictures(truth: np.ndarray, enough: float, limit: float) -> list[Picture]:
    """Cycles' pictures in three ways, each from coarse to the first of `enough` error, or to the
    last that takes less than `limit` seconds.
    """
    found: list[Picture] = []
    cycles = bpy.context.scene.cycles
    for way, rungs in (("plain", SAMPLES), ("denoised", SAMPLES), ("adaptive", THRESHOLDS)):
        for rung in rungs:
            cycles.use_denoising = way == "denoised"
            cycles.use_adaptive_sampling = way == "adaptive"
            cycles.samples = MOST_SAMPLES if way == "adaptive" else rung
            if way == "adaptive":
                cycles.adaptive_threshold = rung
            picture = f12("CYCLES", f"Cycles, {way}")
            picture.error = error_of(picture.color, truth)
            found.append(picture)
            print(f"  {way} {rung:g}: {picture.seconds:.2f} s, {picture.error:.2e}", flush=True)
            if picture.error <= enough or picture.seconds * GROWTH > limit:
                break
    return found


def error_of(color: np.ndarray, truth: np.ndarray) -> float:
    """Root mean square of a difference, over the truth's mean."""
    return float(np.sqrt(((color - truth) ** 2).mean()) / truth.mean())


def compare(name: str, width: int, tolerance: float, limit: float) -> list[Picture]:
    """Three pictures of a scene: ours, and Cycles' of the same time and of the same error."""
    SCENES[name]()
    set_up(width)
    f12("ADAPTIVE_DRT", "")  # the first render of a process loads libraries
    mine = ours(tolerance)
    truth = ours(TRUTH_TOLERANCE).color
    mine.error = error_of(mine.color, truth)
    print(f"{name}: {mine.seconds:.2f} s, {mine.error:.2e}", flush=True)
    theirs = cycles_pictures(truth, mine.error, limit)
    soon = [p for p in theirs if p.seconds <= SAME_TIME * mine.seconds]
    same_time = min(soon, key=lambda p: p.error) if soon else min(theirs, key=lambda p: p.seconds)
    good = [p for p in theirs if p.error <= mine.error]
    same_error = min(good, key=lambda p: p.seconds) if good else min(theirs, key=lambda p: p.error)
    best = min(theirs, key=lambda p: p.error)
    print(f"  means differ by {best.color.mean() / truth.mean() - 1:.1e}", flush=True)
    return [mine, same_time, same_error]


def main() -> None:
    """Render all, write the sheet and print its figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--width", type=int, default=300)
    parser.add_argument("--tolerance", type=float, default=1e-2)
    parser.add_argument("--limit", type=float, default=120.0, help="seconds of a render of Cycles")
    parser.add_argument("--picture", type=Path, default=PICTURES / "side-by-side.png")
    given = parser.parse_args()
    print(machine.describe(), flush=True)
    package = load_addon()
    package.register()
    rows = []
    for name in given.scenes:
        for picture in compare(name, given.width, given.tolerance, given.limit):
            label = f"{picture.label}: {picture.seconds:.2g} s, error {100 * picture.error:.2g} %"
            print(label, flush=True)
            rows.append((label, display_picture(picture.color)))
    save(sheet(rows, columns=3, side=given.width), given.picture)
    package.unregister()


if __name__ == "__main__":
    main()
