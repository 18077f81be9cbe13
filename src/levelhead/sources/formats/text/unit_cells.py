"""Cells that hold a number and its unit, "0.02 g": the unit belongs to the name of the column."""

import re
from collections.abc import Sequence

from levelhead import units
from levelhead.sources.formats.text.labelled import looks_labelled

_CELL = r"\s*\"?[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?\s*[a-zA-Zµ°][\w/^²°.]*\"?\s*"
MEASURED = re.compile(rf"(?:[,;\t]|^){_CELL}[,;\t]{_CELL}[,;\t]{_CELL}(?:[,;\t]|$)")
_PARTS = re.compile(r"\s*\"?([-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)\s*([a-zA-Zµ°][\w/^²°.]*)\"?\s*$")


def without_units(lines: Sequence[str]) -> str | None:
    """The table with plain numbers and a unit in the name of each column; None: what follows the numbers is no unit."""
    first = next(i for i, line in enumerate(lines) if MEASURED.search(line))
    sign = max("\t;,", key=lines[first].count)
    cells = lines[first].split(sign)
    found = [parts[2] if (parts := _PARTS.match(cell)) else "" for cell in cells]
    known = [unit for unit in found if any(units.find_factor(quantity, unit) is not None for quantity in units.FACTORS)]
    if first == 0 or len(known) < 6 or looks_labelled(lines[:40]):
        return None
    titles = [title.strip() for title in lines[first - 1].split(sign)]
    if len(titles) != len(found):
        return None
    head = sign.join(f"{title} [{unit}]" if unit else title for title, unit in zip(titles, found, strict=True))
    body = [sign.join(_PARTS.sub(r"\1", cell) for cell in line.split(sign)) for line in lines[first:]]
    return "\n".join([head, *body])
