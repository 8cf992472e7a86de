# SPDX-License-Identifier: GPL-3.0-or-later
"""What runs of the families of kernels found, one file a family, so that a run can be taken up
again where it ended and a table be written of families that ran at different times.

A result holds for the sources that it was run with: those of the family's module and of all that
it imports of the renderer, the oracles and the helpers. With other sources a run begins anew, and a
table says so of a result that is shown all the same.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import subprocess
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from pathlib import Path

__all__ = ["FOLDER", "Tally", "digest", "load", "revision", "save"]

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "benchmarks" / "stress_results"
PLACES = (ROOT, ROOT / "tests", ROOT / "tests" / "helpers")
"""Where a module's file is looked for."""


@dataclass
class Tally:
    """What became of a family's configurations.

    seed, count : of the run: `count` configurations were asked for.  chunks : so many are done.
    cases, promised : configurations that were run, and those for which the bound says something.
    broken : exceptions, warnings and numbers that are not finite, a sentence each.
    worst : (error over bound by long doubles or quick sums, chunk, case) of the worst.
    ratio, error, where : of the worst by the better numbers; `where` is the seed and case.
    sources, revision : digest of the sources, and the revision of the repository.
    seconds : of a processor.
    """

    seed: int = 0
    count: int = 0
    chunks: int = 0
    cases: int = 0
    promised: int = 0
    broken: list[str] = field(default_factory=list)
    worst: list[tuple[float, int, int]] = field(default_factory=list)
    ratio: float = 0.0
    error: float = 0.0
    where: str = ""
    sources: str = ""
    revision: str = ""
    seconds: float = 0.0


def load(name: str) -> Tally | None:
    """The result that is kept of a family."""
    file = FOLDER / f"{name}.json"
    if not file.exists():
        return None
    tally = Tally(**json.loads(file.read_text(encoding="utf-8")))
    tally.worst = [(ratio, chunk, case) for ratio, chunk, case in tally.worst]
    return tally


def save(name: str, tally: Tally) -> None:
    """Keep a family's result in place of the one before, all of it or nothing."""
    FOLDER.mkdir(exist_ok=True)
    file = FOLDER / f"{name}.json"
    part = file.with_suffix(f".{os.getpid()}")
    part.write_text(json.dumps(asdict(tally), indent=1) + "\n", encoding="utf-8")
    part.replace(file)


@lru_cache
def revision() -> str:
    """The revision that is checked out, with a + where sources differ from it."""
    git = ["git", "-C", str(ROOT)]
    try:
        head = subprocess.check_output([*git, "rev-parse", "--short", "HEAD"], text=True).strip()
        changed = subprocess.run(
            [*git, "diff", "--quiet", "HEAD", "--", "adaptive_drt", "tests"], check=False
        ).returncode
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return head + ("+" if changed else "")


@lru_cache
def digest(module: str) -> str:
    """Digest of the sources of a module and of all that it imports of this repository."""
    files: dict[str, Path] = {}
    todo = [module]
    while todo:
        name = todo.pop()
        file = None if name in files else _file(name)
        if file is None:
            continue
        files[name] = file
        todo += _imports(file)
    # what a module says of itself does not change what it computes
    parts = (ast.dump(_bare(ast.parse(files[name].read_text()))) for name in sorted(files))
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def _file(name: str) -> Path | None:
    stem = name.replace(".", "/")
    for place in PLACES:
        for file in (place / f"{stem}.py", place / stem / "__init__.py"):
            if file.exists():
                return file
    return None


def _imports(file: Path) -> list[str]:
    """Names of modules that a file imports, and names in them that may be modules."""
    package = list(file.relative_to(ROOT).with_suffix("").parts[:-1])
    if package[:1] == ["tests"]:
        package = package[1:]
    found = []
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            found += [base, *(f"{base}.{alias.name}" for alias in node.names)]
    return found


def _bare(tree: ast.Module) -> ast.Module:
    """A tree without the strings that stand alone: docstrings and those after constants."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [  # type: ignore[attr-defined]
                item
                for item in body
                if not (isinstance(item, ast.Expr) and isinstance(item.value, ast.Constant))
            ]
    return tree
