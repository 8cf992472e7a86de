# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done with each setting of a world."""

from __future__ import annotations

from .coverage import Table, Use
from .datablock_table import GROUP, ID

WORLD: Table = {
    **ID,
    **dict.fromkeys(("color", "use_nodes", "node_tree"), Use.RENDERED),
    # their own tables
    **dict.fromkeys(("cycles", "cycles_visibility"), Use.RENDERED),
    **dict.fromkeys(("light_settings", "mist_settings"), Use.COVERED),
    # into which of a view layer's passes its light goes; the sum is the same
    "lightgroup": Use.NO_EFFECT,
    # EEVEE's
    **dict.fromkeys(
        (
            *("use_eevee_finite_volume", "probe_resolution", "sun_threshold", "sun_angle"),
            *("use_sun_shadow", "sun_shadow_maximum_resolution", "sun_shadow_filter_radius"),
            *("use_sun_shadow_jitter", "sun_shadow_jitter_overblur"),
        ),
        Use.NO_EFFECT,
    ),
}

MIST: Table = {
    **GROUP,
    # it shapes the Mist pass alone, and a pass that is missing has a line
    **dict.fromkeys(("use_mist", "intensity", "start", "depth", "height", "falloff"), Use.COVERED),
}

LIGHTING: Table = {
    **GROUP,
    # of Cycles' Fast GI Approximation, which the scene's table lists
    **dict.fromkeys(("ao_factor", "distance"), Use.COVERED),
}

CYCLES_WORLD: Table = {
    **GROUP,
    # how rays are spent
    **dict.fromkeys(("sampling_method", "sample_map_resolution", "max_bounces"), Use.NO_EFFECT),
    # of light that mirrors and glass send on, which have lines
    "is_caustics_light": Use.COVERED,
    "use_shadows": Use.RENDERED,
    # of its volume, which has a line
    **dict.fromkeys(
        ("homogeneous_volume", "volume_sampling", "volume_interpolation", "volume_step_size"),
        Use.COVERED,
    ),
}

VISIBILITY: Table = {
    **GROUP,
    # whether it is seen, and whether it throws light on surfaces
    **dict.fromkeys(("camera", "diffuse"), Use.RENDERED),
    # of rays that mirrors, glass and volumes send on, which have lines
    **dict.fromkeys(("glossy", "transmission", "scatter"), Use.COVERED),
    # Cycles has no such setting of a world
    "shadow": Use.NO_EFFECT,
}

TABLES: dict[str, Table] = {
    "World": WORLD,
    "WorldMistSettings": MIST,
    "WorldLighting": LIGHTING,
    "CyclesWorldSettings": CYCLES_WORLD,
    "CyclesVisibilitySettings": VISIBILITY,
}
"""By the identifiers of the RNA structs."""
