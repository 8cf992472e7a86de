# SPDX-License-Identifier: GPL-3.0-or-later
"""Moments summed over lines: those of a half-space in a box, against points of it."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.numerics.line_lattice import Lattice
from adaptive_drt.visibility.moments import MomentSums

LOWER = ((0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2))
"""Axes of the second moments xx, yx, yy, tx, ty, tt."""


def below(lattice, offset, slope):
    """Lengths and moments (3, 1, rows, columns, 1) of lines where s < offset + slope.(u, v)."""
    end = offset + slope[0] * lattice.u + slope[1] * lattice.v
    high = np.clip(end, -0.5, 0.5)
    size, middle = high + 0.5, 0.5 * (high - 0.5)
    return np.array([size, size * middle, size * (middle**2 + size**2 / 12.0)])[:, None]


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("seed", range(5))
def test_moments_are_those_of_many_points(axis, seed):
    rng = np.random.default_rng(seed)
    offset, slope = rng.uniform(-0.3, 0.3), rng.normal(size=2) * 0.5
    lattice = Lattice(axis, 24, 24)
    sums = MomentSums.zeros(3)
    sums.add(below(lattice, offset, slope), lattice, np.array([[1]]))
    side = (np.arange(120) + 0.5) / 120 - 0.5
    place = np.stack(np.meshgrid(side, side, side, indexing="ij")).reshape(3, -1)
    others = [other for other in range(3) if other != axis]
    inside = place[axis] < offset + slope[0] * place[others[0]] + slope[1] * place[others[1]]
    part = place[:, inside]
    assert sums.weight[1] == pytest.approx(inside.mean(), abs=1e-3)
    np.testing.assert_allclose(sums.moment[:, 1], part.sum(axis=1) / place.shape[1], atol=1e-3)
    second = [(part[a] * part[b]).sum() / place.shape[1] for a, b in LOWER]
    np.testing.assert_allclose(sums.second[:, 1], second, atol=1e-3)
    assert not sums.weight[[0, 2]].any()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_errors_bound_what_lines_are_off_by(axis):
    """A kink at a random place, on few lines: the estimate is at least the error, mostly."""
    rng = np.random.default_rng(axis)
    off, said = [], []
    for _ in range(100):
        offset, slope = rng.uniform(-1.0, 1.0), rng.normal(size=2) * 2.0
        best, rough = (MomentSums.zeros(1) for _ in range(2))
        for sums, lines in ((best, 80), (rough, 4)):
            lattice = Lattice(axis, lines, lines)
            sums.add(below(lattice, offset, slope), lattice, np.array([[0]]))
        off.append(abs(rough.weight[0] - best.weight[0]))
        said.append(rough.error[0])
    off, said = np.array(off), np.array(said)
    assert (off > said + 1e-4).mean() < 0.1
    assert np.sqrt((off**2).mean()) < np.sqrt((said**2).mean()) < 30.0 * np.sqrt((off**2).mean())


def test_a_single_line_counts_for_the_whole_box():
    lattice = Lattice(2, 1, 1)
    sums = MomentSums.zeros(1)
    sums.add(below(lattice, 0.25, (0.0, 0.0)), lattice, np.array([[0]]))
    assert sums.weight[0] == 0.75 and sums.error[0] == 0.0
    np.testing.assert_allclose(sums.second[:, 0], [0.0625, 0.0, 0.0625, 0.0, 0.0, 0.046875])
