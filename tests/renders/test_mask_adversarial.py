# SPDX-License-Identifier: GPL-3.0-or-later
"""The mask on scenes made to fool it, against a truth in extended precision."""

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
from adversarial_scenes import FAMILIES, adversarial
from adversarial_solids import FAMILIES as SOLID_FAMILIES
from adversarial_solids import KINDS, adversarial_solid

pytestmark = pytest.mark.filterwarnings("error")

FEW = {"method": "RAYS", "light_rays": 2, "time_rays": 2, "pixel_rays": 2, "threads": 1}
MOST = 1.1
"""Flagged over truly dependent pixels at order 2, but for those within the bound of tangency."""
COUNTS, SOLID_COUNTS = {}, {}
"""Truly dependent and flagged pixels by family, for the last test."""


def left_out(seed):
    """Pixels that the mask of either order leaves out, as text; counts what order 2 flags."""
    return _left_out(seed, adversarial(seed), FAMILIES[seed % len(FAMILIES)].__name__)


def left_out_by_solid(seed):
    """The same of a scene with an ellipsoid, cylinder, cone or ellipse."""
    case, family, kind = adversarial_solid(seed)
    return _left_out(seed, case, f"{family}, {kind}", SOLID_COUNTS)


def _left_out(seed, case, name, counts=COUNTS):
    faults = []
    for order in (2, 1):
        settings = Settings(order=order, **FEW, **case.switches)
        found = render_image(case.scene, settings).mask[case.row]
        gone = case.left_out(found)
        if gone.size:
            faults.append(f"order {order}: by {gone.tolist()} of a size")
        if order == 2:
            counts.setdefault(name, np.zeros(2, dtype=int))
            counts[name] += case.counts(found)
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


@pytest.mark.parametrize("seed", range(len(SOLID_FAMILIES) * len(KINDS)))
def test_no_pixel_is_left_out_by_a_solid(seed):
    fault = left_out_by_solid(seed)
    assert not fault, fault


@pytest.mark.slow
@pytest.mark.parametrize("first", range(35, 350, 35))
def test_no_pixel_is_left_out_by_many_solids(first):
    faults = [fault for fault in map(left_out_by_solid, range(first, first + 35)) if fault]
    assert not faults, "\n".join(faults)


def assert_few_are_flagged(counts, capsys):
    with capsys.disabled():
        for name, (true, flagged) in counts.items():
            print(f"\n{name}: {true} pixels depend, order 2 flags {flagged}", end="")
        print()
    for name, (true, flagged) in counts.items():
        assert flagged <= MOST * true + 1, name


def test_no_more_is_flagged_than_depends(capsys):
    """After the tests above: what order 2 flags of each family."""
    assert_few_are_flagged(COUNTS, capsys)


def test_no_more_is_flagged_of_solids_than_depends(capsys):
    """The same of each family of solids, all kinds together.

    But for those that rest on the floor: under flat ones much is hidden by them, which is bounded
    by the balls within them alone.
    """
    total = {}
    for name, counts in SOLID_COUNTS.items():
        family = name.split(",")[0]
        total[family] = total.get(family, 0) + counts
    total.pop("resting", None)
    assert_few_are_flagged(total, capsys)
