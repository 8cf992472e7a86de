# SPDX-License-Identifier: GPL-3.0-or-later
"""One scene of `against_cycles.py` in a process of its own: its figures as JSON, after "@@".

python benchmarks/against_one.py NAME [--moving | --random] [--tolerances …] [--samples N]
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "demo"))

import against_pictures
import against_random
import against_scenes
import bpy
from addon import load_addon


def main() -> None:
    """Make the scene, render it and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name")
    parser.add_argument("--moving", action="store_true", help="the light moves")
    parser.add_argument("--random", action="store_true", help="NAME is a seed")
    parser.add_argument("--extra", help="of a random scene: see against_extras.py")
    parser.add_argument("--tolerances", type=float, nargs="+", default=[1e-2, 3e-3])
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--keep", type=Path, help="save the scene and the pictures here")
    given = parser.parse_args(_arguments())
    package = load_addon()
    package.register()
    if given.random:
        said = against_random.build(int(given.name), given.extra)
    else:
        against_scenes.start()
        scenes = against_scenes.LIGHTS | against_scenes.SKIES | against_scenes.MESHES
        against_scenes.moving_light(given.name) if given.moving else scenes[given.name]()
        said = ""
    if given.keep:
        given.keep.mkdir(parents=True, exist_ok=True)
        bpy.ops.wm.save_as_mainfile(filepath=str(given.keep / "scene.blend"), copy=True)
    found = against_pictures.compare(given.tolerances, given.samples, given.moving, given.keep)
    state = importlib.import_module(f"{package.__name__}.operators.state").state
    issues = [[one.name, one.reason] for each in state.issues.values() for one in each]
    figures = [dataclasses.asdict(one) for one in found]
    print("@@" + json.dumps({"said": said, "issues": issues, "figures": figures}), flush=True)
    package.unregister()


def _arguments() -> list[str]:
    """This script's own, also after the "--" of a Blender that runs it."""
    return sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]


if __name__ == "__main__":
    main()
