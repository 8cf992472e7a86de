# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender by soak.py: rounds of renders, cancels, undo and file loads.

    blender -b --python soak_rounds.py -- FOLDER MINUTES SEED

It appends what each round found to FOLDER/rounds.jsonl, a line of JSON each, and ends early where
FOLDER/stop is there.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import os
import random
import sys
import threading
import time
from pathlib import Path
from typing import Any

import bpy

FOLDER = Path(sys.argv[-3])
SECONDS, SEED = 60.0 * float(sys.argv[-2]), int(sys.argv[-1])
PACKAGE = "bl_ext.user_default.adaptive_drt"
HEAP = 300
"""Balls of the heap."""
SIZES = {"small": (320, 240), "moving": (120, 90), "heap": (120, 80)}
"""Pixels of the pictures: the first is large enough for worker processes."""
LATEST = 1.5
"""Longest time, in seconds, after which a render is cancelled."""
TOLERANCES = (0.02, 0.01)
TBB_CLEAN_ALL = 0
"""TBBMALLOC_CLEAN_ALL_BUFFERS of oneTBB's scalable_allocation_command."""

state: Any = importlib.import_module(f"{PACKAGE}.operators.state").state
pool: Any = importlib.import_module(f"{PACKAGE}.adaptive_drt.parallel.pool").worker_pool


def make_files() -> None:
    """Save the scenes as FOLDER/NAME.blend."""
    for name, (width, height) in SIZES.items():
        bpy.ops.wm.read_factory_settings(use_empty=False)
        importlib.import_module("addon_utils").enable(PACKAGE)
        scene = bpy.context.scene
        scene.render.resolution_x, scene.render.resolution_y = width, height
        bpy.data.objects.remove(bpy.data.objects["Cube"])
        bpy.data.lights["Light"].shadow_soft_size = 0.7
        bpy.ops.mesh.primitive_plane_add(size=30.0, location=(0.0, 0.0, -1.0))
        bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
        ball = bpy.context.object
        ball.name = "Ball"
        if name == "moving":
            scene.render.use_motion_blur = True
            for frame, x in ((1, -0.5), (2, 0.5)):
                ball.location.x = x
                ball.keyframe_insert("location", frame=frame)
        if name == "heap":
            place = random.Random(1)
            mesh = bpy.data.meshes.new("Places")
            places = [[place.uniform(-1.0, 1.0) for _ in range(3)] for _ in range(HEAP)]
            mesh.from_pydata(places, [], [])
            heap = bpy.data.objects.new("Heap", mesh)
            scene.collection.objects.link(heap)
            heap.instance_type = "VERTS"
            ball.parent, ball.scale = heap, (0.12,) * 3
        bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / f"{name}.blend"))


def render(by_engine: bool) -> None:
    """Render by the button, or by F12's operator."""
    if by_engine:
        bpy.context.scene.render.engine = "ADAPTIVE_DRT"
        bpy.ops.render.render()
    else:
        bpy.ops.adaptive_drt.render()


def cancel_soon(after: float) -> bool:
    """Render by the button; another thread cancels it after so many seconds, if it still runs."""
    over, asked = threading.Event(), threading.Event()

    def cancel() -> None:
        over.wait(after)
        while not over.wait(0.01):
            if state.job is not None:
                state.job.cancel()
                asked.set()

    thread = threading.Thread(target=cancel)
    thread.start()
    try:
        bpy.ops.adaptive_drt.render()
    finally:
        over.set()
        thread.join()
    return asked.is_set()


def step_back_and_forth(name: str) -> None:
    """Move what is seen, render, and undo and redo the move."""
    heights = [bpy.data.objects["Ball"].location.z]
    bpy.ops.ed.undo_push(message="begin")
    bpy.data.objects["Ball"].location.z += 0.25
    heights.append(bpy.data.objects["Ball"].location.z)
    bpy.ops.ed.undo_push(message="move")
    render(by_engine=False)
    for step, number in ((bpy.ops.ed.undo, 0), (bpy.ops.ed.redo, 1), (bpy.ops.ed.undo, 0)):
        step()
        assert bpy.data.objects["Ball"].location.z == heights[number]
    if name != "heap":
        render(by_engine=False)


def make_round(chance: random.Random, counts: dict[str, int]) -> None:
    """Open a file, and render, cancel, undo and redo in it."""
    name = chance.choice(list(SIZES))
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"))
    bpy.context.scene.adaptive_drt.tolerance = chance.choice(TOLERANCES)
    kinds = chance.choices(("button", "engine", "cancel", "undo"), k=4)
    for kind in kinds:
        if kind == "cancel":
            counts["ended"] += cancel_soon(chance.uniform(0.0, LATEST))
        elif kind == "undo":
            step_back_and_forth(name)
        else:
            render(kind == "engine")
        counts[kind] += 1
    counts["load"] += 1
    counts[name] += 1


def resident(process: int) -> float:
    """Resident memory of a process, MiB; 0 where it has ended."""
    try:
        pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    except OSError:
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def trimmed() -> float:
    """Resident memory of this process, MiB, when its allocator has returned what is freed.

    How much it keeps depends on which threads took what last, and changes by 100 MiB. Blender may
    have Intel's instead of the C library's.
    """
    try:
        ctypes.CDLL("libtbbmalloc.so.2").scalable_allocation_command(TBB_CLEAN_ALL, None)
    except OSError:
        ctypes.CDLL(None).malloc_trim(0)
    return resident(os.getpid())


def children() -> int:
    """Number of processes that this one started and that are there, ended or not."""
    mine, found = os.getpid(), 0
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            found += int(path.read_text().rpartition(")")[2].split()[1]) == mine
        except OSError:
            continue
    return found


def main() -> None:
    make_files()
    began, chance = time.monotonic(), random.Random(SEED)
    counts = dict.fromkeys(("load", "button", "engine", "cancel", "ended", "undo", *SIZES), 0)
    with (FOLDER / "rounds.jsonl").open("a") as log:
        while time.monotonic() - began < SECONDS and not (FOLDER / "stop").exists():
            make_round(chance, counts)
            # what a scene itself takes is the same each time
            bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "small.blend"))
            workers = list(pool.process_ids)
            facts = {
                "seconds": time.monotonic() - began,
                "host": resident(os.getpid()),
                "kept": trimmed(),
                "workers": [resident(each) for each in workers],
                "children": children(),
                "threads": threading.active_count(),
                "processes": [os.getpid(), *workers],
                "counts": counts,
            }
            log.write(json.dumps(facts) + "\n")
            log.flush()


main()
