# SPDX-License-Identifier: GPL-3.0-or-later
"""Families of elliptic cones: which parts of boundaries lie inside other cones."""

import numpy as np

from adaptive_drt.geometry.crossing_cones import cones_inside_each_other
from adaptive_drt.geometry.elliptic_cones import EllipticCones
from kernel_families import Family, U, across, spread, unit
from oracle.numbers import cross, dot


def random_cone(rng, z, low, high, thinnest):
    """A cone (m,) about unit vectors, its half tangent a from 10^low to 10^high."""
    x = across(rng, z)
    a = spread(rng, low, high, z.shape[1])
    b = a * np.where(rng.random(a.size) < 0.1, 1.0, spread(rng, thinnest, 0.0, a.size))
    return {"x": x, "y": cross(z, x), "z": z, "a": a, "b": b}


def _pairs(rng, n):
    """Two cones near each other, in units of the first one's size, and an angle on its boundary."""
    z = unit(rng, n)
    one = random_cone(rng, z, -4.0, 2.0, -3.0)
    aside = np.minimum(one["a"], 1.0) * rng.uniform(0.0, 2.0, n)
    way = z + aside * across(rng, z)
    way /= np.sqrt(dot(way, way))
    other = random_cone(rng, way, -1.0, 1.0, -3.0)
    scale = np.minimum(one["a"], 10.0)
    other["a"], other["b"] = other["a"] * scale, other["b"] * scale
    inputs = {f"{name}{k}": value for k, c in enumerate((one, other)) for name, value in c.items()}
    phi = rng.uniform(-np.pi, np.pi, n)
    # half of the angles as near to a crossing as rounding tells apart
    low, high = cones_inside_each_other(EllipticCones(**one), EllipticCones(**other))[0]
    crossing = np.where(high > low, np.where(low > -np.pi, low, high), 0.0).sum(axis=0)
    near = (rng.random(n) < 0.5) & (np.abs(crossing) < np.pi) & (crossing != 0.0)
    off = rng.choice([-1.0, 1.0], n) * spread(rng, -17.0, -3.0, n)
    return {**inputs, "phi": np.where(near, crossing + off, phi), "swap": rng.random(n) < 0.3}


def _inside(phi, swap, **parts):
    one, other = (
        EllipticCones(*(parts[f"{n}{k}"] for n in ("x", "y", "z", "a", "b"))) for k in (0, 1)
    )
    found = []
    for first, second, own in ((one, other, 0), (other, one, 1)):
        low, high = cones_inside_each_other(first, second)[own]
        found.append(((low < phi) & (phi < high)).any(axis=0))
    return np.where(swap, *found)


def _margin(m, phi, swap, x0, y0, z0, a0, b0, x1, y1, z1, a1, b1):
    c, s = m.cos(phi), m.sin(phi)
    r = a0 * c * x0 + b0 * s * y0 + z0
    p, q, h = dot(x1, r) / a1, dot(y1, r) / b1, dot(z1, r)
    size = p * p + q * q
    size = np.where(size > 0, size, 1)
    return np.where(h > 0, (h * h - p * p - q * q) / size, -1.0)


CROSSING = Family(
    "boundary of an elliptic cone inside another",
    "decided beyond 2^14 u max(1, 1 / b) of the form's positive terms",
    _pairs,
    _inside,
    _margin,
    lambda b1, phi, **_: 2.0**14 * U * np.maximum(1.0, 1.0 / b1),
)
