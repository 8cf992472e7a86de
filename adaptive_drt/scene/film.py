# SPDX-License-Identifier: GPL-3.0-or-later
"""Sink of a render: the picture, its passes, masks, sample counts and statistics.

Renderers only write finished pixels into a film, and hosts only read them, also while the render
goes on.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["FILM_BORDER", "NO_DEPTH", "PASSES", "Film", "Pass"]

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


FILM_BORDER = 32
"""Number of pixels around the picture that may be written: renderers that work in blocks of pixels
need not cut the blocks at its sides. Nobody reads them."""


@dataclass
class Film:
    """Pixels of one render, row 0 at the bottom.

    Attributes
    ----------
    width, height : pixels.
    color : (3, height, width) float64, scene-linear RGB.
    alpha : (height, width) float64, coverage.
    mask : (3, height, width) bool: penumbra, motion, edge.
    samples : (height, width) int32, rays distributed in the pixel (camera rays, and light rays
        beyond the first); 1 for a pixel of a single ray, 0 for one that is not written yet.
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
        shape = (self.height + 2 * FILM_BORDER, self.width + 2 * FILM_BORDER)
        # arrays with the border, by pass; the attributes are views of the picture in them
        self._stored: dict[str, NDArray[Any]] = {
            "color": np.zeros((3, *shape)),
            "alpha": np.zeros(shape),
            "mask": np.zeros((3, *shape), dtype=np.bool_),
            "samples": np.zeros(shape, dtype=np.int32),
            "depth": np.full(shape, NO_DEPTH),
            "normal": np.zeros((3, *shape)),
        }
        inside = slice(FILM_BORDER, -FILM_BORDER)
        for name, stored in self._stored.items():
            setattr(self, name, stored[..., inside, inside])

    def write_rows(self, rows: slice, **planes: Any) -> None:
        """Write whole rows of some passes.

        Parameters
        ----------
        rows : which rows of the picture.
        planes : by the name of the attribute, values (..., rows, width) or a number; depths are
            infinite where nothing is hit.
        """
        for name, values in planes.items():
            getattr(self, name)[..., rows, :] = _film_values(name, values)

    def write_pixels(
        self, x: NDArray[np.int64], y: NDArray[np.int64], **planes: NDArray[Any]
    ) -> None:
        """Write single pixels of some passes.

        Parameters
        ----------
        x, y : columns and rows, integers of any shapes that broadcast to one shape (...); they may
            be as far as `FILM_BORDER` outside the picture.
        planes : by the name of the attribute, values (...) or (3, ...), as in `write_rows`.
        """
        index = self._storage_indices(x, y)
        for name, values in planes.items():
            stored = self._stored[name]
            flat = stored.reshape(-1, stored.shape[-2] * stored.shape[-1])
            # one plane at a time takes half the time
            parts = _film_values(name, values).reshape(len(flat), *index.shape)
            for plane, part in zip(flat, parts, strict=True):
                plane[index] = part

    def add_samples(
        self, x: NDArray[np.int64], y: NDArray[np.int64], samples: NDArray[np.integer[Any]]
    ) -> None:
        """Add to the sample counts of single pixels, of which none is given twice."""
        self._stored["samples"].reshape(-1)[self._storage_indices(x, y)] += samples

    def _storage_indices(self, x: NDArray[np.int64], y: NDArray[np.int64]) -> NDArray[np.int64]:
        """Indices of pixels in the flattened arrays that hold the border too."""
        return (y + FILM_BORDER) * (self.width + 2 * FILM_BORDER) + (x + FILM_BORDER)

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


def _film_values(name: str, values: Any) -> Any:
    """Values of a pass as films hold them: depths are `NO_DEPTH` where nothing is hit."""
    return np.where(np.isfinite(values), values, NO_DEPTH) if name == "depth" else values
