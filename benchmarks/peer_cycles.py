# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles renders the benchmark's scenes: direct light only, box filter, true spheres.

    python benchmarks/peer_cycles.py SCENE WIDTH HEIGHT FOLDER SECONDS [--adaptive]

writes pictures and times of a ladder of sample counts, or of thresholds (see `bench_ladder`).
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "helpers"))

import bpy
import numpy as np
from bench_ladder import climb, parse
from bench_scenes import bench_scene

import cycles_picture
from adaptive_drt.scene.description import QuadLight, Scene

__all__ = ["render_cycles"]

THREADS = 2
SAMPLES = tuple(4**k for k in range(0, 9))
THRESHOLDS = tuple(0.4 / 2**k for k in range(12))
MOST_SAMPLES = 65_536
"""Adaptive sampling may go this far in a pixel."""
LATE = 1.5
"""A render is stopped, with what it has, at this times the longest that is to be tried."""


def build(scene: Scene) -> None:
    """Make the scene in Blender; lights that move become faces that shine."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    target = bpy.context.scene
    for shape in scene.shapes:
        cycles_picture._move(cycles_picture._add_shape(bpy, shape), shape)
    for light in scene.lights:
        if light.motion is None:
            cycles_picture._add_light(bpy, light)
        else:
            cycles_picture._move(_shining_face(light), light)
    cycles_picture._move(cycles_picture._add_camera(bpy, scene.camera), scene.camera)
    cycles_picture._set_up(target, scene, 1, 0)
    moves = any(x.motion for x in (*scene.shapes, *scene.lights, scene.camera))
    target.render.use_motion_blur = moves
    target.render.threads_mode, target.render.threads = "FIXED", THREADS
    target.view_settings.view_transform = "Raw"
    # the better of Cycles' choices on these scenes, by error squared times CPU time: up to half
    target.cycles.sampling_pattern, target.cycles.use_light_tree = "TABULATED_SOBOL", False


def _shining_face(light: QuadLight) -> Any:
    """A face that emits on its front: Cycles moves those within the shutter, and not lamps."""
    u, v = np.array(light.half_u), np.array(light.half_v)
    mesh = bpy.data.meshes.new(light.name)
    mesh.from_pydata([-u - v, u - v, u + v, v - u], [], [(0, 1, 2, 3)])
    thing = cycles_picture._link(bpy, light.name, mesh)
    thing.location = light.center
    thing.visible_camera = thing.visible_shadow = False
    material = bpy.data.materials.new(light.name)
    material.use_nodes = True
    material.cycles.emission_sampling = "FRONT"
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    out, mix = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeMixShader")
    shine, side = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeNewGeometry")
    strength = max(light.radiance)
    shine.inputs["Color"].default_value = (*(np.array(light.radiance) / strength), 1.0)
    shine.inputs["Strength"].default_value = strength
    links.new(side.outputs["Backfacing"], mix.inputs["Fac"])
    links.new(shine.outputs[0], mix.inputs[1])
    links.new(mix.outputs[0], out.inputs["Surface"])
    mesh.materials.append(material)
    return thing


def render_cycles(scene: Scene, adaptive: bool, longest: float = 0.0) -> Callable[[Any, int], None]:
    """A function of a rung and a seed that renders the scene and leaves it in Blender's memory."""
    build(scene)
    cycles = bpy.context.scene.cycles
    cycles.use_adaptive_sampling = adaptive
    cycles.time_limit = LATE * longest

    def render(rung: float, seed: int) -> None:
        cycles.seed = seed
        cycles.samples = MOST_SAMPLES if adaptive else int(rung)
        if adaptive:
            cycles.adaptive_threshold, cycles.adaptive_min_samples = rung, 0
        bpy.ops.render.render()

    return render


def read(_: None) -> np.ndarray:
    """The picture last rendered, (3, height, width), by way of a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "picture.exr")
        bpy.data.images["Render Result"].save_render(path)
        return cycles_picture._read(path)


def main() -> None:
    """Climb the ladder."""
    given = parse(__doc__ or "", "--adaptive")
    scene = bench_scene(given.scene, given.width, given.height)
    with _quiet():
        render = render_cycles(scene, bool(given.adaptive), given.seconds)
        rungs = THRESHOLDS if given.adaptive else SAMPLES
        climb(render, rungs, given, f"Cycles {bpy.app.version_string}", read, warm=1)
    sys.stdout.flush()
    os._exit(0)


class _quiet:
    """Blender's own lines about each render, which it writes itself, go nowhere."""

    def __enter__(self) -> None:
        self.kept = os.dup(1)
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 1)
        os.close(null)

    def __exit__(self, *_: object) -> None:
        os.dup2(self.kept, 1)


if __name__ == "__main__":
    main()
