# SPDX-License-Identifier: GPL-3.0-or-later
"""What pixels show and which lights reach it, in long doubles, with the margin of each answer.

For scenes that stand still. Margins are metres: the least distance by which a ray, a hit or a
segment would have to move for the answer to be another.
"""

import numpy as np

from adaptive_drt.scene.description import Sphere

from .camera import rays
from .numbers import LONG, cross, dot

LONGEST = np.longdouble(np.inf)


class Spots:
    """Pixels' centres: shape (-1 for none), point, unit normal to the viewer, margin, far side."""

    def __init__(self, ids, point, normal, margin, inside):
        self.ids, self.point, self.normal = ids, point, normal
        self.margin, self.inside = margin, inside


def camera_spots(scene):
    """What the centre of each pixel shows, row by row from the bottom: `Spots`."""
    width, height = scene.camera.resolution
    y, x = np.mgrid[0:height, 0:width]
    o, d = rays(scene.camera, x.ravel() + 0.5, y.ravel() + 0.5, np.zeros(x.size))
    o, d = LONG.lift(o.T), LONG.lift(d.T)
    n = x.size
    best, second = np.full(n, LONGEST), np.full(n, LONGEST)
    ids, margin = np.full(n, -1), np.full(n, LONGEST)
    for index, shape in enumerate(scene.shapes):
        depth, sure = (_sphere if isinstance(shape, Sphere) else _quad)(shape, o, d)
        margin = np.minimum(margin, sure)
        closer = depth < best
        second = np.where(closer, best, np.minimum(second, depth))
        ids, best = np.where(closer, index, ids), np.where(closer, depth, best)
    hit = ids >= 0
    point = o + np.where(hit, best, 0) * d
    with np.errstate(invalid="ignore"):
        margin = np.where(hit, np.minimum(margin, second - best), margin)
    normal, inside = _normals(scene, ids, point, d)
    return Spots(ids, point, normal, margin, inside)


def _sphere(shape, o, d):
    to, r = LONG.lift(shape.center)[:, None] - o, LONG.lift(shape.radius)
    foot, miss = dot(to, d), LONG.norm(cross(d, to))
    half = np.sqrt(np.maximum((r - miss) * (r + miss), 0))
    near, far = foot - half, foot + half
    depth = np.where(near > 0, near, np.where(far > 0, far, LONGEST))
    sure = np.minimum(np.abs(near), np.abs(far))  # of the eye from the surface
    sure = np.minimum(np.abs(miss - r), np.where(miss < r, sure, LONGEST))
    return np.where(miss < r, depth, LONGEST), np.where(foot < -r, LONGEST, sure)


def _quad(shape, o, d):
    q, a, b = (LONG.lift(x)[:, None] for x in (shape.corner, shape.edge_u, shape.edge_v))
    n = cross(a, b) + 0 * o
    n = n / LONG.norm(n)
    slope, height = dot(n, d), dot(n, q - o)
    safe = np.where(slope == 0, 1, slope)
    depth = np.where(slope == 0, LONGEST, height / safe)
    place = np.where(np.isfinite(depth), depth, 0) * d + o - q
    inner = LONG.lift(np.full(o.shape[1], np.inf))
    for e, f in ((a, b), (b, a)):
        side = cross(n, e)
        wide = dot(f + 0 * o, side)
        share = dot(place, side) / wide
        inner = np.minimum(inner, np.minimum(share, 1 - share) * np.abs(wide))
    hit = (inner > 0) & (depth > 0) & np.isfinite(depth)
    # a flat ray moves its hit by more than it moves itself
    sure = np.minimum(np.abs(inner) * np.abs(slope), np.where(hit, np.abs(height), LONGEST))
    sure = np.where((depth < 0) & (np.abs(height) > 0), np.maximum(sure, np.abs(height)), sure)
    return np.where(hit, depth, LONGEST), sure


def _normals(scene, ids, point, d):
    normal, inside = np.zeros_like(point), np.zeros(ids.size, dtype=bool)
    for index, shape in enumerate(scene.shapes):
        rows = ids == index
        if isinstance(shape, Sphere):
            out = (point - LONG.lift(shape.center)[:, None])[:, rows]
        else:
            a, b = LONG.lift(shape.edge_u)[:, None], LONG.lift(shape.edge_v)[:, None]
            out = cross(a, b) + 0 * point[:, rows]
        out = out / LONG.norm(out)
        away = dot(out, d[:, rows]) > 0
        normal[:, rows] = np.where(away, -out, out)
        if isinstance(shape, Sphere):
            inside[rows] = away
    return normal, inside


def sheets_in_plane(scene, light):
    """Numbers of the sheets that a quad light lies in the plane of, by float32 coordinates.

    The corners of both lie in one plane if the thinnest direction of them all is no thicker than
    a few steps between neighbouring float32 numbers of their size.
    """
    corners = [
        np.array(light.center) + a * np.array(light.half_u) + b * np.array(light.half_v)
        for a in (-1, 1)
        for b in (-1, 1)
    ]
    found = []
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Sphere):
            continue
        q, u, v = (np.array(x) for x in (shape.corner, shape.edge_u, shape.edge_v))
        all_of = np.array([*corners, q, q + u, q + v, q + u + v])
        thin = np.linalg.svd(all_of - all_of.mean(axis=0))[2][-1]
        heights = all_of @ thin
        if np.ptp(heights) <= STEPS * np.spacing(np.float32(np.abs(all_of).max())):
            found.append(index)
    return found


STEPS = 16
"""Between neighbouring float32 numbers: how far apart what touches may be."""


def gaps(scene, spots, target, skipped=()):
    """How far (metres) spots are from not seeing a point (3, n) of a light: (1 + shapes, n).

    The first row is its height over the spot's horizon, the others say how far shapes are from
    hiding it; where all are positive it is seen. Each changes no faster than the point moves. A
    spot's own shape hides nothing, but for a sphere seen from within; nor do those `skipped`.
    """
    rows = [dot(target - spots.point, spots.normal)]
    for index, shape in enumerate(scene.shapes):
        own = spots.ids == index
        if index in skipped:
            rows.append(np.full_like(rows[0], LONGEST))
        elif isinstance(shape, Sphere):
            gap = _ball_gap(shape, spots.point, target, own)
            rows.append(np.where(own & ~spots.inside, LONGEST, gap))
        else:
            gap = _sheet_gap(shape, spots.point, target)
            rows.append(np.where(own, LONGEST, gap))
    return np.stack(rows)


def _ball_gap(shape, a, b, own):
    """How far the open segment a to b is from cutting a sphere's surface; negative: it does."""
    c, r = LONG.lift(shape.center)[:, None], LONG.lift(shape.radius)
    w = b - a
    share = np.clip(dot(c - a, w) / dot(w, w), 0, 1)
    nearest = LONG.norm(a + share * w - c)
    first, last = LONG.norm(a - c), LONG.norm(b - c)
    first = np.where(own, r, first)
    cuts = np.minimum(r - nearest, np.maximum(first, last) - r)
    # from on the inner side, what counts is where the segment ends
    return np.where(own, r - last, -cuts)


def _sheet_gap(shape, a, b):
    q, u, v = (LONG.lift(x)[:, None] for x in (shape.corner, shape.edge_u, shape.edge_v))
    n = cross(u, v) + 0 * a
    n = n / LONG.norm(n)
    h0, h1 = dot(n, a - q), dot(n, b - q)
    across = np.minimum(np.abs(h0), np.abs(h1))
    same = h0 * h1 >= 0
    drop = np.where(h0 == h1, 1, h0 - h1)
    place = a + h0 / drop * (b - a) - q
    inner = LONG.lift(np.full(a.shape[1], np.inf))
    for e, f in ((u, v), (v, u)):
        side = cross(n, e)
        wide = dot(f + 0 * a, side)
        share = dot(place, side) / wide
        inner = np.minimum(inner, np.minimum(share, 1 - share) * np.abs(wide))
    steep = np.abs(h0 - h1) / LONG.norm(b - a)
    inner = inner * steep
    # past the edge, or on one side: either keeps it clear
    return np.where(same, across, np.where(inner < 0, -inner, -np.minimum(inner, across)))
