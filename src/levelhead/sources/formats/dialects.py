"""The dialects of text files: JSON, words before numbers, rows of several sensors, tables."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from levelhead.errors import LevelheadError
from levelhead.sources.formats import json_log
from levelhead.sources.formats.text import (
    delimited,
    labelled,
    long_table,
    ros_echo,
    typed_rows,
    wrapped_lines,
)
from levelhead.sources.formats.text.file import TextFile, open_text
from levelhead.sources.hints import Hints
from levelhead.sources.table import Table, add_conclusion

_BINARY = {
    b"\x89HDF\r\n\x1a\n": "HDF5 (.h5)", b"PK\x03\x04": "a ZIP archive (.zip, .npz, .xlsx)",
    b"PAR1": "Parquet (.parquet)",
    b"\x1f\x8b": "compressed with gzip (.gz)", b"MATLAB 5.0": "MATLAB (.mat)", b"\x93NUMPY": "NumPy (.npy)",
    b"ULog\x01\x12\x35": "PX4's ULog (.ulg)", b"\xa3\x95": "ArduPilot's DataFlash (.bin)",
}  # fmt: skip


class Dialect(NamedTuple):
    """A way to write samples as text.

    Attributes:
        name: for people.
        matches: whether the first lines of a file are written so.
        tables: the tables of a file that matches.
    """

    name: str
    matches: Callable[[TextFile], bool]
    tables: Callable[[TextFile], Sequence[Table]]


def _unwrapped_tables(file: TextFile) -> Sequence[Table]:
    """The tables of the text without the wrapping of its lines."""
    return sniff(wrapped_lines.unwrap_file(file))


# The first dialect that matches reads the file, so each comes before those that match its files too:
# - The names in JSON and in ROS messages are words before numbers.
# - A wrapped line holds a line of any dialect below.
# - Words before numbers may have delimiters between them.
# - Long tables and typed rows both name a sensor in each row; a long table has a column of values besides.
# - The delimited table matches always.
DIALECTS = (
    Dialect("JSON", json_log.matches, json_log.text_tables),
    Dialect("ROS messages", ros_echo.matches, ros_echo.tables),
    Dialect("wrapped lines", wrapped_lines.matches, _unwrapped_tables),
    Dialect("words before numbers", labelled.matches, labelled.tables),
    Dialect("long table", long_table.matches, long_table.tables),
    Dialect("typed rows", typed_rows.matches, typed_rows.tables),
    Dialect("delimited table", delimited.matches, delimited.tables),
)


def tables(path: Path, display_path: str, hints: Hints) -> Sequence[Table]:
    """The tables of a text file.

    Raises:
        LevelheadError: empty, binary, no line of numbers.
    """
    with open(path, "rb") as file:
        head = file.read(16)
    for signature, what in _BINARY.items():
        if head.startswith(signature):
            raise LevelheadError(
                f"{display_path} is named like text but is {what}; expected lines of numbers, or the right suffix"
            )
    text = open_text(path, display_path)
    found = sniff(text)
    return found if text.zeros is None else [add_conclusion(table, text.zeros) for table in found]


def sniff(file: TextFile) -> Sequence[Table]:
    """The tables of a text by the first dialect that matches and finds some; the last one does or raises an error."""
    return next(tables for dialect in DIALECTS if dialect.matches(file) and (tables := dialect.tables(file)))
