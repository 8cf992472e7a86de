# SPDX-License-Identifier: GPL-3.0-or-later
"""Many instances of one mesh, which is stored once: rays are taken to them by `instance_tracer`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.morton import morton_order
from ...numerics.vector import dot, normalize
from ..camera import PinholeCamera
from ..line_crossings import LightLines, LineCrossings
from ..pixel_coverage import PixelCoverage
from ..smooth_surface import SmoothSurface
from .faces import MeshFaces, smooth_normals
from .instance_tracer import InstanceTracer
from .instanced_picture import InstancedPicture
from .placements import Placements, applied, stretch, transposed
from .tracer import START_OFFSET

__all__ = ["InstancedFaces"]


MOST_CLUSTERS = 4_096
"""Number of balls of clusters of faces of all instances up to which these bound what they hide;
above it there is one ball for each instance."""
STEP_BACK = 256.0 * START_OFFSET
"""Distance before points of hits from which rays look for their faces, in sizes of an instance."""
HULL_MARGIN = 1e-9
"""Width, relative to the lengths involved, by which the hull of two balls is widened against
rounding."""
MOST_OUTLINED = 8
"""Number of instances before a light, seen from a block of points, up to which their outlines are
found; more are left to shadow rays, which then are quicker."""


@dataclass(frozen=True)
class InstancedFaces:
    """The faces of n instances of a mesh, relative to the camera: see `MeshFaces`.

    Attributes
    ----------
    shared : the mesh in its own space.  placements : of the instances.
    """

    shared: MeshFaces
    placements: Placements

    @classmethod
    def make(
        cls, shared: MeshFaces, matrices: Array, origin: Array, displacement: Array | None
    ) -> InstancedFaces:
        """Instances by their matrices (k, 3, 4, n); see `Placements.make`.

        They are put into an order in which neighbours in space are mostly neighbours.
        """
        middle = matrices[len(matrices) // 2]
        place = applied(middle[:, :3], shared.ball[0][:, None]) + middle[:, 3]
        matrices = np.ascontiguousarray(matrices[..., morton_order(place)])
        return cls(shared, Placements.make(matrices, origin, displacement))

    def __getstate__(self) -> dict[str, Any]:
        """Pickled state, without what is projected on the picture again by who needs it."""
        return {name: value for name, value in self.__dict__.items() if name != "_picture"}

    @property
    def is_empty(self) -> bool:
        """Whether there are no faces."""
        return not self.shared.faces.size

    @property
    def face_count(self) -> int:
        """Number of faces that are stored."""
        return self.shared.face_count

    @property
    def moves(self) -> bool:
        """Whether an instance moves during the shutter, relative to the camera."""
        return self.placements.motion is not None

    @property
    def build_seconds(self) -> float:
        """See `MeshFaces.build_seconds`."""
        return self.shared.build_seconds

    @property
    def bytes(self) -> int:
        """Memory of the arrays of the shared faces and of the places."""
        places = self.placements
        return self.shared.bytes + places.linear.nbytes + places.offset.nbytes

    @cached_property
    def swept(self) -> tuple[Array, Array, Array]:
        """Balls around the instances: see `Placements.swept_balls`."""
        return self.placements.swept_balls(*self.shared.ball)

    @cached_property
    def displacement(self) -> Array:
        """Mean displacement (3,) of the instances over the shutter, metres."""
        mean: Array = self.swept[1].mean(axis=1)
        return mean

    @cached_property
    def balls(self) -> tuple[Array, Array]:
        """Centres (3, n) and radii (n,), metres, of balls around the instances at mid-shutter.

        With the mean displacement of all they enclose the instances during the whole shutter.
        """
        center, displacement, radius = self.swept
        other = displacement - self.displacement[:, None]
        return center, radius + 0.5 * np.sqrt(dot(other, other))

    @cached_property
    def ball(self) -> tuple[Array, float]:
        """Centre (3,) and radius of a ball around `balls`, metres."""
        center, radius = self.balls
        if self.is_empty:
            return np.zeros(3), 0.0
        low, high = (center - radius).min(axis=1), (center + radius).max(axis=1)
        middle = 0.5 * (low + high)
        gap = center - middle[:, None]
        return middle, float((np.sqrt(dot(gap, gap)) + radius).max()) * (1.0 + 2.0**-40)

    @cached_property
    def clusters(self) -> tuple[Array, Array]:
        """Centres (3, c) and radii (c,), metres, of balls that together enclose the faces."""
        center, radius = self.shared.clusters
        n = self.placements.count
        if self.moves or radius.size * n > MOST_CLUSTERS:
            return self.balls
        item = np.repeat(np.arange(n), radius.size)
        linear, offset = self.placements.at(item, 0.0)
        return applied(linear, np.tile(center, n)) + offset, stretch(linear) * np.tile(radius, n)

    @cached_property
    def size(self) -> float:
        """Size of the largest instance at mid-shutter, metres."""
        return self.shared.tracer.size * float(stretch(self.placements.linear).max())

    @cached_property
    def tracer(self) -> InstanceTracer:
        """Rays against the instances."""
        center, displacement, radius = self.swept
        reach = radius + 0.5 * np.abs(displacement)
        low, high = center - reach, center + reach
        if not self.moves and not self.is_empty:
            least, most = (each(self.shared.vertices, axis=1)[:, None] for each in (np.min, np.max))
            linear, offset = self.placements.linear, self.placements.offset
            place = applied(linear, 0.5 * (least + most)) + offset
            half = applied(np.abs(linear), 0.5 * (most - least))
            low, high = np.maximum(low, place - half), np.minimum(high, place + half)
        return InstanceTracer(self.shared, self.placements, low, high)

    def intersect(self, start: Array, w: Array, time: Array | float = 0.0) -> Array:
        """Ray parameters (n,) of the first hits of rays from `start` along w (3, n), or inf."""
        return self.tracer.nearest(start, w, time).t

    def second_hits(self, w: Array, t: Array) -> Array:
        """See `MeshFaces.second_hits`."""
        start = t + START_OFFSET * self.size / np.sqrt(dot(w, w))
        return start + self.intersect(start * w, w)

    def blocked(self, start: Array, to: Array, time: Array | float = 0.0, group: int = 1) -> Mask:
        """Whether a face lies between `start` (3, n) and `start + to`: (n,).

        group : number of consecutive rays whose starts are near each other.
        """
        return self.tracer.blocked(start, to, time, group)

    def surface(
        self, start: Array, w: Array, point: Array, time: Array | float = 0.0
    ) -> tuple[Array, Array, SmoothSurface | None]:
        """Surface points of hits: see `MeshFaces.surface`."""
        # nothing is met before the points, so that rays need not come from their starts
        square = np.maximum(dot(w, w), TINY)
        step = STEP_BACK * self.size / np.sqrt(square)
        back = np.maximum(np.minimum(step, dot(point - start, w) / square), 0.0)
        item, face = self._faces_at(point - back * w, w, back + step, time)
        normal = -normalize(w)
        place = point.copy()
        smooth = None
        if self.shared.normals is not None:
            smooth = SmoothSurface(np.zeros_like(w), normal.copy())
        rows = (face >= 0).nonzero()[0]
        if not rows.size:
            return place, normal, smooth
        face, item = face[rows], item[rows]
        when = time[rows] if isinstance(time, np.ndarray) else time
        linear, offset = self.placements.at(item, when)
        inverse = self.placements.inverse_at(item, when)
        own = columns(self.shared.planes[0], face)
        plain = normalize(transposed(inverse, own))
        side = np.where(dot(plain, columns(w, rows)) > 0.0, -1.0, 1.0)
        plain = side * plain
        at = columns(point, rows)
        lift = START_OFFSET * self.shared.tracer.size * side
        place[:, rows] = at + applied(linear, lift * own)
        normal[:, rows] = plain
        if self.shared.normals is not None and smooth is not None:
            corners, turned = [], []
            for k in range(3):
                corner = columns(self.shared.vertices, self.shared.faces[k, face])
                corners.append(applied(linear, corner) + offset)
                each = transposed(inverse, columns(self.shared.normals[k], face))
                turned.append(side * normalize(each))
            found = smooth_normals(at, corners, turned, plain)
            normal[:, rows], smooth.rise[:, rows] = found
            smooth.facet[:, rows] = plain
        return place, normal, smooth

    def outline_crossings(self, point: Array, lines: LightLines) -> LineCrossings | None:
        """Where outlines seen from points (3, n), near each other, cross lines on a light.

        None where the instances move, or are too many before the light.
        """
        if self.moves:
            return None
        middle = 0.5 * (point.min(axis=1) + point.max(axis=1))[:, None]
        gap = point - middle
        span = float(np.sqrt(dot(gap, gap).max()))
        chosen = _before_light(self.balls, (middle, span), lines.ball)
        if chosen.size > MOST_OUTLINED:
            return None
        parts = [self._own_crossings(int(item), point, lines) for item in chosen]
        if not parts:
            none = np.zeros(0, dtype=np.int64)
            return LineCrossings(none, np.zeros(0), np.zeros(0), none)
        names = LineCrossings.__dataclass_fields__
        return LineCrossings(*(np.concatenate([getattr(p, k) for p in parts]) for k in names))

    def coverage(self, w: Array, camera: PinholeCamera) -> PixelCoverage:
        """Coverage of m pixels at mid-shutter; w (3, m) are directions through their centres."""
        return self._on_picture(camera).coverage(self, w)

    def may_meet(self, w: Array, camera: PinholeCamera) -> tuple[Mask, Array]:
        """Whether instances may be seen in m pixels, and a lower bound on their depths."""
        return self._on_picture(camera).may_meet(w)

    def baked(self, some: Ints) -> MeshFaces:
        """Some of the instances as a mesh of their own, at mid-shutter."""
        linear, offset = self.placements.at(some, 0.0)
        inverse = self.placements.inverse_at(some, 0.0)
        v, f = self.shared.vertices.shape[1], self.shared.faces.shape[1]
        vertices = applied(linear[..., None], self.shared.vertices[:, None, :]) + offset[..., None]
        mirrored = dot(linear[:, 0], np.cross(linear[:, 1], linear[:, 2], axis=0)) < 0.0
        # a mirrored mesh keeps its outer side
        kept, turned = self.shared.faces[:, None, :], self.shared.faces[::-1, None, :]
        faces = np.where(mirrored[:, None], turned, kept) + v * np.arange(some.size)[:, None]
        normals = None
        if self.shared.normals is not None:
            own = self.shared.normals
            placed = np.array(
                [applied(inverse.transpose(1, 0, 2)[..., None], each[:, None, :]) for each in own]
            )
            normals = np.where(mirrored[:, None], placed[::-1], placed).reshape(3, 3, -1)
        # rounding leaves no area to faces of instances that are too small for their place
        return MeshFaces.make(vertices.reshape(3, -1), faces.reshape(3, some.size * f), normals)

    def _on_picture(self, camera: PinholeCamera) -> InstancedPicture:
        """The instances on the picture of a camera; those of the last one are kept."""
        kept = self.__dict__.get("_picture")
        if isinstance(kept, InstancedPicture) and kept.camera is camera:
            return kept
        made = InstancedPicture.make(self, camera)
        self.__dict__["_picture"] = made
        return made

    def _own_crossings(self, item: int, point: Array, lines: LightLines) -> LineCrossings:
        """Crossings by the outlines of one instance."""
        one = np.array([item])
        linear, offset = self.placements.at(one, 0.0)
        inverse = self.placements.inverse_at(one, 0.0)
        center, radius = lines.ball
        ball = applied(inverse, center - offset), radius * float(stretch(inverse)[0])
        own = applied(inverse, point - offset)
        at, ends, change = self.shared.outlines.seen_before(own, ball)
        placed = [applied(linear, end) + offset - columns(point, at) for end in ends]
        volume = dot(linear[:, 0], np.cross(linear[:, 1], linear[:, 2], axis=0))
        return lines.crossings(at, (placed[0], placed[1]), np.sign(volume) * change)

    def _faces_at(
        self, start: Array, w: Array, length: Array, time: Array | float
    ) -> tuple[Ints, Ints]:
        """Instances and faces (n,) that rays meet first, which lie within ray parameters `length`
        (n,) but where rounding decides; -1 for none."""
        if self.moves:
            return self.tracer.nearest(start, w, time)[1:]
        hits = self.tracer.first_within(start, w, length)
        rows = (hits.item < 0).nonzero()[0]
        hits.enter(rows, self.tracer.nearest(columns(start, rows), columns(w, rows), 0.0))
        return hits.item, hits.face


def _before_light(
    balls: tuple[Array, Array], points: tuple[Array, float], light: tuple[Array, float]
) -> Ints:
    """The balls that may lie between points, in a ball around them, and a light, in another."""
    (center, radius), (middle, span), (end, size) = balls, points, light
    way = end - middle
    length = float(np.sqrt(dot(way, way))[0])
    axis = way / max(length, TINY)
    # the sides of the hull of both balls; there is none of balls that lie within each other
    sine = min((size - span) / max(length, TINY), 1.0)
    cosine = np.sqrt(max(1.0 - sine * sine, 0.0))
    gap = center - middle
    along = dot(np.broadcast_to(axis, gap.shape), gap)
    aside = np.sqrt(np.maximum(dot(gap, gap) - along * along, 0.0))
    reach = (radius + span) * (1.0 + HULL_MARGIN) + HULL_MARGIN * (length + np.abs(along))
    may = (aside * cosine - along * sine <= reach) & (along >= -reach)
    found: Ints = (may & (along <= length + size + reach)).nonzero()[0]
    return found
