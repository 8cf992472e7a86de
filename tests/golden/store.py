# SPDX-License-Identifier: GPL-3.0-or-later
"""What golden pictures looked like when they were last written: arrays, and digests of them.

`arrays.npz` holds the arrays of all cases, end to end, from one environment. Each file in
`digests` holds the digests of one environment: see `environment`.
"""

import hashlib
import json
from pathlib import Path

import numpy as np

from .environment import environment, environment_key

__all__ = [
    "ARRAYS",
    "arrays_of",
    "digests_of",
    "read_arrays",
    "read_digests",
    "write_arrays",
    "write_digests",
]

FOLDER = Path(__file__).parent
ARRAYS_FILE, DIGESTS_FOLDER = FOLDER / "arrays.npz", FOLDER / "digests"
ARRAYS = ("color", "alpha", "depth", "normal", "mask", "samples")
"""Arrays of a film; with them goes its estimate of its error, in an array of one."""


def arrays_of(film):
    """The arrays of a film by name, C-contiguous, and `estimate` (1,); 0 with method RAYS."""
    arrays = {name: np.ascontiguousarray(getattr(film, name)) for name in ARRAYS}
    arrays["estimate"] = np.array([film.stats.get("error_estimate", 0.0)])
    return arrays


def digests_of(arrays):
    """SHA-256 of each array: of its type, its shape and its bytes."""
    return {
        name: hashlib.sha256(
            f"{array.dtype.str} {array.shape} ".encode() + array.tobytes()
        ).hexdigest()
        for name, array in arrays.items()
    }


def read_arrays():
    """The stored arrays: {case: {name: array}}; none before they are first written."""
    if not ARRAYS_FILE.exists():
        return {}
    with np.load(ARRAYS_FILE, allow_pickle=False) as file:
        cases = json.loads(str(file["cases"]))
        flat = {name: file[name] for name in file.files if name != "cases"}
    arrays, first = {}, dict.fromkeys(flat, 0)
    for case, shapes in cases.items():
        arrays[case] = {}
        for name, shape in shapes.items():
            end = first[name] + int(np.prod(shape))
            arrays[case][name] = flat[name][first[name] : end].reshape(shape)
            first[name] = end
    return arrays


def write_arrays(arrays):
    """Store arrays as `read_arrays` returns them; all cases have the same names."""
    cases = {
        case: {name: array.shape for name, array in own.items()} for case, own in arrays.items()
    }
    names = next(iter(cases.values()))
    flat = {name: np.concatenate([own[name].ravel() for own in arrays.values()]) for name in names}
    np.savez_compressed(ARRAYS_FILE, cases=np.array(json.dumps(cases)), **flat)


def read_digests(key=None):
    """The stored digests of an environment, this one unless told: {case: {name: digest}}.

    Without any for it: {}.
    """
    path = DIGESTS_FOLDER / f"{key or environment_key()}.json"
    return json.loads(path.read_text(encoding="utf-8"))["digests"] if path.exists() else {}


def write_digests(digests, stale):
    """Store this environment's digests, and take `stale` cases from those of all others."""
    DIGESTS_FOLDER.mkdir(exist_ok=True)
    own = DIGESTS_FOLDER / f"{environment_key()}.json"
    for path in sorted(DIGESTS_FOLDER.glob("*.json")):
        if path != own:
            known = json.loads(path.read_text(encoding="utf-8"))
            kept = {case: each for case, each in known["digests"].items() if case not in stale}
            _write(path, {**known, "digests": kept})
    _write(own, {"environment": environment(), "digests": digests})


def _write(path, known):
    path.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
