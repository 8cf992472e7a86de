# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render or a check has found: for the panels, in the log, and in a text datablock.

The engine renders in a thread of its own while a window is open, where Blender's data must not be
changed: it notes what it found, and a timer in Blender's own thread writes the text.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..adaptive_drt.scene.description import Issue, Scene, SceneError, validate
from .datablocks import own_datablock
from .figures import issues_of, summary
from .issues import count_text, grouped, report_text
from .regions import redraw_panels
from .state import issues_key, state

log = logging.getLogger(__name__)

TEXT = "Adaptive Render Report"
"""Name of the text datablock."""

LOOK = 0.2
"""Seconds between two looks at whether there is something new to show."""


@dataclass(frozen=True)
class Subject:
    """What is rendered or checked.

    scene : what `State` knows the scene by; the scene itself may be deleted meanwhile.
    layer : name of the view layer.
    title : all of it in words.
    """

    scene: str
    layer: str
    title: str


def subject_of(scene: Any, layer: Any) -> Subject:
    """Return the subject of a report on a view layer of an original scene, at its frame."""
    file = bpy.path.basename(bpy.data.filepath) or "unsaved file"
    title = f'Adaptive Render: scene "{scene.name}" of {file}, frame {scene.frame_current}'
    return Subject(issues_key(scene), layer.name, title)


def tell(subject: Subject, figures: dict[str, Any]) -> str:
    """Keep the figures and issues of a render, log the issues, and return a line about it all.

    May be called in any thread. The line begins with the count, so that a narrow status bar does
    not cut it off.

    Parameters
    ----------
    figures : `Film.stats`, or what `gather_figures` makes of it.
    """
    state.figures[subject.scene] = figures
    found = tuple(issues_of(figures))
    keep(subject, found)
    return "; ".join(part for part in (count_text(found), summary(figures)) if part)


def keep(subject: Subject, found: tuple[Issue, ...]) -> None:
    """Keep the issues of a view layer, and log them unless the log has them already.

    The list of a scene holds the issues of all its view layers.
    """
    layers = state.layers.setdefault(subject.scene, {})
    if subject.layer in layers:  # the first layer of another frame
        layers.clear()
    layers[subject.layer] = found
    key = (subject.scene, subject.layer)
    if state.logged.get(key) != found:  # once for an animation, not once a frame
        state.logged[key] = found
        for line in log_lines(found):
            log.warning("%s", line)
    issues = tuple(dict.fromkeys(one for part in layers.values() for one in part))
    state.issues[subject.scene] = issues
    state.report = report_text(subject.title, issues)
    state.news += 1


def refuse_missing(frame: int, scene: Scene) -> None:
    """Where the command is strict, raise if objects are missing from the picture.

    Raises
    ------
    SceneError
        They are; the message names each.
    """
    if not state.is_strict:
        return
    lacks = [group for group in grouped(validate(scene).issues) if group.missing]
    if lacks:
        count = sum(len(group.members) for group in lacks)
        names = "".join(f"\n  {group.line}" for group in lacks)
        raise SceneError(
            f"--strict: frame {frame} lacks {count} object{'s' * (count != 1)}:{names}"
        )


def log_lines(issues: Iterable[Issue]) -> Iterator[str]:
    """Yield a line for each group of issues."""
    for group in grouped(issues):
        yield f"{'Missing' if group.missing else 'Note'}: {group.line}"


def find_text() -> Any | None:
    """Return this file's own text datablock of the report, or None."""
    return own_datablock(bpy.data.texts, TEXT)


def write_text() -> None:
    """Write the last report into its text datablock; in Blender's own thread alone."""
    text = find_text()
    body = state.report
    if text is None:
        if not body:
            return
        text = bpy.data.texts.new(TEXT)
        # somebody else's linked text may hold the name already
        text.name = TEXT
    if text.as_string() == body:
        return
    text.clear()
    text.write(body)
    text.cursor_set(0)
    for space in text_editors():
        if space.text == text:
            space.top = 0


def text_editors() -> Iterator[Any]:
    """Yield the Text Editors of all windows."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "TEXT_EDITOR":
                yield area.spaces.active


class _Shown:
    """What the timer has shown already, and what a step of undo is to bring back."""

    def __init__(self) -> None:
        self.news, self.idle = 0, True
        self.editors: list[int] = []


_shown = _Shown()


def deliver() -> None:
    """Write the text and draw the panels again, if there is news."""
    news, idle = state.news, state.job is None
    if news != _shown.news and state.report:
        write_text()
    if (news, idle) != (_shown.news, _shown.idle) and not bpy.app.background:
        redraw_panels()
    _shown.news, _shown.idle = news, idle


def _look() -> float:
    """Deliver what is new, but not while Blender renders: then it draws no sidebar either."""
    if bpy.app.is_job_running("RENDER"):
        # the panels may have been drawn with their button greyed out, and a cancelled render has
        # no news
        _shown.idle = False
    else:
        deliver()
    return LOOK


@persistent
def begin(scene: Any, *_: Any) -> None:
    """Before a render of Blender's: forget which view layers were told of."""
    if scene is not None:
        state.layers.pop(issues_key(scene), None)


@persistent
def end(*_: Any) -> None:
    """After a render of Blender's: deliver without waiting where there is no timer."""
    if bpy.app.background:
        deliver()


@persistent
def forget(*_: Any) -> None:
    """After a file is loaded: the report of another file is not written into this one."""
    state.report = ""


@persistent
def remember(*_: Any) -> None:
    """Before a step of undo or redo: note which editors show the report."""
    text = find_text()
    _shown.editors = [
        number for number, space in enumerate(text_editors()) if text and space.text == text
    ]


@persistent
def restore(*_: Any) -> None:
    """After the step: a render is no edit, so its report stays."""
    if not state.report:
        return
    write_text()
    for number, space in enumerate(text_editors()):
        if number in _shown.editors and space.text is None:
            space.text = find_text()


HANDLERS = (
    ("render_init", begin),
    ("render_complete", end),
    ("render_cancel", end),
    ("load_post", forget),
    ("undo_pre", remember),
    ("redo_pre", remember),
    ("undo_post", restore),
    ("redo_post", restore),
)


class ADRT_OT_show_report(bpy.types.Operator):
    """Open the list of what is missing or simplified, with all names, in a Text Editor"""

    bl_idname = "adaptive_drt.show_report"
    bl_label = "Open Report"

    @classmethod
    def poll(cls, _context: Any) -> bool:
        if find_text() is None and not state.report:
            cls.poll_message_set("Render or check the scene first")
            return False
        return True

    def execute(self, context: Any) -> set[str]:
        if find_text() is None:
            write_text()
        text = find_text()
        space = next(text_editors(), None)
        if space is None and not bpy.app.background:
            space = _new_editor(context)
        if space is None:
            self.report({"INFO"}, f'The report is in the text "{TEXT}"')
            return {"FINISHED"}
        space.text, space.top = text, 0
        space.show_word_wrap = True
        return {"FINISHED"}


def _new_editor(context: Any) -> Any:
    """Open a window with a Text Editor alone, as Blender does for its own temporary editors."""
    manager = context.window_manager
    before = set(manager.windows)
    bpy.ops.wm.window_new()
    window = next(w for w in manager.windows if w not in before)
    area = window.screen.areas[0]
    area.type = "TEXT_EDITOR"
    space = area.spaces.active
    # it is no program
    space.show_syntax_highlight = space.show_line_numbers = False
    return space


def register() -> None:
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)
    if not bpy.app.background:
        bpy.app.timers.register(_look, first_interval=LOOK, persistent=True)


def unregister() -> None:
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
