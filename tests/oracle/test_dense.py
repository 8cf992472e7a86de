# SPDX-License-Identifier: GPL-3.0-or-later
"""The oracle of dense rays against closed forms and the other oracle of plain rays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.scene.description import Ellipsoid, Quad, Sphere
from stick_scenes import LIGHTS, plain_picture, stick_scene

pytest.importorskip("numba")
from .dense import dense_picture


@pytest.mark.parametrize("light", LIGHTS)
def test_it_agrees_with_plain_rays(light):
    scene = stick_scene(5, light, moving=True, resolution=(12, 9), tapers=light != "quad")
    color, error = dense_picture(scene, 5e-3)
    plain, noise = plain_picture(scene, 150)
    off = np.abs(color - plain) / np.sqrt(error**2 + noise**2 + 1e-12)
    assert np.sqrt((np.minimum(off, 6.0) ** 2).mean()) < 1.3 and (off > 6.0).mean() < 0.01


def test_an_ellipsoid_of_equal_axes_is_a_ball():
    scene = stick_scene(2, "quad", resolution=(12, 9))
    balls = [shape for shape in scene.shapes if isinstance(shape, Sphere | Quad)]
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    others = [
        Ellipsoid(s.center, *map(tuple, (s.radius * turn).tolist()), s.material)
        if isinstance(s, Sphere)
        else s
        for s in balls
    ]
    one, other = (dense_picture(replace(scene, shapes=tuple(s)), 0.1)[0] for s in (balls, others))
    np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)


def test_its_error_is_what_it_says():
    scene = stick_scene(3, "sphere", resolution=(12, 9))
    rough, error = dense_picture(scene, 0.01, seed=1)
    fine, _ = dense_picture(scene, 1e-3, seed=2)
    ratio = ((rough - fine) ** 2).mean() / (error**2).mean()
    assert 0.3 < ratio < 3.0
