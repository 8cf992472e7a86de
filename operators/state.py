# SPDX-License-Identifier: GPL-3.0-or-later
"""What the host keeps between clicks: the running render, and what each scene leaves out.

Nothing of it is Blender data, so undo and file loading cannot pull it away.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..adaptive_drt.scene import Issue
from .job import Job


@dataclass
class State:
    """`job` is the running render, if any; `issues` are the last found, by the scene's name."""

    job: Job | None = None
    issues: dict[str, tuple[Issue, ...]] = field(default_factory=dict)


state = State()


def issues_key(scene: Any) -> str:
    """Return what `State.issues` knows a Blender scene by, in any file."""
    return f"{scene.session_uid}"
