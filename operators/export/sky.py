# SPDX-License-Identifier: GPL-3.0-or-later
"""Sky Texture nodes of worlds: an image of the sky, and its sun as a light of its own.

Preetham's sky is evaluated by the core. The tables of the others are Blender's own: a second
Blender without a window renders them, at one ray a pixel, and neither the user's scene nor a render
that is going on is touched. Skies that were seen before are kept.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.scene.description import SunLight, Vector
from ...adaptive_drt.scene.environment_images import EQUIRECTANGULAR, MappedImage, tabulated
from ...adaptive_drt.scene.preetham_sky import preetham_radiance
from .environment import mapping_of, own_mapping
from .links import Input, Source
from .nodes import node_called

SKY = "ShaderNodeTexSky"
"""Identifier of the node."""
ROWS = 256
"""Rows of the images of skies: 0.7 degrees each."""
SUN_PIXELS = 256
"""Pixels, a side, by which the mean radiance of the sun is found: it is darker at its rim, and with
32 the mean is 0.4 % off."""
SECONDS = 120.0
"""Time after which the second Blender counts as hanging."""
PLAIN_TYPES = ("FLOAT", "INT", "BOOLEAN", "ENUM")
"""Types of the settings that make a sky."""

SCRIPT = """
import json, math, sys
import bpy, mathutils
import numpy as np
job = json.loads(open(sys.argv[-1]).read())
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
c = scene.cycles
c.device, c.samples, c.use_denoising, c.use_adaptive_sampling = "CPU", 1, False, False
c.pixel_filter_type, c.filter_width = "BOX", 0.01
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
scene.collection.objects.link(camera)
scene.camera = camera
world = scene.world = bpy.data.worlds.new("World")
world.use_nodes = True
tree = world.node_tree
back = next(n for n in tree.nodes if n.type == "BACKGROUND")
sky = tree.nodes.new("ShaderNodeTexSky")
tree.links.new(sky.outputs[0], back.inputs["Color"])
for name, value in job["settings"].items():
    setattr(sky, name, value)


def shot(width, height):
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.filepath = job["folder"] + "/sky.exr"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    flat = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(flat)
    bpy.data.images.remove(image)
    return flat.reshape(height, width, 4)[::-1, :, :3]


camera.data.type = "PANO"
owner = camera.data if hasattr(camera.data, "panorama_type") else camera.data.cycles
owner.panorama_type = "EQUIRECTANGULAR"
camera.rotation_euler = (math.pi / 2.0, 0.0, -math.pi / 2.0)
if hasattr(sky, "sun_disc"):
    sky.sun_disc = False
np.save(job["folder"] + "/sky.npy", shot(2 * job["rows"], job["rows"]))
if job["sun"]:
    camera.data.type, camera.data.angle = "PERSP", job["size"]
    way = mathutils.Vector(job["sun"])
    camera.rotation_euler = way.to_track_quat("-Z", "Y").to_euler()
    side = job["pixels"]
    without = shot(side, side)
    sky.sun_disc = True
    np.save(job["folder"] + "/sun.npy", shot(side, side) - without)
"""
"""What the second Blender does; its last argument names a file that tells which sky."""


def sky_of(
    source: Source, color: Vector, reasons: list[str]
) -> tuple[MappedImage | None, SunLight | None]:
    """Return the image of a Sky Texture, times a colour, and its sun; None for what is left out.

    reasons : gets what is left out of it.
    """
    node = source.node
    assert node is not None
    said = f"the {node_called(node)}"
    # a sky with a sun has no such input
    fed = next((x for x in node.inputs if x.identifier == "Vector" and x.enabled), None)
    matrix = np.eye(3, 4) if fed is None else mapping_of(Input(fed, source.groups))
    why = own_mapping(node) if matrix is not None else "has a Vector that is not understood"
    if why is None and matrix is not None:
        try:
            pixels, sun = _sky(json.dumps(_settings(node), sort_keys=True))
        except (OSError, subprocess.SubprocessError, ValueError):
            why = "needs a second Blender, which could not be started"
    if why is not None or matrix is None:
        reasons.append(f"{said} {why}; it is left out, and the light that it throws")
        return None, None
    image = MappedImage(pixels, EQUIRECTANGULAR, matrix, color)
    if sun is None:
        return image, None
    if not np.array_equal(matrix, np.eye(3, 4)):
        reasons.append(f"{said} is mapped: its sun is left out")
        return image, None
    reasons.append(f"the sun of {said} throws light, but is not seen; it is bright alike all over")
    r, g, b = (x * y for x, y in zip(sun.irradiance, color, strict=True))
    return image, SunLight(sun.direction, (r, g, b), sun.angle, name=node_called(node))


def _settings(node: Any) -> dict[str, Any]:
    """Return what makes a sky."""
    found: dict[str, Any] = {}
    for entry in node.bl_rna.properties:
        name = entry.identifier
        if entry.is_readonly or entry.type not in PLAIN_TYPES or name in _common():
            continue
        value = getattr(node, name)
        found[name] = list(value) if getattr(entry, "is_array", False) else value
    return found


@lru_cache(maxsize=1)
def _common() -> frozenset[str]:
    """Return the names of the settings that all nodes have."""
    return frozenset(entry.identifier for entry in bpy.types.ShaderNode.bl_rna.properties)


@lru_cache(maxsize=8)
def _sky(text: str) -> tuple[NDArray[np.float32], SunLight | None]:
    """Return the image of a sky, and its sun if it has one, by its settings."""
    settings = json.loads(text)
    kind = settings["sky_type"]
    if kind == "PREETHAM":
        sun, turbidity = tuple(settings["sun_direction"]), settings["turbidity"]
        return tabulated(lambda way: preetham_radiance(way, sun, turbidity), ROWS), None
    shines = kind != "HOSEK_WILKIE" and settings.get("sun_disc", False)
    high, turn = settings.get("sun_elevation", 0.0), settings.get("sun_rotation", 0.0)
    toward = (math.sin(turn) * math.cos(high), math.cos(turn) * math.cos(high), math.sin(high))
    size = settings.get("sun_size", 0.0)
    job = {
        "settings": settings, "rows": ROWS, "pixels": SUN_PIXELS, "size": size,
        "sun": toward if shines else None,
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        pixels, disk = _rendered(job, Path(folder))
    if disk is None:
        return pixels, None
    line = (2.0 * np.arange(SUN_PIXELS) + 1.0) / SUN_PIXELS - 1.0
    inside = line[:, None] ** 2 + line**2 < 1.0
    radiance = disk[inside].mean(axis=0) * math.pi * math.sin(0.5 * size) ** 2
    x, y, z = toward
    r, g, b = (float(value) for value in radiance)
    return pixels, SunLight((-x, -y, -z), (r, g, b), size) if radiance.any() else None


def _rendered(job: dict[str, Any], folder: Path) -> tuple[NDArray[Any], NDArray[Any] | None]:
    """Return the sky, and the sun, that a second Blender renders."""
    script, order = folder / "sky.py", folder / "job.json"
    script.write_text(SCRIPT, encoding="utf-8")
    order.write_text(json.dumps({**job, "folder": str(folder)}), encoding="utf-8")
    words = [sys.executable, str(script), str(order)]
    if bpy.app.binary_path:
        start = ["--factory-startup", "-b", "--python-exit-code", "1", "--python", str(script)]
        words = [bpy.app.binary_path, *start, "--", str(order)]
    subprocess.run(
        words, check=True, timeout=SECONDS, stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    disk = np.load(folder / "sun.npy") if job["sun"] else None
    return np.load(folder / "sky.npy"), disk
