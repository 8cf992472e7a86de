# SPDX-License-Identifier: GPL-3.0-or-later
"""One render in a thread of its own. It never touches Blender."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..adaptive_drt.scene.description import Scene
from ..adaptive_drt.scene.film import PASSES, Film
from ..adaptive_drt.scene.settings import Settings

WINDOW_BATCH = 8_192
"""Pixels of a batch while a window watches, so that progress moves often. The picture is the same
for any; measured on the demo at 1200 x 800, 8,192 took no longer than 65,536."""

BAND = 32
"""Rows that are made pixels for the host at a time; ESC may come between."""

GENTLE = 5
"""Of the steps to 19 by which a process may be nicer to others: the render's threads, while a
window watches. Without a graphics card Blender draws with the same processors: at 1920 x 1080 a new
picture took 1.7 s to be drawn while they rendered, and 0.8 s, as without a render, when they gave
way. ESC waits for that."""


class Job:
    """Drives the core's generator to its end, or until it is cancelled.

    Attributes, written by the thread and read by the host:

    film : the picture so far, then the finished one; None before the first progress.
    error : the exception that ended it, or None.
    factor : what part is done, 0 to 1.
    stage : what is being done, in words.
    finished : whether the picture is whole.
    preview : the picture as it was when the host last asked for it, flat float32; or None.

    A host that has cancelled need not wait until the threads have ended, which takes them a chunk
    of rays, or most of a second where pixels are chosen in a large picture: after `leave` none of
    these is set any more, and the threads end by themselves. The film may then be written to once
    more, by pixels that hold as well.

    Parameters
    ----------
    watched : whether a window is to stay alive and wants to see progress.
    """

    def __init__(self, scene: Scene, settings: Settings, watched: bool = False) -> None:
        # imported here, in Blender's own thread, so embreex is loaded on the first render only
        from ..adaptive_drt.render import render

        self._render = render
        self._scene, self._watched = scene, watched
        self._settings = replace(settings, batch=WINDOW_BATCH) if watched else settings
        self._cancel = threading.Event()
        self._thread: threading.Thread | None = None
        self._over, self._left = threading.Event(), False
        self._telling = threading.Lock()
        self._began = 0.0
        self.film: Film | None = None
        self.error: Exception | None = None
        self.factor = 0.0
        self.stage = "Starting"
        self.finished = False
        self.preview: NDArray[np.float32] | None = None
        self._previewed = 0.0
        self._wanted = threading.Event()
        self._memory: NDArray[np.float32] | None = None

    @property
    def region(self) -> tuple[int, int, int, int]:
        """Pixels of the picture (left, bottom, right, top) that are rendered."""
        return self._scene.camera.region

    def start(self) -> None:
        """Render in a thread of its own.

        The thread is made here. One that never starts keeps its target: it and the job would hold
        each other, and with them the film, until Python looks for such cycles.
        """
        self._thread = threading.Thread(target=self.run, name="Adaptive Render", daemon=True)
        self._thread.start()

    def _give_way(self) -> None:
        """Let the window go first; the threads that this one starts do as it does."""
        # elsewhere a thread's number is taken for a process'
        if self._watched and sys.platform == "linux":
            mine = threading.get_native_id()
            now = os.getpriority(os.PRIO_PROCESS, mine)
            os.setpriority(os.PRIO_PROCESS, mine, now + GENTLE)

    def run(self) -> None:
        """Render to the end in the caller's thread."""
        self._began = time.monotonic()
        self._give_way()
        steps: Any = self._render(self._scene, self._settings)
        try:
            while not self._cancel.is_set():
                progress = next(steps)
                factor = progress.done / progress.total if progress.total else 0.0
                self._tell(film=progress.film, factor=factor, stage=progress.stage)
                self._make_preview()
        except StopIteration as end:
            self._tell(film=end.value, factor=1.0, finished=True)
        except Exception as error:  # the host reports it; a thread has nobody to raise it to
            self._tell(error=error)
        finally:
            # nothing is written to the film any more, even if other threads have yet to end
            self._over.set()
            steps.close()

    def _tell(self, **news: Any) -> None:
        with self._telling:
            if not self._left:
                self.__dict__.update(news)

    def want_preview(self) -> None:
        """Ask for a preview of the picture, if there will be more of it than in the last one.

        This thread makes it: at 1920 x 1080 that takes a window's thread 0.1 s, and most of a
        second when the processors are busy, as they are.
        """
        self._wanted.set()

    def take_preview(self) -> NDArray[np.float32] | None:
        """Return the preview that was asked for, once."""
        preview, self.preview = self.preview, None
        return preview

    def _make_preview(self) -> None:
        if self._wanted.is_set() and self.factor > self._previewed:
            self._wanted.clear()
            self._previewed = self.factor
            self.preview = self._fill("Combined", self._cancel.is_set)

    def pixels(self, name: str) -> NDArray[np.float32]:
        """Return a pass of the picture so far, flat float32, good until the next call."""
        flat = self._fill(name, lambda: False)
        assert flat is not None
        return flat

    def rgba(self, name: str) -> NDArray[np.float32]:
        """Return a pass as `pixels` does, of four channels: a number is grey, and opaque."""
        flat = self.pixels(name)
        if next(one for one in PASSES if one.name == name).channels == "RGBA":
            return flat
        assert self._memory is not None
        # the memory holds four channels, of which the one is now the beginning
        grey = flat.copy()
        image = self._memory.reshape(-1, 4)
        image[:, :3] = grey[:, None]
        image[:, 3] = 1.0
        return self._memory

    def _fill(self, name: str, is_over: Callable[[], bool]) -> NDArray[np.float32] | None:
        """Return what `pixels` does, band by band, or None if it is over before.

        All passes share one memory: 33 MB that Blender had just got took 0.13 s to fill at
        1920 x 1080, where used memory took 0.03 s, and ESC has to wait for it.
        """
        film = self.film
        assert film is not None
        if self._memory is None:
            most = max(len(one.channels) for one in PASSES)
            self._memory = np.empty(film.width * film.height * most, dtype=np.float32)
        end = 0
        for first in range(0, film.height, BAND):
            if is_over():
                return None
            rows = slice(first, first + BAND)
            end += film.pixels(name, rows, self._memory[end:]).size
        return self._memory[:end]

    def cancel(self) -> None:
        """Ask it to end at the next progress."""
        self._cancel.set()

    def wait(self, seconds: float | None = None) -> None:
        """Wait until it tells nothing new any more, at most so many seconds."""
        if self.alive:
            self._over.wait(seconds)

    def leave(self) -> None:
        """Ask it to end, and let it tell nothing more."""
        self._cancel.set()
        with self._telling:
            self._left = True

    def join(self) -> None:
        """Wait until its threads have ended."""
        if self._thread is not None:
            self._thread.join()

    @property
    def cancelled(self) -> bool:
        """Whether it was cancelled before it was done."""
        return self._cancel.is_set() and not self.finished

    @property
    def ending(self) -> bool:
        """Whether it has been asked to end."""
        return self._cancel.is_set()

    @property
    def running(self) -> bool:
        """Whether there may be news."""
        return self.alive and not (self._left or self._over.is_set())

    @property
    def alive(self) -> bool:
        """Whether it still has a thread."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def seconds(self) -> float:
        return time.monotonic() - self._began

    @property
    def text(self) -> str:
        """What a progress bar says; the percentage is floored, so 100 means done."""
        left = ""
        if self.factor > 0.05:  # earlier than that the estimate jumps
            left = f", {self.seconds * (1.0 / self.factor - 1.0):.0f} s left"
        return f"{self.stage} {int(100.0 * self.factor)} %{left}"
