"""What only a process of its own shows: imports, pipes, a terminal, a home that is none."""

import os
import re
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = {"numba", "scipy", "matplotlib", "pyarrow", "h5py"}


def levelhead(*words: object, flags: tuple[str, ...] = (), **more: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *flags, "-m", "levelhead", *map(str, words)]
    return subprocess.run(command, capture_output=True, encoding="utf-8", check=False, timeout=120, **more)  # type: ignore[call-overload, no-any-return]


def imported(*words: object) -> set[str]:
    """Names of the packages that a successful run imports."""
    done = levelhead(*words, flags=("-X", "importtime"))
    assert done.returncode == 0, done.stderr
    return {name.partition(".")[0] for name in re.findall(r"import time:.*\|\s+(\S+)$", done.stderr, re.MULTILINE)}


@pytest.mark.slow
def test_help_imports_nothing_heavy():
    assert imported("--help").isdisjoint(HEAVY | {"numpy"})


@pytest.mark.slow
@pytest.mark.parametrize("flt", ["Kalman", "Complementary"])
def test_a_minute_without_a_picture_imports_nothing_heavy(tmp_path, flt):
    from levelhead import simulate
    from levelhead.sources.formats.csv_writer import write_csv

    write_csv(simulate.recording("BMI160", "hand", duration=60.0), tmp_path / "one-minute.csv")
    found = imported("fuse", tmp_path / "one-minute.csv", "--filter", flt, "--no-plot", "-o", tmp_path)
    assert "numpy" in found and found.isdisjoint(HEAVY | {"rich"} if os.name == "posix" else HEAVY)


@pytest.fixture
def homeless(tmp_path: Path) -> dict[str, str]:
    """An environment whose home is a file, so that nothing can be kept there; not even by root."""
    (tmp_path / "home").touch()
    names = ("MPLCONFIGDIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "NUMBA_CACHE_DIR", "PYTHONPATH")
    kept = {name: value for name, value in os.environ.items() if name not in names}
    return kept | {"HOME": str(tmp_path / "home"), "PYTHONDONTWRITEBYTECODE": "1"}


@pytest.mark.slow
def test_success_in_a_pipe_says_nothing_on_stderr_even_without_a_home(logs, tmp_path, homeless):
    done = levelhead("fuse", logs / "hand.csv", "-o", tmp_path, env=homeless)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "hand-track.png").stat().st_size > 10_000


@pytest.mark.full
@pytest.mark.compiled
def test_a_read_only_install_without_a_home_still_compiles(tmp_path, homeless):
    """Files stand where Numba would put its caches: beside the source and at home."""
    import shutil

    import levelhead as package

    source = Path(package.__file__).parent
    copy = tmp_path / "site" / "levelhead"
    shutil.copytree(source, copy, ignore=shutil.ignore_patterns("__pycache__", ".*"))
    for folder in [copy, *(path for path in copy.rglob("*") if path.is_dir())]:
        (folder / "__pycache__").touch()
    program = (
        "import levelhead as lh, sys; "
        f"assert lh.__file__.startswith({str(copy)!r}), lh.__file__; "
        "rec = lh.simulate.lesson(); "
        "track = lh.fuse(rec, lh.AccelTilt(), engine='compiled'); "
        "print(track)"
    )
    env = homeless | {"PYTHONPATH": str(copy.parent)}
    done = subprocess.run([sys.executable, "-c", program], env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"compiling AccelTilt for this machine, once, about \d+ s\n", done.stderr), done.stderr
    assert done.stdout.strip() == "Track(AccelTilt, 6000 samples)"


@pytest.mark.slow
def test_a_pipe_that_knows_no_sigma(logs, tmp_path):
    env = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = levelhead("fuse", logs / "hand.csv", "--no-plot", "-o", tmp_path, env=env)
    assert (done.returncode, done.stderr) == (0, "") and "roll ?" in done.stdout


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="needs the pipes and devices of Unix")
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_has_seen_enough(unbuffered):
    env = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "levelhead", "compare", "--simulate", "lesson", "-f", "AccelTilt"]
    done = subprocess.run(command, env=env, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("form", [[], ["--json"]])
def test_a_full_disk_behind_standard_output(unbuffered, form):
    env = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    command = [sys.executable, "-m", "levelhead", "compare", "--simulate", "lesson", "-f", "AccelTilt", *form]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, env=env, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2 and done.stderr.startswith("levelhead: standard output: ")
    assert done.stderr.count("\n") == 2


def watch(terminal: int, *words: bytes) -> None:
    """Reads until all words have stood there; the other end must be open, or what came last is lost with it."""
    seen = b""
    while not all(word in seen for word in words):
        assert select.select([terminal], [], [], 60.0)[0], f"only {seen!r}"
        seen += os.read(terminal, 4096)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="needs a pseudo-terminal")
def test_a_bar_on_a_terminal_and_json_alone_beside_it():
    import json
    import pty

    outer, inner = pty.openpty()
    words = ["sweep", "-p", "r_measure", "--filter", "Kalman", "--simulate", "lesson", "--json"]
    # A fast machine is done before a bar would appear, and before rich is imported.
    program = (
        "import sys; from levelhead.cli import main; import levelhead.publish.progress, rich.console, rich.progress; "
        "sys.modules['levelhead.publish.progress'].PATIENCE = 0.0; sys.exit(main())"
    )
    env = os.environ | {"TERM": "xterm", "COLUMNS": "80"}
    command = [sys.executable, "-c", program, *words]
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=inner, text=True) as process:
        watch(outer, b"sweeping", b"%")
        out, _ = process.communicate(timeout=120)
    os.close(inner)
    os.close(outer)
    assert process.returncode == 0 and json.loads(out)["parameter"] == "r_measure"


@pytest.fixture
def compiling(tmp_path):
    """The command line with a verb that has to compile, where nothing is kept from before."""
    code = (
        "import signal, sys, levelhead as lh; from levelhead import cli\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # which a job in the background is started without
        "recording = lh.simulate.recording('MPU-6050', 'hand', duration=1.0)\n"
        "cli.app = lambda *_, **__: lh.fuse(recording, lh.Mahony(), engine='compiled')\n"
        "sys.exit(cli.main(['fuse']))"
    )
    env = os.environ | {"TERM": "xterm", "COLUMNS": "80", "NUMBA_CACHE_DIR": str(tmp_path)}
    return [sys.executable, "-c", code], env


NOTICE = re.compile(rb"compiling Mahony for this machine, once, about \d+ s")


@pytest.mark.compiled
@pytest.mark.skipif(os.name != "posix", reason="needs signals")
def test_compiling_is_said_in_a_log_and_ctrl_c_leaves_it_quietly(compiling):
    """Half a minute of silence would look like a program that hangs."""
    command, env = compiling
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        first = process.stderr.readline()
        assert NOTICE.match(first), first
        process.send_signal(signal.SIGINT)
        out, said = process.communicate(timeout=120)
    assert process.returncode == 130
    assert out == b"" and b"Traceback" not in said
    assert said.splitlines()[-1] == b"levelhead: stopped"


@pytest.mark.compiled
@pytest.mark.skipif(os.name != "posix", reason="needs a pseudo-terminal")
def test_a_terminal_is_told_that_a_filter_is_compiled(compiling):
    import pty

    command, env = compiling
    outer, inner = pty.openpty()
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=inner) as process:
        watch(outer, b"compiling Mahony", b"for this machine, once")
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=120)
        os.close(inner)
    os.close(outer)
    assert process.returncode == 130


def test_an_error_without_a_file_is_not_taken_for_one_of_standard_output(monkeypatch, capsys):
    from levelhead import cli

    def lose_connection(*_words: object, **_options: object) -> None:
        raise ConnectionResetError(104, "Connection reset by peer")

    monkeypatch.setattr(cli, "app", lose_connection)
    monkeypatch.setattr(cli, "_start", lambda _tokens: None)
    assert cli.main(["fuse"]) == 2
    assert capsys.readouterr().err == "levelhead: Connection reset by peer\n"
