# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with values of records, and sums of colours."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.values import (
    LARGEST_COORDINATE,
    SMALLEST_SIZE,
    Motion,
    area_defect,
    is_finite,
    motion_defect,
    radius_defect,
    scaled_color,
    vector_defect,
    vector_of,
)

BAD_NUMBERS = (np.nan, np.inf, -np.inf, 1e31)


def test_vectors_are_tuples_of_floats():
    found = vector_of(np.arange(3))
    assert found == (0.0, 1.0, 2.0) and all(type(x) is float for x in found)
    with pytest.raises(ValueError):
        vector_of((1.0, 2.0))


def test_vectors_have_three_finite_components():
    assert is_finite((0.0, -LARGEST_COORDINATE, 1e-300))
    assert not is_finite((0.0, 1.0)) and not is_finite((0.0, 1.0, 2.0, 3.0))
    for number in BAD_NUMBERS:
        for k in range(3):
            vector = [0.0, 0.0, 0.0]
            vector[k] = number
            assert not is_finite(tuple(vector))
            assert "displacement" in (vector_defect(Motion(tuple(vector)), "displacement") or "")
            assert "motion" in (motion_defect(Motion(tuple(vector))) or "")
    assert motion_defect(None) is None and motion_defect(Motion((1.0, 2.0, 3.0))) is None


@pytest.mark.parametrize("radius", [0.0, -1.0, 0.5 * SMALLEST_SIZE, *BAD_NUMBERS])
def test_radii_are_positive(radius):
    assert "radius" in (radius_defect(radius) or "")
    assert radius_defect(1.0) is None and radius_defect(SMALLEST_SIZE) is None


@pytest.mark.parametrize("u, v", [
    ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ((1.0, 2.0, 3.0), (-2.0, -4.0, -6.0)),
    ((1.0, 0.0, 0.0), (1.0, 1e-17, 0.0)),
    ((1e-61, 0.0, 0.0), (0.0, 1.0, 0.0)),
])  # fmt: skip
def test_edges_span_an_area(u, v):
    assert area_defect(u, v) == area_defect(v, u) == "it has no area"
    assert area_defect((1e8, 0.0, 0.0), (0.0, 1e-8, 0.0)) is None


def test_colours_are_scaled():
    assert scaled_color((1.0, 2.0, 0.5), 2.0) == (2.0, 4.0, 1.0)
