"""Names in the type of code on the pages exist in the source, and tables are whole."""

import ast
import re
from collections import defaultdict
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

import levelhead
from levelhead import filters
from levelhead.filters.parameters import derived_table
from levelhead.guard import Guard

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "levelhead"
PAGES = [
    ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", ROOT / "benchmarks" / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]  # fmt: skip
DOTTED = re.compile(r"`((?:[A-Za-z_]\w*\.)+[A-Za-z_]\w*)(?:\([^`]*\))?`")
CALLED = re.compile(r"`([A-Za-z_]\w*)\([^`]*\)`")
SNAKE = re.compile(r"`([a-z][a-z0-9]*(?:_[a-z0-9]+)+)(?:\([^`]*\))?`")
FENCE = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
FILE = re.compile(r".*\.(py|md|c|h|csv|txt|json|yaml|toml|npz|mat|properties|parquet|png|x|ulg)")
# Objects in examples that are called as a module is.
INSTANCES = {"board", "filter", "hooks", "joint", "kalman", "live", "node", "subscription", "track"}
SUFFIXES = {".py", ".c", ".h", ".ino"}
SENSORS = {"gyr", "acc", "mag"}
SEPARATOR = re.compile(r"\|(?: ?:?-+:? ?\|)+")


def prose(page: Path) -> str:
    """A page without its blocks of code."""
    return FENCE.sub("", page.read_text(encoding="utf-8"))


@cache
def trees() -> dict[Path, ast.Module]:
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in SOURCE.rglob("*.py")}


def defined(body: list[ast.stmt]) -> set[str]:
    """What the statements of a module or a class give a name to, in its functions' ``self`` too."""
    found: set[str] = set()
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        if isinstance(node, ast.Import | ast.ImportFrom):
            found |= {alias.asname or alias.name for alias in node.names}
        for inner in ast.walk(node):
            if isinstance(inner, ast.Name) and isinstance(inner.ctx, ast.Store):
                found.add(inner.id)
            if isinstance(inner, ast.Attribute) and isinstance(inner.ctx, ast.Store):
                found.add(inner.attr)
    return found


@cache
def members() -> dict[str, set[str]]:
    """Name of a module, a package or a class -> what it has; of several with one name all of theirs."""
    found: dict[str, set[str]] = defaultdict(set)
    bases: dict[str, set[str]] = defaultdict(set)
    for path, tree in trees().items():
        name = path.parent.name if path.stem == "__init__" else path.stem
        found[name] |= defined(tree.body)
        found[path.parent.name].add(path.stem)
        found[path.parent.parent.name].add(path.parent.name)
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                found[node.name] |= defined(node.body)
                bases[node.name] |= {base.id for base in node.bases if isinstance(base, ast.Name)}
    for name, parents in bases.items():
        for parent in parents:
            found[name] |= found.get(parent, set())
    for flt in filters.ALL:
        found[flt.params.__name__] |= set(derived_table(flt.params))
    found["levelhead"] |= set(levelhead.__all__)
    return dict(found)


@cache
def words() -> set[str]:
    """Every word in the code of the repository but this file."""
    folders = ("src", "tests", "benchmarks", "examples")
    paths = [path for folder in folders for path in (ROOT / folder).rglob("*") if path.suffix in SUFFIXES]
    return {
        word
        for path in paths
        if path != Path(__file__)
        for word in re.findall(r"\w+", path.read_text(encoding="utf-8"))
    }


def is_word(name: str, shown: str) -> bool:
    """Whether the code has a name, makes it of parts, exports it to C, or the page shows it in an example."""
    stem, _, last = name.rpartition("_")
    module, _, function = name.partition("_")
    exported = name.startswith("lh_") or function in members().get(module, ())
    made = last in SENSORS and f"{stem}_" in words()
    return name in words() or made or exported or re.search(rf"\b{name}\b", shown) is not None


def unknown_names(text: str, shown: str = "") -> list[str]:
    """Dotted names, calls and names with an underscore that are not those of the source.

    ``shown``: the code blocks of the page.
    """
    known, unknown = members(), []
    for name in DOTTED.findall(text):
        parts = name.removeprefix("levelhead.").removeprefix("lh.").split(".")
        if name.startswith("lh."):
            parts = ["levelhead", *parts]
        if FILE.fullmatch(name) or parts[0] in INSTANCES or parts[0] not in known:
            continue
        for owner, part in pairwise(parts):
            if owner not in INSTANCES and part not in known.get(owner, {part}):
                unknown.append(name)
    unknown += [name for name in CALLED.findall(text) if not is_word(name, shown)]
    return unknown + [name for name in SNAKE.findall(text) if not is_word(name, shown)]


def broken_tables(text: str) -> list[str]:
    """Lines at which a table ends before it is whole."""
    broken, before = [], ["", ""]
    for line in [*text.splitlines(), ""]:
        if line.startswith("|"):
            cells = len(re.findall(r"(?<!\\)\|", line))
            first = not before[-1].startswith("|")
            second = not first and not before[-2].startswith("|")
            uneven = not first and cells != len(re.findall(r"(?<!\\)\|", before[-1]))
            if not line.endswith("|") or uneven or (second and not SEPARATOR.fullmatch(line)):
                broken.append(line)
        elif before[-1].startswith("|") and not before[-2].startswith("|"):
            broken.append(before[-1])  # a row by itself
        before.append(line)
    return broken


@pytest.mark.parametrize(  # pages of coming-from name what other packages have
    "page", [page for page in PAGES if page.parent.name != "coming-from"], ids=lambda page: page.name
)
def test_names_on_a_page_exist(page: Path) -> None:
    code = "".join(FENCE.findall(page.read_text(encoding="utf-8")))
    assert unknown_names(prose(page), code) == []


def test_every_parameter_of_vqf_has_its_counterpart() -> None:
    text = (ROOT / "docs" / "coming-from" / "vqf.md").read_text(encoding="utf-8")
    for name in pytest.importorskip("vqf").VQF(0.01).params:
        assert f"`{name}`" in text, name
    known = {flt.params.__name__: {*flt.params._fields, *derived_table(flt.params)} for flt in filters.ALL}
    known["Guard"] = set(Guard._fields)
    for owner, name in re.findall(r"\b(\w+)\((\w+)=", text):
        assert name in known.get(owner, {name}), f"{owner}({name}=)"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_tables_are_whole(page: Path) -> None:
    assert broken_tables(prose(page)) == []


def test_unknown_names_and_broken_tables_are_found() -> None:
    assert unknown_names("`compile.not_there`, `Track.eulers()`, `lh.fusion`, `no_such_name`, `nonesuch(x)`") == [
        "compile.not_there", "Track.eulers", "lh.fusion", "nonesuch", "no_such_name",
    ]  # fmt: skip
    assert unknown_names("`Track.euler()`, `lh.fuse`, `np.no_such`, `bias_limit`, `numba.njit`, `hooks.step`") == []
    whole = "| a | b |\n|---|--:|\n| c \\| d | e |\n"
    assert broken_tables(whole) == []
    assert broken_tables(whole + "| f | g\nh |\n") == ["| f | g"]
    assert broken_tables(whole + "\n| f | g |\n| h | i |\n") == ["| h | i |"]
    assert broken_tables(whole + "| f |\n") == ["| f |"]
