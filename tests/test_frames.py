"""Frames, mountings, Euler sequences, tare and heading, held against SciPy's rotations and Monte Carlo."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.axis_map import AxisMap

TO_ENU = {
    "ENU": np.eye(3),
    "NED": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    "NWU": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}
TO_FLU = {"ENU": np.eye(3), "NED": np.diag([1.0, -1.0, -1.0]), "NWU": np.eye(3)}


def track(n=20, seed=1, **more):
    random = np.random.default_rng(seed)
    quat = Rotation.random(n, random_state=seed).as_quat(scalar_first=True)
    columns = {name: random.random((n, 3)) for name in ("bias", "sigma", "position", "velocity", "sigma_position")}
    return lh.Track(0.1 * np.arange(n), quat, **columns | more)


@pytest.mark.parametrize("frame", ["NED", "NWU"])
def test_a_frame_turns_all_vectors_and_back(frame):
    enu = track()
    found = enu.to_frame(frame.lower())
    expected = TO_ENU[frame].T @ enu.as_rotation().as_matrix() @ TO_FLU[frame]
    np.testing.assert_allclose(found.as_rotation().as_matrix(), expected, atol=1e-14)
    np.testing.assert_array_equal(found.position, enu.position @ TO_ENU[frame])
    np.testing.assert_array_equal(found.bias, enu.bias @ TO_FLU[frame])
    np.testing.assert_array_equal(found.sigma, enu.sigma @ np.abs(TO_ENU[frame]))
    assert found.frame == frame and found.to_frame(frame) is found
    again = found.to_frame("NWU" if frame == "NED" else "NED").to_frame("ENU")
    np.testing.assert_allclose(np.abs(np.sum(again.quat * enu.quat, axis=1)), 1.0, atol=1e-14)
    np.testing.assert_array_equal(again.velocity, enu.velocity)


@pytest.mark.parametrize("sequence", ["ZXY", "zxy", "XYX", "zyx", "YZY"])
@pytest.mark.parametrize("frame", [None, "NED"])
def test_any_euler_sequence_is_scipys(sequence, frame):
    one = track()
    np.testing.assert_array_equal(
        one.euler(sequence, frame=frame), one.as_rotation(frame).as_euler(sequence, degrees=True)
    )


def test_euler_of_missing_samples_and_at_gimbal_lock():
    quat = np.array([[np.nan] * 4, Rotation.from_euler("ZXY", [20, 90, 0], degrees=True).as_quat(scalar_first=True)])
    angles = lh.Track([0.0, 1.0], quat).euler("ZXY")
    assert np.isnan(angles[0]).all()
    np.testing.assert_allclose(angles[1], [20.0, 90.0, 0.0], atol=1e-6)


@pytest.mark.parametrize(
    "text, expected",
    [
        ("ZYX:90,0,10", Rotation.from_euler("ZYX", [90, 0, 10], degrees=True)),
        ("zxy:30,-20,170", Rotation.from_euler("zxy", [30, -20, 170], degrees=True)),
        ("X:180", Rotation.from_euler("X", 180, degrees=True)),
        ("0.5,0.5,-0.5,0.5", Rotation.from_quat([0.5, 0.5, -0.5, 0.5], scalar_first=True)),
        ("-y,x,z", Rotation.from_matrix([[0, -1, 0], [1, 0, 0], [0, 0, 1]])),
    ],
)
def test_a_mounting_is_scipys_rotation(text, expected):
    found = AxisMap.parse(text)
    np.testing.assert_allclose(found.matrix, expected.as_matrix(), atol=1e-15)
    assert AxisMap.parse(str(found)) == found or np.allclose(AxisMap.parse(str(found)).matrix, found.matrix, atol=1e-15)
    np.testing.assert_allclose(found.turn((1.0, 2.0, 3.0)), expected.apply([1.0, 2.0, 3.0]), atol=1e-14)


def test_a_quarter_turn_by_angles_is_that_by_letters():
    assert AxisMap.parse("Z:90") == AxisMap.parse("-y,x,z") and str(AxisMap.parse("Z:90")) == "-y,x,z"


@pytest.mark.parametrize(
    "text, said",
    [
        ("ZZY:1,2,3", "none twice in a row"),
        ("ZYx:1,2,3", "the sequence 'ZYx'"),
        ("ZYX:1,2", "not 3 numbers"),
        ("1,2,3", "not 4 numbers"),
        ("0,0,0,0", "not a quaternion"),
        ("nan,0,0,1", "are none"),
        ("ZYX:1,inf,2", "not 3 numbers"),
    ],
)
def test_no_mounting(text, said):
    with pytest.raises(lh.LevelheadError, match=said):
        AxisMap.parse(text)


def test_a_mounted_sensor_gives_the_track_of_the_body():
    body = lh.simulate.recording("ICM-20948", "hand", duration=8.0, seed=3)
    mounting = AxisMap.parse("ZYX:50,-30,100")
    r = mounting.matrix  # sensor to body
    sensor = lh.Recording(body.t, body.gyr @ r, body.acc @ r, body.mag @ r)
    found = lh.fuse(sensor).mount("ZYX:50,-30,100")
    plain = lh.fuse(body)
    angle = (found.as_rotation() * plain.as_rotation().inv()).magnitude()
    assert np.degrees(angle.max()) < 0.2, "only the axes of the guard's detectors and of rounding differ"
    np.testing.assert_allclose(found.bias, plain.bias, atol=2e-3)
    with pytest.raises(lh.LevelheadError, match="once"):
        found.mount("x,y,z")
    turned = mounting.rotate(sensor)
    np.testing.assert_allclose(turned.acc, body.acc, atol=1e-12)


def test_errors_do_not_depend_on_frame_and_mounting():
    rec = lh.simulate.recording("ICM-20948", "hand", duration=8.0, seed=3)
    plain = lh.fuse(rec)
    score = lh.evaluate.evaluate(rec, plain)
    again = lh.evaluate.evaluate(rec, plain.mount("ZYX:50,-30,100").to_frame("NED"))
    assert again.total == pytest.approx(score.total, rel=1e-9) and again.bias == pytest.approx(score.bias, rel=1e-9)


def test_relative_to_a_pose_with_sigma_by_monte_carlo():
    random, sigma = np.random.default_rng(2), np.array([[0.01, 0.02, 0.03], [0.02, 0.01, 0.05]])
    poses = Rotation.random(2, random_state=4)
    found = lh.Track([0.0, 1.0], poses.as_quat(scalar_first=True), sigma=sigma).relative_to(0.0)
    np.testing.assert_allclose(found.as_rotation()[0].magnitude(), 0.0, atol=1e-12)
    true = poses[0].inv() * poses[1]
    np.testing.assert_allclose(found.as_rotation()[1].as_matrix(), true.as_matrix(), atol=1e-12)
    first, second = (Rotation.from_rotvec(random.normal(0.0, s, (40_000, 3))) for s in sigma)
    errors = ((first * poses[0]).inv() * (second * poses[1]) * true.inv()).as_rotvec()
    np.testing.assert_allclose(found.sigma[1], errors.std(axis=0), rtol=0.02)
    assert found.frame == "POSE"
    with pytest.raises(lh.LevelheadError, match="relative to one of its poses"):
        found.to_frame("NED")


@pytest.mark.parametrize("frame", ["ENU", "NED", "NWU"])
def test_a_heading_is_the_yaw_in_the_frame(frame):
    one = track(declination=0.1).to_frame(frame)
    found = one.with_heading(33.0, t=0.5, sigma=2.0)
    assert found.euler()[5, 2] == pytest.approx(33.0, abs=1e-9) and found.declination is None
    np.testing.assert_allclose(found.euler()[:, :2], one.euler()[:, :2], atol=1e-9)
    up = np.sqrt(one.sigma[:, 2] ** 2 + one.sigma[5, 2] ** 2 + np.radians(2.0) ** 2)
    np.testing.assert_allclose(found.sigma[:, 2], up)
    np.testing.assert_allclose(np.linalg.norm(found.position, axis=1), np.linalg.norm(one.position, axis=1))


def test_no_heading_where_the_nose_is_vertical():
    up = Rotation.from_euler("y", -90, degrees=True).as_quat(scalar_first=True)
    with pytest.raises(lh.LevelheadError, match="x axis is vertical"):
        lh.Track([0.0], [up]).with_heading(0.0)
    with pytest.raises(lh.LevelheadError, match="expected a stamp from 0 to 1.9"):
        track().relative_to(7.0)
    with pytest.raises(lh.LevelheadError, match="'SWU' is not an earth frame"):
        track().to_frame("SWU")


def test_files_name_frame_and_axes(tmp_path):
    import pyarrow.parquet as pq

    from levelhead.publish import write_track

    one = track().mount("-y,x,z").to_frame("NED")
    write_track(one, tmp_path / "a.parquet")
    table = pq.read_table(tmp_path / "a.parquet")
    said = {key.decode(): value.decode() for key, value in table.schema.metadata.items() if key != b"ARROW:schema"}
    assert said["frame"] == "NED" and said["axes"] == "-y,x,z"
    assert said["orientation"] == "quaternion wxyz, body to earth; earth x magnetic north, y east, z down"
    np.testing.assert_array_equal(table["ned_qw"], one.quat[:, 0])
    np.testing.assert_array_equal(table["sigma_down [rad]"], one.sigma[:, 2])
    write_track(one, tmp_path / "a.csv")
    assert "ned_qw,ned_qx,ned_qy,ned_qz,ned_roll [deg]" in (tmp_path / "a.csv").read_text()
    again = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(again[:, 1:5], one.quat)
