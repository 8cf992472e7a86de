# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads Blender's EXR files with the OpenEXR library, whatever parts a version writes."""

from __future__ import annotations

import numpy as np
import OpenEXR


def read_exr(path):
    """{"ViewLayer.Combined": {"R": (height, width) float32, …}, …}, row 0 at the bottom."""
    found = {}
    for part in OpenEXR.File(str(path), separate_channels=True).parts:
        for name, channel in part.channels.items():
            # 5.x may say the layer and the pass in the part's name alone
            full = name if "." in name else f"{part.header.get('name', '')}.{name}"
            layer, _, letter = full.rpartition(".")
            found.setdefault(layer, {})[letter] = channel.pixels[::-1]
    return found


def read_header(path):
    """What the first part says of itself."""
    return OpenEXR.File(str(path), separate_channels=True).parts[0].header


def assert_same_bits(path, other, but=()):
    """Both files hold the same passes, and every value is the same to the last bit.

    but : names of passes whose values may differ.
    """
    first, second = read_exr(path), read_exr(other)
    assert first.keys() == second.keys()
    for name, channels in first.items():
        assert channels.keys() == second[name].keys(), name
        if name in but:
            continue
        for letter, pixels in channels.items():
            assert pixels.dtype == second[name][letter].dtype, f"{name}.{letter}"
            assert pixels.tobytes() == second[name][letter].tobytes(), f"{name}.{letter}"


def flat(channels, order):
    """One pass as `Film.pixels` has it: flat, its channels in the order given."""
    return np.stack([channels[letter] for letter in order], axis=-1).reshape(-1)
