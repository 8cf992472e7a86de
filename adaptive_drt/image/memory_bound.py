# SPDX-License-Identifier: GPL-3.0-or-later
"""A bound on the memory of a render, computed before it begins.

It holds for a picture in which every pixel is traced, cut by outlines and corrected; most pictures
take a half or less. Beyond it are scenes whose pixels have hundreds of occluders in closed form.
"""

from __future__ import annotations

from ..tracing.compile import Plan

__all__ = ["listed_pixels", "memory_bound"]

FILM_BYTES = 71
"""Bytes of a pixel in a film: 8 float64, a count and 3 flags."""
FRAME_BYTES = 204
"""Bytes of a pixel in a frame, if it is traced: 12 predicted errors, 10 other numbers, 12 flags."""
SAMPLED_BYTES = 170
"""Bytes of a pixel in the frame of a scene whose pixels may be sampled, with its centre's light."""
CORRECTED_BYTES = 190
"""Bytes of a pixel while its mean is computed from its neighbours, and of its correction."""
RAYS_BYTES = 120
"""Bytes of a pixel in the working arrays of method 'RAYS', which has no frame."""
OBJECT_BYTES = 500
"""Bytes of an object in each process: the compiled scene, its groups and embree's tree, and what
making them takes for a moment. Measured with a million spheres, of which 240 bytes stay; faces of
meshes take less."""
CALL_BYTES, CALL_PIXELS = 3_000, 262_144
"""Bytes of a pixel in a call that traces it, and largest number of pixels in one call."""
MAX_PAIRS, MIN_LISTED = 1 << 27, 1_024
"""Largest number of pairs of pixels and objects of which candidates are listed together, unless the
pixels are fewer than the second number: single points have thousands of candidate occluders, of 100
bytes each, where hundreds of thousands of objects lie before a light."""
CALL_BASE = 256 << 20
"""Bytes of a call whatever its number of pixels: chunks of points, rays and pairs."""
WORKER_BYTES = 120 << 20
"""Bytes of a worker process before its first call, with its modules."""


def memory_bound(plan: Plan, workers: int) -> int:
    """Bytes that a render takes at most, in this process and so many workers together."""
    left, bottom, right, top = plan.region
    region, picture = (right - left) * (top - bottom), plan.resolution[0] * plan.resolution[1]
    # a part of a picture has a frame of the whole for its goal
    framed = region if region == picture else region + picture
    each = FRAME_BYTES + CORRECTED_BYTES + SAMPLED_BYTES * plan.may_sample
    if plan.settings.method != "EXACT":
        framed, each = region, RAYS_BYTES
    call = CALL_BASE + CALL_BYTES * min(region, CALL_PIXELS)
    calls = max(1, min(plan.threads, workers + 1)) if workers else plan.threads
    return (
        FILM_BYTES * region
        + each * framed
        + OBJECT_BYTES * plan.object_count * (1 + workers)
        + WORKER_BYTES * workers
        + call * calls
    )


def listed_pixels(plan: Plan) -> int:
    """Largest number of pixels of whose points the candidate occluders are listed together."""
    return max(MIN_LISTED, MAX_PAIRS // max(plan.object_count, 1))
