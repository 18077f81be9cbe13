"""Changes one operator of the source at random and shows whether the tests notice it.

    python tests/mutants.py [--count 10] [--seed 0] [--room sources] [--jobs 2] [--tiers 2] [TEST…]

Each change is made in a copy of the repository. The tests of its room run first, in all tiers, then all others: one
that fails is enough. A survivor is a gap in the tests, or the same program: look at it.
"""

import argparse
import ast
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
SOURCE = Path("src", "levelhead")
TIERS = ("not compiled and not slow and not full", "(compiled or slow) and not full", "full")  # make quick, test, …
NATIVE = ("engine", "export", "filters", "guard", "kernels")  # rooms that the native engine is made of
SWAPS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.Lt: ("<", ">="), ast.LtE: ("<=", ">"), ast.Gt: (">", "<="),
    ast.GtE: (">=", "<"), ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.And: ("and", "or"), ast.Or: ("or", "and"), ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"),
}  # fmt: skip


class Mutant(NamedTuple):
    """One operator: its file below the repository, its line from 1, its place in the line, and its replacement."""

    path: Path
    line: int
    column: int
    old: str
    new: str


def operators(path: Path) -> list[Mutant]:
    """All operators of a file that can be changed, each found between its two operands."""
    text = (ROOT / path).read_text(encoding="utf-8")
    lines = text.splitlines()
    found = []
    for node in ast.walk(ast.parse(text)):
        for operator, left, right in operands(node):
            old, new = SWAPS.get(type(operator), ("", ""))
            if not old or left.end_lineno != right.lineno:
                continue
            raw = lines[right.lineno - 1].encode()
            between = raw[left.end_col_offset or 0 : right.col_offset]
            if (at := between.find(old.encode())) >= 0:
                found.append(Mutant(path, right.lineno, (left.end_col_offset or 0) + at, old, new))
    return found


def operands(node: ast.AST) -> list[tuple[ast.AST, ast.expr, ast.expr]]:
    """(operator, left, right) of each operation that a node is."""
    if isinstance(node, ast.BinOp):
        return [(node.op, node.left, node.right)]
    if isinstance(node, ast.BoolOp):
        return [(node.op, a, b) for a, b in zip(node.values, node.values[1:], strict=False)]
    if isinstance(node, ast.Compare):
        return list(zip(node.ops, [node.left, *node.comparators], node.comparators, strict=False))
    return []


def apply(mutant: Mutant, copy: Path) -> None:
    """Makes the change in a copy of the repository."""
    lines = (copy / mutant.path).read_bytes().split(b"\n")
    line = lines[mutant.line - 1]
    end = mutant.column + len(mutant.old)
    lines[mutant.line - 1] = line[: mutant.column] + mutant.new.encode() + line[end:]
    (copy / mutant.path).write_bytes(b"\n".join(lines))


def rounds(mutant: Mutant, tests: Sequence[str], tiers: Sequence[str]) -> list[tuple[int, str, list[str]]]:
    """(tier, mark, test files) of each run: the tests of the room in all tiers, then all others."""
    room = Path(mutant.path.parts[2]).stem
    files = sorted(path.relative_to(ROOT) for path in (ROOT / "tests").rglob("test_*.py"))
    mine = [path for path in files if room in path.parts or path.stem.startswith(f"test_{room}")]
    others = [path for path in files if path not in mine]
    parts = [list(tests)] if tests else [[str(path) for path in part] for part in (mine, others)]
    return [(tier, mark, part) for part in parts if part for tier, mark in enumerate(tiers, 1)]


def find_tier(mutant: Mutant, tests: Sequence[str], tiers: Sequence[str], limit: float) -> tuple[int, str]:
    """The tier of the test that notices the change, from 1, and that test; 0: none does.

    A tier that takes longer than ``limit`` s has noticed.
    """
    with tempfile.TemporaryDirectory(prefix="levelhead-mutant-") as folder:
        copy = Path(folder, "repository")
        ignored = shutil.ignore_patterns(".git", ".venv*", "__pycache__", ".*_cache", "node_modules")
        shutil.copytree(ROOT, copy, ignore=ignored)
        apply(mutant, copy)
        env = {**os.environ, "PYTHONPATH": str(copy / "src"), "OPENBLAS_NUM_THREADS": "1"}
        if mutant.path.parts[2] in NATIVE:  # make quick builds it
            build = [sys.executable, "-m", "levelhead.export.extension"]
            if subprocess.run(build, cwd=copy, env=env, capture_output=True, check=False).returncode:
                return 1, "the native engine is not built"
        for tier, mark, files in rounds(mutant, tests, tiers):
            command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", mark]
            try:
                done = subprocess.run(
                    [*command, *files],
                    cwd=copy, env=env, capture_output=True, check=False, timeout=limit,
                )  # fmt: skip
            except subprocess.TimeoutExpired:
                return tier, f"more than {limit:.0f} s"
            if done.returncode == 1:
                failed = re.search(r"^(FAILED|ERROR) (\S+)", done.stdout.decode(), re.MULTILINE)
                return tier, failed[2] if failed else done.stdout.decode()[-200:]
            if done.returncode < 0:
                return tier, f"ended by signal {-done.returncode}"
            if done.returncode not in (0, 5):  # 5: the files have no test of this tier
                raise SystemExit(done.stdout.decode()[-2000:] + done.stderr.decode()[-2000:])
    return 0, ""


def main() -> None:
    """Print each change and its verdict; exit code 1 if one survived."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tests", nargs="*", help="test files (default: all)")
    parser.add_argument("--count", type=int, default=10, help="changes")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--room", default="", help="a folder or file of src/levelhead")
    parser.add_argument("--jobs", type=int, default=1, help="changes that are tried at the same time")
    parser.add_argument("--tiers", type=int, choices=(1, 2, 3), default=1, help="1: make quick, 2: make test, 3: all")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds of a tier, beyond which it has noticed")
    given = parser.parse_args()
    place = ROOT / SOURCE / given.room
    files = sorted(place.rglob("*.py")) if place.is_dir() else [place]
    every = [mutant for file in files for mutant in operators(file.relative_to(ROOT))]
    drawn = random.Random(given.seed).sample(every, min(given.count, len(every)))
    lived = 0
    with ThreadPoolExecutor(given.jobs) as pool:
        tiers = TIERS[: given.tiers]
        verdicts = {pool.submit(find_tier, one, given.tests, tiers, given.limit): one for one in drawn}
        for done in as_completed(verdicts):
            mutant, (tier, test) = verdicts[done], done.result()
            lived += not tier
            verdict = f"tier {tier}" if tier else "SURVIVED"
            print(f"{verdict:9} {mutant.path}:{mutant.line}  {mutant.old} -> {mutant.new}  {test}", flush=True)
    print(f"{len(drawn) - lived} of {len(drawn)} noticed (seed {given.seed}, {len(every)} operators)")
    sys.exit(int(lived > 0))


if __name__ == "__main__":
    main()
