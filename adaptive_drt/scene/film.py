# SPDX-License-Identifier: GPL-3.0-or-later
"""Result of a render: the picture, its passes, masks, sample counts and statistics."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["NO_DEPTH", "PASSES", "Film", "Pass"]

PENUMBRA, MOTION, EDGE = 0, 1, 2
"""Channels of `Film.mask`, shown as red, green and blue."""


@dataclass(frozen=True)
class Pass:
    """One output of the renderer, a render pass in Blender's terms."""

    name: str
    channels: str
    kind: str


PASSES = (
    Pass("Combined", "RGBA", "COLOR"),
    Pass("Depth", "Z", "VALUE"),
    Pass("Normal", "XYZ", "VECTOR"),
    Pass("Adaptive Mask", "RGBA", "COLOR"),
    Pass("Sample Count", "X", "VALUE"),
)
"""All passes of the renderer; every host application reads them from this table."""

NO_DEPTH = 1e10
"""Depth in metres of pixels where nothing is hit, Blender's own value."""


@dataclass
class Film:
    """Pixels of one render, row 0 at the bottom; arrays may be views of larger ones.

    Attributes
    ----------
    width, height : pixels.
    color : (3, height, width) float64, scene-linear RGB.
    alpha : (height, width) float64, coverage.
    mask : (3, height, width) bool: penumbra, motion, edge.
    samples : (height, width) int32, rays distributed in the pixel (camera rays, and light rays
        beyond the first); 1 for a pixel of a single ray.
    depth : (height, width) float64, metres along the camera's axis at the pixel's centre.
    normal : (3, height, width) float64, unit vectors in world space, 0 where nothing is hit.
    stats : statistics of the render, JSON-serialisable.
    """

    width: int
    height: int
    color: NDArray[np.float64] = field(init=False)
    alpha: NDArray[np.float64] = field(init=False)
    mask: NDArray[np.bool_] = field(init=False)
    samples: NDArray[np.int32] = field(init=False)
    depth: NDArray[np.float64] = field(init=False)
    normal: NDArray[np.float64] = field(init=False)
    stats: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        shape = (self.height, self.width)
        self.color = np.zeros((3, *shape))
        self.alpha = np.zeros(shape)
        self.mask = np.zeros((3, *shape), dtype=np.bool_)
        self.samples = np.zeros(shape, dtype=np.int32)
        self.depth = np.full(shape, NO_DEPTH)
        self.normal = np.zeros((3, *shape))

    def pixels(
        self, name: str, rows: slice = slice(None), out: NDArray[np.float32] | None = None
    ) -> NDArray[np.float32]:
        """Return a pass in the format of Blender's images: flat float32, row 0 at the bottom.

        Parameters
        ----------
        name : one of the names in `PASSES`.
        rows : which rows; all by default.
        out : flat float32 array, large enough, whose beginning is filled and returned. None
            allocates a new array.

        Returns
        -------
        (rows * width * channels,) float32, C-contiguous.
        """
        ones = np.broadcast_to(1.0, (self.height, self.width))
        planes: list[NDArray[Any]] = {
            "Combined": [*self.color, self.alpha],
            "Depth": [self.depth],
            "Normal": [*self.normal],
            "Adaptive Mask": [*self.mask, ones],
            "Sample Count": [self.samples],
        }[name]
        shape = (*planes[0][rows].shape, len(planes))
        flat = np.empty(shape, dtype=np.float32).reshape(-1) if out is None else out[: prod(shape)]
        image = flat.reshape(shape)
        with np.errstate(over="ignore"):
            for k, plane in enumerate(planes):
                image[..., k] = plane[rows]
        # values beyond float32's range are clipped, so that no image holds an infinity
        limit = np.finfo(np.float32).max
        np.clip(flat, -limit, limit, out=flat)
        return flat
