"""C text laid out for people: lines that fit a screen, comments that do too."""

import functools
import textwrap
from collections.abc import Iterable, Iterator
from importlib import resources
from string import Template

WIDTH = 110
LONGEST = 120  # of a line that is a comment
STEP = "    "


@functools.cache
def template(name: str) -> Template:
    """One of the C files with gaps."""
    return Template(resources.files(__package__).joinpath("templates", name).read_text(encoding="utf-8"))


def safe(words: str) -> str:
    """Words that can stand inside a comment."""
    return words.replace("*/", "* /").replace("/*", "/ *")


RANKS = {",": 0, "?": 1, ":": 1, "||": 2, "&&": 2, "+": 3, "-": 3, "*": 4, "/": 4}


def _spots(code: str) -> Iterator[tuple[int, int, int]]:
    """(depth of brackets, rank, position) of every space at which a line may be broken: behind a comma, or before an
    operator.
    """
    depth = 0
    for i, letter in enumerate(code):
        depth += (letter in "([{") - (letter in ")]}")
        if letter == " ":
            after = code[i + 1 :].partition(" ")[0]
            rank = RANKS.get("," if code[i - 1] == "," else after)
            if rank is not None:
                yield depth, rank, i


def wrapped(code: str, indent: str) -> list[str]:
    """One statement as lines; broken where the fewest brackets are open, as late as possible."""
    lines, left = [], code
    room = WIDTH - len(indent)
    while len(left) > room:
        spots = [(depth, rank, -at) for depth, rank, at in _spots(left) if 24 < at <= room]
        if not spots:
            break
        at = -min(spots)[2]
        lines.append(left[:at].rstrip())
        left = left[at + 1 :]
        room = WIDTH - len(indent) - len(STEP)
    lines.append(left)
    return [indent + lines[0], *(indent + STEP + line for line in lines[1:])]


def comment(words: str, indent: str = "") -> list[str]:
    """Words as a comment of its own; what is laid out by hand stays so."""
    text = safe(words.strip())
    if "\n" not in text and len(text) + len(indent) <= LONGEST - 6:
        return [f"{indent}/* {text} */"]
    lines = []
    for i, line in enumerate(text.split("\n")):
        head = f"{indent}/* " if i == 0 else f"{indent} * "
        fits = len(head) + len(line) <= LONGEST + 6
        for j, piece in enumerate([line] if fits else textwrap.wrap(line, WIDTH - len(head))):
            lines.append(((head if j == 0 else f"{indent} * ") + piece).rstrip())
    return [*lines, f"{indent} */"]


def beside(code: Iterable[str], words: str) -> list[str]:
    """Lines of code with a comment behind the last, or above the first where there is no room."""
    lines = list(code)
    if not words:
        return lines
    if len(lines[-1]) + len(words) <= LONGEST - 6:
        return [*lines[:-1], f"{lines[-1]} /* {safe(words)} */"]
    indent = lines[0][: len(lines[0]) - len(lines[0].lstrip())]
    return [*comment(words, indent), *lines]


def docstring(text: str | None) -> str:
    """A docstring as words: no quoting of code."""
    return textwrap.dedent("    " + (text or "").strip()).strip().replace("``", "") if text else ""
