"""Kernels read and build records by name: a field that is added in the middle must shift nothing.

Vectors, quaternions, matrices and flat covariances have an order of their own and are exempt. ``LEFT`` counts what is
still by position, room by room; it may only shrink.
"""

import ast
from pathlib import Path

import levelhead

ROOMS = ("engine", "filters", "guard", "kernels")
MOST = 3  # fields by position
ORDERED = {"Vec3", "Quat", "Mat2", "Mat3", "Cov", "Covariance", "Sums", "Euler"}  # of these, any number
LEFT = {
    "engine/aiding_inputs.py": 3,
    "engine/batch.py": 1,
    "engine/chunks.py": 1,
    "engine/driver.py": 1,
    "engine/lanes.py": 4,
    "engine/native.py": 2,
    "engine/serialization.py": 1,
    "engine/smooth_chunks.py": 1,
    "engine/smoother_kernels.py": 3,
    "engine/smoothing.py": 2,
    "engine/stepper.py": 1,
    "engine/stream.py": 3,
    "filters/complementary.py": 1,
    "filters/eskf/aiding.py": 1,
    "filters/eskf/calibration.py": 3,
    "filters/eskf/filter.py": 1,
    "filters/eskf/rts_aided.py": 3,
    "filters/eskf/state.py": 1,
    "filters/madgwick.py": 6,
    "filters/mahony.py": 1,
    "filters/mekf/covariance.py": 3,
    "guard/rest.py": 1,
}


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
                if len(names) > MOST and any(len(name) > 2 for name in names if name != "_"):
                    lines.append(node.lineno)
    return lines


def test_no_more_records_go_by_position():
    records = _records()
    found = {path: len(lines) for path, tree in _trees().items() if (lines := _by_position(tree, records))}
    assert found == LEFT, "read by attribute and build by keyword, or take the count down in LEFT"
