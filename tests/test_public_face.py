"""The Python face: the lines of the docstring as written, names, and what Recording and Track promise and refuse."""

import dataclasses
import re
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.recording import real_array
from levelhead.sources.formats.csv_writer import write_csv

T = np.arange(5) * 0.01
GYR = np.zeros((5, 3))
ACC = np.tile([0.0, 0.0, 9.81], (5, 1))
QUAT = np.tile([1.0, 0.0, 0.0, 0.0], (5, 1))


def refused(make, *arguments, **keywords) -> str:
    with pytest.raises(lh.LevelheadError) as caught:
        make(*arguments, **keywords)
    assert "\n" not in str(caught.value)
    return str(caught.value)


# The docstring


def docstring_program() -> str:
    """The indented lines of the package's docstring, without the remarks to their right."""
    lines = [line.strip() for line in str(lh.__doc__).splitlines() if line.startswith("    ")]
    return "\n".join(re.split(r"\s{4,}", line)[0] for line in lines)


@pytest.mark.compiled
def test_the_lines_of_the_docstring_work_as_written(tmp_path, monkeypatch):
    write_csv(lh.simulate.recording("BMI160", "hand", duration=5.0), tmp_path / "flight.csv")
    monkeypatch.chdir(tmp_path)
    program = docstring_program()
    assert len(program.splitlines()) == 7 and 'lh.read("flight.csv")' in program
    names = {"g": (0.0, 0.1, 0.0), "a": (0.0, 0.0, 9.81)}
    exec(program, names)
    rec, track, table, quat = (names[name] for name in ("rec", "track", "table", "quat"))
    assert isinstance(rec, lh.Recording) and rec.mag is None and rec.truth is not None
    assert isinstance(track, lh.Track) and track.quat.shape == (500, 4) and track.params == lh.Kalman(r_measure=0.1)
    assert track.bias is not None and track.sigma is not None and track.health.shape == (500,)
    assert "Complementary" in str(table) and "Kalman" in str(table) and "total [°]" in str(table)
    assert len(quat) == 4 and np.linalg.norm(quat) == pytest.approx(1.0, abs=1e-12)


def test_everything_named_is_there():
    for name in lh.__all__:
        assert getattr(lh, name) is not None
        assert name in dir(lh)


@pytest.mark.parametrize("wrong, right", [("Kalmann", "Kalman"), ("fues", "fuse"), ("record", "Recording")])
def test_a_wrong_name_gets_the_nearest(wrong, right):
    with pytest.raises(AttributeError, match=f"levelhead has no '{wrong}'; did you mean '{right}'"):
        getattr(lh, wrong)


def test_import_costs_nothing():
    program = "import levelhead, sys; print(sorted({'numpy', 'numba', 'scipy', 'matplotlib'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# Recording


def test_recording_is_frozen_and_so_are_its_arrays():
    rec = lh.Recording(T, GYR, ACC, np.ones((5, 3)), lh.Truth(QUAT))
    with pytest.raises(dataclasses.FrozenInstanceError):
        rec.t = T  # type: ignore[misc]
    for array in (rec.t, rec.gyr, rec.acc, rec.mag, rec.truth.quat):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    GYR[0] = 0.0  # what the caller holds stays writable


def test_lists_and_integers_are_welcome():
    rec = lh.Recording([0, 1], [[0, 0, 0]] * 2, [[0, 0, 10]] * 2)
    assert rec.t.dtype == rec.gyr.dtype == np.float64 and rec.rate == 1.0


@pytest.mark.parametrize(
    "t, said",
    [
        ([], "the recording is empty"),
        ([[0.0, 1.0]], "t has shape (1, 2); expected (n,) in s"),
        ([0.0, 0.1, 0.1, 0.2, 0.3], "t does not increase at row 2: 0.1 s after 0.1 s"),
        ([0.0, 0.1, 0.05, 0.2, 0.3], "t does not increase at row 2: 0.05 s after 0.1 s"),
        ([0.0, np.nan, 0.2, 0.3, 0.4], "t is NaN at row 1; expected a time in s"),
        ([0.0, 0.1, 0.2, 0.3, np.inf], "t is infinite at row 4; expected finite values in s"),
        (["0", "1"], "expected real numbers in s"),
        (None, "expected real numbers in s"),
    ],
)
def test_time_is_checked(t, said):
    assert said in refused(lh.Recording, t, GYR, ACC)


@pytest.mark.parametrize(
    "name, unit, full",
    [("gyr", "rad/s", "gyroscope"), ("acc", "m/s²", "accelerometer"), ("mag", "µT", None)],
)
def test_sensors_are_checked_with_field_row_and_unit(name, unit, full):
    def said(values) -> str:
        return refused(lh.Recording, **({"t": T, "gyr": GYR, "acc": ACC} | {name: values}))

    assert said(np.zeros((5, 4))) == f"{name} has shape (5, 4); expected (n, 3) in {unit}"
    assert said(np.zeros(15)) == f"{name} has shape (15,); expected (n, 3) in {unit}"
    assert said(np.zeros((4, 3))) == f"{name} has 4 rows, but t has 5; expected one row in {unit} per stamp"
    assert said(np.zeros((5, 3), complex)) == f"{name} holds complex128 values; expected real numbers in {unit}"
    assert said(np.zeros((5, 3), bool)) == f"{name} holds bool values; expected real numbers in {unit}"
    assert said(np.zeros((5, 3), object)) == f"{name} holds object values; expected real numbers in {unit}"
    assert said([["1", "2", "3"]] * 5).endswith(f"expected real numbers in {unit}")
    assert said([[1.0, 2.0, 3.0], [1.0, 2.0]]) == f"{name} has rows of different lengths; expected (n, 3) in {unit}"
    infinite = np.zeros((5, 3))
    infinite[3, 1] = -np.inf
    assert said(infinite).startswith(f"{name} is infinite at row 3; expected finite values in {unit}")
    if full is not None:
        assert said(None) == f"there is no {full}; expected {name} of shape (n, 3) in {unit}"


def test_truth_is_checked():
    assert "norm 2 at row 3" in refused(lh.Truth, np.diag([1.0, 1.0, 1.0, 2.0]))
    assert "truth.quat has shape (5, 3)" in refused(lh.Truth, GYR)
    assert "truth.bias has shape (4, 3); expected (5, 3) in rad/s" in refused(lh.Truth, QUAT, GYR[:4])
    assert "truth.moving has shape (4,)" in refused(lh.Truth, QUAT, moving=[True] * 4)
    assert refused(lh.Recording, T[:4], GYR[:4], ACC[:4], truth=lh.Truth(QUAT)) == "truth has 5 rows, but t has 4"
    nearly = lh.Truth(QUAT * 1.005).quat
    np.testing.assert_allclose(np.linalg.norm(nearly, axis=1), 1.0, atol=1e-15)
    blind = lh.Truth(np.full((5, 4), np.nan))
    assert np.isnan(blind.quat).all()


def test_valid_rows_rate_duration_and_words():
    gyr, acc, mag = GYR.copy(), ACC.copy(), np.full((5, 3), np.nan)
    gyr[1, 2] = acc[3, 0] = np.nan
    rec = lh.Recording([0.0, 0.01, 0.02, 0.5, 0.51], gyr, acc, mag)
    assert rec.valid.tolist() == [True, False, True, False, True]  # the magnetometer does not count
    assert rec.rate == pytest.approx(100.0) and rec.duration == 0.51 and len(rec) == 5
    assert repr(rec) == "Recording(5 samples, 0.5 s at 100.0 Hz: gyr, acc, mag; 2 incomplete rows)"
    assert lh.Recording([7.0], GYR[:1], ACC[:1]).rate == 0.0


def test_slicing_keeps_everything_together():
    moving = np.array([True, False, True, False, True])
    rec = lh.Recording(T, GYR, ACC, ACC, lh.Truth(QUAT, GYR, moving, north=False), {"source": "a test"})
    part = rec[1:4]
    assert part.t.tolist() == T[1:4].tolist() and len(part.gyr) == len(part.acc) == len(part.mag) == 3
    assert part.truth.moving.tolist() == [False, True, False] and not part.truth.north
    assert len(part.truth.bias) == 3 and part.meta["source"] == "a test"
    assert "empty" in refused(lambda: rec[5:])


def test_real_array_takes_what_it_can_without_a_copy():
    values = np.zeros((4, 3))
    assert np.shares_memory(real_array("gyr", values, (None, 3), "rad/s"), values)
    assert values.flags.writeable


# Track


def random_track(n: int = 50) -> lh.Track:
    quat = Rotation.random(n, random_state=3).as_quat(scalar_first=True)
    return lh.Track(np.arange(n) * 0.01, quat)


def test_track_is_frozen_and_checked():
    track = random_track(5)
    with pytest.raises(dataclasses.FrozenInstanceError):
        track.quat = QUAT  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        track.quat[0] = 1.0
    assert "quat has shape (4, 4); expected (5, 4) in unit quaternions wxyz" in refused(lh.Track, T, QUAT[:4])
    assert "bias has shape (5, 2); expected (5, 3) in rad/s" in refused(lh.Track, T, QUAT, np.zeros((5, 2)))
    assert "sigma has shape (4, 3); expected (5, 3) in rad" in refused(lh.Track, T, QUAT, sigma=GYR[:4])
    assert "t does not increase at row 1" in refused(lh.Track, T[::-1], QUAT)
    assert track.health.tolist() == [0] * 5 and track.bias is None and track.sigma_tilt is None


def test_a_filter_knows_its_name():
    rec = lh.Recording(T, GYR, ACC)
    assert repr(lh.fuse(rec, lh.Kalman(r_measure=4))) == "Track(Kalman(r_measure=4), 5 samples)"
    assert lh.fuse(rec, "complementary").name == "Complementary"
    assert "did you mean 'Kalman'" in refused(lh.fuse, rec, "Kalmann")
    assert "levelhead.read(path) makes one" in refused(lh.fuse, "flight.csv")


def test_euler_is_intrinsic_zyx():
    track = random_track()
    yaw, pitch, roll = Rotation.from_quat(track.quat, scalar_first=True).as_euler("ZYX", degrees=True).T
    np.testing.assert_allclose(track.euler(), np.stack([roll, pitch, yaw], axis=1), atol=1e-9)
    np.testing.assert_allclose(track.euler(degrees=False), np.radians(track.euler()), atol=1e-12)


def test_rotation_and_xyzw():
    track = random_track()
    rotation = track.as_rotation()
    np.testing.assert_allclose(rotation.apply([0.0, 0.0, 1.0]), Rotation.from_quat(
        track.quat[:, [1, 2, 3, 0]]).apply([0.0, 0.0, 1.0]), atol=1e-12)  # fmt: skip
    xyzw = rotation.as_quat()
    sign = np.sign((xyzw[:, [3, 0, 1, 2]] * track.quat).sum(axis=1, keepdims=True))
    np.testing.assert_allclose(sign * xyzw[:, [3, 0, 1, 2]], track.quat, atol=1e-12)


def test_ned_by_hand():
    """A vector known in the body as (forward, left, up) is (forward, right, down) there, and NED swaps the earth."""
    track = random_track()
    forward, left, up = 0.3, -0.7, 0.2
    east, north, high = track.as_rotation("ENU").apply([forward, left, up]).T
    ned = track.as_rotation("NED").apply([forward, -left, -up])
    np.testing.assert_allclose(ned, np.stack([north, east, -high], axis=1), atol=1e-12)


def test_ned_of_known_attitudes():
    east, north = [1.0, 0.0, 0.0, 0.0], [np.cos(np.pi / 4), 0.0, 0.0, np.sin(np.pi / 4)]
    up = [np.cos(np.pi / 8), 0.0, -np.sin(np.pi / 8), 0.0]  # nose up by 45°, to the east
    ned = lh.Track([0.0, 1.0, 2.0], [east, north, up]).as_rotation("NED").as_euler("ZYX", degrees=True)
    np.testing.assert_allclose(ned, [[90.0, 0.0, 0.0], [0.0, 0.0, 0.0], [90.0, 45.0, 0.0]], atol=1e-9)


def test_another_frame_is_refused():
    assert "did you mean 'NED'" in refused(random_track().as_rotation, "ned ")


def test_doubt_of_tilt_and_heading():
    track = lh.Track(T, QUAT, sigma=np.tile([0.3, 0.4, 2.0], (5, 1)))
    np.testing.assert_allclose(track.sigma_tilt, 0.5)
    np.testing.assert_array_equal(track.sigma_heading, 2.0)
