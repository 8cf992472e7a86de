# SPDX-License-Identifier: GPL-3.0-or-later
"""Sky Texture nodes of worlds: an image of the sky, and its sun as a light of its own.

Preetham's sky is evaluated by the core, the others by Blender: see `baked`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...adaptive_drt.scene.description import SunLight, Vector
from ...adaptive_drt.scene.environment_images import EQUIRECTANGULAR, MappedImage, tabulated
from ...adaptive_drt.scene.preetham_sky import preetham_radiance
from .baked import LEAST_ROWS, Baked, baked
from .environment import mapping_of, own_mapping
from .links import Input, Source
from .node_graph import NotDescribedError, graph_of
from .nodes import node_called

SUN_IS_NOT_SEEN = "throws light, but is not seen; it is bright alike all over"


def sky_of(
    source: Source, color: Vector, unread: list[str], notes: list[str]
) -> tuple[MappedImage | None, SunLight | None]:
    """Return the image of a Sky Texture, times a colour, and its sun; None for what is left out.

    unread : gets why it is left out.  notes : gets what of it is.
    """
    node = source.node
    assert node is not None
    said = f"the {node_called(node)}"
    # a sky with a sun has no such input
    fed = next((x for x in node.inputs if x.identifier == "Vector" and x.enabled), None)
    matrix = np.eye(3, 4) if fed is None else mapping_of(Input(fed, source.groups))
    why = own_mapping(node) if matrix is not None else "has a Vector that is not understood"
    if why is None:
        try:
            sky = _sky(node, source)
        except NotDescribedError as error:
            why = f"is left out: {error}"
    if why is not None or matrix is None:
        unread.append(f"{said} {why}; it is left out, and the light that it throws")
        return None, None
    image = MappedImage(sky.pixels, EQUIRECTANGULAR, matrix, color, sky.error)
    if not sky.suns:
        return image, None
    if not np.array_equal(matrix, np.eye(3, 4)):
        notes.append(f"{said} is mapped: its sun is left out")
        return image, None
    (sun,) = sky.suns
    notes.append(f"the sun of {said} {SUN_IS_NOT_SEEN}")
    r, g, b = (x * y for x, y in zip(sun.irradiance, color, strict=True))
    return image, SunLight(sun.direction, (r, g, b), sun.angle, name=node_called(node))


def _sky(node: Any, source: Source) -> Baked:
    """Return what a Sky Texture shines that is not mapped."""
    if node.sky_type == "PREETHAM":
        sun, turbidity = tuple(node.sun_direction), node.turbidity
        pixels = tabulated(lambda way: preetham_radiance(way, sun, turbidity), LEAST_ROWS)
        return Baked(pixels)
    return baked(graph_of(source, mapped=False), LEAST_ROWS, LEAST_ROWS)
