# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks of rays through boxes meet every box, by embree as by NumPy."""

import pickle

import numpy as np
import pytest

from adaptive_drt.geometry.embree import has_embree
from adaptive_drt.geometry.mesh import instance_boxes as module
from adaptive_drt.geometry.mesh.instance_boxes import InstanceBoxes


def met_by(low, high, start, way, length):
    """Whether each ray (n,) meets each box (m,), by slabs."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = ((side[:, None] - start[:, :, None]) / way[:, :, None] for side in (low, high))
    first, last = np.minimum(a, b).max(axis=0), np.maximum(a, b).min(axis=0)
    return (first <= last) & (last > 0.0) & (first < length[:, None])


def walked(boxes, start, way, length, count):
    found = np.zeros((way.shape[1], count), dtype=int)
    walk = boxes.walk(start, way, length)
    while (step := walk.step()) is not None:
        assert np.unique(step[0]).size == step[0].size
        found[step] += 1
    return found


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("embree", [False, True])
def test_every_box_is_met(scale, embree, monkeypatch):
    if embree and not has_embree():
        pytest.skip("needs embree")
    monkeypatch.setattr(module, "has_embree", lambda: embree)
    rng = np.random.default_rng(0)
    low = rng.uniform(-1.0, 1.0, size=(3, 60))
    low[:, :20] = np.round(low[:, :20] * 4.0) / 4.0  # boxes that touch
    high = low + np.where(np.arange(60) < 20, 0.25, rng.uniform(0.0, 0.6, size=(3, 60)))
    start, way = rng.uniform(-2.0, 2.0, size=(3, 500)), rng.normal(size=(3, 500))
    start[:, :20] *= 1e3
    way[:, :20] = -start[:, :20]
    length = np.where(np.arange(500) % 2, np.inf, 0.4)
    boxes = InstanceBoxes(scale * low, scale * high)
    found = walked(boxes, scale * start, scale * way, length, 60)
    sure = met_by(low, high, start, way, length)
    assert not (sure & (found == 0)).any()
    wide = met_by(low - 1e-4, high + 1e-4, start, way, np.full(500, np.inf))
    assert not (~wide & (found > 0)).any()


def test_rays_end_where_they_are_told():
    low = np.array([[0.0, 10.0, 20.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    boxes = pickle.loads(pickle.dumps(InstanceBoxes(low, low + 1.0)))
    start, way = np.full((3, 2), 0.5), np.array([[1.0, 2.0], [0.0, 0.0], [0.0, 0.0]])
    walk = boxes.walk(start - np.array([[5.0], [0.0], [0.0]]), way, np.full(2, np.inf))
    ray, box = walk.step()
    assert box.tolist() == [0, 0]
    walk.shorten(ray, np.array([-1.0, np.inf]))
    later = []
    while (step := walk.step()) is not None:
        later.append(step)
    assert all(step[0].tolist() == [1] for step in later)
    assert {int(step[1][0]) for step in later} == {1, 2}
