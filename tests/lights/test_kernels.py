# SPDX-License-Identifier: GPL-3.0-or-later
"""Partly hidden suns, spots, skies, environments and ellipses against brute force.

`benchmarks/stress_kernels.py` puts many more configurations through each.
"""

import numpy as np
import pytest

pytest.importorskip("numba")

import kernel_ellipses
import kernel_skies
from kernel_families import Family
from oracle.numbers import LONG

SEED = 4
CASES = 60
SLOW_CASES = 6
FAMILIES = {
    name: thing
    for module in (kernel_skies, kernel_ellipses)
    for name, thing in vars(module).items()
    if isinstance(thing, Family)
}


@pytest.mark.parametrize("name", FAMILIES)
def test_errors_stay_within_their_bound(name):
    family = FAMILIES[name]
    cases = CASES if family.share == 1.0 else SLOW_CASES
    inputs = family.sample(np.random.default_rng(SEED), cases)
    got = family.core(**inputs)
    assert np.isfinite(got).all()
    worst = (family.error(LONG, inputs, got) / family.bound(**inputs)).max()
    assert worst <= 1.0, f"{name}, seed {SEED}: {worst}"
