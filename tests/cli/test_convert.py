"""``levelhead convert``: every format is read back, by our reader and by those who own it."""

import sys

import numpy as np
import pytest

import levelhead as lh
from levelhead import simulate
from levelhead.sources.formats.npz import write_npz

READ_BACK = {".mcap": "rosbags", ".bag": "rosbags", ".db3": "rosbags", ".parquet": "pyarrow", ".csv": "", ".npz": ""}


@pytest.fixture(scope="module")
def nine(tmp_path_factory):
    path = tmp_path_factory.mktemp("convert") / "nine.npz"
    write_npz(simulate.recording("ICM-20948", "hand", duration=3.0), path)
    return path


@pytest.mark.parametrize("suffix", READ_BACK)
def test_a_log_in_another_format_is_the_same_log(levelhead, nine, tmp_path, suffix):
    if READ_BACK[suffix]:
        pytest.importorskip(READ_BACK[suffix], reason=f"{READ_BACK[suffix]} is not installed")
    done = levelhead("convert", nine, "-o", tmp_path / f"x{suffix}")
    assert done.code == 0 and done.out.splitlines()[-1] == f"written: {tmp_path / f'x{suffix}'}"
    before, after = lh.read(nine), lh.read(tmp_path / f"x{suffix}")
    for name in ("t", "gyr", "acc", "mag"):
        ours, theirs = getattr(before, name), getattr(after, name)
        np.testing.assert_allclose(ours - (ours[0] if name == "t" else 0.0), theirs - (theirs[0] if name == "t" else 0.0), atol=2e-9)  # fmt: skip # noqa: E501
    assert sorted(one.name for one in tmp_path.iterdir()) == [f"x{suffix}"]


def test_sto_is_a_table_of_quaternions(levelhead, nine, tmp_path):
    assert levelhead("convert", nine, "-o", tmp_path / "x.sto").code == 0
    head, _, rows = (tmp_path / "x.sto").read_text().partition("endheader\ntime\timu\n")
    assert "DataRate=100.0" in head and "DataType=Quaternion" in head
    values = [[float(cell) for cell in row.replace("\t", ",").split(",")] for row in rows.splitlines()]
    recording = lh.read(nine)
    np.testing.assert_array_equal(values, np.column_stack([recording.t, recording.truth.quat]))


def test_rrd_is_read_by_rerun(levelhead, nine, tmp_path):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed (extra levelhead[rerun])")
    assert levelhead("convert", nine, "-o", tmp_path / "x.rrd").code == 0
    assert (tmp_path / "x.rrd").read_bytes()[:3] == b"RRF" and (tmp_path / "x.rrd").stat().st_size > 20_000


def test_rrd_without_rerun_gives_the_line_that_installs_it(refused, nine, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert "pip install 'levelhead[rerun]'" in refused("convert", nine, "-o", tmp_path / "x.rrd")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "out, said", [("x.cvs", "did you mean '.csv'"), ("no/x.csv", "there is no folder"), ("x", "cannot write")]
)
def test_bad_input(refused, nine, tmp_path, out, said):
    assert said in refused("convert", nine, "-o", tmp_path / out)


@pytest.mark.slow
def test_a_black_box_is_decoded_by_readers_of_ros(levelhead, tmp_path):
    """The box holds sensor_msgs beside its own rows; mcap-ros2-support reads them, convert keeps them."""
    pytest.importorskip("mcap", reason="mcap is not installed (extra levelhead[box])")
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    box = tmp_path / "box.mcap"
    run = ("run", "--no-realtime", "--source", "emulated:icm20948", "--calibrate", "50", "--duration", "2", "--json")
    assert levelhead(*run, "--box", box).code == 0
    from levelhead.sources.formats.blackbox import FUSED, read_box

    rows = read_box(box).rows
    fused = rows[(rows["flags"] & FUSED) > 0]
    assert levelhead("convert", box, "-o", tmp_path / "x.parquet").code == 0
    from pyarrow import parquet

    table = parquet.read_table(tmp_path / "x.parquet")
    quat = np.column_stack([table[f"q{axis}"].to_numpy() for axis in "wxyz"])
    np.testing.assert_array_equal(quat, fused["quat"])
    assert levelhead("fuse", box, "--no-plot", "-o", tmp_path / "out").out.count("magnetometer missing") == 0
    decoder = pytest.importorskip("mcap_ros2.reader", reason="mcap-ros2-support is not installed (extra test)")
    read: dict = {}
    for message in decoder.read_ros2_messages(str(box), topics=["/imu/data", "/imu/mag", "/tf", "/diagnostics"]):
        read.setdefault(message.channel.topic, []).append(message.ros_msg)
    assert set(read) >= {"/imu/data", "/imu/mag", "/tf", "/diagnostics"} and len(read["/imu/data"]) == len(rows)
    gyr = [[v.x, v.y, v.z] for v in (one.angular_velocity for one in read["/imu/data"])]
    np.testing.assert_array_equal(gyr, rows["gyr"])
    q = [[v.w, v.x, v.y, v.z] for v in (one.transforms[0].transform.rotation for one in read["/tf"])]
    np.testing.assert_array_equal(q, fused["quat"])
    assert any("started" in one.status[0].name for one in read["/diagnostics"])
