# SPDX-License-Identifier: GPL-3.0-or-later
"""What the last bits of a picture hang on besides the code: NumPy, the processor and libraries."""

import hashlib
import importlib
import json
import platform

import numpy as np

__all__ = ["environment", "environment_key"]

COUNT = 4_096
"""Arguments that each function is tried on."""


def environment():
    """This environment, ready for JSON.

    NumPy chooses the code of many functions by the features of the processor that are enabled;
    others come from the C library, and eigenvalues and small dot products from BLAS and LAPACK,
    which choose for themselves. `arithmetic` is the digest of what all of these return here.
    """
    return {
        "numpy": np.__version__,
        "cpu_features": sorted(name for name, on in _cpu_features().items() if on),
        "machine": platform.machine(),
        "libc": " ".join(platform.libc_ver()).strip() or platform.system(),
        "arithmetic": _arithmetic(),
    }


def environment_key():
    """A short name for this environment: NumPy's version and a digest of all the rest."""
    text = json.dumps(environment(), sort_keys=True)
    return f"numpy-{np.__version__}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def _cpu_features():
    """NumPy's own table of the processor's features: enabled or not."""
    # NumPy 2 moved it
    for name in ("numpy._core._multiarray_umath", "numpy.core._multiarray_umath"):
        try:
            return importlib.import_module(name).__cpu_features__
        except (ImportError, AttributeError):
            continue
    raise RuntimeError("NumPy does not tell the processor's features: look where it does now")


def _arithmetic():
    """Digest of what the functions that the core calls return for fixed arguments."""
    # a multiplicative hash: products of integers and a power of two are exact everywhere
    whole = (np.arange(1, COUNT + 1, dtype=np.uint64) * np.uint64(2654435761)) % np.uint64(2**32)
    unit = whole.astype(np.float64) / 2.0**32
    other = unit[::-1].copy()
    wide = 20.0 * (unit - 0.5)
    table = unit.reshape(-1, 4, 4)
    results = [
        *(f(wide) for f in (np.sin, np.cos, np.tan, np.arctan, np.exp)),
        *(f(unit) for f in (np.sqrt, np.arcsin, np.arccos, np.log, np.log2)),
        *(f(unit, other) for f in (np.arctan2, np.hypot, np.power)),
        unit.sum(keepdims=True),
        unit.reshape(64, 64).sum(axis=0),
        np.cumsum(unit),
        np.array([row @ row[0] for row in table]),
        np.linalg.norm(table, axis=1),
        np.linalg.eigvals(table).real,
        np.linalg.lstsq(unit.reshape(-1, 4), other[: COUNT // 4], rcond=None)[0],
    ]
    total = hashlib.sha256()
    for result in results:
        total.update(np.ascontiguousarray(result).tobytes())
    return total.hexdigest()
