# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels against mpmath at 50 digits: no error beyond the stated bound, and no empty bound.

`benchmarks/stress_kernels.py` puts a million configurations through each.
"""

import numpy as np
import pytest

import kernel_arcs
import kernel_cones
import kernel_families
import kernel_hidden
import kernel_lights
import kernel_ranges
import kernel_spots
from adaptive_drt.geometry.sphere import kernels as quadric
from kernel_families import Family
from oracle.numbers import EXACT, LONG

SEED = 4
CASES = 1_000
MANY = 30_000
EMPTY = 100.0
"""A bound more than so many times the worst error seen promises nothing."""
MODULES = (
    kernel_ranges,
    kernel_families,
    kernel_lights,
    kernel_spots,
    kernel_arcs,
    kernel_cones,
    kernel_hidden,
)
FAMILIES = {
    name: thing
    for module in MODULES
    for name, thing in vars(module).items()
    if isinstance(thing, Family)
}


def ratios(family, m, seed, n):
    """Errors over bounds (..., n); 0 where no bound is promised."""
    inputs = family.sample(np.random.default_rng(seed), n)
    got = family.core(**inputs)
    assert np.isfinite(got).all()
    bound = family.bound(**inputs)
    error = family.error(m, inputs, got)
    promised = np.isfinite(bound)
    assert promised.mean() > 0.5 and not np.isnan(error).any()
    assert (error[promised & (bound == 0.0)] == 0.0).all()
    return np.where(promised, error, 0.0) / np.where(promised & (bound > 0.0), bound, 1.0)


@pytest.mark.parametrize("name", FAMILIES)
def test_errors_stay_within_their_bound(name):
    """Sizes 1e-6 to 1e6, distances to 1e6, aspect ratios to 1e6, against 50 digits."""
    worst = ratios(FAMILIES[name], EXACT, SEED, CASES)
    print(f"{name}, seed {SEED}: {worst.max():.2g} of {FAMILIES[name].promise}")
    assert worst.max() <= 1.0


@pytest.mark.parametrize("name", FAMILIES)
def test_bounds_are_not_empty(name):
    """Of many cases, by long doubles, some error comes within a hundredth of the bound."""
    worst = ratios(FAMILIES[name], LONG, SEED + 1, MANY)
    at = np.unravel_index(worst.argmax(), worst.shape)[-1]
    print(f"{name}, seed {SEED + 1}, case {at}: {worst.max():.2g} of {FAMILIES[name].promise}")
    assert 1.0 / EMPTY <= worst.max() <= 1.0


def test_a_sphere_that_touches_a_cone_is_never_called_clear():
    """The decisions on cones err to the safe side: against 50 digits, never past contact."""
    for family, safe in ((kernel_families.CONE_TOUCHES, 1), (kernel_families.CONE_COVERED, -1)):
        inputs = family.sample(np.random.default_rng(SEED), 4 * CASES)
        got = family.core(**inputs)
        lifted = {key: EXACT.lift(value) for key, value in inputs.items()}
        margin = np.asarray(family.true(EXACT, **lifted)).astype(float)
        wrong = (margin > 0.0) & ~got if safe > 0 else got & (margin < 0.0)
        assert not wrong.any(), f"{family.name}, seed {SEED}: case {np.flatnonzero(wrong)[0]}"


def test_a_hit_lies_closer_to_its_surface_than_counts_as_on_it():
    """`GRAZE` holds the error of hits: 2^-50 of distance and radius, a thousand times less."""
    family = kernel_families.HIT_SPHERE
    inputs = family.sample(np.random.default_rng(SEED), MANY)
    w, v, r = inputs["w"], inputs["v"], inputs["r"]
    t = quadric.intersect_sphere(w, v, r)
    rows = np.flatnonzero(np.isfinite(t))
    out = t[rows] * w[:, rows] - v[:, rows]
    point = v[:, rows] + r[rows] * (out / np.sqrt((out * out).sum(axis=0)))
    off = LONG.norm(LONG.lift(point) - LONG.lift(v[:, rows])) - LONG.lift(r[rows])
    far = np.sqrt((v[:, rows] ** 2).sum(axis=0)) + r[rows]
    assert np.max(np.abs(off) / far) < 2.0**-50
    graze = quadric.surface_tolerance(point, r[rows])
    assert np.all(np.abs(off) < 2.0**-8 * graze)
