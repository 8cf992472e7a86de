# SPDX-License-Identifier: GPL-3.0-or-later
"""How a finished picture is written: Blender does it, for all engines alike."""

from __future__ import annotations

from ..coverage import Table, Use
from ..datablock_table import GROUP

IMAGE_FORMAT: Table = {
    **GROUP,
    **dict.fromkeys(
        (
            "media_type",
            "file_format",
            "color_mode",
            "color_depth",
            "quality",
            "compression",
            "exr_codec",
            "use_exr_interleave",
            "use_jpeg2k_ycc",
            "use_jpeg2k_cinema_preset",
            "use_jpeg2k_cinema_48",
            "jpeg2k_codec",
            "tiff_codec",
            "use_cineon_log",
            "cineon_black",
            "cineon_white",
            "cineon_gamma",
            "color_management",
            "view_settings",
            "display_settings",
            "linear_colorspace_settings",
        ),
        Use.RENDERED,
    ),
    # in force with Stereoscopy alone, which is listed
    **dict.fromkeys(("views_format", "stereo_3d_format"), Use.COVERED),
    # a second file beside the picture, and a fact about the format
    **dict.fromkeys(("use_preview", "has_linear_colorspace"), Use.NO_EFFECT),
}
