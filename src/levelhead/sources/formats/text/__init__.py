"""What a text file is: JSON, words before numbers, rows typed by sensor, or a table."""

from collections.abc import Sequence
from pathlib import Path

from levelhead.errors import LevelheadError
from levelhead.sources.formats.text.cells import is_comment
from levelhead.sources.formats.text.delimited import TextTable
from levelhead.sources.formats.text.dialect import first_lines, layout_of
from levelhead.sources.formats.text.encoding import Encoding
from levelhead.sources.formats.text.labelled import looks_labelled
from levelhead.sources.formats.text.labelled_table import labelled_table
from levelhead.sources.formats.text.long_table import melted_tables
from levelhead.sources.formats.text.ros_echo import echoed_table, looks_echoed
from levelhead.sources.formats.text.typed_rows import typed_tables
from levelhead.sources.formats.text.wrapped_lines import undress_text
from levelhead.sources.hints import Hints
from levelhead.sources.interpret.by_numbers import with_names
from levelhead.sources.table import Table

_BINARY = {
    b"\x89HDF\r\n\x1a\n": "HDF5 (.h5)", b"PK\x03\x04": "a ZIP archive (.zip, .npz, .xlsx)",
    b"PAR1": "Parquet (.parquet)",
    b"\x1f\x8b": "compressed with gzip (.gz)", b"MATLAB 5.0": "MATLAB (.mat)", b"\x93NUMPY": "NumPy (.npy)",
    b"ULog\x01\x12\x35": "PX4's ULog (.ulg)", b"\xa3\x95": "ArduPilot's DataFlash (.bin)",
}  # fmt: skip

_FEW = 5  # lines that are no comments; a protocol whose lines begin as comments may send some greetings too


def tables(path: Path, shown: str, hints: Hints) -> Sequence[Table]:
    """The tables of a text file.

    Raises:
        LevelheadError: empty, binary, no line of numbers.
    """
    with open(path, "rb") as file:
        head = file.read(16)
    for signature, what in _BINARY.items():
        if head.startswith(signature):
            raise LevelheadError(
                f"{shown} is named like text but is {what}; expected lines of numbers, or the right suffix"
            )
    lines, encoding = _find_format(path, shown)
    content = [line for line in lines if line.strip() and not is_comment(line)]
    first = content[0].lstrip("\ufeff \t") if content else ""
    bracket = first[:1] in "{[" and first[:1] and '"' in "".join(content[:3])
    if bracket or any(line.lstrip().startswith("{") and '"' in line for line in content[1:2]):
        from levelhead.sources.formats.json_tables import tables as json_tables

        return json_tables(path, shown, hints)
    if looks_echoed(content):
        return [echoed_table(path, shown, encoding)]
    if undress_text("\n".join((content if len(content) > _FEW else lines)[:200])) is not None:
        return _tables_undressed(path, shown, hints, encoding)
    if looks_labelled(content[:40]):
        return [labelled_table(path, shown, encoding)]
    if found := melted_tables(path, shown, content, encoding) or typed_tables(path, shown, content, encoding):
        return found
    table = TextTable(path, layout_of(lines, shown, encoding), shown)
    nameless = table.layout.headless and not {"gyr", "acc"} <= set(hints.map)
    return [with_names(table, hints) if nameless else table]


def _tables_undressed(path: Path, shown: str, hints: Hints, encoding: Encoding) -> Sequence[Table]:
    """The tables of a text once its lines are plain, read before the plain copy goes."""
    import tempfile

    from levelhead.sources.table import in_memory

    text = undress_text(path.read_bytes()[encoding.skip :].decode(encoding.name, "replace"))
    if text is None:
        raise LevelheadError(f"{shown} begins with sentences or stamps of a terminal, but does not go on with them")
    with tempfile.TemporaryDirectory(prefix="levelhead-") as folder:
        copy = Path(folder) / "0.txt"
        copy.write_text(text, encoding="utf-8")
        return [in_memory(table, "") for table in tables(copy, shown, hints)]


def _find_format(path: Path, shown: str) -> tuple[list[str], Encoding]:
    try:
        return first_lines(str(path))
    except LevelheadError as error:
        raise LevelheadError(str(error).replace(str(path), shown)) from None
