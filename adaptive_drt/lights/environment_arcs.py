# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of an environment map over regions of directions, by quadrature along their boundary.

The boundary integral of `environment_map`, of the form G dpsi with G = (S cos psi, S sin psi, C),
is singular at the nadir. With a = -z there, q = -n (which no region above the horizon holds), the
forms eta_p = p.(w x dw) / (1 - p.w) and T the integral of L w over all directions, the integral of
L w over a region, whether or not it holds a pole, is the sum along its boundary of

    G dpsi + T / (4 pi) (eta_a - eta_q)              where w is nearer to the zenith,
    (G - K) dpsi + dA + T / (4 pi) (eta_z - eta_q)   where w is nearer to the nadir,

since (eta_p - eta_q) / 2 is closed and winds by 2 pi about p, and dpsi = (eta_z - eta_a) / 2. K is
G at the nadir and A the periodic part of its integral over psi. Each term is bounded where it is
used: the arcs are cut so that none comes near both poles.

The integrand is exact, so that the only error is that of the quadrature: by Gauss-Kronrod pairs of
7 and 15 nodes (Piessens and others 1983, QUADPACK) on pieces of arcs, which are halved while their
difference is more than allowed. Rules of 3 and 7 nodes are tried first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.boundary_arcs import BoundaryArcs
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from .environment_map import EnvironmentMap

__all__ = ["LONGEST_ARC", "integrate_over_arcs", "uniform_factor"]


@dataclass(frozen=True)
class _Rule:
    """A Kronrod rule and the Gauss rule within it, for the interval from -1 to 1.

    Attributes
    ----------
    nodes : (q, 1).  fine, rough : (q, 1) weights of both; those of the latter are 0 at new nodes.
    """

    nodes: Array
    fine: Array
    rough: Array

    @classmethod
    def make(cls, nodes: list[float], fine: list[float], rough: list[float]) -> _Rule:
        """Return the rule, given what holds at its nodes from 1 to 0."""
        x, k, g = np.array(nodes), np.array(fine), np.array(rough)
        return cls(*(np.concatenate([a, b[-2::-1]])[:, None] for a, b in ((-x, x), (k, k), (g, g))))


ROUGH_RULE = _Rule.make(
    [0.960491268708020283, 0.774596669241483377, 0.434243749346802558, 0.0],
    [0.104656226026467265, 0.268488089868333441, 0.401397414775962223, 0.450916538658474142],
    [0.0, 5.0 / 9.0, 0.0, 8.0 / 9.0],
)
"""Rule of 7 and 3 nodes, which is tried first."""
FINE_RULE = _Rule.make(
    [
        0.991455371120812639, 0.949107912342758525, 0.864864423359769073, 0.741531185599394440,
        0.586087235467691130, 0.405845151377397167, 0.207784955007898468, 0.0,
    ],
    [
        0.022935322010529225, 0.063092092629978553, 0.104790010322250184, 0.140653259715525919,
        0.169004726639267903, 0.190350578064785410, 0.204432940075298892, 0.209482141084727828,
    ],
    [
        0.0, 0.129484966168869693, 0.0, 0.279705391489276668,
        0.0, 0.381830050505118945, 0.0, 0.417959183673469388,
    ],
)  # fmt: skip
"""Rule of 15 and 7 nodes, for pieces for which that is too rough."""

LONGEST_TURN, LONGEST_ARC = 3.2, 1.2
"""Largest angle about its circle, and largest length on the unit sphere, of the first pieces of
arcs, in radians. Pieces of that length come near one pole at most."""
LAST_HALVING = 14
"""Number of halvings of a piece after which its error is left as it is."""
NODES_AT_A_TIME = 1 << 16
"""Number of nodes evaluated at a time, which bounds memory."""
ERROR_MARGIN = 2.0
"""Factor on the root of the sum of the squared differences between both rules of all pieces.
Measured: see `tests/lights/test_environment.py`."""
INHERITED_ERROR = 1.0 / 32.0
"""Least error of a piece, as a fraction of that of the one it was halved from. At a texel's edge,
where the slope of the integrand jumps, errors fall by 4 on average, but differ by chance."""
ROUNDING = 2.0**-44
"""Least error that is asked for, relative to the largest radiance times a radian."""


def integrate_over_arcs(
    environment: EnvironmentMap,
    normal: Array,
    arcs: BoundaryArcs,
    allowed: Array,
    longest: float = LONGEST_ARC,
) -> tuple[Array, Array]:
    """Integrals of L n.w over regions above the horizon, and estimates of their errors.

    Parameters
    ----------
    normal : (3, n) unit vectors in the tracer's axes.
    arcs : boundaries of the regions that n points see.
    allowed : (n,) errors up to which pieces are not halved.
    longest : length of the first pieces, in radians: narrow bright parts of the map need less.

    Returns
    -------
    value (k, n) for each channel, error (n,) the largest of the channels. Both are independent of
    the rest of the batch to the last bit.
    """
    n = environment.turned(normal)
    count, k = normal.shape[1], environment.channel_count
    # the integrals, and the squares of their errors
    sums = np.zeros((k + 1, count))
    least = ROUNDING * float(np.abs(environment.values).max(initial=0.0))
    if not arcs.low.size or least == 0.0:
        return sums[:k], sums[k]
    # the pieces' errors have random signs: their squares add up
    most = (np.maximum(allowed, least) / ERROR_MARGIN) ** 2
    origin, first, second = (environment.turned(v) for v in (arcs.origin, arcs.first, arcs.second))
    pieces = _first_pieces(replace(arcs, origin=origin, first=first, second=second), longest)
    before = np.zeros(0)
    for halving in range(LAST_HALVING + 1):
        rule = FINE_RULE if halving else ROUGH_RULE
        part, off = _integrate_pieces(environment, n, pieces, rule)
        if halving > 1:
            off = np.maximum(off, INHERITED_ERROR * before)
        square = off * off
        wrong = _unsettled(square, pieces.point, most - sums[k])
        if halving == LAST_HALVING:
            wrong[:] = False
        _add(sums, pieces.point, np.vstack([part, square]), ~wrong)
        rows = wrong.nonzero()[0]
        if not rows.size:
            break
        # the better rule first, then halves
        pieces = _split(pieces, rows, np.full(rows.size, 2)) if halving else pieces.take(rows)
        before = np.repeat(off[rows], 2)
    return sums[:k], ERROR_MARGIN * np.sqrt(sums[k])


def _add(sums: Array, point: Ints, parts: Array, chosen: Mask) -> None:
    """Add some of the rows of `parts` (j, m) to those of the sums (j, n) of their points."""
    for row, part in zip(sums, parts, strict=True):
        row += np.bincount(point[chosen], weights=part[chosen], minlength=row.size)


def uniform_factor(normal: Array, arcs: BoundaryArcs) -> Array:
    """Integrals (n,) of n.w alone over regions, in closed form: half of n.(w x dw) along the arcs.

    Parameters as for `integrate_over_arcs`.
    """
    n = columns(normal, arcs.point)
    across = cross(arcs.origin, arcs.first), cross(arcs.origin, arcs.second)
    value = dot(n, cross(arcs.first, arcs.second)) * (arcs.high - arcs.low)
    value += dot(n, across[0]) * (np.cos(arcs.high) - np.cos(arcs.low))
    value += dot(n, across[1]) * (np.sin(arcs.high) - np.sin(arcs.low))
    total: Array = 0.5 * np.bincount(
        arcs.point, weights=arcs.sign * value, minlength=normal.shape[1]
    )
    return total


def _unsettled(square: Array, point: Ints, room: Array) -> Mask:
    """Which pieces (m,) with squared errors `square` are too many for the room (n,) of a point."""
    total = np.bincount(point, weights=square, minlength=room.size)
    number = np.maximum(np.bincount(point, minlength=room.size), 1)
    # those that are left share what is allowed
    share = 0.25 * (np.maximum(room, 0.0) / number)[point]
    wrong: Mask = (total > room)[point] & (square > share)
    return wrong


def _first_pieces(arcs: BoundaryArcs, longest: float) -> BoundaryArcs:
    """Return the arcs cut into pieces that are short enough."""
    turn = arcs.high - arcs.low
    number = np.maximum(np.ceil(turn / LONGEST_TURN), np.ceil(turn * arcs.radius / longest))
    return _split(arcs, np.arange(turn.size), np.maximum(number, 1.0).astype(np.int64))


def _split(arcs: BoundaryArcs, rows: Ints, number: Ints) -> BoundaryArcs:
    """Return some of the arcs, each cut into a number of equal pieces."""
    index = np.repeat(rows, number)
    first = np.repeat(np.cumsum(number) - number, number)
    place, parts = np.arange(index.size) - first, np.repeat(number, number)
    pieces = arcs.take(index)
    low, step = pieces.low, (pieces.high - pieces.low) / parts
    # pieces that meet have the same end to the last bit
    ends = np.where(place + 1 == parts, pieces.high, low + (place + 1) * step)
    return replace(pieces, low=low + place * step, high=ends)


def _integrate_pieces(
    environment: EnvironmentMap, normal: Array, pieces: BoundaryArcs, rule: _Rule
) -> tuple[Array, Array]:
    """Integrals (k, m) along pieces, and their errors (m,), by Gauss-Kronrod pairs."""
    count = pieces.low.size
    value, error = np.zeros((environment.channel_count, count)), np.zeros(count)
    step = max(1, NODES_AT_A_TIME // rule.nodes.size)
    for first in range(0, count, step):
        rows = np.arange(first, min(first + step, count))
        value[:, rows], error[rows] = _integrate_some(environment, normal, pieces.take(rows), rule)
    return value, error


def _integrate_some(
    environment: EnvironmentMap, normal: Array, pieces: BoundaryArcs, rule: _Rule
) -> tuple[Array, Array]:
    """`_integrate_pieces` of few pieces."""
    m, k = pieces.low.size, environment.channel_count
    middle, half = 0.5 * (pieces.low + pieces.high), 0.5 * (pieces.high - pieces.low)
    n = columns(normal, pieces.point)
    phi = (middle + half * rule.nodes).ravel()
    nodes = _Nodes(pieces, n, phi, rule.nodes.size)
    # where a piece is nearer to the nadir
    south = pieces.origin[2] + pieces.first[2] * np.cos(middle) + pieces.second[2] * np.sin(middle)
    south = south < 0.0
    integrand = nodes.integrand(environment, np.tile(south, rule.nodes.size))
    grid = integrand.reshape(k, rule.nodes.size, m)
    fine: Array = (grid * rule.fine).sum(axis=1) * half
    rough: Array = (grid * rule.rough).sum(axis=1) * half
    error = np.abs(fine - rough).max(axis=0)
    rows = south.nonzero()[0]
    if rows.size:
        fine[:, rows] += _nadir_changes(environment, pieces.take(rows), columns(n, rows))
    return pieces.sign * fine, error


class _Nodes:
    """Nodes of a rule of `size` points on m pieces: directions, and what changes along the arcs."""

    def __init__(self, pieces: BoundaryArcs, normal: Array, phi: Array, size: int) -> None:
        c, s = np.cos(phi), np.sin(phi)
        origin, first, second = (
            np.tile(v, (1, size)) for v in (pieces.origin, pieces.first, pieces.second)
        )
        self.way = origin + c * first + s * second
        along = c * second - s * first
        self.turn = cross(self.way, along)
        self.normal = np.tile(normal, (1, size))

    def integrand(self, environment: EnvironmentMap, south: Array) -> Array:
        """Integrand (k, m size) of the boundary integral, but for the changes of A."""
        (x, y, z), n = self.way, self.normal
        turn = self.turn[2]
        square = np.maximum(x * x + y * y, TINY)
        aside = np.sqrt(square)
        theta, psi = np.arctan2(aside, z), np.arctan2(y, x)
        sine, height = environment.antiderivatives(theta, psi)
        rows = south.nonzero()[0]
        if rows.size:
            last = environment.nadir_antiderivatives(psi[rows])
            sine[:, rows] -= last[0]
            height[:, rows] -= last[1]
        level = (n[0] * x + n[1] * y) / aside
        value: Array = (sine * level + height * n[2]) * (turn / square)
        # eta of the pole that is not near, less that of -n
        side = np.where(south, -1.0, 1.0)
        pole = -side * turn / (1.0 + side * z)
        winding = pole + dot(n, self.turn) / (1.0 + dot(n, self.way))
        total = environment.total.T / (4.0 * np.pi)
        for channel, (a, b, c) in enumerate(total):
            value[channel] += (a * n[0] + b * n[1] + c * n[2]) * winding
        return value


def _nadir_changes(environment: EnvironmentMap, pieces: BoundaryArcs, normal: Array) -> Array:
    """Changes (k, m) of n.A from the beginnings of pieces to their ends."""
    ends = []
    for phi in (pieces.low, pieces.high):
        x, y, _ = pieces.origin + np.cos(phi) * pieces.first + np.sin(phi) * pieces.second
        a, b, c = environment.nadir_integrals(np.arctan2(y, x))
        ends.append(normal[0] * a + normal[1] * b + normal[2] * c)
    change: Array = ends[1] - ends[0]
    return change
