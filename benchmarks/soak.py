# SPDX-License-Identifier: GPL-3.0-or-later
"""Hours in one Blender: renders, cancels, undo and file loads; does its memory settle?

    python benchmarks/soak.py [--minutes 60] [--seed 1] [--page docs/soak.md]

The extension is packed and installed in the Blender that `make blender` makes, with a profile of
its own. Ctrl-C ends the rounds after the present one; the page says how long they took.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import statistics
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests" / "gui"), str(ROOT / "scripts")]

import machine  # noqa: E402
import package  # noqa: E402
from program import Program, find_program  # noqa: E402

FIRST, LAST = (5.0, 10.0), 5.0
"""Minutes after which memory has to have settled, from and to, and length of the end that is
compared with them."""
PATIENCE = 10.0
"""Seconds in which worker processes end after Blender has."""
WRONG = re.compile(r"Traceback|\bError\b|ERROR|CRITICAL|Exception|Segmentation|Not freed")
"""What the log has where something went wrong."""


def install() -> Program:
    """The program with this tree's extension in an empty profile."""
    program = find_program("5.2")
    if isinstance(program, str):
        sys.exit(program)
    package.WHEELS.mkdir(exist_ok=True)
    built = package.build("linux-x64", program.folder)
    told = program.run(
        "--command", "extension", "install-file", "-r", "user_default", "--enable", built
    )
    if told.returncode != 0:
        sys.exit(told.stdout + told.stderr)
    return program


def run_rounds(program: Program, minutes: float, seed: int) -> tuple[int, list[str]]:
    """Run the rounds; returns Blender's exit code and the lines of its log that tell of errors."""
    script = shutil.copy(ROOT / "benchmarks" / "soak_rounds.py", program.folder)
    words = [*program.words(), "-b", "--python-exit-code", "1", "--python"]
    words += [program.inside(Path(script)), "--", program.inside(program.folder)]
    with (program.folder / "log.txt").open("w") as log:
        process = subprocess.Popen(
            [*words, str(minutes), str(seed)],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C is for this script alone
        )
        try:
            code = process.wait()
        except KeyboardInterrupt:
            (program.folder / "stop").touch()
            code = process.wait()
    lines = (program.folder / "log.txt").read_text(errors="replace").splitlines()
    return code, [line for line in lines if WRONG.search(line)]


def still_there(rounds: list[dict[str, Any]]) -> int:
    """Number of processes of the rounds that have not ended with Blender."""
    end = time.monotonic() + PATIENCE
    numbers = {number for facts in rounds for number in facts["processes"]}
    while True:
        left = [number for number in numbers if Path(f"/proc/{number}").exists()]
        if not left or time.monotonic() > end:
            return len(left)
        time.sleep(0.2)


def memory_rows(rounds: list[dict[str, Any]]) -> list[str]:
    """Rows of the table: medians over the early minutes and the last ones."""
    end = rounds[-1]["seconds"] / 60.0
    early = [r for r in rounds if FIRST[0] <= r["seconds"] / 60.0 <= FIRST[1]] or rounds[:1]
    late = [r for r in rounds if r["seconds"] / 60.0 >= end - LAST]
    rows = []
    for name, value in (
        ("Blender", lambda r: r["host"]),
        ("Blender, freed memory returned", lambda r: r["kept"]),
        ("largest worker process", lambda r: max(r["workers"], default=0.0)),
        ("all", lambda r: r["host"] + sum(r["workers"])),
    ):
        # a cancelled render ends its worker processes
        found = [[x for x in map(value, part) if x] or [0.0] for part in (early, late)]
        before, after = map(statistics.median, found)
        most = max(map(value, rounds))
        change = 100.0 * (after / before - 1.0) if before else 0.0
        rows.append(f"| {name} | {before:.0f} | {after:.0f} | {change:+.1f} % | {most:.0f} |")
    return rows


def write_page(rounds: list[dict[str, Any]], facts: dict[str, Any]) -> str:
    """The page."""
    last = rounds[-1]
    counts = last["counts"]
    wrong = facts["wrong"]
    rows = "\n".join(memory_rows(rounds))
    said = "".join(f"\n    {line}" for line in wrong[:20])
    told = f"""
{last["seconds"] / 60.0:.0f} minutes in one process: {counts["load"]} rounds, {counts["small"]} with
a file of one ball, {counts["moving"]} with a moving ball and {counts["heap"]} with a heap of 300.
In each the file is loaded and four of these follow at random, in all {counts["button"]} renders by
the button, {counts["engine"]} by the engine, {counts["cancel"]} that are cancelled after 0 to 1.5 s
({counts["ended"]} still ran then), and {counts["undo"]} edits that are rendered, undone, redone and
undone."""
    ended = f"""
Blender ended with code {facts["code"]}; processes left after it: {facts["left"]}. It had at most
{max(r["children"] for r in rounds)} child processes, and at most
{max(r["threads"] for r in rounds)} threads of Python, {last["threads"]} at the end. Lines of the
log that tell of errors: {len(wrong)}."""
    return f"""\
<!-- Written by benchmarks/soak.py: `python benchmarks/soak.py --page docs/soak.md`. -->
# A long time in one Blender

Measured on: {facts["machine"]}. {facts["blender"]} without a window, seed {facts["seed"]}.

{textwrap.fill(told.strip(), 100)}

Resident memory, MiB, after each round, with the file of one ball loaded: medians over minutes
{FIRST[0]:.0f} to {FIRST[1]:.0f} and over the last {LAST:.0f}, and the most. After each round the
memory that is freed is returned to the system as well, and measured again.

| process | early | end | change | most |
|---|---|---|---|---|
{rows}

{textwrap.fill(ended.strip(), 100)}
{said}"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--page", type=Path)
    options = parser.parse_args()
    facts: dict[str, Any] = {"machine": machine.describe(), "seed": options.seed}
    program = install()
    try:
        facts["blender"] = program.run("--version").stdout.splitlines()[0]
        print(f"rounds and log: {program.folder}", flush=True)
        facts["code"], facts["wrong"] = run_rounds(program, options.minutes, options.seed)
        said = (program.folder / "rounds.jsonl").read_text().splitlines()
        rounds = [json.loads(line) for line in said]
        facts["left"] = still_there(rounds)
        page = write_page(rounds, facts)
        print(page)
        if options.page:
            options.page.write_text(page)
    finally:
        program.close()


if __name__ == "__main__":
    main()
