# SPDX-License-Identifier: GPL-3.0-or-later
"""Mitsuba 3 renders the benchmark's still scenes: its direct integrator, compiled by LLVM.

    python benchmarks/peer_mitsuba.py SCENE WIDTH HEIGHT FOLDER SECONDS

writes pictures and times of a ladder of sample counts (see `bench_ladder`). A process of its own:
Blender's module and Mitsuba each bring libraries that need not agree.
"""

from __future__ import annotations

import glob
import math
import os
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from bench_ladder import climb, parse
from bench_scenes import bench_scene

from adaptive_drt.scene.description import Cylinder, Ellipsoid, Quad, QuadLight, Scene

__all__ = ["render_mitsuba"]

THREADS = 2
SAMPLES = tuple(p * p for p in (2, 5, 11, 23, 47, 97, 193))
SAMPLER = "orthogonal"
"""Of independent, stratified, multijitter, orthogonal and ldsampler, the least error for its time.
It wants squares of primes."""
MOST_LANES = 50_000_000
"""Samples that Mitsuba holds in memory at a time."""
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "adaptive-drt" / "llvm"
PLACES = ("/usr/lib/*/libLLVM*.so*", "/usr/lib/llvm-*/lib/libLLVM*.so*", "/usr/lib*/libLLVM*.so*")
LEAST_LLVM = 16
"""LLVM 15, which Debian 12's OpenGL brings, aborts on the code of spherical lights."""


def start() -> Any:
    """Mitsuba with its LLVM variant, or its scalar one where no LLVM is found."""
    if "DRJIT_LIBLLVM_PATH" not in os.environ:
        version, path = max(_libraries(), default=(0, ""))
        if version >= LEAST_LLVM:
            os.environ["DRJIT_LIBLLVM_PATH"] = path
    import drjit
    import mitsuba

    if "DRJIT_LIBLLVM_PATH" in os.environ and drjit.has_backend(drjit.JitBackend.LLVM):
        mitsuba.set_variant("llvm_ad_rgb")
        drjit.set_thread_count(THREADS)
    else:
        mitsuba.set_variant("scalar_rgb")
    return mitsuba


def _libraries() -> Iterator[tuple[int, str]]:
    """Versions and paths of LLVM's library, the system's and what bench_setup.sh unpacked."""
    for place in (*PLACES, *(f"{CACHE}{place}" for place in PLACES)):
        for path in glob.glob(place):
            version = re.search(r"libLLVM-?(?:\.so\.)?(\d+)", path)
            if version:
                yield int(version.group(1)), path


def describe(mi: Any, scene: Scene) -> dict[str, Any]:
    """A core scene as Mitsuba's dictionary; lights are shapes, and hidden from the camera."""
    world: dict[str, Any] = {
        "type": "scene",
        "integrator": {
            "type": "direct",
            "emitter_samples": 1,
            "bsdf_samples": 0,
            "hide_emitters": True,
        },
        "sensor": _camera(mi, scene.camera),
    }
    for k, shape in enumerate(scene.shapes):
        world[f"shape{k}"] = _placed(mi, shape) | {
            "bsdf": {
                "type": "twosided",
                "bsdf": {"type": "diffuse", "reflectance": _color(shape.material.color)},
            }
        }
    for k, light in enumerate(scene.lights):
        world[f"light{k}"] = _placed(mi, light) | {
            "emitter": {"type": "area", "radiance": _color(light.radiance)}
        }
    return world


def _color(rgb: Any) -> dict[str, Any]:
    return {"type": "rgb", "value": list(rgb)}


def _placed(mi: Any, thing: Any) -> dict[str, Any]:
    """Type and place: Mitsuba's rectangle is -1..1 in x and y and faces z."""
    if isinstance(thing, Quad | QuadLight):
        if isinstance(thing, Quad):
            u, v = 0.5 * np.array(thing.edge_u), 0.5 * np.array(thing.edge_v)
            center = np.array(thing.corner) + u + v
        else:
            u, v, center = np.array(thing.half_u), np.array(thing.half_v), np.array(thing.center)
        n = np.cross(u, v)
        matrix = np.eye(4)
        matrix[:3] = np.stack([u, v, n / np.linalg.norm(n), center], axis=1)
        return {"type": "rectangle", "to_world": mi.ScalarTransform4f(matrix)}
    if isinstance(thing, Cylinder):  # without ends
        ends = {"p0": list(thing.start), "p1": list(thing.end)}
        return {"type": "cylinder", "radius": thing.radius, **ends}
    if isinstance(thing, Ellipsoid):
        return _ellipsoid(mi, thing)
    return {"type": "sphere", "center": list(thing.center), "radius": thing.radius}


def _ellipsoid(mi: Any, thing: Ellipsoid) -> dict[str, Any]:
    """Mitsuba's ellipsoids have half axes along the axes of a frame, which a quaternion turns."""
    frame, size, _ = np.linalg.svd(np.array([thing.half_u, thing.half_v, thing.half_w]).T)
    frame *= np.linalg.det(frame)
    # the eigenvector to the eigenvalue 3 (Bar-Itzhack, J. Guidance, Control, Dynamics 23, 2000)
    skew = frame - frame.T
    k = np.empty((4, 4))
    k[:3, :3] = frame + frame.T - np.trace(frame) * np.eye(3)
    k[3, :3] = k[:3, 3] = skew[2, 1], skew[0, 2], skew[1, 0]
    k[3, 3] = np.trace(frame)
    quaternion = np.linalg.eigh(k)[1][:, -1]
    rows = {"centers": thing.center, "scales": size, "quaternions": quaternion}
    arrays = {name: mi.TensorXf(np.array([row])) for name, row in rows.items()}
    return {"type": "ellipsoids", "extent": 1.0, **arrays}


def _camera(mi: Any, camera: Any) -> dict[str, Any]:
    """Mitsuba's camera looks along +z with x to the left."""
    matrix = np.array(camera.matrix) @ np.diag([-1.0, 1.0, -1.0, 1.0])
    width, height = camera.resolution
    opening = 2.0 * math.degrees(math.atan(0.5 * camera.sensor_width / camera.focal_length))
    return {
        "type": "perspective",
        "fov": opening,
        "fov_axis": "larger",
        "near_clip": 1e-2,
        "far_clip": 1e4,
        "to_world": mi.ScalarTransform4f(matrix),
        "sampler": {"type": SAMPLER},
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
    }


def render_mitsuba(scene: Scene) -> Callable[[int, int], np.ndarray]:
    """A function of samples and seed that renders a scene: (height, width, 3), row 0 on top."""
    mi = start()
    world = mi.load_dict(describe(mi, scene))
    width, height = scene.camera.resolution
    description = describe(mi, scene)["integrator"]

    def render(samples: int, seed: int) -> np.ndarray:
        prime = math.isqrt(samples)
        passes = prime if samples * width * height > MOST_LANES else 1
        few = {"samples_per_pass": samples // passes} if passes > 1 else {}
        integrator = mi.load_dict(description | few)
        return np.array(mi.render(world, integrator=integrator, spp=samples, seed=seed))

    return render


def main() -> None:
    """Climb the ladder; `--check` alone says by its exit code whether LLVM is there."""
    if sys.argv[1:] == ["--check"]:
        sys.exit(0 if start().variant().startswith("llvm") else 1)
    given = parse(__doc__ or "")
    scene = bench_scene(given.scene, given.width, given.height)
    render = render_mitsuba(scene)
    mitsuba = sys.modules["mitsuba"]
    version = f"Mitsuba {mitsuba.__version__} {mitsuba.variant()}"
    climb(render, SAMPLES, given, version, lambda picture: np.moveaxis(picture[::-1], -1, 0))


if __name__ == "__main__":
    main()
