# SPDX-License-Identifier: GPL-3.0-or-later
"""Every setting of scenes, view layers and objects is rendered, without effect, or listed."""

from __future__ import annotations

import coverage_walk
from conftest import PACKAGE

ELSEWHERE = {
    "Scene": """
        allow_preroll annotation compositing_node_group grease_pencil node_tree playback_loop_mode
        time_jump_delta time_jump_unit
    """,
    "RenderSettings": """
        anisotropic_filter bake_bias bake_margin bake_margin_type bake_samples bake_type
        bake_user_scale compositor_denoise_device compositor_denoise_final_quality
        compositor_denoise_preview_quality ppm_base ppm_factor save_output
        use_auto_generate_texture_cache use_bake_clear use_bake_lores_mesh use_bake_multires
        use_bake_selected_to_active use_bake_user_scale use_new_cpu_compositor
        use_texture_cache
    """,
    "ImageFormatSettings": """
        media_type use_exr_interleave
    """,
    "ColorManagedViewSettings": """
        is_hdr support_emulation use_hdr_view use_white_balance white_balance_temperature
        white_balance_tint white_balance_whitepoint
    """,
    "ColorManagedDisplaySettings": """
        emulation
    """,
    "ViewLayer": """
        use_grease_pencil use_pass_grease_pencil
    """,
    "Object": """
        grease_pencil_modifiers hide_surface_pick parent_bone_head_tail_factor
        shadow_terminator_geometry_offset shadow_terminator_normal_offset
        shadow_terminator_shading_offset use_parent_final_indices visible_raycast
    """,
    "CyclesRenderSettings": """
        debug_texture_cache_preserve_unused debug_use_hip_adaptive_compile
        debug_use_metal_adaptive_compile debug_use_texture_cache_eviction feature_set
        sample_subset_length texture_resolution texture_resolution_render use_pixel_jitter
        use_sample_subset volume_biased
    """,
    "CyclesRenderLayerSettings": """
        denoising_pass_follow_reflections denoising_pass_use_albedo_roughness_weighting
        pass_render_time use_pass_volume_majorant use_pass_volume_scatter use_pass_volume_transmit
    """,
    "CyclesObjectSettings": """
        dicing_rate use_adaptive_subdivision
    """,
}
"""What some of the tested Blenders have and others do not."""


def test_every_property_is_in_a_class(addon):
    found = coverage_walk.unclassified(PACKAGE)
    assert not found, "\n".join(found)


def test_no_name_is_of_no_blender(addon):
    """A name that this Blender does not have is one that another Blender is known to have."""
    known = {f"{struct}.{name}" for struct, names in ELSEWHERE.items() for name in names.split()}
    found = set(coverage_walk.unknown(PACKAGE)) - known
    assert not found, "\n".join(sorted(found))


def test_each_listed_setting_is_listed_when_it_is_set(addon):
    faults, count = coverage_walk.unlisted(PACKAGE)
    assert not faults, "\n".join(faults)
    assert count > 40


def test_the_startup_file_lists_no_setting(addon):
    found = coverage_walk.factory_issues(PACKAGE)
    assert {issue.kind for issue in found} <= {"WORLD", "MATERIAL"}, found
    assert not any(issue.missing for issue in found)
