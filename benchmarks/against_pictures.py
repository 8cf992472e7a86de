# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the open Blender scene by our engine and by Cycles, and says how far apart they are."""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "blender"))

import bpy
import numpy as np
from numpy.typing import NDArray
from peer import render_cycles, saved

__all__ = ["SURE", "Difference", "compare"]

Array: TypeAlias = NDArray[np.float64]

SURE = 3.0
"""Standard errors by which a figure may be off."""
MOMENTS, LEAST_SAMPLES = 32, 64
"""Times at which Cycles renders what it does not move within the shutter: lights; and the least
number of its samples for each. The noise of its seeds is not independent: errors of still pictures
of one scene correlate by 0.1, so the mean of many pictures keeps a third of the noise of one. Of 64
with 8 samples that was 0.7 %, where the mean of 32 of our still pictures is within 0.04 % of ours
with motion."""


@dataclass
class Difference:
    """How far our picture is from Cycles', relative to the mean of its absolute values.

    rms: root mean square without Cycles' noise. least_rms: what it is at least, by SURE standard
    errors of its square. noise: of Cycles' picture, from two seeds. means: ours less Cycles'.
    means_noise: standard error of `means`. alpha: as rms, but not relative. seconds: of processor
    time of ours. theirs: mean absolute value of Cycles' picture.
    """

    rms: float
    least_rms: float
    noise: float
    means: float
    means_noise: float
    alpha: float
    seconds: float
    theirs: float


def our_picture(folder: Path, tolerance: float) -> tuple[Array, float]:
    """Our picture (height, width, 4) through Blender's F12, and processor seconds."""
    scene = bpy.context.scene
    scene.render.engine = "ADAPTIVE_DRT"
    scene.adaptive_drt.tolerance = tolerance
    scene.view_settings.view_transform = "Raw"
    start = time.process_time()
    picture = saved(folder / "ours.exr")
    return picture, time.process_time() - start


def cycles_picture(folder: Path, samples: int, seed: int, lights_move: bool) -> Array:
    """Cycles' picture (height, width, 4); of moving lights the mean over the shutter."""
    if not lights_move:
        return render_cycles(folder, samples, seed, alpha=True)
    scene = bpy.context.scene
    frame, shutter = scene.frame_current, scene.render.motion_blur_shutter
    scene.render.use_motion_blur = False
    total: Array | float = 0.0
    count = max(LEAST_SAMPLES, samples // MOMENTS)
    for k in range(MOMENTS):
        now = frame + shutter * ((k + 0.5) / MOMENTS - 0.5)
        scene.frame_set(int(now // 1), subframe=now % 1)
        each = render_cycles(folder, count, seed * MOMENTS + k, alpha=True)
        total = total + each
    scene.frame_set(frame)
    scene.render.use_motion_blur = True
    return np.asarray(total) / MOMENTS


def compare(
    tolerances: list[float], samples: int, lights_move: bool, keep: Path | None
) -> list[Difference]:
    """The difference for each tolerance of ours, against Cycles' with two seeds.

    keep: folder for the last of ours and the mean of Cycles', as arrays.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        mine = [our_picture(place, tolerance) for tolerance in tolerances]
        theirs = [cycles_picture(place, samples, seed, lights_move) for seed in (1, 2)]
    if keep is not None:
        np.savez(keep / "pictures.npz", ours=mine[-1][0], theirs=0.5 * (theirs[0] + theirs[1]))
    return [difference(picture, theirs, seconds) for picture, seconds in mine]


def difference(ours: Array, theirs: list[Array], seconds: float) -> Difference:
    """Of our picture from two of Cycles', which have independent noise."""
    first, second = theirs
    mean = 0.5 * (first + second)
    scale = max(float(np.abs(mean[..., :3]).mean()), np.finfo(np.float32).tiny)
    square, unsure, noise = beyond_noise(ours[..., :3], first[..., :3], second[..., :3])
    alpha = beyond_noise(ours[..., 3], first[..., 3], second[..., 3])[0]
    return Difference(
        rms=float(np.sqrt(max(square, 0.0))) / scale,
        least_rms=float(np.sqrt(max(square - SURE * unsure, 0.0))) / scale,
        noise=noise / scale,
        means=float((ours - mean)[..., :3].mean()) / scale,
        means_noise=noise / np.sqrt(1.5 * mean.size) / scale,
        alpha=float(np.sqrt(max(alpha, 0.0))),
        seconds=seconds,
        theirs=scale,
    )


def beyond_noise(ours: Array, first: Array, second: Array) -> tuple[float, float, float]:
    """Mean square of ours less what two noisy pictures show, without their noise; the standard
    error of that; and the root mean square of the noise of one.

    Noise is independent in the two, so the products of both differences have none in the mean.
    """
    products = ((ours - first) * (ours - second)).reshape(ours.shape[0] * ours.shape[1], -1)
    of_pixels = products.mean(axis=1)  # channels share their noise
    noise = float(np.sqrt(((first - second) ** 2).mean() / 2.0))
    return float(of_pixels.mean()), float(of_pixels.std() / np.sqrt(of_pixels.size)), noise
