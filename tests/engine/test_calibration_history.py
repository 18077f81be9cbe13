"""How knowledge of a sensor grows: looked at on the way, it ends where the run ends."""

import numpy as np
import pytest

import levelhead as lh
from levelhead.engine.calibration_history import POINTS, calibration_history, sample_rows
from levelhead.filters import ESKF


@pytest.fixture(scope="module")
def recording():
    return lh.simulate.recording("LSM6DSO32", "hand", duration=40.0, seed=1, mag="HMC5883L")


@pytest.mark.slow
def test_it_ends_where_the_run_ends_and_passes_where_shorter_runs_end(recording):
    course = calibration_history(recording, ESKF())
    assert len(course.t) == len(course.known) == 40
    np.testing.assert_allclose(np.diff(course.t), 1.0, atol=0.011)
    assert course.known[-1].to_dict() == lh.fuse(recording, ESKF()).calibration.to_dict()
    part = recording[: int(np.searchsorted(recording.t, course.t[14], side="right"))]
    assert course.known[14].to_dict() == lh.fuse(part, ESKF(), engine="python").calibration.to_dict()


def test_sigma_falls_and_the_truth_stays_inside(recording):
    course = calibration_history(recording, ESKF())
    value, sigma = course.series("gyr_bias"), course.series("gyr_bias", "sigma")
    assert value.shape == sigma.shape == (40, 3)
    assert (sigma[-1] < 0.02 * np.radians(5.0)).all() and (sigma[-1] < sigma[0]).all()
    true = np.linalg.solve(recording.meta["true_errors"]["gyr"]["matrix"], recording.truth.bias[0])
    assert (np.abs(value[5:] - true) < 4.0 * sigma[5:]).all()


def test_without_a_magnetometer_there_is_no_course_of_it(recording):
    six = lh.Recording(recording.t, recording.gyr, recording.acc)
    course = calibration_history(six, ESKF())
    assert np.isnan(course.series("mag_offset")).all() and course.series("acc_bias").shape == (40, 3)
    mag = recording.mag.copy()
    mag[:1000] = np.nan
    late = calibration_history(lh.Recording(recording.t, recording.gyr, recording.acc, mag), ESKF()).series(
        "mag_offset"
    )
    assert np.isnan(late[:8]).all() and np.isfinite(late[12:]).all()


def test_looks_are_few_and_end_with_the_recording():
    t = np.arange(0.0, 100_000.0, 0.5)
    rows = sample_rows(t, 1.0)
    assert POINTS - 2 <= len(rows) <= POINTS + 1 and rows[-1] == len(t)
    assert sample_rows(np.array([3.0]), 1.0).tolist() == [1]
    gap = sample_rows(np.array([0.0, 0.5, 50.0, 50.5]), 1.0)
    assert gap[-1] == 4 and (np.diff(gap) > 0).all()


def test_refusals(recording):
    with pytest.raises(lh.LevelheadError, match="EKF learns no calibration; ESKF does"):
        calibration_history(recording, lh.EKF())
    with pytest.raises(lh.LevelheadError, match="every is 0.0"):
        calibration_history(recording, ESKF(), every=0.0)
