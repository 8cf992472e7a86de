# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour management: Blender applies it to the finished picture, whatever engine made it."""

from __future__ import annotations

from ..coverage import Table, Use
from ..datablock_table import GROUP

VIEW: Table = {
    **GROUP,
    **dict.fromkeys(
        (
            "view_transform",
            "look",
            "exposure",
            "gamma",
            "use_curve_mapping",
            "curve_mapping",
            "use_white_balance",
            "white_balance_temperature",
            "white_balance_tint",
            "white_balance_whitepoint",
        ),
        Use.RENDERED,
    ),
    # of the screen alone, and facts about the view transform
    **dict.fromkeys(("use_hdr_view", "is_hdr", "support_emulation"), Use.NO_EFFECT),
}

DISPLAY: Table = {
    **GROUP,
    **dict.fromkeys(("display_device", "emulation"), Use.RENDERED),
}

SEQUENCER_COLOR: Table = {**GROUP, "name": Use.RENDERED}
"""Its name is the colour space in which Blender mixes strips."""
