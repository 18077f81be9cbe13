"""The examples in CONTRIBUTING.md pass linter, type checker and docs generator with the settings of the project."""

import importlib.util
import re
import runpy
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

from levelhead import filters
from levelhead.version import VERSION

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "CONTRIBUTING.md"


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The filter and the format as files, where the project's rules for ``src`` hold."""
    folder = tmp_path_factory.mktemp("examples") / "src"
    folder.mkdir()
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    found = {}
    for name, mark in (("my_filter", "FILTER = "), ("my_format", "def tables(")):
        found[name] = folder / f"{name}.py"
        found[name].write_text(next(block for block in blocks if mark in block), encoding="utf-8")
    return found


def run(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", *map(str, words)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_the_linter_has_nothing_to_say(examples: dict[str, Path]) -> None:
    for words in (("check",), ("format", "--check")):
        done = run("ruff", *words, "--no-cache", "--config", ROOT / "pyproject.toml", *examples.values())
        assert done.returncode == 0, done.stdout + done.stderr
    broken = examples["my_filter"].with_name("broken.py")
    broken.write_text(examples["my_filter"].read_text(encoding="utf-8").replace('"""', "#"), encoding="utf-8")
    done = run("ruff", "check", "--no-cache", "--config", ROOT / "pyproject.toml", broken)
    assert done.returncode == 1 and "D100" in done.stdout


@pytest.mark.slow
def test_the_types_are_right(examples: dict[str, Path]) -> None:
    done = run("mypy", "--config-file", ROOT / "pyproject.toml", *examples.values())
    assert done.returncode == 0, done.stdout + done.stderr


def load(path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, path.stem, module)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("doc", [None, "Does without a title.", ""])
def test_the_generator_writes_the_page(
    examples: dict[str, Path], monkeypatch: pytest.MonkeyPatch, doc: str | None
) -> None:
    """With any docstring: one without "Title: words" ended in an IndexError."""
    module = load(examples["my_filter"], monkeypatch)
    if doc is not None:
        module.__doc__ = doc
    monkeypatch.setattr(filters, "ALL", (*filters.ALL, module.FILTER))
    made = runpy.run_path(str(ROOT / "docs" / "generate.py"))
    page = made["BLOCKS"]["filter Leaky"]()
    assert page.startswith("# Leaky\n\n") and "| `tau` | s | 1 |" in page
    assert "[`Leaky`](filters/Leaky.md)" in made["BLOCKS"]["filters"]()
    assert ("An example of a filter." if doc is None else doc) in page


def test_the_version_stands_in_one_place():
    """CITATION.cff repeats it; the package's metadata read it from ``version.py``."""
    cited = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert cited and cited[1] == VERSION and "version" in project["dynamic"]
