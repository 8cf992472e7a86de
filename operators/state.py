# SPDX-License-Identifier: GPL-3.0-or-later
"""What the host keeps between clicks: the running render, and what each scene leaves out.

Nothing of it is Blender data, so undo and file loading cannot pull it away.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..adaptive_drt.scene.description import Issue
from .job import Job


@dataclass
class State:
    """What runs and what was found.

    job : the running render, if any.
    preparing : whether a render is about to read the scene.
    left : renders that nobody waits for any more, whose threads may have yet to end.
    watch : is told of the engine's progress with the scene and the job; None: nobody.
    issues : the last found, by `issues_key`.
    layers : the same apart by view layer.
    logged : the last that were logged, by `issues_key` and view layer.
    figures : of the last render, by `issues_key`.
    newest : name of the image that holds the newest picture, by `issues_key`.
    report : text about the last found, of whatever scene; "" where nothing was found in this file.
    news : how many reports there were.
    is_strict : whether the engine refuses to render what lacks an object.
    """

    job: Job | None = None
    preparing: bool = False
    left: deque[Job] = field(default_factory=deque)
    watch: Callable[[Any, Job], None] | None = None
    issues: dict[str, tuple[Issue, ...]] = field(default_factory=dict)
    layers: dict[str, dict[str, tuple[Issue, ...]]] = field(default_factory=dict)
    logged: dict[tuple[str, str], tuple[Issue, ...]] = field(default_factory=dict)
    figures: dict[str, dict[str, Any]] = field(default_factory=dict)
    newest: dict[str, str] = field(default_factory=dict)
    report: str = ""
    news: int = 0
    is_strict: bool = False

    def leave(self, job: Job | None = None) -> None:
        """Be done with a render, the running one unless given, and let its threads end."""
        job = job or self.job
        if job is not None:
            job.leave()
            self.left.append(job)
            while self.left and not self.left[0].alive:
                self.left.popleft()
        if job is self.job:
            self.job = None

    def join(self) -> None:
        """Wait until the threads of all renders that were left have ended."""
        while self.left:
            self.left.popleft().join()


state = State()


def issues_key(scene: Any) -> str:
    """Return what `State` knows a Blender scene by, in any file."""
    return f"{scene.session_uid}"
