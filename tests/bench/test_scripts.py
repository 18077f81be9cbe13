"""The scripts in benchmarks/ import only names that exist; nothing runs them here, so a rename would be missed."""

import ast
import importlib
import importlib.util
from pathlib import Path

import pytest

SCRIPTS = {path.stem: path for path in sorted((Path(__file__).resolve().parents[2] / "benchmarks").glob("*.py"))}


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
        if node.module in SCRIPTS or node.module.partition(".")[0] == "levelhead"
    ]
    assert [f"{module}.{name}" for module, name in imports if not exists(module, name)] == []
