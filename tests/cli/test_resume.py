"""A long run that was ended goes on where it was, and gives the bytes of one that was not."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest
from tests.reference.long_log import N, write_long_log

from levelhead.cli import resume
from levelhead.engine import column_files, smoothing
from levelhead.engine.chunks import ChunkRun
from levelhead.engine.column_files import ColumnFiles
from levelhead.publish import writers

pytest.importorskip("pyarrow")
VERBS = ("fuse", "smooth")


class Ended(BaseException):
    """In place of kill -9, in this process."""


@pytest.fixture
def log(tmp_path, monkeypatch):
    return write_long_log(tmp_path, monkeypatch)


@pytest.fixture
def often(monkeypatch):
    """A state is kept after every chunk."""
    monkeypatch.setattr(resume, "EVERY", 0.0)
    monkeypatch.setattr(smoothing, "MOST_BLOCKS", 4)


@pytest.fixture
def ended(levelhead, monkeypatch, capsys):
    """Runs until a method was called so often, and is about to be called once more."""

    def run(place, *words):
        (owner, name, after), calls = place, []
        whole = getattr(owner, name)

        def ending(*arguments, **options):
            calls.append(name)
            if len(calls) > after:
                raise Ended
            return whole(*arguments, **options)

        with monkeypatch.context() as patch, pytest.raises(Ended):
            patch.setattr(owner, name, ending)
            levelhead(*words)
        return capsys.readouterr().err

    return run


PLACES = {
    "fuse": [(ChunkRun, "track", 2), (ColumnFiles, "append", 1), (writers, "_arrow", 1)],
    "smooth": [
        (ColumnFiles, "append", 2),
        (smoothing.Smoother, "run_forward", 1),
        (smoothing.Smoother, "run_forward", 7),
        (smoothing.Smoother, "back", 0),
        (smoothing.Smoother, "back", 3),
        (writers, "_arrow", 1),
    ],
}


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["parquet", pytest.param("csv", marks=pytest.mark.slow)])
@pytest.mark.parametrize("verb", VERBS)
def test_ended_anywhere_it_gives_the_same_bytes(levelhead, log, tmp_path, ended, often, verb, suffix):
    words = (verb, log, "--format", suffix, "--no-plot", "--save-calibration")
    assert levelhead(*words, tmp_path / "one.json", "-o", tmp_path / "one").code == 0
    again = (*words, tmp_path / "two.json", "-o", tmp_path / "two")
    for place in PLACES[verb]:
        assert "results so far are in" in ended(place, *again)
        assert [path.name for path in (tmp_path / "two").iterdir()] == [f".log-track.{suffix}.unfinished"]
    said = levelhead(*again)
    assert said.code == 0 and "continues after" in said.err and f"{N:,} samples" in said.out
    name = f"log-track.{suffix}"
    assert [path.name for path in (tmp_path / "two").iterdir()] == [name]
    assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()


def test_what_is_done_is_not_done_again(levelhead, log, tmp_path, monkeypatch, ended, often):
    words = ("fuse", log, "--format", "parquet", "-o", tmp_path / "out")
    ended((ChunkRun, "track", 2), *words)
    seen = []
    whole = ChunkRun.track
    monkeypatch.setattr(ChunkRun, "track", lambda run, chunk: seen.append(len(chunk)) or whole(run, chunk))
    said = levelhead(*words)
    assert said.code == 0 and "continues after 800 samples" in said.err and seen == [400, N - 1200]


@pytest.mark.slow
@pytest.mark.parametrize("place", [(ChunkRun, "track", 2), (writers, "_arrow", 0)])
def test_at_a_lower_output_rate_too(levelhead, log, tmp_path, ended, often, place):
    words = ("fuse", log, "--format", "parquet", "--json", "--output-rate", "12", "-o")
    one = levelhead(*words, tmp_path / "one").json
    ended(place, *words, tmp_path / "two")
    two = levelhead(*words, tmp_path / "two").json
    assert {**one, "written": ""} == {**two, "written": ""}
    assert (tmp_path / "one/log-track.parquet").read_bytes() == (tmp_path / "two/log-track.parquet").read_bytes()


@pytest.mark.slow
def test_other_options_are_refused_and_the_work_stays(levelhead, refused, log, tmp_path, ended, often):
    words = ("fuse", log, "--format", "parquet", "-o", tmp_path / "out")
    ended((ChunkRun, "track", 2), *words)
    for more, sentence in (
        (("--filter", "Mahony"), "an unfinished run with filter ESKF, not Mahony;"),
        (("--set", "acc_noise=0.04"), "an unfinished run with acc_noise 0.03, not 0.04;"),
        (("--guard", "off"), "an unfinished run with guard on, not off;"),
        (("--map", "mag=mag"), "an unfinished run with map nothing, not "),
        (("--output-rate", "10"), "an unfinished run with output rate nothing, not 10.0;"),
    ):
        said = refused(*words, *more)
        assert sentence in said and "finish it with the same options, or remove that folder" in said
    assert "continues after 800" in levelhead(*words).err


@pytest.mark.parametrize("change", ["log", "version"])
def test_another_log_or_version_begins_anew(levelhead, log, tmp_path, ended, often, change):
    words = ("fuse", log, "--format", "parquet", "-o", tmp_path / "out")
    ended((ChunkRun, "track", 2), *words)
    if change == "log":
        os.utime(log, ns=(1, 1))
    else:
        path = tmp_path / "out" / ".log-track.parquet.unfinished" / "state.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {"levelhead": "0.0.1"}))
    said = levelhead(*words)
    sentence = "is of another state of" if change == "log" else "is of levelhead 0.0.1, and this is"
    assert said.code == 0 and sentence in said.err and "the run starts again" in said.err
    assert "continues after" not in said.err


def test_a_full_disk_loses_nothing(levelhead, log, tmp_path, monkeypatch, often):
    words = ("fuse", log, "--format", "parquet", "-o", tmp_path / "out")
    whole, count = column_files.ColumnFiles.append, 0

    def append(files, columns):
        nonlocal count
        count += 1
        if count == 3:
            raise OSError(28, "No space left on device")
        whole(files, columns)

    with monkeypatch.context() as patch:
        patch.setattr(column_files.ColumnFiles, "append", append)
        said = levelhead(*words)
    assert said.code == 2 and "results so far are in" in said.err and "No space left on device\n" in said.err
    assert "continues after 800 samples" in levelhead(*words).err


def test_two_runs_at_once(refused, log, tmp_path):
    fcntl = pytest.importorskip("fcntl")
    folder = tmp_path / "out" / ".log-track.parquet.unfinished"
    folder.mkdir(parents=True)
    with (folder / ".lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert "another run is writing into" in refused("fuse", log, "--format", "parquet", "-o", tmp_path / "out")


SLOW = """
import sys, time
from levelhead.cli import main, resume
from levelhead.engine import smoothing
from levelhead.engine.chunks import ChunkRun
from levelhead.sources import chunked
chunked.LONG_ROWS, chunked.ROWS, resume.EVERY, smoothing.MOST_BLOCKS = 1000, 100, 0.0, 4
for owner, name in ((ChunkRun, "track"), (smoothing.Smoother, "run_forward")):
    def slow(*words, whole=getattr(owner, name)):
        time.sleep(float(sys.argv[1]))
        return whole(*words)
    setattr(owner, name, slow)
sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.full
@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS)
def test_kill_9(log, tmp_path, verb):
    """The process itself, killed three times."""

    def command(wait, out):
        return [
            sys.executable,
            "-c",
            SLOW,
            str(wait),
            verb,
            str(log),
            "--format",
            "parquet",
            "--no-plot",
            "-o",
            str(out),
        ]

    subprocess.run(command(0, tmp_path / "one"), check=True, capture_output=True)
    out = tmp_path / "two"
    state = out / ".log-track.parquet.unfinished" / "state.json"
    for _ in range(3):
        before = state.read_bytes() if state.exists() else b""
        process = subprocess.Popen(command(0.2, out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while process.poll() is None and (state.read_bytes() if state.exists() else b"") == before:
            time.sleep(0.05)
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL  # and not done before
    said = subprocess.run(command(0, out), check=True, capture_output=True, text=True)
    assert "continues after" in said.stderr
    assert [path.name for path in out.iterdir()] == ["log-track.parquet"]
    assert (out / "log-track.parquet").read_bytes() == (tmp_path / "one" / "log-track.parquet").read_bytes()
