# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a scene's render, which all engines share."""

from __future__ import annotations

from typing import Any

from ..coverage import Listed, Table, Use
from ..datablock_table import GROUP


def blurs(scene: Any) -> bool:
    """Whether anything of a scene may be blurred by motion."""
    render, ours = scene.render, getattr(scene, "adaptive_drt", None)
    return (
        render.use_motion_blur
        and render.motion_blur_shutter > 0.0
        and getattr(ours, "use_motion", True)
        and any(layer.use_motion_blur for layer in scene.view_layers if layer.use)
    )


def _shutter_is_shaped(render: Any) -> bool:
    if not blurs(render.id_data):
        return False
    heights = {
        round(point.location[1], 4)
        for curve in render.motion_blur_shutter_curve.curves
        for point in curve.points
    }
    return len(heights) > 1


RENDER: Table = {
    **GROUP,
    # the picture, and its shutter
    **dict.fromkeys(
        (
            "engine",
            "resolution_x",
            "resolution_y",
            "resolution_percentage",
            "pixel_aspect_x",
            "pixel_aspect_y",
            "use_border",
            "border_min_x",
            "border_min_y",
            "border_max_x",
            "border_max_y",
            "use_crop_to_border",
            "film_transparent",
            "use_motion_blur",
            "motion_blur_shutter",
            "motion_blur_position",
        ),
        Use.RENDERED,
    ),
    "motion_blur_shutter_curve": Listed(
        neutral=(),
        when=_shutter_is_shaped,
        reason="its Shutter Curve is left out: the shutter is open evenly; "
        "reset the curve to a flat line (in Motion Blur, under Cycles)",
    ),
    "use_multiview": Listed(
        neutral=(False,),
        reason="Stereoscopy is left out, so its views are all alike: render each eye with a "
        "camera of its own, or switch Stereoscopy off (scene.render.use_multiview; its panel is "
        "in Output under Blender's own engines)",
    ),
    # in force with Stereoscopy alone
    **dict.fromkeys(("views", "stereo_views", "views_format", "use_spherical_stereo"), Use.COVERED),
    # time, and Simplify: Blender has applied them to what the engine is given
    **dict.fromkeys(
        (
            "fps",
            "fps_base",
            "frame_map_old",
            "frame_map_new",
            "use_simplify",
            "simplify_subdivision_render",
            "simplify_child_particles_render",
        ),
        Use.RENDERED,
    ),
    # what Blender draws over the picture: Freestyle, Grease Pencil, stamps
    **dict.fromkeys(
        (
            "use_freestyle",
            "line_thickness_mode",
            "line_thickness",
            "simplify_gpencil",
            "simplify_gpencil_antialiasing",
            "simplify_gpencil_view_fill",
            "simplify_gpencil_modifier",
            "simplify_gpencil_shader_fx",
            "simplify_gpencil_tint",
            "use_stamp",
            "use_stamp_camera",
            "use_stamp_date",
            "use_stamp_filename",
            "use_stamp_frame",
            "use_stamp_frame_range",
            "use_stamp_hostname",
            "use_stamp_labels",
            "use_stamp_lens",
            "use_stamp_marker",
            "use_stamp_memory",
            "use_stamp_note",
            "use_stamp_render_time",
            "use_stamp_scene",
            "use_stamp_sequencer_strip",
            "use_stamp_time",
            "stamp_background",
            "stamp_font_size",
            "stamp_foreground",
            "stamp_note_text",
            "metadata_input",
        ),
        Use.RENDERED,
    ),
    # what Blender does to the finished picture, and how it writes it
    **dict.fromkeys(
        (
            "use_compositing",
            "compositor_precision",
            "use_new_cpu_compositor",  # 4.3
            "compositor_denoise_final_quality",
            "use_sequencer",
            "dither_intensity",
            "image_settings",
            "ffmpeg",
            "ppm_base",
            "ppm_factor",
        ),
        Use.RENDERED,
    ),
    # which files are written, and where
    **dict.fromkeys(
        (
            "filepath",
            "file_extension",
            "use_file_extension",
            "use_overwrite",
            "use_placeholder",
            "use_render_cache",
            "save_output",
            "is_movie_format",
            "use_single_layer",
        ),
        Use.NO_EFFECT,
    ),
    # speed, memory and the interface; the threads are this add-on's own setting
    **dict.fromkeys(
        (
            "threads",
            "threads_mode",
            "use_lock_interface",
            "use_persistent_data",
            "compositor_device",
            "compositor_denoise_device",
            "has_multiple_engines",
        ),
        Use.NO_EFFECT,
    ),
    # the viewport
    **dict.fromkeys(
        (
            "preview_pixel_size",
            "simplify_subdivision",
            "simplify_child_particles",
            "simplify_volumes",
            "use_simplify_normals",
            "simplify_gpencil_onplay",
            "sequencer_gl_preview",
            "use_sequencer_override_scene_strip",
            "compositor_denoise_preview_quality",
        ),
        Use.NO_EFFECT,
    ),
    # EEVEE and Workbench: their pixel filter, hair and textures
    **dict.fromkeys(
        ("filter_size", "hair_type", "hair_subdiv", "use_high_quality_normals"), Use.NO_EFFECT
    ),
    # image textures: a material that uses one is listed itself
    **dict.fromkeys(
        ("anisotropic_filter", "use_texture_cache", "use_auto_generate_texture_cache"),
        Use.COVERED,
    ),
    # baking is no render
    **dict.fromkeys(
        (
            "bake",
            "bake_type",
            "use_bake_selected_to_active",
            "use_bake_clear",
            "bake_margin",
            "bake_margin_type",
            "bake_bias",
            "use_bake_multires",
            "use_bake_lores_mesh",
            "bake_samples",
            "use_bake_user_scale",
            "bake_user_scale",
        ),
        Use.NO_EFFECT,
    ),
}
