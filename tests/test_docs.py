"""The pages tell the truth: their Python blocks run, print what they show, and their tables are those of the source."""

import ast
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from levelhead import cli, filters
from levelhead.engine import native
from levelhead.filters import Filter
from levelhead.guard import Guard

ROOT = Path(__file__).resolve().parents[1]
DOCS = sorted(path for path in (ROOT / "docs").rglob("*.md") if "gallery" not in path.parts)
PAGES = [ROOT / "README.md", *DOCS]
BLOCK = re.compile(r"^```(python|sh run)\n(.*?)^```\n(?:\s*^```text\n(.*?)^```$)?", re.DOTALL | re.MULTILINE)
ALL_PAGES = [*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
LINK = re.compile(r"\]\((?!https?://)([^)#\s]+)[^)]*\)")
ANCHOR = re.compile(r"\]\((?!https?://)([^)#\s]*)#([^)\s]+)\)")
NAMED_FILE = re.compile(r"`([\w./-]+\.(?:py|toml|md|c|h))`")
OUTPUT = re.compile(r"(.*/)?(my_\w+|lh_\w+|DIR/.*)\.\w+")  # a file that a page's reader, or a command, writes
TREE = [path for folder in ("src", "tests", "docs", "benchmarks", "examples") for path in (ROOT / folder).rglob("*.*")]
TREE += list(ROOT.glob("*.*"))
EQUATION = re.compile(r"^\S.* \((\w+)\)$", re.MULTILINE)  # a line of a page that ends in its number
NAMED_EQUATION = re.compile(r"\beqs?\. (\d+(?:(?:, | and | to )\d+)*)|(?<![\w.])\(([1-9]\d*[a-z]?)\)", re.IGNORECASE)
STATED = re.compile(r"`(\w+)` (-?\d+(?:\.\d+)?(?:e-?\d+)?)\b(?! /)")
DEFAULTS: dict[str, set[float]] = {}  # parameter -> its defaults, of the guard and of all filters that have it
for params in (Guard, *(flt.params for flt in filters.ALL)):
    for parameter, default in params._field_defaults.items():
        DEFAULTS.setdefault(parameter, set()).add(float(default))


@pytest.mark.compiled
@pytest.mark.parametrize(
    "page", [page for page in PAGES if BLOCK.search(page.read_text(encoding="utf-8"))], ids=lambda page: page.name
)
def test_the_code_on_a_page_runs(page, tmp_path, monkeypatch, capsys):
    """All ```python blocks of a page in one namespace, and the commands of ```sh run between them, in an empty folder.

    A ```text block right below one is what it prints.
    """
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    if any('"native"' in block[2] for block in BLOCK.finditer(text)) and not native.up_to_date():
        pytest.skip("the native engine is missing or older than the sources: make native")
    namespace = {"__name__": "__main__"}
    for block in BLOCK.finditer(text):
        if block[1] == "python":
            above = "\n" * (text.count("\n", 0, block.start()) + 1)  # so that a traceback names the line of the page
            exec(compile(above + block[2], str(page), "exec"), namespace)
        else:
            for line in block[2].splitlines():
                assert cli.main(shlex.split(line, comments=True)[1:]) == 0, line
        printed = capsys.readouterr().out
        if block[3] is not None:
            assert printed == block[3]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub makes them."""
    found: set[str] = set()
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE):
        plain = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).lower()
        slug = "".join(c for c in plain if c.isalnum() or c in " -_").replace(" ", "-")
        found.add(next(name for i in range(99) if (name := slug if i == 0 else f"{slug}-{i}") not in found))
    return found


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_anchors_are_headings(page):
    for target, anchor in ANCHOR.findall(page.read_text(encoding="utf-8")):
        other = page.parent / target if target else page
        assert other.suffix != ".md" or anchor in anchors(other), f"{target}#{anchor}"


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_named_files_exist(page):
    """A path in the type of code is one from the root, from src/levelhead, or the end of one of theirs."""
    for name in NAMED_FILE.findall(page.read_text(encoding="utf-8")):
        ends = any(path.as_posix().endswith(f"/{name}") for path in TREE)
        assert ends or OUTPUT.fullmatch(name), name


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_nothing_is_left_to_be_written(page):
    assert not re.search(r"to be filled in|\bTODO\b|\bFIXME\b|\bTBD\b|\bXXX\b", page.read_text(encoding="utf-8"), re.I)


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.name)
def test_stated_defaults_are_those_of_the_code(page):
    """ "`bias_limit` 15 °/s" on a page names the default of a parameter; other values are written "`name=value`"."""
    for name, value in STATED.findall(page.read_text(encoding="utf-8")):
        if name in DEFAULTS:
            assert float(value) in DEFAULTS[name], f"`{name}` {value}; the code has {DEFAULTS[name]}"


def test_the_rooms_of_the_table_are_those_of_the_tree():
    text = (ROOT / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
    rows = text.partition("| room | ")[2].partition("\n\n")[0].splitlines()[2:]
    told = [room for row in rows for room in re.findall(r"`(\w+)`", row.split("|")[1])]
    tree = {
        path.stem
        for path in (ROOT / "src" / "levelhead").iterdir()
        if path.suffix == ".py" or (path / "__init__.py").exists()
    }
    assert sorted(told) == sorted(tree - {"__init__", "__main__"})


def test_the_table_of_a_filter_has_every_field():
    text = (ROOT / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
    rows = text.partition("| field | content |")[2].partition("\n\n")[0].splitlines()[2:]
    told = [name for row in rows for name in re.findall(r"`(\w+)`", row.split("|")[1])]
    assert sorted(told) == sorted(Filter._fields)


def cited(text: str) -> set[int]:
    """The equations that a text names: eq. 7, eqs. 8 to 12, (16), (22) to (24)."""
    found: set[int] = set()
    for first, last in re.findall(r"\(?\b(\d+)\)? to \(?(\d+)\)?", text):
        found |= set(range(int(first), int(last) + 1))
    for several, one in NAMED_EQUATION.findall(text):
        found |= {int(number) for number in re.findall(r"\d+", several + one)}
    return found


def test_every_equation_of_eskf_stands_in_the_file_that_its_map_names():
    folder = ROOT / "src" / "levelhead" / "filters" / "eskf"
    rows = re.findall(r"^\| ``(\w+)`` \| (.+) \|$", (folder / "__init__.py").read_text(encoding="utf-8"), re.MULTILINE)
    assert {name for name, _ in rows} == {path.stem for path in folder.glob("*.py")} - {"__init__"}
    for name, what in rows:
        lacking = cited(what) - cited((folder / f"{name}.py").read_text(encoding="utf-8"))
        assert not lacking, f"{name}: equations {sorted(lacking)}"


def test_the_equations_of_eskf_have_the_numbers_of_its_page():
    """The page counts them from 1; its own text, and the docstrings of the files, name no other."""
    text = (ROOT / "docs" / "explanation" / "self-calibration.md").read_text(encoding="utf-8")
    numbers = EQUATION.findall(text)
    assert numbers == [str(1 + i) for i in range(len(numbers))]
    texts = {"self-calibration.md": text}
    for path in sorted((ROOT / "src" / "levelhead" / "filters" / "eskf").glob("*.py")):
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        kinds = ast.Module | ast.ClassDef | ast.FunctionDef
        texts[path.name] = " ".join(ast.get_docstring(node) or "" for node in nodes if isinstance(node, kinds))
    for name, told in texts.items():
        for several, one in NAMED_EQUATION.findall(told):
            for number in re.findall(r"\w+", several.replace("and", "").replace("to", "") + one):
                assert number in numbers, f"{name}: equation {number}"


@pytest.mark.slow
def test_generated_tables_are_up_to_date():
    command = [sys.executable, "docs/generate.py", "--check"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_pictures_are_small():
    for picture in (ROOT / "docs" / "pictures").glob("*.png"):
        assert picture.stat().st_size < 300_000, picture.name


@pytest.mark.parametrize("page", DOCS, ids=lambda page: page.name)
def test_a_page_is_in_the_contents(page):
    """A page of the site stands in the toctree of its folder's index, or of docs/index.md."""
    listed = [
        (index.parent / name.strip()).with_suffix(".md").resolve()
        for index in (ROOT / "docs").rglob("index.md")
        for block in re.findall(r"^```\{toctree\}\n(.*?)^```", index.read_text(encoding="utf-8"), re.DOTALL | re.M)
        for name in block.splitlines()
        if name.strip() and not name.startswith(":")
    ]
    globbed = page.parent.name == "filters"
    assert globbed or page == ROOT / "docs" / "index.md" or page in listed, f"add {page.stem} to {page.parent}/index.md"
