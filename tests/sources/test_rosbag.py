"""ROS bags of both kinds, written and read back; and bags that other programs wrote."""

import numpy as np
import pytest

import levelhead as lh

pytest.importorskip("rosbags", reason="rosbags is not installed (extra levelhead[ros])")
from levelhead.sources.formats.rosbag import IMU, MAG, write_bag


@pytest.fixture(scope="module")
def recording():
    rec = lh.simulate.recording("ICM-20948", "hand", duration=3.0)
    mag = rec.mag.copy()
    mag[np.arange(300) % 5 != 0] = np.nan  # at 20 Hz
    return lh.Recording(rec.t, rec.gyr, rec.acc, mag, meta={"t0": 1_700_000_000.0})


@pytest.mark.parametrize("name", ["log.bag", "log", "log.mcap"])
@pytest.mark.parametrize("with_track", [False, True])
def test_a_bag_reads_back(recording, tmp_path, name, with_track):
    track = lh.fuse(recording) if with_track else None
    write_bag(recording, tmp_path / name, track)
    back = lh.read(tmp_path / name)
    np.testing.assert_array_equal(back.gyr, recording.gyr)
    np.testing.assert_array_equal(back.acc, recording.acc)
    np.testing.assert_allclose(back.mag, recording.mag, rtol=1e-15)
    np.testing.assert_allclose(back.t, recording.t, atol=1e-9)
    assert back.meta["t0"] == 1_700_000_000.0 and back.truth is None
    if track is not None:
        from levelhead.sources import orientation

        said = orientation(tmp_path / name, "orientation")
        np.testing.assert_allclose(said.quat, track.quat, atol=1e-15)
    assert list(tmp_path.iterdir()) == [tmp_path / name]  # nothing unfinished is left


def by_hand(path, stamps, mags=(), second=None, topic="/imu"):
    """A ROS 2 bag in MCAP as a robot writes it: magnetometer at its own stamps, no orientation."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    vector, zero = types["geometry_msgs/msg/Vector3"], np.zeros(9)
    none = np.array([-1.0, *[0.0] * 8])

    def head(t):
        return types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](t // 10**9, t % 10**9), "imu")

    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for name in [topic, *([second] if second else [])]:
            connection = writer.add_connection(name, IMU, typestore=store)
            for i, t in enumerate(stamps):
                message = types[IMU](
                    head(t), types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0), none,
                    vector(0.1 * i, 0.0, 0.0), zero, vector(0.0, 0.0, 9.8), zero,
                )  # fmt: skip
                writer.write(connection, t + 1000, store.serialize_cdr(message, IMU))
        if len(mags):
            connection = writer.add_connection("/mag", MAG, typestore=store)
            for t in mags:
                message = types[MAG](head(t), vector(1e-6 * (t % 1000), 19e-6, -45e-6), zero)
                writer.write(connection, t, store.serialize_cdr(message, MAG))


def test_hidden_files_beside_a_bag_are_left(recording, tmp_path):
    """As macOS and file managers leave them."""
    write_bag(recording, tmp_path / "log")
    for name in (".DS_Store", "._log.db3", "._metadata.yaml"):
        (tmp_path / "log" / name).write_bytes(b"\x00\x05\x16\x07")
    np.testing.assert_array_equal(lh.read(tmp_path / "log").gyr, recording.gyr)


def test_a_slower_magnetometer_goes_to_the_nearest_sample(tmp_path):
    t = 10**18 + np.arange(20) * 10_000_000
    mags = [int(t[0]) + 2_000_001, int(t[4]) - 1_999_997, int(t[19]) + 10**9]
    by_hand(tmp_path / "log", t.tolist(), mags)
    for path in (tmp_path / "log", next((tmp_path / "log").glob("*.mcap"))):
        rec = lh.read(path)
        assert np.flatnonzero(np.isfinite(rec.mag[:, 0])).tolist() == [0, 4]  # the third is a second after all
        np.testing.assert_allclose(rec.mag[[0, 4], 0], [1.0, 3.0], rtol=1e-12)
        np.testing.assert_allclose(rec.t, np.arange(20) * 0.01, atol=1e-12)
    assert lh.read(tmp_path / "log", map={"mag": []}).mag is None


def test_two_topics_need_a_choice(tmp_path):
    by_hand(tmp_path / "log", [10**9, 2 * 10**9], second="/imu2")
    with pytest.raises(lh.LevelheadError, match="has 2 Imu topics: /imu, /imu2; the hint map gyr=/imu chooses one"):
        lh.read(tmp_path / "log")
    with pytest.raises(lh.LevelheadError, match="has no Imu topic /imu3; there is: /imu, /imu2"):
        lh.read(tmp_path / "log", map={"gyr": "/imu3"})
    assert len(lh.read(tmp_path / "log", map={"gyr": "/imu2"})) == 2


def test_bad_bags_are_refused(recording, tmp_path):
    write_bag(recording, tmp_path / "log.bag")
    whole = (tmp_path / "log.bag").read_bytes()
    (tmp_path / "cut.bag").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.bag").write_text("t,gx,gy,gz\n")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "metadata.yaml").write_text("nonsense: [")
    for name in ("cut.bag", "text.bag", "folder"):
        with pytest.raises(lh.LevelheadError, match="is not a ROS bag, or it is damaged"):
            lh.read(tmp_path / name)
    by_hand(tmp_path / "none", [])
    with pytest.raises(lh.LevelheadError, match="no messages of type sensor_msgs/Imu"):
        lh.read(tmp_path / "none")


def test_what_cannot_be_written_is_refused(recording, tmp_path):
    (tmp_path / "there").mkdir()
    for path, words in (
        ("there", "exists already"),
        ("no/log", "there is no folder"),
        ("no/log.bag", "there is no folder"),
    ):
        with pytest.raises(lh.LevelheadError, match=words):
            write_bag(recording, tmp_path / path)
    with pytest.raises(lh.LevelheadError, match="not those of the recording"):
        write_bag(recording, tmp_path / "log.bag", lh.fuse(recording[:100]))
    early = lh.Recording(recording.t - 5.0, recording.gyr, recording.acc)
    with pytest.raises(lh.LevelheadError, match="before time 0"):
        write_bag(early, tmp_path / "log.bag")
    assert [path.name for path in tmp_path.iterdir()] == ["there"]
