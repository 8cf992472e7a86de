# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays of better numbers: long doubles for many, 50 digits of mpmath for few. No core code.

Formulas are written once, over a `Numbers`, and run in either.
"""

from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
from mpmath.ctx_mp import MPContext

DIGITS = 50


@dataclass(frozen=True)
class Numbers:
    """What a formula needs of its numbers, elementwise on arrays."""

    lift: Any
    sqrt: Any
    atan2: Any
    cos: Any
    sin: Any
    pi: Any

    def norm(self, a):
        return self.sqrt(dot(a, a))

    def angle(self, a, b):
        """Angle between vectors (3, n), accurate for all angles."""
        return self.atan2(self.norm(cross(a, b)), dot(a, b))

    def acos(self, c):
        return self.atan2(self.sqrt((1 - c) * (1 + c)), c)


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    rows = [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]
    return np.stack([np.asarray(row) for row in rows])


def _long():
    one = np.longdouble(1)
    return Numbers(
        lambda a: np.asarray(a, dtype=np.longdouble),
        np.sqrt,
        np.arctan2,
        np.cos,
        np.sin,
        4 * np.arctan(one),
    )


def _exact():
    context = MPContext()
    context.dps = DIGITS

    def each(function, arguments=1):
        return np.frompyfunc(function, arguments, 1)

    make = each(lambda x: context.mpf(float(x)))
    return Numbers(
        lambda a: np.asarray(make(np.asarray(a, dtype=np.float64)), dtype=object),
        each(context.sqrt),
        each(context.atan2, 2),
        each(context.cos),
        each(context.sin),
        +context.pi,
    )


LONG = _long()
EXACT = _exact()
assert mpmath.mp.dps == 15, "the context of all others stays as it is"
