# SPDX-License-Identifier: GPL-3.0-or-later
"""Descriptions of shader nodes from which another Blender makes them again.

Groups, reroutes and muted nodes are taken out, and so are nodes that nothing uses. Two trees with
the same description shine alike, so it also tells whether what was found before still holds.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from .links import Input, Known, Source, nothing_known, value_of
from .nodes import node_called

PLAIN_TYPES = ("FLOAT", "INT", "BOOLEAN", "ENUM")
"""RNA types of the properties that a description holds by their values."""

STRUCTS = ("TexMapping", "ColorMapping", "ImageUser")
"""RNA structs of nodes that are described by their own properties."""

REFUSED = {
    **dict.fromkeys(
        ("ShaderNodeCameraData", "ShaderNodeLightPath", "ShaderNodeLightFalloff"),
        "depends on the ray",
    ),
    **dict.fromkeys(
        (
            *("ShaderNodeAttribute", "ShaderNodeScript", "ShaderNodeTexPointDensity"),
            *("ShaderNodeRaycast", "ShaderNodeAmbientOcclusion", "ShaderNodeTexIES"),
        ),
        "reads more than nodes",
    ),
}
"""Nodes that another Blender does not know the surroundings of, and why."""

VIEWS = ("Camera", "Window")
"""Outputs of a Texture Coordinate node that depend on the camera."""

VALUES = ("ShaderNodeNormal", "ShaderNodeRGB", "ShaderNodeValue")
"""Nodes whose outputs hold their values."""

PURE = frozenset(
    name if name.startswith("Function") else f"ShaderNode{name}"
    for name in (
        *("AddShader", "Background", "Blackbody", "BrightContrast", "Clamp", "CombineColor"),
        *("CombineHSV", "CombineRGB", "CombineXYZ", "Emission", "FloatCurve", "Gamma"),
        *("HueSaturation", "Invert", "MapRange", "Mapping", "Math", "Mix", "MixRGB", "MixShader"),
        *("RGB", "RGBCurve", "RGBToBW", "SeparateColor", "SeparateHSV", "SeparateRGB"),
        *("SeparateXYZ", "Squeeze", "ValToRGB", "Value", "VectorCurve", "VectorMath"),
        *("VectorRotate", "Wavelength"),
        *("FunctionNodeInputBool", "FunctionNodeInputInt", "FunctionNodeInputVector"),
    )
)
"""Nodes whose outputs depend on their inputs alone."""

STILL_SOURCES = ("FILE", "GENERATED")
"""Sources of images that are the same at all times."""


class NotDescribedError(Exception):
    """Why nodes have no description."""


@dataclass(frozen=True)
class Graph:
    """A description of nodes.

    Attributes
    ----------
    text : JSON; the nodes, what is their surface, and the images that they show.
    images : the images, for those who have to hand them on.
    is_pure : whether it is one colour, whatever the ray is.
    """

    text: str
    images: tuple[Any, ...] = field(compare=False)
    is_pure: bool = False


def graph_of(source: Source, known: Known = nothing_known, mapped: bool = True) -> Graph:
    """Return the description of what a source is made of.

    known : values of outputs of nodes that are then not described, such as Light Path.
    mapped : whether its node's inputs are described.

    Raises
    ------
    NotDescribedError : if it holds a node that has no description.
    """
    if source.node is None:
        raise NotDescribedError("it has no nodes")
    writer = _Writer(known)
    surface = writer.link(source)
    if not mapped:
        del writer.nodes[1:]
        writer.nodes[0]["inputs"] = {}
    content = {
        "nodes": writer.nodes,
        "surface": surface,
        "images": [_image_key(image) for image in writer.images],
    }
    text = json.dumps(content, sort_keys=True)
    pure = all(entry["type"] in PURE for entry in writer.nodes)
    return Graph(text, tuple(writer.images), pure)


class _Writer:
    """Describes nodes, each once.

    nodes : their descriptions.  images : what they show.
    """

    def __init__(self, known: Known) -> None:
        self.nodes: list[dict[str, Any]] = []
        self.images: list[Any] = []
        self._known = known
        self._index: dict[tuple[int, ...], int] = {}

    def link(self, source: Source) -> dict[str, Any]:
        """Return the output that a source is, and as what it is passed on."""
        socket = source.socket
        passed = [kind for kind in reversed(source.passed) if kind != "SHADER"]
        if not set(passed) <= {"VALUE", "RGBA", "VECTOR"}:
            raise NotDescribedError("a number is made a whole one on its way")
        if set(passed) == {socket.type}:
            passed = []
        return {"from": [self._number(source), socket.identifier], "passed": passed}

    def _number(self, source: Source) -> int:
        """Return the number of a source's node."""
        node = source.node
        assert node is not None
        key = tuple(each.as_pointer() for each in (node, *source.groups))
        found = self._index.get(key)
        if found is None:
            _refuse(source)
            found = self._index[key] = len(self.nodes)
            entry: dict[str, Any] = {"type": node.bl_idname}
            self.nodes.append(entry)
            entry["settings"] = self._settings(node, node)
            entry["inputs"] = dict(self._inputs(node, source.groups))
            shown = node.outputs if node.bl_idname in VALUES else ()
            entry["outputs"] = {x.identifier: _plain(x.default_value) for x in shown}
        elif node.bl_idname == "ShaderNodeTexCoord":
            _refuse(source)
        return found

    def _inputs(self, node: Any, groups: tuple[Any, ...]) -> Iterable[tuple[str, Any]]:
        for socket in node.inputs:
            if not socket.enabled or socket.is_unavailable:
                continue
            fed = Input(socket, groups)
            source = fed.source()
            if source.node is None and source.socket == socket:
                if hasattr(socket, "default_value"):
                    yield socket.identifier, {"value": _plain(socket.default_value)}
                continue
            value = None if socket.type == "SHADER" else value_of(fed, self._known)
            if value is not None:
                yield socket.identifier, {"constant": list(value)}
            elif source.node is not None:
                yield socket.identifier, self.link(source)

    def _settings(self, owner: Any, node: Any) -> dict[str, Any]:
        """Return the properties of a node, or of a struct of its."""
        found: dict[str, Any] = {}
        for entry in owner.bl_rna.properties:
            name = entry.identifier
            if name in _common() or name == "name":
                continue
            if entry.type == "POINTER":
                value = self._pointer(entry.fixed_type.identifier, getattr(owner, name), node)
                if value is not None:
                    found[name] = value
            elif entry.type in PLAIN_TYPES and not entry.is_readonly:
                found[name] = _plain(getattr(owner, name))
        return found

    def _pointer(self, kind: str, value: Any, node: Any) -> dict[str, Any] | None:
        if value is None:
            if kind == "Image":  # Cycles warns of it by a pink
                raise NotDescribedError(f"the {node_called(node)} has no image")
            return None
        if kind == "ColorRamp":
            elements = [[x.position, list(x.color)] for x in value.elements]
            return {"settings": self._settings(value, node), "elements": elements}
        if kind == "CurveMapping":
            curves = [[[list(p.location), p.handle_type] for p in c.points] for c in value.curves]
            return {"settings": self._settings(value, node), "curves": curves}
        if kind == "Image":
            image = value.original
            if image not in self.images:
                self.images.append(image)
            return {"image": self.images.index(image)}
        if kind == "Object":
            return {"matrix": [list(row) for row in value.matrix_world]}
        if kind in STRUCTS:
            return self._settings(value, node)
        raise NotDescribedError(f"the {node_called(node)} reads more than nodes")


def _refuse(source: Source) -> None:
    """Raise an error for a node that cannot be described."""
    node, socket = source.node, source.socket
    assert node is not None and socket is not None
    kind, why = node.bl_idname, ""
    if not kind.startswith(("ShaderNode", "FunctionNodeInput")):
        why = "is not known"
    elif kind == "ShaderNodeTexCoord" and socket.identifier in VIEWS:
        why = "depends on the camera"
    elif kind == "ShaderNodeVectorTransform" and "CAMERA" in (node.convert_from, node.convert_to):
        why = "depends on the camera"
    why = REFUSED.get(kind, why)
    if why:
        raise NotDescribedError(f"the {node_called(node)} {why}")


def _plain(value: Any) -> Any:
    if isinstance(value, str | bool | int | float):
        return value
    return [float(x) for x in value]


@lru_cache(maxsize=1)
def _common() -> frozenset[str]:
    """Return the names of the settings that all nodes have."""
    return frozenset(entry.identifier for entry in bpy.types.ShaderNode.bl_rna.properties)


def _image_key(image: Any) -> dict[str, Any]:
    """Return what tells an image from others."""
    if image.source not in STILL_SOURCES:
        raise NotDescribedError(f'the image "{image.name}" is a {image.source.lower()}')
    key = {
        "colorspace": image.colorspace_settings.name,
        "alpha_mode": image.alpha_mode,
        "is_float": bool(image.is_float),
        "rows": int(image.size[1]),
    }
    if not image.size[0] or not image.size[1]:
        raise NotDescribedError(f'the image "{image.name}" is not found')
    return {**key, "content": _content(image)}


def _content(image: Any) -> list[str]:
    """Return where the pixels of an image are, and what tells them from others."""
    packed, path = image.packed_file, Path(image.filepath_from_user())
    if image.source == "FILE" and not image.is_dirty and packed is not None:
        return ["packed", hashlib.sha256(packed.data).hexdigest()]
    if image.source == "FILE" and not image.is_dirty and path.is_file():
        facts = path.stat()
        return ["file", str(path), str(facts.st_mtime_ns), str(facts.st_size)]
    return ["pixels", hashlib.sha256(pixels_of(image).tobytes()).hexdigest()]


def pixels_of(image: Any) -> Any:
    """Return the pixels of an image as Blender keeps them, a flat array of float32."""
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    return flat


def hand_over(image: Any, key: dict[str, Any], folder: Path, index: int) -> dict[str, Any]:
    """Put an image where another Blender finds it, and return how it does.

    key : what the description says of it.
    """
    settings = {name: key[name] for name in ("colorspace", "alpha_mode", "is_float")}
    entry: dict[str, Any] = {"file": None, "settings": settings}
    kind = key["content"][0]
    if kind == "file":
        entry["file"] = key["content"][1]
    elif kind == "packed":
        ending = Path(image.filepath_raw).suffix or ".png"
        place = folder / f"image_{index}{ending}"
        place.write_bytes(image.packed_file.data)
        entry["file"] = str(place)
    else:
        place = folder / f"image_{index}.npy"
        np.save(place, _with_alpha(pixels_of(image), int(image.channels)))
        entry.update(pixels=str(place), size=list(image.size))
    return entry


def _with_alpha(flat: Any, channels: int) -> Any:
    """Return pixels of four channels each."""
    if channels == 4:
        return flat
    grid = flat.reshape(-1, channels)
    full = np.ones((len(grid), 4), dtype=np.float32)
    full[:, :3] = grid[:, :3] if channels == 3 else grid[:, :1]
    return full.ravel()
