"""Comparisons and sweeps as terminal tables: units in the head, the best of each column bold."""

import sys
from typing import TYPE_CHECKING, TextIO

from levelhead.evaluate import Comparison
from levelhead.evaluate.compare import COLUMNS
from levelhead.evaluate.text_table import Column, best_rows, drop_empty_columns
from levelhead.standard_output import standard_output
from levelhead.tune import Sweep

if TYPE_CHECKING:
    from rich.table import Table
    from rich.text import Text


def rich_table(result: Comparison | Sweep) -> "Table":
    """A ``rich.table.Table`` of the result, without its notes."""
    from rich import box
    from rich.table import Table

    columns = COLUMNS if isinstance(result, Comparison) else result.columns
    rows = result.table
    shown = drop_empty_columns(columns, rows)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    for column in shown:
        words = [str(row[column.key]).partition("(")[0] for row in rows if isinstance(row[column.key], str)]
        if words:  # the names of filters stay whole, their parameters may wrap
            table.add_column(_head(column), justify="left", overflow="fold", min_width=max(map(len, words)))
        else:
            table.add_column(_head(column), justify="right", no_wrap=True)
    best = [best_rows(column, rows) for column in shown]
    for i, row in enumerate(rows):
        cells = zip(shown, best, strict=True)
        table.add_row(*(_text(column.cell(row[column.key]), i in top) for column, top in cells))
    return table


def _head(column: Column) -> "Text":
    """Title, and under it the unit; a long title takes two lines, so that a table of errors fits 80 characters."""
    from rich.text import Text

    text = Text(column.title.replace(" ", "\n"))
    return text.append(f"\n{column.unit}", "dim") if column.unit else text


def _text(cell: str, best: bool) -> "Text":
    """A cell; the parameters of a filter stand quietly under its name."""
    from rich.text import Text

    name, _, params = cell.partition("(")
    text = Text(name, "bold" if best else "")
    return text.append(f"\n{params.removesuffix(')')}", "dim") if params else text


@standard_output()
def print_table(result: Comparison | Sweep, file: TextIO | None = None) -> None:
    """Print the result and its notes: a rich table on a terminal, else plain text (default: stdout)."""
    file = sys.stdout if file is None else file
    if not file.isatty():
        file.write(f"{result}\n")
        return
    from rich.console import Console

    notes = result.notes if isinstance(result, Comparison) else [f"{result.finding[0].upper()}{result.finding[1:]}."]
    console = Console(file=file, highlight=False)
    console.print(rich_table(result))
    console.print(*notes, sep="\n", style="dim", markup=False)
