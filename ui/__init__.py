# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user sees of the add-on: properties and panels."""

from . import engine_panels, menus, panels, properties


def register() -> None:
    properties.register()
    panels.register()
    engine_panels.register()
    menus.register()


def unregister() -> None:
    menus.unregister()
    engine_panels.unregister()
    panels.unregister()
    properties.unregister()
