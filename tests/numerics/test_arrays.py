# SPDX-License-Identifier: GPL-3.0-or-later
"""The aliases name the types that the core's functions return."""

from __future__ import annotations

import typing

import numpy as np
import pytest

from adaptive_drt.numerics import arrays
from adaptive_drt.numerics.low_discrepancy import hashed_shifts


@pytest.mark.parametrize(
    ("name", "kind"), [("Array", np.float64), ("Ints", np.int64), ("Mask", np.bool_)]
)
def test_aliases_are_of_one_element_type(name, kind):
    assert kind in typing.get_args(typing.get_args(getattr(arrays, name))[1])


def test_python_and_numpy_numbers_become_these_types():
    assert hashed_shifts(0, np.arange(3), 0, 0).dtype == np.float64
    assert np.array([1.5]).dtype == np.float64 and np.arange(2).dtype == np.int64
