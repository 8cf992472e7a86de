# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done with the settings that all datablocks have."""

from __future__ import annotations

from .coverage import Table, Use

ID: Table = {
    # the name of a datablock, its use, and where it is kept: all this is about the file
    **dict.fromkeys(
        (
            *("rna_type", "name", "name_full", "id_type", "session_uid", "users", "use_fake_user"),
            *("use_extra_user", "is_embedded_data", "is_linked_packed", "is_missing"),
            *("is_runtime_data", "is_editable", "tag", "is_library_indirect", "library"),
            *("library_weak_reference", "asset_data", "preview"),
        ),
        Use.NO_EFFECT,
    ),
    # Blender has applied overrides, animation and drivers to the datablocks that a render is given
    **dict.fromkeys(
        ("is_evaluated", "original", "override_library", "animation_data"), Use.RENDERED
    ),
}

GROUP: Table = dict.fromkeys(("rna_type", "name"), Use.NO_EFFECT)
"""Of a struct that is no datablock: both are about the file."""
