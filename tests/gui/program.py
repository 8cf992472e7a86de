# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as a program: the one that `make blender` made, or another one that is named.

ADAPTIVE_DRT_BLENDER=/path/to/blender tests another one, and without a window.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "blender.sh"
VERSIONS = ("5.2", "4.3")
SECONDS = 300.0
"""Longest that one run may take."""


@dataclass
class Program:
    """Runs a Blender in a folder of its own, with a profile of its own in it.

    folder : where both sides see files; `inside` says what the program calls one.
    """

    prefix: list[str]
    folder: Path
    root: Path
    variables: dict[str, str] = field(default_factory=dict)

    def inside(self, path: Path) -> str:
        return "/" + path.relative_to(self.root).as_posix()

    @property
    def profile(self) -> Path:
        return self.folder / "profile"

    def words(self, command: str = "blender", profile: Path | None = None) -> list[str]:
        """Return the words that start Blender, or another command, with its profile or another."""
        resources = self.inside(profile or self.profile)
        variables = {"BLENDER_USER_RESOURCES": resources, **self.variables}
        settings = [f"{name}={value}" for name, value in variables.items()]
        program = os.environ.get("ADAPTIVE_DRT_BLENDER", "blender")
        return [*self.prefix, "env", *settings, program if command == "blender" else command]

    def run(self, *arguments: str | Path, command: str = "blender") -> subprocess.CompletedProcess:
        """Run Blender to its end; paths in the folder are given as the program knows them."""
        said = [self.inside(a) if isinstance(a, Path) else a for a in arguments]
        return subprocess.run(
            [*self.words(command), *said],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=SECONDS,
        )

    def close(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)


def find_program(version: str) -> Program | str:
    """Return the program in a fresh folder, or the reason why there is none."""
    if os.environ.get("ADAPTIVE_DRT_BLENDER"):
        return _fresh(Program([], Path(tempfile.mkdtemp()), Path("/")))
    found = subprocess.run(
        ["bash", str(SCRIPT), "folder", version], capture_output=True, text=True
    ).stdout.strip()
    if not found:
        return f"no Blender {version} here: make blender"
    if os.geteuid() != 0:
        return f"Blender {version} is in a folder that root alone can enter"
    root = Path(found)
    folder = Path(tempfile.mkdtemp(prefix="adaptive-drt-", dir=root / "srv"))
    return _fresh(Program(["bash", str(SCRIPT), "run", version], folder, root))


def _fresh(program: Program) -> Program:
    # Blender falls back to the user's own profile when this one is not there
    program.profile.mkdir()
    return program
