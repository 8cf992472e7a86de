# SPDX-License-Identifier: GPL-3.0-or-later
"""The long run of the kernels: taken up again where it ended, honest about what it ran, and its
quick sums hide no error."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba")

sys.path.append(str(Path(__file__).resolve().parent.parent / "benchmarks"))

import stress_kernels
import stress_results

import kernel_families
import kernel_skies
from oracle.latitudes import integrals
from oracle.visible import round_light, visible

SEED = 5
NAME = "LENGTHS"
FAMILY = kernel_families.DISCRIMINANT


def by_name(count, seconds=1e9):
    stress_kernels._by_name(SEED, count, stress_kernels.time.time() + seconds, NAME)
    return stress_results.load(NAME)


@pytest.fixture
def folder(monkeypatch, tmp_path):
    monkeypatch.setattr(stress_results, "FOLDER", tmp_path / "results")
    monkeypatch.setattr(stress_kernels, "CHUNK", 100)


def test_a_run_goes_on_where_it_ended(folder, monkeypatch):
    whole = by_name(250)
    assert (whole.cases, whole.chunks) == (250, 3)
    stress_results.save(NAME, replace(whole, sources="others"))
    clock = iter([0.0, 0.0, 2.0])
    with monkeypatch.context() as patched:
        patched.setattr(stress_kernels.time, "time", lambda: next(clock))
        stress_kernels._by_name(SEED, 250, 1.0, NAME)
    part = stress_results.load(NAME)
    assert (part.cases, part.chunks) == (200, 2), "it ended at its time, by itself"
    on = by_name(250)
    assert on.cases == 250
    assert (on.worst, on.ratio, on.where) == (whole.worst, whole.ratio, whole.where)


def test_what_is_done_is_not_done_again_and_other_sources_are_marked(folder):
    first = by_name(100)
    assert by_name(50) == first
    row = stress_kernels._row(NAME, first)
    assert "| 100 |" in row and f"{first.revision} |" in row
    assert f"{first.revision} * |" in stress_kernels._row(NAME, replace(first, sources="others"))
    stress_results.save(NAME, replace(first, cases=7, sources="others"))
    assert by_name(50).cases == 50


def test_sources_are_those_that_a_module_imports(monkeypatch, tmp_path):
    helpers = tmp_path / "tests" / "helpers"
    helpers.mkdir(parents=True)
    (helpers / "one.py").write_text("from two import x\n")
    (helpers / "two.py").write_text("x = 1\n")
    (helpers / "other.py").write_text("x = 1\n")
    monkeypatch.setattr(stress_results, "ROOT", tmp_path)
    monkeypatch.setattr(stress_results, "PLACES", (tmp_path, helpers))

    def now():
        stress_results.digest.cache_clear()
        return stress_results.digest("one")

    before = now()
    (helpers / "other.py").write_text("x = 2\n")
    (helpers / "two.py").write_text('"""Says more."""\nx = 1\n')
    assert now() == before
    (helpers / "two.py").write_text("x = 2\n")
    assert now() != before
    stress_results.digest.cache_clear()


def test_quick_sums_pass_no_error_that_the_true_ones_find():
    """Quick sums that are half a bound off alarm, and the true ones decide; a wrong kernel stays
    wrong."""
    own = FAMILY
    true = lambda **inputs: own.true(stress_kernels.LONG, **inputs)  # noqa: E731
    off = replace(own, quick=lambda **i: true(**i) + 0.5 * own.bound(**i))
    wrong = replace(
        own,
        core=lambda **i: own.core(**i) + 2.0 * own.bound(**i),
        quick=lambda **i: true(**i),
    )
    fine, bad = stress_kernels.Tally(SEED, 300), stress_kernels.Tally(SEED, 300)
    stress_kernels.stress(off, fine)
    stress_kernels.stress(wrong, bad)
    assert fine.worst[0][0] < 0.3 and fine.ratio < 0.3
    assert bad.worst[0][0] > 1.5 and bad.ratio > 1.5


def test_two_kinds_of_brute_force_agree():
    """Latitudes of which only those at the region's own corners divide the sum, and lines across
    the light: no code in common."""
    rng = np.random.default_rng(SEED)
    n = 12
    inputs = kernel_skies.round_light(rng, n)
    inputs["half"] = np.minimum(inputs["half"], 1.0)
    got = kernel_skies._true_sun(stress_kernels.LONG, **inputs).astype(float)
    quick = kernel_skies._true_sun(stress_kernels.LONG, **inputs, once=True).astype(float)
    for k in range(n):
        axis, half, up = inputs["axis"][:, k], inputs["half"][k], inputs["up"][:, k]
        balls = [(inputs["place"][:, i, k], inputs["radius"][i, k]) for i in range(2)]
        sheets = [inputs["quads"][:, :, i, k] for i in range(inputs["quads"].shape[2])]
        want = visible(round_light(axis, half), up, balls, sheets)
        print(f"seed {SEED}, case {k}: {got[k]}, {want}")
        allowed = 1e-9 * np.sin(half) ** 2 + 1e-12
        assert abs(got[k] - want) <= allowed and abs(quick[k] - want) <= 10.0 * allowed


def test_an_image_that_is_linear_in_the_longitude_is_summed_in_closed_form():
    """A sky of one colour is the hemisphere's pi, and images add up."""
    rng = np.random.default_rng(SEED)
    up = kernel_skies.unit(rng, 1)
    circles = kernel_skies._columns((up, 0.0, 0))
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0][None]
    grey, one = np.ones((1, 8, 16, 3)), rng.random((1, 8, 16, 3))
    sums = [integrals(circles, up.T, frame, None, i)[0] for i in (grey, one, grey - one)]
    assert np.abs(sums[0] - np.pi).max() < 1e-10
    assert np.abs(sums[1] + sums[2] - sums[0]).max() < 1e-10
