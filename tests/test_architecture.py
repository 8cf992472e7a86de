# SPDX-License-Identifier: GPL-3.0-or-later
"""The house rules that a reader of the imports can check."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
CORE = ROOT / "adaptive_drt"

LAYERS = (
    ("numerics",),
    ("parallel", "scene"),
    ("geometry",),
    ("lights",),
    ("tracing",),
    ("detection", "visibility"),
    ("shading",),
    ("cubature",),
    ("image",),
    ("exact", "distributed"),
    ("cost_model",),
    ("render",),
)
"""The core's packages, and the modules of the driver, by rank: each imports only what is of a lower
rank, or of its own package; siblings of one rank do not know each other."""
RANK = {name: rank for rank, layer in enumerate(LAYERS) for name in layer}

DATA = {"description", "settings", "film"}
"""Records in `scene`, which import nothing of the core but each other."""
THIRD_PARTY = {
    "adaptive_drt": {"numpy", "embreex"},
    "operators": {"numpy", "bpy", "mathutils", "bl_math", "bpy_extras", "gpu", "blf"},
    "ui": {"bpy", "mathutils", "bl_ui", "bl_operators"},
}
MAX_LINES = 700
MAX_FUNCTION_LINES = 50
HEADER = "# SPDX-License-Identifier: GPL-3.0-or-later"
# Spelled in two parts, so that this file passes its own test.
MACHINE_PATHS = re.compile("|".join(("/" + "tmp/", "/" + "work/", "/" + "root/", "/" + "home/")))
SKIPPED = {".venv", ".git", "__pycache__", "wheels", "dist", ".mypy_cache", ".ruff_cache"}


def files(*suffixes: str) -> list[Path]:
    found = (path for path in ROOT.rglob("*") if path.is_file() and path.suffix in suffixes)
    return sorted(path for path in found if not SKIPPED & set(path.relative_to(ROOT).parts))


PYTHON = files(".py")
ADDON = [
    path
    for path in PYTHON
    if path.relative_to(ROOT).parts[0] in THIRD_PARTY or path == ROOT / "__init__.py"
]
CORE_FILES = [path for path in ADDON if path.is_relative_to(CORE)]


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), name_of(path))


def imports(path: Path) -> Iterator[tuple[int, str]]:
    """(level, dotted name) of every import of a file, at any depth; level 0 is absolute.

    `from . import a, b` counts as imports of `a` and of `b`.
    """
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield 0, alias.name
        elif isinstance(node, ast.ImportFrom):
            if node.module:
                yield node.level, node.module
            else:
                for alias in node.names:
                    yield node.level, alias.name


def targets(path: Path) -> Iterator[tuple[str, ...]]:
    """Relative imports of a file, as paths from the root of the add-on."""
    package = path.relative_to(ROOT).parts[:-1]
    for level, name in imports(path):
        if level:
            assert level <= len(package) + 1, f"{name_of(path)} imports from above the add-on"
            yield (*package[: len(package) - level + 1], *name.split("."))


def test_there_is_something_to_check():
    assert len(CORE_FILES) > 5 and len(ADDON) > len(CORE_FILES)


@pytest.mark.parametrize("path", ADDON, ids=name_of)
def test_absolute_imports_are_of_allowed_packages_only(path):
    package = path.relative_to(ROOT).parts[0]
    allowed = THIRD_PARTY.get(package, {"bpy"}) | set(sys.stdlib_module_names)
    absolute = {name.split(".")[0] for level, name in imports(path) if level == 0}
    assert absolute <= allowed, f"{name_of(path)} imports {sorted(absolute - allowed)}"


def module_of(path: Path) -> tuple[str, str]:
    """Package and name of a core file; a module of the driver is a package of its own here."""
    parts = path.relative_to(CORE).with_suffix("").parts
    return (parts[0], parts[-1])


@pytest.mark.parametrize("path", CORE_FILES, ids=name_of)
def test_core_imports_point_to_a_lower_layer(path):
    for target in targets(path):
        assert target[0] == "adaptive_drt", f"{name_of(path)} imports {'.'.join(target)}"
    if path.name == "__init__.py":
        assert not list(targets(path)), f"{name_of(path)} imports"
        return
    package, own = module_of(path)
    assert package in RANK, f"give {package} its place in LAYERS"
    for target in targets(path):
        other = target[1]
        assert other == package or RANK[other] < RANK[package], f"{name_of(path)} imports {other}"
        if package == "scene" and own in DATA:
            assert target[2] in DATA, f"{own} holds records; it imports {target[2]}"


def test_no_import_goes_in_a_circle():
    """Modules of a package may import each other, in one direction."""
    known = {path.relative_to(ROOT).with_suffix("").parts: path for path in CORE_FILES}
    graph = {one: {t for t in targets(path) if t in known} for one, path in known.items()}
    while graph:
        free = {one for one, needs in graph.items() if not needs & graph.keys()}
        assert free, f"a circle within {sorted('.'.join(one) for one in graph)}"
        graph = {one: needs for one, needs in graph.items() if one not in free}


def test_the_driver_is_all_that_is_in_no_package():
    found = {path.stem for path in CORE.glob("*.py")}
    assert found == {"__init__", "exact", "distributed", "cost_model", "render"}
    assert {path.parent.name for path in CORE.glob("*/__init__.py")} <= RANK.keys()


@pytest.mark.parametrize("path", CORE_FILES, ids=name_of)
def test_only_one_file_knows_embreex(path):
    if path.name != "embree.py":
        assert not any(name.split(".")[0] == "embreex" for _, name in imports(path))


@pytest.mark.parametrize("path", CORE_FILES, ids=name_of)
def test_core_says_what_it_offers(path):
    if path.name == "__init__.py":
        return
    bodies = tree_of(path).body
    names = [
        target.id
        for node in bodies
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    ]
    assert "__all__" in names


def test_operators_do_not_import_the_ui():
    """The core < operators < ui: operators reach settings through the datablock."""
    for path in ADDON:
        if path.relative_to(ROOT).parts[0] == "operators":
            assert all(target[0] != "ui" for target in targets(path)), name_of(path)


def test_the_root_imports_nothing_of_blender_when_it_is_imported():
    for node in tree_of(ROOT / "__init__.py").body:
        assert not isinstance(node, ast.Import | ast.ImportFrom) or (
            isinstance(node, ast.ImportFrom) and node.module == "__future__"
        )


@pytest.mark.parametrize("path", CORE_FILES, ids=name_of)
def test_core_uses_no_einsum_and_prints_nothing(path):
    for node in ast.walk(tree_of(path)):
        name = getattr(node, "attr", getattr(node, "id", ""))
        assert name not in ("einsum", "print"), f"{name_of(path)}:{node.lineno} uses {name}"


@pytest.mark.parametrize("path", PYTHON, ids=name_of)
def test_files_are_small_and_carry_the_licence(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    assert HEADER in lines[:2], f"{name_of(path)} lacks its licence line"
    assert len(lines) <= MAX_LINES, f"{name_of(path)} has {len(lines)} lines"


@pytest.mark.parametrize("path", ADDON, ids=name_of)
def test_functions_are_small(path):
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            length = (node.end_lineno or node.lineno) - node.lineno + 1
            assert length <= MAX_FUNCTION_LINES, f"{name_of(path)}: {node.name}, {length} lines"


def test_no_path_of_a_machine():
    suffixes = (".py", ".md", ".toml", ".txt", ".sh", ".yaml", ".yml", ".json", ".ini", ".cfg")
    for path in [*files(*suffixes), ROOT / "Makefile"]:
        found = MACHINE_PATHS.search(path.read_text(encoding="utf-8"))
        assert not found, f"{name_of(path)} names {found and found.group()}"
