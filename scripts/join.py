# SPDX-License-Identifier: GPL-3.0-or-later
"""Joins parts of one picture that were rendered apart, to the last bit; run by Blender.

    blender -b -P join.py -- OUT.exr PART.exr PART.exr …

The parts are OPEN_EXR files of the whole picture's size, empty outside their borders, which must
not overlap: so the picture is their sum. It is written with 32 bits a channel.
"""

import sys
from pathlib import Path

import bpy
import numpy as np


def read_pixels(path):
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    return flat, tuple(image.size)


def join(target, parts):
    total, size = read_pixels(parts[0])
    for part in parts[1:]:
        flat, other = read_pixels(part)
        if other != size:
            raise SystemExit(f"join: {part} is {other}, and not {size}")
        total += flat
    # data, or Blender would convert what it takes for colours of a display
    image = bpy.data.images.new("Joined", *size, alpha=True, float_buffer=True, is_data=True)
    image.pixels.foreach_set(total)
    image.file_format, image.filepath_raw = "OPEN_EXR", str(target)
    image.save()


own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
if len(own) < 3:
    raise SystemExit("usage: blender -b -P join.py -- OUT.exr PART.exr PART.exr …")
join(Path(own[0]).resolve(), [Path(part).resolve() for part in own[1:]])
