# SPDX-License-Identifier: GPL-3.0-or-later
"""Mutation test: which small faults in a module of the core do given tests notice?

    python benchmarks/mutate.py geometry/spherical_curves --count 40 --seed 1 -- tests/geometry

Each mutant is the module with one comparison, operator, number or function exchanged for another.
The tests are run with it until one fails; a mutant that none notices is printed with its line. A
run that takes ten minutes is counted apart: the mutant may have made a loop endless, or the machine
may be busy. A run that ends in another way, killed for example, stops the whole. The checkout in
the working directory is tested, and no file of it is written.
"""

import argparse
import ast
import importlib.abc
import importlib.util
import os
import random
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

OPERATORS = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
"""What each operator is exchanged for."""
FUNCTIONS = {
    "minimum": "maximum", "maximum": "minimum", "min": "max", "max": "min", "any": "all",
    "all": "any", "sin": "cos", "cos": "sin", "floor": "ceil", "ceil": "floor",
}  # fmt: skip
"""What each function of NumPy is exchanged for."""
SECONDS = 600.0
"""Time after which a run of the tests is given up."""
FAILED, COLLECTION_FAILED = 1, 2
"""What pytest returns when a test fails, and when a module cannot be imported."""


def places(tree):
    """All places of a module at which something can be exchanged, as (node, field, position)."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            yield from ((node, "ops", k) for k, op in enumerate(node.ops) if type(op) in OPERATORS)
        elif isinstance(node, ast.BinOp | ast.AugAssign | ast.BoolOp):
            if type(node.op) in OPERATORS:
                yield node, "op", None
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Invert | ast.Not):
            yield node, "operand", None
        elif isinstance(node, ast.Attribute) and node.attr in FUNCTIONS:
            yield node, "attr", None
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float, bool):
            yield node, "value", None


def without_annotations(tree):
    """The tree without annotations of types, which are never computed with."""
    for node in ast.walk(tree):
        for name in ("annotation", "returns"):
            if getattr(node, name, None) is not None and not isinstance(node, ast.AnnAssign):
                setattr(node, name, None)
    return tree


def mutant(source, number):
    """A module's tree with the fault of a number, and what was exchanged, in words."""
    tree = without_annotations(ast.parse(source))
    node, name, position = list(places(tree))[number]
    before = ast.unparse(node)
    if name == "ops":
        node.ops[position] = OPERATORS[type(node.ops[position])]()
    elif name == "op":
        node.op = OPERATORS[type(node.op)]()
    elif name == "operand":
        node.op = ast.UAdd() if isinstance(node.op, ast.USub) else ast.USub()
        if isinstance(node.op, ast.USub):  # the operand itself, of a mask
            node.op = ast.Invert()
            node.operand = ast.UnaryOp(ast.Invert(), node.operand)
    elif name == "attr":
        node.attr = FUNCTIONS[node.attr]
    else:
        node.value = not node.value if isinstance(node.value, bool) else node.value + 1
    after = ast.unparse(ast.fix_missing_locations(node))
    return ast.fix_missing_locations(tree), f"line {node.lineno}: {before} -> {after}"


class Mutator(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Loads one module with a fault, and leaves all others alone."""

    def __init__(self, path, number):
        self.path, self.number = Path(path), int(number)
        self.name = ".".join(("adaptive_drt", *self.path.with_suffix("").parts))

    def find_spec(self, name, path=None, target=None):
        return importlib.util.spec_from_loader(name, self) if name == self.name else None

    def exec_module(self, module):
        file = Path("adaptive_drt") / self.path
        module.__file__ = str(file.resolve())
        tree, _ = mutant(file.read_text(encoding="utf-8"), self.number)
        exec(compile(tree, str(file), "exec"), module.__dict__)


if "ADAPTIVE_DRT_MUTANT" in os.environ:  # as a plugin of pytest: -p mutate
    sys.meta_path.insert(0, Mutator(*os.environ["ADAPTIVE_DRT_MUTANT"].split(":")))


def outcome(path, number, tests):
    """What becomes of a mutant: "noticed" if any of the tests fails, "survives" or "timed out"."""
    folders = (str(Path(__file__).parent), os.environ.get("PYTHONPATH", ""))
    changes = {
        "ADAPTIVE_DRT_MUTANT": f"{path}:{number}",
        "PYTHONPATH": os.pathsep.join(folders),
        "OPENBLAS_NUM_THREADS": "1",
    }
    command = [sys.executable, "-m", "pytest", "-p", "mutate", "-p", "no:cacheprovider", "-xq"]
    try:
        done = subprocess.run(
            [*command, *tests], env=os.environ | changes, capture_output=True, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        return "timed out"
    if done.returncode not in (0, FAILED, COLLECTION_FAILED):
        raise RuntimeError(f"pytest returned {done.returncode} for mutant {number} of {path}")
    return "noticed" if done.returncode else "survives"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("module", help="such as numerics/taylor_range")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--numbers", help="only these mutants, such as 3,17")
    parser.add_argument("tests", nargs="+")
    chosen = parser.parse_args()
    path = f"{chosen.module}.py"
    source = (Path("adaptive_drt") / path).read_text(encoding="utf-8")
    every = range(len(list(places(without_annotations(ast.parse(source))))))
    if chosen.numbers:
        some = [int(number) for number in chosen.numbers.split(",")]
    else:
        some = sorted(random.Random(chosen.seed).sample(every, min(chosen.count, len(every))))
    with ThreadPoolExecutor(chosen.jobs) as pool:
        found = list(pool.map(lambda number: outcome(path, number, chosen.tests), some))
    for number, seen in zip(some, found, strict=True):
        if seen != "noticed":
            print(f"{seen}: {number}, {mutant(source, number)[1]}")
    counts = ", ".join(
        f"{found.count(kind)} {kind}" for kind in ("noticed", "survives", "timed out")
    )
    print(f"{chosen.module}: {counts} of {len(some)} mutants, of {len(every)} in all")


if __name__ == "__main__":
    main()
