# SPDX-License-Identifier: GPL-3.0-or-later
"""Families of elliptic lights: whole ones against an integral along the rim, hidden ones against
lines across them (`oracle.visible`)."""

from itertools import pairwise

import numpy as np

from adaptive_drt.geometry.elliptic_cones import (
    EllipticCones,
    cone_antiderivative,
    cone_boundary_values,
)
from adaptive_drt.lights.ellipse_light import make_ellipse_emitter
from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.occluded_form_factor import visible_factor
from adaptive_drt.scene.description import EllipseLight, vector_of
from kernel_cones import random_cone
from kernel_families import Family, U, across, length, unit
from kernel_skies import CLOSED, LIGHTS, QUADRATURE, given, occluders, plain
from oracle.numbers import cross, dot
from oracle.visible import Light, visible

AT_REST = LightMotion(np.zeros(3), np.zeros(3))
PIECES = 24
NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
SINGLE = 0.01
"""Share of a long run's cases for which lines across the light are drawn: 10 ms each."""


def _lamps(rng, circular):
    """Half axes (3, `LIGHTS`) of ellipses, at right angles and not."""
    a = unit(rng, LIGHTS)
    b = across(rng, a)
    b = b - dot(a, b) * a  # at right angles to rounding, so that it counts as a circle
    b = b / length(b)
    if not circular:
        b = b * rng.uniform(0.2, 1.0, LIGHTS) + rng.uniform(-0.5, 0.5, LIGHTS) * a
    return a, b


def ellipse(circular, cut):
    """Points before an ellipse of half an axis of 1, and normals, with the horizon across or not.

    cut : whether the horizon crosses the light; else it is wholly above it.
    """

    def sample(rng, n):
        a, b = (np.repeat(x, -(-n // LIGHTS), axis=1)[:, :n] for x in _lamps(rng, circular))
        normal = cross(a, b)
        normal /= length(normal)
        aside = rng.uniform(-1.0, 1.0, (2, n)) * 10.0 ** rng.uniform(-1.0, 0.7, n)
        height = 10.0 ** rng.uniform(-0.5, 1.0, n)
        to = -(height * normal + aside[0] * a + aside[1] * b)
        extent = np.sqrt(dot(to, to))
        aim = to / extent
        side = across(rng, aim)
        # the height of the light's middle, in units of its extent along the normal
        up = aim + rng.uniform(0.0, 3.0, n) * side
        up /= length(up)
        for _ in range(60):
            reach = np.hypot(dot(up, a), dot(up, b))
            wrong = (dot(up, to) < reach * 1.001) if not cut else (np.abs(dot(up, to)) > reach)
            goal = aim if not cut else side
            up = np.where(wrong, up + 0.5 * goal, up)
            up /= length(up)
        reach = np.hypot(dot(up, a), dot(up, b))
        if not cut:  # from as near as this only a point that faces the plane sees all of it
            up = np.where(dot(up, to) < reach * 1.001, -normal, up)
        return {"to": to, "a": a, "b": b, "up": up}

    return sample


def _emitters(n, a, b):
    """Emitters of the lights that cases share, and their rows."""
    stacked = np.concatenate([a, b])
    change = np.flatnonzero((stacked[:, 1:] != stacked[:, :-1]).any(axis=0)) + 1
    for first, last in pairwise([0, *change, n]):
        axes = vector_of(a[:, first]), vector_of(b[:, first])
        light = EllipseLight((0.0,) * 3, *axes, (1.0,) * 3)
        yield slice(first, last), make_ellipse_emitter(light, AT_REST)


def _factor(to, a, b, up):
    n = to.shape[1]
    found = np.zeros(n)
    for rows, lamp in _emitters(n, a, b):
        point = np.zeros((3, found[rows].size))
        found[rows] = lamp.irradiance_factor(to[:, rows], point, up[:, rows])
    return found


def _true_factor(m, to, a, b, up):
    """Half of n.(p x dp) / |p|^2 along the rim above the horizon, and along its chord."""
    to, a, b, up = map(plain, (to, a, b, up))
    height, p, q = dot(up, to), dot(up, a), dot(up, b)
    size, middle = np.maximum(np.hypot(p, q), 1e-300), np.arctan2(q, p)
    half = np.arccos(np.clip(-height / size, -1.0, 1.0))
    low, step = middle - half, 2.0 * half / PIECES
    total = np.zeros(to.shape[1])

    def at(phi):
        return to + np.cos(phi) * a + np.sin(phi) * b

    for piece in range(PIECES):
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            phi = low + (piece + 0.5 + 0.5 * node) * step
            place, way = at(phi), np.cos(phi) * b - np.sin(phi) * a
            total += 0.5 * weight * step * dot(up, cross(place, way)) / dot(place, place)
    start, end = at(low), at(low + 2.0 * half)
    turn = np.arctan2(dot(up, cross(end, start)), dot(end, start))
    total += np.where(half < np.pi, turn, 0.0)
    return m.lift(0.5 * np.abs(total))


def _share_of(fraction):
    """A fraction of pi times the sine squared of a cone as wide as the light."""
    return lambda to, a, b, up: fraction * np.pi / (1.0 + dot(to, to))


WHOLE_DISK = Family(
    "disk that does not turn, above the horizon",
    "1e-9 r^2 / (d^2 + r^2) sr",
    ellipse(True, False),
    _factor,
    _true_factor,
    _share_of(CLOSED),
    digits=False,
)
WHOLE_ELLIPSE = Family(
    "elliptic light above the horizon",
    "1e-9 r^2 / (d^2 + r^2) sr",
    ellipse(False, False),
    _factor,
    _true_factor,
    _share_of(CLOSED),
    digits=False,
)
CUT_ELLIPSE = Family(
    "elliptic light that the horizon cuts",
    "1e-9 r^2 / (d^2 + r^2) sr",
    ellipse(False, True),
    _factor,
    _true_factor,
    _share_of(CLOSED),
    digits=False,
)


def hidden_ellipse(rng, n):
    inputs = ellipse(False, False)(rng, n)
    far = length(inputs["to"])
    half = np.arctan2(0.7, far)
    hiders = occluders(rng, n, inputs["to"] / far, half)
    # before the light's plane, which nothing may cross
    return {**inputs, **{k: v * (0.01 if k == "quads" else 1.0) for k, v in hiders.items()}}


def _hidden_factor(to, a, b, up, place, radius, quads):
    n = to.shape[1]
    found = np.zeros(n)
    for rows, lamp in _emitters(n, a, b):
        hiders = given(place[..., rows], radius[..., rows], quads[..., rows])
        found[rows] = visible_factor(
            lamp.silhouette(to[:, rows], up[:, rows]), up[:, rows], *hiders
        )
    return found


def _true_hidden(m, to, a, b, up, place, radius, quads):
    arrays = tuple(map(plain, (to, a, b, up, place, radius, quads)))
    found = []
    for k in range(arrays[0].shape[1]):
        t, u, v, n, c, r, q = (array[..., k] for array in arrays)
        spheres = [(c[:, i], r[i]) for i in range(r.size)]
        sheets = [q[:, :, i] for i in range(q.shape[2])]
        found.append(visible(Light(t, u, v, disk=True), n, spheres, sheets))
    return m.lift(np.array(found))


HIDDEN_ELLIPSE = Family(
    "elliptic light behind spheres and a quad",
    "1e-6 r^2 / (d^2 + r^2) sr",
    hidden_ellipse,
    _hidden_factor,
    _true_hidden,
    lambda to, a, b, up, **_: _share_of(QUADRATURE)(to, a, b, up),
    digits=False,
    share=SINGLE,
)


def _cone_arcs(rng, n):
    z = unit(rng, n)
    low = rng.uniform(-np.pi, np.pi, n)
    return {
        **random_cone(rng, z, -4.0, 0.6, -3.0),
        "up": unit(rng, n),
        "low": low,
        "high": low + rng.uniform(0.0, 2.0 * np.pi, n),
    }


def _cone_integral(x, y, z, a, b, up, low, high):
    cones = EllipticCones(*(each[..., None, :] for each in (x, y, z, a, b)))
    potential = cone_antiderivative(up, z, cones)
    ends = [cone_boundary_values(potential, phi[None])[0] for phi in (low, high)]
    return ends[1] - ends[0]


def _true_cone_integral(m, x, y, z, a, b, up, low, high):
    """By quadrature of n.((w - c) x dw), with c the axis, in a variable in which w turns evenly."""

    def place(phi):
        r = a * m.cos(phi) * x + b * m.sin(phi) * y + z
        return r, r / m.norm(r)

    def turned(phi):
        t = m.atan2(m.sin(phi) / g, m.cos(phi))
        return t + 2 * m.pi * np.round(plain(phi - t) / (2 * np.pi))

    total = 0 * low
    start, end = place(low)[1], place(high)[1]
    # tan(phi) = g tan(t)
    g = m.sqrt((1 + a * a) / (1 + b * b))
    first = turned(low)
    step = (turned(high) - first) / PIECES
    for piece in range(PIECES):
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            t = first + (piece + 0.5 + 0.5 * node) * step
            c, s = m.cos(t), m.sin(t)
            phi = m.atan2(g * s, c)
            rate = g / (c * c + g * g * s * s)
            r, _ = place(phi)
            d = b * m.cos(phi) * y - a * m.sin(phi) * x
            total = total + 0.5 * weight * step * rate * dot(up, cross(r, d)) / dot(r, r)
    return total - dot(cross(up, z), end - start)


ALONG = Family(
    "integral along the boundary of an elliptic cone",
    "64 u sr",
    _cone_arcs,
    _cone_integral,
    _true_cone_integral,
    lambda low, **_: np.full(low.size, 64.0 * U),
    digits=False,
)
