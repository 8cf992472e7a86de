# SPDX-License-Identifier: GPL-3.0-or-later
"""Families of light that occluders hide in part, against sums over latitudes: suns, spots, lights
of limited spread, skies, environments, and the paths for many circles and polygons.

What is true is computed by `oracle.latitudes`, which shares no code, in float64: its own error is
some 1e-12 sr, far below the bounds. So the arithmetic that is asked for does not matter here.
"""

from contextlib import contextmanager
from functools import partial
from itertools import pairwise

import numpy as np

from adaptive_drt.geometry.axial_profile import AxialProfile
from adaptive_drt.geometry.open_hemisphere import (
    open_hemisphere_factor,
    polygons_in_general_position,
)
from adaptive_drt.geometry.silhouettes import (
    CircularSilhouette,
    Hemisphere,
    make_polygon_silhouettes,
)
from adaptive_drt.geometry.spread_profile import SpreadProfile
from adaptive_drt.lights import occluded_form_factor
from adaptive_drt.lights.environment_factor import Environment
from adaptive_drt.lights.environment_map import make_environment_map
from adaptive_drt.lights.occluded_form_factor import visible_factor
from adaptive_drt.scene.description import EnvironmentLight
from kernel_families import Family, across, length, unit
from oracle.latitudes import ALONE, CONE, SPREAD, integrals
from oracle.numbers import LONG, cross, dot

CLOSED, QUADRATURE = 1e-9, 1e-6
"""Largest error that counts, in sr of a light that fills the sky or less: of closed forms, and of
quadratures."""
MISSED = 1e-6
"""Error of an environment, as a fraction of the mean irradiance, by which it may be beyond the
stated one, which is an estimate. Over many configurations the RMS error is a tenth of the stated
one at 1e-6, and a sixth at 1e-4."""
AXIS_TILTS = (0.4, -0.7, 1.3)
"""Tangents by which the axes of latitudes are off the one that is given: any that differ do."""
ENOUGH = 1e-10
"""Difference of a piece of latitudes and its halves that is small enough where the bound is
`QUADRATURE`."""
SAME = 1e-11
"""Relative difference of two sums over latitudes from which on a third decides."""
LIGHTS = 16
"""Lights with a profile of their own, for all cases of a call."""
IMAGES, ROWS = 4, 8
"""Images of the sky for all cases of a call, and their rows."""


def plain(array):
    """Numbers of any kind as float64."""
    return np.asarray(array).astype(np.float64)


def _columns(*rows):
    """Circles (n, k, 5) of rows of axes (3, n), cosines (n,) and groups."""
    found = []
    for axis, cosine, group in rows:
        n = axis.shape[1]
        found.append(np.stack([*axis, np.broadcast_to(cosine, n), np.full(n, float(group))], 1))
    return np.stack(found, axis=1)


def _frame(axis):
    """Frames (n, 3, 3) with unit vectors (3, n) as the last axis."""
    least = np.abs(axis).argmin(axis=0)
    x = cross(axis, np.eye(3)[:, least])
    x = x / length(x)
    return np.stack([x, cross(axis, x), axis]).transpose(2, 0, 1)


def _uniform_light(circles, up, axis, once=False):
    """Irradiance (n,) of uniform light, summed along the latitudes about two axes near those given,
    or `once`, about the first of them.

    Where the sums disagree, the median with a third: a piece whose sum and whose halves' sum agree
    by chance is not divided, which is off by up to 1e-10 sr in one of 1,000 cases. Latitudes about
    the normal itself are worse, since the horizon is one of them.
    """
    frame = _frame(axis)

    def summed(rows, tilt):
        way = (frame[rows] * np.array([[tilt], [0.3 * tilt], [1.0]])).sum(axis=1).T
        return integrals(circles[rows], up.T[rows], _frame(way / length(way)))[:, 0]

    every = np.arange(len(circles))
    found = summed(every, AXIS_TILTS[0])
    if once:
        return found
    other = summed(every, AXIS_TILTS[1])
    doubtful = (np.abs(found - other) > SAME * np.abs(found)).nonzero()[0]
    if doubtful.size:
        third = summed(doubtful, AXIS_TILTS[2])
        found[doubtful] = np.median([found[doubtful], other[doubtful], third], axis=0)
    return found


def _hiders(place, radius, quads):
    """Circles of occluding spheres (3, k, n), radii (k, n), and polygons (j, 3, m, n)."""
    rows = []
    for k in range(radius.shape[0]):
        d = length(place[:, k])
        rows.append((place[:, k] / d, np.sqrt((d - radius[k]) * (d + radius[k])) / d, ALONE))
    for i in range(quads.shape[2]):
        corners = quads[:, :, i]
        side = np.sign(dot(cross(corners[0], corners[1]), corners[2]))
        for k in range(len(corners)):
            m = side * cross(corners[k], corners[(k + 1) % len(corners)])
            rows.append((m / length(m), 0.0, 2 + i))
    return rows


def occluders(rng, n, axis, half, balls=2, sheets=1):
    """Spheres and parallelograms around directions: of the order of a half angle (n,)."""
    place, radius, quads = [], [], []
    for _ in range(balls):
        way = axis + np.tan(np.minimum(half, 1.2)) * rng.uniform(0.0, 1.3, n) * across(rng, axis)
        way *= 10.0 ** rng.uniform(-2.0, 2.0, n) / length(way)
        place.append(way)
        own = np.minimum(half * 10.0 ** rng.uniform(-1.5, 0.3, n), 1.4)
        radius.append(length(way) * np.sin(own))
    for _ in range(sheets):
        middle = axis + np.tan(np.minimum(half, 1.0)) * rng.uniform(0.0, 1.0, n) * across(rng, axis)
        a, b = (0.7 * half * 10.0 ** rng.uniform(-0.7, 0.2, n) * unit(rng, n) for _ in range(2))
        quads.append(np.stack([middle + a + b, middle - a + b, middle - a - b, middle + a - b]))
    return {"place": np.stack(place, 1), "radius": np.stack(radius), "quads": np.stack(quads, 2)}


def given(place, radius, quads):
    """Occluders as `visible_factor` takes them."""
    return (place.swapaxes(0, 1), radius), quads.transpose(2, 0, 1, 3)


# suns and other round lights


def round_light(rng, n):
    axis = unit(rng, n)
    half = np.where(rng.random(n) < 0.5, 10.0 ** rng.uniform(-2.0, 0.0, n), rng.uniform(0, 1.5, n))
    half = np.maximum(half, 0.01)
    up = axis + rng.uniform(0.0, 1.6, n) * across(rng, axis)
    lit = {"axis": axis, "half": half, "up": up / length(up)}
    return {**lit, **occluders(rng, n, axis, half)}


def _sun(axis, half, up, **hiders):
    light = CircularSilhouette(axis, np.cos(half), np.sin(half))
    return visible_factor(light, up, *given(**hiders))


def _true_sun(m, axis, half, up, once=False, **hiders):
    axis, half, up = map(plain, (axis, half, up))
    rows = [(up, 0.0, 0), (axis, np.cos(half), 0)]
    circles = _columns(*rows, *_hiders(**{k: plain(v) for k, v in hiders.items()}))
    return m.lift(_uniform_light(circles, up, axis, once))


HIDDEN_SUN = Family(
    "sun behind spheres and a quad",
    "1e-9 sr times the sine of its half angle",
    round_light,
    _sun,
    _true_sun,
    lambda half, **_: CLOSED * np.sin(half),
    digits=False,
    quick=partial(_true_sun, LONG, once=True),
)


# lights whose radiance depends on the direction


def _shared(rng, n, make):
    """Something that `LIGHTS` lights have, each repeated for its share of the cases."""
    made = make(LIGHTS)
    return np.repeat(made, -(-n // LIGHTS), axis=-1)[..., :n]


def spot(rng, n):
    inputs = round_light(rng, n)
    beam = _shared(rng, n, lambda k: unit(rng, k))
    angle = _shared(rng, n, lambda k: rng.uniform(0.1, 1.5, k))
    blend = _shared(rng, n, lambda k: np.maximum(rng.choice([0.0, 0.2, 1.0], k), 2.0**-12))
    # the light is near the edge of its cone
    turned = beam + np.tan(angle) * rng.uniform(0.5, 1.2, n) * across(rng, beam)
    axis = turned / length(turned)
    half = np.minimum(inputs["half"], 1.0)
    up = axis + rng.uniform(0.0, 1.6, n) * across(rng, axis)
    inputs.update(axis=axis, half=half, up=up / length(up), **occluders(rng, n, axis, half))
    outer = np.cos(angle)
    return {**inputs, "beam": beam, "outer": outer, "inner": outer + (1.0 - outer) * blend}


def _by_profile(run, make, *lights):
    """Run a kernel for each of the profiles that cases share."""
    stacked = np.concatenate([np.atleast_2d(light) for light in lights])
    change = (stacked[:, 1:] != stacked[:, :-1]).any(axis=0)
    starts = [0, *(np.flatnonzero(change) + 1), stacked.shape[1]]
    parts = []
    for first, last in pairwise(starts):
        rows = slice(first, last)
        parts.append(run(rows, make(*(light[..., first : first + 1] for light in lights))))
    return np.concatenate(parts)


def _spot(axis, half, up, place, radius, quads, beam, outer, inner):
    def run(rows, profile):
        light = CircularSilhouette(axis[:, rows], np.cos(half[rows]), np.sin(half[rows]))
        hiders = given(place[..., rows], radius[..., rows], quads[..., rows])
        return visible_factor(light, up[:, rows], *hiders, profile)

    make = lambda z, a, b: AxialProfile(z, float(a[0]), float(b[0]))  # noqa: E731
    return _by_profile(run, make, beam, outer, inner)


def _true_spot(m, axis, half, up, beam, outer, inner, **hiders):
    axis, half, up, beam, outer, inner = map(plain, (axis, half, up, beam, outer, inner))
    rows = [(up, 0.0, 0), (axis, np.cos(half), 0)]
    circles = _columns(*rows, *_hiders(**{k: plain(v) for k, v in hiders.items()}))
    profile = np.stack([np.full(outer.size, float(CONE)), outer, inner], axis=1)
    return m.lift(integrals(circles, up.T, _frame(beam), profile, accuracy=ENOUGH)[:, 0])


HIDDEN_SPOT = Family(
    "spot behind spheres and a quad",
    "1e-6 sr times the sine of its half angle",
    spot,
    _spot,
    _true_spot,
    lambda half, **_: QUADRATURE * np.sin(half),
    digits=False,
)


def spread_light(rng, n):
    """Parallelograms whose normal differs from the direction to them by the half spread or less."""
    beam = _shared(rng, n, lambda k: unit(rng, k))
    half = _shared(rng, n, lambda k: rng.uniform(0.1, 1.5, k))
    turned = beam + np.tan(half) * rng.uniform(0.0, 1.1, n) * across(rng, beam)
    to = turned / length(turned)
    size = 10.0 ** rng.uniform(-1.5, 0.0, n) * dot(to, beam)
    a = across(rng, beam)
    b = cross(beam, a) + rng.uniform(-0.5, 0.5, n) * a
    a, b = a * size, b * size * 10.0 ** rng.uniform(-0.5, 0.0, n)
    up = to + rng.uniform(0.0, 1.6, n) * across(rng, to)
    lit = {"to": to, "a": a, "b": b, "up": up / length(up), "beam": beam, "outer": np.cos(half)}
    return {**lit, **occluders(rng, n, to, np.minimum(size, 1.0))}


def _corners(to, a, b):
    return np.stack([to + a + b, to - a + b, to - a - b, to + a - b])


def _spread(to, a, b, up, beam, outer, place, radius, quads):
    corners = _corners(to, a, b)

    def run(rows, profile):
        hiders = given(place[..., rows], radius[..., rows], quads[..., rows])
        return visible_factor(corners[..., rows], up[:, rows], *hiders, profile)

    return _by_profile(run, lambda z, c: SpreadProfile(z, float(c[0]), 1.0), beam, outer)


def _true_spread(m, to, a, b, up, beam, outer, **hiders):
    to, a, b, up, beam, outer = map(plain, (to, a, b, up, beam, outer))
    light = _hiders(np.zeros((3, 0, outer.size)), np.zeros((0, outer.size)),
                    _corners(to, a, b)[:, :, None])  # fmt: skip
    rows = [(up, 0.0, 0), *((axis, cosine, 0) for axis, cosine, _ in light)]
    circles = _columns(*rows, *_hiders(**{k: plain(v) for k, v in hiders.items()}))
    profile = np.stack([np.full(outer.size, float(SPREAD)), outer, np.ones(outer.size)], axis=1)
    return m.lift(integrals(circles, up.T, _frame(beam), profile, accuracy=ENOUGH)[:, 0])


HIDDEN_SPREAD = Family(
    "quad light of limited spread behind spheres and a quad",
    "1e-6 (|a| + |b|) / d sr",
    spread_light,
    _spread,
    _true_spread,
    lambda a, b, **_: QUADRATURE * (length(a) + length(b)),
    digits=False,
)


# skies


def under_sky(balls, sheets):
    def sample(rng, n):
        up = unit(rng, n)
        parts = [occluders(rng, n, unit(rng, n), np.full(n, 0.4), 1, 1) for _ in range(balls)]
        found = {"place": np.concatenate([p["place"] for p in parts], axis=1)}
        found["radius"] = np.concatenate([p["radius"] for p in parts])
        found["quads"] = np.concatenate([p["quads"] for p in parts], axis=2)[:, :, :sheets]
        return {"up": up, **found}

    return sample


@contextmanager
def _paths_for(circles, polygons):
    """The numbers from which the paths for many circles and polygons are taken."""
    before = occluded_form_factor.CROSSING_CIRCLES, occluded_form_factor.CROSSING_POLYGONS
    occluded_form_factor.CROSSING_CIRCLES = circles
    occluded_form_factor.CROSSING_POLYGONS = polygons
    try:
        yield
    finally:
        occluded_form_factor.CROSSING_CIRCLES, occluded_form_factor.CROSSING_POLYGONS = before


def _sky(circles, polygons):
    def core(up, **hiders):
        with _paths_for(circles, polygons):
            return visible_factor(Hemisphere(), up, *given(**hiders))

    return core


def _open_sky(up, place, radius, quads):
    """By the vertices that are open, and in the way of `shading.open_sky` where edges coincide."""
    length_ = length(place)
    n = up.shape[1]
    point = np.repeat(np.arange(n), radius.shape[0])
    axis = (place / length_).swapaxes(1, 2).reshape(3, -1)
    cosine = np.sqrt((length_ - radius) * (length_ + radius)) / length_
    seen = make_polygon_silhouettes(quads.transpose(2, 0, 1, 3), up)
    clear = polygons_in_general_position(up, seen)
    caps = axis, (radius / length_).T.ravel(), cosine.T.ravel(), point
    return np.where(clear, open_hemisphere_factor(up, *caps, seen), _sky(1_000, 1_000)(
        up, place=place, radius=radius, quads=quads))  # fmt: skip


def _true_sky(m, up, once=False, **hiders):
    up = plain(up)
    circles = _columns((up, 0.0, 0), *_hiders(**{k: plain(v) for k, v in hiders.items()}))
    return m.lift(_uniform_light(circles, up, up, once))


def _sky_family(name, balls, sheets, core):
    bound = lambda up, **_: np.full(up.shape[1], CLOSED)  # noqa: E731
    quick = partial(_true_sky, LONG, once=True)
    sample = under_sky(balls, sheets)
    return Family(name, "1e-9 sr", sample, core, _true_sky, bound, digits=False, quick=quick)


HIDDEN_SKY = _sky_family("sky behind spheres and polygons", 3, 2, _sky(1_000, 1_000))
CROSSING_CIRCLES = _sky_family("sky behind circles that cross", 5, 1, _sky(1, 1_000))
OPEN_HEMISPHERE = _sky_family("sky by open vertices", 5, 1, _open_sky)
CROSSING_POLYGONS = _sky_family("sky behind polygons that cross", 3, 3, _sky(1_000, 1))


# environments


def under_image(rng, n):
    inputs = under_sky(2, 1)(rng, n)
    kind = rng.random((IMAGES, 1, 1, 1))
    pixels = rng.random((IMAGES, ROWS, 2 * ROWS, 3)) ** (1.0 + 5.0 * kind)
    turn = np.stack([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(IMAGES)])
    number = np.arange(n) % IMAGES
    # each case carries its image, so that it can be looked at alone
    return {
        **inputs,
        "pixels": pixels.transpose(1, 2, 3, 0)[..., number],
        "turn": (turn * np.linalg.det(turn)[:, None, None]).transpose(1, 2, 0)[..., number],
    }


def _image_factor(up, place, radius, quads, pixels, turn):
    """Values (3, n) and the stated errors (1, n), over the mean irradiance."""
    n = up.shape[1]
    found = np.zeros((4, n))
    for first in range(min(n, IMAGES)):
        rows = np.arange(first, n, IMAGES)
        rotation = tuple(tuple(map(float, row)) for row in turn[..., first])
        light = EnvironmentLight(pixels[..., first], rotation=rotation)
        environment = Environment(make_environment_map(light))
        hiders = given(place[..., rows], radius[..., rows], quads[..., rows])
        mean = np.pi * float(environment.level.max())
        allowed = np.full(rows.size, QUADRATURE * mean)
        value, error = environment.visible_factor(up[:, rows], *hiders, allowed)
        found[:, rows] = np.concatenate([value, error[None]]) / mean
    return found


def _beyond_stated(m, got, up, pixels, turn, **hiders):
    """Largest error of the channels, over the stated one and what that may miss."""
    up, pixels, turn, got = map(plain, (up, pixels, turn, got))
    circles = _columns((up, 0.0, 0), *_hiders(**{k: plain(v) for k, v in hiders.items()}))
    n = up.shape[1]
    images = pixels[..., : min(n, IMAGES)].transpose(3, 0, 1, 2)
    want = integrals(circles, up.T, turn.transpose(2, 0, 1), None, images, ENOUGH).T
    theta = (np.arange(ROWS) + 0.5) * np.pi / ROWS
    weight = np.sin(theta)[:, None, None, None] / np.sin(theta).sum() / (2 * ROWS)
    mean = np.pi * (pixels * weight).sum(axis=(0, 1)).max(axis=0)
    off = np.abs(got[:3] * _true_mean(pixels, images) - want).max(axis=0) / mean
    return m.lift(off / (got[3] + MISSED))


def _true_mean(pixels, images):
    """Mean irradiance (n,) of the brightest channel of each case's image, as the core has it."""
    means = []
    for image in images:
        means.append(
            np.pi * float(Environment(make_environment_map(EnvironmentLight(image))).level.max())
        )
    return np.array(means)[np.arange(pixels.shape[-1]) % len(images)]


HIDDEN_IMAGE = Family(
    "environment behind spheres and a quad",
    "the stated error, 1e-6 of the mean irradiance as is asked for, and as much that it may miss",
    under_image,
    _image_factor,
    None,
    lambda up, **_: np.ones(up.shape[1]),
    _beyond_stated,
    digits=False,
)
