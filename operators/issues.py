# SPDX-License-Identifier: GPL-3.0-or-later
"""The issues of a scene as a list for people: equal ones in one line, missing objects first."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ..adaptive_drt.scene.description import Issue

PLURALS = {"MESH": "meshes", "LATTICE": "lattices", "SPEAKER": "speakers"}


@dataclass(frozen=True)
class Group:
    """Issues that differ in nothing but the datablock.

    kind, reason, missing : as of each `Issue`.
    members : the issues, in the order in which they were found.
    """

    kind: str
    reason: str
    missing: bool
    members: tuple[Issue, ...]

    @property
    def title(self) -> str:
        """The name of the one datablock, or the number of them."""
        if len(self.members) == 1:
            return self.members[0].name
        return f"{len(self.members):,} {plural(self.kind)}"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all, quoted."""
        return tuple(quoted(one) for one in self.members)

    @property
    def line(self) -> str:
        """All of it in one line of text."""
        names = ", ".join(self.names)
        if len(self.members) == 1:
            return f"{names}: {self.reason}"
        return f"{self.title}: {self.reason}: {names}"


def plural(kind: str) -> str:
    """Return what several datablocks of a kind are called."""
    word = kind.replace("_", " ").lower()
    return PLURALS.get(kind, word if word.endswith("s") else f"{word}s")


def quoted(issue: Issue) -> str:
    """Return the name of an issue's datablock as a sentence needs it."""
    # other kinds' names say what they are: 'Material "Red"'
    if issue.kind == "OBJECT" and '"' not in issue.name:
        return f'"{issue.name}"'
    return issue.name


def grouped(issues: Iterable[Issue]) -> tuple[Group, ...]:
    """Return the lines of the list: missing objects first, each part in the order found."""
    found: dict[tuple[bool, str, str], dict[tuple[str, str], Issue]] = {}
    for one in issues:
        members = found.setdefault((one.missing, one.kind, one.reason), {})
        members.setdefault((one.name, one.target), one)
    groups = (
        Group(kind, reason, missing, tuple(members.values()))
        for (missing, kind, reason), members in found.items()
    )
    # sorting is stable
    return tuple(sorted(groups, key=lambda group: not group.missing))


def missing_count(issues: Iterable[Issue]) -> int:
    """Return how many objects are missing from the picture."""
    return len({(one.kind, one.target or one.name) for one in issues if one.missing})


def count_text(issues: Iterable[Issue]) -> str:
    """Return '2 objects missing, 3 notes', or "" when there are none; a note is a line."""
    found = tuple(issues)
    missing = missing_count(found)
    notes = sum(not group.missing for group in grouped(found))
    parts = []
    if missing:
        parts.append(f"{missing:,} object{'s' * (missing != 1)} missing")
    if notes:
        parts.append(f"{notes:,} note{'s' * (notes != 1)}")
    return ", ".join(parts)


def report_text(title: str, issues: Iterable[Issue]) -> str:
    """Return all issues as the lines of a text.

    Parameters
    ----------
    title : first line: what was rendered or checked.
    """
    found = tuple(issues)
    groups = grouped(found)
    lines = [title, count_text(found) or "Nothing is missing or simplified"]
    for heading, missing in (("Missing from the picture", True), ("Notes", False)):
        part = [group for group in groups if group.missing == missing]
        if part:
            lines += ["", heading, "=" * len(heading)]
        for group in part:
            if len(group.members) == 1:
                lines.append(group.line)
            else:
                lines.append(f"{group.title}: {group.reason}")
                lines += [f"    {name}" for name in group.names]
    return "\n".join(lines) + "\n"
