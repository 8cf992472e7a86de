# SPDX-License-Identifier: GPL-3.0-or-later
"""The mask on scenes made to fool it, against a truth in extended precision."""

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
from adversarial_scenes import FAMILIES, adversarial

pytestmark = pytest.mark.filterwarnings("error")

FEW = {"method": "RAYS", "light_rays": 2, "time_rays": 2, "pixel_rays": 2, "threads": 1}
MOST = 1.1
"""Flagged over truly dependent pixels at order 2, but for those within the bound of tangency."""
COUNTS = {}
"""Truly dependent and flagged pixels by family, for the last test."""


def left_out(seed):
    """Pixels that the mask of either order leaves out, as text; counts what order 2 flags."""
    case = adversarial(seed)
    name = FAMILIES[seed % len(FAMILIES)].__name__
    faults = []
    for order in (2, 1):
        settings = Settings(order=order, **FEW, **case.switches)
        found = render_image(case.scene, settings).mask[case.row]
        gone = case.left_out(found)
        if gone.size:
            faults.append(f"order {order}: by {gone.tolist()} of a radius")
        if order == 2:
            COUNTS.setdefault(name, np.zeros(2, dtype=int))
            COUNTS[name] += case.counts(found)
    return f"seed {seed}, {name}: " + "; ".join(faults) if faults else ""


@pytest.mark.parametrize("seed", (*range(90), 1603))
def test_no_pixel_is_left_out(seed):
    fault = left_out(seed)
    assert not fault, fault


@pytest.mark.slow
@pytest.mark.parametrize("first", range(90, 990, 90))
def test_no_pixel_is_left_out_of_many_scenes(first):
    faults = [fault for fault in map(left_out, range(first, first + 90)) if fault]
    assert not faults, "\n".join(faults)


def test_no_more_is_flagged_than_depends(capsys):
    """After the tests above: what order 2 flags of each family."""
    with capsys.disabled():
        for name, (true, flagged) in COUNTS.items():
            print(f"\n{name}: {true} pixels depend, order 2 flags {flagged}", end="")
        print()
    for name, (true, flagged) in COUNTS.items():
        assert flagged <= MOST * true + 1, name
