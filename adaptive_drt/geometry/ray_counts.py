# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of rays that were traced against meshes and sets of spheres, by kind, for the statistics.

Each thread counts its own, so that the rays of a call are the difference of the counts after and
before it, whatever other threads do.
"""

from __future__ import annotations

import threading

__all__ = ["RAY_KINDS", "count_rays", "counted_rays", "rays_since"]


RAY_KINDS = (
    "nearest", "shadow", "instance nearest", "instance shadow", "solid nearest", "solid shadow",
)  # fmt: skip
"""Rays that look for the nearest face, and that ask whether there is any; the same of instances
that embree takes rays to, and of solids that are traced as one set."""

_own = threading.local()


def count_rays(kind: str, count: int) -> None:
    """Count rays of a kind that this thread has traced."""
    counts = _own.__dict__
    counts[kind] = counts.get(kind, 0) + count


def counted_rays() -> dict[str, int]:
    """Numbers of rays that this thread has traced so far, by kind."""
    return {kind: _own.__dict__.get(kind, 0) for kind in RAY_KINDS}


def rays_since(before: dict[str, int]) -> dict[str, int]:
    """Numbers of rays that this thread has traced since it had counted so many, by kind."""
    return {kind: count - before[kind] for kind, count in counted_rays().items()}
