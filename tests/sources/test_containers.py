"""Archives of tar and pipes: read like a file or a folder; a damaged or dangerous one is rejected in a sentence."""

import bz2
import gzip
import io
import lzma
import os
import subprocess
import sys
import tarfile
import threading
from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead.sources.formats import container

ROWS = [f"{0.01 * k:.2f},{0.01 * (k % 7):.2f},0.02,0.03,0.1,0.2,9.8" for k in range(500)]
TEXT = "\n".join(["t (s),gx (rad/s),gy (rad/s),gz (rad/s),ax (m/s²),ay (m/s²),az (m/s²)", *ROWS]).encode()
PACKERS = {".tar": bytes, ".tar.gz": gzip.compress, ".tgz": gzip.compress, ".tar.bz2": bz2.compress,
           ".tbz2": bz2.compress, ".tar.xz": lzma.compress, ".TXZ": lzma.compress}  # fmt: skip


def archive(files: dict[str, bytes]) -> bytes:
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w") as tar:
        for name, content in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            tar.addfile(info, io.BytesIO(content))
    return made.getvalue()


def refused(path: Path) -> str:
    with pytest.raises(lh.LevelheadError) as error:
        lh.read(path)
    return str(error.value)


@pytest.mark.parametrize("suffix", PACKERS)
def test_a_tar_is_read_as_its_file(tmp_path: Path, suffix: str) -> None:
    (tmp_path / "log.csv").write_bytes(TEXT)
    path = tmp_path / f"log{suffix}"
    path.write_bytes(PACKERS[suffix](archive({"readme.md": b"words", "run/log.csv": TEXT})))
    one, other = lh.read(path), lh.read(tmp_path / "log.csv")
    np.testing.assert_array_equal(one.gyr, other.gyr)
    np.testing.assert_array_equal(one.t, other.t)


def test_a_tar_with_a_file_for_each_sensor(tmp_path: Path) -> None:
    t, *columns = np.array([[float(word) for word in row.split(",")] for row in ROWS]).T
    parts = {}
    for name, unit, three in (("Gyroscope", "rad/s", columns[:3]), ("Accelerometer", "m/s²", columns[3:])):
        rows = [",".join(map(str, row)) for row in zip(t, *three, strict=True)]
        parts[f"{name}.csv"] = "\n".join([f"time (s),x ({unit}),y ({unit}),z ({unit})", *rows]).encode()
    path = tmp_path / "phone.tar.gz"
    path.write_bytes(gzip.compress(archive(parts)))
    recording = lh.read(path)
    assert len(recording) == len(ROWS)
    np.testing.assert_allclose(recording.acc[:, 2], 9.8)


@pytest.mark.parametrize("suffix", PACKERS)
def test_a_damaged_tar(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"log{suffix}"
    whole = PACKERS[suffix](archive({"log.csv": os.urandom(40_000)}))
    path.write_bytes(whole[: len(whole) // 2])
    assert "is not a tar archive, or it is damaged" in refused(path)
    path.write_bytes(b"words")
    assert "is not a tar archive, or it is damaged" in refused(path)


def test_a_tar_without_a_log(tmp_path: Path) -> None:
    path = tmp_path / "log.tar"
    path.write_bytes(archive({"readme.md": b"words"}))
    assert "without a file that levelhead reads" in refused(path)


def test_a_tar_writes_nowhere_else_and_follows_no_link(tmp_path: Path) -> None:
    path = tmp_path / "log.tar"
    with tarfile.open(path, "w") as tar:
        outside = tarfile.TarInfo("/../../outside.csv")
        outside.size = len(TEXT)
        tar.addfile(outside, io.BytesIO(TEXT))
        link = tarfile.TarInfo("link.csv")
        link.type, link.linkname = tarfile.SYMTYPE, "/etc/passwd"
        tar.addfile(link)
    assert "without a file that levelhead reads" in refused(path)
    assert not list(tmp_path.parent.glob("outside.csv"))


def test_a_tar_that_grows_too_far(tmp_path: Path) -> None:
    path = tmp_path / "log.tar.gz"
    path.write_bytes(gzip.compress(archive({"log.csv": bytes(40 << 20)})))
    assert f"would grow {container.MAX_RATIO}-fold" in refused(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_a_pipe_is_read_once(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    writer = threading.Thread(target=path.write_bytes, args=(TEXT,))
    writer.start()
    recording = lh.read(path)
    writer.join()
    assert len(recording) == len(ROWS)


@pytest.mark.skipif(not Path("/dev/stdin").exists(), reason="no /dev/stdin here")
def test_a_dash_is_standard_input(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "levelhead", "fuse", "-", "-o", str(tmp_path), "--no-plot"]
    done = subprocess.run(words, input=TEXT, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "stdin-track.csv").stat().st_size > 10_000
