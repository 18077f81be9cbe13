"""A corpus on real Dask workers: the same rows, workers and schedulers that die, another version."""

import os
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from types import SimpleNamespace

import pytest
from tests.reference.corpus import GOOD, write_corpus

import levelhead as lh
from levelhead.corpora import cluster
from levelhead.corpora.results import list_parts
from levelhead.errors import LevelheadError

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore"),  # of Dask's own code, its threads and sockets
]
psutil = pytest.importorskip("psutil")  # which Dask needs itself
LOST = [
    ConnectionResetError("by peer"),
    OSError("in <TCP (closed)>: Stream is closed"),
    TimeoutError(),
    CancelledError(),
]
TIMES = ["read_s", "run_s"]
MODULE = [sys.executable, "-m"]


@pytest.fixture(scope="module", autouse=True)
def _dask():
    """Imported where the tests run: every process that collects them would wait a second for it."""
    pytest.importorskip("distributed")


def workers_of(pid):
    """The processes of Dask's workers below a process."""
    with suppress(psutil.NoSuchProcess):
        return [one for one in psutil.Process(pid).children(recursive=True) if "spawn_main" in "".join(one.cmdline())]
    return []


@pytest.fixture(scope="module")
def plain(recordings):
    return lh.corpus(recordings, workers=0).drop_columns(TIMES)


def test_a_worker_that_is_killed_loses_nothing_and_changes_no_bit(recordings, plain, tmp_path, monkeypatch):
    monkeypatch.setattr("levelhead.corpora.plan.MAX_RECORDINGS", 1)
    killed = []

    def kill(state):
        if state.done and not killed:
            killed.append(workers_of(os.getpid())[0].pid)
            os.kill(killed[0], signal.SIGKILL)

    table = lh.corpus(recordings, out=tmp_path / "out", workers=2, progress=kill)
    assert killed and table.drop_columns(TIMES).equals(plain)


@pytest.mark.full
def test_a_recording_that_kills_every_worker_is_a_row(recordings, tmp_path, monkeypatch):
    folder = write_corpus(tmp_path / "recordings", seconds=1.0)
    plugin = tmp_path / "sitecustomize.py"  # which the workers import as they start
    plugin.write_text(
        "import hashlib, os\n"
        "honest = hashlib.file_digest\n"
        "def deadly(file, kind):\n"
        "    return os._exit(9) if file.name.endswith('unit1_day2.csv') else honest(file, kind)\n"
        "hashlib.file_digest = deadly\n"
    )
    before = os.environ.get("PYTHONPATH", "")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{before}")
    rows = lh.corpus(folder, out=tmp_path / "out", workers=2).to_pylist()
    assert len(rows) == GOOD + 1
    bad = {row["recording"]: row for row in rows if row["error"]}
    assert set(bad) == {"walk/broken.csv", "hand/unit1_day2.csv"}
    assert "ended every worker" in bad["hand/unit1_day2.csv"]["error"] and bad["hand/unit1_day2.csv"]["transient"]
    monkeypatch.setenv("PYTHONPATH", before)
    again = lh.corpus(folder, out=tmp_path / "out", workers=1).to_pylist()  # it is tried again
    assert {row["recording"] for row in again if row["error"]} == {"walk/broken.csv"} and len(again) == GOOD + 1


def test_a_scheduler_that_does_not_answer(recordings, monkeypatch):
    monkeypatch.setattr(cluster, "PATIENCE", 1.0)
    with pytest.raises(LevelheadError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9 within 1 s"):
        lh.corpus(recordings, scheduler="tcp://127.0.0.1:9")


@pytest.mark.parametrize("address", ["nonsense", "10.0.0.1", "carrier://10.0.0.1:8786"])
def test_an_address_that_is_none_is_refused_at_once(recordings, address):
    with pytest.raises(
        LevelheadError, match=rf"'{address}' is not an address of a Dask scheduler; expected one such as tcp:"
    ):
        lh.corpus(recordings, scheduler=address)


@contextmanager
def dask(workers):
    """A scheduler and workers as processes of their own: its address, and the processes."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = [
        *MODULE,
        "distributed.cli.dask_scheduler",
        "--host",
        "127.0.0.1",
        "--port",
        str(port),
        "--no-dashboard",
    ]
    worker = [*MODULE, "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    started = [subprocess.Popen(scheduler, **quiet)]
    started += [subprocess.Popen(worker, **quiet) for _ in range(workers)]
    try:
        yield address, started
    finally:
        for process in started:
            process.kill()
            process.wait()


@pytest.mark.full
def test_a_scheduler_without_workers(recordings, monkeypatch):
    with dask(0) as (address, _):
        monkeypatch.setattr(cluster, "PATIENCE", 5.0)
        with pytest.raises(LevelheadError, match="has no worker; start some: dask worker tcp://"):
            lh.corpus(recordings, scheduler=address)


def test_workers_with_another_version_are_refused_by_name(recordings, monkeypatch):
    with dask(1) as (address, _):
        monkeypatch.setattr(cluster, "VERSION", "9.9.9")
        with pytest.raises(
            LevelheadError, match=r"need levelhead 9\.9\.9, but tcp://127.* has levelhead " + lh.__version__
        ):
            lh.corpus(recordings, scheduler=address)


def command(folder, out, *more):
    return [*MODULE, "levelhead", "corpus", "fuse", str(folder), "-o", str(out), "--no-plot", *more]


def wait_for_parts(out, process):
    until = time.monotonic() + 120.0
    while not list_parts(out) and process.poll() is None and time.monotonic() < until:
        time.sleep(0.05)


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """Enough recordings that a run is not over before it is killed."""
    folder = tmp_path_factory.mktemp("many")
    for i in range(12):
        write_corpus(folder / f"{i:02d}", seconds=6.0)
    return folder


@pytest.mark.full
def test_a_client_that_is_killed_goes_on_and_leaves_no_process(many, tmp_path):
    out = tmp_path / "out"
    process = subprocess.Popen(
        command(many, out, "--workers", "2"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    wait_for_parts(out, process)
    left = workers_of(process.pid)
    assert process.poll() is None and left
    process.kill()
    process.wait()
    _, alive = psutil.wait_procs(left, timeout=60.0)
    assert alive == []
    done = sum(1 for _ in list_parts(out))
    assert done >= 1
    assert subprocess.run(command(many, out, "--workers", "2"), capture_output=True, check=False).returncode == 1
    table = lh.corpus(many, out=out, workers=0)
    assert table.drop_columns(TIMES).equals(lh.corpus(many, workers=0).drop_columns(TIMES))


@pytest.mark.full
def test_a_scheduler_that_is_killed_ends_the_run_with_a_sentence(many, tmp_path):
    out = tmp_path / "out"
    with dask(2) as (address, started):
        process = subprocess.Popen(command(many, out, "--scheduler", address), stderr=subprocess.PIPE, text=True)
        wait_for_parts(out, process)
        assert process.poll() is None
        started[0].kill()
        _, said = process.communicate(timeout=120.0)
    assert process.returncode == 2 and "Traceback" not in said
    assert "the scheduler is gone; the finished rows are kept" in said
    table = lh.corpus(many, out=out, workers=0)
    assert table.drop_columns(TIMES).equals(lh.corpus(many, workers=0).drop_columns(TIMES))


def test_a_result_that_is_lost_with_its_worker_is_waited_for():
    """Dask says that a task is finished, its worker dies before the rows were fetched, and it runs again elsewhere."""

    class Future:
        key, status = "one", "lost"

        def result(self):
            return [{"recording": "a"}]

        def release(self):
            pass

    class Running(list):
        def __next__(self):
            return self.pop()

        def add(self, future):
            future.status = "finished"
            self.append(future)

    future = Future()
    pool = cluster.DaskPool.__new__(cluster.DaskPool)
    pool._futures, pool._running = {"one": future}, Running([future])
    assert pool.wait() == ("one", [{"recording": "a"}])


@pytest.mark.parametrize("error", LOST)
@pytest.mark.parametrize("call", ["room", "submit", "next", "result"])
def test_each_call_of_dask_that_finds_the_scheduler_gone_says_so(call, error):
    """Which one it is depends on when the scheduler died."""

    def gone(*_, **__):
        raise error

    future = SimpleNamespace(key="one", status="finished", result=gone)
    pool = cluster.DaskPool.__new__(cluster.DaskPool)
    pool._client = SimpleNamespace(scheduler_info=gone, submit=gone)
    pool._counted, pool._futures = -cluster.FRESH, {"one": future}
    pool._running = iter([future]) if call == "result" else (gone() for _ in "a")
    with pytest.raises(LevelheadError, match="the scheduler is gone; the finished rows are kept"):
        {"room": lambda: pool.room, "submit": lambda: pool.submit(max)}.get(call, pool.wait)()


def test_a_fault_beside_a_scheduler_that_answers_keeps_its_own_words():
    pool = cluster.DaskPool.__new__(cluster.DaskPool)

    def fail(*_, **__):
        raise ZeroDivisionError

    pool._client = SimpleNamespace(submit=fail, status="running")
    with pytest.raises(ZeroDivisionError):
        pool.submit(max)
    pool._client.status = "closed"
    with pytest.raises(LevelheadError, match="the scheduler is gone"):
        pool.submit(max)
