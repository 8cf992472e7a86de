# SPDX-License-Identifier: GPL-3.0-or-later
"""What this engine does with each of Blender's settings: the terms in which the tables state it.

Every property of the datablocks that a render reads is in one class, of `Use` or `Listed`. A test
walks Blender's RNA and fails for a property that is in none, so a new version of Blender shows what
is new in it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any


class Use(Enum):
    """What is done with a property that is never listed.

    RENDERED : the picture heeds it, or Blender has applied it to what the engine is given.
    NO_EFFECT : by its nature it cannot change this engine's picture: it belongs to the viewport,
        the user interface, files, other engines, or speed.
    COVERED : where it would change the picture, another line says so already: of the thing that it
        is a detail of (the f-stop of a depth of field that is left out), or of what it acts on.
    """

    RENDERED = "rendered"
    NO_EFFECT = "no effect"
    COVERED = "covered"


@dataclass(frozen=True)
class Listed:
    """A property that the engine does not heed: listed where it would change the picture.

    Attributes
    ----------
    neutral : values at which it changes nothing.
    reason : what the user is told; `{value}` stands for the value.
    when : tells of the property's owner whether the property is in force at all; None: always.
    missing : whether the thing itself is then not in the picture.
    """

    neutral: tuple[Any, ...]
    reason: str
    when: Callable[[Any], bool] | None = None
    missing: bool = False


Entry = Use | Listed
Table = dict[str, Entry]
"""Entries by the identifiers of an RNA struct's properties."""
