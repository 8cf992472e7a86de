# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's zip in a real Blender; every test here is skipped where there is none."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent))

from program import ROOT, VERSIONS, find_program

HERE = Path(__file__).resolve().parent


@pytest.fixture(
    scope="session",
    params=[pytest.param(v, marks=[pytest.mark.slow] * (v != VERSIONS[0])) for v in VERSIONS],
)
def program(request):
    """Blender with an empty profile; `make test` looks at the newest alone."""
    found = find_program(request.param)
    if isinstance(found, str):
        pytest.skip(found)
    yield found
    found.close()


def package():
    spec = importlib.util.spec_from_file_location("package", ROOT / "scripts" / "package.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def extension(program):
    """The zip for Linux, where the program sees it."""
    module = package()
    module.WHEELS.mkdir(exist_ok=True)
    try:
        built = module.build("linux-x64", program.folder)
    except subprocess.CalledProcessError:
        pytest.skip("embreex's wheels are not here and cannot be downloaded: make package")
    return built


@pytest.fixture(scope="session")
def installed(program, extension):
    """The program with the extension installed and enabled, by its own command."""
    told = program.run(
        "--command", "extension", "install-file", "-r", "user_default", "--enable", extension
    )
    # its exit code is 0 for some errors
    assert told.returncode == 0 and "ERROR" not in told.stdout + told.stderr, told
    return program


@pytest.fixture(scope="session")
def scene(program):
    """The demo, small, as bpy 4.5 has saved it; its pictures at frames 11 and 12 lie beside it."""
    path = program.folder / "scene.blend"
    command = [sys.executable, str(HERE / "make_scene.py"), str(path)]
    subprocess.run(command, check=True, stdin=subprocess.DEVNULL, capture_output=True)
    return path


@pytest.fixture(scope="session")
def copied(program):
    """Copy a script of these tests to where the program sees it."""

    def copy(name):
        return Path(shutil.copy(HERE / name, program.folder / name))

    return copy


@pytest.fixture(scope="session")
def in_window(installed, copied):
    """Run a script of these tests in the program's window; returns the facts that it wrote.

    scene : a .blend; "-": the factory's own.
    shots : screenshots to keep where ADAPTIVE_DRT_PICTURES names a folder, by their names there.
    """
    if os.environ.get("ADAPTIVE_DRT_BLENDER"):
        pytest.skip("the window is tested in the Blender that `make blender` makes")
    folder, kept = installed.folder, os.environ.get("ADAPTIVE_DRT_PICTURES")

    def run(script, name, scene="-", shots=None, **variables):
        copied("desk.py")
        installed.variables.update(variables)
        told = installed.run(copied("window.sh"), scene, copied(script), folder, command="sh")
        for there, here in (shots or {}).items() if kept else ():
            if (folder / f"{here}.png").exists():
                Path(kept).mkdir(parents=True, exist_ok=True)
                shutil.copy(folder / f"{here}.png", Path(kept) / f"{there}.png")
        said = told.stdout + told.stderr
        assert told.returncode == 0 and "Traceback" not in said, said[-6000:]
        return {**json.loads((folder / f"{name}.json").read_text()), "log": said}

    return run
