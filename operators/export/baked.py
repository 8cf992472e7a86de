# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance of shader nodes that Blender itself evaluates: as an image of the sphere, or one value.

A second Blender without a window makes the nodes again and lets Cycles render them, at one ray a
pixel. Neither the user's scene nor a render that is going on is touched, and what was found before
is kept.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
from collections import OrderedDict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.lights.environment_reduction import reduced_image
from ...adaptive_drt.scene.description import SunLight, Vector
from .links import Known, Source, Value, nothing_known
from .node_graph import Graph, NotDescribedError, graph_of, hand_over

SECONDS = 300.0
"""Time after which the second Blender counts as hanging."""
LEAST_ROWS, MOST_ROWS = 256, 1_024
"""Rows of the images of the sphere: 0.7 degrees each, and as many as are needed up to 0.18."""
LIGHT_ERROR = 3e-4
"""Relative error of the irradiance by an image of fewer pixels than it is seen with."""
FEWEST_ROWS = 2
"""Rows of an image of one colour: Blender's pictures have at least 4 x 4 pixels, two a row."""
SUN_PIXELS = 256
"""Pixels, a side, by which the mean radiance of a sun is found: it is darker at its rim, and with
32 the mean is 0.4 % off."""
SUNLESS = ("PREETHAM", "HOSEK_WILKIE")
"""Types of skies that have no disk of a sun."""
SKY = "ShaderNodeTexSky"
"""Identifier of the node."""
KEPT = 16
"""Number of results that are kept: images of the sphere take up to 25 MB each."""
SCRIPT = Path(__file__).with_name("bake_script.py")
"""What the second Blender runs."""

Image = NDArray[np.float32]


@dataclass(frozen=True)
class Baked:
    """What nodes shine.

    Attributes
    ----------
    pixels : radiance (rows, 2 rows, 3), equirectangular from the top down.
    error : of the irradiance by which the image differs from the nodes.
    suns : those of skies, which are not in the image.
    """

    pixels: Image
    error: float = 0.0
    suns: tuple[SunLight, ...] = ()

    def for_light(self) -> Baked:
        """Return it with as few pixels as surfaces need that are lit by it."""
        height = len(self.pixels)
        mean = np.pi * float(np.abs(self.pixels).mean(axis=(0, 1)).max())
        rows = LEAST_ROWS
        while rows < height:
            pixels, error = reduced_image(self.pixels, 2 * rows * rows)
            if error <= LIGHT_ERROR * mean:
                return replace(self, pixels=pixels.astype(np.float32), error=self.error + error)
            rows *= 2
        return self

    @property
    def color(self) -> Vector | None:
        """Return the radiance that it has in all directions, or None."""
        r, g, b = (float(x) for x in self.pixels[0, 0])
        return (r, g, b) if (self.pixels == self.pixels[0, 0]).all() else None


_kept: OrderedDict[tuple[str, int, int], Baked] = OrderedDict()


def baked(graph: Graph, least: int = LEAST_ROWS, most: int = MOST_ROWS) -> Baked:
    """Return what nodes shine.

    least, most : limits of the number of rows of its image; images that the nodes show are taken
        as they are within these.

    Raises
    ------
    NotDescribedError : if the second Blender fails.
    """
    key = (graph.text, least, most)
    found = _kept.pop(key, None)
    if found is None:
        try:
            with tempfile.TemporaryDirectory() as folder:
                found = _rendered(graph, least, most, Path(folder))
        except (OSError, subprocess.SubprocessError, ValueError) as error:
            raise NotDescribedError(
                "it needs a second Blender, which could not be started"
            ) from error
    _kept[key] = found
    if len(_kept) > KEPT:
        _kept.popitem(last=False)
    return found


def folding(known: Known = nothing_known) -> Known:
    """Return what is known of outputs, and the values of those that depend on no ray or place."""

    def value(source: Source) -> Value | None:
        found = known(source)
        return _constant(source, known) if found is None else found

    return value


def _constant(source: Source, known: Known) -> Value | None:
    """Return the value of an output that depends on no ray or place, and None of others."""
    if source.socket is None or source.socket.type not in ("VALUE", "RGBA", "VECTOR", "SHADER"):
        return None
    try:
        graph = graph_of(source, known)
        color = baked(graph, FEWEST_ROWS, FEWEST_ROWS).color if graph.is_pure else None
    except NotDescribedError:
        return None
    if color is None:
        return None
    return color[:1] if source.socket.type == "VALUE" else color


def _rendered(graph: Graph, least: int, most: int, folder: Path) -> Baked:
    content = json.loads(graph.text)
    entries = content["images"]
    shown = max((entry["rows"] for entry in entries), default=0)
    suns = [sun for index, node in enumerate(content["nodes"]) for sun in _suns(index, node)]
    order = {
        **content,
        "images": [
            hand_over(image, entry, folder, index)
            for index, (image, entry) in enumerate(zip(graph.images, entries, strict=True))
        ],
        "least": min(max(shown, least), most), "most": most, "shown": shown,
        "suns": suns, "pixels": SUN_PIXELS, "folder": str(folder),
    }  # fmt: skip
    _run(order, folder)
    fine = np.load(folder / "sphere.npy")
    pixels, split = reduced_image(fine, fine[..., 0].size // 4)
    error = float(np.load(folder / "error.npy")) + split
    disks = [np.load(folder / f"sun_{index}.npy") for index in range(len(suns))]
    lights = tuple(_sun(sun, disk) for sun, disk in zip(suns, disks, strict=True) if disk.any())
    return Baked(pixels.astype(np.float32), error, lights)


def _run(order: dict[str, Any], folder: Path) -> None:
    """Let a second Blender do what is ordered."""
    place = folder / "order.json"
    place.write_text(json.dumps(order), encoding="utf-8")
    words = [sys.executable, str(SCRIPT), str(place)]
    if bpy.app.binary_path:
        start = ["--factory-startup", "-b", "--python-exit-code", "1", "--python", str(SCRIPT)]
        words = [bpy.app.binary_path, *start, "--", str(place)]
    subprocess.run(
        words, check=True, timeout=SECONDS, stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


def _suns(index: int, node: dict[str, Any]) -> list[dict[str, Any]]:
    """Return where the sun of a node is, and its angle, if it is a sky that has one."""
    own = node["settings"]
    if node["type"] != SKY or own["sky_type"] in SUNLESS or not own.get("sun_disc", False):
        return []
    high, turn = own["sun_elevation"], own["sun_rotation"]
    toward = (math.sin(turn) * math.cos(high), math.cos(turn) * math.cos(high), math.sin(high))
    return [{"node": index, "toward": toward, "size": own["sun_size"]}]


def _sun(sun: dict[str, Any], disk: Image) -> SunLight:
    """Return the light of a sun's disk, as bright all over as it is on the mean."""
    line = (2.0 * np.arange(SUN_PIXELS) + 1.0) / SUN_PIXELS - 1.0
    inside = line[:, None] ** 2 + line**2 < 1.0
    size = sun["size"]
    irradiance = disk[inside].mean(axis=0) * math.pi * math.sin(0.5 * size) ** 2
    x, y, z = sun["toward"]
    r, g, b = (float(value) for value in irradiance)
    return SunLight((-x, -y, -z), (r, g, b), size)
