# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' own settings, which its users expect of any renderer of their scenes."""

from __future__ import annotations

from typing import Any

from ..coverage import Listed, Table, Use
from ..datablock_table import GROUP
from .object import ADAPTIVE
from .passes import passes
from .render import blurs

WIDE = 2.08
"""Pixels: a Blackman-Harris filter of this width spreads as far as this engine's box of one."""


def _blurs_pixels(cycles: Any) -> bool:
    return bool(cycles.pixel_filter_type != "BOX" and cycles.filter_width > WIDE)


def _adds_light(cycles: Any) -> bool:
    return bool(cycles.use_fast_gi)


def _culls(switch: str) -> Any:
    """Return whether an object is culled at all: scene, object and Simplify must be on for it."""

    def of(cycles: Any) -> bool:
        scene = cycles.id_data.original
        return scene.render.use_simplify and any(
            getattr(thing.cycles, switch) for thing in scene.objects
        )

    return of


def _dices(cycles: Any) -> bool:
    thing = cycles.id_data.original
    last = thing.modifiers[-1] if len(thing.modifiers) else None
    return (
        last is not None
        and last.type == "SUBSURF"
        and last.show_render
        # 4.x alone has this setting here, and heeds it where the scene is experimental
        and any(scene.cycles.feature_set == "EXPERIMENTAL" for scene in thing.users_scene)
    )


CYCLES: Table = {
    **GROUP,
    # applied to lights and background
    "film_exposure": Use.RENDERED,
    # any of them stands for the mean over the pixel here
    "pixel_filter_type": Use.NO_EFFECT,
    "filter_width": Listed(
        neutral=(),
        when=_blurs_pixels,
        reason="its Pixel Filter of {value} px is left out: each pixel is the mean over "
        "itself; blur the picture in the compositor, or set the width to 1.5 (under Cycles)",
    ),
    "rolling_shutter_type": Listed(
        neutral=("NONE",),
        when=lambda cycles: blurs(cycles.id_data),
        reason="its Rolling Shutter is left out: all lines are exposed at once; "
        "set it to None (in Motion Blur, under Cycles)",
    ),
    "rolling_shutter_duration": Use.COVERED,  # of that
    "sample_clamp_direct": Listed(
        neutral=(0.0,),
        reason="its Clamping of direct light at {value} is left out: "
        "bright light stays as it is; set it to 0 (in Light Paths, under Cycles)",
    ),
    "fast_gi_method": Listed(
        neutral=("REPLACE",),
        when=_adds_light,
        reason="the light that Fast GI adds is left out: add lights, or switch it off "
        "(in Light Paths, under Cycles)",
    ),
    # it replaces indirect light, of which this engine has none
    **dict.fromkeys(("use_fast_gi", "ao_bounces", "ao_bounces_render"), Use.NO_EFFECT),
    "use_camera_cull": Listed(
        neutral=(False,),
        when=_culls("use_camera_cull"),
        reason="its Camera Culling is left out: what is out of view casts its shadows all the "
        "same; switch it off (in Simplify, under Cycles)",
    ),
    "use_distance_cull": Listed(
        neutral=(False,),
        when=_culls("use_distance_cull"),
        reason="its Distance Culling is left out: what is far away is rendered all the same; "
        "hide that from renders, or switch it off (in Simplify, under Cycles)",
    ),
    **dict.fromkeys(("camera_cull_margin", "distance_cull_margin"), Use.COVERED),  # of those
    # samples: how Cycles finds its picture, not which
    **dict.fromkeys(
        (
            "samples",
            "sample_offset",
            "use_sample_subset",
            "sample_subset_length",
            "time_limit",
            "sampling_pattern",
            "scrambling_distance",
            "auto_scrambling_distance",
            "use_pixel_jitter",
            "use_layer_samples",
            "light_sampling_threshold",
            "use_adaptive_sampling",
            "adaptive_threshold",
            "adaptive_min_samples",
            "direct_light_sampling_type",
            "use_light_tree",
            "seed",
            "use_animated_seed",
            "use_denoising",
            "denoiser",
            "denoising_prefilter",
            "denoising_quality",
            "denoising_input_passes",
            "denoising_use_gpu",
            "use_guiding",
            "use_deterministic_guiding",
            "guiding_distribution_type",
            "guiding_directional_sampling_type",
            "use_surface_guiding",
            "surface_guiding_probability",
            "use_volume_guiding",
            "volume_guiding_probability",
            "guiding_training_samples",
            "use_guiding_direct_light",
            "use_guiding_mis_weights",
            "guiding_roughness_threshold",
        ),
        Use.NO_EFFECT,
    ),
    # indirect light: this engine renders direct light alone, as its documents say
    **dict.fromkeys(
        (
            "max_bounces",
            "min_light_bounces",
            "diffuse_bounces",
            "glossy_bounces",
            "transmission_bounces",
            "sample_clamp_indirect",
            "caustics_reflective",
            "caustics_refractive",
            "blur_glossy",
        ),
        Use.NO_EFFECT,
    ),
    # glass, transparency, volumes and image textures, which are listed by their materials
    **dict.fromkeys(
        (
            "min_transparent_bounces",
            "transparent_max_bounces",
            "film_transparent_glass",
            "film_transparent_roughness",
            "volume_bounces",
            "volume_biased",
            "volume_step_rate",
            "volume_max_steps",
            "texture_limit_render",
            "texture_resolution_render",
            "shading_system",
        ),
        Use.COVERED,
    ),
    # adaptive subdivision, listed with the objects that use it
    **dict.fromkeys(
        (
            "feature_set",
            "dicing_rate",
            "max_subdivisions",
            "dicing_camera",
            "offscreen_dicing_scale",
        ),
        Use.COVERED,
    ),
    # speed, memory and baking
    **dict.fromkeys(
        (
            "device",
            "use_auto_tile",
            "tile_size",
            "debug_bvh_type",
            "debug_bvh_layout",
            "debug_bvh_time_steps",
            "debug_use_spatial_splits",
            "debug_use_hair_bvh",
            "debug_use_compact_bvh",
            "debug_use_cpu_avx2",
            "debug_use_cpu_sse42",
            "debug_use_cuda_adaptive_compile",
            "debug_use_hip_adaptive_compile",
            "debug_use_metal_adaptive_compile",
            "debug_use_optix_debug",
            "debug_use_texture_cache_eviction",
            "debug_texture_cache_preserve_unused",
            "bake_type",
        ),
        Use.NO_EFFECT,
    ),
    # the viewport
    **dict.fromkeys(
        (
            "preview_pause",
            "preview_samples",
            "preview_scrambling_distance",
            "preview_dicing_rate",
            "use_preview_adaptive_sampling",
            "preview_adaptive_threshold",
            "preview_adaptive_min_samples",
            "use_preview_denoising",
            "preview_denoiser",
            "preview_denoising_prefilter",
            "preview_denoising_quality",
            "preview_denoising_input_passes",
            "preview_denoising_start_sample",
            "preview_denoising_use_gpu",
            "volume_preview_step_rate",
            "texture_limit",
            "texture_resolution",
        ),
        Use.NO_EFFECT,
    ),
}

CYCLES_CURVES: Table = {
    **GROUP,
    # whether hair is straight between its points; ribbons are rendered as what they look like
    "shape": Use.RENDERED,
    # tubes follow the smooth curve
    "subdivisions": Use.NO_EFFECT,
}

CYCLES_LAYER: Table = {
    **GROUP,
    **passes(
        {
            "pass_debug_sample_count": "Sample Count",
            "pass_render_time": "Render Time",
            "use_pass_volume_direct": "Volume Direct",
            "use_pass_volume_indirect": "Volume Indirect",
            "use_pass_volume_scatter": "Volume Scatter",
            "use_pass_volume_transmit": "Volume Transmit",
            "use_pass_volume_majorant": "Volume Majorant",
            "use_pass_shadow_catcher": "Shadow Catcher",
            "denoising_store_passes": "Denoising Data",
        }
    ),
    # noise, and of those passes
    **dict.fromkeys(
        (
            "use_denoising",
            "denoising_pass_follow_reflections",
            "denoising_pass_use_albedo_roughness_weighting",
        ),
        Use.NO_EFFECT,
    ),
}

CYCLES_OBJECT: Table = {
    **GROUP,
    # an instancer's counts for what it instances, too
    "use_motion_blur": Use.RENDERED,
    # off is what this engine does; a form that changes during the shutter is told by its mesh
    "use_deform_motion": Use.RENDERED,
    # how closely Cycles follows a path; one that is not straight is told by its object
    "motion_steps": Use.NO_EFFECT,
    "use_adaptive_subdivision": Listed(neutral=(False,), when=_dices, reason=ADAPTIVE),
    "dicing_rate": Use.COVERED,  # of that
    # in force only with the scene's own switches, which are listed
    **dict.fromkeys(("use_camera_cull", "use_distance_cull"), Use.COVERED),
    # smooth shading, Fast GI and glass, which are listed themselves
    **dict.fromkeys(
        (
            "shadow_terminator_offset",
            "shadow_terminator_geometry_offset",
            "ao_distance",
            "is_caustics_caster",
            "is_caustics_receiver",
        ),
        Use.COVERED,
    ),
}
