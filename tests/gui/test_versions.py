# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender tests again, in the other Blenders that are Python modules."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from program import ROOT


@pytest.mark.slow
@pytest.mark.parametrize("version", ["4.2", "5.0"])
def test_module(version):
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    python = cache / "adaptive-drt" / f"bpy-{version}" / "bin" / "python"
    if not python.exists():
        pytest.skip(f"no Blender {version} as a module: make blender-venvs")
    told = subprocess.run(
        [python, "-m", "pytest", "tests/blender", "-m", "not slow", "-q", "-p", "no:cacheprovider"],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=600.0,
    )
    assert told.returncode == 0, told.stdout[-3000:] + told.stderr[-3000:]
