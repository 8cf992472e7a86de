# SPDX-License-Identifier: GPL-3.0-or-later
"""The command: `blender -b scene.blend -c adaptive_render --frame 1..10 --output //out_####`.

Each file is looked at when it is written: on a full disk Blender itself ends with exit code 0.
"""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import bpy

from . import terminal
from .engine import ENGINE
from .job import Job
from .output import fault_of, movie_fault, paths_of, stamp_of
from .state import state
from .temporary import changed

NAME = "adaptive_render"
HEEDED_BY = {
    "tolerance": "EXACT",
    **dict.fromkeys(("order", "distribution", "light_rays", "time_rays", "pixel_rays"), "RAYS"),
}
"""The method that a setting belongs to, if to one alone."""

RANGE = re.compile(r"(\d+)(?:(?:\.\.|-)(\d+))?")
"""A frame or a range of frames, as Blender (1..10) or render farms (1-10) write it.

An animation's frames begin at 0: Blender would render frame 0 in place of one below.
"""

JOINABLE = ("OPEN_EXR", "OPEN_EXR_MULTILAYER")
"""Formats whose parts `adaptive_join` can join."""

CODECS = ("NONE", "ZIP", "ZIPS")
"""Compressions of parts that it can read. Others are replaced by ZIP, which loses nothing."""

STEP = 0.1
"""Of a frame: progress is told this often on a terminal."""


def parse_frames(text: str) -> list[tuple[int, int]]:
    """Return ranges of frames (first, last) from a text such as '5', '1..10' or '1-3,7'."""
    ranges = []
    for piece in text.split(","):
        found = RANGE.fullmatch(piece.strip())
        if found is None:
            raise argparse.ArgumentTypeError(f"{text!r} is not like 5, 1..10 or 1..3,7")
        ranges.append((int(found[1]), int(found[2] or found[1])))
        if ranges[-1][0] > ranges[-1][1]:
            raise argparse.ArgumentTypeError(f"{piece} runs backwards")
    return ranges


def parse_border(text: str) -> tuple[float, ...]:
    """Return left, bottom, right and top as parts of the picture."""
    try:
        left, bottom, right, top = border = tuple(float(x) for x in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not like 0,0,0.5,1") from None
    if not (0.0 <= left < right <= 1.0 and 0.0 <= bottom < top <= 1.0):
        raise argparse.ArgumentTypeError(f"{text} holds nothing of the picture")
    return border


def border_of(part: tuple[int, int], parts: tuple[int, int]) -> tuple[float, ...]:
    """Return the border of a part: its column and row, counted from 1 at the left and the bottom.

    Parts that meet have the same number there, so they neither overlap nor leave a gap.

    Raises
    ------
    RuntimeError
        The picture is not cut into so many columns or rows.
    """
    for name, number, count in zip(("column", "row"), part, parts, strict=True):
        if number > count:
            raise RuntimeError(f"--part: there is no {name} {number} among {count}")
    (column, row), (columns, rows) = part, parts
    return (column - 1) / columns, (row - 1) / rows, column / columns, row / rows


def make_parser(scene: Any) -> argparse.ArgumentParser:
    """Return the parser; its settings, their ranges and their words are the panel's own."""
    parser = argparse.ArgumentParser(
        prog=f"blender -b SCENE.blend -c {NAME}",
        description="Render with Adaptive Render; what is not said here, the file says.",
        epilog="Exit code: 0 if all files are written and whole, 1 otherwise.",
    )
    add = parser.add_argument
    add("--frame", type=parse_frames, help="5, 1..10, 1-10 or 1..3,7; otherwise the file's own")
    add("--output", help="path of the pictures; // is the file's folder, #### the frame")
    formats = scene.render.image_settings.bl_rna.properties["file_format"].enum_items.keys()
    add("--format", choices=formats, metavar="FORMAT", help="as in Blender: " + ", ".join(formats))
    add("--depth", choices=("8", "10", "12", "16", "32"), help="bits a channel, if FORMAT has them")
    border = parser.add_mutually_exclusive_group()
    border.add_argument(
        "--border", type=parse_border, metavar="L,B,R,T", help="render this part, 0 to 1, alone"
    )
    border.add_argument(
        "--part",
        type=terminal.parse_pair,
        metavar="COLUMN,ROW",
        help="render this part of --parts alone, from 1,1 at the left and the bottom; "
        "adaptive_join joins them",
    )
    add("--parts", type=terminal.parse_pair, metavar="COLUMNS,ROWS", default=(1, 1))
    add(
        "--strict",
        action=argparse.BooleanOptionalAction,
        default=False,
        help="stop with exit code 1, before a frame is rendered, if objects are missing from it; "
        "each is named. Otherwise they are listed, and the frame is rendered without them",
    )
    add("--crop", action="store_true", help="write the part alone, not the whole picture around it")
    group = parser.add_argument_group(
        "settings, in place of the file's own; a number that is empty, as in --tolerance=, is not"
    )
    for prop in settings_properties(scene):
        group.add_argument(
            f"--{prop.identifier.replace('_', '-')}",
            help=prop.description.replace("%", "%%"),
            **_value_of(prop),
        )
    return parser


def settings_properties(scene: Any) -> Iterator[Any]:
    """Yield the settings that `scene.adaptive_drt` has."""
    for prop in scene.adaptive_drt.bl_rna.properties:
        if prop.identifier not in ("rna_type", "name"):
            yield prop


def idle_settings(chosen: dict[str, Any], method: str) -> list[str]:
    """Return the settings among those chosen that the method does not look at."""
    return [name for name in chosen if HEEDED_BY.get(name, method) != method]


def _value_of(prop: Any) -> dict[str, Any]:
    if prop.type == "BOOLEAN":
        return {"action": argparse.BooleanOptionalAction, "default": None}
    if prop.type == "ENUM":
        return {"choices": prop.enum_items.keys()}
    return {"type": _within(prop, int if prop.type == "INT" else float), "metavar": "N"}


def _within(prop: Any, kind: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return what reads a number; Blender itself would silently cut it to the range."""

    def number(text: str) -> Any:
        if not text:  # a job's parameter that was left empty
            return None
        value = kind(text)
        if not prop.hard_min <= value <= prop.hard_max:
            raise argparse.ArgumentTypeError(f"{text} is not in {prop.hard_min}..{prop.hard_max}")
        return value

    return number


def _format_values(settings: Any, options: argparse.Namespace) -> dict[str, str]:
    """Return what to set, in this order, for a format; Blender 5 asks for its kind first."""
    name = options.format or settings.file_format
    values = {"file_format": name}
    if hasattr(settings, "media_type"):
        kinds = {"OPEN_EXR_MULTILAYER": "MULTI_LAYER_IMAGE", "FFMPEG": "VIDEO"}
        values = {"media_type": kinds.get(name, "IMAGE"), **values}
    depth = options.depth
    if depth is None and name.startswith("OPEN_EXR") and settings.color_depth == "32":
        depth = "32"  # which Blender 5 forgets on the way from one kind to another
    if depth is not None:
        values["color_depth"] = depth
    if options.part is not None:
        if name not in JOINABLE:
            raise RuntimeError(f"--part: the format {name} cannot be joined: choose OPEN_EXR")
        if settings.exr_codec not in CODECS:
            values["exr_codec"] = "ZIP"
    return values


def render_frames(scene: Any, options: argparse.Namespace) -> None:
    """Render what is asked for and write the files, as `blender -a` does.

    Raises
    ------
    RuntimeError, TypeError
        The render failed, or the format does not have that depth.
    """
    render = scene.render
    chosen = {
        prop.identifier: getattr(options, prop.identifier)
        for prop in settings_properties(scene)
        if getattr(options, prop.identifier) is not None
    }
    asked = {"engine": ENGINE}
    if options.output is not None:
        within = options.output.startswith("//")
        asked["filepath"] = options.output if within else os.path.abspath(options.output)
    border = options.border
    if options.part is not None:
        border = border_of(options.part, options.parts)
    if border is not None:
        sides = ("border_min_x", "border_min_y", "border_max_x", "border_max_y")
        asked.update(zip(sides, border, strict=True))
        asked.update(use_border=True, use_crop_to_border=options.crop)
    with ExitStack() as stack:
        stack.enter_context(changed(scene.adaptive_drt, **chosen))
        method = scene.adaptive_drt.method
        for name in idle_settings(chosen, method):
            terminal.warn(NAME, f"--{name.replace('_', '-')} does nothing with the method {method}")
        stack.enter_context(changed(render, **asked))
        settings = render.image_settings
        stack.enter_context(changed(settings, **_format_values(settings, options)))
        frame = scene.frame_current
        stack.enter_context(changed(scene, frame_current=frame))
        for first, last in frame_ranges(options.frame or [(frame, frame)], render.is_movie_format):
            with changed(scene, frame_start=first, frame_end=last, frame_step=1):
                _render_range(scene)


def frame_ranges(asked: list[tuple[int, int]], is_movie: bool) -> Iterator[tuple[int, int]]:
    """Yield the ranges that Blender renders at a time: single frames, unless a movie holds them."""
    for first, last in asked:
        if is_movie:
            yield first, last
        else:
            yield from ((frame, frame) for frame in range(first, last + 1))


def _render_range(scene: Any) -> None:
    """Render from the scene's first frame to its last, and see that the files are whole.

    Raises
    ------
    RuntimeError
        The render failed, or a file is not whole.
    """
    render, first, last = scene.render, scene.frame_start, scene.frame_end
    is_movie = render.is_movie_format
    paths = paths_of(scene, first)
    before = [stamp_of(path) for path in paths]
    # then Blender leaves out what is there already
    is_there = all(stamp.changed is not None for stamp in before)
    if is_there and not (render.use_overwrite or is_movie):
        terminal.warn(NAME, f'frame {first}: "{paths[0]}" is there already, and Overwrite is off')
        return
    if "FINISHED" not in bpy.ops.render.render(animation=True, scene=scene.name):
        raise RuntimeError(f"frame {first}: cancelled")
    for path, stamp in zip(paths, before, strict=True):
        fault = fault_of(path, stamp)
        if not fault and is_movie:
            fault = movie_fault(path, last + 1 - first)
        if fault:
            raise RuntimeError(f'frame {first}: "{path}": {fault}')


class _Terminal:
    """Says on the terminal how far a frame is, in steps of `STEP`."""

    def __init__(self) -> None:
        self._last: tuple[int, int] | None = None

    def __call__(self, scene: Any, job: Job) -> None:
        now = (scene.frame_current, int(job.factor / STEP))
        if now != self._last:
            self._last = now
            terminal.tell(NAME, f"frame {now[0]}: {job.text}")

    def wrote(self, scene: Any, *_: Any) -> None:
        for path in paths_of(scene, scene.frame_current):
            terminal.tell(NAME, f"frame {scene.frame_current}: {path}")


def run(arguments: list[str]) -> int:
    """Run the command and return its exit code."""
    scene = bpy.context.scene
    try:
        # Blender hands on the -- that ends its own arguments
        options = make_parser(scene).parse_args([a for a in arguments if a != "--"])
    except SystemExit as end:
        return int(bool(end.code))
    if not bpy.data.filepath:
        return terminal.fail(NAME, f"no file is open: blender -b SCENE.blend -c {NAME}")
    progress = _Terminal()
    written = bpy.app.handlers.render_write
    state.watch, state.is_strict = progress, options.strict
    written.append(progress.wrote)
    try:
        render_frames(scene, options)
    # Blender's word for a depth that a format does not have is TypeError
    except (RuntimeError, TypeError) as error:
        return terminal.fail(NAME, str(error).strip().removeprefix("Error: "))
    finally:
        state.watch, state.is_strict = None, False
        # a file that is loaded meanwhile empties the list
        if progress.wrote in written:
            written.remove(progress.wrote)
    return 0


_handles: list[Any] = []


def register() -> None:
    _handles.append(bpy.utils.register_cli_command(NAME, run))


def unregister() -> None:
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())
