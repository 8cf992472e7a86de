# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done with every setting of a scene, its view layers and its objects.

A table is of one RNA struct; an object has one for each part it plays in a picture. Settings of
cameras, lights, worlds, materials and their nodes are in tables of their own, elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..coverage import Table
from .color import DISPLAY, SEQUENCER_COLOR, VIEW
from .cycles import CYCLES, CYCLES_CURVES, CYCLES_LAYER, CYCLES_OBJECT
from .image_format import IMAGE_FORMAT
from .object import INSTANCED, INSTANCER, LAMP, LIGHT_LINKING, SHAPE
from .render import RENDER
from .scene import SCENE
from .view_layer import COLLECTION, LAYER_COLLECTION, VIEW_LAYER


@dataclass(frozen=True)
class Covered:
    """A table, the RNA struct it is of, and the part its owner plays where that makes one."""

    struct: str
    table: Table
    part: str = ""


COVERED = (
    Covered("Scene", SCENE),
    Covered("RenderSettings", RENDER),
    Covered("ImageFormatSettings", IMAGE_FORMAT),
    Covered("ColorManagedViewSettings", VIEW),
    Covered("ColorManagedDisplaySettings", DISPLAY),
    Covered("ColorManagedSequencerColorspaceSettings", SEQUENCER_COLOR),
    Covered("ViewLayer", VIEW_LAYER),
    Covered("LayerCollection", LAYER_COLLECTION),
    Covered("Collection", COLLECTION),
    Covered("Object", SHAPE, "shape"),
    Covered("Object", INSTANCED, "instanced"),
    Covered("Object", INSTANCER, "instancer"),
    Covered("Object", LAMP, "lamp"),
    Covered("ObjectLightLinking", LIGHT_LINKING),
    Covered("CyclesRenderSettings", CYCLES),
    Covered("CyclesCurveRenderSettings", CYCLES_CURVES),
    Covered("CyclesRenderLayerSettings", CYCLES_LAYER),
    Covered("CyclesObjectSettings", CYCLES_OBJECT),
)
"""All tables of this package."""
