"""Tables of benchmarks for terminals and for pages: errors by group, and times with their ratios."""

import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TextIO

from levelhead.bench.accuracy import Accuracy
from levelhead.bench.ratios import Ratios
from levelhead.bench.timing import Table as Figures
from levelhead.evaluate.text_table import Cell, Column, best_rows
from levelhead.standard_output import standard_output

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

RATIO_COLUMNS = {
    "data": "data",
    "recordings": "recordings",
    "ratio": "error, ratio",
    "tilt": "tilt, ratio",
    "ours": "ours °",
    "peer": "theirs °",
    "worse": "> 1.2",
    "worst": "worst",
    "worst recording": "which",
    "beyond_tilt": "tilt beyond 4σ",
    "beyond_heading": "heading beyond 4σ",
    "tilt_ratio": "tilt/σ",
    "heading_ratio": "heading/σ",
}
RATIO_NOTE = (
    "Ratios are geometric means. The error is the total one after one constant rotation, without a magnetometer the "
    "change of the heading error in a minute."
)
PIPE = 200  # columns of text where there is no terminal
PARTED = 2  # columns between the groups and the overall figures


@standard_output()
def print_accuracy(result: Accuracy, every: bool = False, file: TextIO | None = None) -> None:
    """Print the table by group and its notes (default: to stdout), after the long one if it is wanted.

    Where the terminal is too narrow the table is cut between columns, and goes on below.
    """
    console = _console(file)
    if every:
        console.print(_long(result))
    for table in _parts(result, console):
        console.print(table)
    for ratios in result.ratios:
        console.print(ratio_table(ratios))
    console.print(*result.notes, sep="\n", style="dim", markup=False)


def ratio_table(ratios: Ratios) -> "Table":
    """Ours beside a peer, a row per data set."""
    table = _grid(f"{ratios.method} beside {ratios.peer}", RATIO_NOTE)
    for key, title in RATIO_COLUMNS.items():
        table.add_column(title, justify="left" if key in ("data", "worst recording") else "right")
    for row in ratios.table:
        table.add_row(*(_ratio_cell(key, row[key]) for key in RATIO_COLUMNS))
    return table


def ratio_markdown(ratios: Ratios) -> str:
    """The same as a Markdown table."""
    lines = [list(RATIO_COLUMNS.values()), ["---"] + ["---:"] * (len(RATIO_COLUMNS) - 1)]
    lines += [[_ratio_cell(key, row[key]) for key in RATIO_COLUMNS] for row in ratios.table]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def _ratio_cell(key: str, value: str | float | None) -> str:
    if key.startswith("beyond") and isinstance(value, float):
        return f"{100.0 * value:.1f} %"
    return format_cell(value)


@standard_output()
def print_figures(tables: Sequence[Figures], machine: Mapping[str, str], notes: Sequence[str] = ()) -> None:
    """Print the machine of the measurement, and the tables."""
    from rich.markup import escape

    console = _console(None)
    facts = ", ".join(f"{name} {value}" for name, value in machine.items())
    console.print(facts, style="dim", soft_wrap=True)
    for figures in tables:
        table = _grid(figures.title, escape(figures.note))
        for i, heading in enumerate(figures.columns.values()):
            table.add_column(heading, justify="right" if i else "left")
        for row in figures.rows:
            table.add_row(*(escape(format_cell(row.get(key))) for key in figures.columns))
        console.print(table)
    for note in notes:
        console.print(note, style="dim", markup=False)


def format_cell(value: Cell) -> str:
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
    table += "".join(f"\n{one.method} beside {one.peer}:\n\n{ratio_markdown(one)}" for one in result.ratios)
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
