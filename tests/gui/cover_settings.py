# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender: the tables of settings against its RNA, and each listed setting set."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import coverage_walk
import rna_walk_nodes

PACKAGE = "bl_ext.user_default.adaptive_drt"

print("in no class:", coverage_walk.unclassified(PACKAGE))
faults, count = coverage_walk.unlisted(PACKAGE)
print(f"set: {count > 40}, not listed: {faults}")
found = coverage_walk.factory_issues(PACKAGE)
print("of the startup file:", [i for i in found if i.kind not in ("MATERIAL", "WORLD")])
print("of nodes and datablocks:", rna_walk_nodes.report(PACKAGE))
