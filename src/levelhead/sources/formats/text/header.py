"""The lines above the numbers: preamble, one or more header rows, a row of units."""

import math
import re
from collections.abc import Sequence
from itertools import pairwise

from levelhead import units
from levelhead.open_types import ReadOnlyJson
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.text.cells import cells, is_number, trim
from levelhead.sources.names.column_name import understand

_RATE = re.compile(
    r"(?:sampl\w*|update|output|data|logging|odr|imu)[ _-]*(?:rate|freq\w*)?\W{0,12}?(\d+(?:\.\d+)?)\s*hz"
    r"|(?:sampl\w*|update|output|data|logging)[ _-]*(?:rate|freq\w*)[^\d\n]{0,16}?(\d+(?:\.\d+)?)"
    r"|(?:^|\W)(?:rate|fs)\s*[:=]\s*(\d+(?:\.\d+)?)",
    re.IGNORECASE,
)
_DEVICES = re.compile(r"^Devices,*\n(\d+(?:\.\d+)?),*$", re.MULTILINE)  # Vicon Nexus: the rate below
_PERIOD = re.compile(r"(?:rate|period|interval)\W{0,12}?\d+(?:\.\d+)?\s*(?:ms|us|milli|micro)", re.IGNORECASE)
_PRINTF = re.compile(r"%[\w.]+\(([^)]*)\)")
_FEW_ROWS = 5  # lines below a header by which its names are judged
_SAME = 0.7  # share of equal cells from which a line of a header distinguishes little
_NO_UNIT = {"no units", "no unit", "unitless", "none", "n/a", "-", ""}
_RELATIVE = {"local", "local_flux", "a.u.", "au", "normalized", "normalised", "arbitrary"}


def rate_in(preamble: Sequence[str]) -> float | None:
    """The sample rate in Hz that lines such as "// Update Rate: 100.0Hz" give; None if they give none or several."""
    found = {float(rate) for rate in _DEVICES.findall("\n".join(preamble))}
    for line in preamble:
        if _PERIOD.search(line):  # a period, not a rate
            continue
        for groups in _RATE.findall(line):
            value = float(next((text for text in groups if text), "0"))
            if 0.5 <= value <= 100_000.0:
                found.add(value)
    return found.pop() if len(found) == 1 else None


def header_cells(line: str, delimiter: str, width: int) -> list[str] | None:
    """The cells of a header line that has ``width`` of them, by the delimiter of the numbers or another; else None."""
    text = line.strip().lstrip("#%/ ")
    if len(named := _PRINTF.findall(text)) == width:
        return named
    options = [delimiter, *(one for one in ("\t", ",", ";", "|", ":", "  ", " ") if one != delimiter)]
    for option in options:
        row = _words(text, option)
        for cut in (row, _after_colon(row)):
            if len(cut) == width:
                return cut
    return None


def _words(text: str, delimiter: str) -> list[str]:
    if delimiter == "  ":
        row = [cell for cell in re.split(r"\s{2,}", text.strip()) if cell]
    elif delimiter == " ":
        row = re.sub(r"\s+(?=[\[(])", "\0", text).split()
        row = [cell.replace("\0", " ") for cell in row]
    else:
        row = [cell.strip() for cell in trim(cells(text, delimiter))]
    return [cell.strip().strip("\"'").rstrip(":").strip() for cell in row]


def _after_colon(row: Sequence[str]) -> list[str]:
    """The row with "Data format:" taken off its first cell."""
    head, colon, rest = row[0].partition(":") if row else ("", "", "")
    return [rest.strip().strip("\"'"), *row[1:]] if colon and rest and " " in head else []


def looks_like_header(row: Sequence[str] | None, width: int, comma: bool) -> bool:
    """Whether a row has words and no numbers."""
    if row is None or not row:
        return False
    filled = [cell for cell in row if cell.strip()]
    words = sum(any(sign.isalpha() for sign in cell) for cell in filled)
    numbers = sum(is_number(cell, comma) for cell in filled) - 2 * len(_counted_axes(row))
    return words > 0 and numbers <= 0.2 * len(filled) and (width < 3 or len(filled) >= 2)


def _counted_axes(row: Sequence[str]) -> list[int]:
    """Where a name has "1" and "2" behind it, as its second and third axis: gopro-telemetry's tables."""
    return [
        i for i in range(len(row) - 2)
        if row[i + 1 : i + 3] == ["1", "2"] and any(sign.isalpha() for sign in row[i])
    ]  # fmt: skip


def _merged_axes(rows: Sequence[Sequence[str]], names: Sequence[str]) -> list[int]:
    """Where one sensor's name stands over three columns, as merged cells of a spreadsheet become."""
    apart = [i for i, cell in enumerate(rows[-1]) if cell]
    ends = [*apart[1:], len(rows[-1])] if len(rows) == 1 else []
    return [
        i for i, end in zip(apart, ends, strict=False)
        if end == i + 3 and not understand(names[i]).axis and understand(f"{names[i]} x").role in ("gyr", "acc", "mag")
    ]  # fmt: skip


def join_names(header: Sequence[Sequence[str]], width: int) -> list[str]:
    """One name per column.

    Of several header lines, a group's name spreads over the blank cells behind it, a line that is the same for all
    columns is left out, and a line of units becomes the bracket at the end of the name.
    """
    rows = [[cell.strip() for cell in row] + [""] * (width - len(row)) for row in header]
    unit_row = rows.pop() if len(rows) > 1 and _is_unit_row(rows[-1]) else []
    if len(rows) > 1:
        rows = [row for row in rows if len(set(row)) > 1] or rows[-1:]
    for row in [row for row in rows if _says_little(row)]:
        rest = [other for other in rows if other is not row]
        if rest and _sensors_apart(rest):
            rows = rest
    width = max(map(len, rows))
    names = _add_groups(rows, width)
    names = [name + _unit_bracket(unit_row[i]) if i < len(unit_row) else name for i, name in enumerate(names)]
    for i in [*_counted_axes(names), *_merged_axes(rows, names)]:
        names[i : i + 3] = [f"{names[i]} {axis}" for axis in "xyz"]
    return names


def _add_groups(rows: Sequence[Sequence[str]], width: int) -> list[str]:
    """The cells above each column together; those of all lines but the last spread to the right over blank cells.

    A group does not spread over columns in which every cell is blank.
    """
    parts: list[list[str]] = [[] for _ in range(width)]
    for depth, row in enumerate(rows):
        group = ""
        for i, cell in enumerate(row):
            group = cell or (group if depth < len(rows) - 1 else "")
            if group:
                parts[i].append(group)
    blank = [len(rows) > 1 and not any(i < len(row) and row[i] for row in rows) for i in range(width)]
    return ["" if blank[i] else " ".join(part) for i, part in enumerate(parts)]


def _unit_bracket(cell: str) -> str:
    """A cell in a line of units as the end of a name; "" if it declares none."""
    unit = cell.strip("[] ").replace("(", "").replace(")", "")
    if unit.lower() in _NO_UNIT:
        return ""
    return f" [{'relative' if unit.lower() in _RELATIVE else unit}]"


def _says_little(row: Sequence[str]) -> bool:
    """Whether nearly all cells of a header line are the same word, as in Visual3D's ANALOG and ORIGINAL."""
    filled = [cell for cell in row if cell]
    return len(filled) > 3 and max(filled.count(cell) for cell in set(filled)) > _SAME * len(filled)


def _sensors_apart(rows: Sequence[Sequence[str]]) -> bool:
    """Whether these header lines alone distinguish all columns of sensors."""
    names = [" ".join(cell for cell in column if cell) for column in zip(*rows, strict=True)]
    sensors = [name for name in names if understand(name).role in {"gyr", "acc", "mag"} and understand(name).axis]
    return len(sensors) > 5 and len(set(sensors)) == len(sensors)


def fit_names(names: Sequence[str], given: int, rows: Sequence[Sequence[str]]) -> tuple[list[str], Conclusion | None]:
    """(names, conclusion) for ``rows`` of which each has one cell more, or one less, than the ``given`` names.

    One name less: the first column holds the number or the name of a row, as R writes it, or the last one has no name.
    One name more: the first is a time that is not there, or the last column is missing.
    """
    width = len(rows[0]) if rows else 0
    if len(rows) < _FEW_ROWS or not any(row[-1].strip() for row in rows):
        return list(names), None
    if given < width - 1:
        more = width - given
        facts: ReadOnlyJson = {"names": given, "cells": width, "unnamed": more}
        return [*names[:given], *[""] * more], Conclusion("file.header", "rest_unnamed", more, Basis.GUESS, facts)
    return _fit_one(names, given, rows) if abs(given - width) == 1 else (list(names), None)


def _fit_one(names: Sequence[str], given: int, rows: Sequence[Sequence[str]]) -> tuple[list[str], Conclusion | None]:
    """``fit_names`` for one cell more or less."""
    width, first = len(rows[0]), [row[0].strip() for row in rows if row]
    column = [float(cell) if is_number(cell, False) else math.nan for cell in first]
    forward = all(after > before for before, after in pairwise(column))
    facts = {"names": given, "cells": width}
    if given < width:
        counts = len({after - before for before, after in pairwise(column)} | {1.0}) == 1 or len(set(first)) == 1
        if not (counts or all(map(math.isnan, column))):
            return [*names[:given], ""], None
        return ["", *names[:given]], Conclusion("file.header", "first_unnamed", 1, Basis.NUMBERS, facts)
    if understand(names[0]).role == "t" and not forward:
        return list(names[1:]), Conclusion("file.header", "time_absent", names[0], Basis.GUESS, facts)
    return list(names[:width]), Conclusion("file.header", "last_absent", names[-1], Basis.NUMBERS, facts)


def number_twins(names: Sequence[str]) -> list[str]:
    """The names, with " (2)" behind those of a second set of sensors that are called as those of the first.

    A single name that comes again, without its axes, stays: it may be either of the two.
    """
    known = [understand(name) for name in names]
    made = list(names)
    for role in ("gyr", "acc", "mag"):
        mine = [i for i, name in enumerate(known) if name.role == role and name.axis]
        counts = {names[i]: [names[k] for k in mine].count(names[i]) for i in mine}
        if len(counts) < 3 or len(set(counts.values())) > 1:
            continue
        for k, i in enumerate(mine):
            before = [names[one] for one in mine[:k]].count(names[i])
            made[i] += f" ({before + 1})" if before else ""
    return made


def _is_unit_row(row: Sequence[str]) -> bool:
    """Whether most cells are units, or declare none."""
    filled = [cell.strip("[] ") for cell in row if cell.strip()]
    known = sum(
        plain.lower() in _NO_UNIT | _RELATIVE
        or any(units.find_factor(quantity, one) is not None for quantity in units.FACTORS for one in (cell, plain))
        for cell, plain in ((cell, cell.strip("() ")) for cell in filled)
    )
    words = sum(len(cell) > 1 and not is_number(cell, False) for cell in filled)
    return bool(filled) and known > 0.6 * len(filled) and words > 0
