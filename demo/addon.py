# SPDX-License-Identifier: GPL-3.0-or-later
"""Loads the add-on from its checkout, whatever the folder is called."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parent.parent


def load_addon(name: str = "adaptive_drt_addon", root: Path = ROOT) -> ModuleType:
    """Import the root package under any name, dotted ones excepted, and return it unregistered."""
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(
        name, root / "__init__.py", submodule_search_locations=[str(root)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"no add-on in {root}")
    package = importlib.util.module_from_spec(spec)
    sys.modules[name] = package
    spec.loader.exec_module(package)
    return package
