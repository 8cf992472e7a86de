# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine: F12, animations and `blender -b -E ADAPTIVE_DRT`, through the same core call.

An exception must never leave `render()`: Blender would write a black picture, and 5.2 crashes when
the file is a multilayer EXR. An error that is reported writes no file and ends `-b` with 1.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..adaptive_drt.scene.description import SceneError
from ..adaptive_drt.scene.film import PASSES, Film, Pass
from ..adaptive_drt.scene.settings import SettingsError
from . import report
from .engine_export import ENGINE, export, pending
from .figures import REGION
from .job import Job
from .state import issues_key, state
from .temporary import RENDER_RESULT

OPTIONAL = {"Depth": "use_pass_z", "Normal": "use_pass_normal"}
"""Passes of Blender's own that a view layer asks for; the others are always there."""

TICK = 0.05
"""Seconds between two looks at whether to go on."""

GRACE = 0.15
"""Seconds that a cancelled render waits for the last word of its threads."""

SHOW = 1.0
"""Seconds between two showings of the picture so far; ESC waits while one is drawn."""

SPARE = 5.0
"""Times as long as one showing takes the window is left alone after it."""

log = logging.getLogger(__name__)


def passes_of(view_layer: Any) -> Iterator[Pass]:
    """Yield the passes that a view layer gets."""
    for one in PASSES:
        switch = OPTIONAL.get(one.name)
        if switch is None or getattr(view_layer, switch):
            yield one


class ADRT_RE_engine(bpy.types.RenderEngine):
    """Adaptive distributed ray tracing as one of Blender's renderers"""

    bl_idname = ENGINE
    bl_label = "Adaptive Render"
    bl_use_postprocess = True
    bl_use_preview = False
    # the viewport is EEVEE's, and so are the shader nodes on offer
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False

    _told = 0.0
    _said = ""

    def update_render_passes(self, scene: Any = None, renderlayer: Any = None) -> None:
        """Tell Blender, the compositor's Render Layers node among it, which passes there are."""
        for one in passes_of(renderlayer):
            channels = len(one.channels)
            self.register_pass(scene, renderlayer, one.name, channels, one.channels, one.kind)

    def render(self, depsgraph: Any) -> None:
        """Render one view layer at the current frame, or only export it for the button."""
        if pending:
            pending[0].answer(self, depsgraph)
            return
        try:
            self._render(depsgraph)
        except (SceneError, SettingsError) as error:
            self.report({"ERROR"}, str(error))
        except Exception as error:
            log.error("render failed", exc_info=error)
            self.report({"ERROR"}, str(error) or type(error).__name__)

    def _render(self, depsgraph: Any) -> None:
        job = self._export(depsgraph)
        self._told, self._said = 0.0, ""
        # a render of the operator may be running; then its progress stays the one that is shown
        if state.job is None:
            state.job = job
        job.start()
        picture = _Picture(self, depsgraph.view_layer.name)
        try:
            while job.running:
                job.wait(TICK)
                self._tell_progress(job, depsgraph.scene.original)
                picture.show(job)
                if self._is_over():
                    job.cancel()
                    job.wait(GRACE)
                    break
            job.leave()
            if job.error is not None:
                raise job.error
            if job.film is not None:
                picture.finish(job)
        finally:
            state.leave(job)
            picture.close()
        if job.finished:
            self._tell(depsgraph, job.film)

    def _export(self, depsgraph: Any) -> Job:
        self.update_stats("", "Exporting")
        exported, settings = export(self, depsgraph)
        report.refuse_missing(depsgraph.scene.original.frame_current, exported)
        return Job(exported, settings, watched=not bpy.app.background)

    def _is_over(self) -> bool:
        """Whether the user has cancelled."""
        return bool(self.test_break())

    def _tell_progress(self, job: Job, scene: Any) -> None:
        """Say how far it is, if that is news: a window draws it, a terminal writes a line."""
        if state.watch is not None:
            state.watch(scene, job)
        text = job.text
        if text != self._said and (not bpy.app.background or job.factor > self._told):
            self._told, self._said = job.factor, text
            self.update_progress(job.factor)
            self.update_stats("", text)

    def _tell(self, depsgraph: Any, film: Film) -> None:
        """Say how it went, and what is missing or simplified."""
        scene = depsgraph.scene.original
        state.newest[issues_key(scene)] = RENDER_RESULT
        subject = report.subject_of(scene, depsgraph.view_layer)
        self.update_stats("", report.tell(subject, film.stats))


class _Picture:
    """The part of Blender's render result that one view layer fills."""

    def __init__(self, engine: Any, layer: str) -> None:
        self._engine, self._layer = engine, layer
        self._result: Any = None
        self._due = time.monotonic() + SHOW

    def show(self, job: Job) -> None:
        """Show what there is in a window, but not more often than is useful."""
        if bpy.app.background:
            return
        preview = job.take_preview()
        if preview is not None and job.film is not None:
            began = time.monotonic()
            self._fill(job.film, "Combined", preview)
            self._engine.update_result(self._result)
            now = time.monotonic()
            self._due = now + max(SHOW, SPARE * (now - began))
        elif time.monotonic() >= self._due:
            job.want_preview()

    def finish(self, job: Job) -> None:
        """Fill every pass."""
        film = job.film
        assert film is not None
        for one in PASSES:
            self._fill(film, one.name, job.pixels(one.name))
        kept = {k: v for k, v in film.stats.items() if k != "issues"}
        figures = json.dumps({**kept, REGION: job.region})
        # the whole result: what is said of a part is lost when it is merged
        self._engine.get_result().stamp_data_add_field(f"adaptive_drt.{self._layer}", figures)

    def close(self) -> None:
        """Hand the result over; a result that is begun must be ended, whatever happened."""
        if self._result is not None:
            self._engine.end_result(self._result)
            self._result = None

    def _fill(self, film: Film, name: str, flat: NDArray[np.float32]) -> None:
        if self._result is None:
            self._result = self._engine.begin_result(
                0, 0, film.width, film.height, layer=self._layer
            )
        # one layer, since it was asked for; with stereoscopy a pass is there once for each view
        for one in self._result.layers[0].passes:
            if one.name == name:
                one.rect.foreach_set(flat)
