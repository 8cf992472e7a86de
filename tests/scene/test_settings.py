# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings: what is in range is kept, and what is not is named in a message."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, fields, replace

import pytest

from adaptive_drt.scene.settings import Settings, SettingsError

ALLOWED = {
    "method": ("EXACT", "RAYS"),
    "tolerance": (1e-12, 1, 1e9),
    "order": (1, 2),
    "distribution": ("ADAPTIVE", "EVERYWHERE"),
    "accelerator": ("AUTO", "ARRAYS", "EMBREE"),
    "light_rays": (1, 10_000),
    "time_rays": (1, 10_000),
    "pixel_rays": (1, 10_000),
    "threads": (0, 64),
    "batch": (1, 10**7),
}
REFUSED = {
    "method": ("exact", "", None, 1),
    "tolerance": (0.0, -1.0, float("nan"), float("inf"), "0.1", None),
    "order": (0, 3, "2"),
    "distribution": ("NOWHERE", None),
    "accelerator": ("embree", None),
    "light_rays": (0, -1, 1.5, None),
    "time_rays": (0, -1, 1.5, None),
    "pixel_rays": (0, -1, 1.5, None),
    "threads": (-1, 0.5, None),
    "batch": (0, -5, 2.5, None),
}


def test_every_number_and_choice_is_tested_here():
    switches = {f.name for f in fields(Settings) if isinstance(f.default, bool)} | {"seed"}
    assert {f.name for f in fields(Settings)} - switches == ALLOWED.keys() == REFUSED.keys()


@pytest.mark.parametrize("name, value", [(n, v) for n, vs in ALLOWED.items() for v in vs])
def test_what_is_in_range_is_kept(name, value):
    assert getattr(replace(Settings(), **{name: value}), name) == value


@pytest.mark.parametrize("name, value", [(n, v) for n, vs in REFUSED.items() for v in vs])
def test_what_is_out_of_range_is_named(name, value):
    with pytest.raises(SettingsError, match=f"^{name} is "):
        Settings(**{name: value})


def test_settings_are_frozen():
    with pytest.raises(FrozenInstanceError):
        Settings().order = 1
