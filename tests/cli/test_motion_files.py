"""``--motion`` in every format of a track: the values are those of ``Track.linear_acceleration`` and its sisters."""

import numpy as np
import pytest

import levelhead as lh
from levelhead import simulate
from levelhead.publish.writers import motion_columns, motion_series
from levelhead.sources.formats.npz import load_arrays, write_npz

BAGS = ("mcap", "bag", "db3")


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("motion") / "hand.npz"
    write_npz(simulate.recording("ICM-20948", "hand", duration=2.0), path)
    return path


@pytest.fixture(scope="module")
def track(log):
    return lh.fuse(lh.read(log), lh.Mahony())


def messages(path):
    """Topic -> (stamps in ns, frame, linear part, covariance of it) of each kind of message, by rosbags."""
    pytest.importorskip("rosbags", reason="rosbags is not installed (extra levelhead[ros])")
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2
    from rosbags.typesys import Stores, get_typestore

    first = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    decode = store.deserialize_ros1 if first else store.deserialize_cdr
    found = {}
    with (Reader1 if first else Reader2)(path) as reader:
        for connection, at, data in reader.messages():
            found.setdefault(connection.topic, []).append((at, decode(data, connection.msgtype)))
    return found


def three(vector):
    return [vector.x, vector.y, vector.z]


@pytest.mark.parametrize("suffix", BAGS)
def test_bags_hold_rate_force_and_accelerations(levelhead, log, track, tmp_path, suffix):
    said = levelhead(
        "fuse", log, "-f", "Mahony", "--no-north", "--no-plot", "--motion", "--format", suffix, "-o", tmp_path
    )
    assert said.code == 0, said.err
    found, series = messages(tmp_path / f"hand-track.{suffix}"), motion_series(track)
    imu = [one for _, one in found["/imu/data"]]
    np.testing.assert_array_equal([[q.w, *three(q)] for q in (one.orientation for one in imu)], track.quat)
    np.testing.assert_array_equal([three(one.angular_velocity) for one in imu], series["rate"].value)
    np.testing.assert_array_equal([three(one.linear_acceleration) for one in imu], series["specific_force"].value)
    variances = np.array([np.diag(one.angular_velocity_covariance.reshape(3, 3)) for one in imu])
    np.testing.assert_allclose(variances, series["rate"].sigma ** 2)
    for name, frame in (("linear", "imu_link"), ("earth", "odom")):
        every = [one for _, one in found[f"/imu/{name}_acceleration"]]
        wanted = series[f"{name}_acceleration"]
        np.testing.assert_array_equal([three(one.accel.accel.linear) for one in every], wanted.value)
        np.testing.assert_allclose(
            [np.diag(one.accel.covariance.reshape(6, 6))[:3] for one in every], wanted.sigma**2, rtol=1e-12
        )
        assert {one.header.frame_id for one in every} == {frame}
    assert np.abs(lh.read(tmp_path / f"hand-track.{suffix}").gyr - series["rate"].value).max() < 1e-12


def test_tables_and_archives(levelhead, log, track, tmp_path):
    import pyarrow.parquet as pq

    expected = motion_columns(track)
    for suffix in ("npz", "parquet", "csv"):
        said = levelhead(
            "fuse", log, "-f", "Mahony", "--no-north", "--no-plot", "--motion", "--format", suffix, "-o", tmp_path
        )
        assert said.code == 0, said.err
    found = load_arrays(tmp_path / "hand-track.npz")
    table = pq.read_table(tmp_path / "hand-track.parquet")
    names = (tmp_path / "hand-track.csv").read_text().partition("\n")[0].split(",")
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)
        np.testing.assert_array_equal(table[name], values)
        assert name in names
    np.testing.assert_array_equal(np.stack([found[f"q{axis}"] for axis in "wxyz"], axis=1), track.quat)
    assert str(found["frame"]) == "ENU" and "sensor to earth" in str(found["orientation"])


def test_an_archive_names_frame_and_axes(levelhead, log, tmp_path):
    words = ["fuse", log, "-f", "Mahony", "--no-plot", "--format", "npz", "--frame", "ned", "--axes", "-y,x,z"]
    assert levelhead(*words, "-o", tmp_path).code == 0
    found = load_arrays(tmp_path / "hand-track.npz")
    assert (str(found["frame"]), str(found["axes"])) == ("NED", "-y,x,z") and "ned_qw" in found


@pytest.mark.parametrize("suffix", ["csv", "npz", "parquet", "mcap"])
def test_convert_writes_the_motion_of_an_orientation(levelhead, log, tmp_path, suffix):
    """Here the orientation is the simulation's truth, which the log has."""
    recording = lh.read(log)
    track = lh.Track(recording.t, recording.truth.quat, readings=recording)
    assert levelhead("convert", log, "--motion", "-o", tmp_path / f"x.{suffix}").code == 0
    wanted = track.linear_acceleration().value[:, 1]
    if suffix == "mcap":
        every = [one for _, one in messages(tmp_path / "x.mcap")["/imu/linear_acceleration"]]
        found = [one.accel.accel.linear.y for one in every]
    elif suffix == "npz":
        found = load_arrays(tmp_path / "x.npz")["linear_acceleration_y [m/s²]"]
        np.testing.assert_array_equal(lh.read(tmp_path / "x.npz").gyr, recording.gyr)
    elif suffix == "parquet":
        import pyarrow.parquet as pq

        found = pq.read_table(tmp_path / "x.parquet")["linear_acceleration_y [m/s²]"].to_numpy()
    else:
        found = np.genfromtxt(tmp_path / "x.csv", delimiter=",", names=True, deletechars="")[
            "linear_acceleration_y_[m/s²]"
        ]
    np.testing.assert_array_equal(found, wanted)


def test_bad_input(refused, log, tmp_path):
    plain = tmp_path / "plain.npz"
    rec = lh.read(log)
    write_npz(lh.Recording(rec.t, rec.gyr, rec.acc), plain)
    assert "--motion needs an orientation" in refused("convert", plain, "--motion", "-o", tmp_path / "x.csv")
    assert "holds an orientation alone" in refused("convert", log, "--motion", "-o", tmp_path / "x.sto")
    said = refused("fuse", log, "--format", "mcap", "--frame", "ned", "-o", tmp_path)
    assert "a bag has every sample in enu (REP 103)" in said
    assert "leave --output-rate" in refused("fuse", log, "--format", "bag", "--output-rate", "10", "-o", tmp_path)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["plain.npz"]
