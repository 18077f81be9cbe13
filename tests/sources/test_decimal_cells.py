"""Columns out of text by array operations have the bits of Python's own float and int."""

import math
import random
from pathlib import Path

import numpy as np
import pytest

from levelhead.sources.formats.text.decimal_cells import find_decimal_cells
from levelhead.sources.formats.text.delimited import TextTable
from levelhead.sources.formats.text.file import open_text

PLAIN = ["0", "-0", "-0.0", "+.5", "5.", "  1.5 ", "-12345.678901", "0.1", 
         "0.000123456789012345678", "0.30000000000000004", "-9007199254740991", "123456789012345678"]  # fmt: skip
OTHER = [
    "9007199254740993",
    "1e3",
    "1234567890123456789",
    "12.34567890123456789",
    "nan",
    "0.1234567890123456789",
    "",
    ".",
    "-",
    "1_0",
    "12a",
    "1.2.3",
    "0x10",
    "1 2",
]


def made(rng: random.Random) -> str:
    """A number of up to 17 digits, as programs write them."""
    digits = "".join(rng.choice("0123456789") for _ in range(rng.randint(1, 17)))
    at = rng.randint(0, len(digits))
    if rng.random() < 0.3:
        return repr(rng.gauss(0.0, 10.0 ** rng.randint(-3, 3)))
    return rng.choice(["", "-", "+"]) + rng.choice([digits, f"{digits[:at]}.{digits[at:]}"])


def is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def test_each_known_cell_has_the_bits_of_float() -> None:
    rng = random.Random(0)
    cells = [*PLAIN, *OTHER, *(made(rng) for _ in range(4000))]
    found = find_decimal_cells("\n".join(f"1,{cell},2" for cell in cells), ",", 3)
    assert found is not None
    values, known = found.floats(1)
    for cell, value, is_known in zip(cells, values.tolist(), known.tolist(), strict=True):
        if is_known:
            assert math.copysign(1.0, value) == math.copysign(1.0, float(cell)) and value == float(cell), cell
    assert known[: len(PLAIN)].all() and not known[len(PLAIN) : len(PLAIN) + len(OTHER)].any()
    assert known[len(PLAIN) + len(OTHER) :].mean() > 0.97, "most numbers need no second reading"
    assert [found.cell(row, 1) for row in range(len(cells))] == cells


def test_whole_numbers_are_exact() -> None:
    cells = ["0", "-7", "+12", " 345 ", "123456789012345678", "-99999999999999999"]
    found = find_decimal_cells("\n".join(f"{cell};x" for cell in cells), ";", 2)
    assert found is not None
    values, known = found.integers(0)
    assert known.all() and values.tolist() == [int(cell) for cell in cells]
    more = find_decimal_cells("1.5;x\n1234567890123456789;x\n;x\n12a;x", ";", 2)
    assert more is not None and not more.integers(0).known.any()


@pytest.mark.parametrize("text", ["1,2\n3", "1,2\n3,4,5\n6", "1,2\n\n3,4", "1\n2,3,4", "1,2°\n3,4"])
def test_lines_that_are_not_alike_are_left_to_the_other_reader(text: str) -> None:
    assert find_decimal_cells(text, ",", 2) is None


@pytest.mark.parametrize(("delimiter", "point", "end"), [(",", ".", "\n"), (";", ",", "\r\n"), ("\t", ".", "\r")])
def test_a_file_reads_as_its_cells_whatever_they_are(tmp_path: Path, delimiter: str, point: str, end: str) -> None:
    """Several blocks; stamps beyond 2^53; cells that only Python reads; missing ones."""
    rng = random.Random(1)
    stamps = [1_683_203_415_250_000_000 + 10_000_000 * k for k in range(30_000)]
    rows = []
    for k, stamp in enumerate(stamps):
        odd = "" if k % 50 == 7 else "1.5e-3" if k % 50 == 9 else made(rng)
        rows.append([str(stamp), f"{rng.gauss(0, 1):.6f}", f"{rng.gauss(0, 300):.3f}", odd])
    path = tmp_path / "log.txt"
    lines = [delimiter.join(["t", "a", "b", "c"]), *(delimiter.join(row).replace(".", point) for row in rows)]
    path.write_bytes((end.join(lines) + end).encode())
    table = TextTable(open_text(path))
    columns = table.read([0, 1, 2, 3], frozenset([0]))
    assert columns[0].dtype == np.int64 and columns[0].tolist() == stamps
    for i in (1, 2, 3):
        expected = np.array([float(row[i]) if row[i] else math.nan for row in rows])
        assert columns[i].tobytes() == expected.tobytes()
    assert not table.conclusions or point == ","


def test_a_torn_cell_is_left_out_with_its_line(tmp_path: Path) -> None:
    rows = [f"{k / 100:.2f},{k}.5,1.0" for k in range(400)]
    rows[123] = "1.23,12x.5,1.0"
    path = tmp_path / "log.csv"
    path.write_text("t,a,b\n" + "\n".join(rows) + "\n")
    table = TextTable(open_text(path))
    columns = table.read([0, 1, 2])
    assert len(columns[0]) == 399 and 123.5 not in columns[1]
    assert [conclusion.facts["first"] for conclusion in table.conclusions] == [
        "line 125, column 'a': '12x.5' is not a number"
    ]
