"""JSON lines, one object for each sample: what a microcontroller says on a serial line, kept in a file."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.sources.conclusion import Basis, Conclusion
from levelhead.sources.devices.line_parser import LONGEST, Garbage, flatten_json
from levelhead.sources.formats.text.cells import is_comment, lines_of
from levelhead.sources.table import ArrayTable


@dataclass(frozen=True)
class JsonTable(ArrayTable):
    """Columns of JSON lines; ``lines`` are the numbers of those that they came from."""

    lines: Sequence[int] = ()

    def where(self, row: int) -> str:
        """See ``Table``."""
        return f"line {self.lines[row]}"


def looks_like_json(path: Path) -> bool:
    """Whether a file holds JSON lines, the first of which may be cut."""
    with open(path, "rb") as file:
        head = file.read(LONGEST).removeprefix(b"\xef\xbb\xbf")
    return any(line.lstrip().startswith(b"{") for line in head.split(b"\n")[:2])


def json_lines(path: Path) -> JsonTable:
    """The numbers of JSON lines by name, NaN where a line does not have one, by the rules for serial lines.

    The first and the last line may be cut, because whoever kept them came late and was stopped; that is noted.

    Raises:
        LevelheadError: a line between them is no JSON object of numbers, or there is none at all.
    """
    source = str(path)
    given = [
        (number, line)
        for number, line in enumerate(
            lines_of(path.read_bytes().removeprefix(b"\xef\xbb\xbf").decode("utf-8", "replace")), 1
        )
        if line.strip() and not is_comment(line)
    ]
    rows, lines, conclusions = [], [], []
    for i, (number, line) in enumerate(given):
        try:
            rows.append(flatten_json(line))
            lines.append(number)
        except Garbage:
            if 0 < i < len(given) - 1:
                shown = line.strip()[:30]
                raise LevelheadError(
                    f"{source}, line {number}: '{shown}' is no JSON object of numbers; expected such as "
                    '{"t": 0.01, "gyr": [0, 0, 0], "acc": [0, 0, 9.81]}'
                ) from None
            conclusions.append(Conclusion("file.lines", "cut_off", number, Basis.NUMBERS))
    if not rows:
        raise LevelheadError(f"{source} holds no JSON objects; expected one line per sample")
    names = list(dict.fromkeys(name for row in rows for name in row))
    arrays = {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}
    return JsonTable(source, arrays, conclusions=conclusions, lines=lines)
