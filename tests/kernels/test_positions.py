"""Kernels read and build records by name: a field that is added in the middle must shift nothing.

Vectors, quaternions, matrices and flat covariances have an order of their own and are exempt.
"""

import ast
import re
from pathlib import Path

import levelhead

ROOMS = ("engine", "filters", "guard", "kernels")
MOST = 3  # fields by position
ENTRY = re.compile(r"_|[a-z]?[wxyz]{1,2}|[a-z]")  # of a vector or a matrix
ORDERED = {"Vec3", "Quat", "Mat2", "Mat3", "Cov", "Covariance", "Euler"}  # of these, any number


def _records() -> set[str]:
    """Names of all NamedTuples of these rooms with more than ``MOST`` fields."""
    found = set()
    for tree in _trees().values():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and "NamedTuple" in map(ast.unparse, node.bases):
                fields = [line for line in node.body if isinstance(line, ast.AnnAssign)]
                found |= {node.name} if len(fields) > MOST else set()
    return found - ORDERED


def _trees() -> dict[str, ast.Module]:
    root = Path(levelhead.__file__).parent
    paths = sorted(path for room in ROOMS for path in (root / room).rglob("*.py"))
    return {path.relative_to(root).as_posix(): ast.parse(path.read_text("utf-8")) for path in paths}


def _by_position(tree: ast.Module, records: set[str]) -> list[int]:
    """Lines that build a record from more than ``MOST`` positions, or take one of unknown kind apart so."""
    lines = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func) in records and len(node.args) > MOST:
            lines.append(node.lineno)
        elif isinstance(node, ast.Assign) and not isinstance(node.value, ast.Tuple | ast.List):
            for target in node.targets:
                names = [name.id for name in getattr(target, "elts", ()) if isinstance(name, ast.Name)]
                if len(names) > MOST and not all(map(ENTRY.fullmatch, names)):
                    lines.append(node.lineno)
    return lines


def test_no_record_goes_by_position():
    records = _records()
    found = {path: lines for path, tree in _trees().items() if (lines := _by_position(tree, records))}
    assert found == {}, "read by attribute and build by keyword"


def test_a_record_by_position_is_found():
    tree = ast.parse("state, health, guard, covariance = run\nOutput(q, b, s, 0)\nw, x, y, z = q\nOutput(quat=q)")
    assert _by_position(tree, {"Output"}) == [1, 2]
