# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes that a view layer can ask for, and this engine does not make.

A pass that nobody looks at is not missed. Where a compositing tree uses one, its node is listed;
the tables list passes of a file that is to hold them all.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..coverage import Listed, Table


def goes_to_layers(owner: Any) -> bool:
    """Whether a view layer's passes are all written to a file."""
    return bool(owner.id_data.render.image_settings.file_format == "OPEN_EXR_MULTILAYER")


def passes(names: Mapping[str, str]) -> Table:
    """Return entries for switches of passes, by what a person calls each pass."""
    return {
        switch: Listed(
            neutral=(False,),
            when=goes_to_layers,
            reason=f"its {name} pass is not made and will not be in the multilayer file",
        )
        for switch, name in names.items()
    }
