# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenEXR files as Blender writes them: their blocks of rows are read and written as octets.

No value is converted, so what is copied stays the same to the last bit. A file holds one image or
several ("parts" in OpenEXR's own words), each with a header; the rows of an image are stored in
blocks, of 16 rows with ZIP and of one with ZIPS or none ("File Layout", "ZIP compression").
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

MAGIC = b"v/1\x01"
"""The first octets of every OpenEXR file."""

MULTIPART, TILED, DEEP = 0x1000, 0x200, 0x800
"""Bits of the version field: several images, tiles in place of rows, several values a pixel."""

ROWS = {0: 1, 2: 1, 3: 16}
"""Rows in a block, by the number of the compression: none, ZIPS and ZIP."""

UNCOMPRESSED = 0

OCTETS = {0: 4, 1: 2, 2: 4}
"""Octets of one value, by the number of a channel's type: unsigned integer, half and float."""

Octets = NDArray[np.uint8]


class OpenEXRError(ValueError):
    """A file is not like those that Blender writes."""


@dataclass
class Image:
    """One image of a file.

    attributes : type and value of each attribute of the header, as octets.
    channels : octets of one value of each channel, in the order of the file.
    width, height : size in pixels.
    rows : rows in a block.
    places : where in the file each block is, from the top of the picture to its bottom.
    """

    attributes: dict[bytes, tuple[bytes, bytes]]
    channels: list[int]
    width: int
    height: int
    rows: int
    places: list[int] = field(default_factory=list)

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return -(-self.height // self.rows)

    def rows_of(self, block: int) -> tuple[int, int]:
        """Return the first row of a block, counted from the top, and the row after its last."""
        return block * self.rows, min((block + 1) * self.rows, self.height)

    def spans(self, left: int, right: int) -> Iterator[slice]:
        """Yield, for each channel, where the octets of some columns are within a row."""
        start = 0
        for octets in self.channels:
            yield slice(start + octets * left, start + octets * right)
            start += octets * self.width


class Reader:
    """A file whose blocks can be read.

    version : the version field of the file.
    images : the images in the file.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        if file.read(4) != MAGIC:
            raise OpenEXRError("it is no OpenEXR file")
        self.version = self._integer()
        if self.version & (TILED | DEEP):
            raise OpenEXRError("its pixels are not stored in rows")
        self.images = list(self._headers())
        for image in self.images:
            octets = self._exactly(8 * image.blocks)
            image.places = list(struct.unpack(f"<{image.blocks}Q", octets))

    def read(self, image: Image, block: int) -> Octets:
        """Return a block of an image as (rows, octets of a row)."""
        self._file.seek(image.places[block] + (4 if self.version & MULTIPART else 0))
        first, last = image.rows_of(block)
        if self._integer() != first + _window(image.attributes)[1]:
            raise OpenEXRError("its rows are not stored from the top to the bottom")
        data = self._exactly(self._integer())
        shape = last - first, image.width * sum(image.channels)
        return _unpack(data, shape[0] * shape[1]).reshape(shape)

    def _headers(self) -> Iterator[Image]:
        while attributes := self._attributes():
            yield _image_of(attributes)
            if not self.version & MULTIPART:
                return

    def _attributes(self) -> dict[bytes, tuple[bytes, bytes]]:
        found = {}
        while name := self._word():
            kind = self._word()
            found[name] = kind, self._exactly(self._integer())
        return found

    def _word(self) -> bytes:
        word = b""
        while (one := self._exactly(1)) != b"\x00":
            word += one
        return word

    def _integer(self) -> int:
        return int.from_bytes(self._exactly(4), "little", signed=True)

    def _exactly(self, count: int) -> bytes:
        octets = self._file.read(max(count, 0))
        if len(octets) != count:
            raise OpenEXRError("its end is missing")
        return octets


class Writer:
    """A file of images like those of another one, block by block.

    Parameters
    ----------
    version : the version field of the file.
    images : the images to write; their places are not looked at.
    """

    def __init__(self, file: BinaryIO, version: int, images: list[Image]) -> None:
        self._file, self._version, self._images = file, version, images
        file.write(MAGIC + struct.pack("<i", version))
        for image in images:
            for name, (kind, value) in image.attributes.items():
                file.write(name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value)
            file.write(b"\0")
        if version & MULTIPART:
            file.write(b"\0")
        self._table = file.tell()
        self._places: list[int] = []
        file.write(bytes(8 * sum(image.blocks for image in images)))

    def write(self, number: int, block: int, pixels: Octets) -> None:
        """Write a block (rows, octets of a row) of the image of that number.

        Blocks are written in their order, those of the first image first.
        """
        image = self._images[number]
        compression = image.attributes[b"compression"][1][0]
        data = pixels.tobytes() if compression == UNCOMPRESSED else _pack(pixels)
        row = image.rows_of(block)[0] + _window(image.attributes)[1]
        self._places.append(self._file.tell())
        if self._version & MULTIPART:
            self._file.write(struct.pack("<i", number))
        self._file.write(struct.pack("<ii", row, len(data)) + data)

    def close(self) -> None:
        """Write the table of places, without which the file is not whole."""
        self._file.seek(self._table)
        self._file.write(struct.pack(f"<{len(self._places)}Q", *self._places))


def _window(attributes: dict[bytes, tuple[bytes, bytes]]) -> tuple[int, ...]:
    """Return left, top, right and bottom of the stored pixels, right and bottom inclusive."""
    return struct.unpack("<4i", attributes[b"dataWindow"][1])


def _image_of(attributes: dict[bytes, tuple[bytes, bytes]]) -> Image:
    try:
        left, top, right, bottom = _window(attributes)
        compression = attributes[b"compression"][1][0]
        channels = list(_channels(attributes[b"channels"][1]))
    except (KeyError, IndexError, struct.error):
        raise OpenEXRError("its header is not whole") from None
    if compression not in ROWS:
        raise OpenEXRError("its compression is neither ZIP nor none")
    return Image(attributes, channels, right - left + 1, bottom - top + 1, ROWS[compression])


def _channels(octets: bytes) -> Iterator[int]:
    """Yield how many octets one value of each channel in a list of channels has."""
    at = 0
    while octets[at]:
        at = octets.index(b"\0", at) + 1
        kind, _, horizontal, vertical = struct.unpack_from("<4i", octets, at)
        if (horizontal, vertical) != (1, 1):
            raise OpenEXRError("a channel has fewer values than there are pixels")
        yield OCTETS[kind]
        at += 16


def _unpack(data: bytes, count: int) -> Octets:
    """Return the octets of a block: inflated, summed up, and its halves interleaved."""
    if len(data) == count:  # what would not have become shorter is stored as it is
        return np.frombuffer(data, np.uint8)
    try:
        octets = np.frombuffer(zlib.decompress(data), np.uint8).copy()
    except zlib.error:
        raise OpenEXRError("a block of it is damaged") from None
    if len(octets) != count:
        raise OpenEXRError("a block of it is damaged")
    octets[1:] -= np.uint8(128)
    halves = np.add.accumulate(octets, dtype=np.uint8)
    found = np.empty(count, np.uint8)
    found[0::2], found[1::2] = np.split(halves, [(count + 1) // 2])
    return found


def _pack(pixels: Octets) -> bytes:
    """Return a block's octets as `_unpack` reads them."""
    octets = pixels.reshape(-1)
    halves = np.concatenate([octets[0::2], octets[1::2]])
    steps = np.concatenate([halves[:1], halves[1:] - halves[:-1] + np.uint8(128)])
    data = zlib.compress(steps.tobytes(), 4)
    return data if len(data) < len(octets) else octets.tobytes()
