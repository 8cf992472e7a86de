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

ROOMS = {"geometry": ("sphere", "polygon", "ellipse", "ellipsoid", "cylinder"), "lights": ()}
"""Packages that may tell kinds of shapes or of lights apart, and the folders of single kinds."""
KIND_FREE = {
    "geometry.sphere.kernels",
    "geometry.sphere.light_occlusion",
    "geometry.polygon.clipping",
}
"""Modules in those folders whose functions serve all kinds: bounding balls, convex outlines."""
KIND_WORDS = re.compile(
    "(^|_)(spheres?|balls?|quads?|parallelograms?|triangles?|points?|disks?|suns?)_?(count|kinds?)$"
    "|^(is|has)_(sphere|ball|quad|parallelogram|polygon|triangle|disk|sun)$"
)
"""Names of questions after a kind, such as `sphere_count` or `is_quad`."""

DATA = {"description", "film", "light_records", "settings", "values"}
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


def records_and_classes() -> set[str]:
    """Names of the records of shapes and lights, and of the classes that render them."""
    found = set()
    for package in ROOMS:
        for path in sorted((CORE / package).rglob("*.py")):
            for node in ast.walk(tree_of(path)):
                if isinstance(node, ast.ClassDef):
                    bases = {getattr(base, "id", "") for base in node.bases}
                    if bases & {"ShapeSet", "PolygonSet", "Emitter", "RoundLight"}:
                        found.add(node.name)
    for package in ROOMS:
        for node in tree_of(CORE / package / "registry.py").body:
            if isinstance(node, ast.AnnAssign) and getattr(node.target, "id", "").isupper():
                assert node.value
                found |= {name.id for name in ast.walk(node.value) if isinstance(name, ast.Name)}
    return found


def test_kinds_are_found():
    """The test below looks for something."""
    assert {"Sphere", "Quad", "QuadLight", "SphereSet", "ParallelogramSet"} <= records_and_classes()


@pytest.mark.parametrize("path", CORE_FILES, ids=name_of)
def test_only_rooms_know_kinds_of_shapes_and_lights(path):
    """Outside `geometry` and `lights` no code branches on a kind, or names one."""
    package = path.relative_to(CORE).parts[0]
    if package in ROOMS or (
        package == "scene" and path.stem in ("description", "light_records", "__init__")
    ):
        return
    names = records_and_classes()
    for node in ast.walk(tree_of(path)):
        name = getattr(node, "attr", getattr(node, "id", getattr(node, "name", None)))
        where = f"{name_of(path)}:{getattr(node, 'lineno', 0)}"
        assert name not in names or package == "scene", f"{where} names the kind {name}"
        assert not KIND_WORDS.search(str(name)), f"{where} asks for a kind: {name}"
    for target in targets(path):
        if len(target) > 2 and target[2] in ROOMS.get(target[1], ()):
            assert ".".join(target[1:4]) in KIND_FREE, f"{name_of(path)} imports {'.'.join(target)}"


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


TESTED_BY = {
    "geometry": {
        "depth_pairs": "visibility/test_depth_events.py",
        "implicit_surface": "geometry/test_surface_pairs.py",
        "light_plane": "geometry/test_light_plane.py",
        "light_protocol": "geometry/test_light_occlusion.py",
        "line_forms": "visibility/test_line_forms.py",
        "occluder_outline": "shading/test_partial_occlusion.py",
        "patch": "shading/test_footprint.py",
        "pixel_coverage": "geometry/test_pixel_coverage.py",
        "planar_faces": "geometry/polygon/test_closed_boxes.py",
        "quadric_lines": "visibility/test_line_forms.py",
        "receivers": "geometry/test_light_occlusion.py",
        "registry": "geometry/test_shape_table.py",
        "shaded_patches": "geometry/test_shadow_edges.py",
        "shadow_edges": "geometry/test_outline_rates.py",
        "shape": "geometry/test_pixel_coverage.py",
    },
    "geometry/ellipse": {
        "line_polynomials": "visibility/test_line_forms.py",
        "pixel_coverage": "geometry/test_pixel_coverage.py",
        "shape": "geometry/test_pixel_coverage.py",
    },
    "geometry/ellipsoid": {
        "light_occlusion": "geometry/test_ellipsoids.py",
        "shadow_edges": "geometry/test_shadow_edges.py",
        "shape": "geometry/test_ellipsoids.py",
        "unit_space": "geometry/test_ellipsoids.py",
    },
    "geometry/mesh": {"shape": "geometry/mesh/test_faces.py"},
    "geometry/polygon": {
        "clipping": "geometry/test_light_plane.py",
        "closed_boxes": "geometry/polygon/test_closed_boxes.py",
        "light_occlusion": "geometry/test_light_occlusion.py",
        "line_polynomials": "visibility/test_line_forms.py",
        "pixel_coverage": "geometry/test_pixel_coverage.py",
        "shadow_edges": "geometry/polygon/test_shadow_edges.py",
        "shape": "geometry/test_pixel_coverage.py",
        "view": "geometry/polygon/test_shadow_edges.py",
    },
    "geometry/sphere": {
        "light_occlusion": "geometry/test_light_occlusion.py",
        "line_polynomials": "visibility/test_line_forms.py",
        "outline": "lights/test_occluded_form_factor.py",
        "pixel_coverage": "geometry/test_pixel_coverage.py",
        "plane_section": "geometry/test_light_plane.py",
        "section_edges": "geometry/sphere/test_section_edges.py",
        "shadow_edges": "geometry/sphere/test_shadow_edges.py",
        "shape": "geometry/test_pixel_coverage.py",
    },
    "lights": {
        "bounds": "lights/test_emitter.py",
        "disk_light": "lights/test_emitter.py",
        "flat_light": "lights/test_ellipse_light.py",
        "distant_light": "lights/test_sun_light.py",
        "form_factor": "lights/test_form_factor.py",
        "point_light": "lights/test_emitter.py",
        "quad_light": "lights/test_emitter.py",
        "registry": "lights/test_emitter.py",
        "round_light": "lights/test_emitter.py",
        "sphere_light": "lights/test_emitter.py",
        "sun_light": "lights/test_sun_light.py",
    },
}
"""Test files of modules that are tested through an interface, as kinds of shapes and lights are:
each question of `ShapeSet` and `Emitter` has a file, which asks it of all kinds."""


def imported_by(path: Path) -> set[str]:
    """Dotted names of the modules, and of what is in them, that a file imports."""
    return {
        f"{node.module}.{alias.name}" if isinstance(node, ast.ImportFrom) else alias.name
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }


@pytest.mark.parametrize("path", CORE_FILES, ids=name_of)
def test_each_module_has_tests_of_its_own(path):
    """`tests/<package>/test_<module>.py`, where `driver` holds those of modules in no package."""
    if path.name == "__init__.py":
        return
    package = "driver" if path.parent == CORE else path.parent.relative_to(CORE).as_posix()
    through = TESTED_BY.get(package, {}).get(path.stem)
    own = ROOT / "tests" / (through or f"{package}/test_{path.stem}.py")
    assert own.exists(), f"{name_of(path)} has no {name_of(own)}"
    module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    assert through or any(f"{each}.".startswith(f"{module}.") for each in imported_by(own)), (
        f"{name_of(own)} does not import {module}"
    )


def test_modules_tested_through_an_interface_exist():
    for package, modules in TESTED_BY.items():
        for name in modules:
            assert (CORE / package / f"{name}.py").exists(), f"{package}/{name}.py"


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
