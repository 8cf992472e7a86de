# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user sees of the add-on: properties and panels."""

from . import panels, properties


def register() -> None:
    properties.register()
    panels.register()


def unregister() -> None:
    panels.unregister()
    properties.unregister()
