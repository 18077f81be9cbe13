"""Columns out of plain text have the bits of Python's own float and int."""

import math
import random
import unittest.mock
from pathlib import Path

import numpy as np
import pytest

from levelhead.sources.formats.text import number_rows as module
from levelhead.sources.formats.text.delimited import TextTable
from levelhead.sources.formats.text.file import open_text
from levelhead.sources.formats.text.number_rows import number_rows

PLAIN = ["0", "-0", "-0.0", "+.5", "5.", "  1.5 ", "-12345.678901", "0.1", "1e3", "inf", "1E-400",
         "0.000123456789012345678", "0.30000000000000004", "9007199254740993", "1234567890123456789"]  # fmt: skip
BLANK = ["", "nan", "NaN", " ", "-", "N/A", "null", "None", "--", "-nan(ind)"]
OTHER = [".", "1_0", "12a", "1.2.3", "0x10", "1 2", "nano", "--1", "٣"]


@pytest.fixture(autouse=True, params=["numpy", "msgspec"])
def reader(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Both readers get each text, whatever its length."""
    monkeypatch.setattr(module, "_LONG", 0 if request.param == "msgspec" else math.inf)
    return str(request.param)


def made(rng: random.Random) -> str:
    """A number of up to 17 digits, as programs write them."""
    digits = "".join(rng.choice("0123456789") for _ in range(rng.randint(1, 17)))
    at = rng.randint(0, len(digits))
    if rng.random() < 0.3:
        return repr(rng.gauss(0.0, 10.0 ** rng.randint(-3, 3)))
    return rng.choice(["", "-", "+"]) + rng.choice([digits, f"{digits[:at]}.{digits[at:]}"])


def test_each_cell_has_the_bits_of_float() -> None:
    rng = random.Random(0)
    cells = [*PLAIN, *(made(rng) for _ in range(4000))]
    found = number_rows("\n".join(f"1,{cell},2" for cell in cells), ",", 3, [1], [])
    assert found is not None and list(found) == [1]
    assert found[1].tobytes() == np.array([float(cell) for cell in cells]).tobytes()


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|"])
def test_plain_numbers_go_to_the_fast_reader(delimiter: str, reader: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = random.Random(2)
    rows = [[str(k), f"{rng.gauss(0, 10):.6f}", repr(rng.gauss(0, 1e-3)), "-0.0"] for k in range(-500, 500)]
    parse = unittest.mock.Mock(wraps=module._parse)
    monkeypatch.setattr(module, "_parse", parse)
    found = number_rows("\n".join(map(delimiter.join, rows)) + "\n", delimiter, 4, [0, 2, 3], [0])
    assert found is not None and parse.called == (reader == "numpy")
    assert found[0].dtype == np.int64 and found[0].tolist() == list(range(-500, 500))
    for i in (2, 3):
        assert found[i].tobytes() == np.array([float(row[i]) for row in rows]).tobytes()


@pytest.mark.parametrize("cell", ["-0", "-0 ", " -0", "9" * 400, "1e400", "18446744073709551617"])
def test_numbers_at_the_edges_of_json_have_the_bits_of_float(cell: str) -> None:
    found = number_rows(f"1,{cell}\n{cell},2", ",", 2, [0, 1], [])
    assert found is not None
    assert np.concatenate([found[0], found[1]]).tobytes() == np.array([1.0, float(cell), float(cell), 2.0]).tobytes()


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|"])
def test_missing_cells_are_nan_wherever_they_stand(delimiter: str) -> None:
    rows = [[cell, "1.5", cell, cell] for cell in BLANK] + [["1", "2", "3", "4"]]
    found = number_rows("\n".join(delimiter.join(row) for row in rows), delimiter, 4, range(4), [])
    assert found is not None and found[1].tolist() == [1.5] * len(BLANK) + [2.0]
    for i, last in ((0, 1.0), (2, 3.0), (3, 4.0)):
        assert np.isnan(found[i][:-1]).all() and found[i][-1] == last


@pytest.mark.parametrize("cell", OTHER)
def test_what_is_no_number_is_left_to_the_other_reader(cell: str) -> None:
    text = f"1,2,x\n3,{cell},y"
    assert number_rows(text, ",", 3, [0, 1], []) is None
    found = number_rows(text, ",", 3, [0], [])
    assert found is not None and found[0].tolist() == [1.0, 3.0], "nobody asked for that column"


def test_whole_numbers_are_exact() -> None:
    cells = ["0", "-7", "+12", " 345 ", "123456789012345678", "-99999999999999999", "9223372036854775807"]
    found = number_rows("\n".join(f"{cell};x" for cell in cells), ";", 2, [0], [0])
    assert found is not None and found[0].dtype == np.int64 and found[0].tolist() == [int(cell) for cell in cells]


@pytest.mark.parametrize("cell", ["1.5", "9223372036854775808", "", "1e3"])
def test_a_column_with_another_number_is_not_whole(cell: str) -> None:
    found = number_rows(f"7;x\n{cell};x", ";", 2, [0], [0])
    assert found is not None and found[0].dtype == np.float64
    assert found[0].tobytes() == np.array([7.0, float(cell or "nan")]).tobytes()


@pytest.mark.parametrize("text", ["1,2\n3", "1,2\n3,4,5\n6", "1\n2,3,4", "1,2°\n3,4", "", "\n"])
def test_lines_that_are_not_alike_are_left_to_the_other_reader(text: str) -> None:
    assert number_rows(text, ",", 2, [0, 1], []) is None


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
