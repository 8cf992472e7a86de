# SPDX-License-Identifier: GPL-3.0-or-later
"""What every datablock and every RNA struct has, and no picture shows."""

from __future__ import annotations

from ..coverage import Table, Use

STRUCT: Table = dict.fromkeys(("rna_type", "name"), Use.NO_EFFECT)
"""Of any struct; settings of add-ons have a name, too."""

DATABLOCK: Table = {
    **STRUCT,
    # how Blender keeps it: in which file, for how many users, with which overrides
    **dict.fromkeys(
        (
            "asset_data",
            "id_type",
            "is_editable",
            "is_embedded_data",
            "is_evaluated",
            "is_library_indirect",
            "is_linked_packed",
            "is_missing",
            "is_runtime_data",
            "library",
            "library_weak_reference",
            "name_full",
            "original",
            "override_library",
            "preview",
            "session_uid",
            "tag",
            "use_extra_user",
            "use_fake_user",
            "users",
        ),
        Use.NO_EFFECT,
    ),
}
