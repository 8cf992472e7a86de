# SPDX-License-Identifier: GPL-3.0-or-later
"""The button: renders the scene into image datablocks."""

from __future__ import annotations

import logging
import time
from typing import Any

import bpy

from ..adaptive_drt.scene.description import SceneError
from ..adaptive_drt.scene.settings import SettingsError
from . import report
from .engine_export import export_for_render
from .figures import gather_figures, issues_of, read_figures
from .images import MASK, RESULT, find_image, frame_of, write_images, write_picture
from .issues import missing_count
from .job import Job
from .regions import redraw_panels
from .show import redraw_images, show_rendered
from .state import state

log = logging.getLogger(__name__)

TICK = 0.1
"""Seconds between two looks at a render that runs in a window."""

GRACE = 0.15
"""Seconds that ESC waits for the render's last word, which comes with its next sign of life; after
that the picture is taken as it is."""

SHOW = 0.5
"""Seconds between two showings of the picture so far."""

SPARE = 5.0
"""Times as long as one drawing takes the window is left alone after it. Without a graphics card
Blender draws a picture of 1920 x 1080, and the 3D view with it, in 0.3 to 1.5 s, and panels in
0.1 to 0.3 s."""


class ADRT_OT_render(bpy.types.Operator):
    """Render the scene into images, with more than one ray only where derivatives ask for it"""

    bl_idname = "adaptive_drt.render"
    bl_label = "Adaptive Render"

    _timer: Any = None
    _shown = False
    _due = 0.0
    _drew: float | None = None
    _rest = 0.0
    _said = ""

    @classmethod
    def poll(cls, context: Any) -> bool:
        if state.job is not None or state.preparing or bpy.app.is_job_running("RENDER"):
            cls.poll_message_set("A render is running; ESC cancels it")
            return False
        return context.scene is not None

    def execute(self, context: Any) -> set[str]:
        """Render to the end; what a script and `blender -b` get."""
        if not self._prepare(context):
            return {"CANCELLED"}
        job = state.job
        try:
            job.run()
        finally:
            state.leave()
        return self._finish(job)

    def invoke(self, context: Any, _event: Any) -> set[str]:
        """Render in a thread while the window stays alive."""
        if context.window is None or bpy.app.background:
            return self.execute(context)
        state.preparing = True
        # the window says so before it stands still to read a large scene
        context.workspace.status_text_set("Adaptive Render: reading the scene")
        manager = context.window_manager
        self._timer = manager.event_timer_add(TICK, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def _start(self, context: Any) -> set[str]:
        """Begin the render at the first tick."""
        state.preparing = False
        if not self._prepare(context, watched=True):
            self._leave(context)
            return {"CANCELLED"}
        state.job.start()
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        if state.preparing:
            return self._start(context) if event.type == "TIMER" else {"PASS_THROUGH"}
        job = state.job
        if job is None:  # the add-on was switched off meanwhile
            self._leave(context)
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            job.cancel()
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        if job.ending:
            job.wait(GRACE)
        elif job.running:
            if self._has_rested():
                self._show_progress(context, job.text)
                self._show_so_far(job)
            return {"PASS_THROUGH"}
        state.leave()
        self._leave(context)
        return self._finish(job)

    def _has_rested(self) -> bool:
        """Whether the window may be given something to draw again."""
        now = time.monotonic()
        if self._drew is not None:
            # this tick came after the drawing; what it is late by is what drawing takes
            self._rest = now + SPARE * max(0.0, now - self._drew - TICK)
            self._drew = None
        return now >= self._rest

    def _show_progress(self, context: Any, text: str) -> None:
        if text == self._said:  # nothing to draw again
            return
        self._said = text
        context.workspace.status_text_set(f"Adaptive Render: {text}   (ESC: cancel)")
        redraw_panels()
        self._drew = time.monotonic()

    def _show_so_far(self, job: Job) -> None:
        """Let the picture fill in, now and then, when there is more of it."""
        now = time.monotonic()
        preview = job.take_preview()
        if preview is not None and job.film is not None:
            write_picture(preview, job.film, self._frame)
            if not self._shown:
                # a window must not change inside modal(): that would run its end a second time
                bpy.app.timers.register(show_rendered, first_interval=0.0)
            redraw_images()
            self._shown = True
            self._drew, self._due = now, now + SHOW
        elif now >= self._due:
            job.want_preview()

    def cancel(self, context: Any) -> None:
        """Stop when Blender ends the operator itself: a file is loaded, the window is closed.

        What is done of the picture is kept; a file that is loaded takes it away.
        """
        state.preparing = False
        job = state.job
        if job is not None:
            job.cancel()
            job.wait(GRACE)
        state.leave()
        self._leave(context)
        if job is not None:
            log.warning("the window was closed, or another file is loaded: the render is cancelled")
            self._finish(job)

    def _prepare(self, context: Any, watched: bool = False) -> bool:
        """Export the scene and make the job; report and return False if there is nothing to do."""
        scene = context.scene
        self._subject = report.subject_of(scene, context.view_layer)
        report.begin(scene)
        try:
            self._scene, self._settings = export_for_render(scene, context.view_layer)
            crop = scene.render.use_border and scene.render.use_crop_to_border
            self._frame = frame_of(self._scene.camera, crop)
            state.job = Job(self._scene, self._settings, watched)
        except (SceneError, SettingsError) as error:
            self.report({"ERROR"}, str(error))
            return False
        return True

    def _finish(self, job: Job) -> set[str]:
        """Write what the job left, and tell."""
        if job.error is not None:
            if not isinstance(job.error, (SceneError, SettingsError)):
                log.error("render failed", exc_info=job.error)
            self.report({"ERROR"}, str(job.error) or type(job.error).__name__)
            if self._shown and job.film is not None:
                # the picture is half of this render by now, so its mask and figures go with it
                write_images(job, self._frame, {"cancelled": True, "done": job.factor})
            return {"CANCELLED"}
        if job.film is None:
            self.report({"WARNING"}, "Cancelled before the first pixels; the images are as before")
            return {"CANCELLED"}
        stats = dict(job.film.stats)
        if job.cancelled:
            stats.update(cancelled=True, done=job.factor)
            stats.setdefault("issues", [vars(issue) for issue in self._scene.issues])
        before = read_figures(find_image(MASK))
        figures = gather_figures(stats, self._scene, self._settings, before)
        write_images(job, self._frame, figures)
        state.newest[self._subject.scene] = RESULT
        self._tell(job, figures)
        # a window must not change inside modal(): that would run its end a second time
        if not bpy.app.background:
            bpy.app.timers.register(show_rendered, first_interval=0.0)
        return {"FINISHED"}

    def _tell(self, job: Job, figures: dict[str, Any]) -> None:
        said = report.tell(self._subject, figures)
        report.deliver()
        if job.cancelled:
            said = f"cancelled at {int(100.0 * job.factor)} %, and that much is kept; {said}"
        lacks = job.cancelled or missing_count(issues_of(figures))
        # one line alone: the status bar shows the last
        self.report({"WARNING" if lacks else "INFO"}, f"Adaptive Render: {said}")

    def _leave(self, context: Any) -> None:
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        redraw_panels()


class ADRT_OT_cancel(bpy.types.Operator):
    """Cancel the render that Adaptive Render has begun, and keep what there is of its picture"""

    bl_idname = "adaptive_drt.cancel"
    bl_label = "Cancel Adaptive Render"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: Any) -> bool:
        return state.job is not None

    def execute(self, _context: Any) -> set[str]:
        # who began it sees that at its next look
        state.job.cancel()
        return {"FINISHED"}


def stop() -> None:
    """End all renders and wait for their threads and processes; nothing of them is kept."""
    from ..adaptive_drt.parallel.pool import worker_pool

    state.leave()
    state.join()
    worker_pool.stop()
