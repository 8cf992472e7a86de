# SPDX-License-Identifier: GPL-3.0-or-later
"""What a partly hidden light brings, by quadrature over lines across it. No code of the core.

Every light is a figure in a plane, p(x, y) = corner + x u + y v: a quad is the unit square, a
round light the disk x^2 + y^2 <= 1 in the plane across its axis. In (x, y) everything that bounds
what is seen is a line or a conic, so a line across the light changes at roots of quadratics, and
those lines themselves at roots of quartics (resultants). Between them the integrand is smooth but
for roots at the ends: double exponential quadrature over y, Gauss-Legendre over x, both in the
angle in which the coordinate is seen, so that lights near the point cost no digits.
"""

from itertools import combinations

import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
STEP = 0.15
T = np.arange(-21, 22) * STEP
SINH = np.tanh(np.pi / 2 * np.sinh(T))
SINH_WEIGHTS = STEP * np.pi / 2 * np.cosh(T) / np.cosh(np.pi / 2 * np.sinh(T)) ** 2


class Light:
    """A figure in a plane: corner, u, v (3,), and whether it is a disk (else the unit square)."""

    def __init__(self, corner, u, v, disk):
        self.corner, self.u, self.v, self.disk = corner, u, v, disk

    def at(self, x, y):
        return self.corner + x[..., None] * self.u + y[..., None] * self.v

    def plane(self, m):
        """The line where m.p = 0: coefficients of 1, x, y, x^2, x y, y^2."""
        return np.array([m @ self.corner, m @ self.u, m @ self.v, 0.0, 0.0, 0.0])

    def ball(self, c, r):
        """The conic of rays tangent to a sphere: r^2 p^2 - |p x c|^2 = 0."""
        q, u, v = self.corner, self.u, self.v

        def form(a, b):
            return r * r * (a @ b) - np.cross(a, c) @ np.cross(b, c)

        terms = form(q, q), 2 * form(q, u), 2 * form(q, v), form(u, u), 2 * form(u, v), form(v, v)
        return np.array(terms)


def quad_light(corners):
    return Light(corners[0], corners[1] - corners[0], corners[3] - corners[0], disk=False)


def round_light(axis, half_angle):
    k = np.eye(3)[np.argmin(np.abs(axis))]
    u = np.cross(axis, k)
    u /= np.linalg.norm(u)
    size = np.tan(half_angle)
    return Light(axis, size * u, size * np.cross(axis, u), disk=True)


def visible(light, normal, spheres=(), quads=()):
    """Integral of max(0, n.w) over what is seen: spheres (centre, radius), polygons (k, 3)."""
    rows = [light.plane(normal)] + [light.ball(c, r) for c, r in spheres]
    for q in quads:
        count = len(q)
        rows += [light.plane(np.cross(q[i], q[(i + 1) % count] - q[i])) for i in range(count)]
    one = np.eye(6)
    if light.disk:
        rows.append(one[0] - one[3] - one[5])
        ends = (-1.0, 1.0)
    else:
        rows += [one[1], one[0] - one[1]]
        ends = (0.0, 1.0)
    events = event_lines(rows, *ends)
    # y = foot + depth tan(angle), about the line of the light that is nearest to the point
    area = np.cross(light.u, light.v)
    across = np.cross(area, light.u)
    foot = -(light.corner @ across) / (light.v @ across)
    height = abs(light.corner @ area) / np.linalg.norm(area)
    depth = height * np.linalg.norm(across) / abs(light.v @ across)
    angle = np.arctan((events - foot) / depth)
    angle = np.concatenate([angle, np.linspace(angle[0], angle[-1], 9)[1:-1]])
    angle.sort()  # short pieces: no digits are lost to poles nearby
    low, high = angle[:-1, None], angle[1:, None]
    angle = (0.5 * (low + high) + 0.5 * (high - low) * SINH).ravel()
    y = np.clip(foot + depth * np.tan(angle), *ends)
    weight = (0.5 * (high - low) * SINH_WEIGHTS).ravel() * depth / np.cos(angle) ** 2
    return float(weight @ strips(light, normal, spheres, quads, rows, y))


def event_lines(rows, low, high):
    """Every y where a line across the light may meet something new."""
    found = []
    for a in rows:
        a2, a1, a0 = split(a)
        found += [np.polysub(np.polymul(a1, a1), 4 * a2 * a0)] if a2 else [a0]
    for a, b in combinations(rows, 2):
        (a2, a1, a0), (b2, b1, b0) = split(a), split(b)
        cross = np.polysub(np.polymul(a1, b0), np.polymul(b1, a0))
        if a2 or b2:
            first = np.polysub(a2 * b0, b2 * a0)
            second = np.polymul(np.polysub(a2 * b1, b2 * a1), cross)
            cross = np.polysub(np.polymul(first, first), second)
        found.append(cross)
    ys = [low, high]
    for p in found:
        size = np.abs(p).max()
        if size > 0:
            roots = np.roots(np.where(np.abs(p) > 1e-15 * size, p, 0.0))
            ys += [z.real for z in roots if abs(z.imag) < 1e-5 and low < z.real < high]
    ys = np.unique(ys)
    return ys[np.concatenate([[True], np.diff(ys) > 1e-13])]


def split(row):
    """A conic as a quadratic in x whose coefficients are polynomials in y, highest first."""
    return row[3], np.array([row[4], row[1]]), np.array([row[5], row[2], row[0]])


def strips(light, normal, spheres, quads, rows, y):
    """Integrals over x along lines y (k,)."""
    low, high = (-np.ones_like(y), np.ones_like(y)) if light.disk else (0 * y, 0 * y + 1)
    if light.disk:
        high = np.sqrt((1 - y) * (1 + y))
        low = -high
    cuts = [low, high]
    for row in rows:
        a, b, c = row[3] + 0 * y, row[1] + row[4] * y, row[0] + (row[2] + row[5] * y) * y
        with np.errstate(all="ignore"):
            q = -0.5 * (b + np.copysign(np.sqrt(np.maximum(b * b - 4 * a * c, 0)), b))
            cuts += [c / q, q / a] if row[3] else [-c / b]
    cuts = np.sort(np.clip(np.nan_to_num(np.stack(cuts)), low, high), axis=0)
    middle = light.at(0.5 * (cuts[1:] + cuts[:-1]), y)
    seen = ~hidden(middle, spheres, quads) & (middle @ normal > 0)
    span, line = np.nonzero(seen & (cuts[1:] > cuts[:-1]))
    x0, x1 = cuts[span, line][:, None], cuts[span + 1, line][:, None]
    start, u = light.at(0 * y, y)[line][:, None], light.u
    foot = -(start @ u) / (u @ u)
    depth = np.linalg.norm(start[:, 0] + foot * u, axis=-1)[:, None] / np.linalg.norm(u)
    low, high = np.arctan((x0 - foot) / depth), np.arctan((x1 - foot) / depth)
    angle = 0.5 * (low + high) + 0.5 * (high - low) * NODES
    p = start + (foot + depth * np.tan(angle))[..., None] * u
    value = np.maximum(p @ normal, 0) * np.abs(p @ np.cross(u, light.v))
    value *= depth / np.cos(angle) ** 2 / np.sum(p * p, axis=-1) ** 2
    return np.bincount(line, (0.5 * (high - low) * value) @ WEIGHTS, minlength=y.size)


def hidden(p, spheres, quads):
    """Whether rays along p (..., 3) meet an occluder."""
    blocked = np.zeros(p.shape[:-1], dtype=bool)
    w = p / np.linalg.norm(p, axis=-1, keepdims=True)
    for c, r in spheres:
        along = w @ c
        miss = c - along[..., None] * w
        blocked |= (along > 0) & (np.sum(miss * miss, axis=-1) <= r * r)
    for q in quads:
        side = np.cross(q[1] - q[0], q[-1] - q[0])
        if abs(side @ q[0]) <= 1e-14 * np.linalg.norm(side) * np.linalg.norm(q[0]):
            continue  # seen edge-on
        # w t = q0 + a (q1 - q0) + b (q3 - q0), q3 the last corner
        inverse = np.linalg.pinv(np.stack([q[1] - q[0], q[-1] - q[0], q[0]]).T)
        a, b, t = np.moveaxis(w @ inverse.T, -1, 0)
        # w = a' e1 + b' e2 + t q0, so the hit is at 1 / t
        within = np.maximum(a, b) <= t if len(q) == 4 else a + b <= t
        blocked |= (t > 0) & (a >= 0) & (b >= 0) & within
    return blocked
