# SPDX-License-Identifier: GPL-3.0-or-later
"""The sets of shapes of a compiled scene, by kind."""

from adaptive_drt.geometry.polygon.shape import ParallelogramSet
from adaptive_drt.geometry.sphere.shape import SphereSet

__all__ = ["quads_of", "spheres_of"]


def spheres_of(plan):
    """The spheres of a compiled scene; their object numbers begin with 0."""
    return next(one for one in plan.shapes.sets if isinstance(one, SphereSet))


def quads_of(plan):
    """The parallelograms of a compiled scene."""
    return next(one for one in plan.shapes.sets if isinstance(one, ParallelogramSet))
