# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's zips, with stand-ins for the wheels; Blender's own tool looks at them."""

from __future__ import annotations

import hashlib
import importlib.util
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def package(tmp_path, monkeypatch):
    spec = importlib.util.spec_from_file_location("package", ROOT / "scripts" / "package.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "WHEELS", tmp_path)
    return module


@pytest.fixture
def built(package, tmp_path, monkeypatch):
    """Build a platform's zip; each wheel's content is its name."""

    def fetch(name, _digest):
        (tmp_path / name).write_text(name)
        return tmp_path / name

    monkeypatch.setattr(package, "fetch", fetch)
    return lambda platform: package.build(platform, tmp_path / "dist")


def test_what_is_in_it(package, built):
    for platform in package.PLATFORMS:
        path = built(platform)
        package.validate(path)
        with zipfile.ZipFile(path) as packed:
            names = packed.namelist()
            manifest = tomllib.loads(packed.read("blender_manifest.toml").decode())
            assert packed.read("__init__.py") == (ROOT / "__init__.py").read_bytes()
        wheels = [n for n in names if n.startswith("wheels/")]
        assert manifest["platforms"] == [platform] and "build" not in manifest
        assert manifest["wheels"] == [f"./{name}" for name in wheels]
        assert wheels and all(n.startswith("wheels/embreex-") for n in wheels)
        assert len(wheels) == (1 if platform == "macos-x64" else 3)
        assert {"adaptive_drt/render.py", "operators/engine.py", "LICENSE"} <= set(names)
        assert not any(n.startswith(("tests", "docs", "demo", ".")) for n in names)


def test_every_wheel_has_its_platform(package):
    lock = package.read_lock()
    for name, digest in lock.items():
        assert sum(mark in name for mark in package.PLATFORMS.values()) == 1, name
        assert len(digest) == 64


def test_the_same_to_the_last_bit(built):
    first = built("linux-x64").read_bytes()
    assert built("linux-x64").read_bytes() == first


def test_a_wheel_that_was_changed(package, tmp_path):
    (name, digest), *_ = package.read_lock().items()
    (tmp_path / name).write_bytes(b"changed")
    with pytest.raises(SystemExit, match=hashlib.sha256(b"changed").hexdigest()):
        package.fetch(name, digest)


def test_a_manifest_that_is_not_valid(package, built, tmp_path):
    path = built("linux-x64")
    broken = tmp_path / "broken.zip"
    with zipfile.ZipFile(path) as packed, zipfile.ZipFile(broken, "w") as other:
        for name in packed.namelist():
            content = packed.read(name)
            other.writestr(name, content.replace(b'type = "add-on"', b'type = "thing"'))
    with pytest.raises(SystemExit, match=r"broken\.zip is not valid"):
        package.validate(broken)
