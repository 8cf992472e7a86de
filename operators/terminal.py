# SPDX-License-Identifier: GPL-3.0-or-later
"""What the commands read from and write to the terminal that they were typed in."""

from __future__ import annotations

import argparse
import sys


def parse_pair(text: str) -> tuple[int, int]:
    """Return two whole numbers from 1 on, columns and rows, from a text such as '4,3'."""
    try:
        columns, rows = (int(x) for x in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not like 4,3") from None
    if min(columns, rows) < 1:
        raise argparse.ArgumentTypeError(f"{text} holds a number below 1")
    return columns, rows


def tell(command: str, what: str) -> None:
    """Write how far a command is."""
    sys.stdout.write(f"{command}: {what}\n")
    sys.stdout.flush()


def warn(command: str, what: str) -> None:
    """Write what is wrong."""
    sys.stderr.write(f"{command}: {what}\n")
    sys.stderr.flush()


def fail(command: str, reason: str) -> int:
    """Write why a command ends, and return its exit code."""
    warn(command, reason)
    return 1
