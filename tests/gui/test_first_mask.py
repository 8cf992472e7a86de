# SPDX-License-Identifier: GPL-3.0-or-later
"""Show Mask in Compositor, from any workspace: the mask lies over the picture on the screen.

ADAPTIVE_DRT_PICTURES=folder keeps the screenshots.
"""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=["Layout", "Compositing"])
def shown(installed, copied, request):
    if os.environ.get("ADAPTIVE_DRT_BLENDER"):
        pytest.skip("the window is tested in the Blender that `make blender` makes")
    workspace, folder = request.param, installed.folder
    copied("desk.py")
    script = copied("first_mask.py")
    installed.variables["ADAPTIVE_DRT_WORKSPACE"] = workspace
    told = installed.run(copied("window.sh"), "-", script, folder, command="sh")
    kept = os.environ.get("ADAPTIVE_DRT_PICTURES")
    if kept and workspace == "Layout":
        Path(kept).mkdir(parents=True, exist_ok=True)
        shutil.copy(folder / f"mask-{workspace}.png", Path(kept) / "window-mask.png")
    assert told.returncode == 0, told.stdout[-3000:] + told.stderr[-3000:]
    assert "Traceback" not in told.stdout + told.stderr, told
    return workspace, folder, json.loads((folder / f"mask-{workspace}.json").read_text())


def test_the_nodes_and_their_picture_are_in_view(shown):
    workspace, _, facts = shown
    assert facts["workspace"] == workspace  # nobody is taken elsewhere
    assert facts["backdrop"] and facts["nodes in view"] and facts["viewer"] == [480, 270]


def test_the_mask_is_seen(shown):
    """The cube's edges are flagged, blue; as many pixels of the screen as the Viewer has are."""
    from PIL import Image

    workspace, folder, facts = shown
    screen = Image.open(folder / f"mask-{workspace}.png").convert("RGB").crop(facts["region"])
    viewer = Image.open(folder / "viewer.png").convert("RGB")
    part = [blue_part(np.asarray(image, dtype=float)) for image in (viewer, screen)]
    assert 0.002 < part[0] < 0.05
    # the picture fills about half of the editor
    assert part[1] > 0.2 * part[0], part


def blue_part(pixels):
    red, green, blue = pixels.transpose(2, 0, 1)
    return ((blue > 120.0) & (blue > 1.5 * green) & (blue > 3.0 * red)).mean()
