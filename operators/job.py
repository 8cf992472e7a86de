# SPDX-License-Identifier: GPL-3.0-or-later
"""One render in a thread of its own. It never touches Blender."""

from __future__ import annotations

import threading
import time
from typing import Any

from ..adaptive_drt.film import Film
from ..adaptive_drt.scene import Scene
from ..adaptive_drt.settings import Settings


class Job:
    """Drives the core's generator to its end, or until it is cancelled.

    Attributes, written by the thread and read by the host:

    film : the picture so far, then the finished one; None before the first progress.
    error : the exception that ended it, or None.
    factor : what part is done, 0 to 1.
    stage : what is being done, in words.
    finished : whether the picture is whole.
    """

    def __init__(self, scene: Scene, settings: Settings) -> None:
        # imported here, in Blender's own thread, so embreex is loaded on the first render only
        from ..adaptive_drt.render import render

        self._render = render
        self._scene, self._settings = scene, settings
        self._cancel = threading.Event()
        self._thread = threading.Thread(target=self.run, name="Adaptive Render", daemon=True)
        self._began = 0.0
        self.film: Film | None = None
        self.error: Exception | None = None
        self.factor = 0.0
        self.stage = "Starting"
        self.finished = False

    def start(self) -> None:
        self._thread.start()

    def run(self) -> None:
        """Render to the end in the caller's thread."""
        self._began = time.monotonic()
        steps: Any = self._render(self._scene, self._settings)
        try:
            while not self._cancel.is_set():
                progress = next(steps)
                self.film = progress.film
                self.factor = progress.done / progress.total if progress.total else 0.0
                self.stage = progress.stage
        except StopIteration as end:
            self.film = end.value
            self.factor = 1.0
            self.finished = True
        except Exception as error:  # the host reports it; a thread has nobody to raise it to
            self.error = error
        finally:
            steps.close()

    def cancel(self) -> None:
        """Ask it to end at the next progress."""
        self._cancel.set()

    def wait(self) -> None:
        if self._thread.is_alive():
            self._thread.join()

    @property
    def cancelled(self) -> bool:
        """Whether it was cancelled before it was done."""
        return self._cancel.is_set() and not self.finished

    @property
    def running(self) -> bool:
        return self._thread.is_alive()

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
