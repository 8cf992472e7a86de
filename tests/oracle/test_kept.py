# SPDX-License-Identifier: GPL-3.0-or-later
"""Kept answers of the oracle are found for the very same question only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import Motion, Sphere
from oracle import kept as module
from oracle.kept import STORE, described, kept
from oracle.truth import masks
from random_scenes import random_scene


def test_descriptions_tell_all_that_differs_but_defaults():
    scene = random_scene(3)
    same = random_scene(3)
    assert described(scene) == described(same)
    shape = scene.shapes[0]
    for other in (
        replace(scene, background=(0.0, 0.0, 1e-300)),
        replace(scene, transparent=True),
        replace(scene, camera=replace(scene.camera, shift_x=np.nextafter(scene.camera.shift_x, 1))),
        replace(scene, shapes=(replace(shape, motion=Motion((0.0, 0.0, 1e-9))), *scene.shapes[1:])),
        replace(scene, shapes=scene.shapes[::-1] if len(scene.shapes) > 1 else ()),
    ):
        assert described(other) != described(scene)
    assert "motion" not in described(Sphere((0.0, 0.0, 0.0), 1.0))
    x = np.arange(3.0)
    assert described(x) != described(x[::-1]) != described(x.astype(int))


def test_an_unknown_question_is_computed(monkeypatch):
    scene = random_scene(2)
    scene = replace(scene, camera=replace(scene.camera, resolution=(6, 5)))
    monkeypatch.delenv("ADAPTIVE_DRT_TRUTHS", raising=False)
    monkeypatch.setattr(module, "_store", lambda: {})
    np.testing.assert_array_equal(kept("truth.masks", scene), masks(scene))


def test_a_changed_oracle_has_no_kept_answers(monkeypatch):
    monkeypatch.delenv("ADAPTIVE_DRT_TRUTHS", raising=False)
    asked = []
    monkeypatch.setattr(module, "_store", lambda: type("", (), {"get": asked.append})())
    scene = random_scene(2)
    scene = replace(scene, camera=replace(scene.camera, resolution=(3, 2)))
    kept("truth.masks", scene)
    monkeypatch.setattr(module, "source_of", lambda name: "another")
    kept("truth.masks", scene)
    assert len(set(asked)) == 2


def test_sources_are_those_of_all_modules_that_a_module_imports():
    found = module.source_of("converged")
    for name in ("converged", "cells_jit", "rays_jit", "light_jit", "arcs_jit", "vectors_jit"):
        assert f"{name}: Module(" in found
    assert "truth: Module(" not in found


def test_the_store_is_small():
    assert STORE.stat().st_size < 1 << 19
