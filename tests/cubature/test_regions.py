# SPDX-License-Identifier: GPL-3.0-or-later
"""Integration cells: split, taken and joined without losing or doubling a part of a pixel."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.cubature.regions import Cells, grouped_sums, merge, split


def random_cells(rng, count, pixels=10):
    low = rng.normal(size=(3, count))
    size = rng.random((3, count)) * (rng.random((3, count)) < 0.8)
    return Cells(
        np.sort(rng.integers(0, pixels, count)), low, low + size, rng.random(count),
        rng.random((3, count)), rng.random(count), rng.random((4, 3, count)), rng.random(count),
        rng.random(count), rng.random(count) < 0.5,
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(10))
def test_children_tile_their_cell(seed):
    rng = np.random.default_rng(seed)
    cells = random_cells(rng, 30)
    parts = np.where(cells.high > cells.low, rng.choice([1, 2, 4], (3, 30)), 1)
    found = split(cells, parts)
    size = parts.prod(axis=0)
    parent = np.repeat(np.arange(30), size)
    np.testing.assert_array_equal(found.pixel, cells.pixel[parent])
    np.testing.assert_array_equal(found.multi_node, cells.multi_node[parent])
    assert not found.color.any() and not found.deviation.any() and not found.shape_error.any()
    for k in range(30):
        own = parent == k
        low, high = found.low[:, own], found.high[:, own]
        np.testing.assert_array_equal(low.min(axis=1), cells.low[:, k])
        np.testing.assert_array_equal(high.max(axis=1), cells.high[:, k])
        assert found.volume_fraction[own].sum() == pytest.approx(
            cells.volume_fraction[k], rel=1e-14
        )
        wide = cells.high[:, k] > cells.low[:, k]
        volume = (high - low)[wide].prod(axis=0).sum()
        assert volume == pytest.approx(
            (cells.high - cells.low)[wide, k].prod() if wide.any() else own.sum()
        )
        # any point lies in one child
        for point in rng.uniform(cells.low[:, k], cells.high[:, k], (20, 3)):
            inside = ((low <= point[:, None]) & (point[:, None] <= high)).all(axis=0)
            assert inside.sum() == 1 or not wide.all(), (seed, k)


@pytest.mark.parametrize("seed", range(5))
def test_cells_that_are_taken_and_merged_are_the_same(seed):
    rng = np.random.default_rng(seed)
    cells = random_cells(rng, 40)
    keep = rng.random(40) < 0.5
    joined = merge([cells.take(keep), cells.take(np.flatnonzero(~keep))])
    order = np.argsort(np.concatenate([cells.pixel[keep], cells.pixel[~keep]]), kind="stable")
    index = np.concatenate([np.flatnonzero(keep), np.flatnonzero(~keep)])[order]
    for name in Cells.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(joined, name), getattr(cells, name)[..., index], name)


def test_errors_are_shares_of_all_kinds_and_axes():
    cells = random_cells(np.random.default_rng(1), 12)
    want = [
        cells.volume_fraction[k] * (cells.deviation[:, :, k].sum() + cells.shape_error[k])
        for k in range(12)
    ]
    np.testing.assert_allclose(cells.error, want, rtol=1e-14)


def test_sums_by_group():
    rng = np.random.default_rng(2)
    row, values = rng.integers(0, 7, 50), rng.normal(size=50)
    want = [values[row == k].sum() for k in range(9)]
    np.testing.assert_allclose(grouped_sums(row, values, 9), want, rtol=1e-13, atol=1e-14)
    assert grouped_sums(np.zeros(0, dtype=np.int64), np.zeros(0), 3).tolist() == [0.0] * 3
