"""Columns of a table of results: title, unit and digits stand here once, for plain text, terminals and pictures."""

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

Cell = str | float | None  # a value in a table: a name, a number, or nothing
Row = Mapping[str, Cell]  # column key -> value


class Column(NamedTuple):
    """One column; ``best``: the lowest value is the best, or the one nearest to 1; "": the column has no best value.

    ``digits`` stand behind the decimal point; None: as many as the value needs, up to 6 in all.
    """

    key: str
    title: str
    unit: str = ""
    digits: int | None = 3
    best: Literal["low", "one", ""] = ""

    @property
    def header(self) -> str:
        """Title with unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    def cell(self, value: Cell) -> str:
        """A value as text; "–" for one that does not exist."""
        if value is None:
            return "–"
        if isinstance(value, str):
            return value
        if self.digits is None:
            return f"{value:.6g}".replace("-", "−")
        text = f"{value:,.{self.digits}f}" if abs(value) < 1e6 else f"{value:.{self.digits}e}"
        return text.replace("-", "−")


def drop_empty_columns(columns: Sequence[Column], rows: Sequence[Row]) -> list[Column]:
    """The columns in which at least one row has a value."""
    return [column for column in columns if any(row[column.key] is not None for row in rows)]


def best_rows(column: Column, rows: Sequence[Row]) -> set[int]:
    """Indices of the best rows of a column, those equal as printed included; none where there is nothing to choose."""
    if not column.best or len(rows) < 2:
        return set()
    ideal = 1.0 if column.best == "one" else 0.0
    values = {i: row[column.key] for i, row in enumerate(rows)}
    away = {i: abs(value - ideal) for i, value in values.items() if isinstance(value, float | int)}
    if len(away) < 2:
        return set()
    least = min(away, key=lambda i: away[i])
    text = column.cell(rows[least][column.key])
    return {i for i in away if column.cell(rows[i][column.key]) == text}


def plain_table(columns: Sequence[Column], rows: Sequence[Row]) -> str:
    """The table as aligned text: words to the left, numbers to the right."""
    shown = drop_empty_columns(columns, rows)
    lines = [[column.header for column in shown]]
    lines += [[column.cell(row[column.key]) for column in shown] for row in rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(shown))]
    wordy = [any(isinstance(row[column.key], str) for row in rows) for column in shown]
    return "\n".join(
        "  ".join(
            text.ljust(width) if left else text.rjust(width)
            for text, width, left in zip(line, widths, wordy, strict=True)
        ).rstrip()
        for line in lines
    )
