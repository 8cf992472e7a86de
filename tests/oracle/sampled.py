# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixel means by sampled rays alone, for scenes in which lights and shapes reach into each other.

Shares no code with the core, and with the closed forms of this folder no more than camera rays.
Sobol points, shifted for each pixel by random bits (Owen 2013, "Monte Carlo theory, methods and
examples", chapter 17), spread over pixel, shutter and lights; each sample sends one segment to a
point of each light, two for parallelograms. Needs numba and SciPy.

What counts:

- A segment is blocked where it crosses a surface: by a sphere unless both of its ends are outside
  and it misses, or both inside; by a parallelogram where it passes through.
- The shape that a point lies on blocks none of its light; of a sphere seen from within, what lies
  outside it does not reach the point.
- From outside, a spherical light sends from its near side, which occluders within it do not hide;
  from inside, it sends from its far side, all around.
- A disk faces each point; a parallelogram sends from its front, U x V, alone.
- Parallelograms within the plane of a light have no convention here: scenes must not hold any.
"""

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from .directions_jit import balanced, turned
from .light_jit import DISK, POINT, QUAD
from .rays_jit import candidates, first_hit, pack
from .vectors_jit import add, cross, dot, jit, less, times, vector

__all__ = ["Samples", "render_samples", "sampled"]

CHUNK = 32
"""Pixels that a thread takes at a time."""
HALVES = 2
"""Independent estimates of each pixel."""
ROUGH = 8
"""Independent rough estimates that tell a pixel's spread: of two, one pixel in twenty has a
difference of a twelfth of what is usual, and got few samples; two pixels were most of the noise of
a picture of 891."""
FEWEST, MOST = 256, 1 << 21
"""Samples of a pixel."""
TOTAL = 1 << 25
"""Samples of a picture's half, about: where it takes more, the noise asked for is raised."""
UNFORESEEN = 3.0
"""Times the noise asked for: pixels whose halves differ by more are estimated anew. If the noise is
as asked for that is one in 400, and those that stay look no less noisy for it."""
RATE = 0.7
"""Power of the number of samples by which a pixel's error falls: less than the 0.75 or so of smooth
and of cut integrands."""
UNIT = 2.0**-32


@dataclass(frozen=True)
class Samples:
    """Two independent estimates of a picture: `halves` (2, 3, height, width)."""

    halves: np.ndarray

    @property
    def color(self):
        """(3, height, width)"""
        return self.halves.mean(axis=0)

    def square_error(self, color):
        """Mean square error of a picture, free of the samples' own noise, and its standard error.

        The errors of the two halves are independent, so that the mean of
        (color - one) (color - other) is that of (color - truth)^2.
        """
        one, other = self.halves
        product = ((color - one) * (color - other)).mean(axis=0)
        # all pixels are there: only the samples' noise makes the mean uncertain
        noise = ((one - other) ** 2).mean(axis=0) / 2.0
        spread = np.sqrt((2.0 * np.maximum(product, 0.0) * noise + noise**2).sum()) / product.size
        return float(product.mean()), float(spread)

    def relative_error(self, color):
        """RMS error of a picture over the mean of absolute values, and a standard error of it."""
        square, spread = self.square_error(color)
        mean = float(np.abs(self.color).mean())
        size = math.sqrt(max(square, 0.0))
        # of the root: spread / (2 root), but no more than the root of the spread itself
        off = min(spread / max(2.0 * size, 1e-300), math.sqrt(spread))
        return size / mean, off / mean


def sampled(scene, noise=1e-3, seed=0, threads=2):
    """Estimate all pixels of a scene's region.

    Parameters
    ----------
    noise : standard deviation of a half that pixels may have, as a fraction of the picture's mean.
        A first, rough estimate, which is then dropped, tells how many samples each pixel needs.
    """
    packed = pack(scene)
    return render_samples(packed, _means, 3 + 2 * packed[2].shape[0], scene, noise, seed, threads)


def render_samples(packed, means, dimensions, scene, noise, seed, threads):
    """Estimate all pixels of a scene's region by a function `means` of points of a cube.

    means : of packed arrays, pixels (n, 2), points (m, dimensions) and shifts (n, dimensions), adds
        the mean radiance to an array (n, 3).  Others are those of `sampled`.
    """
    left, bottom, right, top = scene.camera.region
    y, x = np.mgrid[bottom:top, left:right]
    pixels = np.stack([x.ravel(), y.ravel()], axis=1).astype(float)
    rng = np.random.default_rng(seed)

    def estimate(pixels, counts, number=HALVES):
        return _estimate(packed, means, dimensions, pixels, counts, rng, threads, number)

    every = np.full(len(pixels), FEWEST)
    rough = estimate(pixels, every, ROUGH)
    spread = np.sqrt(rough.var(axis=0, ddof=1).mean(axis=1))
    goal = noise * max(float(np.abs(rough).mean()), 1e-300)
    # few estimates tell a pixel's spread badly: the picture's own is a part of it
    spread = np.maximum(spread, np.sqrt((spread**2).mean()) / 4.0)
    counts = _counts(every, spread, goal)
    while counts.sum() > TOTAL:
        goal *= 1.2
        counts = _counts(every, spread, goal)
    halves = estimate(pixels, counts)
    # what few samples did not meet: these pixels are estimated anew
    spread = np.sqrt(((halves[0] - halves[1]) ** 2).mean(axis=1) / 2.0)
    rows = (spread > UNFORESEEN * goal).nonzero()[0]
    if rows.size:
        more = _counts(counts[rows], spread[rows], goal)
        halves[:, rows] = estimate(pixels[rows], more)
    return Samples(halves.transpose(0, 2, 1).reshape(HALVES, 3, top - bottom, right - left))


def _counts(present, spread, goal):
    """Samples (n,) that pixels need, given their spread with the present number (n,)."""
    gain = np.ceil(np.log2(np.maximum(spread / goal, 1.0)) / RATE)
    return np.minimum(present * 2 ** np.minimum(gain, 30.0).astype(np.int64), MOST)


def _estimate(packed, means, dimensions, pixels, counts, rng, threads, number):
    """Independent estimates (number, n, 3) of pixels (n, 2), each of so many samples (n,)."""
    halves = np.zeros((number, len(pixels), 3))
    calls = []
    for half in range(number):
        points = _sobol_points(dimensions, int(counts.max()), rng)
        shifts = rng.integers(0, 2**32, (len(pixels), dimensions), dtype=np.uint32)
        for count in np.unique(counts):
            rows = (counts == count).nonzero()[0]
            for start in range(0, rows.size, CHUNK):
                part = rows[start : start + CHUNK]
                calls.append((half, part, (packed, pixels[part], points[:count], shifts[part])))

    def call(half, part, arguments):
        result = np.zeros((part.size, 3))
        means(*arguments, result)
        halves[half, part] = result

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda each: call(*each), calls))
    return halves


def _sobol_points(dimensions, count, rng):
    """Scrambled Sobol points as integers of 32 bits: (count, dimensions)."""
    points = qmc.Sobol(dimensions, scramble=True, bits=32, rng=rng)
    return np.floor(points.random(count) * 2.0**32).astype(np.uint32)


@jit
def _means(scene, pixels, points, shifts, result):
    """Mean radiance (n, 3) of pixels (n, 2)."""
    balls, quads, lights, background, _ = scene
    among = np.empty(balls.shape[0] + quads.shape[0], dtype=np.int64)
    for row in range(pixels.shape[0]):
        x, y = pixels[row, 0], pixels[row, 1]
        count = candidates(scene, x, y, among)
        shift = shifts[row]
        for k in range(points.shape[0]):
            u = (points[k, 0] ^ shift[0]) * UNIT
            v = (points[k, 1] ^ shift[1]) * UNIT
            t = (points[k, 2] ^ shift[2]) * UNIT - 0.5
            i, p, n, inside = first_hit(scene, among, count, x + u, y + v, t)
            if i < 0:
                for channel in range(3):
                    result[row, channel] += background[channel]
                continue
            ball = i < balls.shape[0]
            for j in range(lights.shape[0]):
                a = (points[k, 3 + 2 * j] ^ shift[3 + 2 * j]) * UNIT
                b = (points[k, 4 + 2 * j] ^ shift[4 + 2 * j]) * UNIT
                e = _from_light(balls, quads, lights[j], (p, n, t, i, inside), a, b) / math.pi
                for channel in range(3):
                    color = (
                        balls[i, 7 + channel] if ball else quads[i - balls.shape[0], 15 + channel]
                    )
                    result[row, channel] += e * lights[j, 18 + channel] * color
        for channel in range(3):
            result[row, channel] /= points.shape[0]


@jit
def _from_light(balls, quads, light, spot, a, b):
    """One sample of the irradiance over radiance (intensity) that a light brings to a spot."""
    p, n, t, _, _ = spot
    kind = int(light[13])
    c = less(add(vector(light, 0), times(t, vector(light, 14))), p)
    if kind == QUAD:
        return _from_quad(balls, quads, light, spot, c, a, b)
    dd = dot(c, c)
    if kind == POINT:
        cosine = dot(n, c) / math.sqrt(dd)
        if cosine <= 0.0 or _blocked(balls, quads, light, spot, c):
            return 0.0
        return cosine / dd
    d, r = math.sqrt(dd), light[12]
    axis = times(1.0 / d, c)
    if kind != DISK and d <= r:
        # from inside, by the cosine: each direction that is not blocked brings as much
        w = _around_normal(n, a, b)
        along = dot(w, c)
        to = times(along + math.sqrt(along * along + (r * r - dd)), w)
        return 0.0 if _blocked(balls, quads, light, spot, to) else math.pi
    if kind == DISK:
        lowest = d / math.sqrt(dd + r * r)
        opening = r * r / (dd + r * r) / (1.0 + lowest)
    else:
        lowest = math.sqrt((d - r) * (d + r)) / d
        opening = r * r / dd / (1.0 + lowest)
    height = 1.0 - a * opening
    w = turned(axis, height, 2.0 * math.pi * b)
    cosine = dot(w, n)
    if cosine <= 0.0:
        return 0.0
    if kind == DISK:
        to = times(d / height, w)
    else:
        along = dot(w, c)
        off = less(c, times(along, w))
        to = times(along - math.sqrt(max(r * r - dot(off, off), 0.0)), w)
    if _blocked(balls, quads, light, spot, to):
        return 0.0
    return 2.0 * math.pi * opening * cosine


@jit
def _from_quad(balls, quads, light, spot, c, a, b):
    """A parallelogram's light: a point of it and a direction, weighted by the balance heuristic.

    (Veach 1998, "Robust Monte Carlo methods for light transport simulation", chapter 9.) Points
    alone have no finite variance where the light touches the surface.
    """
    n = spot[1]
    front = vector(light, 9)
    ahead = -dot(front, c)
    if ahead <= 0.0:
        return 0.0
    u, v = vector(light, 3), vector(light, 6)
    edge = cross(u, v)
    area = 4.0 * math.sqrt(dot(edge, edge))
    total = 0.0
    to = add(c, add(times(2.0 * a - 1.0, u), times(2.0 * b - 1.0, v)))
    dd = dot(to, to)
    cosine = dot(n, to) / math.sqrt(dd)
    if cosine > 0.0 and not _blocked(balls, quads, light, spot, to):
        total += balanced(cosine, ahead, dd, area)
    w = _around_normal(n, a, b)
    slope = -dot(front, w)
    if slope > 0.0:
        to = times(ahead / slope, w)
        at = less(to, c)
        uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
        au, av = dot(at, u), dot(at, v)
        det = uu * vv - uv * uv
        inner = abs(au * vv - av * uv) <= det and abs(av * uu - au * uv) <= det
        if inner and not _blocked(balls, quads, light, spot, to):
            total += balanced(dot(n, w), ahead, dot(to, to), area)
    return total


@jit
def _around_normal(n, a, b):
    """A direction over the horizon with a density of cosine over pi."""
    return turned(n, math.sqrt(1.0 - a), 2.0 * math.pi * b)


@jit
def _blocked(balls, quads, light, spot, to):
    """Whether a shape crosses the open segment from a spot to a point of a light."""
    if light[17] == 0.0:
        return False
    p, _, t, own, inside = spot
    length2 = dot(to, to)
    for i in range(balls.shape[0]):
        q = balls[i]
        v = less(add(vector(q, 0), times(t, vector(q, 4))), p)
        rr = q[3] * q[3]
        end = less(to, v)
        ends_inside = dot(end, end) < rr
        if i == own:
            if inside and not ends_inside:
                return True
            continue
        starts_inside = dot(v, v) < rr
        if starts_inside != ends_inside:
            return True
        if starts_inside:
            continue
        share = dot(v, to) / length2
        if 0.0 < share < 1.0:
            off = less(v, times(share, to))
            if dot(off, off) < rr:
                return True
    for i in range(quads.shape[0]):
        if balls.shape[0] + i == own:
            continue
        q = quads[i]
        v = less(add(vector(q, 0), times(t, vector(q, 9))), p)
        normal = vector(q, 12)
        height, slope = dot(normal, v), dot(normal, to)
        if height * slope <= 0.0 or abs(height) >= abs(slope):
            continue
        at = less(times(height / slope, to), v)
        e, f = vector(q, 3), vector(q, 6)
        area = dot(cross(e, f), normal)
        a, b = dot(cross(at, f), normal) / area, dot(cross(e, at), normal) / area
        if 0.0 < a < 1.0 and 0.0 < b < 1.0:
            return True
    return False
