# SPDX-License-Identifier: GPL-3.0-or-later
"""The command that joins parts of one picture: `blender -b -c adaptive_join --output WHOLE PART …`.

Each part is an OpenEXR file of the whole picture's size, and its header says which pixels were
rendered. These pixels are copied, of every pass, so the joined picture equals one that was rendered
as a whole to the last bit. They could not be added up: where nothing was rendered, Blender writes a
depth of 1e11.
"""

from __future__ import annotations

import argparse
import json
import os
import re
from contextlib import ExitStack
from typing import Any, NamedTuple

import bpy

from . import terminal
from .figures import KEY, REGION
from .openexr import Image, OpenEXRError, Reader, Writer

NAME = "adaptive_join"

OF_ONE_PART = (b"RenderTime",)
"""Attributes that tell of one part alone, beside our own figures: the joined file has none."""


class Part(NamedTuple):
    """A file that holds a part of the picture.

    left, bottom, right, top : the pixels that were rendered, right and top exclusive.
    """

    path: str
    reader: Reader
    left: int
    bottom: int
    right: int
    top: int

    def rows(self, height: int) -> tuple[int, int]:
        """Return its first row, counted from the top of the picture, and the row after its last."""
        return height - self.top, height - self.bottom


def make_parser() -> argparse.ArgumentParser:
    """Return the parser."""
    parser = argparse.ArgumentParser(
        prog=f"blender -b -c {NAME}",
        description="Join parts of a picture that adaptive_render has written, with all passes.",
        epilog="Exit code: 0 if the file is written, 1 otherwise.",
    )
    add = parser.add_argument
    pattern = "OpenEXR files; with --parts all of them, as in part_####_{column}_{row}.exr"
    add("inputs", nargs="+", metavar="PART", help=pattern)
    add("--output", required=True, help="the OpenEXR file to write")
    add("--frame", type=int, help="stands for #### in all paths")
    add("--parts", type=terminal.parse_pair, metavar="COLUMNS,ROWS", help="as in adaptive_render")
    return parser


def path_of(pattern: str, frame: int | None) -> str:
    """Return a path with the frame in place of #### in the file's name, as Blender writes it."""
    folder, name = os.path.split(pattern)
    if frame is not None:
        name = re.sub("#+", lambda marks: f"{frame:0{len(marks[0])}d}", name)
    return os.path.abspath(os.path.join(folder, name))


def paths_of(options: argparse.Namespace) -> list[str]:
    """Return the files to join."""
    columns, rows = options.parts or (1, 1)
    texts = [
        one.replace("{column}", str(column)).replace("{row}", str(row))
        for one in options.inputs
        for row in range(1, rows + 1)
        for column in range(1, columns + 1)
    ]
    return [path_of(text, options.frame) for text in texts]


def join(target: str, paths: list[str]) -> None:
    """Write the picture that the files are parts of.

    Raises
    ------
    OpenEXRError, OSError
        A file cannot be read or written, or the parts are not those of one picture.
    """
    with ExitStack() as stack:
        parts = [_open(path, stack) for path in paths]
        first = parts[0].reader
        for part in parts[1:]:
            if _shape(part.reader) != _shape(first):
                raise OpenEXRError(f'"{part.path}" differs from "{paths[0]}" in size or passes')
        _refuse_gaps(parts, first.images[0])
        os.makedirs(os.path.dirname(target), exist_ok=True)
        unfinished = f"{target}.unfinished"
        stack.callback(_remove, unfinished)
        with open(unfinished, "wb") as file:
            writer = Writer(file, first.version, [_joined(image) for image in first.images])
            for number in range(len(first.images)):
                _copy(writer, number, parts)
            writer.close()
        # whoever finds the file finds all of it
        os.replace(unfinished, target)


def _open(path: str, stack: ExitStack) -> Part:
    try:
        reader = Reader(stack.enter_context(open(path, "rb")))
    except OpenEXRError as error:
        raise OpenEXRError(f'"{path}": {error}') from None
    for image in reader.images:
        for name, (_, value) in image.attributes.items():
            if name.startswith(f"{KEY}.".encode()):
                region = json.loads(value).get(REGION)
                if region:
                    return Part(path, reader, *region)
    raise OpenEXRError(f'"{path}" does not say which part it is: it is not from adaptive_render')


def _shape(reader: Reader) -> list[tuple[Any, ...]]:
    """Return what all parts have to share."""
    return [(one.width, one.height, one.rows, one.attributes[b"channels"]) for one in reader.images]


def _refuse_gaps(parts: list[Part], image: Image) -> None:
    """Raise an error unless each pixel is in one part and no more."""
    for index, one in enumerate(parts):
        if one.right > image.width or one.top > image.height:
            raise OpenEXRError(f'"{one.path}" is cropped to the part: render it without --crop')
        for other in parts[:index]:
            if max(one.left, other.left) < min(one.right, other.right) and max(
                one.bottom, other.bottom
            ) < min(one.top, other.top):
                raise OpenEXRError(f'"{one.path}" and "{other.path}" overlap')
    held = sum((one.right - one.left) * (one.top - one.bottom) for one in parts)
    if held != image.width * image.height:
        missing = image.width * image.height - held
        raise OpenEXRError(f"{missing} of {image.width * image.height} pixels are in no part")


def _joined(image: Image) -> Image:
    """Return the image with the header of the whole picture."""
    kept = {
        name: value
        for name, value in image.attributes.items()
        if name not in OF_ONE_PART and not name.startswith(f"{KEY}.".encode())
    }
    return Image(kept, image.channels, image.width, image.height, image.rows)


def _copy(writer: Writer, number: int, parts: list[Part]) -> None:
    """Copy the pixels of one image, block by block."""
    image = parts[0].reader.images[number]
    for block in range(image.blocks):
        first, last = image.rows_of(block)
        whole = None
        for part in parts:
            high, low = part.rows(image.height)
            rows = slice(max(high - first, 0), min(low, last) - first)
            if rows.start >= rows.stop:
                continue
            pixels = part.reader.read(part.reader.images[number], block)
            if whole is None:
                whole = pixels.copy()
            for columns in image.spans(part.left, part.right):
                whole[rows, columns] = pixels[rows, columns]
        assert whole is not None, "each row is in a part"
        writer.write(number, block, whole)


def _remove(path: str) -> None:
    if os.path.exists(path):
        os.remove(path)


def run(arguments: list[str]) -> int:
    """Run the command and return its exit code."""
    try:
        options = make_parser().parse_args([a for a in arguments if a != "--"])
    except SystemExit as end:
        return int(bool(end.code))
    target = path_of(options.output, options.frame)
    try:
        join(target, paths_of(options))
    except (OpenEXRError, OSError) as error:
        return terminal.fail(NAME, str(error))
    terminal.tell(NAME, target)
    return 0


_handles: list[Any] = []


def register() -> None:
    _handles.append(bpy.utils.register_cli_command(NAME, run))


def unregister() -> None:
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())
