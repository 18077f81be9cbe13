import importlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from levelhead.errors import LevelheadError
from levelhead.recording import Recording
from levelhead.sources import read
from levelhead.sources.formats.csv_writer import write_csv
from levelhead.sources.formats.text import delimited as text

HEADER = "t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s2],ay [m/s2],az [m/s2]"
ROWS = ["0.00,0.01,0.02,0.03,0.1,0.2,9.8", "0.01,0.01,0.02,0.03,0.1,0.2,9.8", "0.02,0.01,0.02,0.03,0.1,0.2,9.8"]


def log(folder: Path, *lines: str, name: str = "log.csv", end: str = "\n") -> Path:
    path = folder / name
    path.write_bytes((end.join(lines) + end).encode())
    return path


def refused(path: Path, **hints: object) -> str:
    with pytest.raises(LevelheadError) as caught:
        read(path, **hints)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("bom", ["", "\ufeff"])
def test_line_ends_and_byte_order_mark(tmp_path: Path, end: str, bom: str) -> None:
    recording = read(log(tmp_path, bom + HEADER, *ROWS, end=end))
    assert recording.t.tolist() == [0.0, 0.01, 0.02]
    assert recording.gyr[0].tolist() == [0.01, 0.02, 0.03]


@pytest.mark.parametrize("delimiter", [";", "\t", ",", " "])
def test_delimiters(tmp_path: Path, delimiter: str) -> None:
    names = ["t_s", "gx", "gy", "gz", "ax_ms2", "ay_ms2", "az_ms2"]
    lines = [delimiter.join(names), *(row.replace(",", delimiter) for row in ROWS)]
    recording = read(log(tmp_path, *lines), units={"gyr": "rad/s"})
    assert recording.acc[2].tolist() == [0.1, 0.2, 9.8]


def test_decimal_comma(tmp_path: Path) -> None:
    lines = [line.replace(",", ";").replace(".", ",") for line in [HEADER, *ROWS]]
    recording = read(log(tmp_path, *lines))
    assert recording.acc[2].tolist() == [0.1, 0.2, 9.8]
    assert any("decimal comma" in note for note in recording.meta["notes"])


def test_comments_blank_lines_quotes_and_trailing_delimiters(tmp_path: Path) -> None:
    lines = [
        "# made by hand",
        "",
        HEADER + ",",
        ROWS[0] + ",",
        "# in between",
        "",
        ROWS[1],
        '"0.02","0.01",0.02,0.03,0.1,0.2,9.8,',
    ]
    assert read(log(tmp_path, *lines)).t.tolist() == [0.0, 0.01, 0.02]


@pytest.mark.parametrize("missing", ["", " ", "NaN", "nan", "null", "NA", "None"])
def test_missing_values_are_nan(tmp_path: Path, missing: str) -> None:
    recording = read(log(tmp_path, HEADER, ROWS[0], f"0.01,{missing},0.02,0.03,0.1,0.2,9.8", ROWS[2]))
    assert np.isnan(recording.gyr[1, 0]) and recording.gyr[1, 1] == 0.02


def test_two_header_lines_with_spread_groups(tmp_path: Path) -> None:
    lines = [
        "Time (s);IMU Gyroscope (rad/s);;;IMU Acceleration;;;",
        ";X;Y;Z;X;Y;Z;",
        *(r.replace(",", ";") for r in ROWS),
    ]
    recording = read(log(tmp_path, *lines))
    assert recording.meta["units"]["gyr"] == "rad/s" and recording.acc[0, 2] == 9.8


def test_a_header_has_six_lines_at_most(tmp_path: Path) -> None:
    assert "the gyroscope has b b b b b gx [rad/s] but" in refused(log(tmp_path, *["a,b,c,d,e,f,g"] * 8, HEADER, *ROWS))


def test_a_header_in_a_comment(tmp_path: Path) -> None:
    euroc = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    euroc += "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"
    rows = [f"{1403636579758555392 + i * 5_000_000},0.1,0.1,0.1,9.1,0.1,-3.6" for i in range(3)]
    recording = read(log(tmp_path, euroc, *rows))
    assert recording.t.tolist() == [0.0, 0.005, 0.01]
    assert recording.meta["t0"] == pytest.approx(1403636579.758555392)


def test_unused_text_columns_do_no_harm(tmp_path: Path) -> None:
    recording = read(log(tmp_path, HEADER + ",label", *(row + ",walk_ing" for row in ROWS)))
    assert recording.meta["ignored"] == ["label"] and len(recording) == 3


def test_headless_file_asks_for_hints_and_takes_numbers(tmp_path: Path) -> None:
    path = log(tmp_path, *ROWS)
    assert "no header" in refused(path) and "the columns reach: 1 0 to 0.02" in refused(path)
    hints = {"t": ["1"], "gyr": ["2", "3", "4"], "acc": ["5", "6", "7"]}
    assert read(path, map=hints, units={"gyr": "rad/s"}).acc[0, 2] == 9.8


def test_raw_counts(tmp_path: Path) -> None:
    lines = ["ax,ay,az,gx,gy,gz", *("0,0,16384,131,262,-131" for _ in range(5))]
    recording = read(log(tmp_path, *lines), counts={"gyr": "131/deg/s", "acc": "16384/g"}, rate=100.0)
    np.testing.assert_allclose(recording.gyr[0], np.radians([1.0, 2.0, -1.0]), rtol=1e-15)
    assert recording.acc[0, 2] == 9.80665 and recording.t[1] == 0.01
    said = refused(log(tmp_path, *lines), rate=100.0)
    assert "counts gyr=131/deg/s --rate 100" in said  # constant counts: nothing tells the gyroscope's scale
    confirmed = read(log(tmp_path, *lines), counts={"gyr": "131/deg/s"}, rate=100.0)
    assert any("16384 per g, a guess" in note for note in confirmed.meta["notes"])


def test_vendor_quaternion_is_left_out(tmp_path: Path) -> None:
    names = ",Quat_w,Quat_x,Quat_y,Quat_z"
    recording = read(log(tmp_path, HEADER + names, *(row + ",1,0,0,0" for row in ROWS)))
    assert recording.truth is None and recording.meta["ignored"] == names[1:].split(",")
    mapped = read(log(tmp_path, HEADER + names, *(row + ",1,0,0,0" for row in ROWS)), map={"q": ["Quat"]})
    assert mapped.truth is not None and not mapped.truth.north


def test_all_zero_quaternion_means_no_truth(tmp_path: Path) -> None:
    path = log(tmp_path, HEADER + ",qw,qx,qy,qz", ROWS[0] + ",0,0,0,0", ROWS[1] + ",1,0,0,0", ROWS[2] + ",,,,")
    recording = read(path)
    assert recording.truth is not None
    assert np.isnan(recording.truth.quat[:, 0]).tolist() == [True, False, True]


BAD = [
    ([], {}, "is empty"),
    (["# only", "# comments"], {}, "no lines but comments"),
    ([HEADER], {}, "no line of numbers"),
    ([HEADER, ROWS[0], "0.01,abc,0.02,0.03,0.1,0.2,9.8"], {}, "line 3, column 'gx [rad/s]': 'abc' is not a number"),
    (["# c", HEADER, "", ROWS[0], ROWS[1], "0.02,1_0,0.02,0.03,0.1,0.2,9.8"], {}, "line 6, column 'gx [rad/s]': '1_0'"),
    ([HEADER, ROWS[0], "0.01,0.1"], {}, "line 3: 2 cells, but the header has 7"),
    ([HEADER, ROWS[0], ROWS[1] + ",5"], {}, "line 3: 8 cells"),
    ([HEADER, ROWS[1], "# c", ROWS[0]], {}, "line 4, column 't [s]': time goes back from 0.01 to 0.0"),
    ([HEADER, ROWS[0], ROWS[0]], {}, "line 3, column 't [s]': time stands still at 0.0"),
    ([HEADER, ROWS[0], ",0.01,0.02,0.03,0.1,0.2,9.8"], {}, "line 3, column 't [s]': the time is missing"),
    ([HEADER, ROWS[0], "0.01,inf,0.02,0.03,0.1,0.2,9.8"], {}, "line 3, column 'gx [rad/s]': the value is infinite"),
    ([HEADER.replace("t [s],", ""), *(row[5:] for row in ROWS)], {}, "no column with time stamps"),
    ([HEADER, *ROWS], {"rate": 100.0}, "rate=100 is given too"),
    ([HEADER, *ROWS], {"map": {"t": ["tme"]}}, "no column 'tme'"),
    ([HEADER + ",qw,qx,qy,qz", ROWS[0] + ",1,0,0,0", ROWS[1] + ",2,0,0,0"], {}, "line 3: the quaternion"),
    ([HEADER, ROWS[0] + "\0"], {}, "not a text file"),
]  # fmt: skip


@pytest.mark.parametrize(("lines", "hints", "sentence"), BAD, ids=[sentence[:30] for _, _, sentence in BAD])
def test_bad_files(tmp_path: Path, lines: list[str], hints: dict, sentence: str) -> None:
    path = log(tmp_path, *lines)
    if not lines:
        path.write_bytes(b"")
    said = refused(path, **hints)
    assert sentence in said and "log.csv" in said


def test_a_zero_byte_far_down_is_refused_with_its_line(tmp_path: Path) -> None:
    rows = [f"{0.01 * k:.2f},0.01,0.02,0.03,0.1,0.2,9.8" for k in range(20_000)]
    rows[15_000] += "\0"
    assert "line 15002: a zero byte; expected text" in refused(log(tmp_path, HEADER, *rows))


@pytest.mark.parametrize("zeros", [1, 5_000, 3_000_000])
@pytest.mark.parametrize("torn", ["", "12.3"])
def test_zeros_at_the_end_are_left_out(tmp_path: Path, zeros: int, torn: str) -> None:
    """A recorder that loses power leaves a file of its reserved size."""
    rows = [f"{0.01 * k:.2f},0.01,0.02,0.03,0.1,0.2,9.8" for k in range(500)]
    path = log(tmp_path, HEADER, *rows)
    path.write_bytes(path.read_bytes() + torn.encode() + bytes(zeros))
    recording = read(path)
    assert len(recording) == 500
    assert f"the {zeros} zero bytes at the end are left out" in " ".join(recording.meta["notes"])


def test_a_file_of_zeros_is_empty(tmp_path: Path) -> None:
    path = log(tmp_path)
    path.write_bytes(bytes(10_000))
    assert "log.csv is empty" in refused(path)


def test_zeros_behind_words_before_numbers(tmp_path: Path) -> None:
    path = log(tmp_path, *(f"t: {0.01 * k:.2f} gx=0.1 gy=0.2 gz=0.3 ax=0.1 ay=0.2 az=9.8" for k in range(500)))
    path.write_bytes(path.read_bytes() + bytes(5_000))
    recording = read(path)
    assert len(recording) == 500
    assert "the 5000 zero bytes at the end are left out" in " ".join(recording.meta["notes"])


@pytest.mark.parametrize("delimiter", [",", "  "])
def test_exponents_of_fortran(tmp_path: Path, delimiter: str) -> None:
    values = [[0.01 * k, 0.01, -0.02, 0.03, 0.1, 0.2, 9.8] for k in range(500)]
    rows = (delimiter.join(f"{value:.6E}".replace("E", "D") for value in row) for row in values)
    path = log(tmp_path, HEADER.replace(" ", "_").replace(",", delimiter), *rows)
    recording = read(path)
    np.testing.assert_allclose(np.hstack([recording.gyr, recording.acc]), np.array(values)[:, 1:], rtol=1e-6)


@pytest.mark.parametrize("packed", ["bz2", "lzma"])
def test_packed_text(tmp_path: Path, packed: str) -> None:
    suffix, module = {"bz2": ".bz2", "lzma": ".xz"}[packed], importlib.import_module(packed)
    path = log(tmp_path, HEADER, *(f"{0.01 * k:.2f},0.01,0.02,0.03,0.1,0.2,9.8" for k in range(500)))
    target = path.with_name(path.name + suffix)
    target.write_bytes(module.compress(path.read_bytes()))
    assert len(read(target)) == 500
    target.write_bytes(target.read_bytes()[:40])
    assert f"is not packed with {suffix[1:]}, or it is damaged" in refused(target)


@pytest.mark.parametrize(
    ("codec", "note"),
    [("cp1252", "cp1252"), ("gb18030", "gb18030"), ("utf-16", ""), ("utf-16-le", "UTF-16"), ("utf-8", "")],
)
def test_other_encodings(tmp_path: Path, codec: str, note: str) -> None:
    header = HEADER.replace("rad/s", "°/s") + ",T (°)"
    path = tmp_path / "log.csv"
    path.write_bytes("\n".join([header, *(f"{row},20" for row in ROWS * 1)]).encode(codec))
    recording = read(path)
    np.testing.assert_allclose(recording.gyr[0], np.radians([0.01, 0.02, 0.03]), rtol=1e-12)
    assert any(note in one for one in recording.meta["notes"]) or not note


def test_paths_that_are_wrong(tmp_path: Path) -> None:
    log(tmp_path, HEADER, *ROWS, name="flight.csv")
    assert "did you mean 'flight.csv'" in refused(tmp_path / "fligth.csv")
    (tmp_path / "folder").mkdir()
    assert "is a folder" in refused(tmp_path / "folder")
    (tmp_path / "picture.jpg").write_bytes(b"\xff\xd8\0\0")
    assert "expected one of .csv" in refused(tmp_path / "picture.jpg")
    (tmp_path / "zip.csv").write_bytes(b"PK\x03\x04rest")
    assert "named like text but is a ZIP" in refused(tmp_path / "zip.csv")


@pytest.mark.slow
def test_gyroscope_in_degrees_declared_as_radians(tmp_path: Path, hand: Recording) -> None:
    path = tmp_path / "log.csv"
    write_csv(Recording(hand.t, np.degrees(hand.gyr), hand.acc), path)
    said = read(path)
    np.testing.assert_allclose(said.gyr, hand.gyr, rtol=1e-14)
    assert any("a guess against the header, which has rad/s" in note for note in said.meta["notes"])
    taken = read(path, units={"gyr": "rad/s"})  # the user outranks the numbers
    np.testing.assert_array_equal(taken.gyr, np.degrees(hand.gyr))
    assert any("by the hint; a warning: its numbers look like deg/s" in note for note in taken.meta["notes"])
    np.testing.assert_allclose(read(path, units={"gyr": "deg/s"}).gyr, hand.gyr, rtol=1e-14)
    slow = Recording(hand.t, np.degrees(hand.gyr) / 2, hand.acc)  # never beyond 100: gravity has to tell
    write_csv(slow, path)
    assert any("gravity turns" in note for note in read(path).meta["notes"])


def test_gyroscope_in_radians_declared_as_degrees(tmp_path: Path, hand: Recording) -> None:
    path = tmp_path / "log.csv"
    write_csv(hand, path)
    taken = read(path, units={"gyr": "deg/s"})
    np.testing.assert_allclose(taken.gyr, np.radians(hand.gyr), rtol=1e-14)
    assert any("a warning: its numbers look like rad/s" in note for note in taken.meta["notes"])


def test_the_accelerometers_unit_is_taken_from_the_user(tmp_path: Path, hand: Recording) -> None:
    path = tmp_path / "log.csv"
    write_csv(hand, path)
    taken = read(path, units={"acc": "g"})
    np.testing.assert_allclose(taken.acc, hand.acc * 9.80665, rtol=1e-14)
    assert any("a warning: its numbers look like m/s²" in note for note in taken.meta["notes"])


@pytest.mark.parametrize("parts", ["gyr acc", "gyr acc mag", "all"])
def test_written_csv_reads_back_to_the_bit(tmp_path: Path, hand: Recording, parts: str) -> None:
    gyr = hand.gyr.copy()
    gyr[7] = np.nan
    truth = hand.truth if parts == "all" else None
    recording = Recording(hand.t, gyr, hand.acc, hand.mag if parts != "gyr acc" else None, truth)
    write_csv(recording, tmp_path / "log.csv")
    assert os.listdir(tmp_path) == ["log.csv"]
    back = read(tmp_path / "log.csv")
    same(back, recording)


def same(back: Recording, recording: Recording) -> None:
    for name in ("t", "gyr", "acc", "mag"):
        ours, theirs = getattr(back, name), getattr(recording, name)
        assert (ours is None) == (theirs is None)
        assert ours is None or ours.tobytes() == theirs.tobytes()
    assert (back.truth is None) == (recording.truth is None)
    if back.truth is not None and recording.truth is not None:
        np.testing.assert_allclose(
            back.truth.quat, recording.truth.quat, rtol=0, atol=2.3e-16
        )  # Truth normalises again
        assert back.truth.north == recording.truth.north
        np.testing.assert_array_equal(back.truth.moving, recording.truth.moving)


@pytest.mark.slow
def test_big_files_read_the_same_with_and_without_pyarrow(
    tmp_path: Path, hand: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    gyr = hand.gyr.copy()
    gyr[3, 1] = np.nan
    path = tmp_path / "log.csv"
    write_csv(Recording(hand.t, gyr, hand.acc, hand.mag), path)
    plain = read(path)
    monkeypatch.setattr(text, "_BLOCK", 777)  # lines straddle blocks
    same(read(path), plain)
    monkeypatch.setattr(text, "BIG", 0)
    same(read(path), plain)
    lines = path.read_text().splitlines()
    lines[1500] = lines[1500].replace(",", ",abc", 1)
    path.write_text("\n".join(lines))
    torn = Recording(*(np.delete(getattr(plain, one), 1499, axis=0) for one in ("t", "gyr", "acc", "mag")))
    path.write_text("\n".join(lines))
    recording = read(path)
    same(recording, torn)
    assert any("1 line was torn" in note and "line 1501" in note for note in recording.meta["notes"])
    for i in range(0, 1600, 20):
        lines[i + 1] = lines[i + 1].replace(",", ",abc", 1)
    path.write_text("\n".join(lines))
    assert "line 2, column 'gyr_x [rad/s]': 'abc" in refused(path)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert "line 2, column" in refused(path)


@pytest.mark.slow
def test_small_csv_imports_nothing_heavy(tmp_path: Path) -> None:
    path = log(tmp_path, HEADER, *ROWS)
    code = (
        f"import sys; from levelhead.sources import read; read({str(path)!r}); "
        "print([m for m in ('scipy', 'h5py', 'pyarrow', 'numba') if m in sys.modules])"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )


@pytest.mark.parametrize(
    ("name", "start", "step", "unit"),
    [("t", 0, 0.01, "s"), ("time", 0, 10, "ms"), ("t", 5, 10_000, "us"), ("stamp_ns", 10**18, 10**7, "ns"),
     ("timestamp", 1_700_000_000_000, 10, "ms"), ("timestamp", 1.7e9, 0.01, "s")],
)  # fmt: skip
def test_units_of_time(tmp_path: Path, name: str, start: float, step: float, unit: str) -> None:
    lines = [HEADER.replace("t [s]", name), *(f"{start + i * step},{ROWS[0][5:]}" for i in range(50))]
    recording = read(log(tmp_path, *lines))
    np.testing.assert_allclose(np.diff(recording.t), 0.01, rtol=1e-4)
    assert recording.meta["units"]["t"] == unit
    assert ("t0" in recording.meta) == (start > 1e6)


GYR = [("rad/s", 1.0), ("deg/s", np.pi / 180), ("mdps", np.pi / 180e3)]
ACC = [("m/s²", 1.0), ("g", 9.80665), ("mg", 9.80665e-3)]
MAG = [("µT", 1.0), ("nT", 1e-3), ("G", 100.0)]


@pytest.mark.slow
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from([",", ";", "\t"]), st.sampled_from(GYR), st.sampled_from(ACC), st.sampled_from(MAG),
    st.sampled_from(["gyr_{a}", "Gyroscope {A}", "w{a}", "angular_velocity.{a}", "gyro{A}"]),
    st.booleans(), st.booleans(),
)  # fmt: skip
def test_round_trip_through_many_spellings(
    tmp_path: Path,
    hand: Recording,
    delimiter: str,
    gyr: tuple,
    acc: tuple,
    mag: tuple,
    name: str,
    comma: bool,
    said: bool,
) -> None:
    said |= gyr[0] == "mdps"
    names = ["time"]
    for stem, unit in ((name, gyr[0]), ("acc_{a}", acc[0]), ("m{a}", mag[0])):
        names += [stem.format(a=a, A=a.upper()) + (f" ({unit})" if said else "") for a in "xyz"]
    assert hand.mag is not None
    table = np.hstack([hand.t[:, None], hand.gyr / gyr[1], hand.acc / acc[1], hand.mag / mag[1]])[:1000]
    rows = [delimiter.join(map(repr, row)) for row in table.tolist()]
    if comma and delimiter != ",":
        rows = [row.replace(".", ",") for row in rows]
    recording = read(log(tmp_path, delimiter.join(names), *rows))
    np.testing.assert_allclose(recording.gyr, hand.gyr[:1000], rtol=1e-12)
    np.testing.assert_allclose(recording.acc, hand.acc[:1000], rtol=1e-12)
    np.testing.assert_allclose(recording.mag, hand.mag[:1000], rtol=1e-12)


HEADERS = [HEADER, "t,gx,gy,gz,ax,ay,az", "time_ms,gyr,,,acc,,\n,x,y,z,x,y,z", "t,gx,gy,gz,ax,ay,az,qw,qx,qy,qz"]
ODD = ["", "nan", "x", "1,5", '"', "#", "\u0660", "1e308", "-1e308", "0"]
CELL = st.one_of(
    st.floats().map(repr), st.integers().map(str), st.sampled_from(ODD)
)  # fmt: skip


def survives(path: Path) -> None:
    try:
        assert isinstance(read(path), Recording)
    except LevelheadError as error:
        assert "\n" not in str(error) and len(str(error)) < 1000


@pytest.mark.slow
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@example(b"\x1c")  # a line of a blank that ends lines
@given(st.one_of(st.binary(max_size=300), st.text(max_size=300).map(lambda s: s.encode("utf-8", "surrogatepass"))))
def test_any_bytes_give_a_recording_or_a_sentence(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(content)
    survives(path)


@pytest.mark.slow
@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from(HEADERS), st.lists(st.lists(CELL, min_size=6, max_size=8), max_size=12),
    st.booleans(), st.sampled_from([",", ";"]), st.booleans(),
)  # fmt: skip
def test_any_table_gives_a_recording_or_a_sentence(
    tmp_path: Path, header: str, rows: list[list[str]], count: bool, delimiter: str, good: bool
) -> None:
    base = ["0.1", "0.1", "0.1", "0.1", "0.1", "9.81"]
    lines = [[str(i), *(base if good and i % 3 else row[1:])] if count else row for i, row in enumerate(rows)]
    path = log(tmp_path, header.replace(",", delimiter), *(delimiter.join(line) for line in lines))
    survives(path)


def test_a_stamp_of_a_terminal_behind_another_word_is_no_stamp(tmp_path):
    """It was found in the middle of a line, and then missed at its start: a StopIteration in place of a sentence."""
    line = "I/imu 12:30:15.{:03d} -> 0.01,0.02,0.03,0.1,0.2,9.8\n"
    (tmp_path / "log.csv").write_text("".join(line.format(10 * k) for k in range(90)), encoding="utf-8")
    with pytest.raises(LevelheadError, match="no header that names its 6 columns"):
        read(tmp_path / "log.csv")
