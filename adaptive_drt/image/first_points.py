# SPDX-License-Identifier: GPL-3.0-or-later
"""What first points tell of sampled pixels: the spread of their rays, and what they may miss."""

from __future__ import annotations

import numpy as np

from ..cubature.sampled_pixels import FIRST_POINTS, SampledPixels, unseen_error
from ..numerics.arrays import Array, Ints, Mask
from ..shading.center_light import CenterLight
from ..shading.filled_light import FIRST_RAYS
from ..shading.sample_light import LIGHT_RAYS
from .pixel_neighbours import UNKNOWN, agreeing_neighbours, largest_around

__all__ = ["LONE_RAYS", "FirstPoints"]


LONE_RAYS = 0.5
"""Part of its rays that counts for what the rays of a pixel may have missed where pixels around
differ from it: a penumbra is near. If all of n rays have passed, and any fraction was as likely
before, the root mean square of the hidden part is 1.1 / n to 1.4 / n, not `UNSEEN_SHARE` / n."""
LONE_POINTS = 1.0
"""The same under meshes, as a multiple of the points of such a pixel: the rays of a point miss a
thin shadow together, if it is sharp. Chosen for cost: all rays times 0.5 left hair-thin fences at
2.6 times 1 %, and the least that is safe is `LONE_RAYS`."""


class FirstPoints:
    """Records of the n pixels of a frame, row by row; of no pixel where none is sampled.

    Attributes
    ----------
    visibility : (n,) how much of the lights the rays of a pixel have met: see `SampledPixels`.
    agreeing : (n,) number of pixels around that agree with a pixel, as a multiple of its rays.
    """

    def __init__(self, count: int, width: int) -> None:
        """Make records of `count` pixels, in rows of `width`, of which nothing is known yet."""
        self._width = width
        self._spread, self._unseen = np.zeros((2, count))
        self.visibility, self._item = np.full((2, count), UNKNOWN)
        self.agreeing, self._all_agreeing, self._edge_share = np.ones((3, count))
        self._dusk, self._bright_around = np.zeros(count, dtype=np.bool_), np.zeros(count)

    def enter_centers(self, rows: Ints, item: Ints, light: CenterLight) -> None:
        """Enter the light of pixels `rows` (k,), each filled by an object `item` (k,)."""
        self._spread[rows], self._unseen[rows] = light.spread, light.unseen
        self.visibility[rows], self._item[rows] = light.visibility, item + 1

    def enter_points(self, rows: Ints, done: SampledPixels) -> None:
        """Enter pixels `rows` (k,) that points have sampled."""
        self._spread[rows], self._unseen[rows] = done.spread, done.unseen
        self.visibility[rows], self._item[rows] = done.visibility, done.item
        self._dusk[rows] = done.dusk

    def compare_neighbours(
        self, usable: Mask, unreached: Mask, moving: Mask, together: int, brightness: Array
    ) -> None:
        """Compare each pixel with those around it.

        Parameters
        ----------
        usable : (n,) pixels whose mean follows from their centres.
        unreached : (n,) pixels that no outline of a mesh reaches: their rays meet all there is.
        moving : (n,) pixels with motion.
        together : under meshes, the number of rays of a point, which may miss a thin shadow
            together; 0 where there is no mesh.
        brightness : (n,) RMS radiance over channels.
        """
        weight = np.where(usable, 1.0, FIRST_POINTS * (1 if together else LIGHT_RAYS) / FIRST_RAYS)
        weight[unreached] = 0.0
        agreeing = agreeing_neighbours(self.visibility, self._width, weight)
        agreeing = np.where(agreeing > 1.0, agreeing, LONE_RAYS)
        # all rays from a point may miss the sharp shadow of a wire between points
        self.agreeing = np.maximum(agreeing, LONE_POINTS) / together if together else agreeing
        # rays that start at places of their own in the pixel miss it one by one
        self._all_agreeing = np.where(usable, agreeing, self.agreeing)
        # where things move, outlines are bounded by balls: most pixels have none
        share = 1.0 / agreeing_neighbours(self._item, self._width)
        self._edge_share = np.where(moving, share, 1.0)
        self._bright_around = largest_around(brightness, self._width)

    def errors(self, rows: Ints, cut: Mask, contrast: float) -> Array:
        """Errors (k,) of pixels `rows` after their first points; neighbours have been compared.

        cut, contrast : see `contrasts`.
        """
        error = np.maximum(self._spread[rows], self._unseen[rows] / self._all_agreeing[rows])
        missed = unseen_error(self.contrasts(rows, cut, contrast), FIRST_POINTS)
        return np.maximum(error, missed)

    def contrasts(self, rows: Ints, cut: Mask, contrast: float) -> Array:
        """Differences of radiance in sampled pixels `rows` that few points may miss: (k,).

        They are `contrast` of the picture across outlines, by which `cut` (k,) pixels are cut, and
        the radiance around pixels in which a smooth surface turns away from a light: 8 points may
        all lie beyond that line.
        """
        across = self._edge_share[rows] * cut * contrast
        found: Array = np.maximum(across, self._dusk[rows] * self._bright_around[rows])
        return found
