# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's zip in a real Blender; every test here is skipped where there is none."""

from __future__ import annotations

import importlib.util
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
