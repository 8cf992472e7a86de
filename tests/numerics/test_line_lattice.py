# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines through boxes: where they lie, and polynomials restricted to them."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.numerics.axes import TIME
from adaptive_drt.numerics.line_lattice import Lattice, SideLattice, restrict_to_lines

DEGREES = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


def test_lines_lie_at_the_middles_of_cells_or_on_sides():
    lattice = Lattice(0, 4, 2)
    np.testing.assert_allclose(lattice.u.ravel(), [-0.375, -0.125, 0.125, 0.375])
    np.testing.assert_allclose(lattice.v.ravel(), [-0.25, 0.25])
    sides = SideLattice(0, 2, 1)
    assert sides.u.ravel().tolist() == [-0.5, 0.5] and sides.v.ravel().tolist() == [0.0]


@pytest.mark.parametrize("axis", [0, 1, TIME])
@pytest.mark.parametrize("terms", [1, 3, 6])
def test_polynomials_on_lines_have_the_values_of_the_whole(axis, terms):
    rng = np.random.default_rng(terms)
    # along x and y polynomials have no power of time: it is that of the line's place
    powers = 3
    form, lattice = rng.normal(size=(powers, terms, 7)), Lattice(axis, 3, 2)
    if axis != TIME and terms == 1:
        form = form[:, :1]
    parts = restrict_to_lines(form, lattice)
    for s in (-0.5, 0.1, 0.4):
        found = sum(part * s**k for k, part in enumerate(parts))
        for row, u in enumerate(lattice.u.ravel()):
            for column, v in enumerate(lattice.v.ravel()):
                place = [u, v]
                place.insert(axis, s)
                x, y, t = place
                want = sum(
                    form[p, k] * t**p * x ** DEGREES[k][0] * y ** DEGREES[k][1]
                    for p in range(powers)
                    for k in range(terms)
                )
                value = np.broadcast_to(found, (3, 2, 7))[row, column]
                np.testing.assert_allclose(value, want, rtol=1e-12, atol=1e-13)
