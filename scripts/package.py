# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the extension: one zip for each platform, with embreex's wheels for every Python.

    python scripts/package.py [linux_x64 …]      all platforms unless some are named

It downloads the wheels that scripts/wheels.lock names into wheels/, checks their hashes, writes a
manifest that lists them, and leaves the zips in dist/. NumPy is Blender's own and never packed.
The same files give the same zip to the last bit.
"""

from __future__ import annotations

import hashlib
import importlib.util
import re
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LOCK = ROOT / "scripts" / "wheels.lock"
WHEELS, DIST = ROOT / "wheels", ROOT / "dist"

PLATFORMS = {
    "linux-x64": "manylinux",
    "windows-x64": "win_amd64",
    "macos-arm64": "macosx_13_0_arm64",
    "macos-x64": "macosx_13_0_x86_64",
}
"""Blender's name of a platform, and what its wheels' file names hold."""

FOLDERS = ("adaptive_drt", "operators", "ui")
FILES = ("__init__.py", "LICENSE")
LONG_AGO = (1980, 1, 1, 0, 0, 0)
"""The first moment that a zip can hold."""


def read_lock() -> dict[str, str]:
    """Return the wheels' hashes by file name."""
    lines = [line.split() for line in LOCK.read_text().splitlines() if line[:1] not in ("#", "")]
    return {name: digest for digest, name in lines}


def fetch(name: str, digest: str) -> Path:
    """Return a wheel of that hash, downloaded if it is not there."""
    path = WHEELS / name
    if not path.exists():
        package, version, python, abi, platform = name.removesuffix(".whl").split("-")
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-input"]
        command += ["--only-binary=:all:", "--implementation=cp", f"--abi={abi}"]
        command += [f"--python-version={python[2]}.{python[3:]}", f"--dest={WHEELS}"]
        command += [f"--platform={one}" for one in platform.split(".")]
        subprocess.run([*command, f"{package}=={version}"], check=True, stdin=subprocess.DEVNULL)
    found = hashlib.sha256(path.read_bytes()).hexdigest()
    if found != digest:
        raise SystemExit(f"package: {path} has sha256 {found}; scripts/wheels.lock says {digest}")
    return path


def make_manifest(platform: str, wheels: list[str]) -> str:
    """Return the manifest for one platform: the repository's, with its wheels."""
    text = (ROOT / "blender_manifest.toml").read_text()
    # how a zip is built is over; and what is said of wheels that are to come
    text = re.sub(r"^\[build\].*", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^# (Wheels of|wheels =|Once listed).*\n", "", text, flags=re.MULTILINE)
    listed = "".join(f'  "./wheels/{name}",\n' for name in wheels)
    text = f'{text.rstrip()}\n\nplatforms = ["{platform}"]\nwheels = [\n{listed}]\n'
    read = tomllib.loads(text)
    if read["platforms"] != [platform] or len(read["wheels"]) != len(wheels):
        raise SystemExit("package: the manifest's own tables hide the wheels")
    return text


def sources() -> Iterator[Path]:
    """Yield the add-on's files."""
    yield from (ROOT / name for name in FILES)
    for folder in FOLDERS:
        yield from sorted((ROOT / folder).rglob("*.py"))


def build(platform: str, folder: Path = DIST) -> Path:
    """Build the zip of one platform in a folder and return its path."""
    mark = PLATFORMS[platform]
    wheels = [fetch(n, digest) for n, digest in sorted(read_lock().items()) if mark in n]
    manifest = make_manifest(platform, [wheel.name for wheel in wheels])
    read = tomllib.loads(manifest)
    folder.mkdir(exist_ok=True)
    target = folder / f"{read['id']}-{read['version']}-{platform.replace('-', '_')}.zip"
    with zipfile.ZipFile(target, "w") as packed:
        _add(packed, "blender_manifest.toml", manifest.encode())
        for path in sources():
            _add(packed, path.relative_to(ROOT).as_posix(), path.read_bytes())
        for wheel in wheels:
            _add(packed, f"wheels/{wheel.name}", wheel.read_bytes(), zipfile.ZIP_STORED)
    return target


def _add(
    packed: zipfile.ZipFile, name: str, content: bytes, method: int = zipfile.ZIP_DEFLATED
) -> None:
    entry = zipfile.ZipInfo(name, LONG_AGO)
    entry.external_attr = 0o644 << 16
    packed.writestr(entry, content, method)


def validate(path: Path) -> None:
    """Let Blender's own tool look at a zip, if Blender is there as a module; exit if it objects."""
    module = importlib.util.find_spec("bpy")
    if module is None or not module.submodule_search_locations:
        sys.stdout.write("package: not validated, since there is no bpy module\n")
        return
    folder = Path(module.submodule_search_locations[0])
    (tool,) = folder.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    told = subprocess.run(
        [sys.executable, str(tool), "validate", str(path)], capture_output=True, text=True
    )
    # its exit code is 0 for some errors
    if told.returncode or "ERROR" in told.stdout + told.stderr:
        raise SystemExit(f"package: {path.name} is not valid:\n{told.stdout}{told.stderr}")


def main(arguments: list[str]) -> None:
    wanted = [name.replace("_", "-") for name in arguments] or list(PLATFORMS)
    unknown = set(wanted) - PLATFORMS.keys()
    if unknown:
        raise SystemExit(f"package: {unknown} are none of {list(PLATFORMS)}")
    WHEELS.mkdir(exist_ok=True)
    for platform in wanted:
        path = build(platform)
        validate(path)
        sys.stdout.write(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1e6:.1f} MB, valid\n")


if __name__ == "__main__":
    main(sys.argv[1:])
