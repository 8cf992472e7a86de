# SPDX-License-Identifier: GPL-3.0-or-later
"""Events along lines at which two objects may exchange their depth order.

The rules by pair of surfaces are in `geometry.depth_pairs`. The depth of a solid is discontinuous
where the camera enters it, which is an event too.
"""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

from ..geometry.depth_pairs import DepthPair, depth_pair
from ..numerics.arrays import Array, Ints
from ..numerics.axes import TIME
from ..numerics.gather import columns
from ..numerics.line_lattice import Lattice
from ..numerics.line_roots import NO_ROOT, quadratic_roots
from .polynomials import CandidatePolynomials
from .unordered_pairs import GroupPairs

__all__ = ["find_depth_events", "split_by_candidate"]


QUADRATIC = 2
"""Greatest degree of events along t that are found on many lines."""


def find_depth_events(
    table: Array, forms: CandidatePolynomials, unordered: GroupPairs, lattice: Lattice
) -> Array:
    """Events (events, rows, columns, n) along lines; between them depth orders do not change.

    Parameters
    ----------
    table : (11 or 19, rows, columns, k n) of k candidates by item, the first candidates of all
        boxes first, from `line_intervals.depth_coefficients`.
    forms : the k n candidates.
    unordered : the pairs of candidates whose depth order is not known.

    Pairs whose events along t are of higher degree than two are left out along t unless there is a
    single line: choose another axis where such objects may intersect.
    """
    n, timed = unordered.boxes, lattice.axis == TIME
    parts = [*quadratic_roots(*table[8:11])] if timed else []
    one, other = (
        each * n + unordered.box for each in (unordered.first_candidate, unordered.second_candidate)
    )
    kinds = _pairs_by_surface(forms, one, other)
    if timed and lattice.rows * lattice.columns > 1:
        kinds = [kind for kind in kinds if kind[0].degree_in_time <= QUADRATIC]
    # each pair has room for the same number of events, whichever its surfaces: boxes stay alike;
    # without pairs, where the order is not known because of a cycle, the rooms are empty
    degrees = [rule.degree_in_time if timed else rule.degree for rule, *_ in kinds]
    size = max(degrees, default=1), *table.shape[1:3], unordered.capacity * n
    events = np.full(size, NO_ROOT)
    for rule, some, first, second in kinds:
        a, b = columns(table, first, -1), columns(table, second, -1)
        place = unordered.slot[some] * n + unordered.box[some]
        for event, root in zip(events, rule.find(a, b, timed), strict=False):
            event[..., place] = root
    return np.concatenate([split_by_candidate(part, n) for part in (*parts, *events)])


def _pairs_by_surface(
    forms: CandidatePolynomials, one: Ints, other: Ints
) -> list[tuple[DepthPair, Ints, Ints, Ints]]:
    """Split pairs of candidates (p,) by their surfaces, without those of which there is no pair.

    Returns the rule, the rows among the pairs, and the candidates of each pair in the rule's order.
    """
    present = sorted({group.surface for group in forms.groups if group.rows.size})
    if not one.size:
        return []
    if len(present) == 1:
        return [(depth_pair(present[0], present[0]), np.arange(one.size), one, other)]
    surface = forms.surface
    a, b = surface[one], surface[other]
    found = []
    for first, second in combinations_with_replacement(present, 2):
        some = ((a == first) & (b == second)).nonzero()[0]
        swapped = ((b == first) & (a == second)).nonzero()[0] if first != second else some[:0]
        if some.size + swapped.size:
            pairs = np.concatenate([some, swapped])
            firsts = np.concatenate([one[some], other[swapped]])
            seconds = np.concatenate([other[some], one[swapped]])
            found.append((depth_pair(first, second), pairs, firsts, seconds))
    return found


def split_by_candidate(values: Array, n: int) -> Array:
    """Reshape (rows, columns, k n), the first candidates of all boxes first, to (k, rows, columns,
    n)."""
    return values.reshape(*values.shape[:2], -1, n).transpose(2, 0, 1, 3)
