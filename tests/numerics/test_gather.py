# SPDX-License-Identifier: GPL-3.0-or-later
"""Columns are what NumPy's indexing gives, in one piece for each component; renders use them."""

from __future__ import annotations

import numpy as np
import pytest

import adaptive_drt.numerics.vector as vector
from adaptive_drt.numerics.gather import columns, place
from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
from random_scenes import random_scene

FEW = 64
"""Numbers: smaller arrays may lie as they like."""


@pytest.mark.parametrize("shape", [(3, 7), (3, 7, 2), (6, 7)])
def test_columns_are_what_indexing_gives(shape):
    values = np.random.default_rng(1).normal(size=shape)
    for index in (np.array([5, 0, 0, 3]), np.array([[1], [6]]), np.arange(7) % 2 == 0, slice(2, 5)):
        assert np.array_equal(columns(values, index), values[:, index])


def test_columns_of_the_last_axis():
    values = np.random.default_rng(2).normal(size=(2, 3, 9))
    for index in (np.array([8, 0, 1]), np.arange(9) < 4, slice(None, None, 2)):
        assert np.array_equal(columns(values, index, -1), values[..., index])


@pytest.mark.parametrize("count", [0, 6])
@pytest.mark.parametrize("index", [[], [4, 1], [[0], [5]]])
def test_what_is_placed_is_what_indexing_places(count, index):
    index = np.array(index if count else [], dtype=np.int64)
    rng = np.random.default_rng(4)
    for shape in ((count,), (3, count), (2, 3, count)):
        values, want = np.zeros((2, *shape))
        for parts in (rng.normal(size=(*shape[:-1], *index.shape)), rng.normal(size=index.shape)):
            place(values, index, parts)
            want[..., index] = parts
            assert np.array_equal(values, want)


def test_components_are_in_one_piece():
    values = np.random.default_rng(3).normal(size=(3, 50))
    assert columns(values, np.arange(0, 50, 3)).flags.c_contiguous
    assert not values[:, np.arange(0, 50, 3)].flags.c_contiguous, "NumPy does so too by now"


@pytest.mark.parametrize("seed", [3, 11, 12])
def test_renders_keep_components_in_one_piece(monkeypatch, seed):
    """Vectors whose components lie side by side cost up to eight times as much."""
    scattered = []

    def watch(function):
        def watched(a, b, ndim):
            for part in (a, b):
                if part.ndim > 1 and part.size > FEW and part.shape[-1] > 1:
                    scattered.append(part.strides[-1] not in (part.itemsize, 0))
            return function(a, b, ndim)

        return watched

    for name in ("_dot", "_cross"):
        monkeypatch.setattr(vector, name, watch(getattr(vector, name)))
    render_image(random_scene(seed), Settings(tolerance=1e-2, threads=1))
    assert len(scattered) > 100
    assert not any(scattered), f"{sum(scattered)} of {len(scattered)} in scene {seed}"
