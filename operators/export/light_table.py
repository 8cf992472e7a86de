# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done with each setting of a light."""

from __future__ import annotations

from .coverage import Table, Use
from .datablock_table import GROUP, ID

LIGHT: Table = {
    **ID,
    "type": Use.RENDERED,
    **dict.fromkeys(("color", "use_shadow", "use_nodes", "node_tree"), Use.RENDERED),
    **dict.fromkeys(("use_temperature", "temperature", "exposure", "normalize"), Use.RENDERED),
    # Blender's reading of `temperature`
    "temperature_color": Use.RENDERED,
    "cycles": Use.RENDERED,  # its own table
    # EEVEE's: Cycles gives the same picture at any of these
    **dict.fromkeys(
        (
            *("diffuse_factor", "specular_factor", "transmission_factor", "volume_factor"),
            *("use_custom_distance", "cutoff_distance"),
        ),
        Use.NO_EFFECT,
    ),
}

SHADOWS: Table = dict.fromkeys(
    # of EEVEE's shadow maps
    (
        *("shadow_buffer_clip_start", "shadow_buffer_bias", "shadow_color", "use_contact_shadow"),
        *("contact_shadow_distance", "contact_shadow_bias", "contact_shadow_thickness"),
        *("shadow_filter_radius", "shadow_maximum_resolution", "use_shadow_jitter"),
        *("shadow_jitter_overblur", "use_absolute_resolution", "shadow_cascade_max_distance"),
        *("shadow_cascade_count", "shadow_cascade_exponent", "shadow_cascade_fade"),
    ),
    Use.NO_EFFECT,
)

POINT: Table = {
    **LIGHT,
    **SHADOWS,
    **dict.fromkeys(("energy", "shadow_soft_size", "use_soft_falloff"), Use.RENDERED),
}

AREA: Table = {
    **LIGHT,
    **SHADOWS,
    **dict.fromkeys(("energy", "shape", "size", "size_y", "spread"), Use.RENDERED),
    # area lights have no radius
    "shadow_soft_size": Use.NO_EFFECT,
}

SPOT: Table = {
    **LIGHT,
    **SHADOWS,
    **dict.fromkeys(
        ("energy", "shadow_soft_size", "use_soft_falloff", "spot_blend", "spot_size"), Use.RENDERED
    ),
    # drawn by the viewport; measured: Cycles has no square cones
    **dict.fromkeys(("show_cone", "use_square"), Use.NO_EFFECT),
}

SUN: Table = {
    **LIGHT,
    **SHADOWS,
    **dict.fromkeys(("angle", "energy"), Use.RENDERED),
    # sun lights have an angle, and no radius
    "shadow_soft_size": Use.NO_EFFECT,
}

CYCLES_LIGHT: Table = {
    **GROUP,
    # a portal gives no light of its own
    "is_portal": Use.RENDERED,
    # how rays are spent, and how far light goes on from the first surface that it meets
    **dict.fromkeys(("max_bounces", "use_multiple_importance_sampling"), Use.NO_EFFECT),
    # light that glass refracts: the glass has a line
    "is_caustics_light": Use.COVERED,
}

TABLES: dict[str, Table] = {
    "Light": LIGHT,
    "PointLight": POINT,
    "AreaLight": AREA,
    "SpotLight": SPOT,
    "SunLight": SUN,
    "CyclesLightSettings": CYCLES_LIGHT,
}
"""By the identifiers of the RNA structs."""

BY_TYPE: dict[str, Table] = {"POINT": POINT, "AREA": AREA, "SPOT": SPOT, "SUN": SUN}
"""By the types of lights."""
