# SPDX-License-Identifier: GPL-3.0-or-later
"""Environment Texture nodes of worlds: their image, and how it lies on the sphere."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.scene.description import Vector
from ...adaptive_drt.scene.environment_images import MappedImage
from .links import Input, Source, value_of
from .node_graph import STILL_SOURCES
from .nodes import node_called

TEXTURE = "ShaderNodeTexEnvironment"
"""Identifier of the node."""

Matrix = NDArray[np.float64]

LINEAR_SPACES = ("Linear Rec.709", "Non-Color", "Linear", "scene_linear")
"""Colour spaces in which pixels are what Cycles renders."""


def image_of(source: Source, color: Vector, unread: list[str]) -> MappedImage | None:
    """Return the image of an Environment Texture, times a colour; None where it is left out.

    unread : gets what is left out of it.
    """
    node = source.node
    assert node is not None
    said = f"the {node_called(node)}"
    image = None if node.image is None else node.image.original
    why = _unreadable(image)
    matrix = mapping_of(Input(node.inputs["Vector"], source.groups))
    if why is None and matrix is None:
        why = "has a Vector that is not understood"
    own = own_mapping(node)
    if why is None and own:
        why = own
    if why is not None:
        unread.append(f"{said} {why}; it is left out, and the light that it throws")
        return None
    if node.interpolation != "Linear":
        unread.append(f"{said} has the interpolation {node.interpolation}; Linear is used")
    assert matrix is not None
    return MappedImage(_pixels(image), node.projection, matrix, color)


def _unreadable(image: Any | None) -> str | None:
    """Return why an image cannot be read, or None."""
    if image is None:
        return "has no image"
    if image.source not in STILL_SOURCES:
        return f"shows a {image.source.lower()}"
    width, height = image.size
    if not width or not height:
        return "has an image that is not found"
    space = image.colorspace_settings.name
    if space not in LINEAR_SPACES and (image.is_float or space != "sRGB"):
        return f"has an image in the colour space {space}"
    return None


def own_mapping(node: Any) -> str | None:
    """Return what is unusual in the mapping that the node itself carries, or None."""
    own, colors = node.texture_mapping, node.color_mapping
    plain = (
        not any(own.translation) and not any(own.rotation) and all(s == 1.0 for s in own.scale)
        and not own.use_min and not own.use_max
        and (own.mapping_x, own.mapping_y, own.mapping_z) == ("X", "Y", "Z")
    )  # fmt: skip
    same = not colors.use_color_ramp and colors.blend_factor == 0.0
    same = same and colors.brightness == colors.contrast == colors.saturation == 1.0
    return None if plain and same else "has a mapping of its own"


def mapping_of(fed: Input) -> Matrix | None:
    """Return the affine map (3, 4) from directions to what feeds a socket, or None."""
    source = fed.source()
    node, socket = source.node, source.socket
    if node is None:
        # an input that nothing feeds takes the direction itself
        return np.eye(3, 4) if socket is not None else None
    if node.bl_idname == "ShaderNodeTexCoord" and socket.identifier == "Generated":
        return np.eye(3, 4)
    if node.bl_idname != "ShaderNodeMapping":
        return None
    inputs = {s.identifier: Input(s, source.groups) for s in node.inputs}
    inner = inputs["Vector"]
    if inner.source().node is None:
        return None
    before = mapping_of(inner)
    names = ("Rotation", "Scale", *(("Location",) if node.vector_type in SHIFTED else ()))
    values = {name: value_of(inputs[name]) for name in names}
    if before is None or any(value is None or len(value) != 3 for value in values.values()):
        return None
    step = _node_matrix(node.vector_type, {name: np.array(v) for name, v in values.items()})
    if step is None:
        return None
    joined = step @ np.vstack([before, [0.0, 0.0, 0.0, 1.0]])
    return joined[:3]


SHIFTED = ("POINT", "TEXTURE")
"""Types of Mapping nodes that have a location."""


def _node_matrix(kind: str, values: dict[str, Matrix]) -> Matrix | None:
    """Return the affine map (4, 4) of a Mapping node; None where it has none."""
    turn, scale = _euler(values["Rotation"]), values["Scale"]
    found = np.eye(4)
    if kind == "TEXTURE":
        if not scale.all():
            return None
        found[:3, :3] = np.diag(1.0 / scale) @ turn.T
        found[:3, 3] = -found[:3, :3] @ values["Location"]
    elif kind == "NORMAL":
        if not scale.all():
            return None
        found[:3, :3] = turn @ np.diag(1.0 / scale)
    else:
        found[:3, :3] = turn @ np.diag(scale)
        if kind == "POINT":
            found[:3, 3] = values["Location"]
    return found


def _euler(angles: Matrix) -> Matrix:
    """Return the rotation (3, 3) by angles about x, then y, then z, in radians."""
    turns = []
    for axis, angle in enumerate(angles):
        c, s, turn = np.cos(angle), np.sin(angle), np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn[i, i], turn[j, j], turn[i, j], turn[j, i] = c, c, -s, s
        turns.append(turn)
    x, y, z = turns
    made: Matrix = z @ y @ x
    return made


def _pixels(image: Any) -> NDArray[np.float32]:
    """Return the pixels (rows, columns, 3) of an image from the top down, linear."""
    width, height = image.size
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    grid = flat.reshape(height, width, -1)[::-1]
    grid = np.repeat(grid, 3, axis=2) if grid.shape[2] < 3 else grid[:, :, :3]
    if image.is_float or image.colorspace_settings.name != "sRGB":
        return np.ascontiguousarray(grid)
    linear = np.where(grid <= 0.04045, grid / 12.92, ((grid + 0.055) / 1.055) ** 2.4)
    return linear.astype(np.float32)
