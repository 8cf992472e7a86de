# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of objects, by the part an object plays in a picture.

What of them reaches an instance was measured in Cycles of 4.2, 4.5, 5.0 and 5.2: the outermost
instancer's Ray Visibility takes away from the instances' own, its Holdout is in force in place of
theirs, and its Shadow Catcher beside theirs. Instancers within instancers are not asked.
"""

from __future__ import annotations

from typing import Any

from ..coverage import Listed, Table, Use
from ..datablock_table import GROUP, ID


def subdivides_adaptively(thing: Any) -> bool:
    """Whether a modifier of an object is one that Cycles replaces by its own subdivision."""
    return any(
        getattr(modifier, "use_adaptive_subdivision", False) and modifier.show_render
        for modifier in thing.modifiers
    )


ADAPTIVE = "its adaptive subdivision is left out: the levels of its Subdivision modifier are used"

SHAPE: Table = {
    **ID,
    # what it is, and where
    **dict.fromkeys(
        (
            "type",
            "data",
            "mode",
            "material_slots",
            "hide_render",
            "parent",
            "parent_type",
            "parent_vertices",
            "use_parent_final_indices",
            "parent_bone",
            "parent_bone_head_tail_factor",
            "track_axis",
            "up_axis",
            "location",
            "rotation_quaternion",
            "rotation_axis_angle",
            "rotation_euler",
            "rotation_mode",
            "scale",
            "dimensions",
            "delta_location",
            "delta_rotation_euler",
            "delta_rotation_quaternion",
            "delta_scale",
            "matrix_world",
            "matrix_local",
            "matrix_basis",
            "matrix_parent_inverse",
            "constraints",
            "animation_data",
        ),
        Use.RENDERED,
    ),
    # its form: Blender has applied these
    "modifiers": Listed(neutral=(), when=subdivides_adaptively, reason=ADAPTIVE),
    **dict.fromkeys(
        (
            "add_rest_position_attribute",
            "vertex_groups",
            "pose",
            "show_only_shape_key",
            "field",
            "collision",
            "soft_body",
            "rigid_body",
            "rigid_body_constraint",
            "use_simulation_cache",
        ),
        Use.RENDERED,
    ),
    # instances, its own among them
    **dict.fromkeys(
        (
            "particle_systems",
            "instance_type",
            "instance_collection",
            "use_instance_vertices_rotation",
            "use_instance_faces_scale",
            "instance_faces_scale",
            "show_instancer_for_render",
            "is_instancer",
            "is_from_instancer",
            "is_from_set",
        ),
        Use.RENDERED,
    ),
    # Grease Pencil, which Blender draws, and Line Art for it
    **dict.fromkeys(
        ("grease_pencil_modifiers", "shader_effects", "use_grease_pencil_lights", "lineart"),
        Use.RENDERED,
    ),
    # settings with tables of their own
    "cycles": Use.RENDERED,
    # of what shines: a table of its own
    "light_linking": Use.RENDERED,
    # the rays that meet it; without diffuse ones what shines lights nothing here
    **dict.fromkeys(("visible_camera", "visible_shadow", "visible_diffuse"), Use.RENDERED),
    "is_holdout": Use.RENDERED,
    "is_shadow_catcher": Listed(
        neutral=(False,),
        reason="its Shadow Catcher is left out: it is rendered as any surface; "
        "hide it from renders if it must not be seen",
    ),
    # indirect light, reflections and volumes, which this engine has for no object
    **dict.fromkeys(
        (
            "visible_glossy",
            "visible_transmission",
            "visible_volume_scatter",
            "visible_raycast",
        ),
        Use.NO_EFFECT,
    ),
    # shadow terminators of smooth shading: balls are round here, and meshes follow the defaults
    **dict.fromkeys(
        (
            "shadow_terminator_normal_offset",
            "shadow_terminator_geometry_offset",
            "shadow_terminator_shading_offset",
        ),
        Use.COVERED,
    ),
    # read by nodes and passes alone, which are listed themselves
    **dict.fromkeys(("color", "pass_index", "lightgroup"), Use.COVERED),
    # EEVEE's light probes
    **dict.fromkeys(("hide_probe_volume", "hide_probe_sphere", "hide_probe_plane"), Use.NO_EFFECT),
    # empties that show an image, in the viewport alone
    **dict.fromkeys(
        (
            "empty_display_type",
            "empty_display_size",
            "empty_image_offset",
            "empty_image_depth",
            "empty_image_side",
            "image_user",
            "show_empty_image_perspective",
            "show_empty_image_orthographic",
            "show_empty_image_only_axis_aligned",
            "use_empty_image_alpha",
        ),
        Use.NO_EFFECT,
    ),
    # the viewport
    **dict.fromkeys(
        (
            "hide_viewport",
            "hide_select",
            "hide_surface_pick",
            "show_instancer_for_viewport",
            "display",
            "display_type",
            "display_bounds_type",
            "show_bounds",
            "show_name",
            "show_axis",
            "show_texture_space",
            "show_wire",
            "show_all_edges",
            "show_transparent",
            "show_in_front",
            "bound_box",
            "motion_path",
            "animation_visualization",
        ),
        Use.NO_EFFECT,
    ),
    # editing
    **dict.fromkeys(
        (
            "use_camera_lock_parent",
            "active_material",
            "active_material_index",
            "active_shape_key",
            "active_shape_key_index",
            "use_shape_key_edit_mode",
            "use_dynamic_topology_sculpting",
            "use_mesh_mirror_x",
            "use_mesh_mirror_y",
            "use_mesh_mirror_z",
            "lock_location",
            "lock_rotation",
            "lock_rotation_w",
            "lock_rotations_4d",
            "lock_scale",
            "selection_sets",
            "active_selection_set",
        ),
        Use.NO_EFFECT,
    ),
}
"""Of a shape that stands in the scene itself."""

INSTANCED: Table = {**SHAPE, "is_holdout": Use.NO_EFFECT}
"""Of a shape that another object repeats: that one's Holdout is in force."""

INSTANCER: Table = {
    **SHAPE,
    # it may have no form of its own
    "modifiers": Use.RENDERED,
    "is_shadow_catcher": Listed(
        neutral=(False,),
        reason="its Shadow Catcher is left out: what it instances is rendered as any surface; "
        "hide it from renders if that must not be seen",
    ),
}
"""Of an object that repeats shapes: an empty, or one with a mesh of its own."""


LAMP: Table = {
    **SHAPE,
    "modifiers": Use.RENDERED,
    # nothing of Cycles' picture follows these for a light
    **dict.fromkeys(("visible_shadow", "is_holdout", "is_shadow_catcher"), Use.NO_EFFECT),
}
"""Of a light."""


LIGHT_LINKING: Table = {
    **GROUP,
    # a collection without objects links nothing
    **dict.fromkeys(("receiver_collection", "blocker_collection"), Use.RENDERED),
}
"""Of what gives light."""
