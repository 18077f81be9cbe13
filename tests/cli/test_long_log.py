"""A long log is fused in chunks: the same track, and a summary."""

import numpy as np
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
import pytest
from tests.reference.long_log import N, write_long_log

import levelhead as lh
from levelhead.sources import chunked
from levelhead.sources.formats.csv_writer import write_csv

pytest.importorskip("pyarrow")


@pytest.fixture
def log(tmp_path, monkeypatch):
    return write_long_log(tmp_path, monkeypatch)


def columns(path):
    table = pq.read_table(path) if path.suffix == ".parquet" else pa_csv.read_csv(path)
    return {name: table[name].to_numpy() for name in table.column_names}


@pytest.mark.slow
@pytest.mark.parametrize(
    "more",
    [(), ("--filter", "Mahony", "--no-first-pass", "--map", "mag=mag", "--declination", "3"), ("--guard", "off")],
)
def test_the_track_of_one_piece(levelhead, log, tmp_path, more, monkeypatch):
    kind = ("--format", "parquet", "--no-plot")
    said = levelhead("fuse", log, "-o", tmp_path / "long", *kind, *more)
    assert said.code == 0 and f"{N:,} samples" in said.out and "in chunks" in said.out
    monkeypatch.setattr(chunked, "LONG_ROWS", 10_000)
    assert levelhead("fuse", log, "-o", tmp_path / "whole", *kind, *more).code == 0
    long, whole = (columns(tmp_path / name / "log-track.parquet") for name in ("long", "whole"))
    assert list(long) == list(whole)
    assert all(np.array_equal(long[name], whole[name]) for name in whole)


@pytest.mark.slow
@pytest.mark.parametrize("more", [(), ("--map", "mag=mag", "--declination", "3"), ("--guard", "off")])
def test_the_smoothed_track_of_one_piece(levelhead, log, tmp_path, more, monkeypatch):
    kind = ("--format", "parquet", "--no-plot")
    said = levelhead("smooth", log, "-o", tmp_path / "long", *kind, *more)
    assert said.code == 0 and f"{N:,} samples" in said.out and "in chunks" in said.out
    monkeypatch.setattr(chunked, "LONG_ROWS", 10_000)
    assert levelhead("smooth", log, "-o", tmp_path / "whole", *kind, *more).code == 0
    long, whole = (columns(tmp_path / name / "log-track.parquet") for name in ("long", "whole"))
    assert list(long) == list(whole)
    assert all(np.array_equal(long[name], whole[name]) for name in whole)


@pytest.mark.slow
def test_csv_to_csv_with_calibration_and_json(levelhead, log, tmp_path, monkeypatch):
    write_csv(lh.read(log), tmp_path / "text.csv")
    words = ("fuse", tmp_path / "text.csv", "--json", "--no-plot")
    long = levelhead(*words, "-o", tmp_path / "long", "--save-calibration", tmp_path / "long.json").json
    monkeypatch.setattr(chunked, "LONG_BYTES", 10**9)
    whole = levelhead(*words, "-o", tmp_path / "whole", "--save-calibration", tmp_path / "whole.json").json
    assert (tmp_path / "long.json").read_text() == (tmp_path / "whole.json").read_text()
    for key in ("samples", "duration_s", "rate_hz", "filter", "bias_rad_s", "calibration", "at_rest", "health"):
        assert long[key] == whole[key], key
    one, other = (columns(tmp_path / name / "text-track.csv") for name in ("long", "whole"))
    assert all(np.array_equal(one[name], other[name]) for name in ("t [s]", "qw", "qx", "qy", "qz", "health"))


def test_a_log_that_needs_to_be_seen_whole_is_read_whole(levelhead, log, tmp_path):
    table = pq.read_table(log)
    again = np.concatenate([np.arange(1000), np.arange(500)]) * 0.01  # a clock that begins again
    pq.write_table(table.set_column(0, table.column_names[0], [again]), log)
    said = levelhead("fuse", log, "-o", tmp_path / "out", "--no-plot")
    assert said.code == 0 and "1000 samples" in said.out.replace(",", "") and "in chunks" not in said.out


def test_a_failure_on_the_way_leaves_nothing(levelhead, log, tmp_path, monkeypatch):
    monkeypatch.setattr(chunked, "HEAD", 900)
    table = pq.read_table(log)
    t = table[table.column_names[0]].to_numpy().copy()
    t[1200:] -= 5.0
    pq.write_table(table.set_column(0, table.column_names[0], [t]), log)
    said = levelhead("fuse", log, "-o", tmp_path / "out", "--no-plot")
    assert said.code == 2 and said.err.count("\n") == 2 and "time does not increase at row 1200" in said.err
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize("verb", ["fuse", "smooth"])
@pytest.mark.parametrize("length", ["long", "short"])
def test_output_rate_leaves_rows_out_and_changes_none(levelhead, log, tmp_path, monkeypatch, verb, length):
    if length == "short":
        monkeypatch.setattr(chunked, "LONG_ROWS", 10_000)
    words = (verb, log, "--format", "parquet", "--no-plot", "--json")
    whole = levelhead(*words, "-o", tmp_path / "whole").json
    said = levelhead(*words, "-o", tmp_path / "some", "--output-rate", "12").json  # not a divisor of 100 Hz
    assert said["rows"] == 180 and whole["rows"] == N
    for key in ("samples", "duration_s", "end", "bias_rad_s", "calibration", "at_rest", "health"):
        assert said[key] == whole[key], key
    every, some = (columns(tmp_path / name / "log-track.parquet") for name in ("whole", "some"))
    t = np.round(every["t [s]"], 6)
    wanted = [int(np.flatnonzero(t >= k / 12 - 1e-9)[0]) for k in range(180)]  # the first sample of each twelfth
    assert wanted[:4] == [0, 9, 17, 25]
    for name, values in every.items():
        assert np.array_equal(values[wanted], some[name]), name


@pytest.mark.parametrize(("rate", "rows"), [(0.01, 1), (0.5, 8), (100, N), (1e6, N)])
def test_output_rates_far_from_the_logs(levelhead, log, tmp_path, rate, rows):
    said = levelhead("fuse", log, "--format", "parquet", "-o", tmp_path / "out", "--output-rate", rate)
    assert said.code == 0 and f"rows       {rows:,} written" in said.out
    assert len(columns(tmp_path / "out" / "log-track.parquet")["health"]) == rows


@pytest.mark.parametrize("rate", ["0", "-1", "nan", "inf"])
def test_output_rate_that_is_none(refused, log, tmp_path, rate):
    assert "must be a number of rows a second above 0" in refused("fuse", log, "-o", tmp_path, "--output-rate", rate)


def test_the_end_is_relative_to_true_north(levelhead, log, tmp_path, monkeypatch):
    words = ("fuse", log, "--format", "parquet", "--map", "mag=mag", "--declination", "3", "--json", "--no-plot")
    long = levelhead(*words, "-o", tmp_path / "long").json
    monkeypatch.setattr(chunked, "LONG_ROWS", 10_000)
    whole = levelhead(*words, "-o", tmp_path / "whole").json
    assert long["end"]["quat_wxyz"] == whole["end"]["quat_wxyz"]
