# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of triangles for embree's rays. This is the only file that uses embreex."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from typing import Any

import numpy as np

from ..numerics.arrays import Array, Ints

__all__ = ["has_embree", "make_embree_scene"]


def has_embree() -> bool:
    """Whether embree is installed."""
    return find_spec("embreex") is not None


def make_embree_scene(vertices: Array, faces: Ints) -> Any:
    """An `embreex.rtcore_scene.EmbreeScene` of triangles.

    Its first query builds embree's tree, which no two threads may do at a time.

    Parameters
    ----------
    vertices : (3, v), rounded to float32.  faces : (3, f) vertices of each triangle.
    """
    from embreex import rtcore_scene  # the native library loads on the first use only
    from embreex.mesh_construction import TriangleMesh

    # with a device for each scene embree crashes at some 1,500 scenes
    scene = rtcore_scene.EmbreeScene(_device())
    TriangleMesh(
        scene,
        np.ascontiguousarray(vertices.T, dtype=np.float32),
        np.ascontiguousarray(faces.T, dtype=np.int32),
    )
    return scene


@cache
def _device() -> Any:
    """The `embreex.rtcore.EmbreeDevice` of this process."""
    from embreex import rtcore

    return rtcore.EmbreeDevice()
