# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of settings hold in a Blender that is a program, as in those that are modules."""

from __future__ import annotations

import shutil

import pytest
from program import ROOT


@pytest.mark.slow
def test_tables_of_settings(installed, copied):
    """As tests/blender/test_blender_coverage_*.py, in this version."""
    for name in ("coverage_walk.py", "rna_walk_nodes.py"):
        shutil.copy(ROOT / "tests" / "blender" / name, installed.folder / name)
    told = installed.run("-b", "-P", copied("cover_settings.py"))
    assert "in no class: []" in told.stdout, told.stdout + told.stderr
    assert "set: True, not listed: []" in told.stdout, told.stdout + told.stderr
    assert "of the startup file: []" in told.stdout, told.stdout + told.stderr
    assert "of nodes and datablocks: []" in told.stdout, told.stdout + told.stderr
