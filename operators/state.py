# SPDX-License-Identifier: GPL-3.0-or-later
"""What the host keeps between clicks: the running render, and what each scene leaves out.

Nothing of it is Blender data, so undo and file loading cannot pull it away.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..adaptive_drt.scene import Issue
from .job import Job


@dataclass
class State:
    """What runs and what was found.

    job : the running render, if any.
    watch : is told of the engine's progress with the scene and the job; None: nobody.
    issues : the last found, by `issues_key`.
    figures : of the last render, by `issues_key`.
    """

    job: Job | None = None
    watch: Callable[[Any, Job], None] | None = None
    issues: dict[str, tuple[Issue, ...]] = field(default_factory=dict)
    figures: dict[str, dict[str, Any]] = field(default_factory=dict)


state = State()


def issues_key(scene: Any) -> str:
    """Return what `State` knows a Blender scene by, in any file."""
    return f"{scene.session_uid}"
