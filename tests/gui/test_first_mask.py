# SPDX-License-Identifier: GPL-3.0-or-later
"""Show Mask in Compositor, from any workspace: the mask lies over the picture on the screen.

ADAPTIVE_DRT_PICTURES=folder keeps the screenshots.
"""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=["Layout", "Compositing"])
def shown(installed, in_window, request):
    workspace = request.param
    shots = {"window-mask": f"mask-{workspace}"} if workspace == "Layout" else None
    name = f"mask-{workspace}"
    facts = in_window("first_mask.py", name, shots=shots, ADAPTIVE_DRT_WORKSPACE=workspace)
    return workspace, installed.folder, facts


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
