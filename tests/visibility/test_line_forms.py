# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles, ellipses, and a kind of shape defined here only, seen through boxes, by plain rays.

Ellipsoids stand for any surface of degree two: nothing in visibility knows their kind.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from adaptive_drt.geometry.line_forms import BoxRays, DepthSurface
from adaptive_drt.geometry.polygon.shape import ParallelogramSet, PolygonSet
from adaptive_drt.geometry.quadric_lines import QuadricForms
from adaptive_drt.geometry.shape import ShapeSet
from adaptive_drt.geometry.shape_table import ShapeTable
from adaptive_drt.geometry.sphere.line_polynomials import SphereForms, sphere_forms
from adaptive_drt.numerics.box_polynomials import Boxes
from adaptive_drt.numerics.gather import columns
from adaptive_drt.numerics.line_lattice import Lattice, SideLattice
from adaptive_drt.numerics.vector import dot
from adaptive_drt.scene.description import (
    Camera,
    Ellipse,
    Motion,
    Quad,
    Scene,
    Sphere,
    SphereLight,
    Triangle,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.visibility.event_smoothness import find_smooth_boxes
from adaptive_drt.visibility.fragments import find_fragments
from adaptive_drt.visibility.line_intervals import (
    depth_coefficients,
    evaluate_depth,
    hit_intervals,
)
from adaptive_drt.visibility.polynomials import make_polynomials
from plain_hits import oracle_depth, rays

SIZE = 24
CAMERA = Camera(resolution=(SIZE, SIZE))  # at the origin, looks along -z
LAMP = SphereLight((3.0, -2.0, 9.0), 0.5, (10.0, 10.0, 10.0))
EYE = np.zeros((3, 1))


@dataclass(frozen=True)
class Ellipsoid:
    """With the axes of space."""

    center: tuple[float, ...]
    axes: tuple[float, ...]
    motion: Motion | None = None


@dataclass(frozen=True)
class EllipsoidSet(ShapeSet):
    center: np.ndarray
    axes: np.ndarray
    displacement: np.ndarray | None

    @classmethod
    def from_records(cls, records, origin, displacement):
        center, axes = (
            np.array([getattr(r, name) for r in records], dtype=float).reshape(-1, 3).T.copy()
            for name in ("center", "axes")
        )
        return cls(center - origin, axes, displacement)

    @property
    def bounding_spheres(self):
        return self.center, self.axes.max(axis=0)

    def intersect(self, index, w, time):
        raise NotImplementedError

    def surface(self, index, w, point, time):
        raise NotImplementedError

    def blocks(self, index, start, to, time):
        raise NotImplementedError

    def line_forms(self, index, rows, rays):
        """Those of unit spheres in space divided by the axes."""
        axes = columns(self.axes, index)
        mapped = BoxRays(tuple(w / axes for w in rays.directions), rays.time, rays.duration)
        d = None if self.displacement is None else columns(self.displacement, index) / axes
        center = columns(self.center, index) / axes
        forms = sphere_forms(rows, mapped, center, d, np.ones(index.size))
        return QuadricForms(rows, forms.polynomials)


def planned(*shapes):
    """A plan of spheres, quads, triangles, ellipses and ellipsoids; with it the shapes in its
    order.
    """
    kinds = (Sphere, Quad, Triangle, Ellipse, Ellipsoid)
    *each_kind, ellipsoids = ([each for each in shapes if isinstance(each, kind)] for kind in kinds)
    flat_and_round = [shape for kind in each_kind for shape in kind]
    scene = Scene(CAMERA, tuple(flat_and_round), (LAMP,))
    plan = make_plan(scene, Settings(threads=1))
    d = np.array([displacement(each) for each in ellipsoids]).reshape(-1, 3).T.copy()
    last = EllipsoidSet.from_records(ellipsoids, EYE, d if d.any() else None)
    sets = (*plan.shapes.sets, last)
    ordered = [*flat_and_round, *ellipsoids]
    moves = np.array([displacement(each).any() for each in ordered], dtype=bool)
    return replace(plan, shapes=ShapeTable(sets), is_moving=moves), ordered


def displacement(shape):
    return np.zeros(3) if shape.motion is None else np.array(shape.motion.displacement)


def plain_depth(shape, ray, t):
    """Distances of hits of unit rays (3, n) at times t (n,); inf for a miss."""
    if not isinstance(shape, Ellipsoid):
        return oracle_depth(shape, ray, t, EYE)
    shift = t * displacement(shape)[:, None]
    axes = np.array(shape.axes)[:, None]
    unit = Sphere((0.0, 0.0, 0.0), 1.0)
    way = ray / axes
    length = np.sqrt((way * way).sum(axis=0))
    eye = -(np.array(shape.center)[:, None] + shift) / axes
    return oracle_depth(unit, way / length, 0.0 * t, eye) / length


def plain_weights(shapes, low, high, points):
    """Weights (1 + shapes,) of a box, the background first, by an even set of points."""
    place = low[:, None] + points * (high - low)[:, None]
    ray = rays(CAMERA, place[0], place[1])
    depth = np.array(
        [np.full(ray.shape[1], 1e300), *(plain_depth(s, ray, place[2]) for s in shapes)]
    )
    return np.bincount(depth.argmin(axis=0), minlength=depth.shape[0]) / ray.shape[1]


def lattice_points(count):
    """Points (3, count) of the unit cube on a rank-one lattice."""
    steps = np.array([1.0 / count, 0.7548776662466927, 0.5698402909980532])
    return (np.arange(count) * steps[:, None] + 0.5 / count) % 1.0


def random_motion(rng, moving, size):
    if not moving or rng.random() < 0.3:
        return None
    return Motion(tuple((rng.normal(size=3) * size).tolist()))


def random_triangle(rng, moving):
    depth = 10 ** rng.uniform(-0.1, 0.8)
    u, v = rng.normal(size=(2, 3)) * depth * 10 ** rng.uniform(-1.0, 0.3, (2, 1))
    corner = np.array([*rng.uniform(-0.4, 0.4, 2), -1.0]) * depth - (u + v) / 3
    a, b, c = (tuple(part.tolist()) for part in (corner, corner + u, corner + v))
    return Triangle((a, b, c), motion=random_motion(rng, moving, depth / 4))


def random_ellipsoid(rng, moving):
    center = rng.normal(size=3) * 0.5 + (0.0, 0.0, -4.0)
    axes = rng.uniform(0.2, 1.2, 3)
    return Ellipsoid(tuple(center.tolist()), tuple(axes.tolist()), random_motion(rng, moving, 0.4))


def random_ellipse(rng, moving):
    triangle = random_triangle(rng, moving)
    a, b, c = np.array(triangle.vertices)
    place = (a + b + c) / 3.0, (b - a) / 2.0, (c - a) / 2.0
    return Ellipse(*(tuple(part.tolist()) for part in place), motion=triangle.motion)


def random_boxes(rng, count, moving):
    size = 10 ** rng.uniform(-1.0, 0.3, (3, count))
    size[2] = np.minimum(size[2], 1.0) if moving else 0.0
    middle = rng.uniform(3.0, SIZE - 3.0, (3, count))
    middle[2] = rng.uniform(-0.5, 0.5, count) * (1.0 - size[2]) if moving else 0.0
    return Boxes(middle - size / 2, middle + size / 2)


def every_pair(plan, count):
    box, item = np.divmod(np.arange(count * plan.shapes.count), plan.shapes.count)
    return Pairs(box, item)


KINDS = {"triangle": random_triangle, "ellipse": random_ellipse, "ellipsoid": random_ellipsoid}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "lattice", [Lattice(0, 2, 3), Lattice(1, 3, 1), Lattice(2, 2, 2), SideLattice(2, 2, 1)]
)
def test_intervals_and_depths_are_those_of_plain_rays(kind, lattice):
    samples = (np.arange(400) + 0.5) / 400 - 0.5
    axis, met = lattice.axis, 0
    others = [k for k in range(3) if k != axis]
    for seed in range(12):
        rng = np.random.default_rng(seed)
        plan, (shape,) = planned(KINDS[kind](rng, True))
        boxes = random_boxes(rng, 40, True)
        forms, cover = make_polynomials(plan, boxes, every_pair(plan, 40))
        low, high = hit_intervals(forms, cover.all_hit, lattice)
        depth = evaluate_depth(
            depth_coefficients(forms, lattice)[..., None], samples[None, None, None]
        )
        place = np.empty((3, *low.shape, samples.size))
        place[axis] = samples
        place[others[0]], place[others[1]] = lattice.u[..., None], lattice.v[..., None]
        place = boxes.middle[:, None, None, :, None] + place * boxes.size[:, None, None, :, None]
        x, y, t = place.reshape(3, -1)
        ray = rays(CAMERA, x, y)
        far = plain_depth(shape, ray, t).reshape(place.shape[1:])
        inside = (samples >= low[..., None]) & (samples <= high[..., None])
        edge = np.minimum(abs(samples - low[..., None]), abs(samples - high[..., None]))
        clear = (edge > 1e-7) | (high == low)[..., None]
        assert (inside == np.isfinite(far))[clear].all(), seed
        # ray parameters are depths along the camera's axis
        far, seen = far * -ray[2].reshape(far.shape), inside & np.isfinite(far) & clear
        np.testing.assert_allclose(depth[seen], far[seen], rtol=1e-6)
        met += np.count_nonzero(seen)
        bounds = cover.near[:, None], cover.far[:, None]
        for values, hit in zip(far.reshape(-1, 40, 400), seen.reshape(-1, 40, 400), strict=True):
            assert (values >= bounds[0] * (1 - 1e-9))[hit].all()
            assert (values <= bounds[1] * (1 + 1e-9))[hit].all()
        assert not seen[:, :, ~cover.may_hit].any()
        assert np.isfinite(far[:, :, cover.all_hit]).all()
    assert met > 1000


def scene(rng, kind, moving):
    shapes = [KINDS[kind](rng, moving) for _ in range(3)]
    center = rng.normal(size=3) * 0.4 + (0.0, 0.0, -4.0)
    shapes.append(Sphere(tuple(center.tolist()), 0.7, motion=random_motion(rng, moving, 0.3)))
    shapes.append(Quad((-2.0, -1.5, -4.2), (4.0, 0.0, -0.5), (0.2, 3.0, 0.3)))
    return shapes


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_fragments_are_those_of_plain_rays(kind, moving):
    """Among spheres and quads, through which the shapes go."""
    points, accuracy, off, honest = lattice_points(1 << 13), 5e-3, [], []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        plan, shapes = planned(*scene(rng, kind, moving))
        boxes = random_boxes(rng, 60, moving)
        found = find_fragments(plan, boxes, every_pair(plan, 60), accuracy)
        mixed = (np.bincount(found.box) > 1).nonzero()[0][:12]
        for box in mixed:
            weight = plain_weights(shapes, boxes.low[:, box], boxes.high[:, box], points)
            rows = (found.box == box).nonzero()[0]
            ours = np.zeros(weight.size)
            ours[found.item[rows] + 1] = found.weight[rows]
            off.append(np.abs(ours - weight).max())
            honest.append(off[-1] <= 3.0 * found.error[rows].max() + accuracy + 2e-3)
    off = np.array(off)
    assert off.size >= 80 and np.mean(honest) >= 0.98
    assert np.sqrt((off**2).mean()) <= accuracy + 2e-3


@pytest.mark.parametrize("kind", KINDS)
def test_smooth_boxes_have_the_same_events_for_all_rays(kind):
    smooth_boxes, count, times = 0, 150, (np.arange(400) + 0.5) / 400
    u, v = (part.ravel() for part in np.meshgrid(*[np.linspace(0.0, 1.0, 5)] * 2))
    for seed in range(10):
        rng = np.random.default_rng(seed)
        plan, (shape,) = planned(KINDS[kind](rng, True))
        low = np.stack([*rng.uniform(2.0, SIZE - 3.0, (2, count)), np.full(count, -0.5)])
        boxes = Boxes(low, low + np.array([[0.2], [0.2], [1.0]]))
        forms, cover = make_polynomials(plan, boxes, every_pair(plan, count))
        smooth = find_smooth_boxes(forms, cover.all_hit, np.arange(count), count)
        for box in (smooth & cover.may_hit & ~cover.all_hit).nonzero()[0]:
            x, y = low[0, box] + 0.2 * u, low[1, box] + 0.2 * v
            ray = np.repeat(rays(CAMERA, x, y), times.size, axis=1)
            t = np.tile(low[2, box] + times, x.size)
            hit = np.isfinite(plain_depth(shape, ray, t)).reshape(-1, times.size)
            changes = (hit[:, 1:] != hit[:, :-1]).sum(axis=1)
            for values in (hit[:, 0], hit[:, -1], changes):
                assert (values == values[0]).all(), (seed, box)
            smooth_boxes += bool(changes[0])
    assert smooth_boxes > 10


@pytest.mark.parametrize("moving", [False, True])
def test_the_rule_for_all_surfaces_of_degree_two_finds_the_events_of_spheres(moving, monkeypatch):
    same = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        shapes = [
            Sphere(
                tuple((rng.normal(size=3) * 0.5 + (0.0, 0.0, -4.0)).tolist()),
                rng.uniform(0.4, 0.9),
                motion=random_motion(rng, moving, 0.2),
            )
            for _ in range(4)
        ]
        plan, _ = planned(*shapes, Quad((-1.0, -1.0, -3.8), (2.0, 0.0, -0.4), (0.3, 2.0, 0.2)))
        boxes = random_boxes(rng, 80, moving)
        weights = []
        for surface in (DepthSurface.SPHERE, DepthSurface.QUADRIC):
            monkeypatch.setattr(SphereForms, "surface", surface)
            found = find_fragments(plan, boxes, every_pair(plan, 80), 1e-2)
            table = np.zeros((80, 6))
            table[found.box, found.item] = found.weight
            weights.append(table)
        same.append(np.abs(weights[0] - weights[1]).max(axis=1) <= 1e-9)
    assert np.mean(same) >= 0.99


def test_parallelograms_have_the_edge_functions_of_polygons():
    rng = np.random.default_rng(0)
    q, u, v, d = rng.normal(size=(4, 3, 9))
    quads, index = ParallelogramSet(q - 4.0, u, v, d), np.arange(9)
    plan, _ = planned()
    box_rays = BoxRays.make(plan.lens, random_boxes(rng, 9, True), index)
    first, second, third, fourth = quads.line_forms(index, index, box_rays).edges
    corner = box_rays.positions(quads.corner, d)
    general = PolygonSet.edge_functions(quads, box_rays, corner, u, v, np.zeros((1, 3, 9)))
    for own, other in zip((second, third, fourth, first), general, strict=True):
        np.testing.assert_allclose(own, other, rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind", [*KINDS, "quad", "sphere"])
def test_extents_and_planes(kind):
    """Extents hold sampled points; those of polygons are attained by vertices."""
    rng = np.random.default_rng(1)
    if kind in KINDS:
        plan, (shape,) = planned(KINDS[kind](rng, True))
    elif kind == "quad":
        plan, (shape,) = planned(Quad((0.1, 0.2, -3.0), (1.0, 0.2, 0.3), (0.1, 2.0, 0.0)))
    else:
        plan, (shape,) = planned(Sphere((0.1, 0.2, -3.0), 0.7, motion=Motion((1.0, 0.5, 0.2))))
    way, time = rng.normal(size=(3, 50)), rng.uniform(-0.5, 0.5, 50)
    item = np.zeros(50, dtype=np.int64)
    low, high = plan.shapes.extent(item, way, time)
    shift = time * displacement(shape)[:, None]
    if kind == "ellipse":
        center, u, v = (np.array(part) for part in (shape.center, shape.half_u, shape.half_v))
        middle = ((center[:, None] + shift) * way).sum(axis=0)
        reach = np.hypot(u @ way, v @ way)
        assert (low <= middle - reach + 1e-12).all() and (high >= middle + reach - 1e-12).all()
        normal, point = plan.shapes.plane(item)
        np.testing.assert_allclose(dot(normal, (center + u)[:, None] - point), 0.0, atol=1e-12)
        return
    if kind in ("triangle", "quad"):
        if kind == "triangle":
            vertices = list(map(np.array, shape.vertices))
        else:
            q, u, v = (np.array(part) for part in (shape.corner, shape.edge_u, shape.edge_v))
            vertices = [q, q + u, q + v, q + u + v]
        along = np.array([((vertex[:, None] + shift) * way).sum(axis=0) for vertex in vertices])
        # edges of triangles are moved outwards by more than rounding
        close = {"rtol": 1e-12, "atol": 1e-11 * (kind == "triangle")}
        np.testing.assert_allclose([low, high], [along.min(axis=0), along.max(axis=0)], **close)
        normal, point = plan.shapes.plane(item)
        for vertex in vertices:
            np.testing.assert_allclose(dot(normal, vertex[:, None] - point), 0.0, atol=1e-12)
        return
    with pytest.raises(NotImplementedError, match="planes"):
        plan.shapes.plane(item)
    axes = np.array(shape.axes if kind == "ellipsoid" else [shape.radius] * 3)[:, None]
    middle = ((np.array(shape.center)[:, None] + shift) * way).sum(axis=0)
    reach = np.sqrt(((axes * way) ** 2).sum(axis=0))
    assert (low <= middle - reach + 1e-12).all() and (high >= middle + reach - 1e-12).all()
