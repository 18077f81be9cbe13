"""Tables of benchmarks for terminals and for pages: errors by group, and times with their ratios."""

import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TextIO

from levelhead.bench.accuracy import Accuracy
from levelhead.bench.timing import Table as Figures
from levelhead.evaluate.text_table import Cell, Column, best_rows

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

PIPE = 200  # columns of text where there is no terminal
PARTED = 2  # columns between the groups and what is taken over all


def print_accuracy(result: Accuracy, every: bool = False, file: TextIO | None = None) -> None:
    """Print the table by group and its notes (default: to stdout), after the long one if it is wanted.

    Where the terminal is too narrow the table is cut between columns, and goes on below.
    """
    console = _console(file)
    if every:
        console.print(_long(result))
    for table in _parts(result, console):
        console.print(table)
    console.print(*result.notes, sep="\n", style="dim", markup=False)


def print_figures(tables: Sequence[Figures], machine: Mapping[str, str], notes: Sequence[str] = ()) -> None:
    """Print what the figures were taken on, and the tables."""
    from rich.markup import escape

    console = _console(None)
    facts = ", ".join(f"{name} {value}" for name, value in machine.items())
    console.print(facts, style="dim", soft_wrap=True)
    for figures in tables:
        table = _grid(figures.title, escape(figures.note))
        for i, heading in enumerate(figures.columns.values()):
            table.add_column(heading, justify="right" if i else "left")
        for row in figures.rows:
            table.add_row(*(escape(number(row.get(key))) for key in figures.columns))
        console.print(table)
    for note in notes:
        console.print(note, style="dim", markup=False)


def number(value: Cell) -> str:
    """A figure with three digits that count."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    return str(value)


def markdown(result: Accuracy) -> str:
    """The table by group as a Markdown table, the best of each column bold, with its notes below."""
    columns, rows = result.columns, result.table
    best = [best_rows(column, rows) for column in columns]
    lines = [[column.title for column in columns], ["---"] + ["---:"] * (len(columns) - 1)]
    for i in range(len(rows)):
        cells = [result.cell(i, column) for column in columns]
        lines.append([f"**{cell}**" if i in top else cell for cell, top in zip(cells, best, strict=True)])
    table = "".join("| " + " | ".join(line) + " |\n" for line in lines)
    return table + "\n" + "".join(f"- {note.removeprefix('* ')}\n" for note in result.notes)


def _console(file: TextIO | None) -> "Console":
    from rich.console import Console

    file = sys.stdout if file is None else file
    return Console(file=file, highlight=False, width=None if file.isatty() else PIPE)


def _grid(title: str, note: str = "") -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(title=title, caption=note or None, box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False)
    table.caption_justify = "left"
    return table


def _parts(result: Accuracy, console: "Console") -> list["Table"]:
    """The table, in as many parts as the console's width makes it; each begins with the methods."""
    columns, rows = result.columns, result.table
    best = {column.key: best_rows(column, rows) for column in columns}
    cells = {column.key: [result.cell(i, column) for i in range(len(rows))] for column in columns}
    widths = {key: max(map(len, [*texts, *_title(key).split("\n")])) + PARTED for key, texts in cells.items()}
    parts: list[list[Column]] = [[]]
    room = console.width - widths["method"]
    for column in columns[1:]:
        if parts[-1] and sum(widths[one.key] for one in [*parts[-1], column]) > room:
            parts.append([])
        parts[-1].append(column)
    return [_part(result, [columns[0], *part], cells, best) for part in parts]


def _part(
    result: Accuracy, columns: Sequence[Column], cells: Mapping[str, list[str]], best: Mapping[str, set[int]]
) -> "Table":
    from rich.text import Text

    table = _grid(f"RMS {result.figure} error in °, by group")
    for column in columns:
        left = column.key == "method"
        table.add_column(_title(column.key), justify="left" if left else "right", no_wrap=True)
    for i in range(len(result.methods)):
        table.add_row(*(Text(cells[one.key][i], "bold" if i in best[one.key] else "") for one in columns))
    return table


def _title(key: str) -> str:
    """A head of several short lines."""
    return key.replace(": ", " ").replace(" ", "\n")


def _long(result: Accuracy) -> "Table":
    """Every method on every recording."""
    table = _grid("RMS errors in °, every recording")
    shown = ("recording", "method", "total", "heading", "tilt", "aligned", "drift", "note")
    for key in shown:
        table.add_column(key, justify="left" if key in ("recording", "method", "note") else "right")
    for row in result.long:
        table.add_row(*(f"{row[key]:.2f}" if isinstance(row[key], float) else str(row[key] or "") for key in shown))
    return table
