# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers of the oracle that are kept in `truths.npz`, since they take most of a test's time.

An answer is found by a digest of what it depends on: the function, the source of its module and of
those that it imports (without comments and docstrings), and its arguments, of which fields at their
default are left out. So an oracle or a scene that is changed in any way has no kept answer, and is
computed anew: it is never an answer to another question. The variable ADAPTIVE_DRT_TRUTHS chooses:

- nothing: kept answers are used, others computed.
- `check`: all answers are computed, and compared with those that are kept (`make test-all`).
- `keep`: as nothing, and all answers that this process used are kept when it ends (`make truths`).
"""

from __future__ import annotations

import ast
import atexit
import hashlib
import importlib
import os
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from pathlib import Path

import numpy as np

__all__ = ["converged_color", "kept", "light_spread", "masks", "outlines_seen"]

STORE = Path(__file__).with_name("truths.npz")
SAME = 1e-12
"""Largest relative difference of an answer from the kept one that rounding may cause."""
DIGEST_LETTERS = 24
"""Hexadecimal digits of a digest that name an answer."""


@cache
def _tree(module):
    """The program of a module of the oracle without docstrings, and the modules that it imports."""
    path = Path(__file__).with_name(f"{module}.py")
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            if isinstance(body[0].value, ast.Constant):
                body[:1] = []
    imported = {
        node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module
    }
    return ast.dump(tree), imported


@cache
def source_of(module):
    """The programs of a module of the oracle and of all that it imports, without docstrings."""
    found, rest = {}, {module}
    while rest:
        name = rest.pop()
        found[name], imported = _tree(name)
        rest |= imported - found.keys()
    return "\n".join(f"{name}: {found[name]}" for name in sorted(found))


def _default(field):
    return field.default_factory() if field.default_factory is not MISSING else field.default


def described(thing):
    """A thing in plain letters: records by their fields that are not at their default."""
    if is_dataclass(thing):
        parts = [(field.name, getattr(thing, field.name)) for field in fields(thing)
                 if getattr(thing, field.name) != _default(field)]  # fmt: skip
        return f"{type(thing).__name__}({', '.join(f'{n}={described(v)}' for n, v in parts)})"
    if isinstance(thing, np.ndarray):
        return f"{thing.dtype.kind}{thing.shape}{thing.tolist()}"
    if isinstance(thing, tuple | list):
        return f"({', '.join(map(described, thing))})"
    if isinstance(thing, dict):
        return described(sorted(thing.items()))
    return repr(float(thing) if isinstance(thing, np.floating) else thing)


@cache
def _store():
    if not STORE.exists():
        return {}
    with np.load(STORE) as file:
        return {name: file[name] for name in file.files}


_used = {}


@atexit.register
def _write():
    if os.environ.get("ADAPTIVE_DRT_TRUTHS") == "keep" and _used:
        np.savez_compressed(STORE, **dict(sorted(_used.items())))


def kept(function, *arguments, **more):
    """An array that a function of the oracle returns, kept or computed.

    function : 'module.name' within the oracle, so that no more of it is imported than is needed.
    """
    module, name = function.split(".")
    asked = "\n".join((source_of(module), function, described(arguments), described(more)))
    digest = hashlib.sha256(asked.encode()).hexdigest()[:DIGEST_LETTERS]
    check, known = os.environ.get("ADAPTIVE_DRT_TRUTHS") == "check", _store().get(digest)
    if known is None or check:
        answer = getattr(importlib.import_module(f"oracle.{module}"), name)(*arguments, **more)
        value = getattr(answer, "color", answer)
        if known is not None:
            size = np.abs(known).max(initial=0.0) if known.dtype.kind == "f" else 0.0
            np.testing.assert_allclose(value, known, rtol=0.0, atol=SAME * size, err_msg=function)
        known = value
    _used[digest] = known
    return known.copy()


def converged_color(scene, pixels=None, goal=1e-4, scale=None):
    """Radiance (n, 3) of pixels: see `converged`."""
    return kept("converged.converged", scene, pixels, goal=goal, scale=scale)


def masks(scene, **switches):
    """What the mask of a scene must hold at least: see `truth.masks`."""
    return kept("truth.masks", scene, **switches)


def light_spread(scene, pixels):
    """By how much the light changes over pixels: see `spread_jit.light_spread`."""
    return kept("spread_jit.light_spread", scene, pixels)


def outlines_seen(scene, pixels, k, times):
    """Whether places of pixels see more than one object: see `truth.outlines_seen`."""
    return kept("truth.outlines_seen", scene, pixels, k, times)
