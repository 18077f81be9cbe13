"""A function can be read at once: its complexity and its length are bounded, but for a short list with reasons.

Complexity is counted as radon does (`radon cc`): 1, and 1 for each if, loop, handler, case, comprehension, condition in
a comprehension, assertion, and further part of an `and` or `or`. A function in a function counts by itself.
"""

import ast
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "levelhead"
MAX_COMPLEXITY = 20
MAX_LINES = 60
COMMAND = "a verb of the command line: most lines are its options with their help"
COMPLEX = {  # path and function: the reason
    "cli/export.py:export": "a verb of the command line: a branch for each kind of export",
}
LONG = {
    "cli/calibrate.py:calibrate": COMMAND,
    "cli/compare.py:compare": COMMAND,
    "cli/export.py:export": COMMAND,
    "cli/run.py:run": COMMAND,
    "cli/stress.py:stress": COMMAND,
    "cli/tune.py:tune": COMMAND,
    "corpora/runner.py:corpus": COMMAND,
    "live/zenoh_reader.py:subscribe": "a closure for each kind of message",
}


Function = ast.FunctionDef | ast.AsyncFunctionDef


def complexity(node: ast.AST) -> int:
    """What radon adds for a node and all below it, functions in it left out."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        return 0
    own = 0
    if isinstance(node, ast.Assert):
        return 1
    if isinstance(node, ast.If | ast.IfExp):
        own = 1
    elif isinstance(node, ast.For | ast.While | ast.AsyncFor):
        own = 1 + bool(node.orelse)
    elif isinstance(node, ast.Try | ast.TryStar):
        own = len(node.handlers) + bool(node.orelse)
    elif isinstance(node, ast.BoolOp):
        own = len(node.values) - 1
    elif isinstance(node, ast.comprehension):
        own = 1 + len(node.ifs)
    elif isinstance(node, ast.Match):
        own = sum(not (isinstance(case.pattern, ast.MatchAs) and case.pattern.pattern is None) for case in node.cases)
    return own + sum(map(complexity, ast.iter_child_nodes(node)))


def largest(measure: Callable[[Function], int]) -> dict[str, int]:
    """By path and name; of functions with one name in one file the largest."""
    found: dict[str, int] = {}
    for name, node in functions():
        found[name] = max(found.get(name, 0), measure(node))
    return found


def functions() -> Iterator[tuple[str, Function]]:
    for path in sorted(SOURCE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield f"{path.relative_to(SOURCE)}:{node.name}", node


def test_no_function_has_too_many_branches():
    counts = largest(lambda node: 1 + sum(map(complexity, node.body)))
    assert {name: count for name, count in counts.items() if count > MAX_COMPLEXITY and name not in COMPLEX} == {}
    assert [name for name in COMPLEX if counts.get(name, 0) <= MAX_COMPLEXITY] == [], (
        "a reason that is no longer needed"
    )


def test_no_function_is_too_long():
    counts = largest(lambda node: (node.end_lineno or 0) - node.lineno + 1)
    assert {name: count for name, count in counts.items() if count > MAX_LINES and name not in LONG} == {}
    assert [name for name in LONG if counts.get(name, 0) <= MAX_LINES] == [], "a reason that is no longer needed"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("return a", 1),
        ("if a and b or c:\n  return 1\nelse:\n  return 2", 4),
        ("return [a for b in c if d if e]", 4),
        ("try:\n  pass\nexcept A:\n  pass\nexcept B:\n  pass\nelse:\n  pass", 4),
        ("for a in b:\n  while c:\n    pass\n  else:\n    pass", 4),
        ("assert a\ndef inner():\n  if a:\n    pass", 2),
        ("match a:\n  case 1:\n    pass\n  case _:\n    pass", 2),
    ],
)
def test_complexity_is_radons(text: str, expected: int):
    """The expected counts are those that radon 6.0.1 gives."""
    assert 1 + sum(map(complexity, ast.parse(text).body)) == expected
