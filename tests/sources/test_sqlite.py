"""Databases of SQLite: one table for all sensors or one for each, with other tables beside them."""

import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from levelhead.errors import LevelheadError
from levelhead.recording import Recording
from levelhead.sources import read


def fill(path: Path, tables: dict[str, tuple[str, list[tuple[object, ...]]]]) -> None:
    with closing(sqlite3.connect(path)) as database:
        for name, (titles, rows) in tables.items():
            database.execute(f'CREATE TABLE "{name}" ({titles})')
            database.executemany(f'INSERT INTO "{name}" VALUES ({",".join("?" * len(rows[0]))})', rows)
        database.commit()


def check(path: Path, hand: Recording) -> None:
    recording = read(path)
    np.testing.assert_array_equal(recording.gyr, hand.gyr)
    np.testing.assert_array_equal(recording.acc, hand.acc)
    np.testing.assert_allclose(recording.t - recording.t[0], hand.t - hand.t[0], atol=1e-5)


def test_one_table(tmp_path: Path, hand: Recording) -> None:
    stamps = [datetime.fromtimestamp(1.7e9 + t, UTC).isoformat(" ", "microseconds")[:26] for t in hand.t]
    rows = [(k, stamp, *acc, *gyr, "walk") for k, (stamp, acc, gyr) in
            enumerate(zip(stamps, hand.acc.tolist(), hand.gyr.tolist(), strict=True))]  # fmt: skip
    titles = "id INTEGER PRIMARY KEY, stamp TEXT, ax, ay, az, gx, gy, gz, label TEXT"
    fill(tmp_path / "log.db", {"meta": ("key, value", [("device", "pi")]), "imu": (titles, rows)})
    check(tmp_path / "log.db", hand)


def test_a_table_for_each_sensor(tmp_path: Path, hand: Recording) -> None:
    times = np.rint(1e9 * hand.t).astype(int).tolist()
    sensors = {"accelerometer": hand.acc.tolist(), "gyroscope": hand.gyr.tolist()}
    fill(tmp_path / "log.sqlite", {
        name: ("timestamp INTEGER, x REAL, y REAL, z REAL", [(t, *row) for t, row in zip(times, values, strict=True)])
        for name, values in sensors.items()
    })  # fmt: skip
    check(tmp_path / "log.sqlite", hand)


@pytest.mark.parametrize(("content", "sentence"), [(b"no database", "is not an SQLite database"), (b"", "is empty")])
def test_other_files_are_refused(tmp_path: Path, content: bytes, sentence: str) -> None:
    (tmp_path / "log.db").write_bytes(content)
    with pytest.raises(LevelheadError, match=sentence):
        read(tmp_path / "log.db")


def test_a_database_without_samples(tmp_path: Path) -> None:
    fill(tmp_path / "log.db", {"meta": ("key, value", [("device", "pi")])})
    with pytest.raises(LevelheadError, match="no table with columns of numbers"):
        read(tmp_path / "log.db")
    assert (tmp_path / "log.db").stat().st_size > 0
