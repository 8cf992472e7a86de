# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive DRT: a ray tracer for Blender that distributes rays only where it has to."""


def register() -> None:
    """Add the operators, properties and panels to Blender."""
    # bpy is imported only here, so that tools can import this package without Blender
    from . import operators, ui

    operators.register()
    ui.register()


def unregister() -> None:
    """Take everything away again, in reverse order."""
    from . import operators, ui

    ui.unregister()
    operators.unregister()
