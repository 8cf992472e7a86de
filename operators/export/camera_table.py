# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done with each setting of a camera."""

from __future__ import annotations

from .coverage import Listed, Table, Use
from .datablock_table import GROUP, ID

CAMERA: Table = {
    **ID,
    "type": Use.RENDERED,  # any but Perspective is refused with an error
    **dict.fromkeys(
        ("lens", "sensor_fit", "sensor_width", "sensor_height", "shift_x", "shift_y"), Use.RENDERED
    ),
    # its own table
    "dof": Use.RENDERED,
    # each thing that the clipping would cut is named, with the camera's Clip Start or Clip End
    **dict.fromkeys(("clip_start", "clip_end"), Use.COVERED),
    # other ways to set the focal length
    **dict.fromkeys(("angle", "angle_x", "angle_y", "lens_unit"), Use.NO_EFFECT),
    # of orthographic, panoramic and custom cameras, which are refused
    **dict.fromkeys(
        (
            *("ortho_scale", "panorama_type", "fisheye_fov", "fisheye_lens"),
            *("latitude_min", "latitude_max", "longitude_min", "longitude_max"),
            *("fisheye_polynomial_k0", "fisheye_polynomial_k1", "fisheye_polynomial_k2"),
            *("fisheye_polynomial_k3", "fisheye_polynomial_k4"),
            *("central_cylindrical_range_u_min", "central_cylindrical_range_u_max"),
            *("central_cylindrical_range_v_min", "central_cylindrical_range_v_max"),
            *("central_cylindrical_radius", "custom_filepath", "custom_shader", "custom_mode"),
            *("custom_bytecode", "custom_bytecode_hash", "cycles_custom"),
        ),
        Use.COVERED,
    ),
    # the scene's Stereoscopy has a line of its own
    "stereo": Use.COVERED,
    # what the viewport draws over its picture, and behind it
    **dict.fromkeys(
        (
            *("display_size", "passepartout_alpha", "show_passepartout", "show_limits"),
            *("show_mist", "show_name", "show_sensor", "show_safe_areas", "show_safe_center"),
            *("show_composition_center", "show_composition_center_diagonal"),
            *("show_composition_thirds", "show_composition_golden"),
            *("show_composition_golden_tria_a", "show_composition_golden_tria_b"),
            *("show_composition_harmony_tri_a", "show_composition_harmony_tri_b"),
            *("composition_guide_color", "show_background_images", "background_images"),
        ),
        Use.NO_EFFECT,
    ),
}

DEPTH_OF_FIELD: Table = {
    **GROUP,
    "use_dof": Listed((False,), "its depth of field is left out"),
    **dict.fromkeys(
        (
            *("focus_object", "focus_subtarget", "focus_distance", "aperture_fstop"),
            *("aperture_blades", "aperture_rotation", "aperture_ratio"),
        ),
        Use.COVERED,
    ),
}

STEREO: Table = {
    **GROUP,
    # the scene's Stereoscopy has a line of its own
    **dict.fromkeys(
        (
            *("convergence_mode", "convergence_distance", "pivot", "interocular_distance"),
            *("use_spherical_stereo", "use_pole_merge", "pole_merge_angle_from"),
            "pole_merge_angle_to",
        ),
        Use.COVERED,
    ),
}

BACKGROUND_IMAGE: Table = {
    **GROUP,
    # no render shows a camera's background images: they are the viewport's
    **dict.fromkeys(
        (
            *("is_override_data", "source", "image", "clip", "image_user", "clip_user", "offset"),
            *("scale", "rotation", "use_flip_x", "use_flip_y", "alpha", "show_expanded"),
            *("use_camera_clip", "show_background_image", "show_on_foreground"),
            *("display_depth", "frame_method"),
        ),
        Use.NO_EFFECT,
    ),
}

CUSTOM_CAMERA: Table = dict(GROUP)
"""Cycles' settings of a custom camera, which is refused; each shader makes its own."""

TABLES: dict[str, Table] = {
    "Camera": CAMERA,
    "CameraDOFSettings": DEPTH_OF_FIELD,
    "CameraStereoData": STEREO,
    "CameraBackgroundImage": BACKGROUND_IMAGE,
    "CyclesCustomCameraSettings": CUSTOM_CAMERA,
}
"""By the identifiers of the RNA structs."""
