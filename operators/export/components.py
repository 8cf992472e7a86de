# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object is made of besides a mesh, points and hair: volumes and Grease Pencil.

The depsgraph yields what nodes make of an object as instances of that same object, one for each
kind of geometry, whatever the object's own type is.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from .layer_filter import lets_through

GREASE_PENCIL = frozenset(("GREASEPENCIL", "GPENCIL"))
"""4.2 calls it by the second name."""

INVISIBLE = frozenset(
    "EMPTY CAMERA ARMATURE LATTICE SPEAKER LIGHT_PROBE CURVE SURFACE FONT META".split()
)
"""Types of which a render shows nothing. The faces of a curve, text, surface or metaball are
instances of type MESH; what has none, such as a bare path, is not seen in Cycles either."""

VOLUME = "its volume is left out"
SMOKE = "its smoke and fire are left out"
STROKES = "its Grease Pencil strokes are left out here; Render Image (F12) draws them"


class Components:
    """Tells what of an instance a render shows in Cycles, and this engine does not.

    Parameters
    ----------
    layer : the view layer; what it filters out is not told of each object.
    draws_strokes : whether Blender itself draws Grease Pencil over the picture.
    """

    def __init__(self, layer: Any, draws_strokes: bool) -> None:
        self._layer = layer
        self._strands = bool(layer.use_strand)
        self._volumes = bool(layer.use_volumes)
        self._draws_strokes = draws_strokes

    def left_out(self, instance: Any) -> Iterator[str]:
        """Yield a reason for each component of an instance that is not in the picture."""
        thing = instance.object
        if instance.show_self and lets_through(self._layer, thing.type):
            reason = self._component(thing)
            if reason:
                yield reason

    def shows_hair(self, instance: Any) -> bool:
        """Whether the particle hair of an instance is shown, which may be without its emitter."""
        return self._strands and bool(instance.show_particles)

    def _component(self, thing: Any) -> str | None:
        if thing.type in ("MESH", "LIGHT"):
            return SMOKE if self._volumes and holds_smoke(thing) else None
        if thing.type in INVISIBLE or thing.type in ("POINTCLOUD", "CURVES"):
            return None
        if thing.type == "VOLUME":
            # a file's grids are not there before something reads them
            filled = len(thing.data.grids) or thing.data.filepath
            return VOLUME if filled else None
        if thing.type in GREASE_PENCIL:
            return None if self._draws_strokes else STROKES
        return f"objects of type {thing.type.replace('_', ' ').title()} are left out"


def holds_smoke(thing: Any) -> bool:
    """Whether a mesh object is the domain of a gas: Cycles renders that, and not its faces."""
    return any(
        modifier.type == "FLUID"
        and modifier.fluid_type == "DOMAIN"
        and modifier.domain_settings.domain_type == "GAS"
        and modifier.show_render
        for modifier in thing.modifiers
    )
