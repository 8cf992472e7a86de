# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's own settings as the core's."""

from __future__ import annotations

from typing import Any

from ..adaptive_drt.scene.settings import Settings


def settings_of(scene: Any) -> Settings:
    """Return a Blender scene's settings, read from its `adaptive_drt` properties."""
    chosen = scene.adaptive_drt
    return Settings(
        method=chosen.method,
        # as it was typed: Blender keeps float32, where 0.001 is 0.0010000000475
        tolerance=float(f"{chosen.tolerance:.7g}"),
        order=int(chosen.order),
        distribution=chosen.distribution,
        light_rays=chosen.light_rays,
        time_rays=chosen.time_rays,
        pixel_rays=chosen.pixel_rays,
        use_penumbra=chosen.use_penumbra,
        use_motion=chosen.use_motion,
        use_edges=chosen.use_edges,
        seed=chosen.seed,
        threads=chosen.threads,
    )
