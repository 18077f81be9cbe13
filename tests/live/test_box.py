"""The black box: everything is in it, it runs again to the bit, and neither a kill nor a full disk takes it away."""

import errno
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import levelhead as lh
from levelhead.evaluate import compare
from levelhead.live.box import BlackBox
from levelhead.live.rerun import rerun
from levelhead.sources import attitudes
from levelhead.sources.formats.blackbox import PACKED, ROW, read_box

pytestmark = pytest.mark.slow

pytest.importorskip("mcap", reason="mcap is not installed (extra levelhead[box])")


def same(path) -> lh.Track:
    """The node's track, which a new stream gives again to the bit."""
    said, again = rerun(path)
    for name in ("quat", "bias", "sigma", "health"):
        np.testing.assert_array_equal(getattr(said, name), getattr(again, name))
    return said


def test_rows_are_packed_as_numpy_reads_them():
    assert PACKED.size == ROW.itemsize
    values = tuple(range(1, 1 + len(PACKED.unpack(bytes(PACKED.size)))))
    row = np.frombuffer(PACKED.pack(*values), ROW)[0]
    assert [x for name in ROW.names for x in np.atleast_1d(row[name]).tolist()] == list(values)


@pytest.mark.parametrize("text", ["mpu6050", "icm20948+bmp280"])
def test_a_run_again_gives_the_same_bits(rig, tmp_path, text):
    path = tmp_path / "box.mcap"
    one = rig(text, params=lh.Madgwick(), box=BlackBox(path))
    one.clock.at(6.0, lambda: one.node.set(beta=0.3))
    one.clock.at(9.0, lambda: setattr(one.wires, "unplugged", True))
    one.clock.at(9.5, lambda: setattr(one.wires, "unplugged", False))
    one.node.run(duration=12.0)
    said, raw = one.drain(one.orientations), one.drain(one.raw)
    track = same(path)
    assert [m.quat for m in said if m.valid] == [tuple(row) for row in track.quat.tolist()]
    box = read_box(path)
    assert box.whole and len(box.rows) == len(raw) == one.node.samples
    np.testing.assert_array_equal(box.rows["gyr"], [message.gyr for message in raw])
    np.testing.assert_array_equal(box.rows["acc"], [message.acc for message in raw])
    assert [event["name"] for event in box.events] == [event.name for event in one.drain(one.health)]
    assert box.config["filter"] == "Madgwick" and box.config["version"] == lh.__version__
    assert len(box.changes) == 1
    if text.endswith("bmp280"):
        assert np.nanmean(box.rows["pressure"]) == pytest.approx(101325.0, abs=1.0)


def test_fuse_reads_it(rig, tmp_path, monkeypatch):
    path = tmp_path / "box.mcap"
    one = rig("icm20948", box=BlackBox(path))
    one.node.run(duration=8.0)
    recording = lh.read(path)
    track = lh.fuse(recording, one.node.params, guard=one.node.guard)
    np.testing.assert_array_equal(track.quat, same(path).quat)
    assert recording.meta["live"]["filter"] == type(one.node.params).__name__
    assert recording.meta["live"]["params"] == one.node.params._asdict()  # those since the calibration
    assert len(recording.meta["notes"]) == 2
    assert f"the node ran {type(one.node.params).__name__} with parameters of its own" in recording.meta["notes"][1]
    assert "without the bias that was measured at the start" in recording.meta["notes"][0]


def test_it_is_never_overwritten(tmp_path):
    (tmp_path / "box.mcap").write_text("precious")
    for path, words in (
        ("box.mcap", "exists already"),
        ("box.bag", "must end in .mcap"),
        ("no/box.mcap", "cannot write"),
    ):
        with pytest.raises(lh.LevelheadError, match=words):
            BlackBox(tmp_path / path)
    assert (tmp_path / "box.mcap").read_text() == "precious"


def test_a_node_that_never_began_leaves_none_behind(rig, tmp_path):
    one = rig(box=BlackBox(tmp_path / "box.mcap"))
    one.wires.unplugged = True
    with pytest.raises(lh.LevelheadError, match="does not answer"):
        one.node.run(duration=1.0)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_ends_the_box_and_not_the_node(rig, tmp_path):
    path = tmp_path / "box.mcap"
    box = BlackBox(path)
    one = rig(calibrate=0, box=box)
    write = box._file.write

    class Full:
        fileno, close, closed, tell = box._file.fileno, box._file.close, False, box._file.tell

        def write(self, data):
            if self.tell() > 20_000:
                raise OSError(errno.ENOSPC, "No space left on device")
            return write(data)

    box._writer._Writer__stream._file = Full()
    one.clock.at(3.0, lambda: time.sleep(0.6))  # real time for the box's thread, twice
    one.clock.at(6.0, lambda: time.sleep(0.6))
    one.node.run(duration=10.0)
    assert one.node.samples == pytest.approx(2010, abs=3)
    assert box.failure == f"the black box {path} ends here: No space left on device"
    assert "box_failed" in one.events()
    found = read_box(path)
    assert not found.whole and 0 < len(found.rows) < 2010
    same(path)


def test_a_box_cut_anywhere_gives_what_stands_before(rig, tmp_path):
    path = tmp_path / "box.mcap"
    one = rig(calibrate=0, box=BlackBox(path))
    for second in range(1, 6):
        one.clock.at(second, lambda: time.sleep(0.3))  # so that it is written in several blocks
    one.node.run(duration=6.0)
    whole, count = path.read_bytes(), []
    for size in np.linspace(0, len(whole), 25).astype(int):
        (tmp_path / "cut.mcap").write_bytes(whole[:size])
        try:
            box = read_box(tmp_path / "cut.mcap")
        except lh.LevelheadError as error:
            assert "not a black box" in str(error) and size < 3000
            continue
        count.append(len(box.rows))
        assert box.whole == (size == len(whole))
    assert count == sorted(count) and count[-1] == one.node.samples and len(set(count)) >= 3
    (tmp_path / "text.mcap").write_text("t,gx,gy,gz\n1,2,3,4\n")
    with pytest.raises(lh.LevelheadError, match="is not a black box"):
        lh.read(tmp_path / "text.mcap")


def test_killed_in_the_middle_it_opens_and_lacks_less_than_a_second(tmp_path):
    """kill -9 at 200 Hz; benchmarks/speed/blackbox.py does it twenty times."""
    path = tmp_path / "box.mcap"
    command = [
        sys.executable,
        "-m",
        "levelhead",
        "run",
        "--source",
        "emulated:mpu6050",
        "--calibrate",
        "0",
        "--filter",
        "Complementary",
        "--box",
        path,
    ]
    process = subprocess.Popen([*map(str, command), "--no-realtime"], stdout=subprocess.PIPE, text=True)
    for line in process.stdout:
        if "Hz  roll" in line:
            break
    time.sleep(0.5)
    process.send_signal(signal.SIGKILL)
    killed = time.time()
    process.wait()
    process.stdout.close()
    box = read_box(path)
    assert not box.whole and killed - box.rows["stamp"][-1] * 1e-9 < 1.0
    assert len(same(path)) > 100


def test_a_box_that_begins_and_ends_while_the_node_runs(rig, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    one = rig()
    configs = one.node.bus.subscribe("imu/config")
    for at, on in ((4.0, True), (4.5, True), (6.0, False), (7.0, True)):
        one.clock.at(at, lambda on=on: one.node.set(record=on))
    one.node.run(duration=8.0)
    files = [message.data["record"] for message in one.drain(configs)]
    first, second = dict.fromkeys(name for name in files if name)
    assert [name for i, name in enumerate(files) if i == 0 or name != files[i - 1]] == ["", first, "", second]
    box = read_box(first)
    assert box.whole and len(box.rows) == pytest.approx(400, abs=5) and box.rows["t"][0] > 3.9
    assert box.bias == one.node.path.bias != (0.0, 0.0, 0.0)  # measured before the box began
    events = one.events()
    assert [name for name in events if "recording" in name] == ["recording", "-recording", "recording"]
    with pytest.raises(lh.LevelheadError, match="expected True or False"):
        one.node.set(record=1)


@pytest.mark.parametrize("text", ["bno055", "bno085"])
def test_a_chip_s_own_orientation_is_kept_and_compared(rig, felt, tmp_path, text):
    pytest.importorskip("smbus2", reason="smbus2 is not installed (extra levelhead[live])")
    path = tmp_path / "own.mcap"
    one = rig(text, box=BlackBox(path))
    samples = one.node.run(duration=20.0)["samples"]
    ((name, track),) = attitudes(path).items()
    assert name == text.upper() and samples - 60 < len(track.t) <= samples
    assert set(track.t) <= set(read_box(path).rows["t"].tolist())
    own = compare(lh.read(path), [lh.ESKF()], tracks={name: track}).rows[1]
    assert own.name == name and own.difference < 2.0
    with open(path, "rb") as file:  # by an independent decoder
        decode = pytest.importorskip("mcap_ros2.decoder", reason="mcap-ros2-support is not installed")
        reader = pytest.importorskip("mcap.reader").make_reader(file, decoder_factories=[decode.DecoderFactory()])
        _, _, _, message = next(iter(reader.iter_decoded_messages(topics=["/imu/attitude"])))
    said = message.quaternion
    assert (said.w, said.x, said.y, said.z) == pytest.approx(track.quat[0].tolist(), abs=1e-4)
