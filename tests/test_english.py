"""Plain English in pages, docstrings, comments and messages: a noun in place of a clause that begins with "what"."""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = [
    *sorted((ROOT / "docs").rglob("*.md")), *(ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md"))
]  # fmt: skip
CLAUSE = re.compile(r"\b([Ww]hat|[Ww]hoever|[Nn]obody)\b")
# names of fields, and questions
NAMES = re.compile(r"\bwhat:|``what``|symptom\.what|name, severity, what|[Ww]hat to do\b|[^.:|]*\?")


def clauses(text: str) -> list[str]:
    """The lines of a text that have such a clause, without names of fields and questions."""
    return [line.strip() for line in text.split("\n") if CLAUSE.search(NAMES.sub("", line))]


def words(path: Path) -> list[str]:
    """Comments, docstrings and texts of a module."""
    source = path.read_text(encoding="utf-8")
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    texts = [token.string for token in tokens if token.type == tokenize.COMMENT]
    constants = (node.value for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Constant))
    return texts + [value for value in constants if isinstance(value, str) and " " in value]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_page_has_a_clause_for_a_noun(path):
    assert clauses(path.read_text(encoding="utf-8")) == []


def test_no_docstring_comment_or_message_has_a_clause_for_a_noun():
    modules = sorted((ROOT / "src" / "levelhead").rglob("*.py"))
    found = {
        str(path.relative_to(ROOT)): wrong
        for path in modules
        if (wrong := [line for text in words(path) for line in clauses(text)])
    }
    assert len(modules) > 400 and found == {}
