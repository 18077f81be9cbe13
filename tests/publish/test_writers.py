"""Tracks as files: what is written reads back, and a failure leaves nothing half-written."""

import subprocess
import sys
import time

import numpy as np
import pytest

from levelhead.errors import LevelheadError
from levelhead.filters import Kalman
from levelhead.publish import write_track, writers
from levelhead.track import Track

NAMES = ["t [s]", "qw", "qx", "qy", "qz", "roll [deg]", "pitch [deg]", "yaw [deg]"]
BIAS = ["bias_x [rad/s]", "bias_y [rad/s]", "bias_z [rad/s]"]
SIGMA = ["sigma_east [rad]", "sigma_north [rad]", "sigma_up [rad]"]


def some_track(n: int, full: bool = True) -> Track:
    rng = np.random.default_rng(n)
    quat = rng.standard_normal((n, 4))
    quat /= np.linalg.norm(quat, axis=1)[:, None]
    t = 1.7e9 + np.cumsum(rng.uniform(0.001, 0.02, n))  # seconds since 1970 need all their digits
    if not full:
        return Track(t, quat)
    health = rng.integers(0, 32, n).astype(np.uint32)
    return Track(t, quat, 1e-3 * rng.standard_normal((n, 3)), rng.uniform(0, 0.1, (n, 3)), health, Kalman())


def read_csv(path) -> tuple[list[str], np.ndarray]:
    with path.open(encoding="utf-8") as file:
        names = file.readline().rstrip("\n").split(",")
        return names, np.loadtxt(file, delimiter=",", ndmin=2)


def check(track: Track, names: list[str], values: np.ndarray, digits: float) -> None:
    column = dict(zip(names, values.T, strict=True))
    np.testing.assert_array_equal(column["t [s]"], track.t)
    np.testing.assert_array_equal(np.stack([column[n] for n in NAMES[1:5]], axis=1), track.quat)
    np.testing.assert_allclose(np.stack([column[n] for n in NAMES[5:]], axis=1), track.euler(), atol=5.01e-7)
    if track.bias is not None and track.sigma is not None:
        np.testing.assert_allclose(np.stack([column[n] for n in BIAS], axis=1), track.bias, rtol=digits)
        np.testing.assert_allclose(np.stack([column[n] for n in SIGMA], axis=1), track.sigma, rtol=digits)
    np.testing.assert_array_equal(column["health"], track.health)


@pytest.mark.parametrize("n", [1, 777])
def test_csv_reads_back_to_the_bit(tmp_path, n):
    track = some_track(n)
    write_track(track, tmp_path / "track.csv")
    names, values = read_csv(tmp_path / "track.csv")
    assert names == [*NAMES, *BIAS, *SIGMA, "health"]
    check(track, names, values, 1e-8)


def test_values_that_stay_for_many_rows_are_written_as_any_others(tmp_path):
    """Bias and σ as text, each row for itself: repeated, changed in one column, −0 after 0, missing."""
    bias = np.zeros((9, 3))
    bias[3:, 1], bias[5:, 2], bias[7:] = 1 / 3, -0.0, np.nan
    sigma = np.full((9, 3), 0.1)
    sigma[4, 0] = 1e-300
    track = Track(np.arange(9.0), np.tile([1.0, 0.0, 0.0, 0.0], (9, 1)), bias, sigma)
    write_track(track, tmp_path / "track.csv")
    lines = (tmp_path / "track.csv").read_text().splitlines()[1:]
    wanted = [[f"{value:.9g}" for value in (*b, *s)] for b, s in zip(bias, sigma, strict=True)]
    assert [line.split(",")[8:14] for line in lines] == wanted and wanted[5][2] == "-0"


def test_absent_estimates_have_no_columns(tmp_path):
    write_track(some_track(5, full=False), tmp_path / "track.CSV")
    names, values = read_csv(tmp_path / "track.CSV")
    assert names == [*NAMES, "health"]
    assert (values[:, -1] == 0).all()


def test_large_csv_has_the_same_columns_and_values(tmp_path, monkeypatch):
    pytest.importorskip("pyarrow")
    monkeypatch.setattr(writers, "MIN_ARROW_ROWS", 100)
    monkeypatch.setattr(writers, "CHUNK", 64)
    track = some_track(300)
    write_track(track, tmp_path / "large.csv")
    names, values = read_csv(tmp_path / "large.csv")
    assert names == [*NAMES, *BIAS, *SIGMA, "health"]
    check(track, names, values, 0.0)


def test_chunks_join_without_a_seam(tmp_path, monkeypatch):
    track = some_track(300)
    write_track(track, tmp_path / "whole.csv")
    monkeypatch.setattr(writers, "CHUNK", 7)
    write_track(track, tmp_path / "chunks.csv")
    assert (tmp_path / "whole.csv").read_bytes() == (tmp_path / "chunks.csv").read_bytes()


def test_parquet_keeps_every_bit_and_the_filter(tmp_path, monkeypatch):
    parquet = pytest.importorskip("pyarrow.parquet")
    monkeypatch.setattr(writers, "CHUNK", 100)
    track = some_track(250)
    write_track(track, tmp_path / "track.parquet")
    table = parquet.read_table(tmp_path / "track.parquet")
    assert table.column_names == [*NAMES, *BIAS, *SIGMA, "health"]
    assert str(table.schema.field("health").type) == "uint32"
    assert table.schema.metadata[b"filter"] == b"Kalman"
    check(track, table.column_names, np.stack([c.to_numpy() for c in table.columns], axis=1), 0.0)


@pytest.mark.slow
def test_a_minute_at_100_hz_is_written_at_once(tmp_path):
    track = some_track(6000)
    seconds = []
    for _ in range(5):
        began = time.thread_time()
        write_track(track, tmp_path / "track.csv")
        seconds.append(time.thread_time() - began)
    assert min(seconds) < 0.15  # about 0.03 s on an idle machine


def test_a_failure_leaves_what_was_there_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "track.csv"
    path.write_text("precious")
    chunks = writers._chunks

    def breaks(track: Track, report, more):
        yield next(chunks(track, report, more))
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writers, "_chunks", breaks)
    with pytest.raises(LevelheadError, match="No space left on device"):
        write_track(some_track(10), path)
    assert path.read_text() == "precious"
    assert list(tmp_path.iterdir()) == [path]


def test_wrong_paths_are_refused(tmp_path, monkeypatch):
    track = some_track(3)
    with pytest.raises(LevelheadError, match=r"ends in '\.cvs'; did you mean '\.csv'"):
        write_track(track, tmp_path / "track.cvs")
    with pytest.raises(LevelheadError, match="no folder"):
        write_track(track, tmp_path / "missing" / "track.csv")
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(LevelheadError, match=r"levelhead\[formats\]"):
        write_track(track, tmp_path / "track.parquet")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_nothing_heavy_is_imported_for_a_small_csv(tmp_path):
    code = (
        "import sys, numpy as np, levelhead.publish as p, levelhead.publish.plots\n"
        "from levelhead.track import Track\n"
        f"p.write_track(Track([0.0], [[1.0, 0, 0, 0]]), {str(tmp_path / 'x.csv')!r})\n"
        "print([m for m in ('pyarrow', 'matplotlib', 'rich', 'scipy', 'numba') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_parquet_says_which_north(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    track = some_track(3)
    for name, one, north in (("m", track, b"y magnetic north"), ("t", track.to_true_north(3.5), b"y true north")):
        write_track(one, tmp_path / f"{name}.parquet")
        assert north in parquet.read_schema(tmp_path / f"{name}.parquet").metadata[b"orientation"]
