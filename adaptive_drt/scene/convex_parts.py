# SPDX-License-Identifier: GPL-3.0-or-later
"""Decomposition of flat parts of meshes into convex polygons.

Triangles of one plane that share an edge are joined as long as what they make is convex (Hertel and
Mehlhorn 1983: there are at most four times as many parts as there have to be).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints
from .planar_facets import ANGLE_TOLERANCE
from .values import convexity_defect

__all__ = ["ConvexPart", "convex_parts"]

Loop = list[int]
"""Numbers of a polygon's points, in order."""


@dataclass(frozen=True)
class ConvexPart:
    """A convex planar polygon of several triangles.

    Attributes
    ----------
    corners : (k, 3), in order.  members : (m,) int64, the triangles that it consists of.
    """

    corners: Array
    members: Ints


def convex_parts(vertices: Array, group: Ints) -> list[ConvexPart]:
    """Return the convex polygons that triangles make up, in the order of their first triangles.

    Parameters
    ----------
    vertices : (3, 3, t), the number of the vertex, then its components; triangles that touch have
        the very same ones.
    group : (t,) int64; only triangles of the same group are joined.
    """
    places, number = np.unique(
        vertices.transpose(0, 2, 1).reshape(-1, 3), axis=0, return_inverse=True
    )
    loops = [list(loop) for loop in number.reshape(3, -1).T.tolist()]
    a, b, c = vertices
    normal = np.cross(b - a, c - a, axis=0)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=0), np.finfo(np.float64).tiny)
    owner = list(range(len(loops)))
    for one, other in _neighbours(loops):
        if group[one] != group[other]:
            continue
        turn = float(np.linalg.norm(np.cross(normal[:, one], normal[:, other])))
        first, second = owner[one], owner[other]
        if first == second or turn > ANGLE_TOLERANCE:
            continue
        joined = _joined(loops[first], loops[second])
        if joined is None or convexity_defect(places[joined]):
            continue
        kept, gone = min(first, second), max(first, second)
        loops[kept], loops[gone] = joined, []
        owner = [kept if each == gone else each for each in owner]
    owners = np.array(owner, dtype=np.int64)
    parts = np.unique(owners).tolist()
    return [ConvexPart(places[loops[k]], (owners == k).nonzero()[0]) for k in parts]


def _neighbours(loops: list[Loop]) -> list[tuple[int, int]]:
    """Pairs of triangles that share an edge which no third one has."""
    users: dict[tuple[int, int], list[int]] = {}
    for k, loop in enumerate(loops):
        for start, end in zip(loop, loop[1:] + loop[:1], strict=True):
            users.setdefault((min(start, end), max(start, end)), []).append(k)
    return [(pair[0], pair[1]) for pair in users.values() if len(pair) == 2]


def _joined(one: Loop, other: Loop) -> Loop | None:
    """The outline of two polygons that have one run of edges in common, or None.

    Those whose outlines run against each other are turned to the same sense first.
    """
    for second in (other, other[::-1]):
        edges = {(end, start) for start, end in zip(second, second[1:] + second[:1], strict=True)}
        shared = [edge in edges for edge in zip(one, one[1:] + one[:1], strict=True)]
        runs = sum(
            now and not before
            for now, before in zip(shared, shared[-1:] + shared[:-1], strict=True)
        )
        if runs != 1:
            continue
        # the rest of the first polygon, from the end of the run to its start, then of the second
        last = next(k for k, now in enumerate(shared) if now and not shared[(k + 1) % len(one)])
        count = len(one) - sum(shared)
        rest = [one[(last + 1 + k) % len(one)] for k in range(count + 1)]
        begin, stop = second.index(rest[-1]), second.index(rest[0])
        around = [second[(begin + k) % len(second)] for k in range((stop - begin) % len(second))]
        return (
            rest[:-1] + around
            if len(set(rest[:-1] + around)) == len(rest) - 1 + len(around)
            else None
        )
    return None
