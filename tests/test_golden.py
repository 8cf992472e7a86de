# SPDX-License-Identifier: GPL-3.0-or-later
"""Golden pictures: nothing that is not meant to change one changes a bit of it.

In an environment (NumPy, processor, C library: see `golden.environment`) whose digests are stored
each picture has to be the same to the last bit; in any other it is compared with stored arrays by
the rule in `golden.rule`. `make golden` writes both where a picture is meant to change, and adds
the digests of an environment that has none: see CONTRIBUTING.md.
"""

import functools
import warnings
from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.parallel.pool import WorkerPool, worker_pool
from adaptive_drt.render import WORKERS_PIXELS
from golden import store
from golden.environment import environment_key
from golden.rule import broken, difference, state_of
from golden.scenes import CASES
from golden.store import (
    arrays_of,
    digests_of,
    read_arrays,
    read_digests,
    write_arrays,
    write_digests,
)
from workers import wait_for

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

DEFAULT_BATCH = 65_536
PARTS = ((1, 61), (2, DEFAULT_BATCH), (5, 4_096), (5, 61))
"""Threads and pixels of a batch: with 61 a picture takes many batches, of two or three rows."""
PARTED = (
    "all kinds of lights",
    "occluders in lights",
    "large and clear",
    "a crowd of spheres",
    "rays, a crowd by embree",
    "a moving sphere, 0.1 %",
    "all move",
    "smooth motion",
    "rays, order 2",
    "rays everywhere",
    "rays, lights and camera move",
    "rays, a border without a world",
    "a border",
    "a border in motion",
    "film without a world",
)
"""Cases that are rendered in parts: both methods, motion, borders, crowds."""
WORKED = "a sphere on a large floor"
"""The case that is rendered by workers, at a larger size."""


@functools.cache
def stored():
    """This environment's digests, and the arrays."""
    digests = read_digests()
    if not digests:
        warnings.warn(
            f"no golden digests for {environment_key()}: pictures are compared by golden.rule",
            stacklevel=2,
        )
    return digests, read_arrays()


@functools.cache
def rendered(name):
    """Arrays of a case by one thread."""
    return arrays_of(CASES[name].film())


def differing(arrays, others):
    """Names of the arrays that are not the same to the last bit."""
    one, other = digests_of(arrays), digests_of(others)
    return [name for name in one if one[name] != other[name]]


@pytest.mark.parametrize("name", CASES)
def test_the_picture_is_what_it_was(name):
    digests, arrays = stored()
    assert name in arrays, "its arrays are not stored: run `make golden`"
    found = rendered(name)
    if name in digests:
        own = digests_of(found)
        other = [each for each in own if own[each] != digests[name].get(each)]
        off = difference(found, arrays[name])
        assert not other, f"{', '.join(other)} changed; colours by {off:.1e} of the mean"
    assert not broken(CASES[name], found, arrays[name])


@pytest.mark.parametrize("threads, batch", PARTS)
@pytest.mark.parametrize("name", PARTED)
def test_threads_and_batches_change_no_bit(name, threads, batch):
    other = arrays_of(CASES[name].film(threads=threads, batch=batch))
    assert not differing(rendered(name), other)


def test_workers_change_no_bit(monkeypatch):
    """A picture so large that worker processes share it: with two of them, and with none."""
    made, borrow = [], WorkerPool.acquire

    def counted(self):
        worker = borrow(self)
        made.append(worker is not None)
        return worker

    monkeypatch.setattr(WorkerPool, "acquire", counted)
    case = CASES[WORKED]
    camera = replace(case.scene.camera, resolution=(256, 128))
    large = replace(case, scene=replace(case.scene, camera=camera))
    assert 256 * 128 >= WORKERS_PIXELS
    alone = arrays_of(large.film())
    assert not any(made)
    worker_pool.start_workers(2)
    try:
        wait_for(lambda: worker_pool.ready_count == 2)
        together = arrays_of(large.film(threads=3))
    finally:
        worker_pool.stop()
    assert any(made), "no worker was called"
    assert not differing(alone, together)


def test_nothing_is_stored_of_cases_that_are_gone():
    digests, arrays = stored()
    assert set(arrays) == set(CASES) and set(digests) <= set(CASES)


def test_no_two_pictures_are_one():
    """Each case counts for something: its arrays are not those of another."""
    seen = {}
    for name, own in stored()[1].items():
        key = tuple(digests_of(own).values())
        assert seen.setdefault(key, name) == name, f"{name} is {seen[key]}"


SPOILT = {
    "a colour beyond the last bits": ("color", 1e-12, slice(None)),
    "a colour that is not a number": ("color", np.nan, (0, 0, 0)),
    "a pixel beyond the tolerance": ("color", 1.5e-3, (0, 3, 3)),
    "alpha": ("alpha", 1e-12, slice(None)),
    "depth": ("depth", 1e-11, slice(None)),
    "normals": ("normal", 1e-12, slice(None)),
    "the mask": ("mask", True, (0, slice(None))),
    "samples": ("samples", 1, slice(None)),
    "the estimate": ("estimate", 1e-3, 0),
}


@pytest.mark.parametrize("what", SPOILT)
def test_the_rule_is_broken_by(what):
    name, change, where = SPOILT[what]
    case = CASES["quad light"]
    good = stored()[1]["quad light"]
    spoilt = {**good, name: good[name].copy()}
    spoilt[name][where] += change
    assert not broken(case, good, good)
    assert broken(case, spoilt, good)


def test_the_rule_allows_last_bits_and_a_decision():
    case, good = CASES["quad light"], stored()[1]["quad light"]
    other = {name: array.copy() for name, array in good.items()}
    mean = other["color"].mean()
    other["color"] += 5e-14 * mean
    other["color"][:, 3, 3] += 0.9e-3 * mean
    other["samples"][3, 3] += 64
    other["mask"][:, 3, 3] ^= True
    assert not broken(case, other, good)


def test_what_is_written_again():
    case, good = CASES["quad light"], stored()[1]["quad light"]
    digests = digests_of(good)
    last_bit = {**good, "color": np.nextafter(good["color"], np.inf)}
    other = digests_of(last_bit)
    assert state_of(case, good, digests, None, None) == ("new", ())
    assert state_of(case, good, digests, good, digests) == ("same", ())
    assert state_of(case, last_bit, other, good, digests) == ("CHANGED", ("color",))
    # in an environment without digests nobody can tell a change of last bits
    assert state_of(case, last_bit, other, good, None) == ("added", ())
    state, reasons = state_of(case, {**good, "alpha": good["alpha"] + 1.0}, {}, good, None)
    assert state == "CHANGED" and len(reasons) == 2


@pytest.fixture
def elsewhere(monkeypatch, tmp_path):
    monkeypatch.setattr(store, "ARRAYS_FILE", tmp_path / "arrays.npz")
    monkeypatch.setattr(store, "DIGESTS_FOLDER", tmp_path / "digests")


def test_arrays_come_back(elsewhere):
    assert read_arrays() == {}
    arrays = {name: rendered(name) for name in ("one sphere", "a border")}
    write_arrays(arrays)
    again = read_arrays()
    assert list(again) == list(arrays)
    for name, own in arrays.items():
        assert digests_of(again[name]) == digests_of(own)


def test_what_changed_is_dropped_from_the_digests_of_other_environments(elsewhere, monkeypatch):
    assert read_digests() == {}
    with monkeypatch.context() as other:
        other.setattr(store, "environment_key", lambda: "other")
        write_digests({"a": {"color": "1"}, "b": {"color": "2"}}, set())
    write_digests({"a": {"color": "3"}, "b": {"color": "4"}}, {"a"})
    assert read_digests() == {"a": {"color": "3"}, "b": {"color": "4"}}
    assert read_digests("other") == {"b": {"color": "2"}}
