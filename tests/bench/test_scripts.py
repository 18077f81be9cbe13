"""The scripts in benchmarks/ import only names that exist; nothing runs them here, so a rename would be missed."""

import ast
import importlib
import importlib.util
import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in sorted((ROOT / "benchmarks").rglob("*.py"))
}


def defined_names(script):
    """Names that a script gives to anything."""
    nodes = list(ast.walk(ast.parse(SCRIPTS[script].read_text(encoding="utf-8"))))
    stored = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    return stored | {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)}


def exists(module, name):
    """Whether a module of the package or another script has that name."""
    if module in SCRIPTS:
        return name in defined_names(module)
    found = importlib.util.find_spec(module)
    if found is None:
        return False
    is_submodule = found.submodule_search_locations is not None and importlib.util.find_spec(f"{module}.{name}")
    return bool(is_submodule) or hasattr(importlib.import_module(module), name)


@pytest.mark.parametrize("script", SCRIPTS)
def test_what_a_script_imports_exists(script):
    imports = [
        (node.module, alias.name)
        for node in ast.walk(ast.parse(SCRIPTS[script].read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
        if node.module.partition(".")[0] in {"levelhead", "benchmarks", "tests"}
    ]
    assert [f"{module}.{name}" for module, name in imports if not exists(module, name)] == []


def takes_recordings(script):
    """Whether a script has an argument that is a path, and it is not a checkout."""
    words = SCRIPTS[script].read_text(encoding="utf-8")
    calls = [node for node in ast.walk(ast.parse(words)) if isinstance(node, ast.Call)]
    added = [call for call in calls if isinstance(call.func, ast.Attribute) and call.func.attr == "add_argument"]
    named = [
        call
        for call in added
        if any(word.arg == "type" and ast.unparse(word.value) == "Path" for word in call.keywords)
    ]
    places = [str(ast.literal_eval(call.args[0])) for call in named]
    return any(not place.startswith("-") and place != "earlier" for place in places)


TAKING = [script for script in SCRIPTS if takes_recordings(script)]


@pytest.fixture(scope="module")
def unusable(tmp_path_factory):
    """torn.npz, foreign.csv, a log without reference, and half of a reference."""
    folder = tmp_path_factory.mktemp("unusable")
    (folder / "torn.npz").write_bytes(b"PK\x03\x04" + bytes(range(200)))
    (folder / "foreign.csv").write_text("to whom it may concern\n", "utf-8")
    t = np.arange(500) / 100
    rows = np.column_stack([t, np.full((500, 2), 0.01), np.sin(t), np.zeros((500, 2)), np.full(500, 9.81)])
    np.savetxt(folder / "plain.csv", rows, "%.5f", ",", header="t,gx,gy,gz,ax,ay,az", comments="")
    np.savez(folder / "half.npz", t=t, gyr=rows[:, 1:4], acc=rows[:, 4:], q_ref_sensor=np.ones((500, 2)))
    return folder


UNUSABLE = ("none.csv", "torn.npz", "foreign.csv", "plain.csv", "half.npz")
# Any log is good for these.
WITHOUT_REFERENCE = ("benchmarks.accuracy.same_answer", "benchmarks.speed.page", "benchmarks.speed.wasm")
CASES = [
    (script, name)
    for script in TAKING
    for name in UNUSABLE
    if not (script in WITHOUT_REFERENCE and name in ("plain.csv", "half.npz"))
]


@pytest.mark.parametrize("script, name", CASES)
def test_what_cannot_be_used_is_one_sentence(script, name, unusable, monkeypatch, capsys):
    """As its users run it; each ended in a traceback."""
    monkeypatch.setattr(sys, "argv", [str(SCRIPTS[script]), str(unusable / name)])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(SCRIPTS[script]), run_name="__main__")
    said = capsys.readouterr().err
    assert ended.value.code == 2
    assert said.startswith(f"{SCRIPTS[script].name}: ") and said.count("\n") == 1 and name in said


def test_scripts_that_take_recordings_are_known():
    known = {"causes", "changed", "clock", "default", "iron", "single"}
    assert known < {script.rpartition(".")[2] for script in TAKING}


def test_every_script_stands_in_the_readme():
    page = ROOT / "benchmarks" / "README.md"
    links = re.findall(r"^\| \[\w+\]\(([^)]*)\)", page.read_text(encoding="utf-8"), re.MULTILINE)
    run = {path for path in SCRIPTS.values() if '__name__ == "__main__"' in path.read_text(encoding="utf-8")}
    assert sorted(links) == sorted(path.relative_to(page.parent).as_posix() for path in run)


def test_no_test_imports_a_script():
    """What tests and scripts share lives in tests/reference."""
    pattern = re.compile(r"^\s*(from|import) benchmarks\b", re.MULTILINE)
    paths = (ROOT / "tests").rglob("*.py")
    assert [path.name for path in paths if pattern.search(path.read_text(encoding="utf-8"))] == []
