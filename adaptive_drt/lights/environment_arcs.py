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
7 and 15 nodes (Piessens and others 1983, QUADPACK) on pieces of arcs, which are cut in two while
they show an error of more than is allowed. Rules of 3 and 7 nodes are tried first.

At the meridians between columns of texels the slope of the integrand jumps. Three things serve
that. Pieces are cut there, if they are cut. Where the difference of a pair happens to be small, an
odd null rule (Berntsen and Espelid 1991) hardly ever is small too. And what the slope changes
between an outermost node and the end, which no rule sees, is added in closed form.
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
    nodes : (q, 1).  fine, rough : (q // 2 + 1, 1) weights of both for sums over opposite nodes, the
        last for twice what the middle one has; those of the latter are 0 at new nodes.
    odd : (q // 2, 1) weights for differences between opposite nodes, by which polynomials of a
        degree below q - 2 are 0. Their norm over all nodes is that of `fine` less `rough`.
    """

    nodes: Array
    fine: Array
    rough: Array
    odd: Array

    @classmethod
    def make(cls, nodes: list[float], fine: list[float], rough: list[float]) -> _Rule:
        """Return the rule, given what holds at its nodes from 1 to 0."""
        x, k, g = np.array(nodes), np.array(fine), np.array(rough)
        # the only weights that are orthogonal to all lower odd powers of the nodes
        _, _, rows = np.linalg.svd(x[:-1] ** (2 * np.arange(x.size - 2)[:, None] + 1))
        off = k - g
        odd = rows[-1] * np.sqrt((off[:-1] ** 2).sum() + 0.5 * off[-1] ** 2)
        for weights in (k, g):
            weights[-1] *= 0.5
        return cls(*(v[:, None] for v in (np.concatenate([-x, x[-2::-1]]), k, g, odd)))


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
ERROR_MARGIN = 2.0**0.5
"""Factor on the root of the sum of the squared errors that all pieces show.
Measured: see `tests/lights/test_environment_arcs.py`."""
INHERITED_ERROR = 1.0 / 32.0
"""Least error of a piece, as a fraction of that of the one it was cut from. At a texel's edge,
where the slope of the integrand jumps, errors fall by 4 on average, but differ by chance."""
SHORTEST_PART = 1.0 / 256.0
"""Shortest part, as a fraction of a piece, that is cut off at the edge of a texel: about as much as
lies beyond the outermost node, where nothing is seen of the edge."""
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
            off = np.maximum(off, before)
        square = off * off
        wrong = _unsettled(square, pieces.point, most - sums[k])
        wrong &= halving < LAST_HALVING
        _add(sums, pieces.point, np.vstack([part, square]), ~wrong)
        rows = wrong.nonzero()[0]
        if not rows.size:
            break
        pieces, before = pieces.take(rows), off[rows]
        if halving:  # the better rule first, then parts
            pieces = _cut(environment, pieces)
            before = np.tile(INHERITED_ERROR * before, 2)
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


def _cut(environment: EnvironmentMap, arcs: BoundaryArcs) -> BoundaryArcs:
    """Return arcs (m,) cut in two, all first parts before all second ones (2 m,).

    Arcs are cut at the edge between columns of texels that is next to their middle, or in the
    middle if that edge is at an end or beyond it.
    """
    middle = 0.5 * (arcs.low + arcs.high)
    c, s = np.cos(middle), np.sin(middle)
    ways = zip(arcs.origin[:2], arcs.first[:2], arcs.second[:2], strict=True)
    x, y = (o + c * a + s * b for o, a, b in ways)
    width = 2.0 * np.pi / environment.column_count
    edge = width * np.round(np.arctan2(y, x) / width)
    # the circle meets the plane of that meridian, if it does, twice
    c, s = np.cos(edge), np.sin(edge)
    o, a, b = (c * v[1] - s * v[0] for v in (arcs.origin, arcs.first, arcs.second))
    size = np.maximum(np.hypot(a, b), TINY)
    half = np.arccos(np.clip(-o / size, -1.0, 1.0))
    turn = np.arctan2(b, a) - middle
    one, two = (d - 2.0 * np.pi * np.round(d / (2.0 * np.pi)) for d in (turn - half, turn + half))
    aside = np.where(np.abs(one) < np.abs(two), one, two)
    within = np.abs(aside) < (0.5 - SHORTEST_PART) * (arcs.high - arcs.low)
    cut = middle + np.where(within, aside, 0.0)
    return BoundaryArcs.join([replace(arcs, high=cut), replace(arcs, low=cut)])


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
    grid, h = integrand.reshape(k, rule.nodes.size, m), rule.nodes.size // 2
    even, odd = grid[:, : h + 1] + grid[:, : h - 1 : -1], grid[:, :h] - grid[:, :h:-1]
    fine: Array = (even * rule.fine).sum(axis=1) * half
    rough: Array = (even[:, 1::2] * rule.rough[1::2]).sum(axis=1) * half
    odd = (odd * rule.odd).sum(axis=1) * half
    off = fine - rough
    error: Array = np.sqrt((off * off + odd * odd).max(axis=0))
    gap = (1.0 - rule.nodes[-1]) * half
    for node, side in ((0, -1.0), (rule.nodes.size - 1, 1.0)):
        nodes.add_beyond(fine, environment, node, side * gap, south)
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
        x, y, z = self.way
        square = np.maximum(x * x + y * y, TINY)
        aside = np.sqrt(square)
        self.theta, self.psi = np.arctan2(aside, z), np.arctan2(y, x)
        # of the longitude along the arc, and n.w of the point on the equator
        self.rate = self.turn[2] / square
        self.level = (self.normal[0] * x + self.normal[1] * y) / aside

    def integrand(self, environment: EnvironmentMap, south: Array) -> Array:
        """Integrand (k, m size) of the boundary integral, but for the changes of A."""
        z, n, psi = self.way[2], self.normal, self.psi
        sine, height = environment.antiderivatives(self.theta, psi)
        rows = south.nonzero()[0]
        if rows.size:
            last = environment.nadir_antiderivatives(psi[rows])
            sine[:, rows] -= last[0]
            height[:, rows] -= last[1]
        value: Array = (sine * self.level + height * n[2]) * self.rate
        # eta of the pole that is not near, less that of -n
        side = np.where(south, -1.0, 1.0)
        pole = -side * self.turn[2] / (1.0 + side * z)
        winding = pole + dot(n, self.turn) / (1.0 + dot(n, self.way))
        total = environment.total.T / (4.0 * np.pi)
        for channel, (a, b, c) in enumerate(total):
            value[channel] += (a * n[0] + b * n[1] + c * n[2]) * winding
        return value

    def add_beyond(
        self, value: Array, environment: EnvironmentMap, node: int, gap: Array, south: Mask
    ) -> None:
        """Add to integrals (k, m), in place, what the integrand's change of slope at an edge of
        texels makes between a node and the end that is next to it, if one edge is there.

        node : its number.  gap : (m,) radians from the node to the end, below 0 at the beginning.
        south : (m,) whether the pieces are nearer to the nadir.
        """
        at = slice(node * gap.size, (node + 1) * gap.size)
        scale = environment.column_count / (2.0 * np.pi)
        place, move = self.psi[at] * scale, self.rate[at] * gap * scale
        edge = np.floor(place) + (move > 0.0)
        before, move = np.abs(edge - place), np.abs(move)
        rows = ((before < move) & (move < 1.0)).nonzero()[0]
        if not rows.size:
            return
        theta, low = self.theta[at][rows], south[rows]
        jumps = environment.slope_changes(theta, edge[rows].astype(np.int64), low)
        rest = gap[rows] * (1.0 - before[rows] / move[rows])
        rate, level, up = (v[at][rows] for v in (self.rate, self.level, self.normal[2]))
        slope = (jumps[0] * level + jumps[1] * up) * (rate * np.abs(rate))
        value[:, rows] += 0.5 * rest * rest * slope


def _nadir_changes(environment: EnvironmentMap, pieces: BoundaryArcs, normal: Array) -> Array:
    """Changes (k, m) of n.A from the beginnings of pieces to their ends."""
    ends = []
    for phi in (pieces.low, pieces.high):
        x, y, _ = pieces.origin + np.cos(phi) * pieces.first + np.sin(phi) * pieces.second
        a, b, c = environment.nadir_integrals(np.arctan2(y, x))
        ends.append(normal[0] * a + normal[1] * b + normal[2] * c)
    change: Array = ends[1] - ends[0]
    return change
