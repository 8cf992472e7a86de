# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the golden pictures again: for a commit that is meant to change some.

Prints, for each case, how many of its arrays changed and by how much its colours did, in units of
the picture's mean. Cases of which this environment's digests are the same are left as they are.
Where the environment has no digests of a case yet, and the picture keeps the rule of
`golden.rule`, its digests are added, and the arrays stay. What changed is dropped from the digests
of all other environments, in which `golden.rule` then holds for it until they are written there.
"""

import math
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from golden.environment import environment_key  # noqa: E402
from golden.rule import difference, state_of  # noqa: E402
from golden.scenes import CASES  # noqa: E402
from golden.store import (  # noqa: E402
    arrays_of,
    digests_of,
    read_arrays,
    read_digests,
    write_arrays,
    write_digests,
)


def main():
    known, stored = read_digests(), read_arrays()
    print(f"{environment_key()}: digests of {len(known)} cases, arrays of {len(stored)}")
    arrays, digests, stale, most = {}, {}, set(stored) - set(CASES), 0.0
    for name in stale:
        print(f"   gone  {name}")
    for name, case in CASES.items():
        own = arrays_of(case.film())
        digests[name] = digests_of(own)
        state, what = state_of(case, own, digests[name], stored.get(name), known.get(name))
        arrays[name] = own if state in ("new", "CHANGED") else stored[name]
        off = difference(own, stored[name]) if name in stored else math.nan
        if state in ("new", "CHANGED"):
            stale.add(name)
        if state == "CHANGED":
            most = max(most, off)
        print(f"{state:>7} {off:8.1e}  {name}{': ' if what else ''}{', '.join(what)}", flush=True)
    if stale or list(arrays) != list(stored):
        write_arrays(arrays)
    write_digests(digests, stale)
    print(f"largest difference of what changed: {most:.1e} of the mean")


if __name__ == "__main__":
    main()
