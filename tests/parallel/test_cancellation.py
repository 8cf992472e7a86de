# SPDX-License-Identifier: GPL-3.0-or-later
"""A render that is cancelled says so with an exception of its own, also from a worker."""

from __future__ import annotations

import pickle

import pytest

from adaptive_drt.parallel.cancellation import RenderCancelled
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from random_scenes import random_scene


def test_it_is_no_error_of_the_scene_and_passes_between_processes():
    assert not issubclass(RenderCancelled, ValueError | RuntimeError | OSError)
    assert isinstance(pickle.loads(pickle.dumps(RenderCancelled("why"))), RenderCancelled)


def test_it_is_raised_once_the_event_is_set():
    plan = make_plan(random_scene(1), Settings())
    plan.raise_if_cancelled()
    plan.stop.set()
    with pytest.raises(RenderCancelled):
        plan.raise_if_cancelled()
