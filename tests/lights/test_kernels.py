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
CASES = 15
SLOW_CASES = 4
MANY = 120
FAMILIES = {
    name: thing
    for module in (kernel_skies, kernel_ellipses)
    for name, thing in vars(module).items()
    if isinstance(thing, Family)
}


@pytest.mark.parametrize(
    "name",
    [pytest.param(k, marks=pytest.mark.slow if k == "HIDDEN_SUN" else ()) for k in FAMILIES],
)
def test_errors_stay_within_their_bound(name):
    family = FAMILIES[name]
    cases = CASES if family.share == 1.0 else SLOW_CASES
    inputs = family.sample(np.random.default_rng(SEED), cases)
    got = family.core(**inputs)
    assert np.isfinite(got).all()
    worst = (family.error(LONG, inputs, got) / family.bound(**inputs)).max()
    assert worst <= 1.0, f"{name}, seed {SEED}: {worst}"


@pytest.mark.slow
def test_environments_have_the_stated_error_on_average(monkeypatch):
    """Single errors may be beyond it, as no rule sees all jumps of the integrand's slope."""
    family, allowed = kernel_skies.HIDDEN_IMAGE, 1e-4
    monkeypatch.setattr(kernel_skies, "QUADRATURE", allowed)
    monkeypatch.setattr(kernel_skies, "MISSED", 1e-12)
    inputs = family.sample(np.random.default_rng(SEED), MANY)
    stated = family.core(**inputs)[3]
    over = family.error(LONG, inputs, family.core(**inputs))
    true = over * (stated + 1e-12)
    assert np.sqrt((true**2).mean()) <= 0.5 * np.sqrt((stated**2).mean())
    assert true.max() <= 3.0 * allowed
