# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects over a pipe: they arrive whole, and their arrays are their own."""

from __future__ import annotations

import io

import numpy as np
import pytest

from adaptive_drt.parallel.transport import receive, send

ARRAYS = (
    np.arange(6.0).reshape(2, 3),
    np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    np.arange(24.0).reshape(2, 3, 4)[:, ::2, 1:],
    np.zeros((3, 0)),
    np.array(5),
    np.array([True, False]),
    np.zeros(1 << 18),
)


@pytest.mark.parametrize("array", ARRAYS, ids=lambda a: f"{a.dtype}{a.shape}")
def test_arrays_over_a_pipe(array):
    pipe = io.BytesIO()
    send(pipe, {"array": array, "more": ("a", None)})
    send(pipe, "next")
    pipe.seek(0)
    got = receive(pipe)
    assert np.array_equal(got["array"], array) and got["array"].dtype == array.dtype
    assert got["more"] == ("a", None) and receive(pipe) == "next"
    got["array"][...] = 0
    with pytest.raises(EOFError):
        receive(pipe)


def test_half_a_message_is_none():
    pipe = io.BytesIO()
    send(pipe, np.arange(9.0))
    with pytest.raises(EOFError):
        receive(io.BytesIO(pipe.getvalue()[:-1]))
