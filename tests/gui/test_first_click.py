# SPDX-License-Identifier: GPL-3.0-or-later
"""Factory settings, nothing opened by hand, one click: the picture is on the screen, as F12's is.

ADAPTIVE_DRT_PICTURES=folder keeps the screenshots.
"""

from __future__ import annotations

import json

import numpy as np
import pytest

pytestmark = pytest.mark.slow

ALIKE = 2.0
"""Of 255: mean difference of what is seen; it is drawn at another zoom than it is saved."""


@pytest.fixture(scope="module", params=["WINDOW", "SCREEN", "AREA", "NONE"])
def shown(installed, in_window, request):
    """What a click and F12 show under one choice of the preference Render In."""
    kind = request.param
    shots = {f"window-first-{what}": f"{kind}-{what}" for what in ("button", "F12")}
    shots = shots if kind == "WINDOW" else None
    facts = in_window("first_click.py", kind, shots=shots, ADAPTIVE_DRT_RENDER_IN=kind)
    return kind, installed.folder, facts


def seen(folder, name, place):
    """The part of a screenshot that holds the picture, and the picture as it is to look there."""
    from PIL import Image

    screen = Image.open(folder / f"{name}.png").convert("RGB")
    left, top, right, bottom = (round(x) for x in place)
    inside = max(left, 0), max(top, 0), min(right, screen.width), min(bottom, screen.height)
    expected = Image.open(folder / "expected.png").convert("RGB")
    expected = expected.resize((right - left, bottom - top))
    crop = tuple(a - b for a, b in zip(inside, (left, top, left, top), strict=True))
    return np.asarray(screen.crop(inside), dtype=float), np.asarray(
        expected.crop(crop), dtype=float
    )


def test_one_click_shows_the_picture(shown):
    kind, folder, facts = shown
    what = "asked" if kind == "NONE" else "button"
    if kind == "NONE":  # the user's windows stay as they are until the picture is asked for
        assert facts["button"]["windows"] == facts["before"]
    assert facts[what]["place"] is not None, facts
    found, expected = seen(folder, f"{kind}-{what}", facts[what]["place"])
    assert found.shape[0] > 100 and found.std() > 10.0
    assert np.abs(found - expected).mean() < ALIKE


def test_it_opens_where_f12_does(shown):
    kind, folder, facts = shown
    mine, theirs = facts["button"]["windows"], facts["F12"]["windows"]
    said = json.dumps(mine).replace("Adaptive Render", "Render Result")
    assert said == json.dumps(theirs)
    if kind == "NONE":
        return
    found, _ = seen(folder, f"{kind}-button", facts["button"]["place"])
    other, _ = seen(folder, f"{kind}-F12", facts["F12"]["place"])
    size = np.minimum(found.shape, other.shape)
    found, other = (a[: size[0], : size[1]] for a in (found, other))
    assert np.abs(found - other).mean() < ALIKE


def test_escape_gives_the_place_back(shown):
    _, _, facts = shown
    assert facts["closed"] == facts["before"]


def test_the_pixels_are_f12_s(shown):
    kind, folder, facts = shown
    mine, theirs = (np.load(folder / f"{kind}-{who}.npy") for who in ("button", "F12"))
    np.testing.assert_array_equal(mine, theirs)
    assert facts["engine"] == facts["engine before"] != "ADAPTIVE_DRT"
