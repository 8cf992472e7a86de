# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of a whole scene (camera, lights, motion) that leave its picture as it is."""

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import Motion, QuadLight

__all__ = ["mirrored", "moved", "random_rotation", "reordered", "reversed_shutter", "turned"]

PLACES = ("center", "corner")
DIRECTIONS = ("edge_u", "edge_v", "half_u", "half_v")


def _vector(values):
    return tuple(float(x) for x in values)


def _mapped(scene, matrix, shift):
    """The scene with every place x at matrix x + shift."""

    def change(thing):
        fields = {n: matrix @ getattr(thing, n) + shift for n in PLACES if hasattr(thing, n)}
        fields |= {n: matrix @ getattr(thing, n) for n in DIRECTIONS if hasattr(thing, n)}
        fields = {name: _vector(value) for name, value in fields.items()}
        if thing.motion is not None:
            fields["motion"] = Motion(_vector(matrix @ thing.motion.displacement))
        return replace(thing, **fields)

    rows = np.array(scene.camera.matrix)
    rows[:3, :3] = matrix @ rows[:3, :3]
    rows[:3, 3] = matrix @ rows[:3, 3] + shift
    fields = {"matrix": tuple(_vector(row) for row in rows)}
    if scene.camera.motion is not None:
        fields["motion"] = Motion(_vector(matrix @ scene.camera.motion.displacement))
    return replace(
        scene,
        camera=replace(scene.camera, **fields),
        shapes=tuple(change(shape) for shape in scene.shapes),
        lights=tuple(change(light) for light in scene.lights),
    )


def moved(scene, shift):
    """The scene, all of it, moved by a vector."""
    return _mapped(scene, np.eye(3), np.array(shift))


def random_rotation(rng):
    """A rotation matrix, uniform over all."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0.0 else -q


def turned(scene, matrix):
    """The scene, all of it, turned about the origin by a rotation matrix."""
    return _mapped(scene, matrix, np.zeros(3))


def mirrored(scene, normal):
    """The scene in a mirror through the origin, its camera as well: the same picture.

    A quad light emits to the side of cross(half_u, half_v), which a mirror turns about, so one
    of its half edges is turned about too.
    """
    normal = np.array(normal) / np.linalg.norm(normal)
    there = _mapped(scene, np.eye(3) - 2.0 * np.outer(normal, normal), np.zeros(3))
    lights = tuple(
        replace(x, half_v=_vector(-np.array(x.half_v))) if isinstance(x, QuadLight) else x
        for x in there.lights
    )
    return replace(there, lights=lights)


def reordered(scene, rng, lights=True):
    """The scene's shapes (and lights) in another order."""
    shapes = tuple(scene.shapes[k] for k in rng.permutation(len(scene.shapes)))
    order = rng.permutation(len(scene.lights)) if lights else range(len(scene.lights))
    return replace(scene, shapes=shapes, lights=tuple(scene.lights[k] for k in order))


def reversed_shutter(scene):
    """The scene with all motion run backwards: the same blur."""

    def back(thing):
        if thing.motion is None:
            return thing
        return replace(thing, motion=Motion(_vector(-np.array(thing.motion.displacement))))

    return replace(
        scene,
        camera=back(scene.camera),
        shapes=tuple(back(shape) for shape in scene.shapes),
        lights=tuple(back(light) for light in scene.lights),
    )
