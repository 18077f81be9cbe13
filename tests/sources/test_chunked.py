"""Logs in chunks: the recordings of ``read`` in pieces, to the bit, or a sentence."""

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
import pytest

import levelhead as lh
from levelhead.errors import LevelheadError
from levelhead.sources import chunked

N = 3000


def columns(**changes):
    motion = lh.simulate.recording("ICM-20948", "hand", duration=N / 100, rate=100.0, seed=5)
    made = {"time [s]": motion.t[:N]}
    made |= {f"gyr_{a} [deg/s]": np.round(np.degrees(motion.gyr[:N, i]), 4) for i, a in enumerate("xyz")}
    made |= {f"acc_{a} [g]": np.round(motion.acc[:N, i] / 9.80665, 5) for i, a in enumerate("xyz")}
    made |= {f"mag_{a} [uT]": np.round(motion.mag[:N, i], 2) for i, a in enumerate("xyz")}
    return made | changes


def without(names, made):
    return {name: values for name, values in made.items() if name not in names}


STAMPS_NS = 1_700_000_000_000_000_000 + np.arange(N) * 10_000_123
LOGS = {
    "seconds": (columns(), {}),
    "milliseconds": (without(["time [s]"], {"time_ms": np.arange(N) * 10} | columns()), {}),
    "nanoseconds since 1970": (without(["time [s]"], {"t [ns]": STAMPS_NS} | columns()), {}),
    "no stamps": (without(["time [s]"], columns()), {"rate": 104.0}),
    "no magnetometer": (columns(), {"map": {"mag": []}}),
    "counts": (
        {"t": np.arange(N) * 0.01}
        | {name.partition(" ")[0]: np.round(values * (131 if "gyr" in name else 16384))
           for name, values in columns().items() if name.startswith(("gyr", "acc"))},
        {"counts": {"gyr": "131/deg/s", "acc": "16384/g"}},
    ),
    "missing readings": (
        columns(**{"gyr_x [deg/s]": np.where(np.arange(N) % 7 == 3, np.nan, columns()["gyr_x [deg/s]"])}), {},
    ),
}  # fmt: skip


def write(made, path):
    table = pa.table({name: pa.array(values, from_pandas=True) for name, values in made.items()})
    if path.suffix == ".csv":
        pa_csv.write_csv(table, path)
    else:
        pq.write_table(table, path, row_group_size=1111)
    return path


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
@pytest.mark.parametrize("name", LOGS)
def test_chunks_are_the_recording(name, suffix, tmp_path, monkeypatch):
    made, hints = LOGS[name]
    path = write(made, tmp_path / f"log{suffix}")
    monkeypatch.setattr(chunked, "HEAD", 900)
    monkeypatch.setattr(chunked, "HEAD_BYTES", 60_000)
    whole = lh.read(path, **hints)
    parts = list(lh.read_chunks(path, rows=700, **hints))
    assert [len(part) for part in parts] == [700, 700, 700, 700, 200]
    for field in ("t", "gyr", "acc", "mag"):
        expected = getattr(whole, field)
        if expected is None:
            assert all(getattr(part, field) is None for part in parts)
        else:
            assert np.array_equal(np.concatenate([getattr(part, field) for part in parts]), expected, equal_nan=True)


def test_how_far_it_is(tmp_path):
    chunks = lh.read_chunks(write(columns(), tmp_path / "log.parquet"), rows=1000)
    seen = []
    for _ in chunks:
        seen.append(chunks.fraction)
    assert seen[0] == 0.0 and 0.0 < chunks.fraction == 1.0 and seen == sorted(seen)


def test_a_clock_that_steps_back_late_is_refused_with_the_row(tmp_path, monkeypatch):
    monkeypatch.setattr(chunked, "HEAD", 900)
    t = np.arange(N) * 0.01
    t[2100:] -= 5.0
    path = write(columns(**{"time [s]": t}), tmp_path / "log.parquet")
    with pytest.raises(LevelheadError, match=r"time does not increase at row 2100; levelhead.read reads it whole"):
        list(lh.read_chunks(path, rows=700))
    with pytest.raises(LevelheadError, match=r"rows from 2000: t does not increase at row 100.*reads it whole"):
        list(lh.read_chunks(path, rows=1000))


def test_a_log_that_must_be_seen_whole_is_refused(tmp_path):
    twice = columns(**{"time [s]": np.repeat(np.arange(N // 2) * 0.02, 2)})  # a clock that read spreads
    with pytest.raises(LevelheadError, match="cannot be read in chunks.*reads it whole"):
        lh.read_chunks(write(twice, tmp_path / "log.parquet"))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("nowhere.csv", None, "there is no file"),
        ("log.mat", b"x", "cannot be read in chunks; expected one of .parquet"),
        ("log.parquet", b"PAR1 but not really", "not a Parquet file, or it is damaged"),
        ("log.csv", b"", "empty"),
        ("log.csv", b"a,b\n1,2\n", "no gyroscope"),
    ],
)
def test_bad_files(name, content, words, tmp_path):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(LevelheadError, match=words):
        list(lh.read_chunks(tmp_path / name))
