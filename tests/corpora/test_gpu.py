"""A corpus on a GPU, run in numba-cuda's simulator: the rows of plain Python."""

import importlib.util

import pytest
from tests.engine.test_cuda import simulate

import levelhead as lh
from levelhead.errors import LevelheadError
from levelhead.sources.formats.csv_writer import write_csv

numba_cuda = pytest.mark.skipif(importlib.util.find_spec("numba_cuda") is None, reason="numba-cuda is not installed")

ROWS = """
import levelhead as lh

def rows(engine, out, *methods):
    table = lh.corpus({folder!r}, "fuse", *methods, engine=engine, workers=0, out=out, tracks=True)
    return table.drop_columns(["read_s", "run_s", "parameters"])

made, real = (rows(engine, {folder!r} + "-" + engine, "Mahony", "Complementary") for engine in ("cuda", "python"))
assert made.equals(real), (made.to_pylist(), real.to_pylist())
assert made["error"].null_count == 6 and made.num_rows == 7, made["error"]
"""
TUNED = """
import levelhead as lh

tuned = [
    lh.tune_corpus({folder!r}, "Complementary", ["tau"], metric="tilt", engine=engine, workers=0, runs=3)
    for engine in ("cuda", "auto")
]
one, other = (found.tuning.file() for found in tuned)
assert abs(one.params.tau / other.params.tau - 1.0) < 1e-6, (one, other)
"""


def write(folder, samples, rate=100.0):
    folder.mkdir()
    for i in range(3):
        made = lh.simulate.recording("MPU-6050", "hand", duration=1.0 + samples / rate, rate=rate, seed=i)
        write_csv(made[: samples + i], folder / f"{i}.csv")
    return folder


@numba_cuda
@pytest.mark.slow
def test_rows_and_tracks_are_those_of_plain_python(tmp_path):
    folder = write(tmp_path / "recordings", 30)
    (folder / "broken.csv").write_text("this is no recording\n")
    simulate(ROWS.format(folder=str(folder)))
    tracks = {path.name: path.read_bytes() for path in (tmp_path / "recordings-cuda" / "tracks").rglob("*.parquet")}
    assert len(tracks) == 6
    for path in (tmp_path / "recordings-python" / "tracks").rglob("*.parquet"):
        assert tracks[path.name] == path.read_bytes()


@pytest.mark.parametrize(
    ("verb", "options", "words"),
    [
        ("smooth", {}, "the engine 'cuda' is for 'fuse', a thread for each recording, not for 'smooth'"),
        ("fuse", {"sensor": "([0-9])"}, "not for recordings that start with another's calibration"),
    ],
)
def test_wrong_wishes(tmp_path, monkeypatch, verb, options, words):
    monkeypatch.setattr("levelhead.compiler.gpu.require_gpu", lambda: None)
    with pytest.raises(LevelheadError, match="^" + words if verb == "smooth" else words):
        lh.corpus(tmp_path, verb, engine="cuda", **options)


def test_an_engine_that_is_none_is_said_before_anything_is_read(tmp_path):
    with pytest.raises(LevelheadError, match="there is no engine 'gpu'"):
        lh.corpus(tmp_path / "nowhere", engine="gpu")


def test_without_a_gpu_it_is_a_sentence_and_nothing_is_made(tmp_path, monkeypatch):
    real = importlib.util.find_spec
    monkeypatch.setattr(
        "importlib.util.find_spec", lambda name, *rest: None if name == "numba_cuda" else real(name, *rest)
    )
    with pytest.raises(LevelheadError, match="needs numba-cuda and NVIDIA's compiler: pip install"):
        lh.corpus(tmp_path, out=tmp_path / "out", engine="cuda")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.full
@numba_cuda
@pytest.mark.slow
def test_a_tuning_is_that_of_the_processor(tmp_path):
    simulate(TUNED.format(folder=str(write(tmp_path / "recordings", 120, rate=10.0))))
