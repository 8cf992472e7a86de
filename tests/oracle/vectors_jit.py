# SPDX-License-Identifier: GPL-3.0-or-later
"""Vectors as tuples of three numbers, compiled: they live in registers, arrays do not."""

import hashlib
from pathlib import Path

import numba
from numba import njit

__all__ = ["add", "cross", "dot", "jit", "less", "times", "vector"]


def _cache_folder():
    """The folder of compiled functions for the present source of all of them.

    Numba compares the date of a function's own file only. A function compiled with an older one of
    another file that it calls would be used again.
    """
    files = sorted(Path(__file__).parent.glob("*_jit.py"))
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
    return Path(__file__).parent / "__pycache__" / digest[:16]


numba.config.CACHE_DIR = str(_cache_folder())

jit = njit(cache=True, nogil=True, error_model="numpy")


@jit
def vector(row, k):
    """Three numbers of a row from index k on."""
    return row[k], row[k + 1], row[k + 2]


@jit
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit
def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@jit
def add(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@jit
def less(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@jit
def times(s, a):
    return s * a[0], s * a[1], s * a[2]
