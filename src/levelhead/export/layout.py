"""C text laid out for people: lines that fit a screen, comments that do too."""

import functools
import sys
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


def escape(words: str) -> str:
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


def wrap_line(code: str, indent: str) -> list[str]:
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
    """Words as a comment of its own; a layout by hand stays."""
    text = escape(words.strip())
    if "\n" not in text and len(text) + len(indent) <= LONGEST - 6:
        return [f"{indent}/* {text} */"]
    lines = []
    for i, line in enumerate(text.split("\n")):
        head = f"{indent}/* " if i == 0 else f"{indent} * "
        fits = len(head) + len(line) <= LONGEST + 6
        for j, piece in enumerate([line] if fits else textwrap.wrap(line, WIDTH - len(head))):
            lines.append(((head if j == 0 else f"{indent} * ") + piece).rstrip())
    return [*lines, f"{indent} */"]


def add_comment(code: Iterable[str], words: str) -> list[str]:
    """Lines of code with a comment behind the last, or above the first where there is no room."""
    lines = list(code)
    if not words:
        return lines
    if len(lines[-1]) + len(words) <= LONGEST - 6:
        return [*lines[:-1], f"{lines[-1]} /* {escape(words)} */"]
    indent = lines[0][: len(lines[0]) - len(lines[0].lstrip())]
    return [*comment(words, indent), *lines]


def docstring(text: str | None) -> str:
    """A docstring as words: no quoting of code."""
    return textwrap.dedent("    " + (text or "").strip()).strip().replace("``", "") if text else ""


def join_lines(lines: Iterable[str]) -> str:
    """Lines as text."""
    return "\n".join(lines) + "\n"


def wrap_text(text: str) -> str:
    """Code whose long lines are broken."""
    lines: list[str] = []
    for line in text.split("\n"):
        code = line.lstrip()
        fits = len(line) <= LONGEST or code.startswith(("/*", "*", "//"))
        lines += [line] if fits else wrap_line(code, line[: len(line) - len(code)])
    return "\n".join(lines)


def module_words(module: str) -> str:
    """A module's docstring."""
    return docstring(sys.modules[module].__doc__) if module in sys.modules and module.startswith("levelhead") else ""


def snake(name: str) -> str:
    """RollPitchKalman -> roll_pitch_kalman, EKF -> ekf.

    >>> snake("BiasRateKalman"), snake("EKF")
    ('bias_rate_kalman', 'ekf')
    """
    words = ""
    for i, letter in enumerate(name):
        begins = letter.isupper() and i > 0 and (name[i - 1].islower() or name[i + 1 : i + 2].islower())
        words += ("_" if begins else "") + letter.lower()
    return words
