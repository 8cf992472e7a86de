# SPDX-License-Identifier: GPL-3.0-or-later
"""Coefficients of the error model: finite, not negative where they are factors, and documented.

Their values are tested by `tests/cubature/test_error_model.py`.
"""

import numpy as np
import pytest

from adaptive_drt.numerics import error_coefficients

MAY_FALL = {"ACHIEVED_RISE"}
"""Coefficients that may be negative: slopes of laws."""


@pytest.mark.parametrize("name", sorted(set(error_coefficients.__all__) - {"DIGEST"}))
def test_coefficients_are_finite_factors(name):
    values = np.atleast_1d(getattr(error_coefficients, name))
    assert np.isfinite(values).all()
    assert name in MAY_FALL or (values > 0.0).all()
