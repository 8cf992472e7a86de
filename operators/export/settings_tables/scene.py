# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a scene itself."""

from __future__ import annotations

from ..coverage import Table, Use
from ..datablock_table import ID

SCENE: Table = {
    **ID,
    # what the picture is of
    **dict.fromkeys(
        ("camera", "world", "background_set", "objects", "collection", "view_layers"), Use.RENDERED
    ),
    # settings with tables of their own
    **dict.fromkeys(
        (
            "render",
            "cycles",
            "view_settings",
            "display_settings",
            "sequencer_colorspace_settings",
            "adaptive_drt",  # this add-on's own
        ),
        Use.RENDERED,
    ),
    # time: Blender has moved everything to the frame; a marker makes a camera the active one
    **dict.fromkeys(
        (
            "frame_current",
            "frame_subframe",
            "frame_float",
            "frame_current_final",
            "frame_start",
            "frame_end",
            "frame_step",
            "animation_data",
            "timeline_markers",
        ),
        Use.RENDERED,
    ),
    # physics, constraints and simulations: Blender has applied them
    **dict.fromkeys(
        (
            "rigidbody_world",
            "gravity",
            "use_gravity",
            "use_custom_simulation_range",
            "simulation_frame_start",
            "simulation_frame_end",
            "active_clip",
        ),
        Use.RENDERED,
    ),
    # what Blender does to the finished picture: compositor, sequencer, Grease Pencil. Passes that
    # a compositing tree asks for and this engine lacks are listed where its nodes are read.
    **dict.fromkeys(
        (
            "use_nodes",
            "node_tree",
            "compositing_node_group",
            "sequence_editor",
            "grease_pencil_settings",
        ),
        Use.RENDERED,
    ),
    # other engines' settings
    **dict.fromkeys(("eevee", "display", "hydra"), Use.NO_EFFECT),
    # the shape of hair
    "cycles_curves": Use.RENDERED,
    # sound
    **dict.fromkeys(
        (
            "use_audio",
            "use_audio_scrub",
            "audio_doppler_speed",
            "audio_doppler_factor",
            "audio_distance_model",
            "audio_volume",
        ),
        Use.NO_EFFECT,
    ),
    # playback, tools, and what is drawn in editors alone
    **dict.fromkeys(
        (
            "lock_frame_selection_to_range",
            "use_preview_range",
            "frame_preview_start",
            "frame_preview_end",
            "show_subframe",
            "show_keys_from_selected_only",
            "is_nla_tweakmode",
            "sync_mode",
            "allow_preroll",
            "playback_loop_mode",
            "time_jump_unit",
            "time_jump_delta",
            "keying_sets",
            "keying_sets_all",
            "tool_settings",
            "unit_settings",
            "safe_areas",
            "transform_orientation_slots",
            "cursor",
            "grease_pencil",  # annotations
            "annotation",
        ),
        Use.NO_EFFECT,
    ),
    # replaced by `render.stamp_note_text`
    "use_stamp_note": Use.NO_EFFECT,
}
