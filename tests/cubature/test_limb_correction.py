# SPDX-License-Identifier: GPL-3.0-or-later
"""Roots: the slant at a sphere's rim in stars, and shadows that begin with the power 3/2."""

import numpy as np
import pytest

from adaptive_drt.cubature.limb_correction import limb_gains
from adaptive_drt.cubature.nodes import make_nodes
from adaptive_drt.geometry.shadow_edges import TANGENCY_COEFFICIENT
from adaptive_drt.shading.variation import ROOT_COEFFICIENT

BOXES, NODES = 4_000, 24
ALL, ONE = np.zeros(4, dtype=np.int64), np.ones(1, dtype=np.int64)
GAINED = {1: 0.1, 2: 0.4, 3: 0.2}
"""Of a star's own error, RMS: what is left at a rim, at most."""


def boxes(axes, reach, rng):
    """Stars of boxes with a root of something linear in them, from 0 or more at a corner on.

    Returns the mean, by stars, and by stars with gains, of 3 + v + something linear: (n,) each.
    """
    wide = np.zeros((3, BOXES), dtype=bool)
    wide[:axes] = True
    half = np.where(wide, 0.5, 0.0)
    spread = np.zeros((6, BOXES))
    spread[[0, 2, 5]] = half / np.sqrt(3.0)
    place = np.array([[0.3], [-0.2], [1.0]]) + np.zeros((3, BOXES))
    star = np.ones(BOXES, dtype=bool)
    arms = make_nodes(place, spread, wide, star, star, np.zeros(star.size, dtype=np.int64))
    slope = np.where(wide, rng.normal(size=(3, BOXES)), 0.0)
    slope /= np.abs(slope).sum(axis=0)
    beyond = rng.uniform(*reach, BOXES)

    def slant(offset, box):
        return np.sqrt(0.5 + beyond[box] + (slope[:, box] * offset).sum(axis=0))

    every = np.arange(BOXES)
    center, v = slant(0.0 * place, every), slant(arms.offset, arms.subdomain)
    weight = (1.0 - arms.centroid_weight[arms.subdomain]) / arms.count[arms.subdomain]
    gain = limb_gains(v, center, weight, np.ones(v.size), arms.subdomain, wide.sum(axis=0))
    off = np.bincount(arms.subdomain, weight * (v - center[arms.subdomain]))
    x, w = np.polynomial.legendre.leggauss(NODES)
    grid = np.stack(np.meshgrid(*[0.5 * x] * axes, *[[0.0]] * (3 - axes), indexing="ij"))
    share = np.stack(np.meshgrid(*[0.5 * w] * axes, *[[1.0]] * (3 - axes), indexing="ij"))
    true = np.zeros(BOXES)
    for at, part in zip(grid.reshape(3, -1).T, share.reshape(3, -1).prod(axis=0), strict=True):
        true += part * slant(at[:, None], every)
    return true, center + off, center + gain * off, gain


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_means_over_boxes_at_a_rim(axes, seed=7):
    rng = np.random.default_rng(seed)
    true, plain, better, _ = boxes(axes, (0.0, 0.1), rng)
    before, after = (float(np.sqrt(((x - true) ** 2).mean())) for x in (plain, better))
    print(f"seed {seed}: {before:.2g} without, {after:.2g} with")
    assert after < GAINED[axes] * before


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_far_from_a_rim_stars_are_right(axes, seed=8):
    rng = np.random.default_rng(seed)
    true, plain, better, gain = boxes(axes, (5.0, 50.0), rng)
    assert np.abs(better - true).max() < 2.0 * np.abs(plain - true).max()
    assert np.abs(gain - 1.0).max() < 0.03


def test_a_flat_slant_changes_nothing():
    flat, one = np.full(4, 0.3), np.ones(4)
    gain = limb_gains(flat, flat[:1], one / 4.0, one, ALL, ONE)
    assert gain == pytest.approx(1.0)
    zero = np.zeros(4)
    assert np.isfinite(limb_gains(zero, zero[:1], one / 4.0, one, ALL, ONE))


def overlap(a, b, apart):
    """Area that circles of radii a and b have in common, their centres so far apart."""
    x = (apart * apart + a * a - b * b) / (2.0 * apart)
    first = a * a * np.arccos(x / a) - x * np.sqrt(a * a - x * x)
    y = apart - x
    return first + b * b * np.arccos(y / b) - y * np.sqrt(b * b - y * y)


@pytest.mark.parametrize(
    ("other", "inside"), [(1.0, False), (2.0, False), (30.0, False), (2.0, True), (30.0, True)]
)
def test_how_shadows_of_round_things_begin(other, inside):
    """Of a light of radius 1, in units of its width: touching from outside, and from within.

    (Equal circles, one within the other, separate as a ramp does.)
    """
    u = 1e-4
    bent = 1.0 + (-1.0 if inside else 1.0) / other
    power = TANGENCY_COEFFICIENT / np.sqrt(bent)
    if inside:
        hidden = np.pi - overlap(1.0, other, other - 1.0 + 2.0 * u)
    else:
        hidden = overlap(1.0, other, other + 1.0 - 2.0 * u)
    assert hidden / np.pi == pytest.approx(power * u**1.5, rel=0.02)


def test_what_a_power_of_three_halves_leaves_of_a_midpoint(seed=9):
    """Of u^(3/2) in a cell of h that it begins in, or beside: in half extents, to the power 3/2."""
    begin = np.random.default_rng(seed).uniform(-0.5, 0.5, 400_000)
    mean = 0.4 * (np.maximum(0.5 - begin, 0.0) ** 2.5 - np.maximum(-0.5 - begin, 0.0) ** 2.5)
    off = np.maximum(-begin, 0.0) ** 1.5 - mean
    assert ROOT_COEFFICIENT == pytest.approx(
        2.0**1.5 * float(np.sqrt((off * off).mean())), rel=0.05
    )
