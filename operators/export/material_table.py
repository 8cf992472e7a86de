# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done with each setting of a material."""

from __future__ import annotations

from .coverage import Table, Use
from .datablock_table import GROUP, ID

MATERIAL: Table = {
    **ID,
    **dict.fromkeys(("use_nodes", "node_tree"), Use.RENDERED),
    # the colour of a material that has no nodes
    "diffuse_color": Use.RENDERED,
    # the viewport's
    **dict.fromkeys(
        ("specular_color", "roughness", "specular_intensity", "metallic"), Use.NO_EFFECT
    ),
    # EEVEE's: Cycles gives the same picture at any of these
    **dict.fromkeys(
        (
            *("surface_render_method", "blend_method", "shadow_method", "alpha_threshold"),
            *("use_transparency_overlap", "show_transparent_back", "use_backface_culling"),
            *("use_backface_culling_shadow", "use_backface_culling_lightprobe_volume"),
            *("use_transparent_shadow", "use_raytrace_refraction", "use_screen_refraction"),
            *("use_sss_translucency", "refraction_depth", "thickness_mode"),
            *("use_thickness_from_shadow", "volume_intersection_method"),
            "max_vertex_displacement",
        ),
        Use.NO_EFFECT,
    ),
    # how what is linked to Displacement is applied, which has a line
    "displacement_method": Use.COVERED,
    # its own table
    "cycles": Use.COVERED,
    # of Grease Pencil objects, of Line Art and of Freestyle: objects and scene have lines
    **dict.fromkeys(
        ("grease_pencil", "is_grease_pencil", "lineart", "line_color", "line_priority"), Use.COVERED
    ),
    # the Material Index pass, the preview and texture painting
    **dict.fromkeys(
        (
            *("pass_index", "preview_render_type", "use_preview_world", "texture_paint_images"),
            *("texture_paint_slots", "paint_active_slot", "paint_clone_slot"),
        ),
        Use.NO_EFFECT,
    ),
}

CYCLES_MATERIAL: Table = {
    **GROUP,
    # how rays are spent on a material that shines, which has a line
    "emission_sampling": Use.COVERED,
    # of normals that are linked, which have a line
    "use_bump_map_correction": Use.COVERED,
    # of its volume, which has a line
    **dict.fromkeys(
        ("homogeneous_volume", "volume_sampling", "volume_interpolation", "volume_step_rate"),
        Use.COVERED,
    ),
}

GREASE_PENCIL: Table = {
    **GROUP,
    # strokes are drawn on Grease Pencil objects alone, and these have lines
    **dict.fromkeys(
        (
            *("color", "fill_color", "mix_color", "mix_factor", "mix_stroke_factor"),
            *("texture_angle", "texture_scale", "texture_offset", "texture_clamp", "pixel_size"),
            *("hide", "lock", "ghost", "flip", "use_overlap_strokes", "use_stroke_holdout"),
            *("use_fill_holdout", "show_stroke", "show_fill", "alignment_mode"),
            *("alignment_rotation", "pass_index", "mode", "stroke_style", "stroke_image"),
            *("fill_style", "gradient_type", "fill_image", "is_stroke_visible"),
            *("is_fill_visible", "placement_mode", "placement_count", "placement_radius_spacing"),
            *("placement_density", "use_randomization", "random_size_factor"),
            *("random_strength_factor", "random_rotation_factor", "random_hue_factor"),
            *("random_saturation_factor", "random_value_factor", "random_noise_scale"),
        ),
        Use.COVERED,
    ),
}

LINE_ART: Table = {
    **GROUP,
    # Line Art makes strokes of Grease Pencil objects, and these have lines
    **dict.fromkeys(
        (
            *("use_material_mask", "use_material_mask_bits", "mat_occlusion"),
            *("intersection_priority", "use_intersection_priority_override"),
        ),
        Use.COVERED,
    ),
}

TABLES: dict[str, Table] = {
    "Material": MATERIAL,
    "CyclesMaterialSettings": CYCLES_MATERIAL,
    "MaterialGPencilStyle": GREASE_PENCIL,
    "MaterialLineArt": LINE_ART,
}
"""By the identifiers of the RNA structs."""
