"""Changes one operator of the source at random and shows whether the tests notice it.

    python tests/mutants.py [--count 10] [--seed 0] [--room sources] [--mark "not full"] [TEST…]

Each change is made in a copy of the repository. A survivor is a gap in the tests, or the same program: look at it.
"""

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
SOURCE = Path("src", "levelhead")
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


def survives(mutant: Mutant, tests: Sequence[str], mark: str, limit: float) -> bool:
    """Whether the tests pass with the change."""
    with tempfile.TemporaryDirectory(prefix="levelhead-mutant-") as folder:
        copy = Path(folder, "repository")
        shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".git", ".venv", "__pycache__", ".*_cache"))
        lines = (copy / mutant.path).read_bytes().split(b"\n")
        line = lines[mutant.line - 1]
        end = mutant.column + len(mutant.old)
        lines[mutant.line - 1] = line[: mutant.column] + mutant.new.encode() + line[end:]
        (copy / mutant.path).write_bytes(b"\n".join(lines))
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", mark, *tests]
        paths = {"PYTHONPATH": str(copy / "src"), "OPENBLAS_NUM_THREADS": "1"}
        try:
            done = subprocess.run(
                command, cwd=copy, env={**os.environ, **paths}, capture_output=True, check=False, timeout=limit
            )
        except subprocess.TimeoutExpired:
            return False
    if done.returncode not in (0, 1):
        raise SystemExit(done.stdout.decode()[-2000:] + done.stderr.decode()[-2000:])
    return done.returncode == 0


def main() -> None:
    """Print each change and its verdict; exit code 1 if one survived."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tests", nargs="*", default=["tests"], help="test files (default: all)")
    parser.add_argument("--count", type=int, default=10, help="changes")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--room", default="", help="a folder or file of src/levelhead")
    parser.add_argument("--mark", default="not compiled and not slow and not full", help="the tier, as of pytest -m")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds of the tests, beyond which they noticed")
    given = parser.parse_args()
    place = ROOT / SOURCE / given.room
    files = sorted(place.rglob("*.py")) if place.is_dir() else [place]
    every = [mutant for file in files for mutant in operators(file.relative_to(ROOT))]
    drawn = random.Random(given.seed).sample(every, min(given.count, len(every)))
    lived = 0
    for mutant in drawn:
        alive = survives(mutant, given.tests, given.mark, given.limit)
        lived += alive
        verdict = "SURVIVED" if alive else "noticed"
        print(f"{verdict:9} {mutant.path}:{mutant.line}  {mutant.old} -> {mutant.new}", flush=True)
    print(f"{len(drawn) - lived} of {len(drawn)} noticed (seed {given.seed}, {len(every)} operators)")
    sys.exit(int(lived > 0))


if __name__ == "__main__":
    main()
